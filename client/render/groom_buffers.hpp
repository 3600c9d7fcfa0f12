#pragma once

#include "client/draw/groom_geometry.hpp"
#include "client/render/gl_objects.hpp"
#include "client/render/skin_texture.hpp"

namespace hairnet::render {

// Triangles of a groom on the GPU, drawn for many characters at once.
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

// One groom's geometry on the GPU.
class GroomBuffers {
 public:
  explicit GroomBuffers(const draw::GroomGeometry& geometry);

  // Binds the strands' points for StrandDeformPass to the texture units kRestPointsUnit and kRestArcsUnit.
  void bind_points() const;
  [[nodiscard]] const SkinTexture& skin() const { return skin_; }
  SkinTexture& skin() { return skin_; }
  // The number of rows of kPointRow points in the first `strand_count` strands.
  [[nodiscard]] std::size_t point_rows(std::size_t strand_count) const;
  // The points of the first `strand_count` strands.
  [[nodiscard]] std::size_t point_count(std::size_t strand_count) const { return point_end_[strand_count]; }
  // Draws the first `strand_count` strands in the order of drawing, `instances` times.
  void draw_strands(std::size_t list, std::size_t strand_count, GLsizei instances) const;
  [[nodiscard]] const DrawnMesh& cards() const { return cards_; }
  [[nodiscard]] const DrawnMesh& fabric() const { return fabric_; }
  [[nodiscard]] const DrawnMesh& body() const { return body_; }

  [[nodiscard]] std::size_t strand_count() const { return strand_count_; }
  [[nodiscard]] float strand_width_m() const { return strand_width_m_; }
  // Contain the points of the resting strands, and their roots. Head space, m.
  [[nodiscard]] const Eigen::AlignedBox3f& strand_box() const { return strand_box_; }
  [[nodiscard]] const Eigen::AlignedBox3f& root_box() const { return root_box_; }
  [[nodiscard]] float radius_m() const { return radius_m_; }
  // The coarsest list within the tolerance.
  [[nodiscard]] std::size_t list_for(float tolerance_m) const;
  [[nodiscard]] std::size_t index_count(std::size_t list, std::size_t strand_count) const {
    return lists_[list].end[strand_count];
  }
  [[nodiscard]] std::size_t bytes() const { return bytes_ + skin_.bytes(); }

 private:
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
  std::vector<std::uint32_t> point_end_;  // StrandPoints::end
  Buffer strand_vertices_, card_vertices_, fabric_vertices_, body_vertices_;
  std::vector<List> lists_;
  DrawnMesh cards_, fabric_, body_;
  std::size_t strand_count_;
  Eigen::AlignedBox3f strand_box_, root_box_;
  float strand_width_m_, radius_m_;
  std::size_t bytes_ = 0;
};

}  // namespace hairnet::render
