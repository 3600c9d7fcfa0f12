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

// Whether there is a lattice and all of it is finite. Asserts that the coefficients or displacements fit the lattice's
// geometry.
bool moves_hair(const MovedLattice& lattice);

// The data that shaders read of each character in a picture: a row of kRecordTexels texels, whose layout character.glsl
// lists; and the data from which LatticePass makes the nodes of lattices. For each picture call begin(), then add() for
// each character that is drawn, in the order of drawing. It needs no OpenGL: the browser and other engines upload the
// same arrays. One thread.
class CharacterRecords {
 public:
  // There are 21 texels of pose, colours and detail, then 64 of four coefficients each: the kModeCountMax of a basis.
  static constexpr std::size_t kRecordTexels = 85;

  // Begins a picture of some of these characters, which must stay where they are until all of them are added. Each
  // lattice has its own rows of nodes. Nodes that are there from the picture before are not summed up again, so hair
  // that sleeps costs nothing; a character that comes or leaves moves the rows of those behind it, which are then
  // summed up. `rows_max` is the limit of a texture; OpenGL ES 3 allows at least as many.
  void begin(std::span<const ShownCharacter> characters, NodeSum sum = NodeSum::gpu, std::size_t rows_max = 2048);
  // The rows of StrandDeformPass's textures with the points of the character's strands.
  struct PointRows {
    std::size_t first = 0, count = 0;
  };
  // Adds the next record. `number` is the character's place in begin()'s list, `origin` that of scene space in the
  // world: positions become floats only relative to the origin, so it should be the camera. A lattice that is not
  // finite moves nothing, and hair whose nodes have no room rests. `density` is null for a character without a grid.
  void add(std::size_t number, const Vec3& origin, const DrawDetail& detail, float strand_width_m,
           const PointRows& points, const DensityGrid* density = nullptr);

  // Call it when the textures are lost, as with the context of OpenGL: then all nodes are made again.
  void forget();

  // Whether there is room for this character, too. A caller leaves it out otherwise, since add() does not check the
  // number of rows.
  [[nodiscard]] bool has_room(std::size_t number) const { return count() + 1 < rows_max_ && has_rows(number); }
  [[nodiscard]] std::size_t count() const { return records_.size() / kRecordTexels; }
  [[nodiscard]] const std::vector<Eigen::Vector4f>& records() const { return records_; }

  // What the nodes of some records come from. The records lie from `first` to before `end`, so one draw call for each
  // source suffices. Some records between them have another source, or have their nodes already; each record tells the
  // shader which.
  struct Source {
    // Null: the nodes are uploaded.
    std::shared_ptr<const Basis> basis;
    const LevelGeometry* geometry = nullptr;
    // The number of any character that has the basis.
    std::size_t character = 0;
    std::size_t first = 0, end = 0;
  };
  // The first source is that of uploaded nodes; the others have the numbers of bases in records. There is one for each
  // basis that a character of begin() has and the GPU sums up, also where nothing of it is new: so a basis stays on the
  // GPU while its characters sleep.
  [[nodiscard]] const std::vector<Source>& sources() const { return sources_; }
  // These displacements are computed here, in rows of kLatticeRow; w is 0.
  [[nodiscard]] const std::vector<Eigen::Vector4f>& uploaded_nodes() const { return uploaded_nodes_; }
  // The rows of the texture of nodes. When their number changes, the texture is allocated again and no nodes are there.
  [[nodiscard]] std::size_t node_rows() const { return node_rows_; }

 private:
  // The rows of a character's nodes, and what they are the sum of. Comparing it with the new coefficients shows whether
  // the nodes must be summed up again.
  struct Nodes {
    std::size_t first_row = 0, row_count = 0;
    // Empty: the sum is not known, so it is computed.
    std::weak_ptr<const Basis> basis = {};
    std::vector<float> coefficients = {};
  };
  [[nodiscard]] bool has_rows(std::size_t number) const {
    return nodes_[number].first_row + nodes_[number].row_count <= rows_max_;
  }
  void place_lattice(std::size_t character, Eigen::Vector4f* texels);
  [[nodiscard]] bool is_summed(const MovedLattice& moved) const;
  // Returns the number of the basis among the sources, and adds the basis if it is new.
  std::size_t source_of(std::size_t character);

  std::span<const ShownCharacter> characters_;
  // One entry for each character of begin(), kept from picture to picture.
  std::vector<Nodes> nodes_;
  std::vector<Eigen::Vector4f> records_, uploaded_nodes_;
  // The first entry is always there: the source of uploaded nodes.
  std::vector<Source> sources_{1};
  std::vector<Vec3f> scratch_;
  std::size_t node_rows_ = 0, rows_max_ = 0;
  NodeSum sum_ = NodeSum::gpu;
};

}  // namespace hairnet::draw
