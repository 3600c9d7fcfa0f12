#pragma once

#include <array>
#include <cstdint>
#include <vector>

#include "core/groom/groom.hpp"

namespace hairnet::view {

// What is left of light at one place, by where it comes from: +x -x +y -y +z -z of the head.
using LightLeft = std::array<float, 6>;

// Coarse grid over a groom at rest that says how much light gets to a place through hair and body. Head space, m.
class LightField {
 public:
  // `width_m`: of a strand as drawn, with all that is drawn beside it.
  LightField(const Groom& groom, float width_m);
  [[nodiscard]] LightLeft at(const Vec3f& position) const;
  [[nodiscard]] float roots_at(const Vec3f& position) const;  // 0 ... 1: how much of a scalp a place is
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
  void add_strips(const Groom& groom);
  void add_body(const TriangleMesh& mesh);
  void sweep(const std::array<int, 3>& towards);

  Vec3f origin_{0, 0, 0};
  float cell_m_ = 0.01f;
  std::array<int, 3> count_{0, 0, 0};
  std::vector<float> extinction_;  // optical depth of one cell's width
  std::vector<float> roots_;
  std::vector<LightLeft> left_;
};

}  // namespace hairnet::view
