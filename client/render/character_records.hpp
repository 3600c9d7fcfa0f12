#pragma once

#include <array>
#include <memory>
#include <vector>

#include "client/render/density_grid.hpp"
#include "client/render/mode_texels.hpp"
#include "client/render/stage.hpp"

namespace hairnet::render {

// Whether there is a lattice and all of it is finite.
bool moves_hair(const MovedLattice& lattice);

// What character.glsl reads, one row of records for each character, and what LatticePass makes nodes of lattices from.
class CharacterRecords {
 public:
  static constexpr std::size_t kRecordTexels = 53;
  static constexpr std::size_t kCharacterRowsMax = 64 * 64 * 64 / kLatticeRow;

  // `rows_max`: of a texture; OpenGL ES 3 has at least as many.
  void clear(std::size_t rows_max = 2048);
  // The rows of StrandDeformPass's textures with the points of the character's strands.
  struct PointRows {
    std::size_t first = 0, count = 0;
  };
  // `origin`: of scene space, in the world. `cards`: whether the groom has far cards. A lattice that is not finite
  // moves nothing. `density`: null: the character has none.
  void add(const ShownCharacter& character, const Vec3& origin, const DrawDetail& detail, float strand_width_m,
           bool cards, const PointRows& points, const DensityGrid* density = nullptr);

  // Whether there is room for one more character.
  [[nodiscard]] bool has_room() const {
    return count() + 1 < rows_max_ && lattice_rows_ + kCharacterRowsMax < rows_max_;
  }
  [[nodiscard]] std::size_t count() const { return records_.size() / kRecordTexels; }
  [[nodiscard]] const std::vector<Eigen::Vector4f>& records() const { return records_; }

  // The records, from `first` to before `end`, whose lattices have one source; others between them have another one.
  struct Source {
    std::shared_ptr<const Basis> basis;  // null: nodes are uploaded
    const LevelGeometry* geometry = nullptr;
    std::size_t first = 0, end = 0;
  };
  // The first is that of uploaded nodes; the others have the numbers of bases in records.
  [[nodiscard]] const std::vector<Source>& sources() const { return sources_; }
  [[nodiscard]] const std::vector<Eigen::Vector4f>& uploaded_nodes() const { return uploaded_nodes_; }
  [[nodiscard]] std::size_t lattice_rows() const { return lattice_rows_; }

 private:
  void place_lattice(const MovedLattice& moved, Eigen::Vector4f* texels);
  std::size_t source_of(const MovedLattice& moved);

  std::vector<Eigen::Vector4f> records_, uploaded_nodes_;
  std::vector<Source> sources_{1};
  std::vector<Vec3f> scratch_;
  std::size_t lattice_rows_ = 0, rows_max_ = 2048;
};

}  // namespace hairnet::render
