#include "core/learning/held_out.hpp"

#include <algorithm>
#include <array>
#include <bit>
#include <cmath>
#include <utility>

#include "core/assert.hpp"
#include "core/modes/make_modes.hpp"

namespace hairnet {
namespace {

using Eigen::Index;
using Eigen::MatrixXf;
using Eigen::VectorXf;
using RowMajor = Eigen::Matrix<float, Eigen::Dynamic, Eigen::Dynamic, Eigen::RowMajor>;

// Modes of which the error is measured; what the others move can be neglected.
constexpr std::size_t kMeasuredModes = 64;
// Motions of training have lower numbers.
constexpr std::uint32_t kFirstHeldOut = 1000000;

// Error over motion, the mean of all motions. `wrong`: the difference from `truth`.
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

// With 8 bits after the first.
float shortened(float weight) {
  return std::bit_cast<float>((std::bit_cast<std::uint32_t>(weight) + 0x4000u) & ~0x7fffu);
}

std::vector<float> by_rows(const auto& matrix) {
  std::vector<float> out;
  for (Index row = 0; row < matrix.rows(); ++row)
    for (Index column = 0; column < matrix.cols(); ++column) out.push_back(matrix(row, column));
  return out;
}

Eigen::Map<const RowMajor> rows_of(const std::vector<float>& numbers, Index rows, Index columns) {
  HAIRNET_ASSERT(static_cast<Index>(numbers.size()) == rows * columns);
  return {numbers.data(), rows, columns};
}

}  // namespace

std::uint32_t whole_thirty_twos(std::uint32_t count) {
  constexpr std::uint32_t kWhole = 2 * kLearntWidth;
  return (count + kWhole - 1) / kWhole * kWhole;
}

NetworkSize size_of(const LearntHair& hair) {
  return {kPoseInputCount + kAirInputCount, static_cast<Index>(hair.hidden_count), static_cast<Index>(hair.mode_count)};
}

VectorXf weights_of(const LearntHair& hair) {
  const NetworkSize size = size_of(hair);
  const Index gates = 3 * size.hidden;
  VectorXf weights = VectorXf::Zero(size.weight_count());
  NetworkWeights<float> view(size, weights.data());
  view.input.leftCols(kPoseInputCount) = rows_of(hair.input_weights, gates, kPoseInputCount);
  if (!hair.wind.weights.empty())
    view.input.rightCols(kAirInputCount) = rows_of(hair.wind.weights, gates, kAirInputCount);
  view.hidden = rows_of(hair.hidden_weights, gates, size.hidden);
  view.bias = rows_of(hair.bias, gates, 1);
  view.output = rows_of(hair.output_weights, size.outputs, size.hidden);
  return weights;
}

void set_weights(const NetworkSize& size, VectorXf weights, LearntHair& hair) {
  for (float& weight : weights) weight = shortened(weight);
  const NetworkWeights<const float> view(size, weights.data());
  hair.hidden_count = static_cast<std::size_t>(size.hidden);
  hair.mode_count = static_cast<std::size_t>(size.outputs);
  hair.input_weights = by_rows(view.input.leftCols(kPoseInputCount));
  hair.hidden_weights = by_rows(view.hidden);
  hair.bias = by_rows(view.bias);
  hair.output_weights = by_rows(view.output);
  hair.wind.weights = by_rows(view.input.rightCols(kAirInputCount));
}

std::vector<LearntExamples> take_held_out(const Groom& groom, const std::shared_ptr<const LevelSet>& levels,
                                          const Modes& modes, std::uint32_t motion_count, std::size_t tick_count,
                                          const std::function<bool(double)>& keep_going,
                                          const ParallelFor& parallel_for) {
  const ExampleRequest request{.first_motion = kFirstHeldOut,
                               .motion_count = whole_thirty_twos(std::max(motion_count, 1u)),
                               .tick_count = tick_count,
                               .mode_count = static_cast<Index>(std::min(kMeasuredModes, modes.basis.mode_count())),
                               .with_low = true};
  return take_examples(groom, levels, modes, request, keep_going, parallel_for);
}

std::string judge(const std::vector<LearntExamples>& held_out, LearntHair& hair) {
  HAIRNET_ASSERT(!held_out.empty());
  struct Errors {
    MeanError own, low;
  };
  std::array<Errors, 2> errors;  // in still air, in wind
  const NetworkSize size = size_of(hair);
  const VectorXf weights = weights_of(hair);
  Network<float> network(size);
  for (const LearntExamples& e : held_out) {
    MatrixXf h = MatrixXf::Zero(size.hidden, kLearntWidth), wrong = e.coefficients;
    wrong.topRows(size.outputs) -= network.forward(weights, e.inputs, h);
    errors[e.in_wind].own.add(wrong, e.coefficients);
    errors[e.in_wind].low.add(e.low - e.coefficients, e.coefficients);
  }
  hair.error = errors[0].own.mean();
  hair.low_error = errors[0].low.mean();
  hair.wind.error = errors[1].own.mean();
  hair.wind.low_error = errors[1].low.mean();
  if (!(hair.wind.error <= hair.wind.low_error)) hair.wind.weights.clear();
  if (std::string fault = validate(hair); !fault.empty()) return fault;
  if (hair.error <= hair.low_error) return {};
  const auto percent = [](float share) { return std::to_string(std::lround(100 * share)) + " %"; };
  return "learnt hair errs by " + percent(hair.error) + " of the motion, and the low level by " +
         percent(hair.low_error);
}

}  // namespace hairnet
