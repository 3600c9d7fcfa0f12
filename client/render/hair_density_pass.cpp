#include "client/render/hair_density_pass.hpp"

#include <array>

namespace hairnet::render {
namespace {

// The slices of a grid lie side by side; grids lie below each other.
constexpr auto kDensityWidth = static_cast<GLsizei>(draw::DensityGrid::kDensitySide * draw::DensityGrid::kDensitySide);

void allocate_halves(const Texture& texture, GLint unit, GLenum stored, GLenum format, std::size_t rows) {
  glActiveTexture(GL_TEXTURE0 + static_cast<GLenum>(unit));
  glBindTexture(GL_TEXTURE_2D, texture.name());
  glTexImage2D(GL_TEXTURE_2D, 0, static_cast<GLint>(stored), kDensityWidth, static_cast<GLsizei>(rows), 0, format,
               GL_HALF_FLOAT, nullptr);
  for (const GLenum filter : {GL_TEXTURE_MIN_FILTER, GL_TEXTURE_MAG_FILTER})
    glTexParameteri(GL_TEXTURE_2D, filter, GL_LINEAR);
  for (const GLenum wrap : {GL_TEXTURE_WRAP_S, GL_TEXTURE_WRAP_T})
    glTexParameteri(GL_TEXTURE_2D, wrap, GL_CLAMP_TO_EDGE);
}

}  // namespace

Result<HairDensityPass> HairDensityPass::build() {
  auto programs =
      build_programs({{"density_points.vert", "density_points.frag"}, {"density_light.vert", "density_light.frag"}});
  if (!programs) return Refusal(programs.error());
  auto& [points, light] = *programs;
  HairDensityPass pass(std::move(points), std::move(light));
  GLint before = 0;
  glGetIntegerv(GL_FRAMEBUFFER_BINDING, &before);
  pass.rows_ = draw::DensityGrid::kDensitySide;
  pass.is_supported_ = pass.allocate();
  glBindFramebuffer(GL_FRAMEBUFFER, static_cast<GLuint>(before));
  // A device that cannot makes errors here, which are not the next caller's.
  while (glGetError() != GL_NO_ERROR) {
  }
  return pass;
}

// Makes the textures for rows_, and returns whether all of them can be drawn to.
bool HairDensityPass::allocate() {
  allocate_halves(density_, kDensityUnit, GL_RG16F, GL_RG, rows_);
  allocate_halves(now_, kLightDepthNowUnit, GL_RGBA16F, GL_RGBA, rows_);
  allocate_halves(rest_, kLightDepthRestUnit, GL_RGBA16F, GL_RGBA, rows_);
  glBindFramebuffer(GL_FRAMEBUFFER, density_target_.name());
  glFramebufferTexture2D(GL_FRAMEBUFFER, GL_COLOR_ATTACHMENT0, GL_TEXTURE_2D, density_.name(), 0);
  const bool has_density = glCheckFramebufferStatus(GL_FRAMEBUFFER) == GL_FRAMEBUFFER_COMPLETE;
  glBindFramebuffer(GL_FRAMEBUFFER, light_target_.name());
  glFramebufferTexture2D(GL_FRAMEBUFFER, GL_COLOR_ATTACHMENT0, GL_TEXTURE_2D, now_.name(), 0);
  glFramebufferTexture2D(GL_FRAMEBUFFER, GL_COLOR_ATTACHMENT1, GL_TEXTURE_2D, rest_.name(), 0);
  // Light is written by two outputs at once: now and at rest.
  constexpr std::array<GLenum, 2> kBoth{GL_COLOR_ATTACHMENT0, GL_COLOR_ATTACHMENT1};
  glDrawBuffers(2, kBoth.data());
  return has_density && glCheckFramebufferStatus(GL_FRAMEBUFFER) == GL_FRAMEBUFFER_COMPLETE;
}

void HairDensityPass::begin(std::size_t grids) {
  if (grids * draw::DensityGrid::kDensitySide > rows_) {
    rows_ = grids * draw::DensityGrid::kDensitySide;
    allocate();
  }
  glBindVertexArray(nothing_.name());
  glBindFramebuffer(GL_FRAMEBUFFER, density_target_.name());
  glViewport(0, 0, kDensityWidth, static_cast<GLsizei>(rows_));
  // glClear would use the colour that the caller has set.
  constexpr std::array<GLfloat, 4> kNothing{};
  glClearBufferfv(GL_COLOR, 0, kNothing.data());
  glEnable(GL_BLEND);
  glBlendEquation(GL_FUNC_ADD);
  // Each point adds to what is there.
  glBlendFunc(GL_ONE, GL_ONE);
}

void HairDensityPass::add(const GroomBuffers& groom, std::size_t points, std::size_t first_record,
                          std::size_t characters) const {
  groom.bind_points();
  points_.use();
  points_.set("first_record", static_cast<int>(first_record));
  points_.set("target_rows", static_cast<int>(rows_));
  // A character has four instances: each point counts now and at rest, and each time in the two slices of the grid
  // beside it.
  glDrawArraysInstanced(GL_POINTS, 0, static_cast<GLsizei>(points), static_cast<GLsizei>(4 * characters));
}

void HairDensityPass::finish(std::size_t characters) const {
  glDisable(GL_BLEND);
  glBindFramebuffer(GL_FRAMEBUFFER, light_target_.name());
  light_.use();
  light_.set("first_record", 0);
  light_.set("target_rows", static_cast<int>(rows_));
  // Two triangles cover the cells of one grid; a character without a grid draws none.
  glDrawArraysInstanced(GL_TRIANGLES, 0, 6, static_cast<GLsizei>(characters));
}

}  // namespace hairnet::render
