#pragma once

#include <algorithm>
#include <cstdint>
#include <deque>
#include <functional>
#include <map>
#include <memory>
#include <optional>
#include <span>
#include <string>
#include <vector>

#include "core/random.hpp"
#include "schema/channel/packet_splitter.hpp"
#include "server/quic/connection.hpp"
#include "server/session/connection.hpp"
#include "server/transport/admission.hpp"
#include "tests/whole/packet_sender.hpp"
#include "tests/whole/timeline.hpp"

// A simulated network without sockets. Connections are byte streams with delay, jitter, limited bandwidth and breaks;
// some run over paths that lose packets, and some of these have datagrams, like WebTransport. Everything follows from a
// seed and runs in simulated time.
namespace hairnet::whole {

// The quality of one connection, in both directions.
struct NetworkQuality {
  // The delay in one direction.
  std::int64_t delay_ns = 5 * kMs;
  // The largest random delay beside `delay_ns`. Segments stay in order.
  std::int64_t jitter_ns = 0;
  double bytes_per_s = 1e7;
  // The most bytes that are on the way or not yet read.
  std::size_t window_bytes = 64u << 10;
  std::size_t segment_bytes_max = 1460;
  // The sender is not writable while this many bytes wait to be sent.
  std::size_t unsent_bytes_max = 64u << 10;
  // Reads may return any piece of the stream.
  bool in_small_pieces = false;

  // A line whose packets get lost. set_lossy() then sets `delay_ns`, `jitter_ns` and `bytes_per_s` to those of the
  // worse of the two paths.
  struct Lossy {
    PathQuality up, down;
    // True stands for WebTransport, which has datagrams; false stands for TCP.
    bool has_datagrams = false;
  };
  std::optional<Lossy> lossy;
  void set_lossy(const PathQuality& up, const PathQuality& down, bool has_datagrams);

  // Returns a rate that the line reaches at least, in bytes/s. A small window and losses make it lower than
  // `bytes_per_s`, because the sender must wait for acknowledgements.
  [[nodiscard]] double min_bytes_per_s() const;
};

// One direction: bytes written, carried in segments, read in pieces, in order; and datagrams.
class Pipe : public std::enable_shared_from_this<Pipe> {
 public:
  // `is_up` says that the pipe leads from the client to the server.
  Pipe(Timeline& timeline, const NetworkQuality& quality, bool is_up, std::uint64_t seed);

  // Call it once, before the first byte.
  void listen();
  void write(std::span<const std::uint8_t> bytes);
  void write_datagram(std::vector<std::uint8_t> bytes);
  // Ends after the bytes written so far.
  void end();
  // Nothing arrives any more.
  void kill();
  // Stops the receiver's reading, or lets it go on.
  void pause(bool paused);
  // Calls kill(), and then `then`, once so many bytes have arrived, counted from the pipe's first byte.
  void kill_after(std::uint64_t byte_count, std::function<void()> then);
  // Takes kill_after() back.
  void kill_never() { kill_at_bytes_.reset(); }

  [[nodiscard]] std::size_t unsent_bytes() const { return unsent_bytes_; }
  [[nodiscard]] const quic::DatagramQueue& datagrams() const { return datagrams_; }
  // Returns the rate that the sender's congestion window allows. It is 0 when the rate is unknown, because the window
  // has held nothing back in the last second, as in server/quic/connection.hpp.
  [[nodiscard]] double bytes_per_s() const;
  // The number of bytes that were sent over packets and not acknowledged.
  [[nodiscard]] std::size_t kept_bytes() const { return sender_ ? sender_->kept_bytes() : 0; }
  [[nodiscard]] bool is_empty() const { return dead_ || unsent_bytes_ + way_bytes_ == 0; }
  [[nodiscard]] std::uint64_t arrived_bytes() const { return arrived_bytes_; }
  // Returns when anything last arrived; 0 means never.
  [[nodiscard]] std::int64_t arrived_ns() const { return arrived_ns_; }

  std::function<void(std::span<const std::uint8_t>)> on_bytes, on_datagram;
  std::function<void()> on_end;
  // This is called when some of the waiting bytes have been sent.
  std::function<void()> on_room;

 private:
  void pump_soon();
  void pump();
  std::vector<std::uint8_t> take_segment();
  void arrive(std::vector<std::uint8_t> segment);
  void read();

