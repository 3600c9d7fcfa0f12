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
  Kind kind = Kind::join;  // leave: sends goodbye. vanish: leaves without. lose_connection: returns at once
  std::uint32_t client = 0;
  std::uint32_t place = 0;                   // join: the place of the client it replaces, else the next free one
  std::optional<Misbehaviour> misbehaviour;  // of a client that joins
  std::uint32_t characters = 0;              // join and set_characters: how many the client has from now on
  std::size_t stage = 0;
  friend bool operator==(const Action&, const Action&) = default;
};

// An open model: all arrivals and departures of the plan, by time, made before the first of them. Nothing that the
// server does can move one.
std::vector<Action> make_schedule(const Plan& plan);

}  // namespace hairnet::load
