#pragma once

#include <array>
#include <cstdint>
#include <memory>
#include <vector>

#include "client/render/camera.hpp"
#include "core/geometry/vec.hpp"
#include "core/result.hpp"

namespace hairnet::render {

using Rgba = std::array<std::uint8_t, 4>;  // as on the screen, not linear

// Lines and points in the world, to be drawn over characters.
struct Drawing {
  struct Vertex {
    std::array<float, 3> position_world;
    Rgba colour;
  };
  std::vector<Vertex> lines;  // two a line
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

// Draws drawings with OpenGL ES 3 into whatever framebuffer is bound, over what a Stage left there. The context in
// which it was made is current at every call, and when it goes. One thread.
class Overlay {
 public:
  static Result<std::unique_ptr<Overlay>> create();
  ~Overlay();
  // Tested against the depths that are there, in the range that they were drawn with: what is hidden shows faintly.
  void draw(const Drawing& drawing, const Camera& camera, const DepthRange& range, int width, int height);

 private:
  struct Gl;
  explicit Overlay(std::unique_ptr<Gl> gl);
  std::unique_ptr<Gl> gl_;
};

}  // namespace hairnet::render
