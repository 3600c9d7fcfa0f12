#pragma once

#include <cstdint>
#include <functional>
#include <memory>
#include <optional>
#include <string>
#include <utility>
#include <vector>

#include "client/local/played_world.hpp"
#include "client/viewer/characters/place.hpp"
#include "client/viewer/sources/hair_source.hpp"
#include "client/viewer/sources/motion_timeline.hpp"
#include "core/touch/touch_body.hpp"
#include "core/world/grab.hpp"

namespace hairnet::viewer {

// A character to add: what it looks like and how it moves. Several may share a groom and a motion.
struct LocalCharacter {
  std::string name;
  std::shared_ptr<const Groom> groom;
  std::shared_ptr<const Motion> motion;
  Place place;
  LevelIndex level = LevelIndex::high;
  Vec3f hair_colour = Vec3f::Zero();
  // The material in place of the groom's while the character is simulated.
  std::optional<Material> material;
};

struct LocalTick {
  std::uint64_t number = 0;
  // The time at the tick's end.
  double time_s = 0;
  StepReport report;
  // The time that World::step took for all characters together, ms; zero without a clock.
  double step_ms = 0;
};

// A world in this process, whose characters move by clips. They begin at time 0; the world starts
// MotionTimeline::kLeadIn_s earlier, so that hair falls from its design into motion smoothly. All characters are the
// user's own. It has no clock: the same calls give the same bits. One thread; builds no levels (LevelBuilder, or the
// caller).
class LocalWorld : public HairSource {
 public:
  static constexpr double kTickRateMin_hz = local::PlayedWorld::kTickRateMin_hz,
                          kTickRateMax_hz = local::PlayedWorld::kTickRateMax_hz;
  struct Def {
    double tick_rate_hz = 30;
    // The duration of the clips, s, see MotionTimeline.
    double duration_s = 0;
    Loop loop = Loop::plain;
    Wind wind;
    // Times steps; null means that they are not timed.
    ClockNs clock_ns = nullptr;
  };
  explicit LocalWorld(const Def& def);

  // The character is rigid until it has levels. Returns its id.
  std::uint64_t add(LocalCharacter character);
  // Also restarts time; hands and props stay.
  void remove_all();
  // Gives levels to all characters with that groom that have none yet. A set may lack levels that were not requested
  // (Level::rest is empty): when such a level is asked for, the hair stays at the level that it has.
  void give_levels(const Groom& groom, const std::shared_ptr<const LevelSet>& levels);
  // The grooms of characters that have no levels yet.
  [[nodiscard]] std::vector<std::shared_ptr<const Groom>> grooms_without_levels() const;

  // Called after every tick: ticks().back() and lattice() belong to it. It must not change the world. A picture may be
  // made of several ticks, or of none.
  using OnTick = std::function<void()>;
  void on_tick(OnTick call) { ticks_->call = std::move(call); }

  // Sets the hands and props of all characters from now on, also after remove_all(). A call may take hold of hair and
  // let go of it, with the hands of the tick before.
  using BodiesAt = local::PlayedWorld::BodiesAt;
  void touch_by(BodiesAt bodies);
  // Takes hold of hair like World::grab(), and returns how many points of it the hand holds now; 0 for an unknown
  // character.
  std::uint32_t take_hair(std::uint64_t id, const Grab& grab);
  // Lets go of hair like World::let_go().
  void let_go_of_hair(std::uint64_t id, const TouchKey& hand, Release release);

  // Moves all to `time_s`, the time that is shown, which is simulated time. It never decreases. As many ticks are made
  // as that takes: the caller limits the step.
  void advance_to(double time_s);
  [[nodiscard]] double time_s() const { return played_->time_s(); }
  // Advances to the end of the shown tick, or of the next one when it is there already.
  void step_once();
  // Returns the time to which step_once() advances.
  [[nodiscard]] double tick_end_s() const { return played_->tick_end_s(); }
  // Keeps the state of the hair; hands let go of it.
  void set_tick_rate(double hz) { played_->set_tick_rate(hz); }
  [[nodiscard]] double tick_rate_hz() const { return played_->tick_rate_hz(); }
  // Simulated seconds in a second of advance()'s clock.
  void set_speed(double speed) { speed_ = speed; }
  [[nodiscard]] double speed() const { return speed_; }
  // The ticks of the last advance.
  [[nodiscard]] std::span<const LocalTick> ticks() const { return ticks_->last; }
  [[nodiscard]] const World& world() const { return played_->world(); }
  // The lattice after the last tick, with an empty displacement when rigid; none without such a character.
  [[nodiscard]] std::optional<LatticeView> lattice(std::uint64_t id) const;

  Result<void> advance(std::int64_t now_ns) override;
  [[nodiscard]] std::span<const ViewedCharacter> viewed_characters() const override { return viewed_; }
  HeadGrab* grab(std::uint64_t id) override;
  void set_material(std::uint64_t id, const MaterialScale& scale) override;
  void set_level(std::uint64_t id, LevelIndex level) override;
  void teleport(std::uint64_t id) override;
  [[nodiscard]] const Wind& wind() const override { return played_->wind(); }
  void set_wind(const Wind& wind) override;
  [[nodiscard]] bool paused() const override { return paused_; }
  void set_paused(bool paused) override { paused_ = paused; }

 private:
  struct SimulatedCharacter {
    // The timeline refers to the motion that `def` keeps, so it must be declared after it.
    SimulatedCharacter(LocalCharacter of, double duration_s, Loop loop)
        : def(std::move(of)), timeline(*def.motion, duration_s, loop), level_wanted(def.level) {}
    LocalCharacter def;
    std::uint64_t id = 0;
    local::PlayedWorld::Id played = 0;
    MotionTimeline timeline;
    bool has_levels = false;
    MaterialScale material;
    LevelIndex level_wanted;
    HeadGrab grab;
    // teleport() sets these: the character stands aside, and its next pose jumps.
    bool aside = false, teleport_pending = false;
  };
  void begin();
  SimulatedCharacter* find(std::uint64_t id);
  [[nodiscard]] static Pose pose_of(const SimulatedCharacter& simulated, double time_s);
  void show();

  Def def_;
  BodiesAt bodies_;
  std::unique_ptr<local::PlayedWorld> played_;
  // The entries are pointers, because callbacks of the played world refer to each character.
  std::vector<std::unique_ptr<SimulatedCharacter>> simulated_;
  std::vector<ViewedCharacter> viewed_;
  // Callbacks of played_ write to it through a pointer, so it lives on the heap and does not move with this object.
  struct Ticks {
    // The ticks of the last advance.
    std::vector<LocalTick> last;
    OnTick call;
    std::uint64_t number = 0;
  };
  std::unique_ptr<Ticks> ticks_ = std::make_unique<Ticks>();
  std::uint64_t next_id_ = 1;
  double speed_ = 1;
  bool paused_ = false;
  // The time of the last advance().
  std::optional<std::int64_t> last_ns_;
};

}  // namespace hairnet::viewer
