#pragma once

#include <cstdint>
#include <map>
#include <optional>
#include <vector>

#include "core/touch/hand.hpp"
#include "schema/wire/messages.hpp"

namespace hairnet::room {

// What touches hair in a room beside this client: its props, and the hands of others, which are played out as hair is.
// No I/O; one thread.
class RoomTouch {
 public:
  // Hands of whom nothing has come for so long are gone: the word of it may have been lost.
  static constexpr std::int64_t kHandsGone_ns = 500'000'000;

  void take(const wire::RoomProps& announced);
  // `sampled_ns`: their sample time, on the clock of `now_ns`. Drops those of a person of whom newer ones have come.
  void take(const wire::RoomHands& announced, std::int64_t sampled_ns, std::int64_t now_ns);
  // Moves hands() to a sample time; none: to the newest samples.
  void play_hands(std::optional<std::int64_t> sampled_ns, std::int64_t now_ns);
  void clear();

  // By number.
  [[nodiscard]] const std::map<std::uint8_t, wire::Prop>& props() const { return props_; }
  // Of each person that has any.
  [[nodiscard]] const std::vector<wire::RoomHands::Person>& hands() const { return hands_; }

 private:
  struct Sample {
    std::uint64_t tick = 0;
    std::int64_t sampled_ns = 0;
    std::vector<Hand> hands;
  };
  struct Person {
    std::uint64_t session = 0;
    std::int64_t heard_ns = 0;
    std::vector<Sample> samples;  // Their ticks rise; there is one at least.
  };

  std::map<std::uint8_t, wire::Prop> props_;
  std::vector<Person> people_;
  std::vector<wire::RoomHands::Person> hands_;
};

}  // namespace hairnet::room
