#include "client/render/groom_buffers.hpp"

#include <algorithm>
#include <cstddef>

#include "client/render/shader_program.hpp"
#include "client/render/strand_deform_pass.hpp"

namespace hairnet::render {
namespace {

const void* offset(std::size_t bytes) {
  // OpenGL takes an offset as a pointer.
  return static_cast<const char*>(nullptr) + bytes;
}

// Bytes are shares of 255, which the shader reads as 0 ... 1.
void describe(GLuint location, GLint count, GLenum type, std::size_t stride, std::size_t at) {
  glEnableVertexAttribArray(location);
  glVertexAttribPointer(location, count, type, type == GL_UNSIGNED_BYTE ? GL_TRUE : GL_FALSE,
                        static_cast<GLsizei>(stride), offset(at));
}

// The first four attributes of cards and fabric.
template <class Vertex>
void describe_point() {
  describe(0, 4, GL_FLOAT, sizeof(Vertex), offsetof(Vertex, rest));
  describe(1, 4, GL_HALF_FLOAT, sizeof(Vertex), offsetof(Vertex, direction));
  describe(2, 4, GL_UNSIGNED_BYTE, sizeof(Vertex), offsetof(Vertex, sides));
  describe(3, 4, GL_UNSIGNED_BYTE, sizeof(Vertex), offsetof(Vertex, ends));
}

// The attribute numbers here are the layout locations of the vertex shaders.
void describe_vertex(const draw::StrandVertex*) {
  describe(0, 4, GL_UNSIGNED_BYTE, sizeof(draw::StrandVertex), offsetof(draw::StrandVertex, sides));
  describe(1, 4, GL_UNSIGNED_BYTE, sizeof(draw::StrandVertex), offsetof(draw::StrandVertex, ends));
  describe(2, 1, GL_FLOAT, sizeof(draw::StrandVertex), offsetof(draw::StrandVertex, strand));
}

void describe_vertex(const draw::CardVertex*) {
  describe_point<draw::CardVertex>();
  describe(4, 4, GL_FLOAT, sizeof(draw::CardVertex), offsetof(draw::CardVertex, side));
}

void describe_vertex(const draw::FabricVertex*) {
  describe_point<draw::FabricVertex>();
  describe(4, 4, GL_FLOAT, sizeof(draw::FabricVertex), offsetof(draw::FabricVertex, albedo));
  describe(5, 1, GL_FLOAT, sizeof(draw::FabricVertex), offsetof(draw::FabricVertex, cord));
}

void describe_vertex(const draw::BodyVertex*) {
  describe(0, 3, GL_FLOAT, sizeof(draw::BodyVertex), offsetof(draw::BodyVertex, rest));
  describe(1, 4, GL_HALF_FLOAT, sizeof(draw::BodyVertex), offsetof(draw::BodyVertex, normal));
  describe(2, 4, GL_UNSIGNED_BYTE, sizeof(draw::BodyVertex), offsetof(draw::BodyVertex, sides));
  describe(3, 4, GL_UNSIGNED_BYTE, sizeof(draw::BodyVertex), offsetof(draw::BodyVertex, ends));
  describe(4, 4, GL_UNSIGNED_BYTE, sizeof(draw::BodyVertex), offsetof(draw::BodyVertex, shares));
}

}  // namespace

void DrawnMesh::draw_range(std::size_t first, GLsizei count, GLsizei instances) const {
  if (count == 0 || instances == 0) return;
  glBindVertexArray(array_.name());
  glDrawElementsInstanced(GL_TRIANGLES, count, GL_UNSIGNED_INT, offset(first * sizeof(std::uint32_t)), instances);
}

template <class T>
void GroomBuffers::upload(GLenum target, const Buffer& buffer, const std::vector<T>& values) {
  glBindBuffer(target, buffer.name());
  glBufferData(target, static_cast<GLsizeiptr>(values.size() * sizeof(T)), values.data(), GL_STATIC_DRAW);
  bytes_ += values.size() * sizeof(T);
}

template <class Vertex>
void GroomBuffers::fill(const draw::Mesh<Vertex>& mesh, const Buffer& vertices, DrawnMesh& drawn) {
  // The vertex array remembers which buffers and layout belong to it, so draw calls need only bind it.
  glBindVertexArray(drawn.array_.name());
  upload(GL_ARRAY_BUFFER, vertices, mesh.vertices);
  describe_vertex(static_cast<const Vertex*>(nullptr));
  upload(GL_ELEMENT_ARRAY_BUFFER, drawn.indices_, mesh.triangles);
  drawn.index_count_ = static_cast<GLsizei>(mesh.triangles.size());
}

template <std::size_t kNumbers>
void GroomBuffers::fill(const std::vector<std::array<float, kNumbers>>& points, const Texture& texture) {
  static_assert(kNumbers == 2 || kNumbers == 4);
  constexpr std::size_t kRow = StrandDeformPass::kPointRow;
  std::vector<std::array<float, kNumbers>> rows = points;
  // At least one row, also for a groom without strands: a texture has a size.
  rows.resize((points.size() / kRow + 1) * kRow);
  constexpr auto kWidth = static_cast<GLsizei>(kRow);
  const auto height = static_cast<GLsizei>(rows.size() / kRow);
  glBindTexture(GL_TEXTURE_2D, texture.name());
  glTexStorage2D(GL_TEXTURE_2D, 1, kNumbers == 4 ? GL_RGBA32F : GL_RG32F, kWidth, height);
  glTexSubImage2D(GL_TEXTURE_2D, 0, 0, 0, kWidth, height, kNumbers == 4 ? GL_RGBA : GL_RG, GL_FLOAT, rows.data());
  // The points are no picture: interpolation between them would mix strands.
  for (const GLenum filter : {GL_TEXTURE_MIN_FILTER, GL_TEXTURE_MAG_FILTER})
    glTexParameteri(GL_TEXTURE_2D, filter, GL_NEAREST);
  bytes_ += rows.size() * sizeof(rows[0]);
}

GroomBuffers::GroomBuffers(const draw::GroomGeometry& geometry)
    : point_end_(geometry.strand_points.end),
      strand_count_(geometry.strand_count),
      strand_width_m_(geometry.strand_width_m),
      radius_m_(geometry.radius_m) {
  for (std::size_t p = 0; p < geometry.strand_points.rest.size(); ++p) {
    const Vec3f point(geometry.strand_points.rest[p].data());
    strand_box_.extend(point);
    // A point at arc length 0 is a root.
    if (geometry.strand_points.arc[p][0] == 0) root_box_.extend(point);
  }
  fill(geometry.cards, card_vertices_, cards_);
  fill(geometry.fabric, fabric_vertices_, fabric_);
  fill(geometry.body, body_vertices_, body_);
  glActiveTexture(GL_TEXTURE0 + kRestPointsUnit);
  fill(geometry.strand_points.rest, rest_points_);
  glActiveTexture(GL_TEXTURE0 + kRestArcsUnit);
  fill(geometry.strand_points.arc, rest_arcs_);
  glBindVertexArray(0);
  // This buffer stays bound, so that the vertex array of each list refers to the same vertices.
  upload(GL_ARRAY_BUFFER, strand_vertices_, geometry.strand_vertices);
  for (const draw::SimplifiedStrands& list : geometry.simplified_strands) {
    List& one = lists_.emplace_back(List{{}, list.tolerance_m, list.end});
    glBindVertexArray(one.mesh.array_.name());
    describe_vertex(static_cast<const draw::StrandVertex*>(nullptr));
    upload(GL_ELEMENT_ARRAY_BUFFER, one.mesh.indices_, list.triangles);
    one.mesh.index_count_ = static_cast<GLsizei>(list.triangles.size());
  }
  glBindVertexArray(0);
}

void GroomBuffers::bind_points() const {
  glActiveTexture(GL_TEXTURE0 + kRestPointsUnit);
  glBindTexture(GL_TEXTURE_2D, rest_points_.name());
  glActiveTexture(GL_TEXTURE0 + kRestArcsUnit);
  glBindTexture(GL_TEXTURE_2D, rest_arcs_.name());
}

std::size_t GroomBuffers::point_rows(std::size_t strand_count) const {
  constexpr std::size_t kRow = StrandDeformPass::kPointRow;
  return (point_end_[strand_count] + kRow - 1) / kRow;
}

void GroomBuffers::draw_strands(std::size_t list, std::size_t strand_count, GLsizei instances) const {
  lists_[list].mesh.draw_range(0, static_cast<GLsizei>(index_count(list, strand_count)), instances);
}

std::size_t GroomBuffers::list_for(float tolerance_m) const {
  std::size_t list = 0;
  // Tolerances ascend from 0, so the search stops at the first list that is too coarse.
  while (list + 1 < lists_.size() && lists_[list + 1].tolerance_m <= tolerance_m) ++list;
  return list;
}

}  // namespace hairnet::render
