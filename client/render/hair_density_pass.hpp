#pragma once

#include <cstddef>

#include "client/draw/density_grid.hpp"
#include "client/render/groom_buffers.hpp"
#include "client/render/program.hpp"

namespace hairnet::render {

// Follows the light through hair that moves: adds the placed points of strands to grids of density, and marches from
// each cell towards the lights (client/shaders/density.glsl). Its textures are bound to their own units.
class HairDensityPass {
 public:
  static Result<HairDensityPass> build();

  // Whether the device can draw and blend half floats.
  [[nodiscard]] bool is_supported() const { return is_supported_; }
  // Begins a picture with that many grids. Changes the bound framebuffer, viewport and blending.
  void begin(std::size_t grids);
  // Adds the first `points` points of the groom for `characters` with records from `first_record` on. Records and
  // placed points must be bound.
  void add(const GroomBuffers& groom, std::size_t points, std::size_t first_record, std::size_t characters) const;
  // Finds the light of `characters`, all records of the picture. The lights of `light()` must be set.
  void finish(std::size_t characters) const;
  [[nodiscard]] const Program& light() const { return light_; }

 private:
  HairDensityPass(Program points, Program light) : points_(std::move(points)), light_(std::move(light)) {}
  bool allocate();

  Program points_, light_;
  Texture density_, now_, rest_;
  Framebuffer density_target_, light_target_;
  VertexArray nothing_;
  std::size_t rows_ = 0;
  bool is_supported_ = true;
};

}  // namespace hairnet::render
