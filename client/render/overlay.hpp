#pragma once

#include <array>
#include <cstdint>
#include <memory>
#include <vector>

#include "client/draw/camera.hpp"
#include "core/geometry/vec.hpp"
#include "core/result.hpp"

namespace hairnet::render {

// A colour in sRGB, not linear.
using Rgba = std::array<std::uint8_t, 4>;

// Lines and points in the world, to be drawn over characters, such as lattices and springs. Positions are floats of the
// world: a millimetre coarse at 10 km.
struct Drawing {
  struct Vertex {
    std::array<float, 3> position_world;
    Rgba colour;
  };
  // There are two vertices for each line.
  std::vector<Vertex> lines;
  std::vector<Vertex> points;
  float point_px = 5;

  void line(const Vec3f& from, const Vec3f& to, const Rgba& colour) { line(from, to, colour, colour); }
  void line(const Vec3f& from, const Vec3f& to, const Rgba& from_colour, const Rgba& to_colour) {
    lines.push_back({{from.x(), from.y(), from.z()}, from_colour});
    lines.push_back({{to.x(), to.y(), to.z()}, to_colour});
  }
  void point(const Vec3f& at, const Rgba& colour) { points.push_back({{at.x(), at.y(), at.z()}, colour}); }
  void clear() {
    lines.clear();
    points.clear();
  }
  [[nodiscard]] bool empty() const { return lines.empty() && points.empty(); }
};

// Draws lines and points with OpenGL ES 3 into the bound framebuffer, over the picture of a Stage. The context in which
// it was made must be current at every call, also at its destruction. One thread.
class Overlay {
 public:
  static Result<std::unique_ptr<Overlay>> create();
  ~Overlay();
  // Tests against the existing depths, in the range with which they were drawn (Stage::depth_range): hidden parts show
  // faintly. It writes no depths, and leaves blending off.
  void draw(const Drawing& drawing, const draw::Camera& camera, const draw::DepthRange& range, int width, int height);

 private:
  struct Gl;
  explicit Overlay(std::unique_ptr<Gl> gl);
  std::unique_ptr<Gl> gl_;
};

}  // namespace hairnet::render
