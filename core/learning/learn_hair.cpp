#include "core/learning/learn_hair.hpp"

#include <algorithm>
#include <array>
#include <bit>
#include <cmath>
#include <numbers>
#include <utility>

#include "core/assert.hpp"
#include "core/learning/learnt_examples.hpp"
#include "core/learning/network.hpp"
#include "core/random.hpp"

namespace hairnet {
namespace {

using Eigen::Index;
using Eigen::MatrixXf;
using Eigen::VectorXf;

static_assert(kLearntModesMax <= kModeCountMax);

// Modes of which the error is measured; what the others move can be neglected.
constexpr std::size_t kMeasuredModes = 64;
// Motions of training have lower numbers.
constexpr std::uint32_t kFirstHeldOut = 1000000;
constexpr std::size_t kSixteensAStep = 2;
constexpr std::size_t kInputCount = kPoseInputCount + kAirInputCount;

std::uint32_t whole_thirty_twos(std::uint32_t count) {
  constexpr std::uint32_t kWhole = 2 * kLearntWidth;
  return (count + kWhole - 1) / kWhole * kWhole;
}

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

// The examples in numbers of about 1.
struct Scales {
  VectorXf input;  // their RMS
  float output = 1;
};

Scales scales_of(const std::vector<LearntExamples>& examples) {
  Scales scales{VectorXf::Zero(kInputCount), 0};
  Index columns = 0;
  for (const LearntExamples& e : examples) {
    scales.input += e.inputs.rowwise().squaredNorm();
    scales.output += e.coefficients.squaredNorm();
    columns += e.inputs.cols();
  }
  scales.input = (scales.input / static_cast<float>(columns)).cwiseSqrt().cwiseMax(1e-6f);
  scales.output = std::max(std::sqrt(scales.output / static_cast<float>(columns)), 1e-6f);
  return scales;
}

// Of each motion in the loss. Lively motions count more, but not so much that calm hair counts for nothing.
std::vector<VectorXf> weights_of(const std::vector<LearntExamples>& examples) {
  constexpr float kCalm_m = 0.005f;
  std::vector<VectorXf> weights;
  float sum = 0;
  for (const LearntExamples& e : examples) {
    VectorXf& own = weights.emplace_back(VectorXf::Zero(kLearntWidth));
    for (Index c = 0; c < e.coefficients.cols(); ++c) own[c % kLearntWidth] += e.coefficients.col(c).squaredNorm();
    own = ((own / static_cast<float>(e.tick_count())).cwiseSqrt().array() + kCalm_m).inverse();
    sum += own.sum();
  }
  for (VectorXf& own : weights) own *= static_cast<float>(kLearntWidth) * static_cast<float>(weights.size()) / sum;
  return weights;
}

// Adam, with weight decay beside it.
class Descent {
 public:
  Descent(Index count, double decay)
      : first_(VectorXf::Zero(count)), second_(first_), decay_(static_cast<float>(decay)) {}

  void step(VectorXf gradient, float rate, VectorXf& weights) {
    constexpr float kFirst = 0.9f, kSecond = 0.99f, kNormMax = 1;
    const float norm = gradient.norm();
    if (norm > kNormMax) gradient *= kNormMax / norm;
    ++steps_;
    first_ = kFirst * first_ + (1 - kFirst) * gradient;
    second_ = kSecond * second_ + (1 - kSecond) * gradient.cwiseAbs2();
    const float by_first = 1 / (1 - std::pow(kFirst, steps_)), by_second = 1 / (1 - std::pow(kSecond, steps_));
    weights.array() -=
        rate * (by_first * first_.array() / ((by_second * second_).array().sqrt() + 1e-8f) + decay_ * weights.array());
  }

