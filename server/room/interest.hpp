#pragma once

#include <cstdint>
#include <span>
#include <vector>

#include "core/geometry/vec.hpp"
#include "schema/wire/messages.hpp"

namespace hairnet::server {

// A member of a room, as interest is a matter of it.
struct MemberHead {
  std::uint32_t member = 0;
  Vec3 head = Vec3::Zero();  // world, m
  bool own = false;          // of the session that asks
  bool placed = false;       // it has had a pose; else `head` means nothing
};

// Which members a session wants to be sent: one entry a head. Its own always; others by `observe`: those nearest to
// `from`, or to the nearest of its own heads (a session with neither wants all). Ties go to the lower member. Pure.
void choose_members(const wire::Observe& observe, std::span<const MemberHead> heads, std::vector<bool>& wanted);

}  // namespace hairnet::server
