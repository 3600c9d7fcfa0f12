#include "tests/fidelity/decimation_case.hpp"

#include <cstdio>
#include <limits>
#include <memory>

#include "core/levels/build.hpp"
#include "tests/fidelity/random_subset.hpp"

namespace hairnet::fidelity {
namespace {

// As an upper limit of a count this leaves out no stiffener.
constexpr std::size_t kAll = std::numeric_limits<std::size_t>::max();

// Builds a level with so many nodes on each axis. Where the hair has more stiffeners, the build merges them until the
// counts are reached.
std::shared_ptr<const Level> build(const Groom& groom, int nodes, std::size_t spring_count,
                                   std::size_t attachment_count) {
  return build_level(groom, {{nodes, nodes, nodes}, spring_count, attachment_count});
}

std::string text(const char* format, auto... values) {
  char line[256];
  std::snprintf(line, sizeof line, format, values...);
  return line;
}

// The reference for the models of one lattice: all of its stiffeners, over one clip.
struct Truth {
  const Level* level = nullptr;
  std::vector<Vec3f> points;
  double motion_m = 0;
};

// Refuses a clip in which nothing moves, since errors are relative to the motion.
Result<Truth> find_truth(const Level& level, const Clip& clip, const StrandPoints& strands) {
  const auto trajectory = integrate(level, clip);
  if (!trajectory) return Refusal(trajectory.error());
  Truth truth{&level, strands.deform(level, *trajectory), 0};
  truth.motion_m = rms_motion(truth.points, strands.rest());
  if (!(truth.motion_m > 0)) return Refusal(clip.name + ": nothing moves");
  return truth;
}

// The distance of a level's strand points from the reference's, as a share of the motion.
Result<Distance> relative_distance(const Level& level, const Clip& clip, const StrandPoints& strands,
                                   const Truth& truth) {
  const auto trajectory = integrate(level, clip);
  if (!trajectory) return Refusal(trajectory.error());
  const Distance metres = distance(strands.deform(level, *trajectory), truth.points);
  return Distance{metres.rms / truth.motion_m, metres.p95 / truth.motion_m};
}

// The mean distance over random subsets of all stiffeners, with the same counts as the merged model: what decimation
// would be without any merging.
Result<Distance> random_distance(const Clip& clip, const StrandPoints& strands, const Truth& truth,
                                 const DecimationRow& row, std::size_t seed_count) {
  Distance mean;
  for (std::size_t seed = 1; seed <= seed_count; ++seed) {
    Level level = *truth.level;
    // Springs and attachments have different seeds, so their choices are independent.
    level.springs = random_subset(truth.level->springs, row.spring_count, 2 * seed);
    level.attachments = random_subset(truth.level->attachments, row.attachment_count, 2 * seed + 1);
    const auto one = relative_distance(level, clip, strands, truth);
    if (!one) return one;
    mean.rms += one->rms / static_cast<double>(seed_count);
    mean.p95 += one->p95 / static_cast<double>(seed_count);
  }
  return mean;
}

// How far a model that is 1 % stiffer lies from the reference: an error of this size says nothing about decimation.
Result<Distance> stiffer_distance(const Clip& clip, const StrandPoints& strands, const Truth& truth) {
  Level level = *truth.level;
  for (Stiffeners* list : {&level.springs, &level.attachments}) {
    for (float& k : list->stiffness) k *= 1.01f;
    for (float& q : list->damping) q *= 1.01f;
  }
  return relative_distance(level, clip, strands, truth);
}

Result<DecimationRow> measure_model(const Level& merged, const Clip& clip, const StrandPoints& strands,
                                    const Truth& truth, const DecimationOptions& options) {
  DecimationRow row;
  row.motion = clip.name;
  row.lattice_nodes = merged.geometry.lattice.dims[0];
  row.spring_count = merged.springs.count();
  row.attachment_count = merged.attachments.count();
  row.spring_count_all = truth.level->springs.count();
  row.attachment_count_all = truth.level->attachments.count();
  row.motion_m = truth.motion_m;
  const bool is_target = row.lattice_nodes == kTargetNodes && row.spring_count == kTargetSpringCount;
  const auto of_merged = relative_distance(merged, clip, strands, truth);
  if (!of_merged) return Refusal(of_merged.error());
  const auto of_random =
      random_distance(clip, strands, truth, row, is_target ? options.target_seed_count : options.other_seed_count);
  if (!of_random) return Refusal(of_random.error());
  row.merged = *of_merged;
  row.random = *of_random;
  if (is_target) {
    const auto of_stiffer = stiffer_distance(clip, strands, truth);
    if (!of_stiffer) return Refusal(of_stiffer.error());
    row.stiffer_rms = of_stiffer->rms;
  }
  return row;
}

}  // namespace

Result<std::vector<DecimationRow>> measure_decimation(const Groom& groom, std::span<const Clip> clips,
                                                      const DecimationOptions& options, const PrintLine& print_line) {
  const StrandPoints strands(groom, options.point_count_max);
  std::vector<DecimationRow> rows;
  for (const int nodes : kLatticeNodes) {
    const auto all = build(groom, nodes, kAll, kAll);
    std::vector<std::shared_ptr<const Level>> models;
    for (const std::size_t count : kSpringCounts) models.push_back(build(groom, nodes, count, count / 4));
    for (const Clip& clip : clips) {
      const auto truth = find_truth(*all, clip, strands);
      if (!truth) return Refusal(truth.error());
      for (const auto& merged : models) {
        auto row = measure_model(*merged, clip, strands, *truth, options);
        if (!row) return Refusal(row.error());
        row->groom = groom.name;
        print_line(text("%s, %s, %d^3, %zu+%zu of %zu+%zu: merged %.1f %%, random %.1f %% of %.1f mm",
                        row->groom.c_str(), row->motion.c_str(), nodes, row->spring_count, row->attachment_count,
                        row->spring_count_all, row->attachment_count_all, 100 * row->merged.rms, 100 * row->random.rms,
                        1e3 * row->motion_m));
        rows.push_back(std::move(*row));
      }
    }
  }
  return rows;
}

Result<std::vector<LatticeRow>> measure_lattices(const Groom& groom, std::span<const Clip> clips, int truth_nodes,
                                                 const DecimationOptions& options, const PrintLine& print_line) {
  const StrandPoints strands(groom, options.point_count_max);
  const auto fine = build(groom, truth_nodes, kAll, kAll);
  std::vector<LatticeRow> rows;
  for (const Clip& clip : clips) {
    const auto truth = find_truth(*fine, clip, strands);
    if (!truth) return Refusal(truth.error());
    for (const int nodes : kLatticeNodes) {
      const auto one = relative_distance(*build(groom, nodes, kAll, kAll), clip, strands, *truth);
      if (!one) return Refusal(one.error());
      rows.push_back({groom.name, clip.name, nodes, truth_nodes, truth->motion_m, *one});
      print_line(text("%s, %s, all stiffeners on %d^3: %.1f %% off %d^3", groom.name.c_str(), clip.name.c_str(), nodes,
                      100 * one->rms, truth_nodes));
    }
  }
  return rows;
}

}  // namespace hairnet::fidelity
