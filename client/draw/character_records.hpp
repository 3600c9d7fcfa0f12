#pragma once

#include <array>
#include <memory>
#include <span>
#include <vector>

#include "client/draw/density_grid.hpp"
#include "client/draw/mode_texels.hpp"
#include "client/draw/node_sum.hpp"
#include "client/draw/shown_character.hpp"

namespace hairnet::draw {

// Whether there is a lattice and all of it is finite.
bool moves_hair(const MovedLattice& lattice);

// What character.glsl reads, one row of records for each character, and what LatticePass makes nodes of lattices from.
class CharacterRecords {
 public:
  static constexpr std::size_t kRecordTexels = 85;

  // Begins a picture of some of these characters, which stay where they are until all of them are added. Each lattice
  // has its rows of nodes; what they have from the picture before is not summed up again. `rows_max`: of a texture;
  // OpenGL ES 3 has at least as many.
  void begin(std::span<const ShownCharacter> characters, NodeSum sum = NodeSum::gpu, std::size_t rows_max = 2048);
  // The rows of StrandDeformPass's textures with the points of the character's strands.
  struct PointRows {
    std::size_t first = 0, count = 0;
  };
  // `origin`: of scene space, in the world. A lattice that is not finite moves nothing. `density`: null: the character
  // has none.
  // `number`: of the character, among those of begin(). Its hair rests where its nodes have no room.
  void add(std::size_t number, const Vec3& origin, const DrawDetail& detail, float strand_width_m,
           const PointRows& points, const DensityGrid* density = nullptr);

  // What was there is lost, as with the context of OpenGL.
  void forget();

  // Whether there is room for this character, too.
  [[nodiscard]] bool has_room(std::size_t number) const { return count() + 1 < rows_max_ && has_rows(number); }
  [[nodiscard]] std::size_t count() const { return records_.size() / kRecordTexels; }
  [[nodiscard]] const std::vector<Eigen::Vector4f>& records() const { return records_; }

  // The records, from `first` to before `end`, whose nodes have one source; others between them have another one, or
  // their nodes are there already.
  struct Source {
    std::shared_ptr<const Basis> basis;  // null: nodes are uploaded
    const LevelGeometry* geometry = nullptr;
    std::size_t character = 0;  // the number of one that has it
    std::size_t first = 0, end = 0;
  };
  // The first is that of uploaded nodes; the others have the numbers of bases in records. There is one for each basis
  // that a character of begin() has and the GPU sums up, also where nothing of it is new.
  [[nodiscard]] const std::vector<Source>& sources() const { return sources_; }
  [[nodiscard]] const std::vector<Eigen::Vector4f>& uploaded_nodes() const { return uploaded_nodes_; }
  // The rows of the texture of nodes. When their number changes, no nodes are there.
  [[nodiscard]] std::size_t node_rows() const { return node_rows_; }

 private:
  // The rows of a character's nodes, and what they are the sum of.
  struct Nodes {
    std::size_t first_row = 0, row_count = 0;
    std::weak_ptr<const Basis> basis = {};  // empty: it is not known
    std::vector<float> coefficients = {};
  };
  [[nodiscard]] bool has_rows(std::size_t number) const {
    return nodes_[number].first_row + nodes_[number].row_count <= rows_max_;
  }
  void place_lattice(std::size_t character, Eigen::Vector4f* texels);
  [[nodiscard]] bool is_summed(const MovedLattice& moved) const;
  std::size_t source_of(std::size_t character);

  std::span<const ShownCharacter> characters_;
  std::vector<Nodes> nodes_;
  std::vector<Eigen::Vector4f> records_, uploaded_nodes_;
  std::vector<Source> sources_{1};
  std::vector<Vec3f> scratch_;
  std::size_t node_rows_ = 0, rows_max_ = 0;
  NodeSum sum_ = NodeSum::gpu;
};

}  // namespace hairnet::draw
