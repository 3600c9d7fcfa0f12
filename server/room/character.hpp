#pragma once

#include <array>
#include <cstdint>
#include <memory>
#include <optional>
#include <string>
#include <vector>

#include "core/groom/material_scale.hpp"
#include "core/touch/touch_rule.hpp"
#include "core/world/world.hpp"
#include "schema/codec/frame.hpp"
#include "schema/wire/messages.hpp"
#include "server/exchange/character_key.hpp"
#include "server/room/coefficient_track.hpp"
#include "server/room/pose_inbox.hpp"

namespace hairnet::server {

// One coding of a character's frame of this tick; several observers share it.
struct FrameVariant {
  std::uint8_t tolerance = 0;  // a rung of the ladder in publish.cpp
  codec::Detail detail;
  std::vector<std::uint8_t> content;
};

// A character on the tick thread; its lattice is in the World.
struct Character {
  CharacterKey key = 0;
  std::uint32_t room = 0;       // index
  std::uint32_t slot = 0;       // in its room; the member number minus one
  std::uint8_t generation = 0;  // the slot's, modulo 256: frames that overtake a MemberJoined say whose they are
  std::uint32_t subject = 0;    // its owner's; pays for it in the budget
  wire::GroomHash groom{};
  LevelIndex requested_level = LevelIndex::high;  // the finest level that its owner asked for
  MaterialScale material;
  std::string tag;  // this and the next: as its owner last set them
  std::optional<wire::Appearance> appearance;
  std::uint64_t appearance_told_next = 0;  // first tick at which a change may be told to others
  TouchRule touch_rule;                    // as its owner last set it
  std::uint64_t touch_rule_told_next = 0;  // first tick at which a change of it may be told
  std::optional<wire::HairState> state;    // sent by its owner; reset once the World has it
  std::uint64_t state_ticks = 0;           // ticks that it has waited for its levels
  PoseInbox inbox;
  std::vector<std::uint8_t> joined_packet;  // the encoded MemberJoined that announces it to other sessions

  bool in_world = false;                                           // in the World, from its first pose on
  LevelIndex level = LevelIndex::rigid;                            // current level in the World
  int stride = 1;                                                  // current stride in the World
  bool suspended = false;                                          // no observer sees it: the World does not step it
  Pose pose;                                                       // the last pose given to the World
  bool pose_changed = false, pose_teleport = false;                // at this tick
  float head_speed_m_per_s = 0, head_angular_speed_rad_per_s = 0;  // smoothed
  bool lod_chosen = false;                                         // a Lod was chosen at least once
  std::uint64_t lod_since = 0;             // tick at which level, stride or suspension last changed
  std::optional<std::uint64_t> held_tick;  // the last tick after which a hand held its hair
  std::uint64_t learnt_next = 0;           // first tick at which it may be on the learnt level again

  // The character in the views of its observers, at the current tick.
  float screen_height = 0;  // the largest
  bool seen = true;
  std::uint64_t unseen_ticks = 0;    // ticks without being seen
  std::uint32_t observer_count = 0;  // observers that get its frames

  // This tick's frame.
  bool changed = false;  // there is something to send
  bool asleep = false;
  bool discontinuous = false;            // a teleport or a reset
  LevelIndex shown = LevelIndex::rigid;  // level of the lattice that is sent; a change to rigid takes several ticks
  LatticeView lattice;                   // in the World, until its next step
  std::vector<FrameVariant> variants;    // only the first variant_count belong to this tick
  std::size_t variant_count = 0;
  std::int64_t encode_ns = 0;  // time to encode these, the mean of its batch
  CoefficientTrack coefficients;
  codec::EncodedFrame coded;  // the last one
};

}  // namespace hairnet::server
