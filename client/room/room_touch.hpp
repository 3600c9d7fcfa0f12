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
  // The hands of a person from whom nothing has come for so long are gone: the message that says so may have been lost.
  static constexpr std::int64_t kHandsGone_ns = 500'000'000;

  void take(const wire::RoomProps& announced);
  // `sampled_ns` is the sample time of the hands, on the clock of `now_ns`. Drops a person's hands if newer ones of
  // that person have come.
  void take(const wire::RoomHands& announced, std::int64_t sampled_ns, std::int64_t now_ns);
  // Moves hands() to a sample time, that of the shown hair; none: to the newest samples.
  void play_hands(std::optional<std::int64_t> sampled_ns, std::int64_t now_ns);
  void clear();

  // By number.
  [[nodiscard]] const std::map<std::uint8_t, wire::Prop>& props() const { return props_; }
  // Returns the hands of each person that has any.
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
    // Their ticks rise, and there is at least one.
    std::vector<Sample> samples;
  };

  std::map<std::uint8_t, wire::Prop> props_;
  std::vector<Person> people_;
  std::vector<wire::RoomHands::Person> hands_;
};

}  // namespace hairnet::room
