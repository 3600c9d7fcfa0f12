#pragma once

#include <array>
#include <cstdint>
#include <vector>

#include "core/groom/groom.hpp"

namespace hairnet::draw {

// The fraction of light that reaches one point from each of six directions: +x -x +y -y +z -z of the head. Shaders
// weigh the six by the direction of each light.
using Transmittance = std::array<float, 6>;

// This share of blocked light is lost; the rest is scattered on by the hair. Losing all of it would make the inside of
// thick hair black.
inline constexpr float kHairShare = 0.22f;
// The mean width of a strand over its width at the root, about: it tapers to its tip (strand.vert).
inline constexpr float kMeanTaper = 0.75f;

// A coarse grid over a groom at rest: it stores how much light reaches each cell through hair and body (baked ambient
// occlusion by direction). It exists only while the geometry is made. The vertices then carry the light, so it moves
// with the hair. Head space, m.
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
  // Finds the cell of a position; false outside of the grid.
  [[nodiscard]] bool find(const Vec3f& position, std::size_t& cell) const;
  // Sets origin, size and number of the cells. Returns false for a groom without hair.
  bool lay_out(const Groom& groom);
  void add_hair(const Groom& groom, float width_m);
  void add_cards(const Groom& groom);
  void add_body(const TriangleMesh& mesh);
  // Fills transmittance_ for one of the 14 rays.
  void sweep(std::size_t ray);
  [[nodiscard]] Transmittance gather(const Vec3f& position, const Vec3f& normal) const;

  Vec3f origin_{0, 0, 0};
  float cell_m_ = 0.01f;
  std::array<int, 3> count_{0, 0, 0};
  // The optical depth of each cell, along one cell's width.
  std::vector<float> extinction_;
  // The transmittances along 14 rays: 6 to the faces of a cube, then 8 to its corners (kRays).
  using Rays = std::array<float, 14>;
  std::vector<Rays> transmittance_;
};

}  // namespace hairnet::draw
