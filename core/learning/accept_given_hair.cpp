#include "core/learning/accept_given_hair.hpp"

#include <Eigen/Cholesky>
#include <algorithm>
#include <cmath>
#include <utility>

#include "core/assert.hpp"
#include "core/learning/learnt_examples.hpp"
#include "core/learning/learnt_weights.hpp"
#include "core/learning/network.hpp"
#include "core/learning/validation.hpp"

namespace hairnet {
namespace {

using Eigen::Index;
using Eigen::MatrixXd;
using Eigen::MatrixXf;
using Eigen::VectorXf;

// The motions to which outputs are fitted, and those on which the hair is measured: an eighth of what learn_hair()
// takes, and as many as it takes.
constexpr std::uint32_t kMotions = 128, kValidationMotions = 32;
// The ticks of each motion, which lasts 6 s (kLearntTick_s).
constexpr std::size_t kTicks = 180;

// The outputs with the least squares, of a network whose outputs are its hidden numbers:
//
//     V = C W H^T (H W H^T + ridge)^-1.
MatrixXf fit_outputs(const VectorXf& weights, const NetworkSize& size, const std::vector<LearntExamples>& examples) {
  // The ridge of the regression, relative to the mean square of a hidden number.
  constexpr double kRidge = 1e-4;
  const std::vector<VectorXf> weights_of_motions = motion_weights(examples);
  MatrixXd squares = MatrixXd::Zero(size.hidden, size.hidden);
  MatrixXd products = MatrixXd::Zero(size.hidden, examples[0].coefficients.rows());
  Network<float> network(size);
  for (std::size_t e = 0; e < examples.size(); ++e) {
    MatrixXf h = MatrixXf::Zero(size.hidden, kLearntWidth);
    const MatrixXf hidden = network.forward(weights, examples[e].inputs, h);
    MatrixXf weighted = hidden;
    for (Index c = 0; c < hidden.cols(); ++c) weighted.col(c) *= weights_of_motions[e][c % kLearntWidth];
    squares += (weighted * hidden.transpose()).cast<double>();
    products += (weighted * examples[e].coefficients.transpose()).cast<double>();
  }
  squares.diagonal().array() += kRidge * squares.trace() / static_cast<double>(size.hidden) + 1e-30;
  return squares.llt().solve(products).transpose().cast<float>();
}

}  // namespace

Result<std::shared_ptr<const LearntHair>> accept_given_hair(const Groom& groom,
                                                            const std::shared_ptr<const LevelSet>& levels,
                                                            const Modes& modes, const LearntHair& given,
                                                            const BuildCallbacks& callbacks,
                                                            const ParallelFor& parallel_for) {
  HAIRNET_ASSERT(levels);
  HAIRNET_ASSERT(validate(given).empty());
  const auto at = [&callbacks](double begin, double end) {
    return [&callbacks, begin, end](double share) {
      return !callbacks.progress || callbacks.progress(begin + share * (end - begin), "moving the hair");
    };
  };
  const ExampleRequest request{
      .motion_count = kMotions,
      .tick_count = kTicks,
      .mode_count = static_cast<Index>(std::min(given.mode_count, modes.basis.mode_count() / 4 * 4))};
  const std::vector<LearntExamples> seen = take_examples(groom, levels, modes, request, at(0, 0.75), parallel_for);
  if (seen.empty()) return nullptr;
  const std::vector<LearntExamples> validation =
      take_validation_examples(groom, levels, modes, kValidationMotions, kTicks, at(0.75, 1), parallel_for);
  if (validation.empty()) return nullptr;

  // The recurrent part of the network does not depend on the basis and is kept. Its hidden numbers are the outputs at
  // first, so that the outputs for this basis are a linear fit.
  NetworkSize size = size_of(given);
  const VectorXf own = weights_of(given);
  const Index inner = own.size() - size.outputs * size.hidden;
  size.outputs = size.hidden;
  VectorXf weights(size.weight_count());
  weights.head(inner) = own.head(inner);
  NetworkWeights<float>(size, weights.data()).output.setIdentity();
  const MatrixXf outputs = fit_outputs(weights, size, seen);
  if (!outputs.allFinite()) return Refusal("learnt hair that does not move");
  size.outputs = request.mode_count;
  weights.conservativeResize(size.weight_count());
  NetworkWeights<float>(size, weights.data()).output = outputs;
  auto hair = std::make_shared<LearntHair>(given);
  set_weights(size, std::move(weights), *hair);
  // set_weights has stored zeros for hair that knows no wind.
  if (given.wind.weights.empty()) hair->wind.weights.clear();
  if (std::string error = judge(validation, *hair); !error.empty()) return Refusal(std::move(error));
  return hair;
}

}  // namespace hairnet
