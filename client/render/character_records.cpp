#include "client/render/character_records.hpp"

#include <algorithm>
#include <cmath>

#include "core/assert.hpp"

namespace hairnet::render {
namespace {

using Vec4f = Eigen::Vector4f;

constexpr std::size_t kFirstBone = 6, kFirstLayer = 16, kDensityTexel = 31;
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
  std::size_t layers = 0;
  for (const LatticeLayer& layer : character.layers.first(std::min(character.layers.size(), kLatticeLayersMax))) {
    if (add_layer(layer, texels + kFirstLayer + 3 * layers)) ++layers;
  }
  // The w of the last texels of layers, also of those that are not there.
  const Vec3f tip = character.hair_tip_colour.value_or(character.hair_colour);
  for (std::size_t axis = 0; axis < 3; ++axis)
    texels[kFirstLayer + 2 + 3 * axis].w() = tip[static_cast<Eigen::Index>(axis)];
  texels[kFirstLayer + 11].w() = character.roughness;
  texels[4] = {detail.follow_hair_count, kStray_m, static_cast<float>(layers), 0};
}

bool moves_hair(const LatticeLayer& layer) {
  if (layer.geometry == nullptr || layer.grid_displacements.empty() || layer.weight == 0) return false;
  HAIRNET_ASSERT(layer.grid_displacements.size() == layer.geometry->lattice.node_count());
  return std::isfinite(layer.weight) &&
         std::ranges::all_of(layer.grid_displacements, [](const Vec3f& u) { return u.allFinite(); });
}

bool CharacterRecords::add_layer(const LatticeLayer& layer, Vec4f* texels) {
  if (!moves_hair(layer)) return false;
  const Lattice& lattice = layer.geometry->lattice;
  texels[0] = with(lattice.origin, layer.weight);
  texels[1] = with(lattice.spacing.cwiseInverse(), static_cast<float>(lattices_.size()));
  texels[2] = {static_cast<float>(lattice.dims[0]), static_cast<float>(lattice.dims[1]),
               static_cast<float>(lattice.dims[2]), 0};
  for (const Vec3f& u : layer.grid_displacements) lattices_.push_back(with(u, 0));
  return true;
}

}  // namespace hairnet::render
