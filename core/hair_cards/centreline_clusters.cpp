#include "core/hair_cards/centreline_clusters.hpp"

#include <algorithm>
#include <functional>
#include <limits>
#include <numeric>
#include <utility>

#include "core/assert.hpp"
#include "core/random.hpp"

namespace hairnet {
namespace {

// A centreline as a column: the points of its outline, m. Neighbours on the scalp should stay together, so roots weigh
// more.
constexpr Eigen::Index kNumbers = 3 * static_cast<Eigen::Index>(kOutlinePoints);
constexpr float kRootWeight = 1.5f;
using Columns = Eigen::Matrix<float, kNumbers, Eigen::Dynamic>;

constexpr std::size_t kLearntFrom = 20'000;  // centrelines; the others join the nearest of the clusters that these give
constexpr int kClusterRounds = 12;
constexpr Eigen::Index kBlock = 1024;  // columns compared at once

Columns columns_of(std::span<const Centreline> centrelines, std::span<const std::uint32_t> members) {
  Columns columns(kNumbers, static_cast<Eigen::Index>(members.size()));
  for (std::size_t m = 0; m < members.size(); ++m) {
    HAIRNET_ASSERT(members[m] < centrelines.size());
    const auto& outline = centrelines[members[m]].outline;
    for (std::size_t i = 0; i < kOutlinePoints; ++i) {
      columns.col(static_cast<Eigen::Index>(m)).segment<3>(3 * static_cast<Eigen::Index>(i)) =
          (i == 0 ? kRootWeight : 1.0f) * outline[i];
    }
  }
  return columns;
}

// Chooses first centres at random, with a probability that grows with the distance from those chosen before (k-means++,
// Arthur and Vassilvitskii 2007). Returns fewer than `count` when there are fewer distinct columns.
Columns first_centres(const Columns& columns, std::size_t count) {
  HAIRNET_ASSERT(count > 0);
  HAIRNET_ASSERT(count <= static_cast<std::size_t>(columns.cols()));
  Random random(1);
  Columns centres(kNumbers, static_cast<Eigen::Index>(count));
  Eigen::VectorXf nearest2 = Eigen::VectorXf::Constant(columns.cols(), std::numeric_limits<float>::max());
  auto next = static_cast<Eigen::Index>(random.unit() * static_cast<double>(columns.cols()));
  for (Eigen::Index c = 0; c < centres.cols(); ++c) {
    HAIRNET_ASSERT(next < columns.cols());
    centres.col(c) = columns.col(next);
    double sum = 0;
    for (Eigen::Index i = 0; i < columns.cols(); ++i) {
      nearest2[i] = std::min(nearest2[i], (columns.col(i) - centres.col(c)).squaredNorm());
      sum += static_cast<double>(nearest2[i]);
    }
    if (sum == 0) return centres.leftCols(c + 1);
    double left = random.unit() * sum;
    for (next = 0; next + 1 < columns.cols(); ++next) {
      left -= static_cast<double>(nearest2[next]);
      if (left < 0 && nearest2[next] > 0) break;
    }
  }
  return centres;
}

// For each column the nearest centre.
std::vector<Eigen::Index> nearest_centres(const Columns& columns, const Columns& centres) {
  HAIRNET_ASSERT(centres.cols() > 0);
  const Eigen::VectorXf squares = centres.colwise().squaredNorm();
  std::vector<Eigen::Index> nearest(static_cast<std::size_t>(columns.cols()));
  Eigen::MatrixXf products;
  for (Eigen::Index begin = 0; begin < columns.cols(); begin += kBlock) {
    const Eigen::Index count = std::min(kBlock, columns.cols() - begin);
    // |x - c|^2 minus |x|^2, which is the same for all centres.
    products.noalias() = centres.transpose() * columns.middleCols(begin, count);
    for (Eigen::Index i = 0; i < count; ++i)
      (squares - 2 * products.col(i)).minCoeff(&nearest[static_cast<std::size_t>(begin + i)]);
  }
  HAIRNET_VALIDATE(std::ranges::all_of(nearest, [&](Eigen::Index c) { return c >= 0 && c < centres.cols(); }));
  return nearest;
}

// Moves each centre to the mean of the columns that are nearest to it; a centre without such columns stays.
void move_to_means(const Columns& columns, const std::vector<Eigen::Index>& nearest, Columns& centres) {
  HAIRNET_ASSERT(std::cmp_equal(nearest.size(), columns.cols()));
  Eigen::Matrix<double, kNumbers, Eigen::Dynamic> sums(kNumbers, centres.cols());
  sums.setZero();
  std::vector<std::size_t> counts(static_cast<std::size_t>(centres.cols()), 0);
  for (std::size_t i = 0; i < nearest.size(); ++i) {
    sums.col(nearest[i]) += columns.col(static_cast<Eigen::Index>(i)).cast<double>();
    ++counts[static_cast<std::size_t>(nearest[i])];
  }
  for (Eigen::Index c = 0; c < centres.cols(); ++c) {
    const std::size_t count = counts[static_cast<std::size_t>(c)];
    if (count > 0) centres.col(c) = (sums.col(c) / static_cast<double>(count)).cast<float>();
  }
}

}  // namespace

std::vector<std::vector<std::uint32_t>> cluster_centrelines(std::span<const Centreline> centrelines,
                                                            std::span<const std::uint32_t> members, std::size_t count) {
  if (members.empty() || count == 0) return {};
  const std::size_t stride = (members.size() + kLearntFrom - 1) / kLearntFrom;
  std::vector<std::uint32_t> some;
  for (std::size_t m = 0; m < members.size(); m += stride) some.push_back(members[m]);
  const Columns learnt_from = columns_of(centrelines, some);
  Columns centres = first_centres(learnt_from, std::min(count, some.size()));
  for (int round = 0; round < kClusterRounds; ++round)
    move_to_means(learnt_from, nearest_centres(learnt_from, centres), centres);

  const std::vector<Eigen::Index> nearest = nearest_centres(columns_of(centrelines, members), centres);
  std::vector<std::vector<std::uint32_t>> clusters(static_cast<std::size_t>(centres.cols()));
  for (std::size_t m = 0; m < members.size(); ++m) clusters[static_cast<std::size_t>(nearest[m])].push_back(members[m]);
  std::erase_if(clusters, [](const auto& cluster) { return cluster.empty(); });
  HAIRNET_ASSERT(!clusters.empty());
  HAIRNET_ASSERT(clusters.size() <= count);
  HAIRNET_ASSERT(std::transform_reduce(clusters.begin(), clusters.end(), std::size_t{0}, std::plus{},
                                       [](const auto& cluster) { return cluster.size(); }) == members.size());
  return clusters;
}

}  // namespace hairnet
