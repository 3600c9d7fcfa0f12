#include "core/world.hpp"

#include <algorithm>
#include <array>
#include <bit>
#include <cassert>
#include <utility>
#include <vector>

#include "core/ffd/deform.hpp"
#include "core/solver/head_motion.hpp"

namespace hairnet {
namespace {

// Work is dealt to a fixed number of scratch buffers, so that results and memory do not depend on who runs them.
constexpr std::size_t kScratchCount = 16;

struct Character {
  std::shared_ptr<const LevelSet> levels;
  LevelIndex level = LevelIndex::rigid;
  LatticeState state;  // empty when rigid
  Pose from, to;       // of the last step; `from` = `to` between steps
  Pose last_from;      // where the last substep began: with `from` it gives the rest velocity
  ContactRelease contact_release;
  bool teleport = false;
};

struct Slot {
  std::uint32_t generation = 1;
  bool live = false;
  Character character;
};

enum class Outcome : std::uint8_t { idle, stepped, teleported, reset };

const Level* model_of(const Character& c) {
  return c.level == LevelIndex::rigid || !c.levels ? nullptr : &(*c.levels)[c.level];
}

// Velocity beyond the rest's is what a level switch carries over; the rest's is an exact function of the poses.
HeadMotion last_motion(const Character& c, double step_s) {
  StepInput input;
  input.from = c.last_from;
  input.to = c.from;
  input.step_s = step_s;
  return HeadMotion(input);
}

void carry_over(const Level& old_level, const LatticeState& old_state, const HeadMotion& motion, const Level& level,
                LatticeState& state) {
  LatticeState beyond = old_state;
  for (std::size_t i = 0; i < old_level.rest.size(); ++i) {
    beyond.velocity[i] -= motion.rest_velocity(old_level.rest[i].cast<double>()).cast<float>();
  }
  const Deformer at_new_nodes(old_level.geometry.lattice, level.rest, {}, FfdKind::linear);
  std::vector<Vec3f> grid(old_level.geometry.lattice.node_count());
  for (const auto member : {&LatticeState::displacement, &LatticeState::velocity}) {
    expand_displacements(old_level.geometry, beyond.*member, grid);
    (state.*member).resize(level.rest.size());
    at_new_nodes.deform(grid, state.*member);
    for (std::size_t i = 0; i < level.rest.size(); ++i) (state.*member)[i] -= level.rest[i];
  }
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
    assert(def.tick_s > 0 && def.substep_count >= 1 && def.solver.iterations >= 1);
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

  Outcome step_character(Character& c, StepScratch& scratch) const {
    const Level* level = model_of(c);
    const bool jumped = c.teleport || is_teleport(c.from, c.to, def.tick_s);
    c.teleport = false;
    const double release = c.contact_release.update(c.to, def.tick_s);
    Outcome outcome = Outcome::idle;
    if (jumped) {
      c.last_from = c.to;
      outcome = Outcome::teleported;
    } else {
      const Pose start = c.from;
      bool finite = true;
      for (int substep = 0; substep < def.substep_count; ++substep) {
        const bool last = substep + 1 == def.substep_count;
        const Pose to = last ? c.to : interpolate(start, c.to, (substep + 1.0) / def.substep_count);
        if (level) {
          finite = hairnet::step(*level, {c.from, to, substep_s(), def.environment, release}, def.solver, scratch,
                                 c.state) &&
                   finite;
          outcome = Outcome::stepped;
        }
        c.last_from = std::exchange(c.from, to);
      }
      if (!finite) {
        reset_to_rest(*level, c.state);
        outcome = Outcome::reset;
      }
    }
    c.from = c.to;
    return outcome;
  }

  WorldDef def;
  std::vector<Slot> slots;
  std::vector<std::uint32_t> free_slots;
  std::size_t live_count = 0;
  std::vector<std::uint32_t> live;  // slots to step, made anew each tick
  std::vector<Outcome> outcomes;
  std::array<StepScratch, kScratchCount> scratches;
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
  slot.character.from = slot.character.to = slot.character.last_from = def.pose;
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
  if (Character* c = impl_->find(id)) {
    c->levels = std::move(levels);
    const LevelIndex level = std::exchange(c->level, LevelIndex::rigid);
    set_level(id, level);
  }
}

bool World::set_level(CharacterId id, LevelIndex index) {
  Character* c = impl_->find(id);
  if (!c || (index != LevelIndex::rigid && !c->levels)) return false;
  if (index == c->level) return true;
  const Level* old_level = model_of(*c);
  c->level = index;
  const Level* level = model_of(*c);
  if (!level) {
    c->state = {};
    return true;
  }
  const HeadMotion motion = last_motion(*c, impl_->substep_s());
  const LatticeState old_state = std::move(c->state);
  reset_to_rest(*level, c->state);
  if (old_level) carry_over(*old_level, old_state, motion, *level, c->state);
  for (std::size_t i = 0; i < level->rest.size(); ++i) {
    c->state.velocity[i] += motion.rest_velocity(level->rest[i].cast<double>()).cast<float>();
  }
  return true;
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
  StepReport report;
  for (const Outcome outcome : w.outcomes) {
    report.stepped += outcome == Outcome::stepped || outcome == Outcome::reset;
    report.teleports += outcome == Outcome::teleported;
    report.lattices_reset += outcome == Outcome::reset;
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
  return {c.level, model_of(c), c.state.displacement, &c.from};
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
    fnv.add(c.contact_release.calm_s());
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
