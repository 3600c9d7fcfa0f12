#include "client/view/picture_target.hpp"

#include "client/view/program.hpp"

namespace hairnet::view {
namespace {

void make_texture(Texture& texture, GLenum format, int width, int height) {
  texture = Texture();  // storage is immutable: a new size needs a new name
  glBindTexture(GL_TEXTURE_2D, texture.name());
  glTexStorage2D(GL_TEXTURE_2D, 1, format, width, height);
  glTexParameteri(GL_TEXTURE_2D, GL_TEXTURE_MIN_FILTER, GL_NEAREST);
  glTexParameteri(GL_TEXTURE_2D, GL_TEXTURE_MAG_FILTER, GL_NEAREST);
}

bool complete() {
  return glCheckFramebufferStatus(GL_FRAMEBUFFER) == GL_FRAMEBUFFER_COMPLETE;
}

}  // namespace

bool PictureTarget::resize(int width, int height, int supersample) {
  if (width == width_ && height == height_ && supersample == supersample_) return true;
  width_ = height_ = supersample_ = 0;
  glActiveTexture(GL_TEXTURE0 + kSourceUnit);
  make_texture(large_, GL_SRGB8_ALPHA8, width * supersample, height * supersample);
  make_texture(large_depth_, GL_DEPTH_COMPONENT24, width * supersample, height * supersample);
  make_texture(small_, GL_RGBA8, width, height);
  glBindFramebuffer(GL_FRAMEBUFFER, large_target_.name());
  glFramebufferTexture2D(GL_FRAMEBUFFER, GL_COLOR_ATTACHMENT0, GL_TEXTURE_2D, large_.name(), 0);
  glFramebufferTexture2D(GL_FRAMEBUFFER, GL_DEPTH_ATTACHMENT, GL_TEXTURE_2D, large_depth_.name(), 0);
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
  glBindFramebuffer(GL_FRAMEBUFFER, large_target_.name());
  glViewport(0, 0, large_width(), large_height());
}

void PictureTarget::begin_small() const {
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
  for (auto from = upwards.end(); from != upwards.begin(); from -= static_cast<std::ptrdiff_t>(row)) {
    image.rgba.insert(image.rgba.end(), from - static_cast<std::ptrdiff_t>(row), from);
  }
  return image;
}

}  // namespace hairnet::view
