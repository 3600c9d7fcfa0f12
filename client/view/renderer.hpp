#pragma once

#include <cstdint>
#include <memory>
#include <span>
#include <vector>

#include "core/geometry/triangle_mesh.hpp"
#include "core/geometry/vec.hpp"
#include "core/result.hpp"

namespace hairnet::view {

// 8-bit RGBA, rows from the top.
struct Image {
  int width = 0, height = 0;
  std::vector<std::uint8_t> rgba;
};
Result<std::vector<std::uint8_t>> encode_png(const Image& image);
// Tiles of one size side by side, row by row.
Image contact_sheet(std::span<const Image> tiles, int columns, int gap_px = 4);

struct Camera {
  Vec3f eye{0, 0, 1}, target{0, 0, 0}, up{0, 1, 0};
  float fov_deg = 30;              // vertical
};

// What one character looks like at one moment, all in world space, m.
struct DrawnCharacter {
  std::span<const Vec3f> body_vertices;                           // skinned
  const std::vector<std::array<std::uint32_t, 3>>* triangles = nullptr;
  std::span<const Vec3f> strand_points;
  std::span<const std::uint32_t> strand_begin;                    // strand_count + 1
  float strand_width_m = 4e-4f;                                   // drawn width at the root; tapers to the tip
  Vec3f hair_colour{0.16f, 0.07f, 0.03f};                         // linear RGB albedo
  Vec3f skin_colour{0.75f, 0.52f, 0.42f};
};

// Off-screen OpenGL ES 3 through EGL (surfaceless; Mesa's software renderer suffices). One thread.
class Renderer {
 public:
  static Result<std::unique_ptr<Renderer>> create();   // one line that says what is missing
  virtual ~Renderer() = default;
  virtual Image draw(std::span<const DrawnCharacter> characters, const Camera& camera, int width, int height) = 0;
};

}  // namespace hairnet::view
