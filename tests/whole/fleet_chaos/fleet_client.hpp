#pragma once

#include <netinet/in.h>

#include <cstdint>
#include <functional>
#include <memory>
#include <string>
#include <vector>

#include "client/link/link_core.hpp"
#include "core/random.hpp"
#include "schema/channel/packet_splitter.hpp"

namespace hairnet::whole {

struct FleetClientDef {
  std::size_t number = 0;
  std::string room;
  // A watcher has no character.
  bool is_watcher = false;
  // A visitor leaves after some seconds and comes back by a random server. So when the owner of a room is silent,
  // somebody asks another server for the room.
  bool is_visitor = false;
  // The addresses of the servers, all at the same port.
  std::vector<std::string> servers;
  std::uint16_t port = 0;
  std::string own_address;
  std::uint64_t seed = 0;
};

// What happened to a client, for the one who checks. Times are CLOCK_MONOTONIC.
class FleetClientEvents {
 public:
  virtual void on_frames(std::size_t client, std::size_t server_process, std::int64_t stamp_ns,
                         std::int64_t now_ns) = 0;
  virtual void on_lost(std::size_t client, std::size_t server, const std::string& error, std::int64_t now_ns) = 0;
  // The session has ended for good, and the client did not want to leave.
  virtual void on_ended(std::size_t client, const std::string& error, std::int64_t now_ns) = 0;
  // Returns the number of the process that listens at this server's address now (ChaosFleet::process_of).
  virtual std::size_t process_at(std::size_t server) = 0;

 protected:
  ~FleetClientEvents() = default;
};

// A LinkCore with a TCP socket, which knows what server each packet is from. One thread; nothing blocks.
class FleetClient {
 public:
  FleetClient(FleetClientDef def, FleetClientEvents& events);
  ~FleetClient();
  FleetClient(const FleetClient&) = delete;
  FleetClient& operator=(const FleetClient&) = delete;

  // The socket, and the events to wait for as in poll(2). The socket is -1 when there is no connection.
  [[nodiscard]] int socket() const { return socket_; }
  [[nodiscard]] short wanted() const;
  void on_ready(short happened, std::int64_t now_ns);
  // Handles time-outs and sends poses; call it every few milliseconds.
  void poll(std::int64_t now_ns);
  void leave(std::int64_t now_ns);

  [[nodiscard]] const FleetClientDef& def() const { return def_; }
  // The index of the server that it is connected to; servers.size() means none.
  [[nodiscard]] std::size_t server() const { return server_; }
  [[nodiscard]] bool is_active() const { return core_ && core_->active(); }
  // Returns whether a visitor is between two visits, or a client has left.
  [[nodiscard]] bool is_away() const { return !core_; }
  [[nodiscard]] std::int64_t last_frame_ns() const { return last_frame_ns_; }
  // begin_watch() begins to watch the gaps between frames. gap_ns_max() is the longest one since then, and counts one
  // that still lasts. back_ns() is the end of the last gap of more than 200 ms; 0 means that there was none.
  void begin_watch(std::int64_t now_ns);
  [[nodiscard]] std::int64_t gap_ns_max(std::int64_t now_ns) const;
  [[nodiscard]] std::int64_t back_ns() const { return back_ns_; }
  // The time of the visit's first frame; 0 before it.
  [[nodiscard]] std::int64_t first_frame_ns() const { return first_frame_ns_; }
  [[nodiscard]] std::uint64_t reconnect_count() const {
    return reconnects_ + (core_ ? core_->counters().reconnects : 0);
  }

 private:
  void visit(std::int64_t now_ns);
  void turn(std::int64_t now_ns);
  void connect(std::int64_t now_ns);
  void close_socket();
  void break_off(const std::string& error, std::int64_t now_ns);
  void read(std::int64_t now_ns);
  void write(std::int64_t now_ns);
  void take(std::span<const std::uint8_t> packet, std::int64_t now_ns);
  void note_frames(std::int64_t now_ns);
  void hear(std::int64_t now_ns);
  void push_pose(std::int64_t now_ns);

  FleetClientDef def_;
  FleetClientEvents* events_;
  Random random_;
  std::unique_ptr<link::LinkCore> core_;
  std::size_t first_server_ = 0;
  std::size_t server_, server_process_ = 0;
  int socket_ = -1;
  bool is_connecting_ = false, is_half_closed_ = false, is_leaving_ = false;
  channel::PacketSplitter splitter_;
  std::vector<std::uint8_t> unsent_;
  // The next pose is due at `next_pose_ns_`. A visit begins, or ends, at `turn_at_ns_`.
  std::int64_t next_pose_ns_ = 0, turn_at_ns_ = 0;
  std::uint32_t sequence_ = 0;
  std::int64_t last_frame_ns_ = 0, first_frame_ns_ = 0, watch_ns_ = 0, gap_ns_max_ = 0, back_ns_ = 0;
  std::uint64_t reconnects_ = 0;
};

}  // namespace hairnet::whole
