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
  // Hands of clients with other numbers are elsewhere on their ways.
  explicit Toucher(std::uint32_t number) : phase_s_(0.7 * number) {}

  // Another member's head is there, m, world. The first that is seen is the one who is touched.
  void see(std::uint32_t member, const Vec3& head);
  // The session is new: no hold is known there.
  void begin();
  // The hands at `captured_ns`, for a client whose own head is there; sends the holds that are due.
  [[nodiscard]] std::vector<Hand> move(std::int64_t captured_ns, const Vec3& own_head, ProtocolClient& protocol);

 private:
  double phase_s_;
  bool holds_ = false;
  std::uint64_t hold_count_ = 0;
  std::optional<std::uint32_t> member_;
  Vec3 head_ = Vec3::Zero();
};

}  // namespace hairnet::load
