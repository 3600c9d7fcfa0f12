#pragma once

#include <optional>
#include <string>

#include "client/render/stage.hpp"
#include "client/viewer/drawing/mouse_controller.hpp"
#include "client/viewer/drawing/mouse_hand.hpp"
#include "client/viewer/drawing/orbit_camera.hpp"
#include "client/viewer/drawing/overlays.hpp"
#include "client/viewer/offline/recorder.hpp"
#include "client/viewer/sources/live_room.hpp"
#include "client/viewer/sources/local_world.hpp"
#include "client/viewer/sources/scene_list.hpp"
#include "client/viewer/window/adaptive_quality.hpp"
#include "client/viewer/window/time_graph.hpp"

namespace hairnet::viewer {

// Everything that keys, sliders and buttons of a window change.
struct ViewState {
  OrbitCamera camera;
  MouseController mouse;
  MouseHand hand;
  Overlays overlays;
  render::Look look;
  AdaptiveQuality adaptive_quality;
  bool adapts_quality = true;  // lowers quality when pictures are slow
  Timings timings;
  std::optional<std::uint64_t> chosen;  // none: all
  bool follows = true;                  // the camera follows the chosen character, or the mean place of all
  bool camera_chosen = false;           // the user has moved the camera since it last framed all characters
  bool controls_shown = true, keys_shown = false;
  SceneList::Choice scene;
  bool scene_wanted = false;                        // the chosen scene must be made
  bool given_wanted = false;                        // or that of the command line
  bool frame_wanted = true;                         // the camera must frame all characters again
  bool video_wanted = false, trace_wanted = false;  // begin or end one
  float still_wind_deg = 0;                         // direction of the wind while its speed is 0
  std::string fault;                                // the error of the last request; one line
};

// The controls of a picture: draws them and applies their changes. Either `world` or `room` is set, by the kind of the
// source.
struct Controls {
  HairSource& source;
  LocalWorld* world = nullptr;
  LiveRoom* room = nullptr;
  const SceneList* scenes = nullptr;
  const Recorder& recorder;
  const render::StageStatistics& drawn;
  std::string busy;  // the work that the window waits for
};

// Width of the panel, in ImGui's pixels.
inline constexpr float kPanelWidth = 310;

// `pressed`: GLFW's numbers of keys.
void take_keys(std::span<const int> pressed, ViewState& state, Controls& controls);
void draw_controls(ViewState& state, Controls& controls);
// The character after the chosen one, `by` 1 or -1; after the last: all.
std::optional<std::uint64_t> cycled(std::span<const ViewedCharacter> viewed, std::optional<std::uint64_t> chosen,
                                    int by);

}  // namespace hairnet::viewer
