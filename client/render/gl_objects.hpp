#pragma once

#include <GLES3/gl3.h>

#include <utility>

namespace hairnet::render {

// Owns one OpenGL name: the functions of OpenGL that make and delete it are the template's arguments. The context in
// which it was made must be current when it is made, used and destroyed.
template <void (*kMake)(GLsizei, GLuint*), void (*kDelete)(GLsizei, const GLuint*)>
class GlObject {
 public:
  GlObject() { kMake(1, &name_); }
  // A name of 0 is none, and is not deleted.
  GlObject(GlObject&& other) noexcept : name_(std::exchange(other.name_, 0)) {}
  GlObject& operator=(GlObject&& other) noexcept {
    std::swap(name_, other.name_);
    return *this;
  }
  GlObject(const GlObject&) = delete;
  GlObject& operator=(const GlObject&) = delete;
  ~GlObject() {
    if (name_ != 0) kDelete(1, &name_);
  }
  [[nodiscard]] GLuint name() const { return name_; }

 private:
  GLuint name_ = 0;
};

using Buffer = GlObject<glGenBuffers, glDeleteBuffers>;
using VertexArray = GlObject<glGenVertexArrays, glDeleteVertexArrays>;
using Texture = GlObject<glGenTextures, glDeleteTextures>;
using Renderbuffer = GlObject<glGenRenderbuffers, glDeleteRenderbuffers>;
using Framebuffer = GlObject<glGenFramebuffers, glDeleteFramebuffers>;

}  // namespace hairnet::render
