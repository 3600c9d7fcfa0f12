#pragma once

#include <deque>
#include <optional>
#include <string>
#include <vector>

#include "schema/wire/messages.hpp"
#include "server/session/connection.hpp"

namespace hairnet::server {

// A fake connection that stores the sent packets, decoded.
class FakeConnection final : public Connection {
 public:
  void mark_joined() override { joined = true; }
  void send(std::vector<std::uint8_t> packet) override {
    wire::DecodedPacket decoded = wire::decode_packet(packet);
    if (room) --*room;
    sound &= decoded.error == wire::DecodeError::none;
    largest_packet_bytes = std::max(largest_packet_bytes, packet.size());
    received.push_back(std::move(decoded.envelope));
  }
  [[nodiscard]] double bytes_per_s() const override { return network_bytes_per_s; }
  [[nodiscard]] bool writable() const override { return takes_more && room != 0; }
  void close(std::string_view reason) override {
    closed = true;
    close_reason = reason;
  }
  [[nodiscard]] std::string_view peer() const override { return "nowhere"; }
  [[nodiscard]] std::string_view network() const override { return address; }

  // The messages of one kind, in order; they stay.
  template <class T>
  [[nodiscard]] std::vector<T> all() const {
    std::vector<T> found;
    for (const wire::Envelope& envelope : received) {
      if (const T* message = std::get_if<T>(&envelope.message)) found.push_back(*message);
    }
    return found;
  }

  std::optional<std::size_t> room;  // for so many packets more
  std::deque<wire::Envelope> received;
  std::size_t largest_packet_bytes = 0;
  double network_bytes_per_s = 0;
  bool takes_more = true, joined = false, closed = false, sound = true;
  std::string close_reason, address;
};

}  // namespace hairnet::server
