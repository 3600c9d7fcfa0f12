#pragma once

#include <cstdint>
#include <span>
#include <vector>

#include "core/solver/step.hpp"
#include "core/world/grab.hpp"
#include "core/world/room_bodies.hpp"

namespace hairnet {

struct Character;

// The force above which a held point slides through the hand: its anchor is moved towards the point.
inline constexpr double kHoldSlip_n = 0.5;
// A hand loses a point that is farther from its anchor than this.
inline constexpr double kHoldStretchMax_m = 0.25;

// A contact point of the hair that a hand holds, or has pinned to the head.
struct Hold {
  TouchKey hand;
  // The index of a contact point of the character's level.
  std::uint32_t point = 0;
  // The place to which the point is bound, m: in own axes of the hand's shape or, when pinned, in head space.
  Vec3 anchor = Vec3::Zero();
  bool is_pinned = false;
};

// What touches one character. It exists only while a body is near or the hair is held, so untouched characters cost one
// null pointer.
struct CharacterTouch {
  // A body near the hair.
  struct MetBody {
    TouchKey key;
    // The body as it moves over the whole tick, world. A hand has been pushed out of the skin.
    StepBody body;
  };
  // A hand with holds that are not pinned: its place at the start and at the end of the tick, world.
  struct Hand {
    TouchKey key;
    RigidTransform from, to;
  };
  // The bodies that are met in this tick, ascending by key. Only hair with a lattice is given any.
  std::vector<MetBody> bodies;
  std::vector<Hand> hands;
  // All holds and pins. Holds of one hand that are not pinned are neighbours in the list.
  std::vector<Hold> holds;
  // The hands that lost their hair by stretching in this tick's step.
  std::uint32_t holds_stretched = 0;
  // What the substeps of the current turn read; put_touch fills them and StepInput::touch points to `steps`.
  std::vector<StepBody> step_bodies;
  std::vector<StepHold> step_holds;
  std::vector<StepTouch> steps;
};

// What meet_bodies counts of one character; StepReport has the sums and their meaning.
struct TouchCounts {
  std::uint32_t bodies_refused = 0, bodies_left_out = 0, holds_ended = 0;
};

// Finds the bodies that the character meets in the coming tick, and ends the holds of hands that have gone or may not
// touch any more. Moving bodies and hands that hold hair keep the character awake and give it a turn. Call it before
// begin_tick.
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

// Three ways to let go of hair: of all of it, of all that is not pinned, and of all whose holder the character's rule
// forbids. Each wakes the character if a hold ends.
void end_holds(Character& character);
void end_hands(Character& character);
void end_forbidden_holds(Character& character);

}  // namespace hairnet
