#pragma once

#include <cstdint>
#include <memory>
#include <optional>
#include <string>
#include <vector>

#include "client/link/playout.hpp"
#include "client/link/requested_state.hpp"
#include "core/groom/groom.hpp"
#include "core/pose/pose.hpp"
#include "core/skin/skin_distance_field.hpp"
#include "core/touch/touch_rule.hpp"
#include "schema/wire/messages.hpp"

namespace hairnet::room {

// One character of a room, as it is shown at the last Room::advance(). Only the Room changes it.
struct Member {
  // Is the number in the room; an own character gets another one from another server.
  std::uint32_t number = 0;
  // Is this client's own number for it; zero means another client's character.
  std::uint32_t own = 0;
  // Is the owner's session, and another after that one has ended and a new one begun.
  std::uint64_t session = 0;
  // Is the owner's own number for it: with `session` it is the same for all clients.
  std::uint32_t owners_character = 0;
  wire::GroomHash groom_hash{};
  // Holds any bytes, at most wire::kTagBytesMax; by convention the tag is a name in UTF-8.
  std::string tag;
  // None means the default of its number.
  std::optional<wire::Appearance> appearance;
  // Says who may touch its hair; an own character's as it was set last.
  TouchAudience touch = TouchAudience::oneself;
  // Holds the sessions of TouchAudience::chosen.
  std::vector<std::uint64_t> touch_chosen = {};
  // Is null when it is not here yet, or `error` says why it cannot be shown.
  std::shared_ptr<const Groom> groom;
  // Holds the bytes of its file; is null like `groom`.
  link::RequestedState::Bytes groom_file;
  // Says in one line why the groom cannot be shown; empty without an error.
  std::string error;
  // The member's hair is kept out of it (SkinPush); null until it is received.
  std::shared_ptr<const Skin> skin;
  // What to show now. An own character has the pose that was pushed last, with the newest lattice; the pose of others
  // belongs to the same time as their lattice. None: no pose is known, so the character cannot be shown.
  std::optional<Pose> pose;
  // Holds its lattice, and the level that the server steps; is at rest until `valid`.
  link::Playout::Sample sample;
  link::Playout playout;
};

}  // namespace hairnet::room
