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
  // Whether the transforms of the prims above have no effect on this prim (!resetXformStack!).
  bool resets = false;
  // Whether an operation has more than one sample in time.
  bool is_animated = false;
  // The names of operations that cannot be read.
  std::vector<std::string> unread;
};
LocalTransform local_transform(const Prim& prim);

// Reads a matrix4d as USD writes it, for points that are rows, into a matrix for points that are columns. None where
// the value is none.
std::optional<Eigen::Matrix4d> matrix_of(std::string_view value);

}  // namespace hairnet::usda
