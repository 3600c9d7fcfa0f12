#pragma once

#include <cstdint>
#include <memory>
#include <span>
#include <string_view>
#include <vector>

#include "client/render/stage.hpp"
#include "core/result.hpp"

namespace hairnet::render {

// A picture of 8-bit RGBA (sRGB), rows from the top, without gaps between them.
struct Image {
  int width = 0, height = 0;
  std::vector<std::uint8_t> rgba;
};
// Refuses an image whose bytes do not match its size.
Result<std::vector<std::uint8_t>> encode_png(const Image& image);
// Puts tiles of one size side by side, row by row. The first tile gives the size.
Image contact_sheet(std::span<const Image> tiles, int columns, int gap_px = 4);
// Draws dark letters of 5x7 dots, each `scale` pixels wide, and clips them to the image. Printable ASCII; other
// characters become '?'.
void draw_text(Image& image, int x_px, int y_px, std::string_view text, int scale = 2);

// A picture's largest width and height, pixels.
inline constexpr int kPictureSideMax = 8192;

// A stage that draws pictures without a window: off-screen OpenGL ES 3 through EGL (surfaceless; Mesa's software
// renderer suffices). It needs no average: each pixel has many samples instead. The same call gives the same bits on
// one machine and driver. One thread.
class Renderer {
 public:
  // `supersample` is the number of samples along a pixel's side in addition to those of the target, 1 ... 4; very large
  // pictures get fewer. The error is one line about what is missing.
  static Result<std::unique_ptr<Renderer>> create(int supersample = 2);
  virtual ~Renderer() = default;
  // Makes the context current, so that grooms can be added between other contexts' work.
  [[nodiscard]] virtual Stage& stage() = 0;
  // The error is one line: the size is not in 1 ... kPictureSideMax, or memory is not enough. The renderer can be used
  // again afterwards.
  virtual Result<Image> draw(std::span<const draw::ShownCharacter> characters, const draw::Camera& camera,
                             const Look& look, int width, int height) = 0;
};

}  // namespace hairnet::render
