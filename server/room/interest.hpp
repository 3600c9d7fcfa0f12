#pragma once

#include <cstdint>
#include <span>
#include <vector>

#include "core/geometry/vec.hpp"
#include "schema/wire/messages.hpp"

namespace hairnet::server {

// The head of a room's member, as choose_members() needs it.
struct MemberHead {
  std::uint32_t member = 0;
  // The place of the head, in the world, in m.
  Vec3 head = Vec3::Zero();
  // The member belongs to the observing session.
  bool own = false;
  // False: no pose has come yet, and `head` is undefined.
  bool has_pose = false;
};

// Chooses the members of a room whose frames a session gets, and writes one entry for each head into `wanted`. A
// session always gets its own members. It gets other members by `observe`; for a choice by distance, the distance is
// measured from `observe.from`, or else from the nearest of its own heads, and is 0 where there is neither. Of two
// members at the same distance the one with the lower number comes first. `heads` must be in order of their numbers,
// and `observe` valid. Pure.
void choose_members(const wire::Observe& observe, std::span<const MemberHead> heads, std::vector<bool>& wanted);

}  // namespace hairnet::server
