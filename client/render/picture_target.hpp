#pragma once

#include "client/render/gl_objects.hpp"
#include "client/render/renderer.hpp"

namespace hairnet::render {

// The targets of a picture: a supersampled one, several samples a pixel, sRGB with depth; and the small one into which
// it is filtered, and from which it is read. The shader that filters encodes sRGB by itself, with noise against
// banding, so the small one stores colours as they are.
class PictureTarget {
 public:
  // Recreates the targets when the size changes. Returns false when the GPU cannot; the next call then tries again.
  bool resize(int width, int height, int supersample);
  void begin_large() const;
  // Resolves the samples of the large picture and binds it as `source`, and the small one as the target.
  void begin_small() const;
  // Reads from the GPU, and waits for it. Rows are from the top, unlike OpenGL's.
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
