#include "core/world/world.hpp"

#include <algorithm>
#include <bit>
#include <deque>
#include <functional>
#include <map>
#include <tuple>
#include <utility>
#include <vector>

#include "core/assert.hpp"
#include "core/world/batches.hpp"
#include "core/world/character.hpp"
#include "core/world/character_touch.hpp"
#include "core/world/room_bodies.hpp"
#include "core/world/switch_level.hpp"

namespace hairnet {
namespace {

// The place of one character. The generation rises with every removal, so an old id names nothing when the slot is used
// again.
struct Slot {
  std::uint32_t generation = 1;
  bool live = false;
  Character character;
};

// The hash FNV-1a over words of 64 bits instead of bytes, with FNV's offset basis and prime. It compares states and
// does not protect against forgery.
class Fnv {
 public:
  void add(std::uint64_t word) { hash_ = (hash_ ^ word) * 1099511628211ull; }
  void add(float x) { add(std::uint64_t{std::bit_cast<std::uint32_t>(x)}); }
  void add(double x) { add(std::bit_cast<std::uint64_t>(x)); }
  void add(const Vec3f& v) {
    for (int a = 0; a < 3; ++a) add(v[a]);
  }
  void add(const Vec3& v) {
    for (int a = 0; a < 3; ++a) add(v[a]);
  }
  void add(const RigidTransform& t) {
    for (int i = 0; i < 4; ++i) add(t.rotation.coeffs()[i]);
    add(t.position);
  }
  void add(const TouchKey& key) { add(std::uint64_t{key.toucher} << 8 | key.number); }
  void add(const RoomBody& b) {
    add(b.body.key);
    add(b.body.shape.half_size_m);
    add(b.body.shape.radius_m);
    add(std::uint64_t{b.body.only_own} << 2 | std::uint64_t{b.body.shape.is_inside_out} << 1 | std::uint64_t{b.moves});
    for (const RigidTransform& place : {b.from, b.body.place, b.still_place}) add(place);
  }
  void add(const CharacterTouch& touch) {
    for (const CharacterTouch::MetBody& met : touch.bodies) add(met.key);
    for (const Hold& hold : touch.holds) {
      add(hold.hand);
      add(std::uint64_t{hold.point} << 1 | std::uint64_t{hold.is_pinned});
      add(hold.anchor);
    }
  }
  [[nodiscard]] std::uint64_t value() const { return hash_; }

 private:
  std::uint64_t hash_ = 14695981039346656037ull;
};

}  // namespace

struct World::Impl {
  explicit Impl(const WorldDef& d) : def(d), plans(plans_of(d)), environments{d.environment} {}

