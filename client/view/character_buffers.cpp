#include "client/view/character_buffers.hpp"

#include <cstddef>

namespace hairnet::view {
namespace {

template <class T>
void upload(GLenum target, const Buffer& buffer, const std::vector<T>& values) {
  glBindBuffer(target, buffer.name());
  glBufferData(target, static_cast<GLsizeiptr>(values.size() * sizeof(T)), values.data(), GL_STREAM_DRAW);
}

const void* offset(std::size_t bytes) {
  return static_cast<const char*>(nullptr) + bytes;  // OpenGL takes an offset as a pointer
}

void describe_body() {
  constexpr auto kStride = static_cast<GLsizei>(sizeof(SurfaceVertex));
  for (const GLuint i : {0u, 1u, 2u}) glEnableVertexAttribArray(i);
  glVertexAttribPointer(0, 3, GL_FLOAT, GL_FALSE, kStride, offset(offsetof(SurfaceVertex, position)));
  glVertexAttribPointer(1, 4, GL_SHORT, GL_TRUE, kStride, offset(offsetof(SurfaceVertex, normal)));
  glVertexAttribPointer(2, 4, GL_UNSIGNED_BYTE, GL_TRUE, kStride, offset(offsetof(SurfaceVertex, around)));
}

void describe_fabric() {
  constexpr auto kStride = static_cast<GLsizei>(sizeof(FabricVertex));
  for (const GLuint i : {0u, 1u, 2u, 3u, 4u, 5u}) glEnableVertexAttribArray(i);
  glVertexAttribPointer(0, 3, GL_FLOAT, GL_FALSE, kStride, offset(offsetof(FabricVertex, position)));
  glVertexAttribPointer(1, 4, GL_SHORT, GL_TRUE, kStride, offset(offsetof(FabricVertex, normal)));
  glVertexAttribPointer(2, 4, GL_BYTE, GL_TRUE, kStride, offset(offsetof(FabricVertex, fibre)));
  glVertexAttribPointer(3, 4, GL_UNSIGNED_BYTE, GL_TRUE, kStride, offset(offsetof(FabricVertex, light)));
  glVertexAttribPointer(4, 4, GL_FLOAT, GL_FALSE, kStride, offset(offsetof(FabricVertex, colour)));
  glVertexAttribPointer(5, 3, GL_FLOAT, GL_FALSE, kStride, offset(offsetof(FabricVertex, place)));
}

void describe_strands() {
  constexpr auto kStride = static_cast<GLsizei>(sizeof(RibbonVertex));
  for (const GLuint i : {0u, 1u, 2u, 3u}) glEnableVertexAttribArray(i);
  glVertexAttribPointer(0, 3, GL_FLOAT, GL_FALSE, kStride, offset(offsetof(RibbonVertex, position)));
  glVertexAttribPointer(1, 4, GL_BYTE, GL_TRUE, kStride, offset(offsetof(RibbonVertex, tangent)));
  glVertexAttribPointer(2, 4, GL_UNSIGNED_BYTE, GL_TRUE, kStride, offset(offsetof(RibbonVertex, along)));
  glVertexAttribIPointer(3, 1, GL_UNSIGNED_INT, kStride, offset(offsetof(RibbonVertex, strand)));
}

}  // namespace

CharacterBuffers::CharacterBuffers() {
  glBindVertexArray(body_array_.name());
  glBindBuffer(GL_ARRAY_BUFFER, body_vertices_.name());
  glBindBuffer(GL_ELEMENT_ARRAY_BUFFER, body_indices_.name());
  describe_body();
  glBindVertexArray(fabric_array_.name());
  glBindBuffer(GL_ARRAY_BUFFER, fabric_vertices_.name());
  glBindBuffer(GL_ELEMENT_ARRAY_BUFFER, fabric_indices_.name());
  describe_fabric();
  glBindBuffer(GL_ARRAY_BUFFER, strand_vertices_.name());
  glBindVertexArray(line_array_.name());
  glBindBuffer(GL_ELEMENT_ARRAY_BUFFER, line_indices_.name());
  describe_strands();
  glBindVertexArray(ribbon_array_.name());
  glBindBuffer(GL_ELEMENT_ARRAY_BUFFER, ribbon_indices_.name());
  describe_strands();
}

void CharacterBuffers::fill(const BodySurface& body, const FabricMesh& fabric, const StrandRibbons& ribbons) {
  upload(GL_ARRAY_BUFFER, body_vertices_, body.vertices);
  upload(GL_ARRAY_BUFFER, fabric_vertices_, fabric.vertices);
  upload(GL_ARRAY_BUFFER, strand_vertices_, ribbons.vertices);
  glBindVertexArray(body_array_.name());
  upload(GL_ELEMENT_ARRAY_BUFFER, body_indices_, body.triangles);
  glBindVertexArray(fabric_array_.name());
  upload(GL_ELEMENT_ARRAY_BUFFER, fabric_indices_, fabric.triangles);
  glBindVertexArray(line_array_.name());
  upload(GL_ELEMENT_ARRAY_BUFFER, line_indices_, ribbons.lines);
  glBindVertexArray(ribbon_array_.name());
  upload(GL_ELEMENT_ARRAY_BUFFER, ribbon_indices_, ribbons.triangles);
  body_index_count_ = static_cast<GLsizei>(body.triangles.size());
  fabric_index_count_ = static_cast<GLsizei>(fabric.triangles.size());
  opaque_index_count_ = static_cast<GLsizei>(fabric.opaque_index_count);
  line_index_count_ = static_cast<GLsizei>(ribbons.lines.size());
  slabs_ = ribbons.slabs;
}

void CharacterBuffers::draw_body() const {
  if (body_index_count_ == 0) return;
  glBindVertexArray(body_array_.name());
  glDrawElements(GL_TRIANGLES, body_index_count_, GL_UNSIGNED_INT, nullptr);
}

void CharacterBuffers::draw_fabric() const {
  if (fabric_index_count_ == 0) return;
  glBindVertexArray(fabric_array_.name());
  glDrawElements(GL_TRIANGLES, fabric_index_count_, GL_UNSIGNED_INT, nullptr);
}

void CharacterBuffers::draw_opaque_fabric() const {
  if (opaque_index_count_ == 0) return;
  glBindVertexArray(fabric_array_.name());
  glDrawElements(GL_TRIANGLES, opaque_index_count_, GL_UNSIGNED_INT, nullptr);
}

void CharacterBuffers::draw_strand_lines() const {
  if (line_index_count_ == 0) return;
  glBindVertexArray(line_array_.name());
  glDrawElements(GL_LINES, line_index_count_, GL_UNSIGNED_INT, nullptr);
}

void CharacterBuffers::draw_ribbons(int copies) const {
  glBindVertexArray(ribbon_array_.name());
  for (std::size_t i = 0; i + 1 < slabs_.size(); ++i) {
    const auto count = static_cast<GLsizei>(slabs_[i + 1] - slabs_[i]);
    if (count == 0) continue;
    glDrawElementsInstanced(GL_TRIANGLES, count, GL_UNSIGNED_INT, offset(slabs_[i] * sizeof(std::uint32_t)), copies);
  }
}

}  // namespace hairnet::view
