#pragma once

#include <optional>
#include <string>

#include "client/render/stage.hpp"
#include "client/viewer/drawing/mouse_controller.hpp"
#include "client/viewer/drawing/mouse_hand.hpp"
#include "client/viewer/drawing/orbit_camera.hpp"
#include "client/viewer/drawing/overlays.hpp"
#include "client/viewer/offline/window_recorder.hpp"
#include "client/viewer/sources/live_room.hpp"
#include "client/viewer/sources/local_world.hpp"
#include "client/viewer/sources/scene_list.hpp"
#include "client/viewer/window/adaptive_quality.hpp"
#include "client/viewer/window/time_graph.hpp"

namespace hairnet::viewer {

// Everything that keys, sliders and buttons of a window change. Requests that take long, such as a new scene, are flags
// here, which the window handles between two pictures.
struct ViewState {
  OrbitCamera camera;
  MouseController mouse;
  MouseHand hand;
  Overlays overlays;
  render::Look look;
  AdaptiveQuality adaptive_quality;
  // Quality is lowered when pictures are slow.
  bool adapts_quality = true;
  Timings timings;
  // The chosen character; none: all.
  std::optional<std::uint64_t> chosen;
  // The camera follows the chosen character, or the mean place of all.
  bool follows = true;
  // The user has moved the camera since it last framed all characters: it then stays when characters come or go.
  bool camera_chosen = false;
  bool controls_shown = true, keys_shown = false;
  SceneList::Choice scene;
  // The chosen scene must be made.
  bool scene_wanted = false;
  // The scene of the command line must be made.
  bool given_wanted = false;
  // The camera must frame all characters again.
  bool frame_wanted = true;
  // A video or trace must begin, or end if one is running.
  bool video_wanted = false, trace_wanted = false;
  // The direction of the wind while its speed is 0, degrees.
  float still_wind_deg = 0;
  // The error of the last request; one line.
  std::string error;
};

// The parts of a window that its controls draw and change. Either `world` or `room` is set, by the kind of the source.
struct Controls {
  HairSource& source;
  LocalWorld* world = nullptr;
  LiveRoom* room = nullptr;
  const SceneList* scenes = nullptr;
  const WindowRecorder& recorder;
  const render::StageStatistics& drawn;
  // The work that the window waits for, in one line; empty: none.
  std::string busy;
};

// Width of the panel, in ImGui's pixels.
inline constexpr float kPanelWidth = 310;

// Obeys keys. `pressed` has GLFW's numbers of keys that went down since the last picture.
void take_keys(std::span<const int> pressed, ViewState& state, Controls& controls);
// Draws the panels with ImGui and applies what the user changes. Call it between Window::begin_picture and end_picture.
void draw_controls(ViewState& state, Controls& controls);
// The character after the chosen one, `by` 1 or -1; after the last, and before the first: none, which means all.
std::optional<std::uint64_t> cycled(std::span<const ViewedCharacter> viewed, std::optional<std::uint64_t> chosen,
                                    int by);

}  // namespace hairnet::viewer
