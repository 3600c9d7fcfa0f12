// Tests whether anything makes hair run away, and whether it always comes to rest unfolded: after rest, after motion
// that no head makes, and after random poses, materials, winds and levels, on real hairstyles and our own.

#include <CLI/CLI.hpp>
#include <algorithm>
#include <cmath>
#include <cstdio>
#include <functional>
#include <memory>
#include <nlohmann/json.hpp>
#include <numbers>
#include <random>
#include <string>
#include <vector>

#include "core/levels/build.hpp"
#include "core/world/untangle.hpp"
#include "core/world/world.hpp"
#include "tests/fidelity/sections.hpp"
#include "tests/fidelity/write_json.hpp"
#include "tests/support/corpus.hpp"

namespace {

using namespace hairnet;
using Json = nlohmann::ordered_json;

constexpr double kRate_hz = 30;
// All hair must be asleep 20 s after the head is upright and still.
constexpr int kRestTicks = 20 * static_cast<int>(kRate_hz);

struct Options {
  std::vector<std::string> grooms{"yuksel", "harolongo", "ponytail", "sintel", "made:long_straight", "made:long_curly"};
  std::size_t random_steps = 200'000;
  std::uint32_t seed = 1;
  std::string json;
};

double farthest_m(const LatticeView& lattice) {
  double most = 0;
  for (const Vec3f& d : lattice.displacement) most = std::max(most, double{d.norm()});
  return most;
}

// A trial is one row of the table. It passes when nothing was reset or not finite, every node stayed within its bound,
// and the hair fell asleep in time and unfolded.
struct Trial {
  std::string groom, level, what;
  std::size_t steps = 0, lattices_reset = 0, not_finite = 0;
  double farthest_m = 0, bound_m = 0;
  // The time until the hair fell asleep, s; negative when it never did.
  double rest_s = -1;
  // The distance of the farthest node from the design then.
  double off_m = 0;
  bool is_folded = false;
  bool passed = false;
};

class Tester {
 public:
  Tester(std::string name, const std::shared_ptr<const LevelSet>& levels, LevelIndex level)
      // The zeros are those of a new trial; -1 says that the hair has not fallen asleep yet.
      : trial_{std::move(name),
               std::string(kLevelNames[static_cast<std::size_t>(level)]),
               "",
               0,
               0,
               0,
               0,
               0,
               -1,
               0,
               false,
               false},
        levels_(levels),
        world_(world_def()),
        id_(world_.add({levels, level, upright()})) {}

  static WorldDef world_def() {
    WorldDef def;
    def.tick_s = 1 / kRate_hz;
    return def;
  }
  static Pose upright() { return rigid_pose({Quat::Identity(), Vec3(0, 1.6, 0)}); }
  World& world() { return world_; }
  CharacterId id() const { return id_; }

  void step(const Pose& pose, bool teleport = false) {
    world_.set_pose(id_, pose, teleport);
    trial_.lattices_reset += world_.step().lattices_reset;
    ++trial_.steps;
    const LatticeView lattice = world_.lattice(id_);
    if (lattice.level == LevelIndex::rigid) return;
    const double farthest = farthest_m(lattice);
    trial_.not_finite += !std::isfinite(farthest);
    trial_.bound_m = std::max(trial_.bound_m, double{lattice.model->displacement_max_m});
    trial_.farthest_m = std::max(trial_.farthest_m, farthest);
    // A step scales a lattice down that has a node farther than displacement_max_m, so none may be farther; 1e-4 of it
    // allows for the rounding of floats.
    within_bound_ = within_bound_ && farthest <= 1.0001 * double{lattice.model->displacement_max_m};
  }

  // Makes the head upright, the air still and the material as built. Then measures how long the hair takes to rest, and
  // how far from the design.
  Trial finish(std::string what) {
    trial_.what = std::move(what);
    world_.set_environment({});
    world_.set_material(id_, {});
    for (int tick = 1; tick <= kRestTicks && trial_.rest_s < 0; ++tick) {
      // The first step is a teleport: the way back to upright is not part of the trial.
      step(upright(), tick == 1);
      if (world_.lattice(id_).asleep) trial_.rest_s = tick / kRate_hz;
    }
    const LatticeView lattice = world_.lattice(id_);
    trial_.off_m = farthest_m(lattice);
    trial_.is_folded = is_folded(*lattice.model, lattice.displacement);
    trial_.passed = within_bound_ && trial_.not_finite == 0 && trial_.lattices_reset == 0 && trial_.rest_s >= 0 &&
                    !trial_.is_folded;
    return trial_;
  }

