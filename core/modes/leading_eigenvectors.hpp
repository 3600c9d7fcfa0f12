#pragma once

#include <Eigen/Core>

#include "core/parallel_for.hpp"

namespace hairnet {

// A B, with the same bits for any `parallel_for`.
Eigen::MatrixXf product(const Eigen::MatrixXf& a, const Eigen::MatrixXf& b, const ParallelFor& parallel_for);

// The eigenvectors of the largest eigenvalues of X X^T, the largest first, by subspace iteration. A column of the
// result is a vector of length 1. `near`: vectors that are nearly those, the first ones first, for which fewer rounds
// are enough; or none. The same bits for any `parallel_for`. Asserts that X has at least `count` rows.
Eigen::MatrixXf leading_eigenvectors(const Eigen::MatrixXf& x, Eigen::Index count, const ParallelFor& parallel_for,
                                     const Eigen::MatrixXf& near = {});

}  // namespace hairnet
