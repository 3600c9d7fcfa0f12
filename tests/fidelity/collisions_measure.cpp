#include "tests/fidelity/collisions_measure.hpp"

#include <algorithm>

#include "core/build/build.hpp"
#include "core/ffd/deform.hpp"
#include "core/world.hpp"
#include "tests/fidelity/collisions_depth.hpp"

namespace hairnet::fidelity {
namespace {

constexpr std::size_t kPointsLeast = 20000;  // of a hairstyle that has as many
constexpr std::size_t kTicksBetween = 3;

// Every n-th strand of the hairstyle.
struct Sample {
  std::vector<Vec3f> points;
  std::vector<float> blend;
};

Sample sample_points(const Groom& groom) {
  const std::vector<float> blend = root_blend(groom);
  const std::size_t stride = std::max<std::size_t>(1, groom.points.size() / kPointsLeast);
  Sample sample;
  for (std::size_t s = 0; s < groom.strand_count(); s += stride) {
    for (std::uint32_t p = groom.strand_begin[s]; p < groom.strand_begin[s + 1]; ++p) {
      sample.points.push_back(groom.points[p]);
      sample.blend.push_back(blend[p]);
    }
  }
  return sample;
}

// Which points follow nodes that lie in the body more than others: the FFD of 1 there, 0 elsewhere.
std::vector<bool> moved_from_inside(const Level& level, const Sample& sample, BodyDepth& body) {
  std::vector<Vec3f> is_inside;
  for (const Vec3f& node : level.rest) is_inside.emplace_back(body.at(node).depth_m > 0 ? 1.0F : 0.0F, 0.0F, 0.0F);
  std::vector<Vec3f> grid(level.geometry.lattice.node_count()), out(sample.points.size());
  expand_displacements(level.geometry, is_inside, grid);
  Deformer(level.geometry.lattice, sample.points, {}, FfdKind::quadratic).deform(grid, out);
  std::vector<bool> moved;
  for (std::size_t p = 0; p < out.size(); ++p) moved.push_back((out[p] - sample.points[p]).x() > 0.5F);
  return moved;
}

// One character of the world, and what is found of it.
struct Run {
  CharacterId character;
  Deformer deformer;
  std::vector<bool> from_inside;
  Depths depths;
};

void measure_tick(const World& world, const std::vector<double>& design_m, BodyDepth& body, Run& run) {
  const LatticeView view = world.lattice(run.character);
  std::vector<Vec3f> grid(view.model->geometry.lattice.node_count()), points(design_m.size());
  expand_displacements(view.model->geometry, view.displacement, grid);
  run.deformer.deform(grid, points);

  Depths& depths = run.depths;
  const double one = 1.0 / static_cast<double>(points.size());
  double share = 0;
  for (std::size_t p = 0; p < points.size(); ++p) {
    const BodyDepth::Depth depth = body.at(points[p]);
    const double deeper_m = depth.depth_m - design_m[p];
    depths.deepest_m = std::max(depths.deepest_m, deeper_m);
    if (deeper_m <= kTooDeep_m) continue;
    share += one;
    depths.mean_share_by_bone[static_cast<std::size_t>(depth.bone)] += one;
    if (run.from_inside[p]) depths.mean_share_inside += one;
  }
  ++depths.ticks;
  depths.mean_share += share;
  depths.worst_share = std::max(depths.worst_share, share);
}

// Sums over ticks become means.
void finish(Depths& depths) {
  const auto ticks = static_cast<double>(std::max<std::size_t>(1, depths.ticks));
  depths.mean_share /= ticks;
  depths.mean_share_inside /= ticks;
  for (double& share : depths.mean_share_by_bone) share /= ticks;
}

}  // namespace

Subject make_subject(Groom groom, const std::vector<LevelIndex>& levels) {
  auto with = std::make_shared<LevelSet>();
  for (const LevelIndex level : levels) {
    const auto i = static_cast<std::size_t>(level);
    with->levels[i] = *build_level(groom, kLevelSpecs[i]);
  }
  auto without = std::make_shared<LevelSet>(*with);
  for (Level& level : without->levels) level.metaballs.clear();
  return {std::move(groom), levels, std::move(with), std::move(without)};
}

std::vector<Depths> measure_depths(const Subject& subject, const Clip& clip,
                                   const std::function<void(double)>& progress) {
  const Sample sample = sample_points(subject.groom);
  BodyDepth body(subject.groom);
  std::vector<double> design_m;
  for (const Vec3f& point : sample.points) design_m.push_back(body.at(point).depth_m);

  WorldDef def;
  def.tick_s = 1 / clip.rate_hz;
  World world(def);
  std::vector<Run> runs;
  for (const LevelIndex level : subject.levels) {
    const Level& model = (*subject.with)[level];
    for (const bool metaballs : {false, true}) {
      runs.push_back({world.add({metaballs ? subject.with : subject.without, level, clip.poses.front()}),
                      Deformer(model.geometry.lattice, sample.points, sample.blend, FfdKind::quadratic),
                      moved_from_inside(model, sample, body),
                      {subject.groom.name, clip.name, level, metaballs}});
    }
  }
  for (std::size_t tick = 1; tick < clip.poses.size(); ++tick) {
    for (const Run& run : runs) world.set_pose(run.character, clip.poses[tick]);
    world.step();
    if (tick <= clip.lead_in_ticks || (tick - clip.lead_in_ticks) % kTicksBetween != 0) continue;
    body.bend(clip.poses[tick]);
    for (Run& run : runs) measure_tick(world, design_m, body, run);
    progress(static_cast<double>(tick) / static_cast<double>(clip.tick_count()));
  }
  std::vector<Depths> all;
  for (Run& run : runs) {
    finish(run.depths);
    all.push_back(std::move(run.depths));
  }
  return all;
}

}  // namespace hairnet::fidelity
