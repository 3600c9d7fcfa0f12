#pragma once

#include <cstdint>
#include <functional>
#include <memory>
#include <string>
#include <variant>
#include <vector>

#include "core/groom/groom.hpp"
#include "core/result.hpp"
#include "schema/wire/messages.hpp"

namespace hairnet::link {

struct LinkOptions {
  std::string host = "127.0.0.1";
  std::uint16_t port = 7420;
  std::string client_name = "hairnet-link";
  double connect_timeout_s = 5;
  double keep_alive_s = 15;  // after so long without anything to send, an empty pose batch goes out
};

// What the server told us, in order.
struct Connected {
  wire::Welcome welcome;
};
// The last event. `reason` is the server's, or client_leaves after close(), or none when the connection broke; `detail`
// says in one line what happened.
struct Disconnected {
  wire::GoodbyeReason reason = wire::GoodbyeReason::none;
  std::string detail;
};
using Event = std::variant<Connected, Disconnected, wire::GroomStatus, wire::CharacterAdded, wire::CharacterRemoved,
                           wire::LevelRecord, wire::FrameBatch, wire::Error>;

struct LinkCounters {
  std::uint64_t bytes_sent = 0, bytes_received = 0;
  std::uint64_t frame_bytes_received = 0;  // of packets that hold frames
  std::uint64_t frames_dropped = 0;        // not polled in time
  std::uint64_t poses_dropped = 0;         // not sent in time
};

// One connection to a server. Owns its I/O thread; every call is for one thread and none blocks, but connect().
class Link {
 public:
  explicit Link(LinkOptions options);
  ~Link();  // says goodbye, waits a moment for it to leave
  // Resolve, connect, hello, welcome; within the time-out. Once only: a link that ended is not used again.
  Result<wire::Welcome> connect();
  // Offers the groom; its bytes follow as far as the server lacks them. The same groom twice is one upload.
  wire::GroomHash upload(const Groom& groom);
  void add_character(std::uint32_t character, const wire::GroomHash& groom, LevelIndex level);
  void set_level(std::uint32_t character, LevelIndex level);
  // Refused with an Error when out of range.
  void set_material(std::uint32_t character, const MaterialScale& scale);
  void set_wind(const Wind& wind);  // of the whole room; whoever set it last wins
  void remove_character(std::uint32_t character);
  // Poses captured at `capture_time_ns` of now_ns(); sent as one batch.
  void push_poses(std::vector<wire::PoseSample> poses);
  // What arrived since the last call. A caller that never polls loses the oldest frames, not memory.
  std::vector<Event> poll();
  [[nodiscard]] std::int64_t now_ns() const;  // this link's monotonic clock
  // A time on the server's clock, on now_ns(). Once connected.
  [[nodiscard]] std::int64_t to_local_ns(std::int64_t server_time_ns) const;
  [[nodiscard]] LinkCounters counters() const;
  void close();

 private:
  struct Impl;
  std::unique_ptr<Impl> impl_;
};

}  // namespace hairnet::link
