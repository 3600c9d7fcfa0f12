#include "client/viewer/window/controls.hpp"

#define GLFW_INCLUDE_NONE
#include <GLFW/glfw3.h>
#include <imgui.h>

#include <algorithm>
#include <array>
#include <cmath>

namespace hairnet::viewer {
namespace {

// The key H shows this list; take_keys() and the mouse's classes do what it says.
constexpr const char* kKeys =
    "left drag on hair     hold it; let go with shift: pin it\n"
    "ctrl, drag on hair    stroke it with a ball\n"
    "P                     let all pinned hair go\n"
    "left drag on a head   turn it (shift first: move it)\n"
    "left drag beside      turn the camera\n"
    "middle, right drag    move the camera\n"
    "wheel                 nearer, further\n"
    "Tab, shift Tab        choose the next, the last\n"
    "F                     follow it or not      A  look at all\n"
    "Space  pause          .  one tick           T  teleport\n"
    "1-6    level          +, -  speed\n"
    "L lattice  S springs  M contacts   C attachments\n"
    "D drag     V level colours          G  timing\n"
    "R      record video   U  controls           H  this";

// The ids of the own characters that a change concerns: the chosen one, or all without a choice. They are copied, since
// a change may change the result of viewed_characters().
std::vector<std::uint64_t> own_chosen(const ViewState& state, const HairSource& source) {
  std::vector<std::uint64_t> ids;
  for (const ViewedCharacter& character : source.viewed_characters()) {
    if (character.own && (!state.chosen || *state.chosen == character.id)) ids.push_back(character.id);
  }
  return ids;
}

void set_level(LevelIndex level, const ViewState& state, HairSource& source) {
  for (const std::uint64_t id : own_chosen(state, source)) source.set_level(id, level);
}

void teleport(const ViewState& state, HairSource& source) {
  for (const std::uint64_t id : own_chosen(state, source)) source.teleport(id);
}

// A list of names to choose from; `index` is the chosen one. Returns whether it has changed. ImGui's own combo wants an
// array of C strings.
bool combo(const char* label, const std::vector<std::string>& names, int& index) {
  bool changed = false;
  if (!ImGui::BeginCombo(label, names[static_cast<std::size_t>(index)].c_str())) return false;
  for (int i = 0; i < static_cast<int>(names.size()); ++i) {
    if (ImGui::Selectable(names[static_cast<std::size_t>(i)].c_str(), i == index)) {
      changed = changed || i != index;
      index = i;
    }
  }
  ImGui::EndCombo();
  return changed;
}

void scene_controls(ViewState& state, Controls& controls) {
  if (controls.scenes == nullptr || !ImGui::CollapsingHeader("Scene", ImGuiTreeNodeFlags_DefaultOpen)) return;
  bool changed = combo("hair", controls.scenes->hair(), state.scene.hair);
  changed |= combo("motion", controls.scenes->motions(), state.scene.motion);
  ImGui::SliderInt("how many", &state.scene.count, 1, SceneList::kCountMax, "%d", ImGuiSliderFlags_Logarithmic);
  // A count is taken when the slider is let go: a scene of each number in between would take long.
  changed |= ImGui::IsItemDeactivatedAfterEdit();
  std::vector<std::string> levels(kLevelNames.begin(), kLevelNames.end());
  levels.emplace_back("each, side by side");
  changed |= combo("level##scene", levels, state.scene.level);
  // The window makes the scene before the next picture, not in the middle of this one.
  state.scene_wanted = state.scene_wanted || changed;
  if (!controls.scenes->given().empty() && ImGui::Button("as the command line says")) state.given_wanted = true;
}

void time_controls(Controls& controls) {
  if (!ImGui::CollapsingHeader("Time", ImGuiTreeNodeFlags_DefaultOpen)) return;
  bool paused = controls.source.paused();
  if (ImGui::Checkbox("pause", &paused)) controls.source.set_paused(paused);
  LocalWorld* world = controls.world;
  if (world == nullptr) return;
  ImGui::SameLine();
  if (ImGui::Button("one tick")) {
    // A single tick means that the world is paused.
    world->set_paused(true);
    world->step_once();
  }
  auto speed = static_cast<float>(world->speed());
  if (ImGui::SliderFloat("speed", &speed, 0.05f, 2, "%.2f", ImGuiSliderFlags_Logarithmic))
    world->set_speed(static_cast<double>(speed));
  auto rate_hz = static_cast<int>(std::lround(world->tick_rate_hz()));
  if (ImGui::SliderInt("ticks a second", &rate_hz, static_cast<int>(LocalWorld::kTickRateMin_hz),
                       static_cast<int>(LocalWorld::kTickRateMax_hz)))
    world->set_tick_rate(std::clamp<double>(rate_hz, LocalWorld::kTickRateMin_hz, LocalWorld::kTickRateMax_hz));
  ImGui::Text("%.2f s", world->time_s());
}

// Sliders for the factors on a character's material. Returns whether one has changed.
bool material_sliders(MaterialScale& scale) {
  bool changed = false;
  ImGui::SameLine();
  if (ImGui::Button("material as built")) {
    scale = {};
    changed = true;
  }
  const auto factor = [&](const char* label, float& value, float least, float most) {
    changed |= ImGui::SliderFloat(label, &value, least, most, "%.2f",
                                  ImGuiSliderFlags_Logarithmic | ImGuiSliderFlags_AlwaysClamp);
  };
  factor("stiffness", scale.stiffness, 0.01f, 100);
  factor("damping", scale.damping, 0, 100);
  factor("density", scale.density, 0.1f, 10);
  factor("ether damping", scale.ether_damping, 0, 100);
  factor("air drag", scale.air_drag, 0, 100);
  factor("gel", scale.gel_per_s2, 0, 10000);
  return changed;
}

void character_controls(ViewState& state, Controls& controls) {
  if (!ImGui::CollapsingHeader("Character", ImGuiTreeNodeFlags_DefaultOpen)) return;
  const std::span<const ViewedCharacter> viewed = controls.source.viewed_characters();
  const auto chosen = std::find_if(viewed.begin(), viewed.end(),
                                   [&](const ViewedCharacter& s) { return state.chosen && s.id == *state.chosen; });
  if (ImGui::BeginCombo("who", chosen == viewed.end() ? "all" : chosen->name.c_str())) {
    if (ImGui::Selectable("all", !state.chosen)) state.chosen.reset();
    for (const ViewedCharacter& character : viewed) {
      // Two characters may have one name, and ImGui tells entries apart by their names. Its ids are ints.
      ImGui::PushID(static_cast<int>(character.id & 0x7fffffff));
      if (ImGui::Selectable(character.name.c_str(), state.chosen == character.id)) state.chosen = character.id;
      ImGui::PopID();
    }
    ImGui::EndCombo();
  }
  ImGui::Checkbox("follow", &state.follows);
  ImGui::SameLine();
  if (ImGui::Button("look at all")) state.frame_wanted = true;
  // Without a choice the panel shows the first own character, and changes all of them.
  const auto own = chosen != viewed.end()
                       ? chosen
                       : std::find_if(viewed.begin(), viewed.end(), [](const ViewedCharacter& s) { return s.own; });
  if (own == viewed.end() || !own->own) {
    ImGui::TextUnformatted(chosen == viewed.end() ? "no own character here" : "another client's: cannot be changed");
    return;
  }
  if (chosen != viewed.end())
    ImGui::Text("shown at level %s", kLevelNames[static_cast<std::size_t>(own->level)].data());
  const std::vector<std::string> levels(kLevelNames.begin(), kLevelNames.end());
  auto level = static_cast<int>(own->level_wanted);
  MaterialScale scale = own->material;
  if (combo("finest level", levels, level)) set_level(static_cast<LevelIndex>(level), state, controls.source);
  if (ImGui::Button("teleport")) teleport(state, controls.source);
  if (!material_sliders(scale)) return;
  for (const std::uint64_t id : own_chosen(state, controls.source)) controls.source.set_material(id, scale);
}

void wind_controls(ViewState& state, Controls& controls) {
  if (!ImGui::CollapsingHeader(controls.room != nullptr ? "Wind of the room" : "Wind")) return;
  Wind wind = controls.source.wind();
  const Vec3& mean = wind.mean_m_per_s;
  // The direction is in degrees from +z towards +x; a radian has 57.29577951 degrees.
  auto speed = static_cast<float>(mean.norm());
  auto towards_deg = speed > 0 ? static_cast<float>(std::atan2(mean.x(), mean.z()) * 57.29577951) : 0.0f;
  auto gust = static_cast<float>(wind.gust_ratio), rough = static_cast<float>(wind.turbulence_rms_m_per_s);
  bool changed = ImGui::SliderFloat("m/s", &speed, 0, 20, "%.1f");
  // Still air has no direction, so the state remembers the slider's value.
  if (wind.mean_m_per_s.isZero()) towards_deg = state.still_wind_deg;
  changed |= ImGui::SliderFloat("towards", &towards_deg, -180, 180, "%.0f deg");
  state.still_wind_deg = towards_deg;
  changed |= ImGui::SliderFloat("gusts", &gust, 0, 1, "%.2f");
  changed |= ImGui::SliderFloat("turbulence", &rough, 0, 5, "%.2f m/s");
  if (!changed) return;
  const double angle = static_cast<double>(towards_deg) / 57.29577951;
  wind.mean_m_per_s = static_cast<double>(speed) * Vec3(std::sin(angle), 0, std::cos(angle));
  wind.gust_ratio = static_cast<double>(gust);
  wind.turbulence_rms_m_per_s = static_cast<double>(rough);
  controls.source.set_wind(wind);
}

void picture_controls(ViewState& state, const Controls& controls) {
  if (!ImGui::CollapsingHeader("Picture")) return;
  ImGui::SliderFloat("exposure", &state.look.exposure, 0.2f, 4, "%.2f", ImGuiSliderFlags_Logarithmic);
  ImGui::SliderFloat("quality", &state.look.quality, 0.1f, 4, "%.2f", ImGuiSliderFlags_Logarithmic);
  ImGui::Checkbox("less when pictures come slowly", &state.adapts_quality);
  if (state.adapts_quality && state.adaptive_quality.share() < 1)
    ImGui::Text("now %.0f %% of it", 100 * state.adaptive_quality.share());
  const render::StageStatistics& drawn = controls.drawn;
  ImGui::Text("%zu strands in %zu calls\n%.1f MB of grooms, %.1f MB of points, %.1f kB a character", drawn.strands,
              drawn.draw_calls, 1e-6 * static_cast<double>(drawn.groom_bytes),
              1e-6 * static_cast<double>(drawn.point_bytes), 1e-3 * static_cast<double>(drawn.character_bytes));
}

void overlay_controls(ViewState& state, const Controls& controls) {
  if (!ImGui::CollapsingHeader("Overlays", ImGuiTreeNodeFlags_DefaultOpen)) return;
  Overlays& o = state.overlays;
  ImGui::Columns(2, nullptr, false);
  ImGui::Checkbox("lattice (L)", &o.lattice);
  ImGui::Checkbox("springs (S)", &o.springs);
  ImGui::Checkbox("attachments (C)", &o.attachments);
  ImGui::Checkbox("contacts (M)", &o.contacts);
  ImGui::NextColumn();
  ImGui::Checkbox("drag (D)", &o.drag);
  ImGui::Checkbox("levels (V)", &o.levels);
  ImGui::Checkbox("timing (G)", &o.timing);
  ImGui::Columns(1);
  if (o.levels) {
    for (std::size_t i = 0; i < kLevelCount; ++i) {
      // The square root is close to sRGB's curve, for colours of a panel.
      const Vec3f c = level_colour(static_cast<LevelIndex>(i)).cwiseSqrt();
      if (i > 0) ImGui::SameLine();
      ImGui::TextColored(ImVec4(c.x(), c.y(), c.z(), 1), "%s", kLevelNames[i].data());
    }
  }
  const std::string missing = missing_models(o, controls.source.viewed_characters(), state.chosen);
  if (!missing.empty()) ImGui::TextWrapped("%s", missing.c_str());
}

void record_controls(ViewState& state, const Controls& controls) {
  if (!ImGui::CollapsingHeader("Record")) return;
  if (ImGui::Button(controls.recorder.has_video() ? "end video" : "video")) state.video_wanted = true;
  if (controls.world != nullptr) {
    ImGui::SameLine();
    if (ImGui::Button(controls.recorder.has_trace() ? "end trace" : "trace of frames")) state.trace_wanted = true;
  }
  if (!controls.recorder.status().empty()) ImGui::TextWrapped("%s", controls.recorder.status().c_str());
}

// A graph of 260 x 44 points, whose range is 10 % above the largest value.
void graph(const char* label, const char* unit, const TimeGraph& graph) {
  char text[64];
  std::snprintf(text, sizeof text, "%s %.2f %s", label, static_cast<double>(graph.newest()), unit);
  ImGui::PlotLines("", graph.values(), TimeGraph::kCount, graph.oldest(), text, 0, std::max(1e-3f, 1.1f * graph.most()),
                   ImVec2(260, 44));
}

void timing_window(const ViewState& state, const Controls& controls) {
  const ImGuiIO& io = ImGui::GetIO();
  ImGui::SetNextWindowPos(ImVec2(io.DisplaySize.x - 8, 8), ImGuiCond_FirstUseEver, ImVec2(1, 0));
  if (ImGui::Begin("Timing", nullptr, ImGuiWindowFlags_AlwaysAutoResize)) {
    graph("picture", "ms", state.timings.frame_ms);
    graph("drawing", "ms", state.timings.draw_ms);
    if (controls.world != nullptr) {
      graph("tick", "ms", state.timings.tick_ms);
      graph("step", "us a character", state.timings.step_us);
    } else {
      graph("pose to frame", "ms", state.timings.latency_ms);
      graph("received", "kB/s", state.timings.received_kb_per_s);
    }
  }
  ImGui::End();
}

}  // namespace

std::optional<std::uint64_t> cycled(std::span<const ViewedCharacter> viewed, std::optional<std::uint64_t> chosen,
                                    int by) {
  const auto count = static_cast<int>(viewed.size());
  // Before the first, or after the last, stands the entry for all.
  int at = by > 0 ? -1 : count;
  for (int i = 0; i < count; ++i) {
    if (chosen == viewed[static_cast<std::size_t>(i)].id) at = i;
  }
  at += by;
  // Beyond either end stands the entry for all again.
  if (at < 0 || at >= count) return {};
  return viewed[static_cast<std::size_t>(at)].id;
}

void take_keys(std::span<const int> keys, ViewState& state, Controls& controls) {
  const auto pressed = [&](int key) { return std::find(keys.begin(), keys.end(), key) != keys.end(); };
  if (pressed(GLFW_KEY_TAB))
    state.chosen = cycled(controls.source.viewed_characters(), state.chosen, ImGui::GetIO().KeyShift ? -1 : 1);
  if (pressed(GLFW_KEY_F)) state.follows = !state.follows;
  if (pressed(GLFW_KEY_A)) state.frame_wanted = true;
  if (pressed(GLFW_KEY_SPACE)) controls.source.set_paused(!controls.source.paused());
  if (pressed(GLFW_KEY_T)) teleport(state, controls.source);
  if (pressed(GLFW_KEY_R)) state.video_wanted = true;
  if (pressed(GLFW_KEY_U)) state.controls_shown = !state.controls_shown;
  if (pressed(GLFW_KEY_H)) state.keys_shown = !state.keys_shown;
  for (int i = 0; i < static_cast<int>(kLevelCount); ++i) {
    if (pressed(GLFW_KEY_1 + i)) set_level(static_cast<LevelIndex>(i), state, controls.source);
  }
  Overlays& o = state.overlays;
  const std::array<std::pair<int, bool*>, 7> toggles{{{GLFW_KEY_L, &o.lattice},
                                                      {GLFW_KEY_S, &o.springs},
                                                      {GLFW_KEY_C, &o.attachments},
                                                      {GLFW_KEY_M, &o.contacts},
                                                      {GLFW_KEY_D, &o.drag},
                                                      {GLFW_KEY_V, &o.levels},
                                                      {GLFW_KEY_G, &o.timing}}};
  for (const auto& [key, flag] : toggles) {
    if (pressed(key)) *flag = !*flag;
  }
  LocalWorld* world = controls.world;
  // The keys below are of a local world.
  if (world == nullptr) return;
  if (pressed(GLFW_KEY_P)) unpin_hair(*world);
  if (pressed(GLFW_KEY_PERIOD)) {
    world->set_paused(true);
    world->step_once();
  }
  // The limits are those of the slider in time_controls().
  if (pressed(GLFW_KEY_EQUAL) || pressed(GLFW_KEY_KP_ADD)) world->set_speed(std::min(2.0, 1.25 * world->speed()));
  if (pressed(GLFW_KEY_MINUS) || pressed(GLFW_KEY_KP_SUBTRACT)) world->set_speed(std::max(0.05, 0.8 * world->speed()));
}

void draw_controls(ViewState& state, Controls& controls) {
  const ImGuiIO& io = ImGui::GetIO();
  if (state.overlays.timing) timing_window(state, controls);
  if (state.keys_shown) {
    ImGui::SetNextWindowPos(ImVec2(0.5f * io.DisplaySize.x, 0.5f * io.DisplaySize.y), ImGuiCond_Always,
                            ImVec2(0.5f, 0.5f));
    if (ImGui::Begin("Keys", &state.keys_shown, ImGuiWindowFlags_AlwaysAutoResize | ImGuiWindowFlags_NoCollapse))
      ImGui::TextUnformatted(kKeys);
    ImGui::End();
  }
  if (!state.controls_shown) return;
  ImGui::SetNextWindowPos(ImVec2(8, 8), ImGuiCond_FirstUseEver);
  ImGui::SetNextWindowSize(ImVec2(kPanelWidth, std::min(720.0f, io.DisplaySize.y - 16)), ImGuiCond_FirstUseEver);
  // ImGui asks for End() whatever Begin() returns.
  if (ImGui::Begin(controls.room != nullptr ? "hairnet: a server's room" : "hairnet: local")) {
    ImGui::PushItemWidth(0.55f * ImGui::GetWindowWidth());
    ImGui::Text("%zu characters, %.1f pictures/s", controls.source.viewed_characters().size(),
                static_cast<double>(io.Framerate));
    ImGui::SameLine();
    if (ImGui::SmallButton("keys (H)")) state.keys_shown = !state.keys_shown;
    const std::string& status =
        controls.room != nullptr && controls.busy.empty() ? controls.room->status() : controls.busy;
    if (!status.empty()) ImGui::TextWrapped("%s", status.c_str());
    if (!state.error.empty()) ImGui::TextWrapped("%s", state.error.c_str());
    // The hint goes once some hair has been touched.
    if (controls.world != nullptr && !state.hand.has_touched())
      ImGui::TextUnformatted("Take hold of the hair with the mouse.");
    scene_controls(state, controls);
    time_controls(controls);
    character_controls(state, controls);
    wind_controls(state, controls);
    overlay_controls(state, controls);
    picture_controls(state, controls);
    record_controls(state, controls);
    ImGui::PopItemWidth();
  }
  ImGui::End();
}

}  // namespace hairnet::viewer