  Timeline* timeline_;
  NetworkQuality quality_;
  Random random_;
  // Sends over a path that loses packets; null when nothing gets lost.
  std::shared_ptr<PacketSender> sender_;
  quic::DatagramQueue datagrams_;
  // The written packets that are not sent yet.
  std::deque<std::vector<std::uint8_t>> unsent_;
  // `first_sent_` counts the bytes of `unsent_.front()` that are sent already.
  std::size_t unsent_bytes_ = 0, first_sent_ = 0;
  // The number of bytes on the way or unread.
  std::size_t way_bytes_ = 0;
  std::deque<std::vector<std::uint8_t>> unread_;
  // The time from which the link is free for the next segment, and the arrival of the newest segment.
  std::int64_t free_ns_ = 0, last_arrival_ns_ = 0;
  // The time at which the sender's window last held something back.
  std::optional<std::int64_t> held_back_ns_;
  std::uint64_t arrived_bytes_ = 0;
  std::int64_t arrived_ns_ = 0;
  std::optional<std::uint64_t> kill_at_bytes_;
  std::function<void()> on_killed_;
  // The end goes through three states: the writer has ended, the end is under way, the end has arrived. `pumping_` says
  // that a pump() is planned.
  bool ended_ = false, end_sent_ = false, end_arrived_ = false, dead_ = false, paused_ = false, pumping_ = false;
};

// The events of a connection for its client.
class ClientEvents {
 public:
  virtual ~ClientEvents() = default;
  virtual void on_open() = 0;
  virtual void on_bytes(std::span<const std::uint8_t> bytes) = 0;
  virtual void on_datagram(std::span<const std::uint8_t>) {}
  virtual void on_download_packet(std::span<const std::uint8_t>) {}
  // This is called when more bytes can be written.
  virtual void on_room() = 0;
  // This is the last call.
  virtual void on_closed(const std::string& error) = 0;
};

class SimulatedConnection;

// Accepts connections.
class Host {
 public:
  virtual ~Host() = default;
  [[nodiscard]] virtual bool is_up() const = 0;
  virtual server::PacketSink* open(std::shared_ptr<SimulatedConnection> wire) = 0;
  // Returns the time of the host's own clock.
  [[nodiscard]] virtual std::int64_t clock_ns() const = 0;
  // Returns whether the process stands still. Callers then pass what reaches the host to wait_for_it().
  [[nodiscard]] virtual bool is_paused() const { return false; }
  virtual void wait_for_it(std::function<void()>) {}
};

// Describes the loss of a connection without a close: each end notices it after this time. An end with a negative time
// never notices.
struct ConnectionLoss {
  std::int64_t client_announced_ns = 0, server_announced_ns = 0;
};

// One connection between a client and the server.
class SimulatedConnection final : public server::Connection, public std::enable_shared_from_this<SimulatedConnection> {
 public:
  // `address`: of the client's machine; the server limits what one address may do.
  SimulatedConnection(Timeline& timeline, Host& host, ClientEvents& client, const NetworkQuality& quality,
                      std::uint64_t address, std::uint64_t seed);

  // The client's side.
  // A client's datagram is dropped while this many bytes of earlier datagrams wait.
  static constexpr std::size_t kWaitingBytesMax = 1024;
  // ClientEvents::on_open() or on_closed() follows. With `into_nothing` no answer ever comes, as from a machine that is
  // not there.
  void connect(bool into_nothing);
  void write(std::span<const std::uint8_t> bytes) { up_->write(bytes); }
  // The datagram is lost where earlier datagrams still wait: it would be outdated when it leaves.
  void write_datagram(std::vector<std::uint8_t> bytes) {
    if (up_->datagrams().bytes() < kWaitingBytesMax) up_->write_datagram(std::move(bytes));
  }
  [[nodiscard]] bool has_datagrams() const { return quality_.lossy && quality_.lossy->has_datagrams; }
  [[nodiscard]] bool takes_more() const { return open_ && !over_ && up_->unsent_bytes() < quality_.unsent_bytes_max; }
  [[nodiscard]] bool all_sent() const { return up_->unsent_bytes() == 0; }
  // Returns whether all has arrived or is lost.
  [[nodiscard]] bool all_arrived() const { return up_->is_empty(); }
  [[nodiscard]] std::int64_t heard_ns() const { return up_->arrived_ns(); }
  void half_close() { up_->end(); }
  // Ends the connection. The client is not called again, and the server sees the end after the bytes written so far.
  void drop();
  void pause_reading(bool paused);
  [[nodiscard]] bool is_open() const { return open_ && !over_; }

