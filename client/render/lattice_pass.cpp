#include "client/render/lattice_pass.hpp"

#include <algorithm>

#include "client/draw/mode_texels.hpp"

namespace hairnet::render {
namespace {

void set_nearest() {
  for (const GLenum filter : {GL_TEXTURE_MIN_FILTER, GL_TEXTURE_MAG_FILTER})
    glTexParameteri(GL_TEXTURE_2D, filter, GL_NEAREST);
}

}  // namespace

Result<LatticePass> LatticePass::build() {
  auto programs = build_programs({{"nodes.vert", "mode_nodes.frag"}, {"nodes.vert", "uploaded_nodes.frag"}});
  if (!programs) return Refusal(programs.error());
  // The first sums up modes, the second copies nodes that were uploaded.
  auto& [sum, copy] = *programs;
  // A driver may give no name: the pointer is then null, and the empty name counts as a GPU.
  const auto* renderer = reinterpret_cast<const char*>(glGetString(GL_RENDERER));
  return LatticePass(std::move(sum), std::move(copy), draw::node_sum_for(renderer != nullptr ? renderer : ""));
}

void LatticePass::reserve(std::size_t rows) {
  glActiveTexture(GL_TEXTURE0 + kLatticesUnit);
  glBindTexture(GL_TEXTURE_2D, nodes_.name());
  glBindFramebuffer(GL_FRAMEBUFFER, target_.name());
  if (rows == rows_) return;
  rows_ = rows;
  // The texture stores the bits of floats as integers: every device can draw into this format, while drawing into
  // floats is an extension.
  glTexImage2D(GL_TEXTURE_2D, 0, GL_RGBA32UI, static_cast<GLsizei>(draw::kLatticeRow), static_cast<GLsizei>(rows_), 0,
               GL_RGBA_INTEGER, GL_UNSIGNED_INT, nullptr);
  set_nearest();
  glFramebufferTexture2D(GL_FRAMEBUFFER, GL_COLOR_ATTACHMENT0, GL_TEXTURE_2D, nodes_.name(), 0);
}

void LatticePass::bind_modes(const draw::CharacterRecords::Source& source) {
  const auto [place, is_new] = modes_.try_emplace(source.basis.get());
  auto& [basis, texture, bytes] = place->second;
  glActiveTexture(GL_TEXTURE0 + kModesUnit);
  glBindTexture(GL_TEXTURE_2D, texture.name());
  // Modes never change, so an entry is filled once.
  if (!is_new) return;
  basis = source.basis;
  const auto texels = draw::mode_texels(*source.geometry, *source.basis);
  bytes = texels.size() * sizeof texels[0];
  glTexImage2D(GL_TEXTURE_2D, 0, GL_RGBA32F, static_cast<GLsizei>(draw::kLatticeRow),
               static_cast<GLsizei>(texels.size() / draw::kLatticeRow), 0, GL_RGBA, GL_FLOAT, texels.data());
  set_nearest();
}

void LatticePass::run(const draw::CharacterRecords& records) {
  // A new basis may lie where one that is gone lay: entries whose basis is gone must go before the search by address.
  std::erase_if(modes_, [](const auto& entry) { return entry.second.basis.expired(); });
  if (!records.uploaded_nodes().empty()) uploaded_.fill(records.uploaded_nodes());
  GLint before = 0;
  glGetIntegerv(GL_FRAMEBUFFER_BINDING, &before);
  // A texture without rows would make an incomplete framebuffer.
  reserve(std::max<std::size_t>(records.node_rows(), 1));
  glViewport(0, 0, static_cast<GLsizei>(draw::kLatticeRow), static_cast<GLsizei>(rows_));
  glBindVertexArray(nothing_.name());
  for (std::size_t number = 0; number < records.sources().size(); ++number) {
    const draw::CharacterRecords::Source& source = records.sources()[number];
    // No node of this source is new in this picture.
    if (source.end == source.first) continue;
    if (source.basis) bind_modes(source);
    const Program& program = source.basis ? sum_ : copy_;
    program.use();
    program.set("first_record", static_cast<int>(source.first));
    program.set("target_rows", static_cast<int>(rows_));
    // The shader skips records of the range that have another source.
    program.set("basis", static_cast<int>(number));
    glDrawArraysInstanced(GL_TRIANGLES, 0, 6, static_cast<GLsizei>(source.end - source.first));
  }
  glBindFramebuffer(GL_FRAMEBUFFER, static_cast<GLuint>(before));
}

std::size_t LatticePass::basis_bytes() const {
  std::size_t bytes = 0;
  for (const auto& [basis, modes] : modes_) bytes += modes.bytes;
  return bytes;
}

}  // namespace hairnet::render
