#pragma once

#include <Eigen/Core>

#include "core/geometry/vec.hpp"

// Eigen's decompositions of small symmetric matrices take seconds to compile, so they are compiled once, here.
namespace hairnet {

// Eigenvalues in increasing order, and unit eigenvectors as columns in the same order.
template <int kSize>
struct SymmetricEigen {
  Eigen::Vector<double, kSize> values;
  Eigen::Matrix<double, kSize, kSize> vectors;
};
SymmetricEigen<3> symmetric_eigen(const Mat3& symmetric);
SymmetricEigen<4> symmetric_eigen(const Eigen::Matrix4d& symmetric);

// The solution x of symmetric * x = right, by Eigen's LDL^T; not finite where the matrix is singular.
Eigen::VectorXd solve_symmetric(const Eigen::MatrixXd& symmetric, const Eigen::VectorXd& right);

}  // namespace hairnet
