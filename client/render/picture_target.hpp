#pragma once

#include "client/render/gl_objects.hpp"
#include "client/render/renderer.hpp"

namespace hairnet::render {

// The targets of a picture: a supersampled one, several samples a pixel, sRGB with depth; and the small one into which
// it is filtered, and from which it is read.
class PictureTarget {
 public:
  // Recreates the targets when the size changes. Returns false when the GPU cannot.
  bool resize(int width, int height, int supersample);
  void begin_large() const;
  void begin_small() const;  // resolves the samples of the large picture and binds it as `source`
  [[nodiscard]] Image read_small() const;
  [[nodiscard]] int large_width() const { return width_ * supersample_; }
  [[nodiscard]] int large_height() const { return height_ * supersample_; }
  [[nodiscard]] int supersample() const { return supersample_; }

 private:
  int width_ = 0, height_ = 0, supersample_ = 0;
  Renderbuffer samples_, depth_samples_;
  Texture large_, small_;
  Framebuffer samples_target_, large_target_, small_target_;
};

}  // namespace hairnet::render