  static StepPlans plans_of(const WorldDef& d) {
    HAIRNET_ASSERT(d.tick_s > 0);
    HAIRNET_ASSERT(d.substep_count >= 0);
    HAIRNET_ASSERT(d.iterations >= 0);
    HAIRNET_ASSERT(d.environment.gravity.allFinite());
    return {d.tick_s, d.substep_count > 0 ? d.substep_count : substep_count_for(d.tick_s), d.iterations};
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
  [[nodiscard]] TickContext terms() const { return {def.tick_s, environments, &plans, tick}; }

  // The keys by which characters are sorted into batches. They are copies, so that sorting does not touch the
  // characters in memory.
  struct Placed {
    LevelIndex level;
    std::uint8_t stride;
    std::uint32_t step_phase;
    std::uintptr_t model;
    std::uint32_t slot;
    friend bool operator==(const Placed&, const Placed&) = default;
  };
  static auto key_of(const Placed& p) { return std::tuple(p.level, p.model, p.stride, p.step_phase, p.slot); }
  [[nodiscard]] Placed placed_at(std::uint32_t slot) const {
    const Character& c = slots[slot].character;
    const auto model =
        c.network() ? std::bit_cast<std::uintptr_t>(c.network()) : std::bit_cast<std::uintptr_t>(c.model());
    return {c.level, c.stride, c.phase % c.stride, model, slot};
  }

  // Sorts characters by level, model, stride and the tick of their next turn, so that batches are full. Costly levels
  // come first, so that no worker starts a long batch last. Models are ordered by address, which differs between runs.
  // No result depends on this, as a character ends in the same bits in any batch.
  void arrange() {
    order.clear();
    for (std::uint32_t s = 0; s < slots.size(); ++s) {
      if (slots[s].live && !slots[s].character.suspended) order.push_back(placed_at(s));
    }
    std::ranges::sort(order, {}, key_of);
    is_arranged = true;
  }
  // Whether `order` is what arrange() would make of the current characters.
  [[nodiscard]] bool is_order_right() const {
    std::size_t count = 0;
    for (const Slot& slot : slots) count += slot.live && !slot.character.suspended;
    const auto is_current = [this](const Placed& placed) { return placed == placed_at(placed.slot); };
    return order.size() == count && std::ranges::all_of(order, is_current) &&
           std::ranges::adjacent_find(order, std::ranges::greater_equal{}, key_of) == order.end();
  }
  // The character at a place of the order.
  [[nodiscard]] Character& at(std::size_t i) { return slots[order[i].slot].character; }

  // Makes room for an environment of that index.
  void need_environment(std::uint32_t index) {
    HAIRNET_ASSERT(index < kEnvironmentCountMax);
    if (index >= environments.size()) environments.resize(index + 1, def.environment);
  }

  void check_invariants() const {
    HAIRNET_ASSERT(slots.size() == live_count + free_slots.size());
    HAIRNET_ASSERT(live_count <= def.character_count_max);
    HAIRNET_ASSERT(environments.size() <= kEnvironmentCountMax);
    HAIRNET_VALIDATE(!is_arranged || is_order_right());
  }

  // Does what World::set_level does, without marking the order as outdated.
  bool change_level(const LevelChange& change) {
    Character* c = find(change.id);
    if (!c || !has_level(change.level, *c)) return false;
    if (change.level == LevelIndex::learnt && !is_learnt_tick(def.tick_s)) return false;
    switch_level(change.level, *c);
    HAIRNET_ASSERT(c->level == change.level || c->rigid_ease_s >= 0);
    hairnet::check_invariants(*c);
    return true;
  }

  // The bodies of the character's room.
  [[nodiscard]] const RoomBodies& bodies_near(const Character& c) const {
    static const RoomBodies kNone;
    const auto room = bodies.find(c.environment);
    return room == bodies.end() ? kNone : room->second;
  }

  // Finds for each character the bodies that it meets in this tick. Costs nothing in a world without bodies.
  void meet_all_bodies() {
    touch_counts.clear();
    // In the tick after the last body has gone, holds by that body still have to end.
    if (bodies.empty() && !is_any_touched) return;
    touch_counts.resize(order.size());
    run_chunks(def.parallel_for, order.size(), [&](std::size_t begin, std::size_t end) {
      for (std::size_t i = begin; i < end; ++i) touch_counts[i] = meet_bodies(bodies_near(at(i)), def.tick_s, at(i));
    });
  }

  void begin_ticks() {
    const TickContext shared = terms();
    outcomes.resize(order.size());
    run_chunks(def.parallel_for, order.size(), [&](std::size_t begin, std::size_t end) {
      for (std::size_t i = begin; i < end; ++i) outcomes[i] = begin_tick(shared, at(i));
    });
  }

  void step_batches() {
    HAIRNET_ASSERT(outcomes.size() == order.size());
    batches.clear();
    for (std::size_t i = 0; i < order.size(); ++i) {
      if (outcomes[i] == Outcome::stepped) batches.add(at(i), outcomes[i]);
      // A character that eased may have become rigid in this tick, which changes its place in the order.
      if (outcomes[i] == Outcome::eased) is_arranged = false;
    }
    batches.step(terms(), def.now_ns, def.parallel_for);
  }

  void add_touch(StepReport& sum) {
    for (std::size_t i = 0; i < touch_counts.size(); ++i) {
      sum.bodies_refused += touch_counts[i].bodies_refused;
      sum.bodies_left_out += touch_counts[i].bodies_left_out;
      sum.holds_ended += touch_counts[i].holds_ended;
      const Character& c = at(i);
      if (!c.touch) continue;
      ++sum.touched;
      sum.holds_ended += c.touch->holds_stretched;
    }
    is_any_touched = sum.touched > 0;
  }

  [[nodiscard]] StepReport report() {
    StepReport sum;
    add_touch(sum);
    for (const Outcome outcome : outcomes) {
      sum.stepped += outcome == Outcome::stepped || outcome == Outcome::reset;
      sum.teleports += outcome == Outcome::teleport;
      sum.lattices_reset += outcome == Outcome::reset;
      sum.asleep += outcome == Outcome::asleep;
      sum.waiting += outcome == Outcome::waiting;
    }
    HAIRNET_ASSERT(order.size() <= live_count);
    sum.suspended = static_cast<std::uint32_t>(live_count - order.size());
    sum.costs = batches.costs();
    return sum;
  }

  WorldDef def;
  StepPlans plans;
  // The environment of each index; characters have indices into it.
  std::vector<Environment> environments;
  // Slots never move in memory, as this is a deque; removed slots are reused.
  std::deque<Slot> slots;
  // The slots of removed characters.
  std::vector<std::uint32_t> free_slots;
  std::size_t live_count = 0;
  // The live characters without suspended ones, in the order of arrange().
  std::vector<Placed> order;
  // Whether the order is right for the current characters, levels and strides.
  bool is_arranged = false;
  // The outcomes of the last tick, in the order of `order`.
  std::vector<Outcome> outcomes;
  // What meet_bodies counted for each entry of `order`; empty while nobody can be touched.
  std::vector<TouchCounts> touch_counts;
  Batches batches;
  // The key is the environment. A room without bodies has no entry.
  std::map<std::uint32_t, RoomBodies> bodies;
  // Whether any character may have a CharacterTouch.
  bool is_any_touched = false;
  // The number of ticks that have been stepped, which is the number of the next one.
  std::uint64_t tick = 0;
  // Whether a thread is within World::step().
  bool is_stepping = false;
};

World::World(const WorldDef& def) : impl_(std::make_unique<Impl>(def)) {}
World::~World() = default;
World::World(World&&) noexcept = default;
World& World::operator=(World&&) noexcept = default;

World::Impl& World::between_steps() const {
  // The world must not have been moved from.
  HAIRNET_ASSERT(impl_);
  HAIRNET_ASSERT(!impl_->is_stepping);
  return *impl_;
}

CharacterId World::add(const CharacterDef& def) {
  Impl& w = between_steps();
  HAIRNET_ASSERT(is_valid(def.pose));
  if (w.live_count >= w.def.character_count_max) return {};
  std::uint32_t index = 0;
  if (w.free_slots.empty()) {
    index = static_cast<std::uint32_t>(w.slots.size());
    w.slots.emplace_back();
  } else {
    index = w.free_slots.back();
    w.free_slots.pop_back();
  }
  Slot& slot = w.slots[index];
  HAIRNET_ASSERT(!slot.live);
  HAIRNET_ASSERT(slot.generation != 0);
  slot.live = true;
  slot.character = {};
  slot.character.levels = def.levels;
  slot.character.from = slot.character.to = slot.character.last_from = slot.character.still_pose = def.pose;
  slot.character.last_step_s = w.def.tick_s;
  slot.character.state_tick = w.tick;
  slot.character.phase = index;
  slot.character.environment = def.environment;
  slot.character.owner = def.owner;
  w.need_environment(def.environment);
  ++w.live_count;
  w.is_arranged = false;
  const CharacterId id{index, slot.generation};
  // A level that the character lacks leaves it rigid.
  set_level(id, def.level);
  w.check_invariants();
  return id;
}

void World::remove(CharacterId id) {
  Impl& w = between_steps();
  if (!w.find(id)) return;
  Slot& slot = w.slots[id.slot];
  slot.live = false;
  slot.character = {};
  // Generation zero is the null id.
  if (++slot.generation == 0) slot.generation = 1;
  w.free_slots.push_back(id.slot);
  w.is_arranged = false;
  HAIRNET_ASSERT(w.live_count > 0);
  --w.live_count;
  w.check_invariants();
}

void World::set_pose(CharacterId id, const Pose& pose, bool teleport) {
  Impl& w = between_steps();
  HAIRNET_ASSERT(is_valid(pose));
  if (Character* c = w.find(id)) {
    c->to = pose;
    // A later pose of the same tick must not hide the jump before it.
    c->teleport = c->teleport || teleport;
  }
}

void World::set_level_set(CharacterId id, std::shared_ptr<const LevelSet> levels) {
  Impl& w = between_steps();
  Character* c = w.find(id);
  if (!c) return;
  replace_levels(std::move(levels), *c);
  w.is_arranged = false;
  check_invariants(*c);
}

bool World::set_level(CharacterId id, LevelIndex index) {
  Impl& w = between_steps();
  const bool is_changed = w.change_level({id, index});
  if (is_changed) w.is_arranged = false;
  return is_changed;
}

void World::set_levels(std::span<const LevelChange> changes) {
  // Each part goes over the whole list of changes to find its own, so the number of parts is bounded.
  constexpr std::size_t kPartCountMax = 64;
  Impl& w = between_steps();
  if (changes.empty()) return;
  w.is_arranged = false;
  // All changes of a character are in one part, so that they are made in turn, and no two threads change the same
  // character.
  const std::size_t part_count = std::min(changes.size(), kPartCountMax);
  const auto change_part = [&](std::size_t part) {
    for (const LevelChange& change : changes) {
      if (change.id.slot % part_count == part) w.change_level(change);
    }
  };
  run_loop(w.def.parallel_for, part_count, std::cref(change_part));
}

void World::set_material(CharacterId id, const MaterialScale& material) {
  Impl& w = between_steps();
  HAIRNET_ASSERT(validate(material).empty());
  Character* c = w.find(id);
  if (!c || c->material == material) return;
  c->material = material;
  // The limit of elastic energy belongs to the old stiffness.
  c->state.elastic_energy_max_j = std::numeric_limits<float>::infinity();
  c->wake();
}

void World::set_environment(std::uint32_t index, const Environment& environment) {
  Impl& w = between_steps();
  HAIRNET_ASSERT(environment.gravity.allFinite());
  w.need_environment(index);
  w.environments[index] = environment;
  for (Slot& slot : w.slots) {
    // Sleeping hair would not feel a new wind.
    if (slot.character.environment == index) slot.character.wake();
  }
}

void World::set_stride(CharacterId id, int stride) {
  Impl& w = between_steps();
  HAIRNET_ASSERT(stride == 1 || stride == 2 || stride == kStrideMax);
  Character* c = w.find(id);
  if (!c || c->stride == stride) return;
  c->stride = static_cast<std::uint8_t>(stride);
  w.is_arranged = false;
}

void World::set_suspended(CharacterId id, bool suspended) {
  Impl& w = between_steps();
  Character* c = w.find(id);
  if (!c || c->suspended == suspended) return;
  if (suspended) {
    suspend(*c);
  } else {
    unsuspend(w.tick, *c);
  }
  w.is_arranged = false;
  check_invariants(*c);
}

bool World::set_state(CharacterId id, std::span<const Vec3f> displacement, std::span<const Vec3f> velocity) {
  Character* c = between_steps().find(id);
  if (!c || !replace_state(displacement, velocity, *c)) return false;
  check_invariants(*c);
  return true;
}

void World::set_bodies(std::uint32_t environment, std::span<const TouchBody> bodies) {
  Impl& w = between_steps();
  HAIRNET_ASSERT(environment < kEnvironmentCountMax);
  if (bodies.empty()) {
    w.bodies.erase(environment);
    return;
  }
  RoomBodies& room = w.bodies[environment];
  room = move_bodies(room, bodies, w.def.tick_s);
}

void World::set_touch_rule(CharacterId id, const TouchRule& rule) {
  Impl& w = between_steps();
  HAIRNET_ASSERT(std::ranges::is_sorted(rule.chosen));
  Character* c = w.find(id);
  if (!c) return;
  c->touch_rule = rule;
  end_forbidden_holds(*c);
}

std::uint32_t World::grab(CharacterId id, const Grab& grab) {
  Impl& w = between_steps();
  HAIRNET_ASSERT(grab.place.allFinite());
  HAIRNET_ASSERT(grab.radius_m >= 0);
  HAIRNET_ASSERT(grab.radius_m <= kGrabRadiusMax_m);
  Character* c = w.find(id);
  return c ? take_hold(w.bodies_near(*c), grab, *c) : 0;
}

void World::let_go(CharacterId id, const TouchKey& hand, Release release) {
  if (Character* c = between_steps().find(id)) hairnet::let_go(hand, release, *c);
}

StepReport World::step() {
  Impl& w = between_steps();
  // The flag catches calls of the World from within its own step.
  w.is_stepping = true;
  if (!w.is_arranged) w.arrange();
  HAIRNET_VALIDATE(w.is_order_right());
  // Touch may wake a character and give it a turn, so it comes before begin_ticks.
  w.meet_all_bodies();
  w.begin_ticks();
  w.step_batches();
  // A body that nobody sets again stays where it is in the next tick.
  for (auto& [room, bodies] : w.bodies) rest_bodies(bodies);
  ++w.tick;
  w.is_stepping = false;
  w.check_invariants();
  return w.report();
}

bool World::contains(CharacterId id) const {
  return std::as_const(*impl_).find(id) != nullptr;
}
std::size_t World::character_count() const {
  return impl_->live_count;
}

LatticeView World::lattice(CharacterId id) const {
  const Slot* slot = std::as_const(between_steps()).find(id);
  HAIRNET_ASSERT(slot);
  const Character& c = slot->character;
  const bool stepped = c.changed_tick == impl_->tick && !c.suspended;
  return {.level = c.level,
          .model = c.model(),
          .displacement = c.state.displacement,
          .coefficients = c.learnt.coefficients,
          .is_covered = c.learnt.is_covered,
          .pose = &c.from,
          .asleep = c.is_asleep(),
          .stepped = stepped,
          .discontinuous = c.discontinuous,
          .is_touched = c.touch != nullptr};
}

const LatticeState& World::state(CharacterId id) const {
  const Slot* slot = std::as_const(between_steps()).find(id);
  HAIRNET_ASSERT(slot);
  return slot->character.state;
}

std::uint32_t World::held_count(CharacterId id, const TouchKey& hand) const {
  const Slot* slot = std::as_const(between_steps()).find(id);
  return slot ? hairnet::held_count(slot->character, hand) : 0;
}

std::uint64_t World::hash() const {
  const Impl& w = between_steps();
  Fnv fnv;
  for (std::size_t s = 0; s < w.slots.size(); ++s) {
    const Slot& slot = w.slots[s];
    if (!slot.live) continue;
    const Character& c = slot.character;
    fnv.add(std::uint64_t{s});
    fnv.add(static_cast<std::uint64_t>(c.level));
    fnv.add(c.stiffness);
    fnv.add(c.untangle.share());
    fnv.add(c.bones_still_s);
    fnv.add(c.still_s);
    fnv.add(c.rigid_ease_s);
    fnv.add(c.since_switch_s);
    const MaterialScale& m = c.material;
    for (const float x : {m.stiffness, m.damping, m.density, m.ether_damping, m.air_drag, m.gel_per_s2}) fnv.add(x);
    fnv.add(c.state.elastic_energy_max_j);
    fnv.add(c.state.speed_max_m_per_s);
    fnv.add(std::uint64_t{c.environment} << 8 | std::uint64_t{c.stride} << 4 |
            std::uint64_t{c.velocity_is_relative} << 3 | std::uint64_t{c.suspended} << 2 |
            std::uint64_t{c.steps_next_tick} << 1 | std::uint64_t{c.teleport});
    // The hash has the age of the state instead of its tick, so that worlds which began at different ticks can agree.
    fnv.add(c.suspended ? 0 : w.tick - c.state_tick);
    fnv.add(c.head_velocity);
    for (const Pose* pose : {&c.from, &c.to}) {
      for (const RigidTransform& bone : pose->bones) fnv.add(bone);
    }
    for (const Vec3f& d : c.state.displacement) fnv.add(d);
    for (const Vec3f& v : c.state.velocity) fnv.add(v);
    for (const float hidden : c.learnt.state.hidden) fnv.add(hidden);
    if (c.touch) fnv.add(*c.touch);
  }
  for (const auto& [room, bodies] : w.bodies) {
    fnv.add(std::uint64_t{room});
    for (const RoomBody& body : bodies) fnv.add(body);
  }
  return fnv.value();
}

}  // namespace hairnet
