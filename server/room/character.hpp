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

// One coding of a character's frame of this tick. Observers that want the same error share it, so a frame is not coded
// once for each observer.
struct FrameVariant {
  // The step on the ladder of errors (publish.cpp): the RMS error over the hair is at most 0.25 mm times 2^(tolerance /
  // 2). 24 (kPoseOnly) means a frame without hair.
  std::uint8_t tolerance = 0;
  // How many coefficients the frame has, and the step to which they are rounded; then the bytes of the coded frame.
  codec::Detail detail;
  std::vector<std::uint8_t> content;
};

// A character on the tick thread; its lattice is in the World. Rooms owns it, and its address stays until it is
// removed. Workers may change the characters of their own share of a loop, and no others.
struct Character {
  CharacterKey key = 0;
  // The index of its room.
  std::uint32_t room = 0;
  // Its slot in the room; the member number that clients see is one more.
  std::uint32_t slot = 0;
  // The slot's generation, modulo 256. A frame in a datagram may overtake the MemberJoined of a new character in an old
  // slot; the generation says whose it is.
  std::uint8_t generation = 0;
  // The number of its owner's subject (a user or an address), whose part of the budget pays for the character.
  std::uint32_t subject = 0;
  wire::GroomHash groom{};
  // The finest level that its owner asked for.
  LevelIndex requested_level = LevelIndex::high;
  MaterialScale material;
  // Tag and appearance as its owner last set them.
  std::string tag;
  std::optional<wire::Appearance> appearance;
  // The first tick at which others may be told of a change: an owner who changes it all the time would flood the room.
  std::uint64_t appearance_announced_next = 0;
  // The owner's rule, which says who may touch the hair.
  TouchRule touch_rule;
  // The first tick at which others may be told of a change of the rule; 0 while none has been told.
  std::uint64_t touch_rule_announced_next = 0;
  // The hair's motion that its owner sent along, for example after a move to this server; reset once the World has it.
  std::optional<wire::HairState> state;
  // The ticks that the state has waited for the levels, kStateWait_s (scheduler.cpp) at most.
  std::uint64_t state_ticks = 0;
  PoseInbox inbox;
  // The encoded MemberJoined that announces it to other sessions.
  std::vector<std::uint8_t> joined_packet;

  // It is in the World from its first pose on: without a pose there is no head space to place its lattice in.
  bool in_world = false;
  // Its level and stride in the World now.
  LevelIndex level = LevelIndex::rigid;
  int stride = 1;
  // No observer sees it, and the World does not step it.
  bool suspended = false;
  // The last pose that the World was given.
  Pose pose;
  // The pose has changed at this tick; it has a teleport.
  bool pose_changed = false, pose_teleport = false;
  // Smoothed speeds of the head.
  float head_speed_m_per_s = 0, head_angular_speed_rad_per_s = 0;
  // A Lod was chosen at least once.
  bool lod_chosen = false;
  // The tick at which level, stride or suspension last changed.
  std::uint64_t lod_since = 0;
  // The last tick after which a hand held its hair: the level stays then, because another one would end the hold.
  std::optional<std::uint64_t> held_tick;
  // The first tick at which it may be on the learnt level again, after its motion was outside of what the network has
  // learnt.
  std::uint64_t learnt_next = 0;

  // The next four are about the views of its observers, at the current tick. The height of the head over the height of
  // the screen, the largest over its observers.
  float screen_height = 0;
  // At least one observer has it in view.
  bool seen = true;
  // The ticks since an observer had it in view.
  std::uint64_t unseen_ticks = 0;
  // The number of observers that want its frames and have it in view.
  std::uint32_t observer_count = 0;

  // All that follows is about this tick's frame. The lattice was stepped, or a mark must be sent, so there is a frame
  // to send.
  bool changed = false;
  // The hair is at rest. Observers get one last frame with this mark.
  bool asleep = false;
  // A teleport or a reset lies before this frame.
  bool discontinuous = false;
  // The level of the lattice that is sent. A change to rigid takes several ticks.
  LevelIndex shown = LevelIndex::rigid;
  // Points into the World: valid until its next step.
  LatticeView lattice;
  // The codings of this tick's frame. Only the first variant_count belong to this tick; the others keep their memory
  // for later ticks.
  std::vector<FrameVariant> variants;
  std::size_t variant_count = 0;
  // The time to encode these variants: the mean over the batch that was encoded together (Publisher).
  std::int64_t encode_ns = 0;
  CoefficientTrack coefficients;
  // The frame as it was coded last: a buffer of Publisher::encode().
  codec::EncodedFrame coded;
};

}  // namespace hairnet::server
