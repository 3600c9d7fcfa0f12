#include "core/world/switch_level.hpp"

#include <algorithm>
#include <cmath>
#include <utility>

#include "core/assert.hpp"
#include "core/levels/level_map.hpp"
#include "core/solver/energy.hpp"
#include "core/world/rigid_velocity.hpp"

namespace hairnet {
namespace {

// Hair counts as at rest when all nodes are nearer to their design than this on each axis. It then becomes rigid at
// once, since so small a jump needs no easing.
constexpr float kRestShift_m = 3e-4f;

bool is_at_rest(const LatticeState& state) {
  return std::ranges::all_of(state.displacement, [](const Vec3f& d) { return d.isZero(kRestShift_m); });
}

// Whether a state of one level fits the other. Null levels have no nodes.
bool has_same_nodes(const Level* a, const Level* b) {
  return a && b && a->geometry.lattice.dims == b->geometry.lattice.dims && a->rest == b->rest;
}

// Transfers displacements and velocities to another level. The map gets velocities relative to the head alone, since
// the rigid velocity follows exactly from the poses. `motion` is the head's over the last substep; `state` is at rest
// on entry.
void transfer_state(const LevelMap& map, const Level& old_level, LatticeState old_state, const HeadMotion& motion,
                    const MaterialScale& material, const Level& level, LatticeState& state) {
  HAIRNET_ASSERT(old_state.displacement.size() == old_level.rest.size());
  HAIRNET_ASSERT(state.displacement.size() == level.rest.size());
  // The map fits positions and knows no energy. Both the distance from the design and the kinetic energy relative to
  // the head are bounded afterwards, so a switch never adds speed.
  const double kinetic_max_j = energy(old_level, material, motion, old_state).kinetic_j;
  add_rigid_velocity(old_level, motion, -1, old_state);
  map.apply(old_state.displacement, state.displacement);
  map.apply(old_state.velocity, state.velocity);
  float farthest_m = 0;
  for (const Vec3f& d : state.displacement) farthest_m = std::max(farthest_m, d.norm());
  if (farthest_m > level.displacement_max_m) {
    for (Vec3f& d : state.displacement) d *= level.displacement_max_m / farthest_m;
  }
  HAIRNET_ASSERT(state.displacement.size() == level.rest.size());
  HAIRNET_ASSERT(state.velocity.size() == level.rest.size());
  double kinetic_j = 0;
  for (std::size_t i = 0; i < level.rest.size(); ++i) {
    kinetic_j += 0.5 * static_cast<double>(material.density * level.mass[i] * state.velocity[i].squaredNorm());
  }
  if (kinetic_j > kinetic_max_j) {
    // Energy goes with the square of the speed.
    const auto by = static_cast<float>(std::sqrt(kinetic_max_j / kinetic_j));
    for (Vec3f& v : state.velocity) v *= by;
  }
  add_rigid_velocity(level, motion, 1, state);
}

// Requests the rigid level. Hair that is away from its design first eases to it over the next turns (ease_to_rigid in
// character.cpp).
void switch_to_rigid(Character& c) {
  if (!c.model() || is_at_rest(c.state)) {
    c.level = LevelIndex::rigid;
    c.state = {};
    c.learnt = {};
    // The hair may already have been easing to the rigid level.
    c.rigid_ease_s = -1;
  } else if (c.rigid_ease_s < 0) {
    c.rigid_ease_s = 0;
  }
}

// Starts the network, which takes the first pose as held before. Within two seconds the result hardly depends on this
// start (kLearntSettled_ticks in learnt_hair.hpp).
void switch_to_learnt(Character& c) {
  if (c.level == LevelIndex::learnt) return;
  c.level = LevelIndex::learnt;
  c.state = {};
  c.rigid_ease_s = -1;
  c.learnt.coefficients.assign(c.network()->mode_count, 0);
}

}  // namespace

bool has_level(LevelIndex level, const Character& c) {
  HAIRNET_ASSERT(static_cast<std::size_t>(level) < kLevelCount);
  return level == LevelIndex::rigid || (c.levels && (level != LevelIndex::learnt || c.levels->learnt));
}

void switch_level(LevelIndex to, Character& c) {
  HAIRNET_ASSERT(has_level(to, c));
  c.wake();
  // Each level has its own contact points, so holds cannot go on.
  if (to != c.level) end_holds(c);
  if (to == LevelIndex::rigid) return switch_to_rigid(c);
  if (to == LevelIndex::learnt) return switch_to_learnt(c);
  const Level* old_level = c.model();
  const HeadMotion motion = last_head_motion(c);
  // The character was easing to the rigid level, and the new request ends this.
  if (std::exchange(c.rigid_ease_s, -1) >= 0) {
    // Only a lattice eases.
    HAIRNET_ASSERT(old_level);
    // While hair eases its velocities are not kept up to date. The lattice goes on from where it is, moving with the
    // head.
    const std::vector<Vec3f> displacement = std::move(c.state.displacement);
    reset_to_rest(*old_level, c.state);
    c.state.displacement = displacement;
    add_rigid_velocity(*old_level, motion, 1, c.state);
  }
  // A call back to the level on which the hair still is needs no transfer.
  if (to == c.level) return;
  const LevelMap* map = old_level ? c.levels->map(c.level, to) : nullptr;
  c.level = to;
  c.learnt = {};
  const Level& level = *c.model();
  LatticeState old_state = std::move(c.state);
  reset_to_rest(level, c.state);
  if (map) {
    c.since_switch_s = 0;
    transfer_state(*map, *old_level, std::move(old_state), motion, c.material, level, c.state);
  } else {
    add_rigid_velocity(level, motion, 1, c.state);
  }
}

void replace_levels(std::shared_ptr<const LevelSet> levels, Character& c) {
  const std::shared_ptr<const LevelSet> old_levels = std::exchange(c.levels, std::move(levels));
  const Level* old_level = has_lattice(c.level) && old_levels ? &(*old_levels)[c.level] : nullptr;
  c.wake();
  end_holds(c);
  if (has_same_nodes(old_level, c.model())) {
    // The nodes are the same, but the stiffnesses may differ, and the limit of elastic energy belongs to the old ones.
    c.state.elastic_energy_max_j = std::numeric_limits<float>::infinity();
    return;
  }
  c.rigid_ease_s = -1;
  c.state = {};
  c.learnt = {};
  // Going through the rigid level starts the lattice at rest with the head, as the old nodes mean nothing to the new
  // level.
  const LevelIndex level = std::exchange(c.level, LevelIndex::rigid);
  if (has_level(level, c)) switch_level(level, c);
}

}  // namespace hairnet
