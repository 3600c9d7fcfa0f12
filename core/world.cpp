#include "core/world.hpp"

#include <algorithm>
#include <array>
#include <bit>
#include <cassert>
#include <cmath>
#include <utility>
#include <vector>

#include "core/build/level_map.hpp"
#include "core/solver/calm_release.hpp"
#include "core/solver/energy.hpp"
#include "core/solver/head_motion.hpp"

namespace hairnet {
namespace {

// Work is dealt to a fixed number of scratch buffers, so that results and memory do not depend on who runs them.
constexpr std::size_t kScratchCount = 16;

// Bones closer to each other than this are as good as still: less than a headset's noise.
constexpr float kStillShift_m = 3e-4f;
constexpr double kStillTurn_rad = 1e-3;
constexpr float kStillSpeed_m_per_s = 1e-3f;

bool is_still(const Pose& a, const Pose& b) {
  for (std::size_t i = 0; i < kBoneCount; ++i) {
    if ((a.bones[i].position - b.bones[i].position).norm() > double{kStillShift_m}) return false;
    if (a.bones[i].rotation.angularDistance(b.bones[i].rotation) > kStillTurn_rad) return false;
  }
  return true;
}

struct Character {
  std::shared_ptr<const LevelSet> levels;
  LevelIndex level = LevelIndex::rigid;
  LatticeState state;  // empty when rigid
  MaterialScale material;
  Pose from, to;            // of the last step; `from` = `to` between steps
  Pose last_from;           // where the last substep began: with `from` it gives the rest velocity
  Pose still_pose;          // the bones have not left it for still_s
  double still_s = 0;       // with kSleepAfter_s asleep
  double easing_s = -1;     // since the rigid level was asked for; negative: it was not
  double switched_s = 1e9;  // since the lattice was carried over from another level
  double stiffness = 1;     // of the last step, as eased
  CalmRelease calm_release;
  bool teleport = false;

  [[nodiscard]] bool is_asleep() const { return still_s >= kSleepAfter_s; }
  void wake() { still_s = 0; }
};

struct Slot {
  std::uint32_t generation = 1;
  bool live = false;
  Character character;
};

enum class Outcome : std::uint8_t { idle, stepped, eased, teleported, reset, asleep };

const Level* model_of(const Character& c) {
  return c.level == LevelIndex::rigid || !c.levels ? nullptr : &(*c.levels)[c.level];
}

bool has_same_nodes(const Level* a, const Level* b) {
  return a && b && a->geometry.lattice.dims == b->geometry.lattice.dims && a->rest == b->rest;
}

bool is_at_rest(const LatticeState& state) {
  return std::ranges::all_of(state.displacement, [](const Vec3f& d) { return d.isZero(kStillShift_m); });
}

// What has come in of springs, attachments and contact since a switch of levels. They begin weak, not absent, so that
// hair hardly sinks meanwhile.
struct SwitchEase {
  explicit SwitchEase(double since_s) : t(std::clamp(since_s / kSwitchEase_s, 0.0, 1.0)) {}
  [[nodiscard]] double stiffness() const { return 0.1 + 0.9 * t * t; }
  [[nodiscard]] double contact() const { return 0.02 + 0.98 * t * t; }
  double t;
};

HeadMotion last_motion(const Character& c, double step_s) {
  StepInput input;
  input.from = c.last_from;
  input.to = c.from;
  input.step_s = step_s;
  return HeadMotion(input);
}

void add_rest_velocity(const Level& level, const HeadMotion& motion, float sign, LatticeState& state) {
  for (std::size_t i = 0; i < level.rest.size(); ++i) {
    state.velocity[i] += sign * motion.rest_velocity(level.rest[i].cast<double>()).cast<float>();
  }
}

// Velocity beyond the rest's is carried over; the rest's is an exact function of the poses. Kinetic energy that the map
// would add is taken away again.
void carry_over(const LevelMap& map, const Level& old_level, LatticeState old_state, const HeadMotion& motion,
                const MaterialScale& material, const Level& level, LatticeState& state) {
  const double kinetic_max_j = energy(old_level, material, motion, old_state).kinetic_j;
  add_rest_velocity(old_level, motion, -1, old_state);
  map.apply(old_state.displacement, state.displacement);
  map.apply(old_state.velocity, state.velocity);
  float farthest_m = 0;
  for (const Vec3f& d : state.displacement) farthest_m = std::max(farthest_m, d.norm());
  if (farthest_m > level.displacement_max_m) {
    for (Vec3f& d : state.displacement) d *= level.displacement_max_m / farthest_m;
  }
  double kinetic_j = 0;
  for (std::size_t i = 0; i < level.rest.size(); ++i) {
    kinetic_j += 0.5 * static_cast<double>(material.density * level.mass[i] * state.velocity[i].squaredNorm());
  }
  if (kinetic_j > kinetic_max_j) {
    const auto by = static_cast<float>(std::sqrt(kinetic_max_j / kinetic_j));
    for (Vec3f& v : state.velocity) v *= by;
  }
  add_rest_velocity(level, motion, 1, state);
}

class Fnv {
 public:
  void add(std::uint64_t word) { hash_ = (hash_ ^ word) * 1099511628211ull; }
  void add(float x) { add(std::uint64_t{std::bit_cast<std::uint32_t>(x)}); }
  void add(double x) { add(std::bit_cast<std::uint64_t>(x)); }
  void add(const Vec3f& v) {
    for (int a = 0; a < 3; ++a) add(v[a]);
  }
  [[nodiscard]] std::uint64_t value() const { return hash_; }

