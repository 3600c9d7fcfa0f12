#pragma once

#include <cstddef>
#include <cstdint>
#include <memory>

// The boundary to the baselines. They are compiled for the instruction set of the building machine, into a shared
// library that exports nothing else, so that no inline function of Eigen or ours exists in two versions. It uses plain
// numbers only.
namespace hairnet::bench {

// Springs or attachments (Stiffeners of core/levels/level.hpp). Stiffener s has the nodes and weights with the indices
// begin[s] to begin[s + 1] - 1.
struct PlainStiffeners {
  std::size_t count = 0;
  const std::uint32_t* begin = nullptr;
  const std::uint16_t* nodes = nullptr;
  const double* weights = nullptr;
  const double* stiffness = nullptr;    // k, N/m
  const double* damping = nullptr;      // q as the solver takes it, N s/m
  const double* rest_length = nullptr;  // m; of springs
};

// SkinDistanceField (core/skin/skin_distance_field.hpp) and its limits for the contact points.
struct PlainSkinDistanceField {
  double origin[3], cell_m;
  int dims[3];
  const float* distance = nullptr;
  const float* limit = nullptr;  // m, one a contact point
};
// ContactPoints (core/levels/level.hpp).
struct PlainContactPoints {
  std::size_t count = 0;
  const std::uint32_t* begin = nullptr;
  const std::uint16_t* nodes = nullptr;
  const float *weights = nullptr, *rest = nullptr, *potential = nullptr;
};

// A level for steps of one length. Vectors are three numbers for each node, in head space.
struct PlainLevel {
  std::size_t node_count = 0;
  const double* rest = nullptr;             // m
  const double* mass = nullptr;             // kg
  const double* ether_stiffness = nullptr;  // N/m
  const double* ether_damping = nullptr;    // as the solver takes it, N s/m
  const double* drag = nullptr;             // xx xy xz yy yz zz, N s/m
  PlainStiffeners springs, attachments;
  const PlainSkinDistanceField* skin = nullptr;
  std::size_t skin_count = 0;
  PlainContactPoints contacts;
};

struct PlainTransform {
  double rotation[9];  // column by column
  double position[3];
};

// Transforms between the world and the place where the bone's skin is at rest: from the world to there at the start and
// at the end of the step, and from there to the world at its end.
struct PlainBone {
  PlainTransform to_rest_before, to_rest, from_rest;
};

struct PlainInput {
  double step_s;
  PlainTransform head_from, head_to;
  double gravity[3], design_gravity[3];  // world; head axes
  const PlainBone* bones;                // one a skin field
  double contact_release;
};

// The step of section 2.2 of the paper, in world axes and double. As in the paper it is solved by conjugate gradient
// from dP' = 0 without a preconditioner. The air is still, and the energy has no limit.
class BaselineStep {
 public:
  virtual ~BaselineStep() = default;
  // Steps the nodes' positions P and velocities P', world, three numbers for each node. Returns false when the result
  // is not finite.
  virtual bool step(const PlainInput& input, double* P, double* P_dot) = 0;
};

struct BaselineSettings {
  int iterations = 16;
  // The iterations end earlier when the residual is below this share of the load.
  double relative_residual = 0;
};

#define HAIRNET_BASELINE_API __attribute__((visibility("default")))

// Assembles the matrix from triplets in each step. `level` and all that it points to must outlive the result.
HAIRNET_BASELINE_API std::unique_ptr<BaselineStep> make_naive_step(const PlainLevel& level,
                                                                   const BaselineSettings& settings);
// The same into a matrix whose pattern is made once: values are added at positions known beforehand.
HAIRNET_BASELINE_API std::unique_ptr<BaselineStep> make_fair_step(const PlainLevel& level,
                                                                  const BaselineSettings& settings);

}  // namespace hairnet::bench
