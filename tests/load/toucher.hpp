#pragma once

#include <cstdint>
#include <optional>
#include <vector>

#include "core/pose/pose.hpp"
#include "tests/load/protocol_client.hpp"

namespace hairnet::load {

// What the hands of one client do: the right one strokes round the head of another member, takes hold of the hair there
// and pulls it away, then lets go or pins it; the left one moves round the own head. Deterministic in the times.
class Toucher {
 public:
  // `number` shifts the motion in time, so that the hands of two clients are at different places of it.
  explicit Toucher(std::uint32_t number) : phase_s_(0.7 * number) {}

  // Reports the head of another member, m, world. The first member that is reported is the one that is touched.
  void see(std::uint32_t member, const Vec3& head);
  // Returns the last place of the touched head; nothing when no member has been reported in this session.
  [[nodiscard]] std::optional<Vec3> touched_head() const { return member_ ? std::optional(head_) : std::nullopt; }
  // Call it when a new session begins, which has no holds.
  void begin();
  // Returns the hands at `captured_ns`, and sends the holds and releases that are due to `protocol`. `own_head` is the
  // place of the client's own head.
  [[nodiscard]] std::vector<Hand> move(std::int64_t captured_ns, const Vec3& own_head, ProtocolClient& protocol);

 private:
  double phase_s_;
  // It is true while the right hand has a hold.
  bool holds_ = false;
  std::uint64_t hold_count_ = 0;
  // The member that is touched, and the last place of its head.
  std::optional<std::uint32_t> member_;
  Vec3 head_ = Vec3::Zero();
};

}  // namespace hairnet::load
