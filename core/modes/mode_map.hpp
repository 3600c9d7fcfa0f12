#pragma once

#include <Eigen/Core>
#include <span>

#include "core/modes/basis.hpp"
#include "core/modes/mode_map_kernel.hpp"

namespace hairnet {

// Gives the coefficients of a basis from the displacements of one level's active nodes: c = R d. Hair at rest has no
// coefficients on any level. Immutable; all threads may share it.
class ModeMap {
 public:
  // R, [mode][node, x y z].
  using Matrix = Eigen::Matrix<float, Eigen::Dynamic, Eigen::Dynamic, Eigen::RowMajor>;

  ModeMap() = default;
  explicit ModeMap(Matrix matrix) : matrix_(std::move(matrix)) {}

  // The first coefficients, m, of displacements in head space, m. Asserts that there are not more than modes, and one
  // displacement a node.
  void coefficients_of(std::span<const Vec3f> displacements, std::span<float> out) const;
  // Does the same for up to kModeMapWidth characters at once: each number of the matrix is read once for all. Results
  // differ from those of one character by rounding. Asserts also that there is one `out` a character, all equally long.
  void coefficients_of(std::span<const std::span<const Vec3f>> displacements,
                       std::span<const std::span<float>> out) const;
  [[nodiscard]] const Matrix& matrix() const { return matrix_; }

 private:
  Matrix matrix_;
};

// The map of the basis's own level: least squares in its hair's metric G,
//
//     c = (M^T G M)^-1 M^T G d.
//
// Asserts that G has one row a node.
ModeMap make_projection(const Basis& basis, const Eigen::MatrixXf& metric);

}  // namespace hairnet
