#pragma once

#include <cstdint>
#include <span>
#include <vector>

#include "core/solver/step.hpp"
#include "core/world/grab.hpp"
#include "core/world/room_bodies.hpp"

namespace hairnet {

struct Character;

// A held point that pulls harder slides through the hand, as its anchor is moved towards it.
inline constexpr double kHoldSlip_n = 0.5;
// A hand loses a point that is farther from its anchor.
inline constexpr double kHoldStretchMax_m = 0.25;

// A contact point of the hair that a hand holds, or has pinned to the head.
struct Hold {
  TouchKey hand;
  // Names a contact point of the level.
  std::uint32_t point = 0;
  // Is where the point is bound to: own axes of the hand's shape, or, when pinned, head space; m.
  Vec3 anchor = Vec3::Zero();
  bool is_pinned = false;
};

// What touches one character. It exists only while a body is near or the hair is held, so untouched characters cost one
// null pointer.
struct CharacterTouch {
  struct MetBody {
    TouchKey key;
    // Moves over the whole tick.
    StepBody body;
  };
  // Is a hand with holds that are not pinned, over the tick, world.
  struct Hand {
    TouchKey key;
    RigidTransform from, to;
  };
  // Ascend by key; are met in this tick. Only hair with a lattice is given bodies.
  std::vector<MetBody> bodies;
  std::vector<Hand> hands;
  // Holds of one hand that are not pinned are neighbours.
  std::vector<Hold> holds;
  // Counts the grabs that this tick's step ended by stretching.
  std::uint32_t holds_stretched = 0;
  // Hold what the steps of this turn read.
  std::vector<StepBody> step_bodies;
  std::vector<StepHold> step_holds;
  std::vector<StepTouch> steps;
};

// See StepReport.
struct TouchCounts {
  std::uint32_t bodies_refused = 0, bodies_left_out = 0, holds_ended = 0;
};

// Finds the bodies that the character meets in the coming tick, and lets go of hair whose hand has gone. Moving bodies
// and hands that hold hair keep the character awake and give it a turn. Call it before begin_tick.
TouchCounts meet_bodies(const RoomBodies& room, double tick_s, Character& character);

// Sets StepInput::touch of a turn's steps, after put_inputs. Asserts that the character is touched.
void put_touch(Character& character, std::span<StepInput> inputs);

// Lets anchors slide after the steps of a turn, and lets go of points that are stretched too far. Asserts that the
// character is touched.
void slip_holds(Character& character);

// See World::grab and World::let_go.
std::uint32_t take_hold(const RoomBodies& room, const Grab& grab, Character& character);
void let_go(const TouchKey& hand, Release release, Character& character);
// See World::held_count.
std::uint32_t held_count(const Character& character, const TouchKey& hand);

// Let go of all hair; of that which is not pinned; of that whose holder the character's rule forbids.
void end_holds(Character& character);
void end_hands(Character& character);
void end_forbidden_holds(Character& character);

}  // namespace hairnet
