#pragma once

#include <cstddef>

#include "client/draw/density_grid.hpp"
#include "client/render/groom_buffers.hpp"
#include "client/render/shader_program.hpp"

namespace hairnet::render {

// Follows the light through hair that moves: adds the placed points of strands to grids of density, and marches from
// each cell towards the lights (client/shaders/density.glsl). Light that was traced for the resting hair changes by the
// difference between both. Its textures stay bound to their own units, where the strands' shader reads them.
class HairDensityPass {
 public:
  static Result<HairDensityPass> build();

  // Whether the device can draw and blend half floats. Without that, hair keeps the light that it has at rest.
  [[nodiscard]] bool is_supported() const { return is_supported_; }
  // Begins a picture with that many grids, and clears them. Changes the bound framebuffer, viewport and blending: call
  // add() next, for each groom, then finish().
  void begin(std::size_t grids);
  // Adds the first `points` points of the groom for `characters` whose records begin at `first_record`. Records and
  // placed points must be bound, and the bound framebuffer must be that of begin().
  void add(const GroomBuffers& groom, std::size_t points, std::size_t first_record, std::size_t characters) const;
  // Finds the light of `characters`, all records of the picture. The lights of `light()` must be set. Leaves its own
  // framebuffer bound.
  void finish(std::size_t characters) const;
  [[nodiscard]] const Program& light() const { return light_; }

 private:
  HairDensityPass(Program points, Program light) : points_(std::move(points)), light_(std::move(light)) {}
  bool allocate();

  Program points_, light_;
  // density_ has the hair's density; now_ and rest_ have the optical depths towards the lights, for the hair as it is
  // and at rest.
  Texture density_, now_, rest_;
  Framebuffer density_target_, light_target_;
  VertexArray nothing_;
  // The rows of the textures. They only grow, since grids come and go with the camera.
  std::size_t rows_ = 0;
  bool is_supported_ = true;
};

}  // namespace hairnet::render
