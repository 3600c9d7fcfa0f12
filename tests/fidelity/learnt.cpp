// Measures how near a network that sees only poses comes to the hair of the finest level, beside the low level and
// ether.

#include <CLI/CLI.hpp>
#include <algorithm>
#include <array>
#include <cmath>
#include <cstdio>
#include <memory>
#include <nlohmann/json.hpp>
#include <string>
#include <vector>

#include "core/learning/learn_hair.hpp"
#include "core/levels/level_map.hpp"
#include "core/world/world.hpp"
#include "schema/wire/learnt_file.hpp"
#include "tests/fidelity/modes_subject.hpp"
#include "tests/fidelity/sections.hpp"
#include "tests/fidelity/write_json.hpp"
#include "tests/support/corpus.hpp"

namespace {

using namespace hairnet;
using Json = nlohmann::ordered_json;

constexpr double kRate_hz = 1 / kLearntTick_s;
// A character that joins in the middle of a clip may differ for so long: its network has not seen the poses before.
constexpr double kJoin_s = 2;

struct Options {
  std::vector<std::string> grooms{std::begin(fidelity::kRealGrooms), std::end(fidelity::kRealGrooms)};
  std::vector<std::string> motions{std::begin(fidelity::kRealMotions), std::end(fidelity::kRealMotions)};
  std::vector<double> winds_m_per_s{0, 3};
  HairLearning learning;
  double duration_s = 8;
  std::string json;
};

// Makes a wind with gusts of half its speed, and turbulence of a fifth of it: those of the table in README.md.
WindField wind_of(double speed_m_per_s) {
  Wind wind;
  wind.mean_m_per_s = speed_m_per_s * Vec3(0.6, 0, 0.8);
  wind.gust_ratio = 0.5;
  wind.turbulence_rms_m_per_s = 0.2 * speed_m_per_s;
  return WindField(wind);
}

// Moves the hair of one character by a network that only poses and the air drive. The first step is the beginning, as
// in World and in clients.
class LearntCharacter {
 public:
  LearntCharacter(const LearntHair& hair, const Basis& basis) : hair_(hair), basis_(basis), c_(basis.mode_count()) {}
  void step(const Pose& pose, const Vec3& air_world = Vec3::Zero()) {
    const std::array<Vec3, 2> air{air_world, air_world};
    LearntMotion motion{.state = &state_, .from = &pose, .to = &pose, .begins = !has_begun_, .coefficients = c_};
    if (motion.begins) motion.ticks = 0;
    motion.air_world = std::span(air).first(static_cast<std::size_t>(motion.ticks) + 1);
    step_learnt(hair_, {&motion, 1});
    covered_ = motion.is_covered;
    has_begun_ = true;
  }
  void displacements(std::vector<Vec3f>& out) const { displacements_of(basis_, c_, out); }
  [[nodiscard]] std::span<const float> coefficients() const { return c_; }
  [[nodiscard]] bool is_covered() const { return covered_; }

