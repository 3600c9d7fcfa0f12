// Measures what hair does when its level changes: how far strand points jump at the switch, and how far they move in
// the tick after it and in the tick before it. The head is tilted and at rest, or moving; all pairs of levels are
// measured.

#include <CLI/CLI.hpp>
#include <algorithm>
#include <cstdio>
#include <map>
#include <memory>
#include <nlohmann/json.hpp>
#include <string>
#include <tuple>
#include <utility>
#include <vector>

#include "core/ffd/deform.hpp"
#include "core/levels/build.hpp"
#include "core/world/world.hpp"
#include "tests/fidelity/sections.hpp"
#include "tests/fidelity/write_json.hpp"
#include "tests/support/corpus.hpp"

namespace {

using namespace hairnet;
using Json = nlohmann::ordered_json;

constexpr double kRate_hz = 30;

struct Options {
  std::vector<std::string> grooms{"yuksel", "harolongo", "ponytail", "sintel", "made:long_straight"};
  std::vector<std::string> motions{"dance_a", "cmu_131_02", "run"};
  double tilt_rad = 0.6;
  std::string json;
};

// Distances that points went, mm.
struct Distances {
  std::vector<float> mm;

  void add(const std::vector<Vec3f>& from, const std::vector<Vec3f>& to) {
    for (std::size_t i = 0; i < from.size(); ++i) mm.push_back(1e3f * (to[i] - from[i]).norm());
  }
  // Reorders `mm`, which is not sorted before.
  double quantile(double q) {
    if (mm.empty()) return 0;
    const auto at = mm.begin() + static_cast<std::ptrdiff_t>(q * static_cast<double>(mm.size() - 1));
    std::nth_element(mm.begin(), at, mm.end());
    return double{*at};
  }
};

// How far the strand points go at the switch itself, in the tick after it, and in the tick before it for comparison.
struct Row {
  Distances jump, after, before;
};
// The keys are the level before, the level after, and whether the head is tilted or moving.
using Rows = std::map<std::tuple<std::string, std::string, std::string>, Row>;

// The strand points that a level's lattice gives, for any of the levels.
class Hair {
 public:
  Hair(const Groom& groom, const LevelSet& levels) : groom_(groom) {
    for (const Level& level : levels.levels) {
      deformers_.emplace_back(groom, level.geometry.lattice, FfdKind::quadratic);
    }
  }
  std::vector<Vec3f> points(const LatticeView& lattice) {
    std::vector<Vec3f> points(groom_.points.size());
    grid_.resize(lattice.model->geometry.lattice.node_count());
    expand_displacements(lattice.model->geometry, lattice.displacement, grid_);
    deformers_[static_cast<std::size_t>(lattice.level)].deform(grid_, points);
    return points;
  }

