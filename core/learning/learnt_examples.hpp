#pragma once

#include <Eigen/Core>
#include <functional>
#include <memory>
#include <vector>

#include "core/groom/groom.hpp"
#include "core/learnt/learnt_hair.hpp"
#include "core/levels/level.hpp"
#include "core/modes/make_modes.hpp"
#include "core/parallel_for.hpp"

namespace hairnet {

// The mean speed of the strongest wind in training; gusts are stronger.
inline constexpr double kLearntWindMax_m_per_s = 10;

// What the finest level did in sixteen motions (kLearntWidth) side by side. A column is one motion at one tick,
// [tick][motion].
struct LearntExamples {
  // The inputs of the network: those of PoseHistory, then the air.
  Eigen::MatrixXf inputs;
  // The coefficients of the finest level, m.
  Eigen::MatrixXf coefficients;
  // The coefficients of the low level, moved to the finest level by its LevelMap, m; or empty.
  Eigen::MatrixXf low;
  bool in_wind = false;

  [[nodiscard]] Eigen::Index tick_count() const { return inputs.cols() / kLearntWidth; }
};

// Which examples to take.
struct ExampleRequest {
  // The number of the first motion for make_training_motion; a multiple of thirty-two.
  std::uint32_t first_motion = 0;
  // A multiple of thirty-two: the first half of each thirty-two is in still air, the other in wind.
  std::uint32_t motion_count = 0;
  // The ticks of each motion, the modes whose coefficients are taken, and whether the low level is stepped too.
  std::size_t tick_count = 0;
  Eigen::Index mode_count = 0;
  bool with_low = false;
};

// The next multiple of thirty-two: two groups of sixteen motions, one in still air and one in wind.
std::uint32_t whole_thirty_twos(std::uint32_t count);

// Steps the hair through training motions, as it was built, one tick each kLearntTick_s. Empty when `keep_going`, which
// gets the finished share, returns false. The same bits for any `parallel_for`.
std::vector<LearntExamples> take_examples(const Groom& groom, const std::shared_ptr<const LevelSet>& levels,
                                          const Modes& modes, const ExampleRequest& request,
                                          const std::function<bool(double)>& keep_going,
                                          const ParallelFor& parallel_for);

// Returns the weight of each motion in a loss, [sixteen][motion]; their mean is 1. Lively motions count more, but not
// so much that hair which hardly moves counts for nothing.
std::vector<Eigen::VectorXf> motion_weights(const std::vector<LearntExamples>& examples);

}  // namespace hairnet
