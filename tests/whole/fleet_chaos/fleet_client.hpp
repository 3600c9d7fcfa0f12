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
  // Leaves after some seconds and comes back, each time by another server: so a room whose owner is silent gets asked
  // for elsewhere.
  bool is_visitor = false;
  // Holds the addresses of the servers, all at the same port.
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
  // For good, against its will.
  virtual void on_ended(std::size_t client, const std::string& error, std::int64_t now_ns) = 0;
  // The process that listens there now.
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

  // The socket and what to wait for, as for poll(2); -1: none.
  [[nodiscard]] int socket() const { return socket_; }
  [[nodiscard]] short wanted() const;
  void on_ready(short happened, std::int64_t now_ns);
  // Time-outs and poses; call it every few milliseconds.
  void poll(std::int64_t now_ns);
  void leave(std::int64_t now_ns);

  [[nodiscard]] const FleetClientDef& def() const { return def_; }
  // The server that it talks to; servers.size(): none.
  [[nodiscard]] std::size_t server() const { return server_; }
  [[nodiscard]] bool is_active() const { return core_ && core_->active(); }
  // Waiting between visits.
  [[nodiscard]] bool is_away() const { return !core_; }
  [[nodiscard]] std::int64_t last_frame_ns() const { return last_frame_ns_; }
  // The longest wait for a frame that has ended, or goes on, since begin_watch(), and when the last of more than 200 ms
  // has ended; 0: none.
  void begin_watch(std::int64_t now_ns);
  [[nodiscard]] std::int64_t gap_ns_max(std::int64_t now_ns) const;
  [[nodiscard]] std::int64_t back_ns() const { return back_ns_; }
  // When the visit's first frame came; 0: not yet.
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
  // A visit begins, or ends, at `turn_at_ns_`.
  std::int64_t next_pose_ns_ = 0, turn_at_ns_ = 0;
  std::uint32_t sequence_ = 0;
  std::int64_t last_frame_ns_ = 0, first_frame_ns_ = 0, watch_ns_ = 0, gap_ns_max_ = 0, back_ns_ = 0;
  std::uint64_t reconnects_ = 0;
};

}  // namespace hairnet::whole
