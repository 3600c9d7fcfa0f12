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
  Vec3 head = Vec3::Zero();  // world, m
  // It belongs to the observing session.
  bool own = false;
  // False: no pose has come yet, and `head` is undefined.
  bool has_pose = false;
};

// Chooses the members whose frames a session gets: `wanted` has one entry a head. A session always gets its own
// members. It gets others by `observe`: the ones nearest to `from`, or to any of its own heads; with neither, all
// distances are 0. Of two members at the same distance the lower number wins. Heads are in order of their
// numbers, and `observe` is valid. Pure.
void choose_members(const wire::Observe& observe, std::span<const MemberHead> heads, std::vector<bool>& wanted);

}  // namespace hairnet::server
