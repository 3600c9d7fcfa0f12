#pragma once

#include <cstddef>
#include <vector>

#include "client/render/gl_objects.hpp"
#include "core/geometry/vec.hpp"

namespace hairnet::render {

// A texture of vectors in rows of a fixed width, bound to its own texture unit. It grows as needed; the caller must not
// fill more rows than a texture may have.
class VectorTexture {
 public:
  VectorTexture(GLint unit, std::size_t row) : unit_(unit), row_(row) {}
  void fill(const std::vector<Eigen::Vector4f>& values);
  void bind() const;

 private:
  Texture texture_;
  GLint unit_;
  std::size_t row_, capacity_ = 0;  // texels; rows
};

}  // namespace hairnet::render
