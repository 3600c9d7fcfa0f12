#include "tests/whole/network.hpp"

#include <algorithm>
#include <cmath>
#include <utility>

#include "schema/wire/messages.hpp"

namespace hairnet::whole {
namespace {

// The estimate of the rate counts for so long after the congestion window last held bytes back.
constexpr std::int64_t kHeldBack_ns = 1'000'000'000;

}  // namespace

void NetworkQuality::set_lossy(const PathQuality& up, const PathQuality& down, bool has_datagrams) {
  const NetworkQuality usual;
  // Each packet carries one segment. The congestion window of PacketSender then limits what is on the way, so
  // `window_bytes` must not be smaller than usual.
  segment_bytes_max = PacketSender::kPacketBytes;
  in_small_pieces = false;
  window_bytes = std::max(window_bytes, usual.window_bytes);
  lossy = {up, down, has_datagrams};
  delay_ns = std::max(up.delay_ns, down.delay_ns);
  jitter_ns = std::max(up.jitter_ns, down.jitter_ns);
  bytes_per_s = std::min(up.bytes_per_s, down.bytes_per_s);
}

double NetworkQuality::min_bytes_per_s() const {
  const double arrival_s = 1e-9 * static_cast<double>(delay_ns + jitter_ns);
  // A window's bytes take their own time on the line and then the way; only then may the next window follow. So a small
  // window carries less than the line.
  const double most = std::min(
      bytes_per_s, static_cast<double>(window_bytes) / (arrival_s + static_cast<double>(window_bytes) / bytes_per_s));
  if (!lossy) return most;
  // The rate of TCP by Mathis et al. is 1.22 packets per round trip and root of the loss; the factor is smaller for the
  // time-outs. Overtaken packets count as lost.
  const auto losses = [](const PathQuality& path) { return path.loss + path.reorder; };
  const double loss = std::max(1e-4, std::max(losses(lossy->up), losses(lossy->down)));
  const double carried = 0.6 * PacketSender::kPacketBytes / (std::max(2 * arrival_s, 0.02) * std::sqrt(loss));
  return std::min(most, carried);
}

Pipe::Pipe(Timeline& timeline, const NetworkQuality& quality, bool is_up, std::uint64_t seed)
    : timeline_(&timeline), quality_(quality), random_(seed, 1) {
  if (!quality.lossy) return;
  const auto& [up, down, has_datagrams] = *quality.lossy;
  const Path forth(timeline, is_up ? up : down, random_.next());
  PathQuality other = is_up ? down : up;
  // Acknowledgements are small, so a slow way back does not delay them.
  other.bytes_per_s = PathQuality{}.bytes_per_s;
  const Path back(timeline, other, random_.next());
  sender_ = std::make_shared<PacketSender>(timeline, has_datagrams ? Recovery::quic() : Recovery::tcp(), forth, back);
  quality_.segment_bytes_max = std::min(quality_.segment_bytes_max, PacketSender::kPacketBytes);
}

void Pipe::listen() {
  if (!sender_) return;
  sender_->on_segment = [weak = weak_from_this()](std::vector<std::uint8_t> segment) {
    if (const auto self = weak.lock()) self->arrive(std::move(segment));
  };
  sender_->on_datagram = [weak = weak_from_this()](std::span<const std::uint8_t> datagram) {
    const auto self = weak.lock();
    if (!self || self->dead_) return;
    self->arrived_ns_ = self->timeline_->now_ns();
    if (!self->paused_ && self->on_datagram) self->on_datagram(datagram);
  };
  sender_->on_room = [weak = weak_from_this()] {
    if (const auto self = weak.lock()) self->pump_soon();
  };
}

void Pipe::write(std::span<const std::uint8_t> bytes) {
  if (dead_ || ended_ || bytes.empty()) return;
  unsent_.emplace_back(bytes.begin(), bytes.end());
  unsent_bytes_ += bytes.size();
  pump_soon();
}

void Pipe::write_datagram(std::vector<std::uint8_t> bytes) {
  if (dead_ || ended_) return;
  datagrams_.push(std::move(bytes));
  pump_soon();
}

void Pipe::end() {
  ended_ = true;
  pump_soon();
}

void Pipe::kill() {
  dead_ = true;
  unread_.clear();
}

void Pipe::pause(bool paused) {
  paused_ = paused;
  if (!paused) read();
}

void Pipe::kill_after(std::uint64_t byte_count, std::function<void()> then) {
  kill_at_bytes_ = byte_count;
  on_killed_ = std::move(then);
}

// Plans a pump() for the present time, unless one is planned already. Nothing is sent within a call of the sender, just
// as a socket does not call back from within a write.
void Pipe::pump_soon() {
  if (std::exchange(pumping_, true)) return;
  timeline_->after(0, [self = shared_from_this()] { self->pump(); });
}

// Takes the next bytes that travel together: those of one write, or, over packets, as many as fit into one.
std::vector<std::uint8_t> Pipe::take_segment() {
  std::vector<std::uint8_t> segment;
  const std::size_t most = std::min(quality_.segment_bytes_max, quality_.window_bytes - way_bytes_);
  do {
    const std::vector<std::uint8_t>& first = unsent_.front();
    std::size_t count = std::min(first.size() - first_sent_, most - segment.size());
    if (quality_.in_small_pieces) count = 1 + static_cast<std::size_t>(random_.next() % count);
    const auto begin = first.begin() + static_cast<std::ptrdiff_t>(first_sent_);
    segment.insert(segment.end(), begin, begin + static_cast<std::ptrdiff_t>(count));
    first_sent_ += count;
    unsent_bytes_ -= count;
    if (first_sent_ == first.size()) {
      unsent_.pop_front();
      first_sent_ = 0;
    }
  } while (sender_ && segment.size() < most && unsent_bytes_ > 0);
  return segment;
}

// Sends as much as the window allows. Datagrams and the stream take turns, as quic::DatagramQueue says. Without a
// sender the arrival is computed here: after the segments before it, the delay and a random jitter, and never before an
// earlier segment.
void Pipe::pump() {
  pumping_ = false;
  // Bytes that wait stay, because no peer takes them.
  if (dead_) return;
  bool moved = false;
  while (!sender_ || sender_->may_send()) {
    const bool has_bytes = unsent_bytes_ > 0 && way_bytes_ < quality_.window_bytes;
    if (datagrams_.is_next(has_bytes)) {
      sender_->send_datagram(datagrams_.pop());
      moved = true;
      continue;
    }
    if (!has_bytes) break;
    datagrams_.on_stream_sent();
    const std::vector<std::uint8_t> segment = take_segment();
    const std::size_t count = segment.size();
    way_bytes_ += count;
    moved = true;
    if (sender_) {
      sender_->send_segment(segment);
      continue;
    }
    free_ns_ = std::max(free_ns_, timeline_->now_ns()) +
               static_cast<std::int64_t>(1e9 * static_cast<double>(count) / quality_.bytes_per_s);
    const auto jitter_ns = static_cast<std::int64_t>(random_.unit() * static_cast<double>(quality_.jitter_ns));
    last_arrival_ns_ = std::max(last_arrival_ns_, free_ns_ + quality_.delay_ns + jitter_ns);
    timeline_->at(last_arrival_ns_, [self = shared_from_this(), segment] { self->arrive(segment); });
  }
  if (sender_ && !sender_->may_send() && (unsent_bytes_ > 0 || !datagrams_.empty()))
    held_back_ns_ = timeline_->now_ns();
  // Over packets the end follows only when all bytes are acknowledged, since a lost one is sent again.
  const bool is_all_sent = unsent_bytes_ == 0 && (!sender_ || way_bytes_ == 0);
  if (ended_ && !end_sent_ && is_all_sent) {
    end_sent_ = true;
    last_arrival_ns_ = std::max(last_arrival_ns_, timeline_->now_ns() + quality_.delay_ns);
    timeline_->at(last_arrival_ns_, [self = shared_from_this()] {
      self->end_arrived_ = true;
      self->read();
    });
  }
  if (moved && on_room) on_room();
}

double Pipe::bytes_per_s() const {
  return held_back_ns_ && timeline_->now_ns() - *held_back_ns_ <= kHeldBack_ns ? sender_->bytes_per_s() : 0;
}

void Pipe::arrive(std::vector<std::uint8_t> segment) {
  if (dead_) return;
  // The connection breaks within this segment, whose bytes up to the break still arrive.
  const bool killed = kill_at_bytes_ && arrived_bytes_ + segment.size() >= *kill_at_bytes_;
  if (killed) {
    const std::uint64_t left = *kill_at_bytes_ > arrived_bytes_ ? *kill_at_bytes_ - arrived_bytes_ : 0;
    segment.resize(static_cast<std::size_t>(left));
  }
  arrived_bytes_ += segment.size();
  arrived_ns_ = timeline_->now_ns();
  if (!segment.empty()) unread_.push_back(std::move(segment));
  read();
  if (!killed || dead_) return;
  kill();
  if (on_killed_) on_killed_();
}

void Pipe::read() {
  // The called function may drop the connection, and with it this pipe.
  const auto self = shared_from_this();
  while (!paused_ && !dead_ && !unread_.empty()) {
    const std::vector<std::uint8_t> segment = std::move(unread_.front());
    unread_.pop_front();
    way_bytes_ -= segment.size();
    for (std::size_t at = 0; at < segment.size() && !dead_;) {
      std::size_t count = segment.size() - at;
      if (quality_.in_small_pieces) count = 1 + static_cast<std::size_t>(random_.next() % count);
      if (on_bytes) on_bytes(std::span(segment).subspan(at, count));
      at += count;
    }
  }
  if (dead_ || paused_) return;
  if (unsent_bytes_ > 0 || (sender_ && ended_)) pump_soon();
  if (end_arrived_ && unread_.empty() && on_end) std::exchange(on_end, nullptr)();
}

SimulatedConnection::SimulatedConnection(Timeline& timeline, Host& host, ClientEvents& client,
                                         const NetworkQuality& quality, std::uint64_t address, std::uint64_t seed)
    : timeline_(&timeline),
      host_(&host),
      client_(&client),
      quality_(quality),
      address_(address),
      network_(std::to_string(address)),
      up_(std::make_shared<Pipe>(timeline, quality, true, 2 * seed)),
      down_(std::make_shared<Pipe>(timeline, quality, false, 2 * seed + 1)),
      seed_(seed),
      splitter_(server::kHelloPacketBytesMax) {}

// Pipes hold only weak pointers to the connection, which owns them. What reaches a server whose process stands still
// waits, as a copy of the bytes, until it runs again.
void SimulatedConnection::connect(bool into_nothing) {
  if (into_nothing) return;
  const std::weak_ptr<SimulatedConnection> weak = weak_from_this();
  up_->listen();
  down_->listen();
  up_->on_datagram = [weak](std::span<const std::uint8_t> bytes) {
    const auto self = weak.lock();
    if (!self) return;
    if (!self->host_->is_paused()) return self->take_datagram(bytes);
    self->at_server([copy = std::vector(bytes.begin(), bytes.end())](auto& wire) { wire.take_datagram(copy); });
  };
  down_->on_datagram = [weak](std::span<const std::uint8_t> bytes) {
    const auto self = weak.lock();
    if (self && self->client_ && !self->over_) self->client_->on_datagram(bytes);
  };
  up_->on_bytes = [weak](std::span<const std::uint8_t> bytes) {
    const auto self = weak.lock();
    if (!self) return;
    if (!self->host_->is_paused()) return self->take(bytes);
    self->at_server([copy = std::vector(bytes.begin(), bytes.end())](auto& wire) { wire.take(copy); });
  };
  up_->on_end = [weak] {
    if (const auto self = weak.lock()) self->at_server([](auto& wire) { wire.tell_server("the peer closed"); });
  };
  up_->on_room = [weak] {
    const auto self = weak.lock();
    if (self && self->client_ && !self->over_) self->client_->on_room();
  };
  down_->on_bytes = [weak](std::span<const std::uint8_t> bytes) {
    const auto self = weak.lock();
    if (self && self->client_ && !self->over_) self->client_->on_bytes(bytes);
  };
  down_->on_end = [weak] {
    if (const auto self = weak.lock()) self->tell_client("the server closed");
  };
  down_->on_room = [weak] {
    if (const auto self = weak.lock())
      self->at_server([](auto& wire) {
        if (wire.sink_) wire.sink_->on_writable(wire.host_->clock_ns());
      });
  };
  timeline_->after(quality_.delay_ns, [self = shared_from_this()] { self->answer(); });
}

// The SYN of the client has arrived at the host. A host that is down refuses, and the client hears of it one delay
// later.
void SimulatedConnection::answer() {
  const auto self = shared_from_this();
  // The client may have given up meanwhile.
  if (over_ && !answered_) return;
  if (!host_->is_up()) {
    timeline_->after(quality_.delay_ns, [self] { self->tell_client("refused"); });
    return;
  }
  answered_ = true;
  timeline_->after(quality_.delay_ns, [self] {
    if (self->over_ || !self->client_) return;
    self->open_ = true;
    self->client_->on_open();
  });
  at_server([](auto& wire) {
    // The server may have ended meanwhile.
    if (!wire.host_->is_up()) return;
    wire.sink_ = wire.host_->open(wire.shared_from_this());
    if (wire.server_closed_) wire.sink_ = nullptr;
  });
}

template <class Action>
void SimulatedConnection::at_server(Action action) {
  if (host_->is_paused())
    host_->wait_for_it([self = shared_from_this(), action = std::move(action)] { action(*self); });
  else
    action(*this);
}

void SimulatedConnection::take(std::span<const std::uint8_t> bytes) {
  if (!sink_ || broken_stream_) return;
  const std::int64_t now_ns = host_->clock_ns();
  const bool valid = splitter_.feed(bytes, [&](std::span<const std::uint8_t> packet) {
    if (sink_) sink_->on_packet(packet, now_ns);
  });
  if (valid) return;
  broken_stream_ = true;
  if (sink_) sink_->on_broken_stream(now_ns);
}

void SimulatedConnection::send(std::vector<std::uint8_t> packet) {
  if (!server_closed_) down_->write(packet);
}

void SimulatedConnection::take_datagram(std::span<const std::uint8_t> bytes) {
  if (sink_ && !broken_stream_) sink_->on_datagram(bytes, host_->clock_ns());
}

void SimulatedConnection::send_datagram(std::vector<std::uint8_t> packet) {
  if (!server_closed_) down_->write_datagram(std::move(packet));
}

std::optional<server::DownloadStream> SimulatedConnection::open_download() {
  if (server_closed_ || downloads_.size() >= kDownloadsMax) return std::nullopt;
  const server::DownloadStream number = ++last_download_;
  // Each download has a random sequence of its own; 2 * seed_ + 1 is that of the way down.
  const std::uint64_t seed = (2 * seed_ + 1) ^ (static_cast<std::uint64_t>(number) << 32);
  const auto pipe = downloads_[number].pipe = std::make_shared<Pipe>(*timeline_, quality_, false, seed);
  pipe->listen();
  pipe->pause(is_reading_paused_);
  const std::weak_ptr<SimulatedConnection> weak = weak_from_this();
  pipe->on_bytes = [weak, number](std::span<const std::uint8_t> bytes) {
    const auto self = weak.lock();
    if (!self || !self->downloads_.contains(number)) return;
    self->downloads_.at(number).splitter.feed(bytes, [&](std::span<const std::uint8_t> packet) {
      if (self->client_ && !self->over_) self->client_->on_download_packet(packet);
    });
  };
  const auto tell_room = [weak] {
    if (const auto self = weak.lock())
      self->at_server([](auto& wire) {
        if (wire.sink_) wire.sink_->on_streams_writable(wire.host_->clock_ns());
      });
  };
  pipe->on_room = tell_room;
  pipe->on_end = [weak, number, tell_room] {
    if (const auto self = weak.lock()) self->downloads_.erase(number);
    tell_room();
  };
  return number;
}

bool SimulatedConnection::takes_more(server::DownloadStream stream) const {
  const auto found = downloads_.find(stream);
  return !server_closed_ && found != downloads_.end() &&
         found->second.pipe->unsent_bytes() < quic::Connection::kDownloadUnsentBytesMax;
}

void SimulatedConnection::send_download(server::DownloadStream stream, std::vector<std::uint8_t> packet, bool is_last) {
  if (server_closed_) return;
  const std::shared_ptr<Pipe> pipe = downloads_.at(stream).pipe;
  pipe->write(packet);
  if (is_last) pipe->end();
}

void SimulatedConnection::reset_download(server::DownloadStream stream) {
  const auto found = downloads_.find(stream);
  if (found == downloads_.end()) return;
  found->second.pipe->kill();
  downloads_.erase(found);
}

void SimulatedConnection::kill_downloads() {
  for (const auto& [number, download] : downloads_) download.pipe->kill();
}

void SimulatedConnection::pause_reading(bool paused) {
  // The bytes that are read may end the connection and some of its downloads.
  const auto self = shared_from_this();
  is_reading_paused_ = paused;
  down_->pause(paused);
  std::vector<std::shared_ptr<Pipe>> pipes;
  for (const auto& [number, download] : downloads_) pipes.push_back(download.pipe);
  for (const auto& pipe : pipes) pipe->pause(paused);
}

// The server ends the connection. What it has written before still arrives at the client, and then the end.
void SimulatedConnection::close(std::string_view reason) {
  if (server_closed_) return;
  // A session closes with "drained" once its goodbye has gone, or with "drain time-out" when that takes too long.
  was_drained_ = reason.starts_with("drain");
  kill_downloads();
  end_at_server();
  down_->end();
}

// The client has gone, and its end follows the bytes that it has written. The bytes from the server are read and thrown
// away.
void SimulatedConnection::drop() {
  over_ = true;
  client_ = nullptr;
  up_->end();
  down_->pause(false);
}

void SimulatedConnection::break_now(const ConnectionLoss& how) {
  if (broken_ns_ < 0) broken_ns_ = timeline_->now_ns();
  up_->kill();
  down_->kill();
  kill_downloads();
  const auto self = shared_from_this();
  if (how.client_announced_ns >= 0) timeline_->after(how.client_announced_ns, [self] { self->tell_client("reset"); });
  if (how.server_announced_ns >= 0)
    timeline_->after(how.server_announced_ns,
                     [self] { self->at_server([](auto& wire) { wire.tell_server("reset"); }); });
}

void SimulatedConnection::break_after(std::uint64_t bytes, bool of_server, const ConnectionLoss& how) {
  Pipe& pipe = of_server ? *down_ : *up_;
  pipe.kill_after(pipe.arrived_bytes() + bytes, [weak = weak_from_this(), how] {
    if (const auto self = weak.lock()) self->break_now(how);
  });
}

void SimulatedConnection::break_no_more() {
  up_->kill_never();
  down_->kill_never();
}

void SimulatedConnection::on_server_killed() {
  end_at_server();
  up_->kill();
  down_->kill();
  kill_downloads();
}

void SimulatedConnection::tell_client(const std::string& error) {
  if (std::exchange(over_, true)) return;
  if (ClientEvents* client = std::exchange(client_, nullptr)) client->on_closed(error);
}

void SimulatedConnection::tell_server(std::string_view error) {
  if (server_closed_) return;
  server::PacketSink* const sink = sink_;
  end_at_server();
  if (sink) sink->on_closed(error, host_->clock_ns());
}

void SimulatedConnection::end_at_server() {
  server_closed_ = true;
  sink_ = nullptr;
  ticket_ = {};
}

}  // namespace hairnet::whole