 private:
  const LearntHair& hair_;
  const Basis& basis_;
  LearntState state_;
  std::vector<float> c_;
  bool has_begun_ = false, covered_ = true;
};

// Modes are orthonormal, so this is the square of the hair's RMS distance.
double distance_m2(std::span<const float> a, std::span<const float> b) {
  double sum = 0;
  for (std::size_t i = 0; i < a.size(); ++i) sum += std::pow(static_cast<double>(a[i] - b[i]), 2);
  return sum;
}

Json run_clip(const fidelity::ModesSubject& subject, const LearntHair& hair, const fidelity::Clip& clip,
              const WindField& wind) {
  const Modes& modes = *subject.modes;
  WorldDef def;
  def.tick_s = kLearntTick_s;
  def.environment.wind = wind;
  World world(def);
  constexpr std::array kLevels{LevelIndex::high, LevelIndex::low, LevelIndex::ether};
  std::array<CharacterId, kLevels.size()> ids;
  for (std::size_t i = 0; i < ids.size(); ++i) ids[i] = world.add({subject.levels, kLevels[i], clip.poses[0]});
  LearntCharacter learnt(hair, modes.basis), joiner(hair, modes.basis);
  learnt.step(clip.poses[0], wind.velocity(clip.poses[0].head().position, 0));
  // A second character, `joiner`, begins in the middle of the clip, as a client that comes late does. Its hair must
  // come to that of the first.
  const std::size_t join_tick = clip.tick_count() / 2;
  const auto joined_ticks = static_cast<std::size_t>(kJoin_s * kRate_hz);

  enum Case : std::size_t { by_learnt, by_low, by_low_map, by_ether, by_ether_map, case_count };
  std::array<double, case_count> errors_m2{};
  // The cases are learnt, low through its map, and high.
  fidelity::HairDepth depth(subject, 3);
  std::vector<Vec3f> nodes(modes.basis.node_count);
  std::vector<float> c(modes.basis.mode_count());
  double motion_m2 = 0, join_m2 = 0, covered = 0;
  std::size_t ticks = 0, joined = 0;
  for (std::size_t tick = 1; tick < clip.poses.size(); ++tick) {
    const Pose& pose = clip.poses[tick];
    for (const CharacterId id : ids) world.set_pose(id, pose);
    world.step();
    const Vec3 air = wind.velocity(pose.head().position, static_cast<double>(tick) * kLearntTick_s);
    learnt.step(pose, air);
    if (tick >= join_tick) joiner.step(pose, air);
    if (tick >= join_tick + joined_ticks) {
      join_m2 += distance_m2(learnt.coefficients(), joiner.coefficients());
      ++joined;
    }
    if (tick <= clip.lead_in_ticks) continue;
    ++ticks;
    if (learnt.is_covered()) ++covered;
    const std::span<const Vec3f> truth = world.lattice(ids[0]).displacement;
    motion_m2 += subject.mean_square_m2(truth);
    const auto add_error = [&](Case which) {
      std::vector<Vec3f> error = nodes;
      for (std::size_t n = 0; n < error.size(); ++n) error[n] -= truth[n];
      errors_m2[which] += subject.mean_square_m2(error);
    };
    // Queries of the mesh are slow, so only every third tick is measured for depth.
    const bool looks_inside = tick % 3 == 0;
    if (looks_inside) {
      depth.bend(pose);
      depth.add(2, truth);
    }
    learnt.displacements(nodes);
    add_error(by_learnt);
    if (looks_inside) depth.add(0, nodes);
    for (std::size_t i = 1; i < ids.size(); ++i) {
      const std::span<const Vec3f> own = world.lattice(ids[i]).displacement;
      subject.levels->map(kLevels[i], LevelIndex::high)->apply(own, nodes);
      add_error(i == 1 ? by_low : by_ether);
      modes.map(kLevels[i]).coefficients_of(own, c);
      displacements_of(modes.basis, c, nodes);
      add_error(i == 1 ? by_low_map : by_ether_map);
      if (i == 1 && looks_inside) depth.add(1, nodes);
    }
  }
  // Then the character gets upright within half a second and stands still, 4 s in all, in still air. A good network is
  // at rest then; what remains is `rest_mm`.
  Pose rest = rigid_pose({Quat::Identity(), clip.poses.back().head().position});
  for (int tick = 0; tick < 30; ++tick)
    learnt.step(interpolate(clip.poses.back(), rest, std::min((tick + 1) / 15.0, 1.0)));
  for (int tick = 0; tick < 90; ++tick) learnt.step(rest);
  const std::vector<float> none(learnt.coefficients().size());

  Json row{{"rms_mm", 1e3 * std::sqrt(motion_m2 / static_cast<double>(ticks))}};
  const auto percent = [&](Case which) { return 100 * std::sqrt(errors_m2[which] / motion_m2); };
  row["learnt_percent"] = percent(by_learnt);
  row["low_percent"] = percent(by_low);
  row["low_map_percent"] = percent(by_low_map);
  row["ether_percent"] = percent(by_ether);
  row["ether_map_percent"] = percent(by_ether_map);
  // The order of the table: high, low through its map, learnt; then the same three after the push.
  for (const std::size_t i : {2, 1, 0, 5, 4, 3}) row["deep_percent"].push_back(depth.percent(i));
  row["covered_percent"] = 100 * covered / static_cast<double>(ticks);
  row["late_mm"] = joined == 0 ? 0.0 : 1e3 * std::sqrt(join_m2 / static_cast<double>(joined));
  row["rest_mm"] = 1e3 * std::sqrt(distance_m2(learnt.coefficients(), none));
  return row;
}

// The median times of a character and tick.
struct Times {
  double learnt_us = 0, low_us = 0;
};

Times measure_times(const fidelity::ModesSubject& subject, const LearntHair& hair, const fidelity::Clip& clip,
                    const WindField& wind) {
  WorldDef def;
  def.tick_s = kLearntTick_s;
  def.environment.wind = wind;
  World world(def);
  std::vector<CharacterId> ids;
  // kLearntWidth characters are evaluated side by side. Each is a tick further in the clip than the one before, so that
  // all differ.
  std::vector<LearntState> states(kLearntWidth);
  std::vector<std::vector<float>> c(kLearntWidth, std::vector<float>(subject.modes->basis.mode_count()));
  std::vector<LearntMember> members(kLearntWidth);
  for (std::size_t n = 0; n < kLearntWidth; ++n) {
    ids.push_back(world.add({subject.levels, LevelIndex::low, clip.poses[0]}));
  }
  std::vector<float> learnt_us, low_us;
  for (std::size_t tick = 1; tick + kLearntWidth < clip.poses.size(); ++tick) {
    for (std::size_t n = 0; n < kLearntWidth; ++n) {
      members[n] = {&states[n], &clip.poses[tick + n], c[n]};
      world.set_pose(ids[n], clip.poses[tick + n]);
    }
    const double start_s = fidelity::now_s();
    for (LearntMember& member : members)
      member.air_world = wind.velocity(member.pose->head().position, static_cast<double>(tick) * kLearntTick_s);
    step_learnt(hair, members);
    const double middle_s = fidelity::now_s();
    world.step();
    constexpr double kEach_us = 1e6 / kLearntWidth;
    learnt_us.push_back(static_cast<float>(kEach_us * (middle_s - start_s)));
    low_us.push_back(static_cast<float>(kEach_us * (fidelity::now_s() - middle_s)));
  }
  return {fidelity::percentile(learnt_us, 0.5), fidelity::percentile(low_us, 0.5)};
}

void print_head() {
  std::printf(
      "%-18s %-13s %4s %6s | error %%: learnt  low   mapped  ether  mapped | deep %%: high low learnt, pushed"
      "         | covered %% | late mm | rest mm\n",
      "", "", "wind", "rms mm");
}

void print(const Json& row) {
  const auto number = [&](const char* key) { return row[key].get<double>(); };
  std::printf("%-18s %-13s %4.0f %6.1f |        %6.1f  %6.1f %6.1f %6.1f %6.1f |",
              row["groom"].get<std::string>().c_str(), row["motion"].get<std::string>().c_str(), number("wind_m_per_s"),
              number("rms_mm"), number("learnt_percent"), number("low_percent"), number("low_map_percent"),
              number("ether_percent"), number("ether_map_percent"));
  for (const auto& deep : row["deep_percent"]) std::printf(" %5.2f", deep.get<double>());
  std::printf(" | %5.1f | %5.1f | %5.2f\n", number("covered_percent"), number("late_mm"), number("rest_mm"));
  std::fflush(stdout);
}

// The mean of every number of the rows.
Json mean_of(const Json& rows, const std::string& groom) {
  Json mean = rows.front().flatten();
  for (auto& [key, value] : mean.items()) {
    if (!value.is_number()) continue;
    double sum = 0;
    for (const Json& row : rows) sum += row.flatten()[key].get<double>();
    value = sum / static_cast<double>(rows.size());
  }
  mean = mean.unflatten();
  mean["groom"] = groom;
  mean["motion"] = "mean";
  return mean;
}

int run(const Options& o) {
  Json rows = Json::array(), means = Json::array();
  for (const std::string& name : o.grooms) {
    const Result<Groom> groom = fidelity::load_groom(name, 2000);
    if (!groom) return fidelity::fail(groom.error());
    const fidelity::ModesSubject subject(*groom, {});
    const double start_s = fidelity::now_s();
    double fit_s = start_s;
    BuildCallbacks callbacks;
    callbacks.progress = [&](double share, std::string_view) {
      // learn_hair() moves hair until a progress of 0.55 and fits the network after it (core/learning/learn_hair.cpp).
      // So this is the time at which the fit began.
      if (share < 0.55) fit_s = fidelity::now_s();
      return true;
    };
    const auto learnt = learn_hair(*groom, subject.levels, *subject.modes, callbacks, {}, o.learning);
    if (!learnt) {
      std::printf("\n%s: refused: %s\n", name.c_str(), learnt.error().c_str());
      continue;
    }
    const LearntHair& hair = **learnt;
    const double end_s = fidelity::now_s();
    std::vector<fidelity::Clip> clips;
    for (const std::string& motion_name : o.motions) {
      const Result<Motion> motion = fidelity::load_motion(motion_name, groom->body);
      if (!motion) return fidelity::fail(motion.error());
      clips.push_back(fidelity::make_clip(*motion, kRate_hz, o.duration_s));
    }
    const auto percent = [](float share) { return 100 * static_cast<double>(share); };
    std::printf(
        "\n%s: moved %.1f s, fitted %.1f s; %zu B; validation motions: learnt %.1f %%, low %.1f %%; in wind %.1f and "
        "%.1f "
        "%%, at most %.1f m/s\n",
        name.c_str(), fit_s - start_s, end_s - fit_s, wire::encode_learnt(hair).size(), percent(hair.error),
        percent(hair.low_error), percent(hair.wind.error), percent(hair.wind.low_error),
        static_cast<double>(hair.wind.max_m_per_s));
    for (const double speed_m_per_s : o.winds_m_per_s) {
      const WindField wind = wind_of(speed_m_per_s);
      const Times times = measure_times(subject, hair, clips[0], wind);
      std::printf("%.0f m/s: %.2f us a character and tick, low %.1f us\n", speed_m_per_s, times.learnt_us,
                  times.low_us);
      print_head();
      Json own = Json::array();
      for (std::size_t c = 0; c < clips.size(); ++c) {
        Json row{{"groom", name}, {"motion", o.motions[c]}, {"wind_m_per_s", speed_m_per_s}};
        row.update(run_clip(subject, hair, clips[c], wind));
        print(row);
        own.push_back(row);
        rows.push_back(row);
      }
      means.push_back(mean_of(own, name));
      means.back().update({{"moved_s", fit_s - start_s},
                           {"fitted_s", end_s - fit_s},
                           {"validation", {hair.error, hair.low_error, hair.wind.error, hair.wind.low_error}},
                           {"learnt_us", times.learnt_us},
                           {"low_us", times.low_us}});
      print(means.back());
    }
  }
  if (means.empty()) return fidelity::fail("every hairstyle was refused");
  std::printf("\n");
  print_head();
  for (const Json& mean : means) print(mean);
  for (const double speed_m_per_s : o.winds_m_per_s) {
    Json own = Json::array();
    for (const Json& mean : means)
      if (mean["wind_m_per_s"] == speed_m_per_s) own.push_back(mean);
    print(mean_of(own, "mean"));
  }
  for (const Json& mean : means) rows.push_back(mean);
  return fidelity::write_json(o.json, rows);
}

}  // namespace

