#include "client/viewer/window/viewer_window.hpp"

#include <GLES3/gl3.h>
#include <imgui.h>

#include <algorithm>
#include <cmath>
#include <memory>
#include <utility>

#include "client/draw/draw_detail.hpp"
#include "client/render/overlay.hpp"
#include "client/render/picture.hpp"
#include "client/tools/command_line/stop_signal.hpp"
#include "client/viewer/characters/load_characters.hpp"
#include "client/viewer/drawing/framing.hpp"
#include "client/viewer/drawing/render_list.hpp"
#include "client/viewer/window/controls.hpp"
#include "client/viewer/window/window.hpp"
#include "schema/channel/monotonic_clock.hpp"

namespace hairnet::viewer {
namespace {

// What a newcomer sees first: hair that shows its motion.
constexpr const char* kFirstHair = "long_curly";
constexpr const char* kFirstMotion = "dance";
// Heads within this distance of the view are reported as seen, m. Servers do not simulate unseen hair, and hair that
// comes into view should move already.
constexpr double kComingIntoView_m = 2;

double ms_since(std::int64_t began_ns) {
  return 1e-6 * static_cast<double>(channel::monotonic_ns() - began_ns);
}

Vec3f colour_of_level(const ViewedCharacter& character) {
  return level_colour(character.level);
}

// The index of the name, which must be in the list.
int index_of(const std::vector<std::string>& names, const char* name) {
  return static_cast<int>(std::max<std::ptrdiff_t>(0, std::find(names.begin(), names.end(), name) - names.begin()));
}

// ImGui counts points; drawing and picking count the framebuffer's pixels.
MouseInput mouse_now(double pixels_per_point) {
  const ImGuiIO& io = ImGui::GetIO();
  MouseInput mouse;
  mouse.x_px = pixels_per_point * static_cast<double>(io.MousePos.x);
  mouse.y_px = pixels_per_point * static_cast<double>(io.MousePos.y);
  mouse.right_px = pixels_per_point * static_cast<double>(io.MouseDelta.x);
  mouse.down_px = pixels_per_point * static_cast<double>(io.MouseDelta.y);
  mouse.wheel = static_cast<double>(io.MouseWheel);
  mouse.left = io.MouseDown[0];
  mouse.right = io.MouseDown[1];
  mouse.middle = io.MouseDown[2];
  mouse.shift = io.KeyShift;
  mouse.ctrl = io.KeyCtrl;
  // ImGui wants the mouse when it is over a panel.
  mouse.elsewhere = io.WantCaptureMouse;
  return mouse;
}

// The GPU data; must be destroyed before the window, which owns the context. The stage comes first, since the list
// refers to it.
struct Drawer {
  Drawer(std::unique_ptr<render::Stage> s, render::Picture p, std::unique_ptr<render::Overlay> o)
      : stage(std::move(s)), picture(std::move(p)), overlay(std::move(o)), render_list(*stage) {}
  std::unique_ptr<render::Stage> stage;
  render::Picture picture;
  std::unique_ptr<render::Overlay> overlay;
  RenderList render_list;
  render::Drawing drawing;
  std::vector<std::uint8_t> pixels;

  static Result<std::unique_ptr<Drawer>> create() {
    Result<std::unique_ptr<render::Stage>> stage = render::Stage::create();
    if (!stage) return Refusal(stage.error());
    Result<render::Picture> picture = render::Picture::build();
    if (!picture) return Refusal(picture.error());
    Result<std::unique_ptr<render::Overlay>> overlay = render::Overlay::create();
    if (!overlay) return Refusal(overlay.error());
    return std::make_unique<Drawer>(std::move(*stage), std::move(*picture), std::move(*overlay));
  }
};

// A window that shows a local world or a server's room.
class ViewerWindow {
 public:
  ViewerWindow(const ViewOptions& options, Window& window, Drawer& drawer)
      : options_(options), window_(window), drawer_(drawer) {}

