#include "tests/whole/fleet_chaos/fleet_client.hpp"

#include <arpa/inet.h>
#include <netinet/tcp.h>
#include <poll.h>
#include <sys/socket.h>
#include <unistd.h>

#include <algorithm>
#include <array>
#include <cerrno>
#include <cmath>
#include <cstring>
#include <utility>

#include "schema/wire/messages.hpp"
#include "tests/whole/assets.hpp"

namespace hairnet::whole {
namespace {

// A watch counts a gap that lasts when it begins, but not more than kWatchBack_ns of it.
constexpr std::int64_t kPoseInterval_ns = 33'333'333, kWatchBack_ns = 1'000'000'000;
// A shorter wait for frames does not count as a gap.
constexpr std::int64_t kGapLeast_ns = 200'000'000;
constexpr std::uint32_t kCharacter = 1;
// A connection breaks when its bytes are not acknowledged for so long.
constexpr unsigned kUnacknowledgedMax_ms = 15'000;  // as link's sockets

sockaddr_in address_of(const std::string& host, std::uint16_t port) {
  sockaddr_in address{};
  address.sin_family = AF_INET;
  ::inet_pton(AF_INET, host.c_str(), &address.sin_addr);
  address.sin_port = htons(port);
  return address;
}

}  // namespace

FleetClient::FleetClient(FleetClientDef def, FleetClientEvents& events)
    : def_(std::move(def)),
      events_(&events),
      random_(def_.seed, 300 + def_.number),
      server_(def_.servers.size()),
      splitter_(wire::kPacketBytesMax) {}

FleetClient::~FleetClient() {
  close_socket();
}

void FleetClient::visit(std::int64_t now_ns) {
  link::LinkCoreOptions options;
  options.client_name = "chaos-" + std::to_string(def_.number);
  options.room = def_.room;
  options.role = def_.is_watcher ? wire::Role::observer : wire::Role::participant;
  options.trace = random_.next();
  core_ = std::make_unique<link::LinkCore>(options);
  first_server_ = static_cast<std::size_t>(random_.next() % def_.servers.size());
  is_leaving_ = false;
  first_frame_ns_ = 0;
  // A visitor stays 4 to 8 s, so rooms also become empty and are given up.
  turn_at_ns_ = now_ns + static_cast<std::int64_t>(random_.between(4, 8) * 1e9);
  core_->start();
  if (def_.is_watcher) return;
  const Assets::GroomFile& groom = assets().grooms[def_.number % 2];
  core_->offer_groom(groom.hash, groom.bytes);
  core_->send(wire::AddCharacter{kCharacter, groom.hash, LevelIndex::low, {}, options.client_name, {}});
}

void FleetClient::poll(std::int64_t now_ns) {
  if (!core_) {
    if (now_ns < turn_at_ns_) return;
    visit(now_ns);
  }
  if (def_.is_visitor && core_->active() && now_ns >= turn_at_ns_ && !is_leaving_) leave(now_ns);
  if (now_ns >= next_pose_ns_) push_pose(now_ns);
  turn(now_ns);
}

void FleetClient::leave(std::int64_t now_ns) {
  if (!core_) return;
  is_leaving_ = true;
  core_->leave(now_ns);
  turn(now_ns);
}

void FleetClient::push_pose(std::int64_t now_ns) {
  next_pose_ns_ = std::max(next_pose_ns_ + kPoseInterval_ns, now_ns);
  if (def_.is_watcher || !core_->active()) return;
  const double t = 1e-9 * static_cast<double>(now_ns), number = static_cast<double>(def_.number);
  const Quat turn(Eigen::AngleAxisd(0.4 * std::sin(4 * t + number), Vec3::UnitY()));
  core_->push_poses(
      {{kCharacter, ++sequence_, now_ns, false, rigid_pose({turn, {0.6 * number, 1.6, 0.1 * std::sin(3 * t)}})}});
}

void FleetClient::turn(std::int64_t now_ns) {
  core_->poll(now_ns);
  hear(now_ns);
  if (core_->wants_close()) {
    close_socket();
    core_->on_closed("", now_ns);
  }
  if (core_->wants_connection()) connect(now_ns);
  write(now_ns);
  hear(now_ns);
  if (!core_->ended()) return;
  close_socket();
  reconnects_ += core_->counters().reconnects;
  core_.reset();
  // After a first attempt that failed a person tries again; a visitor comes back later.
  turn_at_ns_ =
      now_ns + static_cast<std::int64_t>(is_leaving_ ? random_.between(0.5, 3) * 1e9 : random_.between(1e8, 4e8));
}

void FleetClient::hear(std::int64_t now_ns) {
  for (const link::Event& event : core_->take_events()) {
    if (const auto* lost = std::get_if<link::Reconnecting>(&event)) {
      events_->on_lost(def_.number, server_, lost->detail, now_ns);
    } else if (const auto* ended = std::get_if<link::Disconnected>(&event); ended && !is_leaving_ && core_->welcome()) {
      events_->on_ended(def_.number, ended->detail, now_ns);
    }
  }
}

void FleetClient::connect(std::int64_t now_ns) {
  core_->on_opening(now_ns);
  const std::string host = core_->redirected_to() ? core_->redirected_to()->host : def_.servers[first_server_];
  const auto found = std::find(def_.servers.begin(), def_.servers.end(), host);
  server_ = static_cast<std::size_t>(found - def_.servers.begin());
  splitter_ = channel::PacketSplitter(wire::kPacketBytesMax);
  is_half_closed_ = false;
  socket_ = ::socket(AF_INET, SOCK_STREAM | SOCK_NONBLOCK | SOCK_CLOEXEC, 0);
  const int on = 1;
  ::setsockopt(socket_, IPPROTO_IP, IP_BIND_ADDRESS_NO_PORT, &on, sizeof(on));
  ::setsockopt(socket_, IPPROTO_TCP, TCP_NODELAY, &on, sizeof(on));
  ::setsockopt(socket_, IPPROTO_TCP, TCP_USER_TIMEOUT, &kUnacknowledgedMax_ms, sizeof(kUnacknowledgedMax_ms));
  const sockaddr_in own = address_of(def_.own_address, 0), to = address_of(host, def_.port);
  ::bind(socket_, reinterpret_cast<const sockaddr*>(&own), sizeof(own));
  is_connecting_ = true;
  if (::connect(socket_, reinterpret_cast<const sockaddr*>(&to), sizeof(to)) != 0 && errno != EINPROGRESS)
    break_off(std::strerror(errno), now_ns);
}

void FleetClient::close_socket() {
  if (socket_ >= 0) ::close(std::exchange(socket_, -1));
  unsent_.clear();
  server_ = def_.servers.size();
}

void FleetClient::break_off(const std::string& error, std::int64_t now_ns) {
  const std::size_t server = server_;
  close_socket();
  // hear() reports the loss under this server's index.
  server_ = server;
  core_->on_closed(error, now_ns);
  hear(now_ns);
  if (socket_ < 0) server_ = def_.servers.size();
}

short FleetClient::wanted() const {
  return static_cast<short>(is_connecting_ || !unsent_.empty() ? POLLIN | POLLOUT : POLLIN);
}

void FleetClient::on_ready(short happened, std::int64_t now_ns) {
  if (is_connecting_) {
    int fault = 0;
    socklen_t length = sizeof(fault);
    ::getsockopt(socket_, SOL_SOCKET, SO_ERROR, &fault, &length);
    is_connecting_ = false;
    if (fault != 0) {
      break_off(std::strerror(fault), now_ns);
      return turn(now_ns);
    }
    server_process_ = server_ < def_.servers.size() ? events_->process_at(server_) : 0;
    core_->on_open(now_ns);
  }
  if ((happened & (POLLIN | POLLHUP | POLLERR)) != 0) read(now_ns);
  turn(now_ns);
}

void FleetClient::read(std::int64_t now_ns) {
  std::array<std::uint8_t, 1 << 16> bytes;
  while (socket_ >= 0) {
    const ssize_t count = ::recv(socket_, bytes.data(), bytes.size(), 0);
    if (count < 0 && (errno == EAGAIN || errno == EINTR)) return;
    if (count <= 0)
      return break_off(count == 0 ? "the server closed the connection without a goodbye" : std::strerror(errno),
                       now_ns);
    const bool is_valid = splitter_.feed({bytes.data(), static_cast<std::size_t>(count)},
                                         [&](std::span<const std::uint8_t> packet) { take(packet, now_ns); });
    if (!is_valid) return break_off("a packet of impossible size", now_ns);
    if (core_->wants_close()) return;
  }
}

void FleetClient::take(std::span<const std::uint8_t> packet, std::int64_t now_ns) {
  const wire::DecodedPacket decoded = wire::decode_packet(packet);
  const bool has_frames = core_->active() && std::holds_alternative<wire::FrameBatch>(decoded.envelope.message);
  if (has_frames) events_->on_frames(def_.number, server_process_, decoded.envelope.clock_ns, now_ns);
  if (has_frames) note_frames(now_ns);
  core_->on_packet(packet, now_ns);
}

// The wait for these frames counts from the last ones, or from the begin of the watch.
void FleetClient::note_frames(std::int64_t now_ns) {
  const std::int64_t since_ns = std::max(last_frame_ns_, watch_ns_);
  gap_ns_max_ = std::max(gap_ns_max_, now_ns - since_ns);
  if (now_ns - since_ns > kGapLeast_ns) back_ns_ = now_ns;
  last_frame_ns_ = now_ns;
  if (first_frame_ns_ == 0) first_frame_ns_ = now_ns;
}

void FleetClient::begin_watch(std::int64_t now_ns) {
  watch_ns_ = std::max(last_frame_ns_, now_ns - kWatchBack_ns);
  gap_ns_max_ = back_ns_ = 0;
}

std::int64_t FleetClient::gap_ns_max(std::int64_t now_ns) const {
  return std::max(gap_ns_max_, now_ns - std::max(last_frame_ns_, watch_ns_));
}

void FleetClient::write(std::int64_t now_ns) {
  if (socket_ < 0 || is_connecting_) return;
  for (std::vector<std::uint8_t> packet;
       unsent_.size() < (64u << 10) && !(packet = core_->take_packet(now_ns)).empty();)
    unsent_.insert(unsent_.end(), packet.begin(), packet.end());
  while (!unsent_.empty()) {
    const ssize_t count = ::send(socket_, unsent_.data(), unsent_.size(), MSG_NOSIGNAL);
    // The reader learns why the socket takes no more.
    if (count <= 0) break;
    unsent_.erase(unsent_.begin(), unsent_.begin() + count);
  }
  if (unsent_.empty() && core_->wants_half_close() && !std::exchange(is_half_closed_, true))
    ::shutdown(socket_, SHUT_WR);
}

}  // namespace hairnet::whole
