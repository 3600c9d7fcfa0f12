#include "client/render/strand_deform_pass.hpp"

#include <algorithm>

namespace hairnet::render {

Result<StrandDeformPass> StrandDeformPass::build() {
  auto programs = build_programs({{"points.vert", "deform_points.frag"}, {"points.vert", "limit_lengths.frag"}});
  if (!programs) return Refusal(programs.error());
  auto& [deform, place] = *programs;
  return StrandDeformPass(std::move(deform), std::move(place));
}

void StrandDeformPass::Points::allocate(GLint unit, std::size_t rows) const {
  glActiveTexture(GL_TEXTURE0 + static_cast<GLenum>(unit));
  glBindTexture(GL_TEXTURE_2D, texture.name());
  // The texture stores the bits of floats as integers: every device can draw into this format, while drawing into
  // floats is an extension.
  glTexImage2D(GL_TEXTURE_2D, 0, GL_RGBA32UI, static_cast<GLsizei>(kPointRow), static_cast<GLsizei>(rows), 0,
               GL_RGBA_INTEGER, GL_UNSIGNED_INT, nullptr);
  for (const GLenum filter : {GL_TEXTURE_MIN_FILTER, GL_TEXTURE_MAG_FILTER})
    glTexParameteri(GL_TEXTURE_2D, filter, GL_NEAREST);
  glBindFramebuffer(GL_FRAMEBUFFER, target.name());
  glFramebufferTexture2D(GL_FRAMEBUFFER, GL_COLOR_ATTACHMENT0, GL_TEXTURE_2D, texture.name(), 0);
}

void StrandDeformPass::reserve(std::size_t rows, std::size_t rows_max) {
  if (rows <= rows_) return;
  // A quarter more than is needed, so that a crowd that grows does not allocate in each picture; but not beyond the
  // limit on memory.
  rows_ = std::max(rows, std::min(rows + rows / 4, rows_max));
  GLint before = 0;
  glGetIntegerv(GL_FRAMEBUFFER_BINDING, &before);
  deformed_.allocate(kDeformedPointsUnit, rows_);
  placed_.allocate(kPlacedPointsUnit, rows_);
  glBindFramebuffer(GL_FRAMEBUFFER, static_cast<GLuint>(before));
}

void StrandDeformPass::place(const GroomBuffers& groom, std::size_t first_record, std::size_t characters) const {
  groom.bind_points();
  // The viewport covers all characters; the vertex shader puts each one's rectangle at its own rows.
  glViewport(0, 0, static_cast<GLsizei>(kPointRow), static_cast<GLsizei>(rows_));
  glBindVertexArray(nothing_.name());
  deform_.use();
  groom.skin().use(deform_);
  run(deform_, deformed_, first_record, characters);
  // The second pass reads what the first has written, for all characters of the groom.
  glActiveTexture(GL_TEXTURE0 + kDeformedPointsUnit);
  glBindTexture(GL_TEXTURE_2D, deformed_.texture.name());
  run(place_, placed_, first_record, characters);
}

void StrandDeformPass::run(const Program& pass, const Points& into, std::size_t first_record,
                           std::size_t characters) const {
  glBindFramebuffer(GL_FRAMEBUFFER, into.target.name());
  pass.use();
  pass.set("first_record", static_cast<int>(first_record));
  pass.set("target_rows", static_cast<int>(rows_));
  // Two triangles for each character cover its rows.
  glDrawArraysInstanced(GL_TRIANGLES, 0, 6, static_cast<GLsizei>(characters));
}

void StrandDeformPass::bind() const {
  glActiveTexture(GL_TEXTURE0 + kPlacedPointsUnit);
  glBindTexture(GL_TEXTURE_2D, placed_.texture.name());
}

}  // namespace hairnet::render
