#include "core/learning/learnt_examples.hpp"

#include <algorithm>
#include <array>

#include "core/assert.hpp"
#include "core/learnt/pose_inputs.hpp"
#include "core/levels/level_map.hpp"
#include "core/modes/training_motion.hpp"
#include "core/smoothstep.hpp"
#include "core/world/world.hpp"

namespace hairnet {
namespace {

using Eigen::Index;
using Eigen::MatrixXf;
using Eigen::VectorXf;

// More wild motions than make_training_motion has in a row. Every fourth motion returns to upright rest and stays
// there: hair must learn to come to rest.
std::vector<Pose> poses_of(std::uint32_t number, const Body& body, std::size_t tick_count) {
  constexpr std::array kKinds{0u, 1u, 2u, 3u, 3u, 5u, 6u, 3u};
  const std::uint32_t motion = 8 * number + kKinds[number % kKinds.size()];
  std::vector<Pose> poses = make_training_motion(motion, body, kLearntTick_s, tick_count + 1).poses;
  if (number % 4 != 3) return poses;
  const std::size_t back = tick_count / 2, ticks = static_cast<std::size_t>(0.8 / kLearntTick_s);
  for (std::size_t t = back + 1; t < poses.size(); ++t) {
    const double share = std::min(static_cast<double>(t - back) / static_cast<double>(ticks), 1.0);
    poses[t] = interpolate(poses[back], poses[0], smoothstep(share));
  }
  return poses;
}

struct Actor {
  std::vector<Pose> poses;
  PoseHistory history;
  CharacterId high, low;
};

}  // namespace

std::vector<LearntExamples> take_examples(const Groom& groom, const std::shared_ptr<const LevelSet>& levels,
                                          const Modes& modes, const ExampleRequest& request,
                                          const std::function<bool(double)>& keep_going,
                                          const ParallelFor& parallel_for) {
  HAIRNET_ASSERT(request.motion_count % kLearntWidth == 0);
  const LevelMap* map = levels->map(LevelIndex::low, LevelIndex::high);
  HAIRNET_ASSERT(map);
  WorldDef def;
  def.tick_s = kLearntTick_s;
  def.parallel_for = parallel_for;
  World world(def);
  std::vector<Actor> actors(request.motion_count);
  for (std::uint32_t n = 0; n < actors.size(); ++n) {
    Actor& actor = actors[n];
    actor.poses = poses_of(request.first_motion + n, groom.body, request.tick_count);
    actor.history.next(actor.poses[0]);
    actor.high = world.add({levels, LevelIndex::high, actor.poses[0]});
    if (request.with_low) actor.low = world.add({levels, LevelIndex::low, actor.poses[0]});
  }
  const MatrixXf projection = modes.map(LevelIndex::high).matrix().topRows(request.mode_count);
  const auto ticks = static_cast<Index>(request.tick_count);
  std::vector<LearntExamples> examples(request.motion_count / kLearntWidth);
  for (LearntExamples& e : examples) {
    e.inputs.resize(kPoseInputCount, ticks * kLearntWidth);
    e.coefficients.resize(request.mode_count, ticks * kLearntWidth);
    if (request.with_low) e.low.resize(request.mode_count, ticks * kLearntWidth);
  }
  for (Index t = 0; t < ticks; ++t) {
    if (!keep_going(static_cast<double>(t) / static_cast<double>(ticks))) return {};
    for (std::size_t n = 0; n < actors.size(); ++n) {
      Actor& actor = actors[n];
      const Pose& pose = actor.poses[static_cast<std::size_t>(t) + 1];
      world.set_pose(actor.high, pose);
      if (request.with_low) world.set_pose(actor.low, pose);
      const PoseInputs inputs = actor.history.next(pose);
      const auto lane = static_cast<Index>(n) % kLearntWidth;
      examples[n / kLearntWidth].inputs.col(t * kLearntWidth + lane) =
          Eigen::Map<const VectorXf>(inputs.data(), kPoseInputCount);
    }
    world.step();
    run_loop(parallel_for, examples.size(), [&](std::size_t e) {
      const std::span<const Actor> own = std::span(actors).subspan(e * kLearntWidth, kLearntWidth);
      MatrixXf nodes(projection.cols(), kLearntWidth);
      for (Index lane = 0; lane < kLearntWidth; ++lane) {
        const auto d = world.lattice(own[static_cast<std::size_t>(lane)].high).displacement;
        nodes.col(lane) = Eigen::Map<const VectorXf>(d.data()->data(), nodes.rows());
      }
      examples[e].coefficients.middleCols(t * kLearntWidth, kLearntWidth).noalias() = projection * nodes;
      if (!request.with_low) return;
      std::vector<Vec3f> mapped(modes.basis.node_count);
      for (Index lane = 0; lane < kLearntWidth; ++lane) {
        map->apply(world.lattice(own[static_cast<std::size_t>(lane)].low).displacement, mapped);
        nodes.col(lane) = Eigen::Map<const VectorXf>(mapped.data()->data(), nodes.rows());
      }
      examples[e].low.middleCols(t * kLearntWidth, kLearntWidth).noalias() = projection * nodes;
    });
  }
  return examples;
}

}  // namespace hairnet
