#pragma once

#include <gtest/gtest.h>

#include <limits>
#include <optional>
#include <utility>
#include <vector>

#include "client/link/link_core.hpp"

namespace hairnet::link {

inline constexpr std::int64_t kMs = 1'000'000;
// The server's clock is ahead of the client's by 7000 s, so that a test finds times of the wrong clock.
inline constexpr std::int64_t kServerClock_ns = 7'000'000'000'000;

inline wire::GroomHash hash_of(std::uint8_t first) {
  wire::GroomHash hash{};
  hash[0] = first;
  return hash;
}

// Drives a LinkCore in a test: owns its clock and plays the server's end of its connection.
class LinkCoreDriver {
 public:
  explicit LinkCoreDriver(LinkCoreOptions options = {}) : core(std::move(options)) {}

  // Opens a connection when the core wants one, after the core's waiting time.
  void open() {
    // A wait ends after one or two deadlines; ten are enough for any.
    for (int i = 0; i < 10 && !core.wants_connection(); ++i) pass_to_deadline();
    ASSERT_TRUE(core.wants_connection());
    core.on_opening(now_ns);
    core.on_open(now_ns);
  }
  void connect(wire::Welcome welcome = {}) {
    core.start();
    open();
    expect<wire::Hello>();
    send(std::move(welcome));
  }
  // Closes the connection if the core wants it closed, as the thread of a Link does.
  void close_as_wanted() {
    if (core.wants_close()) core.on_closed("", now_ns);
  }
  void pass(std::int64_t duration_ns) {
    now_ns += duration_ns;
    core.poll(now_ns);
  }
  // Lets the time pass until the core wants to be polled; does nothing when it waits for no time.
  void pass_to_deadline() {
    const std::int64_t deadline_ns = core.next_deadline_ns();
    if (deadline_ns == std::numeric_limits<std::int64_t>::max()) return;
    now_ns = std::max(now_ns, deadline_ns);
    core.poll(now_ns);
  }

  [[nodiscard]] std::vector<std::uint8_t> packet(wire::Message message) const {
    return wire::encode_packet({kServerClock_ns + now_ns, std::move(message)});
  }
  void send(wire::Message message) { core.on_bytes(packet(std::move(message)), now_ns); }

  // Returns the core's next message, or nothing when it has none to send.
  std::optional<wire::Message> take() {
    const std::vector<std::uint8_t> bytes = core.take_packet(now_ns);
    if (bytes.empty()) return std::nullopt;
    wire::DecodedPacket decoded = wire::decode_packet(bytes);
    EXPECT_EQ(decoded.error, wire::DecodeError::none) << decoded.detail;
    // Each packet carries the client's time of sending, from which the server computes when poses were captured.
    EXPECT_EQ(decoded.envelope.clock_ns, now_ns);
    return std::move(decoded.envelope.message);
  }
  template <class T>
  T expect() {
    std::optional<wire::Message> message = take();
    const bool right = message && std::holds_alternative<T>(*message);
    EXPECT_TRUE(right) << (message ? static_cast<int>(message->index()) : -1);
    return right ? std::get<T>(std::move(*message)) : T{};
  }
  std::vector<wire::Message> take_all() {
    std::vector<wire::Message> all;
    while (std::optional<wire::Message> message = take()) all.push_back(std::move(*message));
    return all;
  }

  // Returns the events of one kind since the last call. All other events are dropped.
  template <class T>
  std::vector<T> events() {
    std::vector<T> found;
    for (Event& event : core.take_events()) {
      if (auto* e = std::get_if<T>(&event)) found.push_back(std::move(*e));
    }
    return found;
  }
  // Returns the first of the events of one kind. All others are dropped.
  template <class T>
  std::optional<T> event() {
    std::vector<T> found = events<T>();
    if (found.empty()) return std::nullopt;
    return std::move(found.front());
  }

  std::int64_t now_ns = 1'000'000'000;
  LinkCore core;
};

inline wire::Welcome welcome_to(std::uint64_t session, bool resumed = false) {
  wire::Welcome welcome;
  welcome.session = session;
  // The secret belongs to the session, so that a test can see whether Hello brings the right one.
  welcome.secret[0] = static_cast<std::uint8_t>(session);
  welcome.resumed = resumed;
  return welcome;
}

}  // namespace hairnet::link
