#pragma once

#include <limits>

#include "core/geometry/vec.hpp"

namespace hairnet {

// The least rotation that turns `from` onto `to`; about some normal of `from` if they are opposite. Neither may be
// zero. Eigen's FromTwoVectors does the same by a singular value decomposition, which costs each source seconds to
// compile.
template <typename Scalar>
Eigen::Quaternion<Scalar> rotation_between(const Eigen::Matrix<Scalar, 3, 1>& from,
                                           const Eigen::Matrix<Scalar, 3, 1>& to) {
  constexpr Scalar kOpposite = 16 * std::numeric_limits<Scalar>::epsilon();
  const Eigen::Matrix<Scalar, 3, 1> a = from.normalized(), b = to.normalized();
  const Scalar real = 1 + a.dot(b);
  const Eigen::Matrix<Scalar, 3, 1> axis = real > kOpposite ? a.cross(b).eval() : a.unitOrthogonal();
  Eigen::Quaternion<Scalar> turn;
  turn.w() = real > kOpposite ? real : Scalar(0);
  turn.vec() = axis;
  return turn.normalized();
}

}  // namespace hairnet
