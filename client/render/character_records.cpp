#include "client/render/character_records.hpp"

#include <algorithm>
#include <cmath>

#include "core/assert.hpp"

namespace hairnet::render {
namespace {

using Vec4f = Eigen::Vector4f;

constexpr std::size_t kFirstBone = 6, kLatticeTexel = 16, kTipTexel = 19, kDensityTexel = 20;
constexpr float kStray_m = 2.5e-3f;  // of follow hairs from their strand

Vec4f with(const Vec3f& v, float w) {
  return {v.x(), v.y(), v.z(), w};
}

}  // namespace

void CharacterRecords::clear() {
  records_.clear();
  lattices_.clear();
}

void CharacterRecords::add(const ShownCharacter& character, const Vec3& origin, const DrawDetail& detail,
                           float strand_width_m, bool cards, const PointRows& points, const DensityGrid* density) {
  records_.resize(records_.size() + kRecordTexels, Vec4f::Zero());
  Vec4f* texels = records_.data() + records_.size() - kRecordTexels;
  const auto place = [&](const RigidTransform& bone, std::size_t at) {
    texels[at] = bone.rotation.coeffs().cast<float>();
    texels[at + 1] = with((bone.position - origin).cast<float>(), 0);
  };
  place(character.pose.head(), 0);
  const float far = cards ? detail.cards : 0.0f;
  texels[2] = with(character.hair_colour, strand_width_m * width_scale(detail));
  // Strands fade out only when cards are fully visible.
  texels[3] = {detail.strand_share, std::min(1.0f, 2 - 2 * far), std::min(1.0f, 2 * far), detail.quadratic};
  texels[5] = with(character.skin_colour, character.body_shown ? 0.0f : 1.0f);
  for (std::size_t b = 0; b < kBoneCount; ++b) place(character.pose.bones[b], kFirstBone + 2 * b);
  texels[1].w() = static_cast<float>(points.first);
  texels[kFirstBone + 1].w() = static_cast<float>(points.count);
  if (density != nullptr) {
    texels[kDensityTexel] = with(density->origin, static_cast<float>(density->number + 1));
    for (std::size_t axis = 0; axis < 3; ++axis)
      texels[kFirstBone + 3 + 2 * axis].w() = density->cell[static_cast<Eigen::Index>(axis)];
    texels[kFirstBone + 9].w() = density->weight;
  }
  texels[4] = {detail.follow_hair_count, kStray_m, 0, 0};
  if (moves_hair(character.lattice)) {
    const Lattice& lattice = character.lattice.geometry->lattice;
    texels[4].z() = 1;
    texels[kLatticeTexel] = with(lattice.origin, 0);
    texels[kLatticeTexel + 1] = with(lattice.spacing.cwiseInverse(), static_cast<float>(lattices_.size()));
    texels[kLatticeTexel + 2] = {static_cast<float>(lattice.dims[0]), static_cast<float>(lattice.dims[1]),
                                 static_cast<float>(lattice.dims[2]), 0};
    for (const Vec3f& u : character.lattice.grid_displacements) lattices_.push_back(with(u, 0));
  }
  texels[kTipTexel] = with(character.hair_tip_colour.value_or(character.hair_colour), character.roughness);
}

bool moves_hair(const MovedLattice& lattice) {
  if (lattice.geometry == nullptr) return false;
  HAIRNET_ASSERT(lattice.grid_displacements.size() == lattice.geometry->lattice.node_count());
  return std::ranges::all_of(lattice.grid_displacements, [](const Vec3f& u) { return u.allFinite(); });
}

}  // namespace hairnet::render