  Result<void> run_local(const std::vector<CharacterSetup>& characters) {
    // A clip that loops without an end must not jump at each round.
    LocalWorld world({options_.tick_rate_hz, options_.duration_s,
                      std::isfinite(options_.duration_s) ? Loop::plain : Loop::smooth, options_.wind.value_or(Wind{}),
                      channel::monotonic_ns});
    world.on_tick([&] { recorder_.add_tick(world); });
    // The hand moves in the world's ticks, not in pictures, so that the mechanics sees an even motion.
    world.touch_by([&](double from_s, double to_s) { return state_.hand.tick(to_s - from_s, world); });
    SceneList scenes(characters);
    state_.scene.hair = index_of(scenes.hair(), kFirstHair);
    state_.scene.motion = index_of(scenes.motions(), kFirstMotion);
    state_.scene_wanted = characters.empty();
    state_.given_wanted = !characters.empty();
    Controls controls{world, &world, nullptr, &scenes, recorder_, drawer_.stage->statistics(), {}};
    while (goes_on() && world.time_s() < options_.duration_s + options_.settle_s) {
      if (std::exchange(state_.given_wanted, false)) fill(scenes.given(), world);
      if (std::exchange(state_.scene_wanted, false)) fill(scenes.make(state_.scene), world);
      // Levels come from the builder's thread when they are built; hair is rigid until then.
      for (const auto& groom : world.grooms_without_levels()) {
        if (const auto levels = builder_.levels_of(groom)) world.give_levels(*groom, levels);
      }
      controls.busy = builder_.status();
      if (Result<void> drawn = draw_picture(controls); !drawn) return drawn;
      take_timings(world);
    }
    return finish();
  }

  Result<void> run_room(const std::vector<CharacterSetup>& characters) {
    // A refusal is shown in the panel; the window stays open.
    LiveRoom room(options_, characters, true);
    if (Result<void> opened = room.open(); !opened) return opened;
    Controls controls{room, nullptr, &room, nullptr, recorder_, drawer_.stage->statistics(), {}};
    while (goes_on() && room.clip_time_s(room.now_ns()).value_or(-1) < options_.duration_s + options_.settle_s) {
      // The builder is busy only when an overlay needs the mechanics.
      room.set_level_builder(state_.overlays.need_model() ? &builder_ : nullptr);
      controls.busy = state_.overlays.need_model() ? builder_.status() : std::string();
      if (Result<void> drawn = draw_picture(controls); !drawn) return drawn;
      take_timings(room);
      report_importance(room);
    }
    return finish();
  }

 private:
  [[nodiscard]] bool goes_on() const { return !window_.closing() && !stop_requested(); }

  Result<void> finish() {
    const Result<void> video = recorder_.stop_video(), trace = recorder_.stop_trace();
    return video ? trace : video;
  }

  // A scene that cannot be made leaves the old one.
  void fill(Result<std::vector<LocalCharacter>> characters, LocalWorld& world) {
    state_.error = characters ? "" : characters.error();
    if (!characters) return;
    // Ticks and characters are numbered from the beginning again, and a trace must count from one.
    if (const Result<void> traced = recorder_.stop_trace(); !traced) state_.error = traced.error();
    world.remove_all();
    // The average of pictures would follow heads that are gone.
    drawer_.picture.cut();
    for (LocalCharacter& character : *characters) world.add(std::move(character));
    state_.chosen.reset();
    state_.frame_wanted = true;
  }

