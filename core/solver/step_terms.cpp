#include "core/solver/step_terms.hpp"

#include <algorithm>
#include <type_traits>

#include "core/assert.hpp"
#include "core/solver/head_motion.hpp"
#include "core/solver/wind.hpp"

namespace hairnet {
namespace {

static_assert(std::is_trivially_copyable_v<StepTerms> && sizeof(StepTerms) % sizeof(float) == 0);

static_assert(sizeof(StepTerms::AffineMap) == 12 * sizeof(float), "the kernels read twelve numbers without gaps");

// Puts the maps of the bones that have skin. The head's own maps stay the identity.
void put_bones(const Level& level, const StepInput& input, StepTerms& terms) {
  std::array<bool, kBoneCount> is_wanted{};
  for (const SkinDistanceField& field : *level.skin) is_wanted[static_cast<std::size_t>(field.bone)] = true;
  for (std::size_t b = 1; b < kBoneCount; ++b) {
    if (!is_wanted[b]) continue;
    put(input.from.bones[b].inverse() * input.from.head(), terms.to_bone_before[b]);
    put(input.to.bones[b].inverse() * input.to.head(), terms.to_bone[b]);
  }
}

void check_step_input(const StepInput& input) {
  HAIRNET_ASSERT(input.environment);
  HAIRNET_ASSERT(input.step_s > 0);
  HAIRNET_ASSERT(input.contact_release >= 0);
  HAIRNET_ASSERT(input.contact_release <= 1);
  HAIRNET_ASSERT(input.material.stiffness > 0);
  HAIRNET_ASSERT(input.material.density > 0);
  HAIRNET_VALIDATE(is_valid(input.from));
  HAIRNET_VALIDATE(is_valid(input.to));
}

}  // namespace

void put(const Mat3& m, float (&out)[9]) {
  Eigen::Map<Mat3f>{out} = m.cast<float>();
}
void put(const Vec3& v, float (&out)[3]) {
  Eigen::Map<Vec3f>{out} = v.cast<float>();
}
void put(const RigidTransform& t, StepTerms::AffineMap& out) {
  put(t.rotation.toRotationMatrix(), out.turn);
  put(t.position, out.shift);
}

StepTerms step_terms(const Level& level, const StepInput& input, const LatticeState& state) {
  check_step_input(input);
  // The comparison lets NaN pass, which a state that is not finite may have.
  HAIRNET_ASSERT(!(state.elastic_energy_max_j < 0));
  StepTerms terms;
  const HeadMotion motion(input);
  terms.step_s = static_cast<float>(input.step_s);
  put(motion.turn, terms.turn);
  // R' p^0 as an affine map of p^0 (HeadMotion::rigid_velocity), since the kernels read it for nodes and for springs.
  put(Mat3(motion.rotation_less_identity / -input.step_s), terms.rigid_velocity.turn);
  put(motion.velocity(), terms.rigid_velocity.shift);
  put(motion.gravity_load, terms.gravity_load);

  const MaterialScale& material = input.material;
  terms.stiffness = material.stiffness;
  terms.damping = material.damping;
  terms.density = material.density;
  terms.ether_damping = material.ether_damping;
  terms.air_drag = material.air_drag;
  terms.gel_per_s2 = material.gel_per_s2;
  // The same factor as contact_scale() of the reference.
  terms.contact = static_cast<float>(1 - input.contact_release) * std::max(material.density, 1.0f);
  terms.elastic_energy_max_j = state.elastic_energy_max_j;

  put_bones(level, input, terms);
  if (input.environment->wind.acts()) {
    const LatticeWind wind =
        wind_on(input.environment->wind, level.geometry.lattice, input.to.head(), input.time_s, motion.velocity());
    for (std::size_t corner = 0; corner < wind.corners.size(); ++corner) {
      Eigen::Map<Vec3f>{terms.wind[corner]} = wind.corners[corner];
    }
  }
  return terms;
}

}  // namespace hairnet