void hairnet::fidelity::add_learnt(CLI::App& program, std::function<int()>& chosen) {
  CLI::App& app =
      *program.add_subcommand("learnt", "How near hair that is learnt from poses comes to the finest level.");
  app.footer(
      "Examples:\n  hairnet-fidelity learnt --groom made:ponytail\n  hairnet-fidelity learnt --hidden 64 --rounds "
      "80\n");
  const auto kept = std::make_shared<Options>();
  Options& o = *kept;
  app.add_option("--groom", o.grooms, "hairstyles of the corpus")->capture_default_str();
  app.add_option("--motion", o.motions, "motions of the corpus")->capture_default_str();
  app.add_option("--wind", o.winds_m_per_s, "mean speeds of winds, m/s")
      ->check(CLI::Range(0.0, 40.0))
      ->capture_default_str();
  app.add_option("--duration", o.duration_s, "of each motion, at most, s")
      ->check(CLI::PositiveNumber)
      ->capture_default_str();
  HairLearning& learning = o.learning;
  app.add_option("--training-motions", learning.motion_count, "to learn from")
      ->check(CLI::Range(1, 100000))
      ->capture_default_str();
  const CLI::Validator is_of_fours(
      [](const std::string& text) { return std::stoi(text) % 4 == 0 ? "" : "not a multiple of 4"; }, "multiple of 4");
  app.add_option("--hidden", learning.hidden_count, "hidden numbers")
      ->check(CLI::Range(4, 128))
      ->check(is_of_fours)
      ->capture_default_str();
  app.add_option("--modes", learning.mode_count, "driven modes")
      ->check(CLI::Range(4, 128))
      ->check(is_of_fours)
      ->capture_default_str();
  app.add_option("--rounds", learning.rounds, "over all motions")->check(CLI::Range(1, 10000))->capture_default_str();
  app.add_option("--window", learning.window_s, "of backpropagation, s")
      ->check(CLI::PositiveNumber)
      ->capture_default_str();
  app.add_option("--rate", learning.rate, "of the first steps")->check(CLI::PositiveNumber)->capture_default_str();
  app.add_option("--decay", learning.decay, "of weights")->check(CLI::NonNegativeNumber)->capture_default_str();
  app.add_option("--json", o.json, "the rows as JSON");
  app.callback([kept, &chosen] { chosen = [kept] { return run(*kept); }; });
}