 private:
  Trial trial_;
  std::shared_ptr<const LevelSet> levels_;
  World world_;
  CharacterId id_;
  bool within_bound_ = true;
};

Pose turned(const Quat& rotation, const Vec3& position = {0, 1.6, 0}) {
  return rounded_to_wire(rigid_pose({rotation.normalized(), position}));
}

// No head makes these motions; each trial has one of them for two seconds. World takes a turn beyond 2500 degrees a
// second or a jump beyond 25 m/s as a teleport (core/pose/pose.hpp), so some are below and some beyond these limits.
struct Abuse {
  const char* name;
  std::function<Pose(int tick)> pose;
};
const std::vector<Abuse>& abuses() {
  static const std::vector<Abuse> all{
      {"shaken 10 cm at the tick rate",
       [](int t) {
         return turned(Quat::Identity(), {t % 2 ? 0.1 : 0, 1.6, 0});
       }},
      {"shaken 0.8 m at the tick rate",
       [](int t) {
         return turned(Quat::Identity(), {t % 2 ? 0.8 : 0, 1.6, 0});
       }},
      {"turned 40 degrees to and fro at the tick rate",
       [](int t) { return turned(Quat(Eigen::AngleAxisd(t % 2 ? 0.7 : 0, Vec3::UnitY()))); }},
      {"spun at 2400 degrees a second",
       [](int t) {
         return turned(Quat(Eigen::AngleAxisd(t * 2400 / kRate_hz * std::numbers::pi / 180, Vec3::UnitY())));
       }},
      {"spun at 15000 degrees a second",
       [](int t) {
         return turned(
             Quat(Eigen::AngleAxisd(t * 15000 / kRate_hz * std::numbers::pi / 180, Vec3(1, 1, 0).normalized())));
       }},
      {"somersaults at 1500 degrees a second",
       [](int t) {
         return turned(Quat(Eigen::AngleAxisd(t * 1500 / kRate_hz * std::numbers::pi / 180, Vec3::UnitX())));
       }},
      {"thrown 20 m a second",
       [](int t) {
         return turned(Quat::Identity(), {0, 1.6, 20 * t / kRate_hz});
       }},
      {"teleports every tick",
       [](int t) {
         return turned(Quat(Eigen::AngleAxisd(t, Vec3::UnitY())), {30.0 * (t % 7), 1.6, 0});
       }},
      {"far from the origin",
       [](int t) {
         // This is 9 times further than a pose on the wire may be (kPositionMax_m is 10 km): floats there have steps of
         // 8 mm.
         return turned(Quat::Identity(), {9e4 + 0.05 * (t % 5), 1.6, -9e4});
       }},
      {"shoulders through the head",
       [](int t) {
         Pose pose = Tester::upright();
         pose[Bone::left_shoulder].position.y() += t % 3 * 0.1;
         pose[Bone::right_shoulder].position.x() += 0.15;
         return pose;
       }},
      {"upside down", [](int) { return turned(Quat(Eigen::AngleAxisd(std::numbers::pi, Vec3::UnitZ()))); }}};
  return all;
}

// Does everything at once, at random. The same seed makes the same trial.
Trial random_trial(Tester tester, std::size_t steps, std::uint32_t seed) {
  std::mt19937 random(seed);
  const auto uniform = [&](double low, double high) { return std::uniform_real_distribution<>(low, high)(random); };
  const auto direction = [&] { return Vec3(uniform(-1, 1), uniform(-1, 1), uniform(-1, 1) + 1e-3).normalized(); };
  Pose pose = Tester::upright();
  for (std::size_t step = 0; step < steps; ++step) {
    // A jolt turns by 0.0001 to 3 rad and moves by 10 um to 2 m: the exponents are uniform, so small and absurd jolts
    // are equally common.
    const RigidTransform jolt{Quat(Eigen::AngleAxisd(std::pow(10, uniform(-4, 0.5)), direction())),
                              std::pow(10, uniform(-5, 0.3)) * direction()};
    for (RigidTransform& bone : pose.bones) {
      bone = bone * jolt;
      bone.rotation.normalize();
    }
    // Now and then one bone leaves its place on the body. Every 3 s (90 steps at 30 Hz) the character is upright again,
    // or jolts would carry it away.
    if (step % 13 == 0) pose[static_cast<Bone>(random() % kBoneCount)].position += 0.05 * direction();
    if (step % 90 == 0) pose = Tester::upright();
    tester.step(rounded_to_wire(pose), uniform(0, 1) < 0.01);
    if (uniform(0, 1) < 0.05) tester.world().set_level(tester.id(), static_cast<LevelIndex>(random() % kLevelCount));
    if (uniform(0, 1) < 0.02) {
      // The factors of a material are 0.1 to 10; the gel is 5 to 500.
      const auto factor = [&] { return static_cast<float>(std::pow(10, uniform(-1, 1))); };
      tester.world().set_material(tester.id(), {factor(), factor(), factor(), factor(), factor(), 50 * factor()});
    }
    if (uniform(0, 1) < 0.01) {
      tester.world().set_environment(
          {.wind = WindField({.mean_m_per_s = uniform(0, 30) * direction(), .turbulence_rms_m_per_s = 5})});
    }
  }
  tester.world().set_level(tester.id(), LevelIndex::high);
  return tester.finish("everything at random");
}

void show(const Trial& t, Json& rows, bool& all_passed) {
  all_passed = all_passed && t.passed;
  std::printf("%-4s %-20s %-7s %-46s %8zu steps  farthest %6.3f of %.2f m  at rest after %4.1f s, %.1f mm off%s\n",
              t.passed ? "ok" : "FAIL", t.groom.c_str(), t.level.c_str(), t.what.c_str(), t.steps, t.farthest_m,
              t.bound_m, t.rest_s, t.off_m * 1e3, t.is_folded ? ", folded" : "");
  std::fflush(stdout);
  rows.push_back({{"groom", t.groom},
                  {"level", t.level},
                  {"what", t.what},
                  {"steps", t.steps},
                  {"passed", t.passed},
                  {"farthest_m", t.farthest_m},
                  {"bound_m", t.bound_m},
                  {"rest_s", t.rest_s},
                  {"off_m", t.off_m},
                  {"is_folded", t.is_folded},
                  {"lattices_reset", t.lattices_reset},
                  {"not_finite", t.not_finite}});
}

void test_groom(const std::string& name, const Groom& groom, const Options& o, Json& rows, bool& all_passed) {
  const auto levels = build_levels(groom);
  for (std::size_t i = 0; i < kLevelSpecs.size(); ++i) {
    const auto level = static_cast<LevelIndex>(i);
    Tester resting(name, levels, level);
    for (int tick = 0; tick < 60 * kRate_hz; ++tick) resting.step(Tester::upright());
    Trial rest = resting.finish("60 s at rest");
    // Hair that begins in its design and rests must not move by more than 0.1 mm.
    rest.passed = rest.passed && rest.farthest_m < 1e-4;
    show(rest, rows, all_passed);
    for (const Abuse& abuse : abuses()) {
      Tester tester(name, levels, level);
      for (int tick = 0; tick < 2 * kRate_hz; ++tick) tester.step(abuse.pose(tick));
      show(tester.finish(abuse.name), rows, all_passed);
    }
  }
  show(random_trial(Tester(name, levels, LevelIndex::high), o.random_steps, o.seed), rows, all_passed);
}

int run(const Options& o) {
  Json rows = Json::array();
  bool all_passed = true;
  for (const std::string& name : o.grooms) {
    const Result<Groom> groom = fidelity::load_groom(name, 4000);
    if (!groom) return fidelity::fail(groom.error());
    test_groom(name, *groom, o, rows, all_passed);
  }
  const int unwritten = fidelity::write_json(o.json, rows);
  return all_passed ? unwritten : 1;
}

}  // namespace

void hairnet::fidelity::add_robustness(CLI::App& program, std::function<int()>& chosen) {
  CLI::App& app = *program.add_subcommand("robustness",
                                          "Whether anything makes hair run away, and whether it always comes to rest.");
  app.footer(
      "Exits with 1 when anything failed. Examples:\n  hairnet-fidelity robustness\n"
      "  hairnet-fidelity robustness --groom made:bob --random-steps 1000000 --seed 7\n");
  const auto kept = std::make_shared<Options>();
  Options& o = *kept;
  app.add_option("--groom", o.grooms, "hairstyles of the corpus");
  app.add_option("--random-steps", o.random_steps, "of the random trial of each hairstyle");
  app.add_option("--seed", o.seed, "of the random trials");
  app.add_option("--json", o.json, "the rows as JSON");
  app.callback([kept, &chosen] { chosen = [kept] { return run(*kept); }; });
}