  // Handles mouse and keys, advances all characters to this moment, then draws the picture. Input comes first, so that
  // the picture shows what it does.
  Result<void> draw_picture(Controls& controls) {
    window_.begin_picture();
    const std::int64_t now_ns = channel::monotonic_ns();
    // A first picture, or one after a long stop, counts as a second at most.
    const double elapsed_s = std::clamp(1e-9 * static_cast<double>(now_ns - last_ns_), 0.0, 1.0);
    if (last_ns_ != 0) state_.timings.frame_ms.add(static_cast<float>(1e3 * elapsed_s));
    last_ns_ = now_ns;
    take_keys(window_.keys(), state_, controls);
    const int width = window_.width_px(), height = window_.height_px();
    const Vec3 eye = state_.camera.camera().eye;
    MouseInput mouse = mouse_now(window_.pixels_per_point());
    // What the hand takes is not for heads and camera: one press has one effect.
    if (controls.world != nullptr && state_.hand.apply(mouse, *controls.world, state_.camera, width, height))
      mouse.elsewhere = true;
    state_.mouse.apply(mouse, controls.source, state_.camera, width, height);
    // Only the user moves the camera before this line, so a new place is the user's choice.
    state_.camera_chosen = state_.camera_chosen || eye != state_.camera.camera().eye;
    if (const auto chosen = state_.mouse.take_chosen()) state_.chosen = chosen;
    if (Result<void> advanced = controls.source.advance(now_ns); !advanced) return advanced;
    const std::span<const ViewedCharacter> viewed = controls.source.viewed_characters();
    point_camera(viewed, elapsed_s);

    const std::int64_t began_ns = channel::monotonic_ns();
    drawer_.render_list.set_colour(state_.overlays.levels ? colour_of_level : nullptr);
    const draw::Camera camera = state_.camera.camera();
    drawer_.picture.draw(*drawer_.stage, drawer_.render_list.show(viewed), camera, adaptive_look(elapsed_s), width,
                         height);
    drawer_.drawing.clear();
    draw_overlays(state_.overlays, viewed, state_.chosen, drawer_.drawing);
    if (state_.hand.action() == MouseHand::Action::stroke)
      draw_ball(state_.hand.place(), MouseHand::kBallRadius_m, state_.camera, drawer_.drawing);
    // The average has no depths in the window's own buffer; overlays need them.
    if (!drawer_.drawing.empty()) drawer_.picture.copy_depths();
    drawer_.overlay->draw(drawer_.drawing, camera, drawer_.stage->depth_range(), width, height);
    // This is the processor's time: the GPU may still be drawing.
    state_.timings.draw_ms.add(static_cast<float>(ms_since(began_ns)));
    // Read the pixels before the panels are drawn over them.
    keep_picture(now_ns, width, height);
    draw_controls(state_, controls);
    obey_recording(width, height);
    window_.end_picture();
    return {};
  }

  render::Look adaptive_look(double elapsed_s) {
    render::Look look = state_.look;
    // It learns from each picture, also when it is not applied.
    const double share = state_.adaptive_quality.take(1e3 * elapsed_s);
    if (state_.adapts_quality) look.quality *= static_cast<float>(share);
    return look;
  }

  void point_camera(std::span<const ViewedCharacter> viewed, double elapsed_s) {
    // Frame all characters when one comes or goes, unless the user has moved the camera.
    if (std::exchange(framed_count_, viewed.size()) != viewed.size() && !state_.camera_chosen)
      state_.frame_wanted = true;
    if (state_.frame_wanted && !viewed.empty()) {
      // Frames them in the part beside the panel.
      const double panel_px =
          state_.controls_shown ? window_.pixels_per_point() * static_cast<double>(kPanelWidth) : 0.0;
      const int left_px = std::max(window_.width_px() / 3, window_.width_px() - static_cast<int>(panel_px));
      frame_all(viewed, options_.views.front(), left_px, window_.height_px(), state_.camera);
      // The target moves half of the panel's width, so that the heads stand in the middle of the free part.
      state_.camera.pan(0.5 * (window_.width_px() - left_px), 0, window_.height_px());
      state_.frame_wanted = state_.camera_chosen = false;
    }
    std::optional<Vec3> followed = state_.follows ? middle_of(viewed) : std::nullopt;
    for (const ViewedCharacter& character : viewed) {
      if (state_.follows && state_.chosen == character.id) followed = head_middle(character.pose);
    }
    // Do not follow a grabbed head: the camera would move with it, and the mouse ray with the camera. The head would
    // then run away from the mouse.
    if (state_.mouse.grabbed()) followed.reset();
    // Another character is followed without a jump: its first place is only noted.
    if (followed_last_ != state_.chosen) state_.camera.follow({}, 0);
    followed_last_ = state_.chosen;
    state_.camera.follow(followed, elapsed_s);
  }

