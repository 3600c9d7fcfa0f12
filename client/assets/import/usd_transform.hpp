#pragma once

#include <Eigen/Core>
#include <string>
#include <vector>

#include "client/assets/import/usda.hpp"

namespace hairnet::usda {

// What a prim's xformOps do with the points below it, as a matrix for columns. Samples are taken at their first time.
// The matrix applies to points of the prim and leads to its parent.
struct LocalTransform {
  Eigen::Matrix4d matrix = Eigen::Matrix4d::Identity();
  // The transforms of the prims above do not count.
  bool resets = false;
  bool is_animated = false;
  // Holds the names of operations that cannot be read.
  std::vector<std::string> unread;
};
LocalTransform local_transform(const Prim& prim);

// A matrix4d as it is written, for rows; none when the value is none.
std::optional<Eigen::Matrix4d> matrix_of(std::string_view value);

}  // namespace hairnet::usda
