#pragma once

#include "client/draw/groom_geometry.hpp"
#include "client/render/gl_objects.hpp"
#include "client/render/skin_texture.hpp"

namespace hairnet::render {

// Triangles of a groom on the GPU, drawn for many characters at once: an instance is a character, or one of its follow
// hairs.
class DrawnMesh {
 public:
  void draw(GLsizei instances) const { draw_range(0, index_count_, instances); }
  [[nodiscard]] bool empty() const { return index_count_ == 0; }
  [[nodiscard]] std::size_t index_count() const { return static_cast<std::size_t>(index_count_); }

 private:
  friend class GroomBuffers;
  void draw_range(std::size_t first, GLsizei count, GLsizei instances) const;

  VertexArray array_;
  Buffer indices_;
  GLsizei index_count_ = 0;
};

// One groom's geometry on the GPU: nothing of it changes, except for the skin, which may come later. All characters of
// the groom share it. The context must be current at every call.
class GroomBuffers {
 public:
  explicit GroomBuffers(const draw::GroomGeometry& geometry);

  // Binds the strands' points for StrandDeformPass to the texture units kRestPointsUnit and kRestArcsUnit.
  void bind_points() const;
  [[nodiscard]] const SkinTexture& skin() const { return skin_; }
  SkinTexture& skin() { return skin_; }
  // The number of rows of kPointRow points in the first `strand_count` strands. A character's points begin at a row of
  // their own.
  [[nodiscard]] std::size_t point_rows(std::size_t strand_count) const;
  // The points of the first `strand_count` strands.
  [[nodiscard]] std::size_t point_count(std::size_t strand_count) const { return point_end_[strand_count]; }
  // Draws the first `strand_count` strands `instances` times. `list` is a result of list_for().
  void draw_strands(std::size_t list, std::size_t strand_count, GLsizei instances) const;
  [[nodiscard]] const DrawnMesh& cards() const { return cards_; }
  [[nodiscard]] const DrawnMesh& fabric() const { return fabric_; }
  [[nodiscard]] const DrawnMesh& body() const { return body_; }

  [[nodiscard]] std::size_t strand_count() const { return strand_count_; }
  [[nodiscard]] float strand_width_m() const { return strand_width_m_; }
  // These boxes contain the points of the resting strands, and their roots. Head space, m.
  [[nodiscard]] const Eigen::AlignedBox3f& strand_box() const { return strand_box_; }
  [[nodiscard]] const Eigen::AlignedBox3f& root_box() const { return root_box_; }
  [[nodiscard]] float radius_m() const { return radius_m_; }
  // The index of the coarsest list within the tolerance. The first list has all points, so there is always one.
  [[nodiscard]] std::size_t list_for(float tolerance_m) const;
  [[nodiscard]] std::size_t index_count(std::size_t list, std::size_t strand_count) const {
    return lists_[list].end[strand_count];
  }
  // The memory on the GPU.
  [[nodiscard]] std::size_t bytes() const { return bytes_ + skin_.bytes(); }

 private:
  // The triangles of one tolerance. All lists share the vertices.
  struct List {
    DrawnMesh mesh;
    float tolerance_m;
    std::vector<std::uint32_t> end;  // SimplifiedStrands::end
  };
  template <class Vertex>
  void fill(const draw::Mesh<Vertex>& mesh, const Buffer& vertices, DrawnMesh& drawn);
  template <std::size_t kNumbers>
  void fill(const std::vector<std::array<float, kNumbers>>& points, const Texture& texture);
  template <class T>
  void upload(GLenum target, const Buffer& buffer, const std::vector<T>& values);

  Texture rest_points_, rest_arcs_;
  SkinTexture skin_;
  // StrandPoints::end: the first n strands have the points below it.
  std::vector<std::uint32_t> point_end_;
  Buffer strand_vertices_, card_vertices_, fabric_vertices_, body_vertices_;
  std::vector<List> lists_;
  DrawnMesh cards_, fabric_, body_;
  std::size_t strand_count_;
  Eigen::AlignedBox3f strand_box_, root_box_;
  float strand_width_m_, radius_m_;
  std::size_t bytes_ = 0;
};

}  // namespace hairnet::render
