#pragma once

#include <optional>
#include <string>

#include "client/render/stage.hpp"
#include "client/viewer/drawing/mouse_controller.hpp"
#include "client/viewer/drawing/orbit_camera.hpp"
#include "client/viewer/drawing/overlays.hpp"
#include "client/viewer/offline/recorder.hpp"
#include "client/viewer/sources/live_room.hpp"
#include "client/viewer/sources/local_world.hpp"
#include "client/viewer/sources/scene_list.hpp"
#include "client/viewer/window/adaptive_quality.hpp"
#include "client/viewer/window/time_graph.hpp"

namespace hairnet::viewer {

// All that a window's keys, sliders and buttons change.
struct ViewState {
  OrbitCamera camera;
  MouseController mouse;
  Overlays overlays;
  render::Look look;
  AdaptiveQuality adaptive_quality;
  bool adapts_quality = true;  // lowers quality when pictures are slow
  Timings timings;
  std::optional<std::uint64_t> chosen;  // none: all
  bool follows = true;                  // the camera goes along with the chosen one, or the middle of all
  bool camera_chosen = false;           // the user has moved the camera since it last framed all characters
  bool controls_shown = true, keys_shown = false;
  SceneList::Choice scene;
  bool scene_wanted = false;                        // the scene chosen is to be made
  bool given_wanted = false;                        // or that of the command line
  bool frame_wanted = true;                         // the camera must frame all characters again
  bool video_wanted = false, trace_wanted = false;  // begin or end one
  float still_wind_deg = 0;                         // direction of the wind while its speed is 0
  std::string fault;                                // of what was asked for last; one line
};

// The controls of a picture, drawn and obeyed. `world` or `room`: whichever the show is.
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

// `pressed`: keys as GLFW names them.
void take_keys(std::span<const int> pressed, ViewState& state, Controls& controls);
void draw_controls(ViewState& state, Controls& controls);
// The next subject after the chosen one, `by` 1 or -1; past the last: all.
std::optional<std::uint64_t> cycled(std::span<const ViewedCharacter> viewed, std::optional<std::uint64_t> chosen,
                                    int by);

}  // namespace hairnet::viewer
