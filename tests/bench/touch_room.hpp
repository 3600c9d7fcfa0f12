#pragma once

#include <cstdint>
#include <memory>
#include <string>
#include <vector>

#include "core/pose/motion.hpp"
#include "core/world/world.hpp"

namespace hairnet::bench {

// Where hands are while the ticks of a room are counted. `room`: each person's hand moves in it, one third of them at
// somebody's hair. `nowhere`: the World has never had any. `gone`: the hands were in the room, out of reach of all
// hair, and the World has lost them before the first tick that counts. `elsewhere`: one hand rests in another room of
// the same World.
enum class HandsAt : std::uint8_t { nowhere, room, gone, elsewhere };

// People of level low in one room of a World, 1.5 m apart, with the ticks that servers use. They play the same motion,
// each from another time of it, and begin with a second of it that does not count. Everyone may touch everyone.
class TouchRoom {
 public:
  static constexpr std::size_t kPeople = 20;

  // `levels` needs only the low one. All inputs of the ticks are made here, so that step() alone is what is counted.
  TouchRoom(const std::shared_ptr<const LevelSet>& levels, const Motion& motion, HandsAt hands, std::size_t tick_count);

  // Gives the World the poses and the hands of the next tick, and steps it. Asserts that there is one more tick.
  void step();

  // The mean number of characters near whom hands were, over the ticks that count.
  [[nodiscard]] double touched_mean() const;
  // One line about what would make the counts worthless: a character that was not stepped in every tick, a lattice that
  // was reset, hair that was stroked and not touched, or touched without a hand. Empty when there is nothing.
  [[nodiscard]] std::string fault() const;
  // A hash of the hair alone. It is the same for rooms whose hair no hand has touched.
  [[nodiscard]] std::string hash() const;

 private:
  struct Tick {
    std::vector<Pose> poses;
    // Empty where the tick has no hands in this room.
    std::vector<TouchBody> bodies;
  };

  HandsAt hands_;
  World world_;
  std::vector<CharacterId> ids_;
  std::vector<Tick> ticks_;
  std::size_t next_ = 0;
  // What the ticks that count have reported: sums over all ticks, and the fewest in one tick.
  std::uint64_t touched_ = 0, resets_ = 0;
  std::uint32_t stepped_least_ = kPeople, touched_least_ = kPeople;
};

}  // namespace hairnet::bench
