#include "core/geometry/symmetric_matrix.hpp"

#include <Eigen/Cholesky>
#include <Eigen/Eigenvalues>

namespace hairnet {
namespace {

template <int kSize>
SymmetricEigen<kSize> eigen_of(const Eigen::Matrix<double, kSize, kSize>& symmetric) {
  const Eigen::SelfAdjointEigenSolver<Eigen::Matrix<double, kSize, kSize>> solver(symmetric);
  return {solver.eigenvalues(), solver.eigenvectors()};
}

}  // namespace

SymmetricEigen<3> symmetric_eigen(const Mat3& symmetric) {
  return eigen_of<3>(symmetric);
}

SymmetricEigen<4> symmetric_eigen(const Eigen::Matrix4d& symmetric) {
  return eigen_of<4>(symmetric);
}

Eigen::VectorXd solve_symmetric(const Eigen::MatrixXd& symmetric, const Eigen::VectorXd& right) {
  return symmetric.ldlt().solve(right);
}

}  // namespace hairnet
