#pragma once

#include <cstdint>
#include <span>
#include <utility>
#include <vector>

#include "core/random.hpp"
#include "core/touch/hand.hpp"
#include "schema/wire/client_messages.hpp"

namespace hairnet::whole {

// How a player touches hair, at random: a hand appears at the head of a member, strokes, takes hold, lets go, pins and
// vanishes. The player also changes who may touch its own hair, and sets props where it may.
class Touching {
 public:
  // What the player knows of a member: its number, and where its head is in the world.
  struct Head {
    std::uint32_t member = 0;
    RigidTransform place;
  };
  // What a request may be about.
  struct Surroundings {
    std::span<const Head> heads;
    // The numbers of the player's own characters.
    std::span<const std::uint32_t> characters;
    bool may_set_props = false;
  };

  explicit Touching(Random random) : random_(random) {}

  // The messages of one random request; none where there is nothing to do.
  std::vector<wire::ClientMessage> act(const Surroundings& around);
  // The player's next hands, at `time_s`. There are none while no hand has appeared, or its member is not among the
  // heads.
  std::vector<Hand> hands(std::span<const Head> heads, double time_s);
  // Ends all that act() has begun: the messages let go of all hair, remove the props, and let only the owner touch.
  // There are no hands from here on.
  std::vector<wire::ClientMessage> end(std::span<const std::uint32_t> characters, bool may_set_props);

 private:
  wire::SetProps random_props(const Head& near);

  Random random_;
  // The member at whose head the hand is; 0: there is no hand.
  std::uint32_t at_member_ = 0;
  // The hand has come to this head at once, which its next sample says.
  bool has_jumped_ = false;
  // The members whose hair a hand has taken hold of, with the number of the hand's shape. A server may have ended some
  // of these holds since.
  std::vector<std::pair<std::uint32_t, std::uint8_t>> holds_;
};

}  // namespace hairnet::whole
