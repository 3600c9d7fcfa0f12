#include "core/learning/learnt_examples.hpp"

#include <algorithm>
#include <array>
#include <cmath>
#include <numbers>
#include <span>

#include "core/assert.hpp"
#include "core/learnt/pose_inputs.hpp"
#include "core/levels/level_map.hpp"
#include "core/modes/training_motion.hpp"
#include "core/random.hpp"
#include "core/smoothstep.hpp"
#include "core/world/world.hpp"

namespace hairnet {
namespace {

using Eigen::Index;
using Eigen::MatrixXf;
using Eigen::VectorXf;

// How many groups of sixteen motions (kLearntWidth) are stepped at the same time. It bounds the memory of lattices and
// poses.
constexpr std::size_t kSixteensAtOnce = 16;

// Every other group of sixteen motions is in wind.
bool is_in_wind(std::uint32_t number) {
  return number / kLearntWidth % 2 == 1;
}

// Three motions in eight are wild, while make_training_motion has one in eight; the entries of kKinds are numbers of
// its kinds, and number 3 is the wild one. The factor 8 gives each motion a number of its own. Every fourth motion
// returns to upright rest and stays there: hair must learn to come to rest.
std::vector<Pose> poses_of(std::uint32_t number, const Body& body, std::size_t tick_count) {
  constexpr std::array kKinds{0u, 1u, 2u, 3u, 3u, 5u, 6u, 3u};
  const std::uint32_t motion = 8 * number + kKinds[number % kKinds.size()];
  std::vector<Pose> poses = make_training_motion(motion, body, kLearntTick_s, tick_count + 1).poses;
  if (number % 4 != 3) return poses;
  // Half of the motion, then 0.8 s on the way back, then rest to the end.
  const std::size_t back = tick_count / 2, ticks = static_cast<std::size_t>(0.8 / kLearntTick_s);
  for (std::size_t t = back + 1; t < poses.size(); ++t) {
    const double share = std::min(static_cast<double>(t - back) / static_cast<double>(ticks), 1.0);
    poses[t] = interpolate(poses[back], poses[0], smoothstep(share));
  }
  return poses;
}

// The wind is anything between a breeze and a strong wind, from any side, steady or in gusts.
Wind wind_of(std::uint32_t number) {
  // The seed is not that of make_training_motion() (20040), so winds do not depend on the motions.
  Random random(20041, number);
  const double speed = random.between(0, kLearntWindMax_m_per_s), from = 2 * std::numbers::pi * random.unit();
  Wind wind;
  wind.mean_m_per_s = speed * Vec3(std::sin(from), 0.2 * random.symmetric(), std::cos(from));
  wind.gust_ratio = 0.8 * random.unit();
  wind.gust_period_s = 0.5 * std::pow(8.0, random.unit());
  wind.turbulence_rms_m_per_s = 0.3 * speed * random.unit();
  wind.turbulence_scale_m = 0.4 * std::pow(4.0, random.unit());
  wind.seed = random.next();
  return wind;
}

// One motion, and the characters that go through it on the finest and on the low level.
struct Actor {
  std::vector<Pose> poses;
  PoseHistory history;
  WindField wind;
  CharacterId high, low;
};

// Takes examples of the motions from `first` on, sixteen for each of `examples`. False when cancelled.
bool take_examples(const Groom& groom, const std::shared_ptr<const LevelSet>& levels, const MatrixXf& projection,
                   const ExampleRequest& request, std::uint32_t first, std::span<LearntExamples> examples,
                   const std::function<bool(double)>& keep_going, const ParallelFor& parallel_for) {
  const LevelMap* map = levels->map(LevelIndex::low, LevelIndex::high);
  HAIRNET_ASSERT(map);
  WorldDef def;
  def.tick_s = kLearntTick_s;
  def.parallel_for = parallel_for;
  World world(def);
  std::vector<Actor> actors(examples.size() * kLearntWidth);
  for (std::uint32_t n = 0; n < actors.size(); ++n) {
    Actor& actor = actors[n];
    const std::uint32_t number = first + n;
    actor.poses = poses_of(number, groom.body, request.tick_count);
    actor.history.next(actor.poses[0]);
    if (is_in_wind(number)) actor.wind = WindField(wind_of(number));
    Environment environment;
    environment.wind = actor.wind;
    // Each motion has an environment of its own, as winds differ.
    world.set_environment(n, environment);
    actor.high = world.add({levels, LevelIndex::high, actor.poses[0], n});
    if (request.with_low) actor.low = world.add({levels, LevelIndex::low, actor.poses[0], n});
  }
  const auto ticks = static_cast<Index>(request.tick_count);
  for (std::size_t i = 0; i < examples.size(); ++i) {
    LearntExamples& e = examples[i];
    e.inputs.resize(kPoseInputCount + kAirInputCount, ticks * kLearntWidth);
    e.coefficients.resize(request.mode_count, ticks * kLearntWidth);
    if (request.with_low) e.low.resize(request.mode_count, ticks * kLearntWidth);
    e.in_wind = is_in_wind(first + static_cast<std::uint32_t>(i) * kLearntWidth);
  }
  for (Index t = 0; t < ticks; ++t) {
    if (!keep_going(static_cast<double>(t) / static_cast<double>(ticks))) return false;
    for (std::size_t n = 0; n < actors.size(); ++n) {
      Actor& actor = actors[n];
      const Pose& pose = actor.poses[static_cast<std::size_t>(t) + 1];
      world.set_pose(actor.high, pose);
      if (request.with_low) world.set_pose(actor.low, pose);
      const PoseInputs inputs = actor.history.next(pose);
      const Vec3 air = actor.wind.velocity(pose.head().position, static_cast<double>(t + 1) * kLearntTick_s);
      auto column = examples[n / kLearntWidth].inputs.col(t * kLearntWidth + static_cast<Index>(n) % kLearntWidth);
      // The air in the axes of the head, like all inputs.
      column << Eigen::Map<const VectorXf>(inputs.data(), kPoseInputCount),
          (pose.head().rotation.conjugate() * air).cast<float>();
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
      std::vector<Vec3f> mapped(static_cast<std::size_t>(projection.cols()) / 3);
      for (Index lane = 0; lane < kLearntWidth; ++lane) {
        map->apply(world.lattice(own[static_cast<std::size_t>(lane)].low).displacement, mapped);
        nodes.col(lane) = Eigen::Map<const VectorXf>(mapped.data()->data(), nodes.rows());
      }
      examples[e].low.middleCols(t * kLearntWidth, kLearntWidth).noalias() = projection * nodes;
    });
  }
  return true;
}

}  // namespace