 private:
  std::uint64_t hash_ = 14695981039346656037ull;
};

}  // namespace

struct World::Impl {
  explicit Impl(WorldDef d) : def(std::move(d)) {
    assert(def.tick_s > 0 && def.substep_count >= 0 && def.iterations >= 0);
    if (def.substep_count == 0) def.substep_count = substep_count_for(def.tick_s);
    if (!def.parallel_for) {
      def.parallel_for = [](std::size_t count, const std::function<void(std::size_t)>& body) {
        for (std::size_t i = 0; i < count; ++i) body(i);
      };
    }
  }

  [[nodiscard]] const Slot* find(CharacterId id) const {
    if (!id || id.slot >= slots.size()) return nullptr;
    const Slot& slot = slots[id.slot];
    return slot.live && slot.generation == id.generation ? &slot : nullptr;
  }
  [[nodiscard]] Character* find(CharacterId id) {
    const Slot* slot = std::as_const(*this).find(id);
    return slot ? &slots[id.slot].character : nullptr;
  }

  [[nodiscard]] double substep_s() const { return def.tick_s / def.substep_count; }

  [[nodiscard]] SolverSettings solver_of(LevelIndex level) const {
    return {def.iterations > 0 ? def.iterations : kLevelIterations[static_cast<std::size_t>(level)]};
  }

  Outcome step_character(Character& c, StepScratch& scratch) const {
    const bool jumped = std::exchange(c.teleport, false) || is_teleport(c.from, c.to, def.tick_s);
    if (jumped || !def.environment.wind.is_still() || !hairnet::is_still(c.still_pose, c.to)) {
      c.wake();
      c.still_pose = c.to;
    }
    if (c.is_asleep()) return Outcome::asleep;
    const double calm = c.calm_release.update(c.to, def.tick_s);
    const double release = std::max(def.environment.wind.is_still() ? calm : 0, 1 - SwitchEase(c.switched_s).contact());
    Outcome outcome = Outcome::idle;
    if (c.easing_s >= 0) {
      ease_to_rigid(c);
      outcome = Outcome::eased;
    } else if (jumped) {
      outcome = Outcome::teleported;
    } else if (const Level* level = model_of(c)) {
      outcome = step_lattice(*level, c, release, scratch);
    }
    if (outcome == Outcome::stepped) {
      count_stillness(c);
    } else {
      c.last_from = jumped ? c.to : interpolate(c.from, c.to, (def.substep_count - 1.0) / def.substep_count);
      c.from = c.to;
      if (outcome == Outcome::idle) c.still_s += def.tick_s;
    }
    return outcome;
  }

  Outcome step_lattice(const Level& level, Character& c, double release, StepScratch& scratch) const {
    const Pose start = c.from;
    c.switched_s += def.tick_s;
    const double calm = def.environment.wind.is_still() ? c.calm_release.stiffness() : 1;
    const double stiffness = SwitchEase(c.switched_s).stiffness() * calm;
    c.state.elastic_energy_max_j *= static_cast<float>(stiffness / std::exchange(c.stiffness, stiffness));
    MaterialScale material = c.material;
    material.stiffness *= static_cast<float>(stiffness);
    for (int substep = 0; substep < def.substep_count; ++substep) {
      const bool is_last = substep + 1 == def.substep_count;
      const double share = (substep + 1.0) / def.substep_count;
      const Pose to = is_last ? c.to : interpolate(start, c.to, share);
      const double time_s = (static_cast<double>(tick) + share) * def.tick_s;
      const StepInput input{c.from, to, substep_s(), def.environment, release, material, time_s};
      const bool is_finite = hairnet::step(level, input, solver_of(c.level), scratch, c.state);
      c.last_from = std::exchange(c.from, to);
      if (!is_finite) {
        reset_to_rest(level, c.state);
        return Outcome::reset;
      }
    }
    return Outcome::stepped;
  }

