#pragma once

#include <cstdint>
#include <memory>
#include <span>
#include <string>
#include <string_view>
#include <vector>

#include "core/build/level.hpp"
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
  std::uint32_t character = 0;  // the owner's number; of others, the room's
  bool own = true;
  std::uint64_t tick = 0;
  std::uint32_t stride = 1;               // ticks to the next
  std::int64_t sample_time_local_ns = 0;  // when its pose was sampled, on our clock
  LevelIndex level = LevelIndex::rigid;
  bool discontinuous = false, asleep = false;
  std::size_t node_bytes = 0;
  const Pose* pose = nullptr;                   // until the call returns; null when not decoded
  float step_m = 0;                             // of the quantisation
  std::span<const std::int16_t> displacements;  // integers, 3 a node, in head space; empty when not decoded
};

// What a server tells a client.
class PeerEvents {
 public:
  virtual void on_welcome(const wire::Welcome& welcome, std::int64_t now_ns) = 0;
  virtual void on_groom_state(const wire::GroomHash& groom, wire::GroomState state) = 0;
  virtual void on_added(std::uint32_t character) = 0;
  // Frames of one tick come one after the other; `server_lag_ns`: from the sampling of their poses to the sending, on
  // the server's clock.
  virtual void on_frame(const FrameSeen& frame, std::int64_t server_lag_ns, std::int64_t now_ns) = 0;
  virtual void on_refusal(std::string_view reason, std::uint32_t character) = 0;
  virtual void on_goodbye(std::string_view reason) = 0;

 protected:
  ~PeerEvents() = default;
};

// The client's side of the protocol without I/O and clock: packets in, packets out. Lives as long as its connection.
class Peer {
 public:
  virtual ~Peer() = default;
  virtual void open(std::int64_t now_ns) = 0;  // the connection stands: says hello
  // False: the server broke the protocol, and the connection is to be closed.
  [[nodiscard]] virtual bool on_packet(std::span<const std::uint8_t> packet, std::int64_t now_ns,
                                       PeerEvents& events) = 0;
  virtual void offer(const EncodedGroom& groom, std::int64_t now_ns) = 0;
  virtual void add_character(std::uint32_t character, const wire::GroomHash& groom, LevelIndex level,
                             std::int64_t now_ns) = 0;
  virtual void remove_character(std::uint32_t character, std::int64_t now_ns) = 0;
  virtual void push_poses(std::vector<wire::PoseSample> poses, std::int64_t now_ns) = 0;
  virtual void say_goodbye(std::int64_t now_ns) = 0;
  // The next packet to send; empty: there is none.
  [[nodiscard]] virtual std::vector<std::uint8_t> take_packet() = 0;
};

}  // namespace hairnet::load
