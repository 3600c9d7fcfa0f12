#pragma once

#include <cstdint>
#include <map>
#include <vector>

#include "schema/wire/messages.hpp"

namespace hairnet::link {

// The poses that were sent last. The next datagrams bring them again, so a lost datagram loses no pose. No I/O; one
// thread.
class SentPoses {
 public:
  // So many poses of a character are sent again; still older ones would come too late.
  static constexpr std::size_t kPosesMax = 2;
  // Poses may be this much older than the one that they are sent with.
  static constexpr std::int64_t kAgeMax_ns = 200'000'000;

  // Sets the batch's earlier poses, and stores its own.
  void repeat_in(wire::PoseBatch& batch);
  void forget(std::uint32_t character) { sent_.erase(character); }
  void clear() { sent_.clear(); }

 private:
  std::map<std::uint32_t, std::vector<wire::PoseSample>> sent_;  // oldest first
};

}  // namespace hairnet::link
