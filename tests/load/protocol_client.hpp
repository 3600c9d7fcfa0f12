#pragma once

#include <cstdint>
#include <memory>
#include <span>
#include <string>
#include <string_view>
#include <vector>

#include "core/levels/level.hpp"
#include "schema/wire/messages.hpp"

namespace hairnet::load {

// A groom as it is uploaded, shared by all clients.
struct EncodedGroom {
  std::string spec;
  wire::GroomHash hash{};
  std::shared_ptr<const std::vector<std::uint8_t>> bytes;
};

// One frame of one character, as a client got it.
struct FrameSeen {
  std::uint32_t member = 0;
  // The number that this client has given its character; 0 for a character of another client.
  std::uint32_t character = 0;
  std::uint64_t tick = 0;
  // The number of ticks to the character's next step.
  std::uint32_t stride = 1;
  // The time on this client's clock at which the server sampled the pose.
  std::int64_t sample_time_local_ns = 0;
  LevelIndex level = LevelIndex::rigid;
  bool discontinuous = false, asleep = false, undecodable = false;
  // The coded size of the pose and the coefficients.
  std::size_t content_bytes = 0;
  // These two are valid until the call returns. The pose is null when the frame was not decoded. The coefficients, in
  // metres, are empty then, and when the hair is at rest.
  const Pose* pose = nullptr;
  std::span<const float> coefficients;
};

// The hands of one other person, as a client got them.
struct HandsSeen {
  std::uint64_t session = 0;
  std::int64_t sample_time_local_ns = 0;  // as in FrameSeen
};

// The events of one client's protocol.
class ProtocolEvents {
 public:
  virtual void on_welcome(const wire::Welcome& welcome, std::int64_t now_ns) = 0;
  // The connection is lost and will be made again. `reason`: from the Goodbye; empty when there was none.
  virtual void on_lost(std::string_view reason, std::int64_t now_ns) = 0;
  // This is the last call: the session has ended and will not be resumed.
  virtual void on_end(std::string_view reason, std::int64_t now_ns) = 0;
  virtual void on_groom_state(const wire::GroomHash& groom, wire::GroomState state) = 0;
  virtual void on_refusal(std::string_view reason, std::int64_t now_ns) = 0;
  virtual void on_frame(const FrameSeen& frame, std::int64_t now_ns) = 0;
  virtual void on_hands(const HandsSeen& hands, std::int64_t now_ns) = 0;
  // Props of the room have changed, or the client has come into a room with props.
  virtual void on_props(const wire::RoomProps& props, std::int64_t now_ns) = 0;
  // Answers take_hold(): `points` points of hair are held. With 0 points nothing was there to hold, or a hold has ended
  // that the client had not let go of.
  virtual void on_held(std::uint32_t points, std::int64_t now_ns) = 0;

 protected:
  ~ProtocolEvents() = default;
};

// The client's side of the protocol without I/O and clock: packets in, packets out, over any number of connections.
// Events come during on_packet (frames) and tell (all others); handlers must not call back.
class ProtocolClient {
 public:
  virtual ~ProtocolClient() = default;
  // Requests may be made at any time and are sent once there is a session. Poses without a session are dropped.
  virtual void offer(const EncodedGroom& groom) = 0;
  virtual void add_character(std::uint32_t character, const wire::GroomHash& groom, LevelIndex level) = 0;
  virtual void remove_character(std::uint32_t character) = 0;
  virtual void push_poses(std::vector<wire::PoseSample> poses) = 0;
  virtual void push_hands(std::vector<Hand> hands, std::int64_t captured_ns) = 0;
  // Lets everyone touch the character's hair.
  virtual void allow_touch(std::uint32_t character) = 0;
  virtual void take_hold(const wire::TakeHold& hold) = 0;
  virtual void let_go(const wire::LetGo& hold) = 0;
  virtual void set_props(wire::SetProps change) = 0;
  virtual void leave(std::int64_t now_ns) = 0;

  // Handles time-outs. Call it again at next_deadline_ns().
  virtual void poll(std::int64_t now_ns) = 0;
  [[nodiscard]] virtual std::int64_t next_deadline_ns() const = 0;
  // Calls the handlers of all events that have come since the last call, except frames.
  virtual void tell(ProtocolEvents& events, std::int64_t now_ns) = 0;

  // The connection's side.
  [[nodiscard]] virtual bool wants_connection() const = 0;
  [[nodiscard]] virtual bool wants_half_close() const = 0;
  [[nodiscard]] virtual bool wants_close() const = 0;
  virtual void on_opening(std::int64_t now_ns) = 0;
  virtual void on_open(std::int64_t now_ns, bool has_datagrams) = 0;
  virtual void on_packet(std::span<const std::uint8_t> packet, std::int64_t now_ns, ProtocolEvents& events) = 0;
  virtual void on_closed(std::int64_t now_ns) = 0;
  // The next packet to send; empty: there is none.
  [[nodiscard]] virtual std::vector<std::uint8_t> take_packet(std::int64_t now_ns) = 0;
  // Returns whether the packet that was taken last may be sent as a datagram, which can get lost.
  [[nodiscard]] virtual bool taken_may_be_lost() const { return false; }
};

}  // namespace hairnet::load
