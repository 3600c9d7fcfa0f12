#include "client/render/vector_texture.hpp"

#include <algorithm>

namespace hairnet::render {

void VectorTexture::fill(const std::vector<Eigen::Vector4f>& values) {
  bind();
  const auto width = static_cast<GLsizei>(row_);
  const std::size_t rows = values.size() / row_, rest = values.size() % row_;
  if (rows + 1 > capacity_) {
    GLint rows_max = 0;
    glGetIntegerv(GL_MAX_TEXTURE_SIZE, &rows_max);
    // Twice what is needed, so that a number of rows that varies allocates seldom.
    capacity_ = std::clamp<std::size_t>(2 * (rows + 1), 4, static_cast<std::size_t>(rows_max));
    glTexImage2D(GL_TEXTURE_2D, 0, GL_RGBA32F, width, static_cast<GLsizei>(capacity_), 0, GL_RGBA, GL_FLOAT, nullptr);
    for (const GLenum filter : {GL_TEXTURE_MIN_FILTER, GL_TEXTURE_MAG_FILTER})
      glTexParameteri(GL_TEXTURE_2D, filter, GL_NEAREST);
  }
  // Whole rows and the rest of one are two rectangles.
  if (rows > 0)
    glTexSubImage2D(GL_TEXTURE_2D, 0, 0, 0, width, static_cast<GLsizei>(rows), GL_RGBA, GL_FLOAT, values.data());
  if (rest > 0)
    glTexSubImage2D(GL_TEXTURE_2D, 0, 0, static_cast<GLint>(rows), static_cast<GLsizei>(rest), 1, GL_RGBA, GL_FLOAT,
                    values.data() + rows * row_);
}

void VectorTexture::bind() const {
  glActiveTexture(GL_TEXTURE0 + static_cast<GLenum>(unit_));
  glBindTexture(GL_TEXTURE_2D, texture_.name());
}

}  // namespace hairnet::render
