#pragma once

#include <cstdint>
#include <functional>
#include <memory>
#include <span>
#include <utility>
#include <vector>

#include "core/modes/moved_lattice.hpp"
#include "core/world/world.hpp"

namespace hairnet::local {

// A character's pose at the end of a tick.
struct TickPose {
  Pose pose;
  // The pose does not continue the one before: the hair does not swing after the jump.
  bool teleport = false;
};

// The core's World in this process, played out: it is always stepped to just beyond the shown time, and hair is shown
// between the last two ticks. So the shown hair is exact, and the same calls give the same hair. One thread.
class PlayedWorld {
 public:
  static constexpr double kTickRateMin_hz = 10, kTickRateMax_hz = 240;
  static constexpr std::uint32_t kCharactersMax = 65'536;
  // The number of a character, from 1.
  using Id = std::uint32_t;
  // Returns the character's pose at `to_s`, and whether it jumps after `from_s`; both are times of the world. It is
  // called once for each tick, and with two equal times for the pose that is shown.
  using PoseAt = std::function<TickPose(double from_s, double to_s)>;
  struct Def {
    double tick_rate_hz = 30;
    double start_s = 0;
    Wind wind;
    // Times steps; null means that they are not timed.
    ClockNs clock_ns = nullptr;
  };
  // The hands and props at the end of a tick from `from_s` to `to_s`, in the order of their keys. Called once for each
  // tick; it may grab and let go.
  using BodiesAt = std::function<std::vector<TouchBody>(double from_s, double to_s)>;
  // Asserts that the rate is in its range and the wind is valid.
  explicit PlayedWorld(const Def& def);

  // Adds a character, whose hair is rigid until it has levels. Returns 0 when there are kCharactersMax already.
  Id add(PoseAt pose);
  void remove(Id id);
  // A set may lack levels (Level::rest is empty): hair stays as it is when such a one is asked for.
  void give_levels(Id id, std::shared_ptr<const LevelSet> levels);
  // Nothing is learnt here: learnt hair is stepped at level low, as by a server before it has learnt.
  void set_level(Id id, LevelIndex level);
  // These two assert that their argument is valid.
  void set_material(Id id, const MaterialScale& scale);
  void set_wind(const Wind& wind);
  [[nodiscard]] const Wind& wind() const { return def_.wind; }
  // Sets the hands and props. They may touch everyone's hair, since this program alone has hands here.
  void touch_by(BodiesAt bodies) { bodies_ = std::move(bodies); }
  // Takes hold of hair like World::grab(), with a hand of the last tick.
  std::uint32_t grab(Id id, const Grab& grab);
  void let_go(Id id, const TouchKey& hand, Release release);
  // Keeps the state of the hair; hands let go of it.
  void set_tick_rate(double hz);
  [[nodiscard]] double tick_rate_hz() const { return def_.tick_rate_hz; }

  // Gets the report of each tick, and how long its step took, ms (0 without a clock). It must not change the world.
  using OnTick = std::function<void(double end_s, const StepReport& report, double step_ms)>;
  void on_tick(OnTick call) { on_tick_ = std::move(call); }
  // `time_s` never decreases.
  void advance_to(double time_s);
  [[nodiscard]] double time_s() const { return shown_s_; }
  // Returns the end of the shown tick, or of the next one at its end.
  [[nodiscard]] double tick_end_s() const;

  // A character as it is shown; spans are valid until the next change.
  struct Shown {
    Pose pose;
    LevelIndex level = LevelIndex::rigid;
    // Moves the hair by the displacements of all nodes of the grid.
    MovedLattice lattice;
    // Null at rest.
    std::shared_ptr<const LevelGeometry> geometry;
    // The displacements of the active nodes, in active order, head space, m.
    std::span<const Vec3f> displacement;
    // Null when rigid.
    std::shared_ptr<const Level> model;
  };
  // Asserts that the character is there.
  [[nodiscard]] Shown shown(Id id) const;
  [[nodiscard]] const World& world() const { return world_; }
  // Returns the lattice after the last tick. Asserts that the character is there.
  [[nodiscard]] LatticeView lattice(Id id) const;

 private:
  // A lattice at the end of a tick.
  struct Lattice {
    LevelIndex level = LevelIndex::rigid;
    std::shared_ptr<const LevelGeometry> geometry;
    std::vector<Vec3f> displacement;
  };
  struct Simulated {
    Id id = 0;
    CharacterId character;
    PoseAt pose;
    std::shared_ptr<const LevelSet> levels;
    LevelIndex level_wanted = LevelIndex::high;
    MaterialScale material;
    // The last two ticks.
    Lattice before, after;
    // The shown displacements: of the active nodes, and of all nodes of the grid.
    std::vector<Vec3f> displacement, grid;
    // The lattice that is shown.
    const Lattice* lattice = nullptr;
  };
  // The definition of the World for these options.
  static WorldDef world_def(const Def& def);
  [[nodiscard]] Simulated& at(Id id);
  [[nodiscard]] const Simulated& at(Id id) const;
  // The time at the end of a tick.
  [[nodiscard]] double tick_time_s(std::uint64_t tick) const;
  // Steps the World by one tick.
  void tick();
  // Takes the character's lattice after a tick; the one of the tick before becomes `before`.
  void take_lattice(Simulated& simulated);
  // Sets the wanted level, if the character has it.
  void set_level_now(Simulated& simulated);
  // Computes what is shown of the character at shown_s_.
  void show(Simulated& simulated) const;

  Def def_;
  World world_;
  std::vector<std::unique_ptr<Simulated>> simulated_;
  BodiesAt bodies_;
  OnTick on_tick_;
  Id next_id_ = 1;
  // tick_ counts the ticks that are done. Tick start_tick_ ended at start_s_; the ticks after it have the present rate.
  std::uint64_t tick_ = 0, start_tick_ = 0;
  // start_s_: see tick_. shown_s_ is the time that is shown.
  double start_s_, shown_s_;
};

}  // namespace hairnet::local
