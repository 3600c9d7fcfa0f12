#include "client/render/picture_target.hpp"

#include "client/render/shader_program.hpp"

namespace hairnet::render {
namespace {

void make_texture(Texture& texture, GLenum format, int width, int height) {
  // Storage is immutable: a new size needs a new name.
  texture = Texture();
  glBindTexture(GL_TEXTURE_2D, texture.name());
  glTexStorage2D(GL_TEXTURE_2D, 1, format, width, height);
  glTexParameteri(GL_TEXTURE_2D, GL_TEXTURE_MIN_FILTER, GL_NEAREST);
  glTexParameteri(GL_TEXTURE_2D, GL_TEXTURE_MAG_FILTER, GL_NEAREST);
}

// The samples of a pixel: as many as OpenGL ES 3 guarantees for any device.
constexpr GLsizei kLargeSamples = 4;

void make_large_samples(const Renderbuffer& buffer, GLenum format, GLenum attachment, int width, int height) {
  glBindRenderbuffer(GL_RENDERBUFFER, buffer.name());
  glRenderbufferStorageMultisample(GL_RENDERBUFFER, kLargeSamples, format, width, height);
  glFramebufferRenderbuffer(GL_FRAMEBUFFER, attachment, GL_RENDERBUFFER, buffer.name());
}

bool complete() {
  return glCheckFramebufferStatus(GL_FRAMEBUFFER) == GL_FRAMEBUFFER_COMPLETE;
}

}  // namespace

bool PictureTarget::resize(int width, int height, int supersample) {
  if (width == width_ && height == height_ && supersample == supersample_) return true;
  // A failure leaves no size behind, so that the next call does not take the targets for complete.
  width_ = height_ = supersample_ = 0;
  // Errors of an earlier picture that did not fit into memory are taken off, so that they do not count against this
  // one.
  while (glGetError() != GL_NO_ERROR) {
  }
  glActiveTexture(GL_TEXTURE0 + kSourceUnit);
  const int large_width = width * supersample, large_height = height * supersample;
  glBindFramebuffer(GL_FRAMEBUFFER, samples_target_.name());
  make_large_samples(samples_, GL_SRGB8_ALPHA8, GL_COLOR_ATTACHMENT0, large_width, large_height);
  make_large_samples(depth_samples_, GL_DEPTH_COMPONENT24, GL_DEPTH_ATTACHMENT, large_width, large_height);
  if (!complete()) return false;
  make_texture(large_, GL_SRGB8_ALPHA8, large_width, large_height);
  make_texture(small_, GL_RGBA8, width, height);
  glBindFramebuffer(GL_FRAMEBUFFER, large_target_.name());
  glFramebufferTexture2D(GL_FRAMEBUFFER, GL_COLOR_ATTACHMENT0, GL_TEXTURE_2D, large_.name(), 0);
  if (!complete()) return false;
  glBindFramebuffer(GL_FRAMEBUFFER, small_target_.name());
  glFramebufferTexture2D(GL_FRAMEBUFFER, GL_COLOR_ATTACHMENT0, GL_TEXTURE_2D, small_.name(), 0);
  if (!complete() || glGetError() != GL_NO_ERROR) return false;
  width_ = width;
  height_ = height;
  supersample_ = supersample;
  return true;
}

void PictureTarget::begin_large() const {
  glBindFramebuffer(GL_FRAMEBUFFER, samples_target_.name());
  glViewport(0, 0, large_width(), large_height());
}

void PictureTarget::begin_small() const {
  glBindFramebuffer(GL_READ_FRAMEBUFFER, samples_target_.name());
  glBindFramebuffer(GL_DRAW_FRAMEBUFFER, large_target_.name());
  glBlitFramebuffer(0, 0, large_width(), large_height(), 0, 0, large_width(), large_height(), GL_COLOR_BUFFER_BIT,
                    GL_NEAREST);
  glBindFramebuffer(GL_FRAMEBUFFER, small_target_.name());
  glViewport(0, 0, width_, height_);
  glActiveTexture(GL_TEXTURE0 + kSourceUnit);
  glBindTexture(GL_TEXTURE_2D, large_.name());
}

Image PictureTarget::read_small() const {
  Image image;
  image.width = width_;
  image.height = height_;
  const std::size_t row = 4 * static_cast<std::size_t>(width_);
  std::vector<std::uint8_t> upwards(row * static_cast<std::size_t>(height_));
  glBindFramebuffer(GL_FRAMEBUFFER, small_target_.name());
  glPixelStorei(GL_PACK_ALIGNMENT, 1);
  glReadPixels(0, 0, width_, height_, GL_RGBA, GL_UNSIGNED_BYTE, upwards.data());
  image.rgba.reserve(upwards.size());
  // OpenGL's rows are from the bottom.
  for (auto from = upwards.end(); from != upwards.begin(); from -= static_cast<std::ptrdiff_t>(row)) {
    image.rgba.insert(image.rgba.end(), from - static_cast<std::ptrdiff_t>(row), from);
  }
  return image;
}

}  // namespace hairnet::render