  // The network's side.
  void break_now(const ConnectionLoss& how);
  void break_after(std::uint64_t bytes, bool of_server, const ConnectionLoss& how);
  // Takes back a break_after() that has not happened yet.
  void break_no_more();
  void forget_client() { client_ = nullptr; }

  // The server's side.
  void mark_joined() override { splitter_.allow(wire::kPacketBytesMax); }
  void send(std::vector<std::uint8_t> packet) override;
  [[nodiscard]] std::size_t datagram_bytes_max() const override {
    return has_datagrams() ? quic::kDatagramBytesMax : 0;
  }
  void send_datagram(std::vector<std::uint8_t> packet) override;
  [[nodiscard]] bool has_download_streams() const override { return has_datagrams(); }
  std::optional<server::DownloadStream> open_download() override;
  [[nodiscard]] bool takes_more(server::DownloadStream stream) const override;
  void send_download(server::DownloadStream stream, std::vector<std::uint8_t> packet, bool is_last) override;
  void reset_download(server::DownloadStream stream) override;
  // As far as quic::Connection knows it.
  [[nodiscard]] double bytes_per_s() const override { return has_datagrams() ? down_->bytes_per_s() : 0; }
  [[nodiscard]] bool writable() const override {
    return !server_closed_ && !down_->datagrams().is_full() && down_->kept_bytes() < quic::Connection::kKeptBytesMax &&
           down_->unsent_bytes() + down_->datagrams().bytes() < quality_.unsent_bytes_max;
  }
  [[nodiscard]] bool takes_datagrams() const override {
    return has_datagrams() ? !server_closed_ && !down_->datagrams().is_full() : writable();
  }
  void close(std::string_view reason) override;
  [[nodiscard]] std::string_view peer() const override { return "simulated"; }
  [[nodiscard]] std::string_view network() const override { return network_; }
  [[nodiscard]] std::uint64_t address() const { return address_; }
  // The connection keeps the ticket until the server's end closes.
  void keep(server::Admission::Ticket ticket) { ticket_ = std::move(ticket); }
  [[nodiscard]] bool is_admitted() const { return ticket_.has_address(); }
  // The server's process is gone.
  void on_server_killed();

  // The life (ServerHost::life) of the server that answered; -1 before the answer.
  [[nodiscard]] int life() const { return life_; }
  void set_life(int life) { life_ = life; }
  // The server ended the session, with a goodbye.
  [[nodiscard]] bool was_drained() const { return was_drained_; }
  // The time at which the network broke the connection; it is negative while the connection is not broken.
  [[nodiscard]] std::int64_t broken_ns() const { return broken_ns_; }

 private:
  // Calls `action` with this connection: at once, or when the process of the server runs again.
  template <class Action>
  void at_server(Action action);
  void answer();
  void take(std::span<const std::uint8_t> bytes);
  void take_datagram(std::span<const std::uint8_t> bytes);
  void tell_client(const std::string& error);
  void tell_server(std::string_view error);
  void end_at_server();
  void kill_downloads();

  // A client lets the server open 8 one-way streams (link::QuicOptions::one_way_streams_max). One is the control stream
  // of HTTP/3, so 7 are left for downloads.
  static constexpr std::size_t kDownloadsMax = 7;
  // Packets of a download overtake those of the channel and of other downloads, because it has a path and a sender of
  // its own.
  struct Download {
    std::shared_ptr<Pipe> pipe;
    channel::PacketSplitter splitter{wire::kPacketBytesMax};
  };

  Timeline* timeline_;
  Host* host_;
  ClientEvents* client_;
  NetworkQuality quality_;
  std::uint64_t address_;
  std::string network_;
  server::Admission::Ticket ticket_;
  std::shared_ptr<Pipe> up_, down_;
  std::map<server::DownloadStream, Download> downloads_;
  server::DownloadStream last_download_ = 0;
  std::uint64_t seed_;
  channel::PacketSplitter splitter_;
  server::PacketSink* sink_ = nullptr;
  int life_ = -1;
  std::int64_t broken_ns_ = -1;
  // The state as the client sees it: on_open() was called, and no event will come any more.
  bool open_ = false, over_ = false;
  bool answered_ = false, server_closed_ = false, broken_stream_ = false, is_reading_paused_ = false;
  bool was_drained_ = false;
};

}  // namespace hairnet::whole
