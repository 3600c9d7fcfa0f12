#pragma once

#include <cstdint>
#include <map>
#include <optional>
#include <vector>

#include "core/touch/hand.hpp"
#include "schema/wire/messages.hpp"

namespace hairnet::room {

// What touches hair in a room, apart from this client's own hands: the props of the room, and the hands of others,
// which are played out as hair is. It sends nothing. No I/O; one thread.
class RoomTouch {
 public:
  // A person's hands are gone when nothing has come from that person for this long. The message that says so may have
  // been lost.
  static constexpr std::int64_t kHandsGone_ns = 500'000'000;

  // Adds, changes and removes props as the server announces.
  void take(const wire::RoomProps& announced);
  // Stores a sample of the hands of each named person. `sampled_ns` is the sample time, on the clock of `now_ns`. A
  // sample that is older than the person's newest one is dropped.
  void take(const wire::RoomHands& announced, std::int64_t sampled_ns, std::int64_t now_ns);
  // Moves hands() to the sample time of the shown hair. None: no hair is shown, and hands() has the newest samples.
  void play_hands(std::optional<std::int64_t> sampled_ns, std::int64_t now_ns);
  // Forgets all props and hands.
  void clear();

  // The props of the room by their number.
  [[nodiscard]] const std::map<std::uint8_t, wire::Prop>& props() const { return props_; }
  // The hands of each person that has any, at the time of the last play_hands().
  [[nodiscard]] const std::vector<wire::RoomHands::Person>& hands() const { return hands_; }

 private:
  // The hands of one person at one tick of the server.
  struct Sample {
    std::uint64_t tick = 0;
    // The sample time, on this client's clock.
    std::int64_t sampled_ns = 0;
    std::vector<Hand> hands;
  };
  struct Person {
    std::uint64_t session = 0;
    // The time at which the newest sample came.
    std::int64_t heard_ns = 0;
    // Sorted by tick, the oldest first; never empty, at most kSamplesMax.
    std::vector<Sample> samples;
  };

  std::map<std::uint8_t, wire::Prop> props_;
  std::vector<Person> people_;
  // The result of the last play_hands().
  std::vector<wire::RoomHands::Person> hands_;
};

}  // namespace hairnet::room
