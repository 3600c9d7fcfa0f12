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
  // The number in the room; an own character gets another one from another server.
  std::uint32_t number = 0;
  // This client's own number for the character; zero means another client's character.
  std::uint32_t own = 0;
  // The owner's session. It is another one after that session has ended and the owner has begun a new one.
  std::uint64_t session = 0;
  // The owner's own number for the character. Together with `session` it is the same for all clients.
  std::uint32_t owners_character = 0;
  wire::GroomHash groom_hash{};
  // Any bytes, at most wire::kTagBytesMax; by convention the tag is a name in UTF-8.
  std::string tag;
  // The owner's choice; none: default_appearance() of the member's number.
  std::optional<wire::Appearance> appearance;
  // Who may touch the member's hair. For an own character it is the rule that this client has set last.
  TouchAudience touch = TouchAudience::oneself;
  // The sessions of TouchAudience::chosen.
  std::vector<std::uint64_t> touch_chosen = {};
  // Null while the groom has not arrived, and when `error` says why it cannot be shown.
  std::shared_ptr<const Groom> groom;
  // The bytes of the groom's file; null like `groom`.
  link::RequestedState::Bytes groom_file;
  // One line that says why the groom cannot be shown; empty without an error.
  std::string error;
  // The member's hair is pushed out of this skin (SkinPush); null until it is received.
  std::shared_ptr<const Skin> skin;
  // What to show now. An own character has the pose that was pushed last, with the newest lattice; the pose of others
  // belongs to the same time as their lattice. None: no pose is known, so the character cannot be shown.
  std::optional<Pose> pose;
  // The played-out lattice, and the level that the server steps; at rest until `sample.valid`.
  link::Playout::Sample sample;
  // The frames of the member; `sample` is what it has returned last.
  link::Playout playout;
};

}  // namespace hairnet::room
