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
  // A client that joins takes the place of the client it replaces, else the next free one.
  std::uint32_t place = 0;
  // Belongs to a client that joins.
  std::optional<Misbehaviour> misbehaviour;
  // After join and set_characters the client has so many.
  std::uint32_t characters = 0;
  std::size_t stage = 0;
  friend bool operator==(const Action&, const Action&) = default;
};

// An open model: all arrivals and departures of the plan, by time, made before the first of them. Nothing that the
// server does can move one.
std::vector<Action> make_schedule(const Plan& plan);

}  // namespace hairnet::load
