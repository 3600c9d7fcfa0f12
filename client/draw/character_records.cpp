#include "client/draw/character_records.hpp"

#include <algorithm>
#include <cmath>

#include "core/assert.hpp"

namespace hairnet::draw {
namespace {

using Vec4f = Eigen::Vector4f;

// The texture of nodes shrinks only when it has more rows than these, and more than four times those wanted.
constexpr std::size_t kNodeRowsMin = 8;
// The places of texels in a record (character.glsl lists all). Texels with positions have a number in w that has no
// texel of its own.
constexpr std::size_t kFirstBone = 6, kLatticeTexel = 16, kTipTexel = 19, kDensityTexel = 20, kCoefficientTexel = 21;
// Coefficients of hair are far smaller: larger ones are damaged, and would throw strands across the picture.
constexpr float kCoefficientMax_m = 1e3f;
// Follow hairs lie at most this far beside their strand.
constexpr float kStray_m = 2.5e-3f;
// A record has this number in place of its source when its nodes are in the texture from the picture before.
constexpr float kNodesAreThere = -1;

Vec4f with(const Vec3f& v, float w) {
  return {v.x(), v.y(), v.z(), w};
}

}  // namespace

void CharacterRecords::begin(std::span<const ShownCharacter> characters, NodeSum sum, std::size_t rows_max) {
  characters_ = characters;
  sum_ = sum;
  rows_max_ = rows_max;
  records_.clear();
  uploaded_nodes_.clear();
  sources_.assign(1, {});
  nodes_.resize(characters.size());
  std::size_t row = 0;
  for (std::size_t i = 0; i < characters.size(); ++i) {
    const LevelGeometry* geometry = characters[i].lattice.geometry;
    const std::size_t count = geometry != nullptr ? draw::node_rows(*geometry) : 0;
    // A character keeps its nodes only while its rows lie where they were.
    if (nodes_[i].first_row != row || nodes_[i].row_count != count) nodes_[i] = {row, count};
    row += count;
    // A basis is listed even if this character is not drawn, so that the pass keeps it on the GPU.
    if (is_summed(characters[i].lattice)) static_cast<void>(source_of(i));
  }
  const std::size_t wanted = std::min(row, rows_max);
  // Growing is needed at once, since nodes have no room otherwise; shrinking waits, so that a crowd that comes and goes
  // does not bring all nodes again each time.
  if (wanted <= node_rows_ && node_rows_ <= std::max(4 * wanted, kNodeRowsMin)) return;
  node_rows_ = wanted;
  forget();
}

void CharacterRecords::forget() {
  for (Nodes& nodes : nodes_) nodes.basis.reset();
}

void CharacterRecords::add(std::size_t number, const Vec3& origin, const DrawDetail& detail, float strand_width_m,
                           const PointRows& points, const DensityGrid* density) {
  const ShownCharacter& character = characters_[number];
  records_.resize(records_.size() + kRecordTexels, Vec4f::Zero());
  Vec4f* texels = records_.data() + records_.size() - kRecordTexels;
  const auto place = [&](const RigidTransform& bone, std::size_t at) {
    texels[at] = bone.rotation.coeffs().cast<float>();
    // Subtract in doubles first: floats of world positions would be millimetres coarse at 10 km.
    texels[at + 1] = with((bone.position - origin).cast<float>(), 0);
  };
  place(character.pose.head(), 0);
  texels[2] = with(character.hair_colour, strand_width_m * width_scale(detail) * std::abs(character.scale));
  texels[3] = {detail.strand_share, detail.quadratic, 0, 0};
  texels[5] = with(character.skin_colour, character.body_shown ? 0.0f : 1.0f);
  for (std::size_t b = 0; b < kBoneCount; ++b) place(character.pose.bones[b], kFirstBone + 2 * b);
  texels[1].w() = static_cast<float>(points.first);
  texels[kFirstBone + 1].w() = static_cast<float>(points.count);
  if (density != nullptr) {
    // Zero means no grid, so numbers begin at 1 in the record.
    texels[kDensityTexel] = with(density->origin, static_cast<float>(density->number + 1));
    // The record has no texel of its own for these numbers: they go into the w of the bones' positions.
    for (std::size_t axis = 0; axis < 3; ++axis)
      texels[kFirstBone + 3 + 2 * axis].w() = density->cell[static_cast<Eigen::Index>(axis)];
    texels[kFirstBone + 9].w() = density->weight;
  }
  // The size is stored less 1, so that a texel of zeros means a character of its groom's size.
  texels[4] = {detail.follow_hair_count, kStray_m, 0, character.scale - 1};
  if (moves_hair(character.lattice) && has_rows(number)) place_lattice(number, texels);
  texels[kTipTexel] = with(character.hair_tip_colour.value_or(character.hair_colour), character.roughness);
}

// Fills the lattice's part of the newest record, and brings its nodes where they have changed.
void CharacterRecords::place_lattice(std::size_t character, Vec4f* texels) {
  const MovedLattice& moved = characters_[character].lattice;
  Nodes& nodes = nodes_[character];
  const Lattice& lattice = moved.geometry->lattice;
  std::size_t count = moved.coefficients.size();
  // Trailing zeros are cut, so that equal sums compare as equal, and the shader runs fewer loops.
  while (count > 0 && moved.coefficients[count - 1] == 0) --count;
  const auto coefficients = moved.coefficients.first(count);
  float number = kNodesAreThere, count_or_row = 0;
  // Nodes without a basis are brought for every picture. A basis that is gone locks to null, so that a new one at the
  // same address is not taken for it.
  if (!moved.basis || nodes.basis.lock() != moved.basis || !std::ranges::equal(nodes.coefficients, coefficients)) {
    nodes.basis = moved.basis;
    nodes.coefficients.assign(coefficients.begin(), coefficients.end());
    const std::size_t source = is_summed(moved) ? source_of(character) : 0;
    number = static_cast<float>(source);
    // The range may span records whose nodes are there already; the shader skips those.
    if (sources_[source].end == 0) sources_[source].first = this->count() - 1;
    sources_[source].end = this->count();
    if (source > 0) {
      count_or_row = static_cast<float>(count);
      for (std::size_t k = 0; k < count; ++k)
        texels[kCoefficientTexel + k / 4][static_cast<Eigen::Index>(k % 4)] = coefficients[k];
    } else {
      const std::size_t row = uploaded_nodes_.size() / kLatticeRow;
      count_or_row = static_cast<float>(row);
      for (const Vec3f& u : nodes_of(moved, scratch_)) uploaded_nodes_.push_back(with(u, 0));
      // Each lattice begins at a row, so its rest of a row is filled with zeros.
      uploaded_nodes_.resize((row + nodes.row_count) * kLatticeRow, Vec4f::Zero());
    }
  }
  // This says that a lattice moves the hair.
  texels[4].z() = 1;
  texels[kLatticeTexel] = with(lattice.origin, number);
  texels[kLatticeTexel + 1] = with(lattice.spacing.cwiseInverse(), static_cast<float>(nodes.first_row * kLatticeRow));
  texels[kLatticeTexel + 2] = {static_cast<float>(lattice.dims[0]), static_cast<float>(lattice.dims[1]),
                               static_cast<float>(lattice.dims[2]), count_or_row};
}

// Whether the GPU sums up this lattice. The processor sums up a basis that is too large for a texture.
bool CharacterRecords::is_summed(const MovedLattice& moved) const {
  return moved.geometry != nullptr && moved.basis && sum_ == NodeSum::gpu &&
         mode_rows(*moved.geometry, *moved.basis) <= rows_max_;
}

std::size_t CharacterRecords::source_of(std::size_t character) {
  const MovedLattice& moved = characters_[character].lattice;
  const auto known = std::ranges::find(sources_, moved.basis, &Source::basis);
  const auto number = static_cast<std::size_t>(known - sources_.begin());
  if (known == sources_.end()) sources_.push_back({moved.basis, moved.geometry, character, 0, 0});
  return number;
}

bool moves_hair(const MovedLattice& lattice) {
  if (lattice.geometry == nullptr) return false;
  if (lattice.basis) {
    HAIRNET_ASSERT(lattice.basis->node_count == lattice.geometry->active_nodes.size());
    HAIRNET_ASSERT(lattice.coefficients.size() <= lattice.basis->mode_count());
    return std::ranges::all_of(lattice.coefficients, [](float c) { return std::abs(c) <= kCoefficientMax_m; });
  }
  HAIRNET_ASSERT(lattice.grid_displacements.size() == lattice.geometry->lattice.node_count());
  return std::ranges::all_of(lattice.grid_displacements, [](const Vec3f& u) { return u.allFinite(); });
}

}  // namespace hairnet::draw
