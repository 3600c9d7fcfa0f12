// Measures what stepping every second or fourth tick errs and costs. The trajectory of World at each stride, played out
// linearly between turns, is compared with fine steps and with a step at every tick.

#include <CLI/CLI.hpp>
#include <algorithm>
#include <cstdio>
#include <map>
#include <memory>
#include <nlohmann/json.hpp>
#include <string>
#include <tuple>
#include <vector>

#include "core/levels/build.hpp"
#include "core/world/world.hpp"
#include "schema/channel/monotonic_clock.hpp"
#include "tests/fidelity/cut_off.hpp"
#include "tests/fidelity/sections.hpp"
#include "tests/fidelity/write_json.hpp"
#include "tests/support/corpus.hpp"

namespace {

using namespace hairnet;
using fidelity::Clip;
using fidelity::NodeTrajectory;
using Json = nlohmann::ordered_json;

// The reference has steps of this length: a quarter of a tick at 90 Hz, the highest rate of the tables.
constexpr double kSmall_s = 1.0 / 360;
// World steps characters in batches. So many equal characters fill every batch with any stride.
constexpr int kCrowd = 64;

struct Options {
  std::vector<std::string> grooms{"yuksel", "harolongo", "ponytail", "sintel"};
  std::vector<std::string> motions{"dance_a", "cmu_131_02", "run"};
  std::vector<std::string> levels{"high", "medium", "low", "ether"};
  double rate_hz = 30, duration_s = 3;
  std::string json;
};

NodeTrajectory run_world(const std::shared_ptr<const LevelSet>& levels, LevelIndex level, const Clip& clip,
                         int stride) {
  WorldDef def;
  def.tick_s = 1 / clip.rate_hz;
  def.now_ns = channel::monotonic_ns;
  World world(def);
  std::vector<CharacterId> ids;
  for (int i = 0; i < kCrowd; ++i) {
    ids.push_back(world.add({levels, level, clip.poses.front()}));
    world.set_stride(ids.back(), stride);
  }
  NodeTrajectory trajectory{def.tick_s, {}, 0};
  std::vector<std::vector<Vec3f>> shown{world.state(ids[0]).displacement};
  std::int64_t spent_ns = 0;
  for (std::size_t tick = 1; tick < clip.poses.size(); ++tick) {
    for (const CharacterId id : ids) world.set_pose(id, clip.poses[tick]);
    const StepCosts costs = world.step().costs;
    for (int ticks = 1; ticks <= kStrideMax; ++ticks) spent_ns += costs.of(level, ticks).step_ns;
    const auto now = world.lattice(ids[0]).displacement;
    if (!world.lattice(ids[0]).stepped) continue;
    const std::vector<Vec3f> last = shown.back();
    // The ticks since the last turn get the positions on the straight line between both turns, as clients show them.
    for (std::size_t first = shown.size(), t = first; t <= tick; ++t) {
      const float share = static_cast<float>(t - first + 1) / static_cast<float>(tick - first + 1);
      shown.emplace_back(now.size());
      for (std::size_t i = 0; i < now.size(); ++i) shown.back()[i] = last[i] + share * (now[i] - last[i]);
    }
  }
  // The lead-in brings the hair from rest into the motion, and does not count. A turn that is still under way at the
  // end leaves its ticks out.
  trajectory.ticks.assign(shown.begin() + static_cast<std::ptrdiff_t>(std::min(clip.lead_in_ticks, shown.size())),
                          shown.end());
  trajectory.tick_us = 1e-3 * static_cast<double>(spent_ns) / (kCrowd * static_cast<double>(clip.tick_count()));
  return trajectory;
}

struct Sum {
  // Sums over the cases of one row: the error against small steps, the error against a step at every tick, and the
  // microseconds of a character and a tick.
  double from_small = 0, from_full = 0, us = 0;
  int count = 0;
};
using Key = std::tuple<LevelIndex, int>;

void compare(const Options& o, const std::shared_ptr<const LevelSet>& levels, LevelIndex index, const Motion& motion,
             std::map<Key, Sum>& sums) {
  const Level& level = (*levels)[index];
  const NodeTrajectory small =
      fidelity::integrate(level, motion, {1 / kSmall_s, 1, fidelity::kConverged}, 1, o.duration_s);
  const Clip clip = fidelity::make_clip(motion, o.rate_hz, o.duration_s);
  const NodeTrajectory full = run_world(levels, index, clip, 1);
  for (const int stride : {1, 2, 4}) {
    const NodeTrajectory run = stride == 1 ? full : run_world(levels, index, clip, stride);
    Sum& sum = sums[{index, stride}];
    sum.from_small += fidelity::relative_error(level, run, small);
    sum.from_full += fidelity::relative_error(level, run, full);
    sum.us += run.tick_us;
    ++sum.count;
  }
}

int run(const Options& o) {
  std::map<Key, Sum> sums;
  for (const std::string& groom_name : o.grooms) {
    const Result<Groom> groom = fidelity::load_groom(groom_name, 4000);
    if (!groom) return fidelity::fail(groom.error());
    auto levels = std::make_shared<LevelSet>();
    for (const std::string& name : o.levels) {
      const auto index =
          static_cast<std::size_t>(std::find(kLevelNames.begin(), kLevelNames.end(), name) - kLevelNames.begin());
      if (index >= kLevelSpecs.size()) return fidelity::fail(name + ": no such level");
      levels->levels[index] = *build_level(*groom, kLevelSpecs[index]);
      for (const std::string& motion_name : o.motions) {
        const Result<Motion> motion = fidelity::load_motion(motion_name, groom->body);
        if (!motion) return fidelity::fail(motion.error());
        compare(o, levels, static_cast<LevelIndex>(index), *motion, sums);
      }
    }
  }
  Json rows = Json::array();
  std::printf("%-7s %6s %15s %15s %12s %6s\n", "level", "stride", "from small, %", "from full, %", "us/tick", "cost");
  for (const auto& [key, sum] : sums) {
    const auto& [level, stride] = key;
    const std::string name(kLevelNames[static_cast<std::size_t>(level)]);
    const double cost = sum.us / sums.at({level, 1}).us;
    std::printf("%-7s %6d %15.1f %15.1f %12.2f %6.2f\n", name.c_str(), stride, 100 * sum.from_small / sum.count,
                100 * sum.from_full / sum.count, sum.us / sum.count, cost);
    rows.push_back({{"level", name},
                    {"stride", stride},
                    {"error_from_small_steps", sum.from_small / sum.count},
                    {"error_from_every_tick", sum.from_full / sum.count},
                    {"us_per_tick", sum.us / sum.count},
                    {"cost", cost}});
  }
  return fidelity::write_json(o.json, rows);
}

}  // namespace

void hairnet::fidelity::add_stride(CLI::App& program, std::function<int()>& chosen) {
  CLI::App& app = *program.add_subcommand("stride", "Trajectory error and time of strides.");
  app.footer("Example:\n  hairnet-fidelity stride --groom made:bob --motion made:dance --level low\n");
  const auto kept = std::make_shared<Options>();
  Options& o = *kept;
  app.add_option("--groom", o.grooms, "hairstyles of the corpus");
  app.add_option("--motion", o.motions, "motions of the corpus");
  app.add_option("--level", o.levels, "high, medium, low, ether");
  app.add_option("--rate", o.rate_hz, "ticks a second")->check(CLI::Range(1.0, 1000.0));
  app.add_option("--duration", o.duration_s, "seconds of each motion")->check(CLI::Range(0.5, 60.0));
  app.add_option("--json", o.json, "the rows as JSON");
  app.callback([kept, &chosen] { chosen = [kept] { return run(*kept); }; });
}