  // The displacements shrink along a smooth curve to none, where the rigid level begins.
  void ease_to_rigid(Character& c) const {
    const auto left = [](double elapsed_s) {
      const double t = std::clamp(elapsed_s / kRigidEase_s, 0.0, 1.0);
      return 1 - t * t * (3 - 2 * t);
    };
    const double before = left(c.easing_s);
    c.easing_s += def.tick_s;
    const double after = left(c.easing_s);
    if (after <= 0) {
      c.level = LevelIndex::rigid;
      c.state = {};
      c.easing_s = -1;
      return;
    }
    for (Vec3f& d : c.state.displacement) d *= static_cast<float>(after / before);
  }

  // Counts towards sleep while no node moves against the head.
  void count_stillness(Character& c) const {
    const Level& level = *model_of(c);
    const HeadMotion motion = last_motion(c, substep_s());
    for (std::size_t i = 0; i < level.rest.size(); ++i) {
      const Vec3f rest_velocity = motion.rest_velocity(level.rest[i].cast<double>()).cast<float>();
      if ((c.state.velocity[i] - rest_velocity).norm() > kStillSpeed_m_per_s) return c.wake();
    }
    c.still_s += def.tick_s;
    if (!c.is_asleep()) return;
    for (Vec3f& v : c.state.velocity) v.setZero();
    c.last_from = c.from;
  }

