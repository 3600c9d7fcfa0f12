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
  // The number of earlier poses of a character that are sent again: a pose gets through unless three datagrams in a row
  // are lost.
  static constexpr std::size_t kPosesMax = 2;
  // A pose is not sent again with one that is this much newer: the server has sampled past it by then.
  static constexpr std::int64_t kAgeMax_ns = 200'000'000;

  // Fills the batch's list of earlier poses, and stores the batch's own poses for the next call.
  void repeat_in(wire::PoseBatch& batch);
  void forget(std::uint32_t character) { sent_.erase(character); }
  void clear() { sent_.clear(); }

 private:
  // The last poses of each character, the oldest first.
  std::map<std::uint32_t, std::vector<wire::PoseSample>> sent_;
};

}  // namespace hairnet::link
