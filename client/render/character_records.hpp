#pragma once

#include <array>
#include <vector>

#include "client/render/density_grid.hpp"
#include "client/render/stage.hpp"

namespace hairnet::render {

// Whether there is a lattice and all of it is finite.
bool moves_hair(const MovedLattice& lattice);

// The two textures that character.glsl reads, as floats: one row of records for each character, and the nodes of
// lattices.
class CharacterRecords {
 public:
  static constexpr std::size_t kRecordTexels = 21, kLatticeRow = 1024;
  static constexpr std::size_t kCharacterRowsMax = 64 * 64 * 64 / kLatticeRow;

  void clear();
  // The rows of StrandDeformPass's textures with the points of the character's strands.
  struct PointRows {
    std::size_t first = 0, count = 0;
  };
  // `origin`: of scene space, in the world. `cards`: whether the groom has far cards. A lattice that is not finite
  // moves nothing. `density`: null: the character has none.
  void add(const ShownCharacter& character, const Vec3& origin, const DrawDetail& detail, float strand_width_m,
           bool cards, const PointRows& points, const DensityGrid* density = nullptr);

  // Whether there is room for one more character, when textures have that many rows.
  [[nodiscard]] bool has_room(std::size_t rows) const {
    return count() + 1 < rows && lattices_.size() / kLatticeRow + kCharacterRowsMax < rows;
  }
  [[nodiscard]] std::size_t count() const { return records_.size() / kRecordTexels; }
  [[nodiscard]] const std::vector<Eigen::Vector4f>& records() const { return records_; }
  [[nodiscard]] const std::vector<Eigen::Vector4f>& lattices() const { return lattices_; }

 private:
  std::vector<Eigen::Vector4f> records_, lattices_;
};

}  // namespace hairnet::render
