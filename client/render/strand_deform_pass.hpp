#pragma once

#include <cstddef>

#include "client/render/groom_buffers.hpp"
#include "client/render/shader_program.hpp"

namespace hairnet::render {

// Places the points of strands before the strands are drawn: deforms them (paper 4), pushes them out of the skin, and
// limits every strand to its length at rest (SkinPush and StrandLengths in shaders). Two passes write textures of
// points, because the second walks along a strand's points of the first; client/shaders/strand_points.glsl has their
// layout. Each drawn vertex then reads its point, so FFD runs once a point, not once a vertex and follow hair.
// Points take 32 bytes each, 16 in each texture, for every character.
class StrandDeformPass {
 public:
  // The number of points in a row of the textures. Each character begins a row of its own, and so wastes less than one.
  static constexpr std::size_t kPointRow = 1024;
  // With this many rows both textures take 256 MiB. When a picture wants more, all characters get fewer strands.
  static constexpr std::size_t kRowsMax = 8192;

  static Result<StrandDeformPass> build();

  // Makes room for that many rows, those of all characters of a picture, and for some more up to `rows_max`, the limit
  // of a texture. The old contents are lost when the textures grow; they never shrink.
  void reserve(std::size_t rows, std::size_t rows_max);
  // Places the points of `characters` with the groom. Their records begin at `first_record` and have the rows of the
  // points. Records and lattices must be bound. Changes the bound framebuffer, viewport, program and vertex array.
  void place(const GroomBuffers& groom, std::size_t first_record, std::size_t characters) const;
  // Binds the placed points for drawing.
  void bind() const;
  // The framebuffer of placed points, for reading back.
  [[nodiscard]] GLuint placed() const { return placed_.target.name(); }
  [[nodiscard]] std::size_t bytes() const { return 2 * rows_ * kPointRow * 4 * sizeof(std::uint32_t); }

 private:
  struct Points {
    Texture texture;
    Framebuffer target;
    void allocate(GLint unit, std::size_t rows) const;
  };
  StrandDeformPass(Program deform, Program place) : deform_(std::move(deform)), place_(std::move(place)) {}
  void run(const Program& pass, const Points& into, std::size_t first_record, std::size_t characters) const;

  Program deform_, place_;
  Points deformed_, placed_;
  VertexArray nothing_;
  std::size_t rows_ = 0;
};

}  // namespace hairnet::render
