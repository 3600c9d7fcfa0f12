#pragma once

#include <array>
#include <cstdint>
#include <memory>
#include <span>
#include <string_view>
#include <vector>

#include "core/geometry/triangle_mesh.hpp"
#include "core/geometry/vec.hpp"
#include "core/result.hpp"

namespace hairnet::view {

// 8-bit RGBA (sRGB), rows from the top.
struct Image {
  int width = 0, height = 0;
  std::vector<std::uint8_t> rgba;
};
Result<std::vector<std::uint8_t>> encode_png(const Image& image);
// Tiles of one size side by side, row by row.
Image contact_sheet(std::span<const Image> tiles, int columns, int gap_px = 4);
// Dark letters of 5x7 dots, each `scale` pixels wide; what falls outside the image is cut. Printable ASCII, the rest is
// '?'.
void draw_text(Image& image, int x_px, int y_px, std::string_view text, int scale = 2);

struct Camera {
  Vec3f eye{0, 0, 1}, target{0, 0, 0}, up{0, 1, 0};
  float fov_deg = 30;  // vertical
};

// What else is drawn in the hair: a cloth; a strip, a ribbon of textured hair; a thread, a round cord.
struct DrawnSurface {
  enum class Kind : std::uint8_t { cloth, strip, thread };
  Kind kind = Kind::cloth;
  std::span<const Vec3f> points;  // a strip's: left, right … from the root; a thread's: its line
  std::span<const std::array<std::uint32_t, 3>> triangles{};  // of a cloth; its first point has the index `first_index`
  std::uint32_t first_index = 0;
  Vec3f colour{0.8f, 0.8f, 0.8f};  // linear RGB albedo; a strip has the hair's
  float opacity = 1;               // of a cloth; below 1 light and what is behind come through
  float radius_m = 1e-3f;          // of a thread
};

// What one character looks like at one moment, all in world space, m.
struct DrawnCharacter {
  std::span<const Vec3f> body_vertices;  // skinned
  const std::vector<std::array<std::uint32_t, 3>>* triangles = nullptr;
  std::span<const Vec3f> strand_points;
  std::span<const std::uint32_t> strand_begin;  // strand_count + 1
  std::span<const DrawnSurface> surfaces;
  float strand_width_m = 4e-4f;            // drawn width at the root; tapers to the tip
  Vec3f hair_colour{0.16f, 0.07f, 0.03f};  // linear RGB albedo
  Vec3f skin_colour{0.75f, 0.52f, 0.42f};
};

// How pictures are made. The lights stand about the camera: key above its left, fill at its right, rim behind.
struct Look {
  int follower_count = 2;             // thin copies drawn beside every strand, 0 … 15
  float follower_spread_m = 2.5e-3f;  // how far a copy strays from its strand
  int supersample = 2;                // samples along a pixel's side, 1 … 4; fewer in very large pictures
  float exposure = 1;                 // multiplies all light, not the background
  Vec3f background_top{0.80f, 0.81f, 0.82f}, background_bottom{0.52f, 0.53f, 0.55f};  // linear RGB
};

inline constexpr int kPictureSideMax = 8192;

// Off-screen OpenGL ES 3 through EGL (surfaceless; Mesa's software renderer suffices). One thread.
class Renderer {
 public:
  static Result<std::unique_ptr<Renderer>> create(const Look& look = {});  // one line that says what is missing
  virtual ~Renderer() = default;
  // Points and vertices that are not finite, or over 10 km away, are left out; a strand of fewer than two points shows
  // nothing. One line when offsets or triangles name what is not there, or the size is not 1 … kPictureSideMax.
  virtual Result<Image> draw(std::span<const DrawnCharacter> characters, const Camera& camera, int width,
                             int height) = 0;
};

}  // namespace hairnet::view
