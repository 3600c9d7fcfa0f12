#include "tests/load/plan.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <charconv>
#include <cmath>
#include <nlohmann/json.hpp>
#include <set>

#include "tests/load/requirement.hpp"

namespace hairnet::load {
namespace {

using Json = nlohmann::ordered_json;

Result<void> read_texts(const Json& value, std::vector<std::string>& to) {
  if (!value.is_array()) return Refusal("is not a list of texts");
  to.clear();
  for (const Json& item : value) {
    if (!item.is_string()) return Refusal("is not a list of texts");
    to.push_back(item.get<std::string>());
  }
  return {};
}

Result<void> read_stages(const Json& value, std::vector<Stage>& to) {
  std::vector<std::string> texts;
  if (const auto read = read_texts(value, texts); !read) return read;
  to.clear();
  for (const std::string& text : texts) {
    auto stage = parse_stage(text, to.empty() ? nullptr : &to.back());
    if (!stage) return Refusal(stage.error());
    to.push_back(std::move(*stage));
  }
  return {};
}

Result<void> read(const std::string& key, const Json& value, Plan& plan) {
  if (key == "grooms") return read_texts(value, plan.grooms);
  if (key == "motions") return read_texts(value, plan.motions);
  if (key == "require") return read_texts(value, plan.requirements);
  if (key == "stages") return read_stages(value, plan.stages);
  if (key == "seed") {
    if (!value.is_number_unsigned()) return Refusal("is not a whole number of 0 or more");
    plan.seed = value.get<std::uint64_t>();
  } else if (key == "pose_hz") {
    if (!value.is_number()) return Refusal("is not a number");
    plan.pose_hz = value.get<double>();
  } else if (key == "room_size") {
    if (!value.is_number_unsigned() || value.get<std::uint64_t>() > kClientCountMax)
      return Refusal(fmt::format("is not a whole number of 0 to {}", kClientCountMax));
    plan.room_size = value.get<std::uint32_t>();
  } else if (key == "touch_share") {
    if (!value.is_number()) return Refusal("is not a number");
    plan.touch_share = value.get<double>();
  } else if (key == "props_share") {
    if (!value.is_number()) return Refusal("is not a number");
    plan.props_share = value.get<double>();
  } else if (key == "observe") {
    if (!value.is_string()) return Refusal("is not a text");
    plan.observe = value.get<std::string>();
  } else if (key == "hair_error_mm") {
    if (!value.is_number()) return Refusal("is not a number");
    plan.hair_error_mm = value.get<double>();
  } else if (key == "frame_bytes_per_s") {
    if (!value.is_number()) return Refusal("is not a number");
    plan.frame_bytes_per_s = value.get<double>();
  } else {
    return Refusal(
        "unknown key; there are seed, pose_hz, grooms, motions, room_size, touch_share, props_share, observe, "
        "hair_error_mm, frame_bytes_per_s, stages, require");
  }
  return {};
}

bool is_observe(const std::string& text) {
  if (text == "all") return true;
  std::uint32_t count = 0;
  const auto [end, error] = std::from_chars(text.data(), text.data() + text.size(), count);
  return error == std::errc() && end == text.data() + text.size() && count <= 65'535;
}

}  // namespace

double Plan::duration_s() const {
  double sum_s = 0;
  for (const Stage& stage : stages) sum_s += stage.duration_s;
  return sum_s;
}

bool Plan::has_attacks() const {
  return std::ranges::any_of(stages, [](const Stage& stage) { return stage.attack.has_value(); });
}

std::int64_t Plan::stage_begin_ns(std::size_t stage) const {
  double sum_s = 0;
  for (std::size_t i = 0; i < stage; ++i) sum_s += stages[i].duration_s;
  return std::llround(sum_s * 1e9);
}

// Stages of one name get a number behind it, since thresholds and reports name stages.
std::string settle(Plan& plan) {
  if (plan.stages.empty()) return "a plan needs a stage: give --stage, --plan or --preset";
  if (plan.stages.size() > 1000) return "a plan has at most 1000 stages";
  if (plan.grooms.empty() || plan.motions.empty()) return "a plan needs a groom and a motion";
  if (!(plan.pose_hz >= 1 && plan.pose_hz <= 1000)) return "pose_hz is not in 1 to 1000";
  if (!(plan.touch_share >= 0 && plan.touch_share <= 1)) return "touch_share is not in 0 to 1";
  if (!(plan.props_share >= 0 && plan.props_share <= 1)) return "props_share is not in 0 to 1";
  if (!is_observe(plan.observe)) return "observe is neither 'all' nor a number of nearest characters";
  if (!(plan.hair_error_mm >= 0 && plan.hair_error_mm <= 1000)) return "hair_error_mm is not in 0 to 1000";
  if (!(plan.frame_bytes_per_s >= 0 && plan.frame_bytes_per_s <= 1e9)) return "frame_bytes_per_s is not in 0 to 1e9";
  for (std::size_t i = 0; i < plan.stages.size(); ++i) {
    // The figures of an attack are compared with those of the stages before and after it.
    const bool calm_about =
        i > 0 && i + 1 < plan.stages.size() && !plan.stages[i - 1].attack && !plan.stages[i + 1].attack;
    if (plan.stages[i].attack && !calm_about) return "a stage with an attack needs one without before it and after it";
  }
  for (const std::string& text : plan.requirements)
    if (const auto requirement = parse_requirement(text); !requirement) return requirement.error();
  std::set<std::string> names;
  for (Stage& stage : plan.stages) {
    const std::string base = stage.name;
    for (int n = 2; !names.insert(stage.name).second; ++n) stage.name = fmt::format("{}{}", base, n);
  }
  return {};
}

Result<Plan> parse_plan(std::string_view json) {
  // The arguments say: no callback, no exceptions, and comments are allowed. A report has its plan under "plan".
  const Json root = Json::parse(json, nullptr, false, true);
  if (root.is_discarded()) return Refusal("is not JSON");
  if (!root.is_object()) return Refusal("is not a JSON object");
  const Json& object = root.contains("plan") ? root["plan"] : root;
  if (!object.is_object()) return Refusal("plan: is not a JSON object");
  Plan plan;
  for (const auto& [key, value] : object.items()) {
    if (const auto done = read(key, value, plan); !done) return Refusal(key + ": " + done.error());
  }
  if (std::string error = settle(plan); !error.empty()) return Refusal(std::move(error));
  return plan;
}

std::string to_json_text(const Plan& plan) {
  std::vector<std::string> stages;
  for (const Stage& stage : plan.stages) stages.push_back(to_text(stage));
  const Json json{{"seed", plan.seed},
                  {"pose_hz", plan.pose_hz},
                  {"grooms", plan.grooms},
                  {"motions", plan.motions},
                  {"room_size", plan.room_size},
                  {"touch_share", plan.touch_share},
                  {"props_share", plan.props_share},
                  {"observe", plan.observe},
                  {"hair_error_mm", plan.hair_error_mm},
                  {"frame_bytes_per_s", plan.frame_bytes_per_s},
                  {"stages", std::move(stages)},
                  {"require", plan.requirements}};
  return json.dump(1);
}

// The text of each preset is a plan as in a file of --plan. A run takes a minute at most, and `hostile` some nine
// minutes.
const std::vector<Preset>& presets() {
  static const std::vector<Preset> all{
      {"smoke", "two clients for two seconds: does it work at all", R"({
        "stages": ["ramp:500ms:clients=2,characters=2,level=low", "steady:2s:warm=500ms"]})"},
      {"crowd", "few clients with many characters each, at the low level", R"({
        "observe": "0",
        "stages": ["ramp:5s:clients=4,characters=64,level=low", "steady:20s", "spike:5s:clients=6",
                   "steady:10s:clients=4,warm=1s"]})"},
      {"rooms8", "8 rooms of 8 people who all see each other, with churn and a storm of reconnects", R"({
        "room_size": 8,
        "stages": ["ramp:8s:clients=64,characters=1,level=high", "steady:15s", "steady:15s:name=churn,churn=2",
                   "steady:15s:name=storm,storm=50%"]})"},
      {"rooms32", "2 rooms of 32 people, then with bad clients among them", R"({
        "room_size": 32,
        "stages": ["ramp:8s:clients=64,characters=1,level=high", "steady:15s",
                   "steady:15s:name=bad,slow=2,flood=1,malformed=2,silent=2,half_open=2"]})"},
      {"touch",
       "rooms of 8 people, half of whom stroke, hold, pull and pin the hair of another, at 30 Hz; half of these also "
       "set, move and remove props where the server permits it (-- --props-from-clients participants)",
       R"({
        "room_size": 8, "pose_hz": 30, "touch_share": 0.5, "props_share": 0.5,
        "stages": ["ramp:4s:clients=16,characters=1,level=high", "steady:20s:warm=2s"],
        "require": ["errors==0", "holds>0", "frames_missed_share<0.01", "hands_latency_p99_ms<100"]})"},
      {"hostile",
       "16 people in rooms of 4 as witnesses, while others attack the server, each attack after a calm stage", R"({
        "room_size": 4,
        "stages": ["ramp:4s:clients=16,characters=1,level=high",
                   "steady:14s:name=calm,measured=no", "steady:15s:name=zigzag,attack=zigzag",
                   "steady:14s:name=calm,measured=no", "steady:20s:name=body,attack=body",
                   "steady:14s:name=calm,measured=no", "steady:20s:name=big,attack=big",
                   "steady:14s:name=calm,measured=no", "steady:15s:name=resume,attack=resume",
                   "steady:14s:name=calm,measured=no", "steady:20s:name=offers,attack=offers",
                   "steady:14s:name=calm,measured=no", "steady:15s:name=silent,attack=silent,half_open=4",
                   "steady:14s:name=calm,measured=no", "steady:15s:name=hellos,attack=hellos",
                   "steady:14s:name=calm,measured=no", "steady:15s:name=prologue,attack=prologue",
                   "steady:14s:name=calm,measured=no", "steady:15s:name=churn,attack=churn",
                   "steady:14s:name=calm,measured=no", "steady:15s:name=rooms,attack=rooms",
                   "steady:14s:name=calm,measured=no", "steady:15s:name=observe,attack=observe",
                   "steady:14s:name=calm,measured=no", "steady:15s:name=wind,attack=wind",
                   "steady:14s:name=calm,measured=no", "steady:15s:name=poses,attack=poses",
                   "steady:14s:name=calm,measured=no", "steady:15s:name=appearances,attack=appearances",
                   "steady:14s:name=calm,measured=no", "steady:15s:name=rides,attack=rides",
                   "steady:14s:name=calm,measured=no", "steady:15s:name=hands,attack=hands",
                   "steady:14s:name=calm,measured=no"],
        "require": ["frames_missed_share_over_calm<0.005", "gap_ticks_max<=2", "level_high_share_over_calm>-0.1",
                    "errors==0", "server_ticks_skipped==0", "server_resident_after_mib_over_calm<64",
                    "late_joiner_welcome_s<2", "late_joiner_ready_s<10", "healthz_max_s<2"]})"}};
  return all;
}

Result<Plan> preset_plan(std::string_view name) {
  std::string names;
  for (const Preset& preset : presets()) {
    if (preset.name == name) return parse_plan(preset.plan);
    names += (names.empty() ? "" : ", ") + std::string(preset.name);
  }
  return Refusal(fmt::format("'{}' is not one of {}", name, names));
}

}  // namespace hairnet::load
