#include "core/modes/leading_eigenvectors.hpp"

#include <Eigen/Eigenvalues>
#include <Eigen/QR>
#include <algorithm>

#include "core/assert.hpp"
#include "core/random.hpp"

namespace hairnet {
namespace {

using Eigen::Index;
using Eigen::MatrixXf;

// The iteration has this many vectors more than were asked for, so that the first ones converge in a few rounds.
constexpr Index kSpareVectors = 16;
// The rounds of subspace iteration from random vectors, and from vectors that are nearly the result.
constexpr int kRounds = 5, kRoundsFromNear = 2;

// Calls body(begin, count) for parts of [0, whole).
void in_parts(Index whole, const ParallelFor& parallel_for, const auto& body) {
  // Parts have a fixed width, so the bits do not depend on the number of threads.
  constexpr Index kPart = 48;
  run_loop(parallel_for, static_cast<std::size_t>((whole + kPart - 1) / kPart), [&](std::size_t part) {
    const Index begin = static_cast<Index>(part) * kPart;
    body(begin, std::min(kPart, whole - begin));
  });
}

// X X^T
MatrixXf covariance_of(const MatrixXf& x, const ParallelFor& parallel_for) {
  MatrixXf covariance(x.rows(), x.rows());
  in_parts(x.rows(), parallel_for, [&](Index begin, Index count) {
    const Index below = x.rows() - begin;
    covariance.block(begin, begin, below, count).noalias() =
        x.bottomRows(below) * x.middleRows(begin, count).transpose();
  });
  covariance.triangularView<Eigen::StrictlyUpper>() = covariance.transpose();
  return covariance;
}

}  // namespace

MatrixXf product(const MatrixXf& a, const MatrixXf& b, const ParallelFor& parallel_for) {
  HAIRNET_ASSERT(a.cols() == b.rows());
  MatrixXf out(a.rows(), b.cols());
  in_parts(b.cols(), parallel_for,
           [&](Index begin, Index count) { out.middleCols(begin, count).noalias() = a * b.middleCols(begin, count); });
  return out;
}

MatrixXf leading_eigenvectors(const MatrixXf& x, Index count, const ParallelFor& parallel_for, const MatrixXf& near) {
  HAIRNET_ASSERT(count <= x.rows());
  HAIRNET_ASSERT(near.size() == 0 || near.rows() == x.rows());
  const MatrixXf covariance = covariance_of(x, parallel_for);
  const Index kept = std::min(count + kSpareVectors, x.rows());
  Random random(1);
  MatrixXf vectors(x.rows(), kept);
  for (float& value : vectors.reshaped()) value = static_cast<float>(random.symmetric());
  const Index known = std::min(near.cols(), kept);
  if (known > 0) vectors.leftCols(known) = near.leftCols(known);
  for (int round = 0; round < (known < count ? kRounds : kRoundsFromNear); ++round) {
    // The vectors are made orthogonal in each round, as otherwise all of them would turn into the first eigenvector.
    const Eigen::HouseholderQR<MatrixXf> orthogonal(product(covariance, vectors, parallel_for));
    vectors = orthogonal.householderQ() * MatrixXf::Identity(x.rows(), kept);
  }
  const Eigen::SelfAdjointEigenSolver<MatrixXf> solver(vectors.transpose() *
                                                       product(covariance, vectors, parallel_for));
  HAIRNET_ASSERT(solver.info() == Eigen::Success);
  // Eigen sorts eigenvalues ascending; the largest come first here.
  return vectors * solver.eigenvectors().rightCols(count).rowwise().reverse();
}

}  // namespace hairnet
