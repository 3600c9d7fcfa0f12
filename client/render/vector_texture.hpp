#pragma once

#include <cstddef>
#include <vector>

#include "client/render/gl_objects.hpp"
#include "core/geometry/vec.hpp"

namespace hairnet::render {

// A texture of vectors in rows of a fixed width, bound to its own texture unit. It grows as needed and is filled again
// for each picture; the caller must not fill more rows than a texture may have.
class VectorTexture {
 public:
  VectorTexture(GLint unit, std::size_t row) : unit_(unit), row_(row) {}
  // The rest of the last row keeps what it had: shaders must not read it.
  void fill(const std::vector<Eigen::Vector4f>& values);
  void bind() const;

 private:
  Texture texture_;
  GLint unit_;
  // The texels of a row, and the rows that are allocated.
  std::size_t row_, capacity_ = 0;
};

}  // namespace hairnet::render
