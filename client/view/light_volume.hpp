#pragma once

#include <array>
#include <cstdint>
#include <vector>

#include "client/view/light_rig.hpp"

namespace hairnet::view {

// Coarse grid over one character's hair that says how much light gets to a place through hair and body: the soft part
// of the shading (the key light has its own maps). World space, m.
class LightVolume {
 public:
  struct Left {  // 0 … 1
    float ambient = 1, fill = 1, rim = 1;
    float roots = 0;  // how much of a scalp this place is
  };
  // `copies`: ribbons drawn for a strand.
  LightVolume(const DrawnCharacter& character, float copies, const LightRig& rig);
  [[nodiscard]] Left at(const Vec3f& position) const;
  [[nodiscard]] float cell_m() const { return cell_m_; }

 private:
  using Cell = Eigen::Vector4f;  // ambient, fill, rim, roots
  [[nodiscard]] std::size_t index(int x, int y, int z) const {
    return (static_cast<std::size_t>(z) * static_cast<std::size_t>(count_[1]) + static_cast<std::size_t>(y)) *
               static_cast<std::size_t>(count_[0]) +
           static_cast<std::size_t>(x);
  }
  [[nodiscard]] bool find(const Vec3f& position, std::size_t& cell) const;
  bool lay_out(const DrawnCharacter& character);
  void add_hair(const DrawnCharacter& character, float copies);
  void add_strip(const DrawnSurface& surface);
  void add_body(const DrawnCharacter& character);
  void gather_ambient();
  void sweep(const std::array<int, 3>& towards, float weight);
  void trace(const Vec3f& towards, int part);

  Vec3f origin_{0, 0, 0};
  float cell_m_ = 0.01f;
  std::array<int, 3> count_{0, 0, 0};
  std::vector<float> extinction_;  // optical depth of one cell's width
  std::vector<Cell> cells_;
};

}  // namespace hairnet::view
