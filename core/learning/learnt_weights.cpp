#include "core/learning/learnt_weights.hpp"

#include <bit>
#include <cstdint>
#include <vector>

#include "core/assert.hpp"

namespace hairnet {
namespace {

using Eigen::Index;
using Eigen::VectorXf;
using RowMajor = Eigen::Matrix<float, Eigen::Dynamic, Eigen::Dynamic, Eigen::RowMajor>;

// Rounds a weight to 8 bits after the first one.
float shortened(float weight) {
  // Half of the last kept bit is added first, so the number is rounded and not cut. The carry into the exponent is
  // right as well.
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

}  // namespace hairnet
