#pragma once

#include <cstdint>
#include <optional>
#include <vector>

#include "tests/load/plan.hpp"

namespace hairnet::load {

// The action of a client at its intended time, counted from the plan's begin. Clients are numbered from 0; a number is
// never used for another client.
struct Action {
  enum class Kind : std::uint8_t { join, leave, vanish, lose_connection, set_characters };
  std::int64_t at_ns = 0;
  // `leave` sends goodbye, `vanish` leaves without, and `lose_connection` returns at once.
  Kind kind = Kind::join;
  std::uint32_t client = 0;
  // The index of a client that joins among those that are there, which decides its room. A client that replaces another
  // one gets that one's place.
  std::uint32_t place = 0;
  // A client that joins behaves well, or badly in this way.
  std::optional<Misbehaviour> misbehaviour;
  // After `join` and `set_characters` the client has so many characters.
  std::uint32_t characters = 0;
  std::size_t stage = 0;
  friend bool operator==(const Action&, const Action&) = default;
};

// Returns all arrivals and departures of the plan, in the order of time. They are made before the run begins (an open
// model), so nothing that the server does can delay one.
std::vector<Action> make_schedule(const Plan& plan);

}  // namespace hairnet::load
