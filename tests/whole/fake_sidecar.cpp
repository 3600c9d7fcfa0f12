#include "tests/whole/fake_sidecar.hpp"

#include <netinet/in.h>
#include <poll.h>
#include <sys/socket.h>
#include <unistd.h>

#include <algorithm>

namespace hairnet::whole {
namespace {

// The bytes of a request's body, as its header says.
std::size_t body_bytes(const std::string& header) {
  constexpr std::string_view kField = "Content-Length: ";
  const std::size_t at = header.find(kField);
  return at == std::string::npos ? 0 : std::stoul(header.substr(at + kField.size()));
}

}  // namespace

FakeSidecar::FakeSidecar() {
  listener_ = ::socket(AF_INET, SOCK_STREAM, 0);
  sockaddr_in address{};
  address.sin_family = AF_INET;
  address.sin_addr.s_addr = htonl(INADDR_LOOPBACK);
  ::bind(listener_, reinterpret_cast<const sockaddr*>(&address), sizeof(address));
  ::listen(listener_, 16);
  socklen_t length = sizeof(address);
  ::getsockname(listener_, reinterpret_cast<sockaddr*>(&address), &length);
  port_ = ntohs(address.sin_port);
  set_address("");
  thread_ = std::thread([this] { serve(); });
}

FakeSidecar::~FakeSidecar() {
  ends_ = true;
  thread_.join();
  ::close(listener_);
}

void FakeSidecar::set_address(const std::string& host, std::uint16_t port) {
  const std::lock_guard lock(mutex_);
  const std::string number = std::to_string(port);
  game_server_ = R"({"object_meta":{"name":"hairnet-1"},"status":{"state":"Scheduled","address":")" + host +
                 R"(","ports":[{"name":"hairnet-tcp","port":)" + number + R"(},{"name":"hairnet-udp","port":)" +
                 number + "}]}}";
}

std::vector<std::string> FakeSidecar::states() const {
  const std::lock_guard lock(mutex_);
  std::vector<std::string> all;
  for (const std::string& request : requests_)
    for (const char* state : {"ready", "allocate", "shutdown"})
      if (request.starts_with("POST /" + std::string(state) + " ")) all.emplace_back(state);
  return all;
}

std::size_t FakeSidecar::count(std::string_view text) const {
  const std::lock_guard lock(mutex_);
  return static_cast<std::size_t>(
      std::ranges::count_if(requests_, [text](const std::string& one) { return one.find(text) != std::string::npos; }));
}

// Answers one connection at a time. While `is_away` is true it closes connections without an answer, as a sidecar that
// has just started.
void FakeSidecar::serve() {
  while (!ends_) {
    pollfd waits{.fd = listener_, .events = POLLIN, .revents = 0};
    if (::poll(&waits, 1, 50) <= 0) continue;
    const int peer = ::accept(listener_, nullptr, nullptr);
    if (peer < 0) continue;
    if (!is_away) answer(peer);
    ::close(peer);
  }
}

void FakeSidecar::answer(int peer) {
  // A client that sends only part of a request holds the thread for a second at most.
  const timeval second{.tv_sec = 1, .tv_usec = 0};
  ::setsockopt(peer, SOL_SOCKET, SO_RCVTIMEO, &second, sizeof(second));
  std::string request;
  std::size_t header = std::string::npos;
  while (header == std::string::npos || request.size() < header + 4 + body_bytes(request)) {
    char piece[1024];
    const ssize_t count = ::recv(peer, piece, sizeof(piece), 0);
    if (count <= 0) return;
    request.append(piece, static_cast<std::size_t>(count));
    header = request.find("\r\n\r\n");
  }
  const std::lock_guard lock(mutex_);
  const std::string body = request.starts_with("GET /gameserver ") ? game_server_ : "{}";
  requests_.push_back(std::move(request));
  const std::string text =
      "HTTP/1.1 200 OK\r\nContent-Type: application/json\r\nContent-Length: " + std::to_string(body.size()) +
      "\r\n\r\n" + body;
  ::send(peer, text.data(), text.size(), MSG_NOSIGNAL);
}

}  // namespace hairnet::whole