  WorldDef def;
  std::vector<Slot> slots;
  std::vector<std::uint32_t> free_slots;
  std::size_t live_count = 0;
  std::vector<std::uint32_t> live;  // slots to step, made anew each tick
  std::vector<Outcome> outcomes;
  std::array<StepScratch, kScratchCount> scratches;
  std::uint64_t tick = 0;
};

World::World(const WorldDef& def) : impl_(std::make_unique<Impl>(def)) {}
World::~World() = default;
World::World(World&&) noexcept = default;
World& World::operator=(World&&) noexcept = default;

CharacterId World::add(const CharacterDef& def) {
  if (impl_->live_count >= impl_->def.character_count_max) return {};
  std::uint32_t index = 0;
  if (impl_->free_slots.empty()) {
    index = static_cast<std::uint32_t>(impl_->slots.size());
    impl_->slots.emplace_back();
  } else {
    index = impl_->free_slots.back();
    impl_->free_slots.pop_back();
  }
  Slot& slot = impl_->slots[index];
  slot.live = true;
  slot.character = {};
  slot.character.levels = def.levels;
  slot.character.from = slot.character.to = slot.character.last_from = slot.character.still_pose = def.pose;
  ++impl_->live_count;
  const CharacterId id{index, slot.generation};
  set_level(id, def.level);
  return id;
}

void World::remove(CharacterId id) {
  if (!impl_->find(id)) return;
  Slot& slot = impl_->slots[id.slot];
  slot.live = false;
  slot.character = {};
  if (++slot.generation == 0) slot.generation = 1;
  impl_->free_slots.push_back(id.slot);
  --impl_->live_count;
}

void World::set_pose(CharacterId id, const Pose& pose, bool teleport) {
  assert(is_valid(pose));
  if (Character* c = impl_->find(id)) {
    c->to = pose;
    c->teleport = c->teleport || teleport;
  }
}

void World::set_levels(CharacterId id, std::shared_ptr<const LevelSet> levels) {
  Character* c = impl_->find(id);
  if (!c) return;
  const std::shared_ptr<const LevelSet> old_levels = std::exchange(c->levels, std::move(levels));
  const Level* old_level = c->level == LevelIndex::rigid || !old_levels ? nullptr : &(*old_levels)[c->level];
  c->wake();
  if (has_same_nodes(old_level, model_of(*c))) {
    c->state.elastic_energy_max_j = std::numeric_limits<float>::infinity();
    return;
  }
  c->easing_s = -1;
  c->state = {};
  const LevelIndex level = std::exchange(c->level, LevelIndex::rigid);
  set_level(id, level);
}

bool World::set_level(CharacterId id, LevelIndex index) {
  Character* c = impl_->find(id);
  if (!c || (index != LevelIndex::rigid && !c->levels)) return false;
  const Level* old_level = model_of(*c);
  if (index == LevelIndex::rigid) {
    c->wake();
    if (!old_level || is_at_rest(c->state)) {
      c->level = index;
      c->state = {};
    } else if (c->easing_s < 0) {
      c->easing_s = 0;
    }
    return true;
  }
  c->wake();
  const HeadMotion motion = last_motion(*c, impl_->substep_s());
  if (std::exchange(c->easing_s, -1) >= 0) {
    // Easing has no velocity of its own.
    const std::vector<Vec3f> displacement = std::move(c->state.displacement);
    reset_to_rest(*old_level, c->state);
    c->state.displacement = displacement;
    add_rest_velocity(*old_level, motion, 1, c->state);
  }
  if (index == c->level) return true;
  const LevelMap* map = old_level ? c->levels->map(c->level, index) : nullptr;
  c->level = index;
  const Level& level = *model_of(*c);
  LatticeState old_state = std::move(c->state);
  reset_to_rest(level, c->state);
  if (map) {
    c->switched_s = 0;
    carry_over(*map, *old_level, std::move(old_state), motion, c->material, level, c->state);
  } else {
    add_rest_velocity(level, motion, 1, c->state);
  }
  return true;
}

void World::set_material(CharacterId id, const MaterialScale& material) {
  assert(validate(material).empty());
  Character* c = impl_->find(id);
  if (!c || c->material == material) return;
  c->material = material;
  c->state.elastic_energy_max_j = std::numeric_limits<float>::infinity();
  c->wake();
}

void World::set_environment(const Environment& environment) {
  impl_->def.environment = environment;
  for (Slot& slot : impl_->slots) slot.character.wake();
}

StepReport World::step() {
  Impl& w = *impl_;
  w.live.clear();
  for (std::uint32_t s = 0; s < w.slots.size(); ++s) {
    if (w.slots[s].live) w.live.push_back(s);
  }
  w.outcomes.resize(w.live.size());
  w.def.parallel_for(std::min(kScratchCount, w.live.size()), [&w](std::size_t share) {
    for (std::size_t i = share; i < w.live.size(); i += kScratchCount) {
      w.outcomes[i] = w.step_character(w.slots[w.live[i]].character, w.scratches[share]);
    }
  });
  ++w.tick;
  StepReport report;
  for (const Outcome outcome : w.outcomes) {
    report.stepped += outcome == Outcome::stepped || outcome == Outcome::reset;
    report.teleports += outcome == Outcome::teleported;
    report.lattices_reset += outcome == Outcome::reset;
    report.asleep += outcome == Outcome::asleep;
  }
  return report;
}

bool World::contains(CharacterId id) const {
  return std::as_const(*impl_).find(id) != nullptr;
}
std::size_t World::character_count() const {
  return impl_->live_count;
}

LatticeView World::lattice(CharacterId id) const {
  const Slot* slot = std::as_const(*impl_).find(id);
  assert(slot);
  const Character& c = slot->character;
  return {c.level, model_of(c), c.state.displacement, &c.from, c.is_asleep()};
}

const LatticeState& World::state(CharacterId id) const {
  const Slot* slot = std::as_const(*impl_).find(id);
  assert(slot);
  return slot->character.state;
}

std::uint64_t World::hash() const {
  Fnv fnv;
  for (std::size_t s = 0; s < impl_->slots.size(); ++s) {
    const Slot& slot = impl_->slots[s];
    if (!slot.live) continue;
    const Character& c = slot.character;
    fnv.add(std::uint64_t{s});
    fnv.add(static_cast<std::uint64_t>(c.level));
    fnv.add(c.calm_release.calm_s());
    fnv.add(c.stiffness);
    fnv.add(c.still_s);
    fnv.add(c.easing_s);
    fnv.add(c.switched_s);
    const MaterialScale& m = c.material;
    for (const float x : {m.stiffness, m.damping, m.density, m.ether_damping, m.air_drag, m.gel_per_s2}) fnv.add(x);
    fnv.add(c.state.elastic_energy_max_j);
    for (const RigidTransform& bone : c.from.bones) {
      for (int i = 0; i < 4; ++i) fnv.add(bone.rotation.coeffs()[i]);
      for (int i = 0; i < 3; ++i) fnv.add(bone.position[i]);
    }
    for (const Vec3f& d : c.state.displacement) fnv.add(d);
    for (const Vec3f& v : c.state.velocity) fnv.add(v);
  }
  return fnv.value();
}

}  // namespace hairnet
