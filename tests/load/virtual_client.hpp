#pragma once

#include <cstdint>
#include <functional>
#include <limits>
#include <memory>
#include <string>
#include <unordered_map>
#include <vector>

#include "tests/load/client_connection.hpp"
#include "tests/load/motion_bank.hpp"
#include "tests/load/protocol_client.hpp"
#include "tests/load/sent_props.hpp"
#include "tests/load/tally.hpp"

namespace hairnet::load {

inline constexpr std::int64_t kNever_ns = std::numeric_limits<std::int64_t>::max();

// Receives a copy of every frame, for example to check it.
class FrameWatcher {
 public:
  virtual ~FrameWatcher() = default;
  // This is called at the first welcome of a client and at each later one.
  virtual void on_welcome(std::uint32_t client) = 0;
  virtual void on_frame(std::uint32_t client, const FrameSeen& frame) = 0;
};

// The times of a client's poses, and of its hands, which are captured with them.
struct PoseClock {
  // The time at which pose 0 is captured.
  std::int64_t phase_ns = 0;
  double interval_ns = 0;

  [[nodiscard]] std::int64_t time_ns(std::int64_t pose) const;
  // Returns the number of the newest pose captured at or before `time_ns`. It is -1 before the first pose.
  [[nodiscard]] std::int64_t newest_at(std::int64_t time_ns) const;
};

// The data that all virtual clients share. It must outlive them, and so must what its pointers point to.
struct ClientContext {
  std::uint64_t seed = 1;
  double pose_hz = 72;
  // This share of the clients has hands.
  double touch_share = 0;
  // This share of the clients with hands also sets props.
  double props_share = 0;
  // The number of clients in a room; 0 means one room for all.
  std::uint32_t room_size = 0;
  const std::vector<EncodedGroom>* grooms = nullptr;
  const MotionBank* motions = nullptr;
  Connector* connector = nullptr;
  // Each client has a loopback address of its own, counted from this one. 0 means that clients have no address of
  // their own.
  std::uint32_t first_host = 0;
  // `place` is the index of the client among the clients, which decides its room.
  std::function<std::unique_ptr<ProtocolClient>(std::uint32_t client, std::uint32_t place)> make_protocol_client;
  Tally* tally = nullptr;
  // May be null.
  FrameWatcher* watcher = nullptr;
  // The clocks of the clients that have hands, by session. Clients that see the hands read them.
  std::unordered_map<std::uint64_t, PoseClock>* hand_clocks = nullptr;
  // The changes of props of all clients. Clients that see the props read them.
  SentProps* sent_props = nullptr;
  // Calls the client's act() at `at_ns`, or earlier if an earlier time was asked for before.
  std::function<void(std::uint32_t client, std::int64_t at_ns)> wake;

  // Return the room of a client, and its place among those of the room.
  [[nodiscard]] std::uint32_t room_of(std::uint32_t place) const { return room_size > 0 ? place / room_size : 0; }
  [[nodiscard]] std::uint32_t place_in_room(std::uint32_t place) const {
    return room_size > 0 ? place % room_size : place;
  }
  [[nodiscard]] std::uint32_t host_of(std::uint32_t client) const { return first_host > 0 ? first_host + client : 0; }
};

// One virtual client. It acts at the times of the plan, independently of the server.
class VirtualClient {
 public:
  virtual ~VirtualClient() = default;
  // Does the work that is due; returns the time of the next work, or kNever_ns.
  virtual std::int64_t act(std::int64_t now_ns) = 0;
  virtual void set_characters(std::uint32_t characters, const std::vector<LevelIndex>& levels, std::int64_t now_ns) = 0;
  virtual void lose_connection(std::int64_t intended_ns, std::int64_t now_ns) = 0;
  // Leaves, and counts everything that is still unanswered.
  virtual void leave(bool politely, std::int64_t now_ns) = 0;
  // Returns whether the client has left, and may be destroyed.
  [[nodiscard]] virtual bool gone() const = 0;
  // Returns the number of its characters; 0 for a client that does not count.
  [[nodiscard]] virtual std::size_t character_count() const = 0;
  // Returns whether the client is well-behaved, so that it is in the figures.
  [[nodiscard]] virtual bool counts() const = 0;
};

}  // namespace hairnet::load
