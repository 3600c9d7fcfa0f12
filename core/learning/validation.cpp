#include "core/learning/validation.hpp"

#include <algorithm>
#include <array>
#include <cmath>

#include "core/assert.hpp"
#include "core/learning/learnt_weights.hpp"
#include "core/learning/network.hpp"
#include "core/modes/make_modes.hpp"

namespace hairnet {
namespace {

using Eigen::Index;
using Eigen::MatrixXf;
using Eigen::VectorXf;

// The error is measured on this many modes, since what other modes move can be neglected.
constexpr std::size_t kMeasuredModes = 64;
// The number of the first validation motion. Training has lower numbers, so nothing was learnt from these motions.
constexpr std::uint32_t kFirstValidation = 1000000;

// The mean over motions of the error over the motion. `wrong` is the difference from `truth`; the lanes are motions.
class MeanError {
 public:
  void add(const MatrixXf& wrong, const MatrixXf& truth) {
    for (Index lane = 0; lane < kLearntWidth; ++lane) {
      double error_m2 = 0, motion_m2 = 1e-12;
      for (Index c = lane; c < truth.cols(); c += kLearntWidth) {
        error_m2 += static_cast<double>(wrong.col(c).squaredNorm());
        motion_m2 += static_cast<double>(truth.col(c).squaredNorm());
      }
      sum_ += std::sqrt(error_m2 / motion_m2);
      ++count_;
    }
  }
  [[nodiscard]] float mean() const { return static_cast<float>(sum_ / count_); }

 private:
  double sum_ = 0;
  int count_ = 0;
};

}  // namespace

std::vector<LearntExamples> take_validation_examples(const Groom& groom, const std::shared_ptr<const LevelSet>& levels,
                                                     const Modes& modes, std::uint32_t motion_count,
                                                     std::size_t tick_count,
                                                     const std::function<bool(double)>& keep_going,
                                                     const ParallelFor& parallel_for) {
  const ExampleRequest request{.first_motion = kFirstValidation,
                               .motion_count = whole_thirty_twos(std::max(motion_count, 1u)),
                               .tick_count = tick_count,
                               .mode_count = static_cast<Index>(std::min(kMeasuredModes, modes.basis.mode_count())),
                               .with_low = true};
  return take_examples(groom, levels, modes, request, keep_going, parallel_for);
}

std::string judge(const std::vector<LearntExamples>& validation, LearntHair& hair) {
  HAIRNET_ASSERT(!validation.empty());
  struct Errors {
    MeanError own, low;
  };
  // The errors in still air, and in wind.
  std::array<Errors, 2> errors;
  const NetworkSize size = size_of(hair);
  const VectorXf weights = weights_of(hair);
  Network<float> network(size);
  for (const LearntExamples& e : validation) {
    MatrixXf h = MatrixXf::Zero(size.hidden, kLearntWidth), wrong = e.coefficients;
    // Modes that the network does not drive count as errors in full.
    wrong.topRows(size.outputs) -= network.forward(weights, e.inputs, h);
    errors[e.in_wind].own.add(wrong, e.coefficients);
    errors[e.in_wind].low.add(e.low - e.coefficients, e.coefficients);
  }
  hair.error = errors[0].own.mean();
  hair.low_error = errors[0].low.mean();
  hair.wind.error = errors[1].own.mean();
  hair.wind.low_error = errors[1].low.mean();
  // An error that is NaN refuses as well.
  if (!(hair.wind.error <= hair.wind.low_error)) hair.wind.weights.clear();
  if (std::string error = validate(hair); !error.empty()) return error;
  if (hair.error <= hair.low_error) return {};
  const auto percent = [](float share) { return std::to_string(std::lround(100 * share)) + " %"; };
  return "learnt hair errs by " + percent(hair.error) + " of the motion, and the low level by " +
         percent(hair.low_error);
}

}  // namespace hairnet
