#pragma once

#include <Eigen/Core>
#include <Eigen/Geometry>

namespace hairnet {

// Suffix f is float: groom data, lattice state and everything on the wire. Without it, double: poses and building.
using Vec3 = Eigen::Vector3d;
using Vec3f = Eigen::Vector3f;
using Mat3 = Eigen::Matrix3d;
using Mat3f = Eigen::Matrix3f;
using Quat = Eigen::Quaterniond;

}  // namespace hairnet
