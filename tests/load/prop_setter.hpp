#pragma once

#include <cstdint>
#include <optional>

#include "core/geometry/rigid_transform.hpp"
#include "schema/wire/messages.hpp"

namespace hairnet::load {

// What one client does with its prop, a ball: sets it near a head, moves it into the hair, lets it lie there, and
// removes it again. Deterministic in the times.
class PropSetter {
 public:
  // `client` shifts the motion in time and the side of the head, so that the props of two clients are at different
  // places. `prop` is the prop's number in the room.
  PropSetter(std::uint32_t client, std::uint8_t prop);

  // Call it when a new session begins. Its room may be without the prop.
  void begin() { is_there_ = false; }
  // Returns the change that is due at `captured_ns`, if any. `head` is the place of the head whose hair the prop is to
  // touch, m, world.
  [[nodiscard]] std::optional<wire::SetProps> move(std::int64_t captured_ns, const Vec3& head);

 private:
  double phase_s_, turn_;
  std::uint8_t prop_;
  // It is true while the room has the prop, as far as this session has set and removed it.
  bool is_there_ = false;
};

}  // namespace hairnet::load