 private:
  VectorXf first_, second_;
  float decay_, steps_ = 0;
};

VectorXf first_weights(const NetworkSize& size) {
  VectorXf weights = VectorXf::Zero(size.weight_count());
  NetworkWeights<float> view(size, weights.data());
  Random random(1);
  const auto fill = [&](auto& matrix, double deviation) {
    for (float& weight : matrix.reshaped()) weight = static_cast<float>(deviation * random.bell());
  };
  fill(view.input, 1 / std::sqrt(static_cast<double>(size.inputs)));
  fill(view.hidden, 1 / std::sqrt(static_cast<double>(size.hidden)));
  fill(view.output, 0.3 / std::sqrt(static_cast<double>(size.hidden)));
  view.bias.head(size.hidden).setConstant(-1);  // hair moves slowly at first,
  view.bias.tail(size.hidden).setConstant(1);   // and as the whole tells it
  return weights;
}

// Of the examples, which it scales. Empty when cancelled.
VectorXf fit(std::vector<LearntExamples> examples, const Scales& scales, const NetworkSize& size,
             const HairLearning& learning, const std::function<bool(double)>& keep_going,
             const ParallelFor& parallel_for) {
  const std::vector<VectorXf> motion_weights = weights_of(examples);
  std::vector<MatrixXf> hidden(examples.size());
  for (LearntExamples& e : examples) {
    e.inputs.array().colwise() /= scales.input.array();
    e.coefficients /= scales.output;
  }
  const auto window = std::clamp<Index>(std::lround(learning.window_s / kLearntTick_s), 1, examples[0].tick_count());
  const Index windows = examples[0].tick_count() / window, columns = window * kLearntWidth;
  VectorXf weights = first_weights(size);
  Descent descent(weights.size(), learning.decay);
  std::vector<Network<float>> networks(kSixteensAStep, Network<float>(size));
  std::vector<VectorXf> gradients(kSixteensAStep);

  const std::size_t step_count =
      static_cast<std::size_t>(learning.rounds * windows) * ((examples.size() + kSixteensAStep - 1) / kSixteensAStep);
  std::size_t step = 0;
  for (int round = 0; round < learning.rounds; ++round) {
    for (MatrixXf& h : hidden) h = MatrixXf::Zero(size.hidden, kLearntWidth);
    for (Index begin = 0; begin < windows * columns; begin += columns) {
      for (std::size_t first = 0; first < examples.size(); first += kSixteensAStep) {
        const std::size_t count = std::min(kSixteensAStep, examples.size() - first);
        run_loop(parallel_for, count, [&](std::size_t i) {
          const std::size_t e = first + i;
          const auto x = examples[e].inputs.middleCols(begin, columns);
          MatrixXf error =
              networks[i].forward(weights, x, hidden[e]) - examples[e].coefficients.middleCols(begin, columns);
          for (Index c = 0; c < columns; ++c) error.col(c) *= 2 * motion_weights[e][c % kLearntWidth];
          gradients[i].setZero(weights.size());
          networks[i].backward(weights, x, error / static_cast<float>(columns), gradients[i]);
        });
        for (std::size_t i = 1; i < count; ++i) gradients[0] += gradients[i];
        const double done = static_cast<double>(step) / static_cast<double>(step_count);
        if (!keep_going(done)) return {};
        const double warm = std::min(1.0, static_cast<double>(++step) / 50);
        const double rate = warm * learning.rate * (0.01 + 0.99 * 0.5 * (1 + std::cos(std::numbers::pi * done)));
        descent.step(gradients[0], static_cast<float>(rate), weights);
      }
    }
  }
  return weights;
}

// With 8 bits after the first: the network errs as much, and its file is packed into two thirds of the bytes.
float shortened(float weight) {
  return std::bit_cast<float>((std::bit_cast<std::uint32_t>(weight) + 0x4000u) & ~0x7fffu);
}

std::vector<float> by_rows(const auto& matrix) {
  std::vector<float> out;
  for (Index row = 0; row < matrix.rows(); ++row)
    for (Index column = 0; column < matrix.cols(); ++column) out.push_back(matrix(row, column));
  return out;
}

}  // namespace

Result<std::shared_ptr<const LearntHair>> learn_hair(const Groom& groom, const std::shared_ptr<const LevelSet>& levels,
                                                     const Modes& modes, const BuildCallbacks& callbacks,
                                                     const ParallelFor& parallel_for, const HairLearning& learning) {
  HAIRNET_ASSERT(levels);
  HAIRNET_ASSERT(learning.hidden_count % 4 == 0 && learning.mode_count % 4 == 0);
  const auto at = [&](double begin, double end, const char* stage) {
    return [&callbacks, begin, end, stage](double share) {
      return !callbacks.progress || callbacks.progress(begin + share * (end - begin), stage);
    };
  };
  ExampleRequest request;
  request.motion_count = whole_thirty_twos(std::max(learning.motion_count, 1u));
  request.tick_count = static_cast<std::size_t>(learning.duration_s / kLearntTick_s);
  request.mode_count = static_cast<Index>(std::min(learning.mode_count, modes.basis.mode_count()) / 4 * 4);
  std::vector<LearntExamples> seen =
      take_examples(groom, levels, modes, request, at(0, 0.5, "moving the hair"), parallel_for);
  if (seen.empty()) return nullptr;
  ExampleRequest held_out = request;
  held_out.first_motion = kFirstHeldOut;
  held_out.motion_count = whole_thirty_twos(std::max(learning.held_out_count, 1u));
  held_out.mode_count = static_cast<Index>(std::min(kMeasuredModes, modes.basis.mode_count()));
  held_out.with_low = true;
  const std::vector<LearntExamples> unseen =
      take_examples(groom, levels, modes, held_out, at(0.5, 0.55, "moving the hair"), parallel_for);
  if (unseen.empty()) return nullptr;

  const Scales scales = scales_of(seen);
  const NetworkSize size{kInputCount, static_cast<Index>(learning.hidden_count), request.mode_count};
  auto hair = std::make_shared<LearntHair>();
  VectorXf most = VectorXf::Zero(kPoseInputCount);
  for (const LearntExamples& e : seen) {
    most = most.cwiseMax(e.inputs.topRows(kPoseInputCount).cwiseAbs().rowwise().maxCoeff());
    hair->wind.most_m_per_s =
        std::max(hair->wind.most_m_per_s, e.inputs.bottomRows(kAirInputCount).colwise().norm().maxCoeff());
  }
  std::ranges::copy(most, hair->most.begin());
  VectorXf weights = fit(std::move(seen), scales, size, learning, at(0.55, 1, "learning the hair"), parallel_for);
  if (weights.size() == 0) return nullptr;
  NetworkWeights<float> view(size, weights.data());
  view.input *= scales.input.cwiseInverse().asDiagonal();
  view.output *= scales.output;
  for (float& weight : weights) weight = shortened(weight);
  hair->hidden_count = learning.hidden_count;
  hair->mode_count = static_cast<std::size_t>(size.outputs);
  hair->input_weights = by_rows(view.input.leftCols(kPoseInputCount));
  hair->hidden_weights = by_rows(view.hidden);
  hair->bias = by_rows(view.bias);
  hair->output_weights = by_rows(view.output);
  hair->wind.weights = by_rows(view.input.rightCols(kAirInputCount));
  struct Errors {
    MeanError own, low;
  };
  std::array<Errors, 2> errors;  // in still air, in wind
  Network<float> network(size);
  for (const LearntExamples& e : unseen) {
    MatrixXf h = MatrixXf::Zero(size.hidden, kLearntWidth), wrong = e.coefficients;
    wrong.topRows(size.outputs) -= network.forward(weights, e.inputs, h);
    errors[e.in_wind].own.add(wrong, e.coefficients);
    errors[e.in_wind].low.add(e.low - e.coefficients, e.coefficients);
  }
  hair->error = errors[0].own.mean();
  hair->low_error = errors[0].low.mean();
  hair->wind.error = errors[1].own.mean();
  hair->wind.low_error = errors[1].low.mean();
  if (hair->wind.error > hair->wind.low_error) hair->wind.weights.clear();
  if (const std::string fault = validate(*hair); !fault.empty()) return Refusal(fault);
  if (hair->error > hair->low_error) {
    const auto percent = [](float share) { return std::to_string(std::lround(100 * share)) + " %"; };
    return Refusal("learnt hair errs by " + percent(hair->error) + " of the motion, and the low level by " +
                   percent(hair->low_error));
  }
  return hair;
}

}  // namespace hairnet