 private:
  const Groom& groom_;
  std::vector<Deformer> deformers_;
  std::vector<Vec3f> grid_;
};

// Switches the level in `world`, and steps once to the pose `next`. `before` are the strand points of the tick before;
// the distances go into `row`.
void switch_level(World& world, CharacterId id, LevelIndex to, const Pose& next, Hair& hair,
                  const std::vector<Vec3f>& before, Row& row) {
  const std::vector<Vec3f> at = hair.points(world.lattice(id));
  row.before.add(before, at);
  world.set_level(id, to);
  row.jump.add(at, hair.points(world.lattice(id)));
  world.set_pose(id, next);
  world.step();
  row.after.add(at, hair.points(world.lattice(id)));
}

void at_rest(const std::shared_ptr<const LevelSet>& levels, LevelIndex from, LevelIndex to, double tilt_rad, Hair& hair,
             Row& row) {
  const Pose tilted = rigid_pose({Quat(Eigen::AngleAxisd(tilt_rad, Vec3(1, 0, 0.5).normalized())), Vec3(0, 1.6, 0)});
  WorldDef def;
  def.tick_s = 1 / kRate_hz;
  World world(def);
  const CharacterId id = world.add({levels, from, tilted});
  // The hair has at most 30 s to fall asleep.
  for (int tick = 0; tick < 30 * kRate_hz && !world.lattice(id).asleep; ++tick) world.step();
  switch_level(world, id, to, tilted, hair, hair.points(world.lattice(id)), row);
}

void in_motion(const std::shared_ptr<const LevelSet>& levels, LevelIndex from, LevelIndex to,
               const fidelity::Clip& clip, Hair& hair, Row& row) {
  // The level is switched at every half second of the clip, each time in a world of its own.
  constexpr std::size_t kEvery = 15;
  for (std::size_t at = clip.lead_in_ticks + kEvery; at + 2 < clip.poses.size(); at += kEvery) {
    WorldDef def;
    def.tick_s = 1 / kRate_hz;
    World world(def);
    const CharacterId id = world.add({levels, from, clip.poses[0]});
    std::vector<Vec3f> before;
    for (std::size_t tick = 1; tick <= at; ++tick) {
      if (tick == at) before = hair.points(world.lattice(id));
      world.set_pose(id, clip.poses[tick]);
      world.step();
    }
    switch_level(world, id, to, clip.poses[at + 1], hair, before, row);
  }
}

void print(Rows& rows, Json& json) {
  std::printf("\n%-7s %-7s %-9s %28s %28s %28s\n", "from", "to", "head", "jump at the switch, mm",
              "in the tick after it, mm", "in the tick before, mm");
  for (auto& [key, row] : rows) {
    const auto& [from, to, what] = key;
    std::printf("%-7s %-7s %-9s", from.c_str(), to.c_str(), what.c_str());
    Json entry{{"from", from}, {"to", to}, {"head", what}};
    for (const auto& [name, distances] :
         {std::pair<const char*, Distances*>{"jump", &row.jump}, {"after", &row.after}, {"before", &row.before}}) {
      const double median = distances->quantile(0.5), p95 = distances->quantile(0.95),
                   p999 = distances->quantile(0.999);
      std::printf("   %6.2f %7.2f %8.2f  ", median, p95, p999);
      entry[name] = {{"median_mm", median}, {"p95_mm", p95}, {"p99.9_mm", p999}};
    }
    std::printf("\n");
    json.push_back(entry);
  }
  std::printf("(median, 95 %% and 99.9 %% of all strand points)\n");
}

int run(const Options& o) {
  Rows rows;
  for (const std::string& name : o.grooms) {
    const Result<Groom> groom = fidelity::load_groom(name, 2000);
    if (!groom) return fidelity::fail(groom.error());
    const auto levels = build_levels(*groom);
    Hair hair(*groom, *levels);
    for (const LevelIndex from : {LevelIndex::high, LevelIndex::medium, LevelIndex::low, LevelIndex::ether}) {
      for (const LevelIndex to : {LevelIndex::high, LevelIndex::medium, LevelIndex::low, LevelIndex::ether}) {
        if (from == to) continue;
        std::fprintf(stderr, "%s %zu -> %zu\n", name.c_str(), static_cast<std::size_t>(from),
                     static_cast<std::size_t>(to));
        const std::string from_name(kLevelNames[static_cast<std::size_t>(from)]);
        const std::string to_name(kLevelNames[static_cast<std::size_t>(to)]);
        at_rest(levels, from, to, o.tilt_rad, hair, rows[{from_name, to_name, "tilted"}]);
        for (const std::string& motion_name : o.motions) {
          const Result<Motion> motion = fidelity::load_motion(motion_name, groom->body);
          if (!motion) return fidelity::fail(motion.error());
          in_motion(levels, from, to, fidelity::make_clip(*motion, kRate_hz, 3), hair,
                    rows[{from_name, to_name, "moving"}]);
        }
      }
    }
  }
  Json json = Json::array();
  print(rows, json);
  return fidelity::write_json(o.json, json);
}

}  // namespace

void hairnet::fidelity::add_levels(CLI::App& program, std::function<int()>& chosen) {
  CLI::App& app = *program.add_subcommand("levels", "How far hair jumps when its level changes.");
  app.footer("Examples:\n  hairnet-fidelity levels\n  hairnet-fidelity levels --groom made:bob --motion made:dance\n");
  const auto kept = std::make_shared<Options>();
  Options& o = *kept;
  app.add_option("--groom", o.grooms, "hairstyles of the corpus");
  app.add_option("--motion", o.motions, "motions of the corpus");
  app.add_option("--tilt", o.tilt_rad, "of the head at rest, rad")->check(CLI::Range(0.0, 3.1));
  app.add_option("--json", o.json, "the rows as JSON");
  app.callback([kept, &chosen] { chosen = [kept] { return run(*kept); }; });
}
