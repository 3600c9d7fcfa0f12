#include "core/learning/learn_hair.hpp"

#include <algorithm>
#include <array>
#include <cmath>
#include <numbers>
#include <utility>

#include "core/assert.hpp"
#include "core/learning/learnt_examples.hpp"
#include "core/learning/learnt_weights.hpp"
#include "core/learning/network.hpp"
#include "core/learning/validation.hpp"
#include "core/random.hpp"

namespace hairnet {
namespace {

using Eigen::Index;
using Eigen::MatrixXf;
using Eigen::VectorXf;

static_assert(kLearntModesMax <= kModeCountMax);

// The groups of sixteen motions (kLearntWidth) in one step of descent. Each may have a thread of its own. Their
// gradients are added in order, so the result does not depend on threads.
constexpr std::size_t kSixteensAStep = 2;
constexpr std::size_t kInputCount = kPoseInputCount + kAirInputCount;

// Divisors that make the examples numbers of about 1.
struct Scales {
  // The RMS of each input.
  VectorXf input;
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

// Adam with decoupled weight decay (AdamW).
class Descent {
 public:
  Descent(Index count, double decay)
      : first_(VectorXf::Zero(count)), second_(first_), decay_(static_cast<float>(decay)) {}

  void step(VectorXf gradient, float rate, VectorXf& weights) {
    constexpr float kFirst = 0.9f, kSecond = 0.99f, kNormMax = 1;
    const float norm = gradient.norm();
    // The gradient is clipped, since one rare wild motion must not throw the weights far away.
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

// The weights with which learning begins.
VectorXf first_weights(const NetworkSize& size) {
  VectorXf weights = VectorXf::Zero(size.weight_count());
  NetworkWeights<float> view(size, weights.data());
  // The seed is fixed, so that the same groom gets the same network.
  Random random(1);
  const auto fill = [&](auto& matrix, double deviation) {
    for (float& weight : matrix.reshaped()) weight = static_cast<float>(deviation * random.bell());
  };
  fill(view.input, 1 / std::sqrt(static_cast<double>(size.inputs)));
  fill(view.hidden, 1 / std::sqrt(static_cast<double>(size.hidden)));
  fill(view.output, 0.3 / std::sqrt(static_cast<double>(size.hidden)));
  // The biases of z and r make hair move slowly at first, and each hidden number follow the others.
  view.bias.head(size.hidden).setConstant(-1);
  view.bias.tail(size.hidden).setConstant(1);
  return weights;
}

// Fits the network's weights to the examples by backpropagation through windows of time. Examples and results are
// divided by the scales. Empty when cancelled.
VectorXf fit(std::vector<LearntExamples> examples, const Scales& scales, const NetworkSize& size,
             const HairLearning& learning, const std::function<bool(double)>& keep_going,
             const ParallelFor& parallel_for) {
  const std::vector<VectorXf> weights_of_motions = motion_weights(examples);
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
    // Each round starts at rest and carries the hidden numbers from window to window, but gradients end with their
    // window.
    for (MatrixXf& h : hidden) h = MatrixXf::Zero(size.hidden, kLearntWidth);
    for (Index begin = 0; begin < windows * columns; begin += columns) {
      for (std::size_t first = 0; first < examples.size(); first += kSixteensAStep) {
        const std::size_t count = std::min(kSixteensAStep, examples.size() - first);
        run_loop(parallel_for, count, [&](std::size_t i) {
          const std::size_t e = first + i;
          const auto x = examples[e].inputs.middleCols(begin, columns);
          MatrixXf error =
              networks[i].forward(weights, x, hidden[e]) - examples[e].coefficients.middleCols(begin, columns);
          for (Index c = 0; c < columns; ++c) error.col(c) *= 2 * weights_of_motions[e][c % kLearntWidth];
          gradients[i].setZero(weights.size());
          networks[i].backward(weights, x, error / static_cast<float>(columns), gradients[i]);
        });
        for (std::size_t i = 1; i < count; ++i) gradients[0] += gradients[i];
        const double done = static_cast<double>(step) / static_cast<double>(step_count);
        if (!keep_going(done)) return {};
        // The rate rises over the first 50 steps, while Adam's averages are not yet reliable, then falls as a cosine.
        const double warm = std::min(1.0, static_cast<double>(++step) / 50);
        const double rate = warm * learning.rate * (0.01 + 0.99 * 0.5 * (1 + std::cos(std::numbers::pi * done)));
        descent.step(gradients[0], static_cast<float>(rate), weights);
      }
    }
  }
  return weights;
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
  const std::vector<LearntExamples> validation =
      take_validation_examples(groom, levels, modes, learning.validation_count, request.tick_count,
                               at(0.5, 0.55, "moving the hair"), parallel_for);
  if (validation.empty()) return nullptr;

  const Scales scales = scales_of(seen);
  const NetworkSize size{kInputCount, static_cast<Index>(learning.hidden_count), request.mode_count};
  auto hair = std::make_shared<LearntHair>();
  VectorXf most = VectorXf::Zero(kPoseInputCount);
  for (const LearntExamples& e : seen) {
    most = most.cwiseMax(e.inputs.topRows(kPoseInputCount).cwiseAbs().rowwise().maxCoeff());
    hair->wind.max_m_per_s =
        std::max(hair->wind.max_m_per_s, e.inputs.bottomRows(kAirInputCount).colwise().norm().maxCoeff());
  }
  std::ranges::copy(most, hair->most.begin());
  VectorXf weights = fit(std::move(seen), scales, size, learning, at(0.55, 1, "learning the hair"), parallel_for);
  if (weights.size() == 0) return nullptr;
  NetworkWeights<float> view(size, weights.data());
  // The scales go into the weights, so that evaluation needs none.
  view.input *= scales.input.cwiseInverse().asDiagonal();
  view.output *= scales.output;
  set_weights(size, std::move(weights), *hair);
  if (std::string error = judge(validation, *hair); !error.empty()) return Refusal(std::move(error));
  return hair;
}

}  // namespace hairnet