std::uint32_t whole_thirty_twos(std::uint32_t count) {
  constexpr std::uint32_t kWhole = 2 * kLearntWidth;
  return (count + kWhole - 1) / kWhole * kWhole;
}

std::vector<LearntExamples> take_examples(const Groom& groom, const std::shared_ptr<const LevelSet>& levels,
                                          const Modes& modes, const ExampleRequest& request,
                                          const std::function<bool(double)>& keep_going,
                                          const ParallelFor& parallel_for) {
  HAIRNET_ASSERT(request.first_motion % (2 * kLearntWidth) == 0);
  HAIRNET_ASSERT(request.motion_count % (2 * kLearntWidth) == 0);
  const MatrixXf projection = modes.map(LevelIndex::high).matrix().topRows(request.mode_count);
  std::vector<LearntExamples> examples(request.motion_count / kLearntWidth);
  for (std::size_t begin = 0; begin < examples.size(); begin += kSixteensAtOnce) {
    const auto own = std::span(examples).subspan(begin, std::min(kSixteensAtOnce, examples.size() - begin));
    const auto keep_on = [&](double share) {
      return keep_going((static_cast<double>(begin) + share * static_cast<double>(own.size())) /
                        static_cast<double>(examples.size()));
    };
    const std::uint32_t first = request.first_motion + static_cast<std::uint32_t>(begin) * kLearntWidth;
    if (!take_examples(groom, levels, projection, request, first, own, keep_on, parallel_for)) return {};
  }
  return examples;
}

std::vector<VectorXf> motion_weights(const std::vector<LearntExamples>& examples) {
  // It is added to the RMS of a motion, so that hair which hardly moves has at most twice the weight of hair that moves
  // so much.
  constexpr float kCalm_m = 0.005f;
  std::vector<VectorXf> weights;
  float sum = 0;
  for (const LearntExamples& e : examples) {
    VectorXf& own = weights.emplace_back(VectorXf::Zero(kLearntWidth));
    for (Index c = 0; c < e.coefficients.cols(); ++c) own[c % kLearntWidth] += e.coefficients.col(c).squaredNorm();
    // The weight is one over the RMS of the motion plus kCalm_m.
    own = ((own / static_cast<float>(e.tick_count())).cwiseSqrt().array() + kCalm_m).inverse();
    sum += own.sum();
  }
  for (VectorXf& own : weights) own *= static_cast<float>(kLearntWidth) * static_cast<float>(weights.size()) / sum;
  return weights;
}

}  // namespace hairnet
