#pragma once

#include <array>
#include <cstdint>
#include <vector>

#include "core/groom/groom.hpp"

namespace hairnet::draw {

// The fraction of light that reaches one point from each of six directions: +x -x +y -y +z -z of the head. Shaders
// weigh the six by the direction of each light.
using Transmittance = std::array<float, 6>;

// A coarse grid over a groom at rest that stores how much light reaches each cell through hair and body: baked ambient
// occlusion by direction. It is used only while the geometry is made; the light then moves with the hair. Head space,
// m.
class OcclusionGrid {
 public:
  // `width_m` is that of a drawn strand, including its follow hairs. A groom without hair lets all light through.
  OcclusionGrid(const Groom& groom, float width_m);
  [[nodiscard]] Transmittance at(const Vec3f& position) const { return gather(position, Vec3f::Zero()); }
  // For a surface with this normal: ignores light from behind the surface.
  [[nodiscard]] Transmittance at(const Vec3f& position, const Vec3f& normal) const { return gather(position, normal); }
  [[nodiscard]] float cell_m() const { return cell_m_; }

 private:
  [[nodiscard]] std::size_t index(int x, int y, int z) const {
    return (static_cast<std::size_t>(z) * static_cast<std::size_t>(count_[1]) + static_cast<std::size_t>(y)) *
               static_cast<std::size_t>(count_[0]) +
           static_cast<std::size_t>(x);
  }
  [[nodiscard]] bool find(const Vec3f& position, std::size_t& cell) const;
  bool lay_out(const Groom& groom);
  void add_hair(const Groom& groom, float width_m);
  void add_cards(const Groom& groom);
  void add_body(const TriangleMesh& mesh);
  void sweep(std::size_t ray);
  [[nodiscard]] Transmittance gather(const Vec3f& position, const Vec3f& normal) const;

  Vec3f origin_{0, 0, 0};
  float cell_m_ = 0.01f;
  std::array<int, 3> count_{0, 0, 0};
  // The optical depth of one cell's width.
  std::vector<float> extinction_;
  // The transmittance along each ray: to the faces and the corners of a cube.
  using Rays = std::array<float, 14>;
  std::vector<Rays> transmittance_;
};

}  // namespace hairnet::draw