  // Records the scene without its controls, when the video wants a picture.
  void keep_picture(std::int64_t now_ns, int width, int height) {
    if (!recorder_.wants_picture(now_ns)) return;
    // A video has one size.
    if (width != recorder_.width() || height != recorder_.height()) {
      note(recorder_.stop_video(), "the window has changed its size, and the video is ended");
      return;
    }
    drawer_.pixels.resize(std::size_t{4} * static_cast<std::size_t>(width) * static_cast<std::size_t>(height));
    glPixelStorei(GL_PACK_ALIGNMENT, 1);
    glReadPixels(0, 0, width, height, GL_RGBA, GL_UNSIGNED_BYTE, drawer_.pixels.data());
    if (const Result<void> added = recorder_.add_picture(drawer_.pixels, now_ns); !added) state_.error = added.error();
  }

  // Panels and keys only ask; here the files are begun and ended.
  void obey_recording(int width, int height) {
    if (std::exchange(state_.video_wanted, false))
      note(recorder_.has_video() ? recorder_.stop_video() : recorder_.start_video(width, height), "");
    if (std::exchange(state_.trace_wanted, false))
      note(recorder_.has_trace() ? recorder_.stop_trace() : recorder_.start_trace(), "");
  }

  void note(const Result<void>& done, const char* otherwise) { state_.error = done ? otherwise : done.error(); }

  void take_timings(const LocalWorld& world) {
    for (const LocalTick& tick : world.ticks()) {
      state_.timings.tick_ms.add(static_cast<float>(tick.step_ms));
      state_.timings.step_us.add(
          static_cast<float>(1e3 * tick.step_ms / std::max<std::uint32_t>(1, tick.report.stepped)));
    }
  }

  void take_timings(const LiveRoom& room) {
    state_.timings.latency_ms.add(static_cast<float>(room.latency_ms()));
    const std::int64_t now_ns = channel::monotonic_ns();
    // Rates over less than a quarter of a second would jump between nothing and much.
    if (now_ns - counted_ns_ < 250'000'000) return;
    const std::uint64_t bytes = room.counters().bytes_received;
    const double elapsed_s = 1e-9 * static_cast<double>(now_ns - counted_ns_);
    if (counted_ns_ != 0)
      state_.timings.received_kb_per_s.add(
          static_cast<float>(1e-3 * static_cast<double>(bytes - counted_bytes_) / elapsed_s));
    counted_ns_ = now_ns;
    counted_bytes_ = bytes;
  }

  void report_importance(LiveRoom& room) const {
    const double aspect = static_cast<double>(window_.width_px()) / window_.height_px();
    room.report_importance([&](const Pose& pose) {
      wire::MemberImportance importance;
      const Vec3 middle = head_middle(pose);
      importance.screen_height = static_cast<float>(
          // The protocol refuses larger heights.
          std::min(static_cast<double>(wire::kScreenHeightMax), state_.camera.height_share(middle, draw::kHead_m)));
      importance.in_view = state_.camera.in_view(middle, kComingIntoView_m, aspect);
      return importance;
    });
  }

  const ViewOptions& options_;
  Window& window_;
  Drawer& drawer_;
  ViewState state_;
  WindowRecorder recorder_;
  LevelBuilder builder_;
  // The character that was chosen at the last picture.
  std::optional<std::uint64_t> followed_last_;
  // The number of characters when the camera was last pointed: another number frames all of them again.
  std::size_t framed_count_ = 0;
  // last_ns_ is the time of the last picture. At counted_ns_ the connection had received counted_bytes_.
  std::int64_t last_ns_ = 0, counted_ns_ = 0;
  std::uint64_t counted_bytes_ = 0;
};

}  // namespace

Result<void> run_window(const ViewOptions& options) {
  // The window first: where none can be opened, loading characters would be in vain. Locals are destroyed in reverse,
  // so the window goes last.
  Result<std::unique_ptr<Window>> window = Window::open("hairnet", options.width, options.height);
  if (!window) return Refusal(window.error());
  Result<std::unique_ptr<Drawer>> drawer = Drawer::create();
  if (!drawer) return Refusal(drawer.error());
  const Result<std::vector<CharacterSetup>> characters = load_characters(options);
  if (!characters) return Refusal(characters.error());
  ViewerWindow viewer(options, **window, **drawer);
  return options.source == Source::local ? viewer.run_local(*characters) : viewer.run_room(*characters);
}

}  // namespace hairnet::viewer
