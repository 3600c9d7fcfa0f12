#pragma once

#include <memory>
#include <string>
#include <vector>

#include "core/random.hpp"
#include "tests/load/virtual_client.hpp"

namespace hairnet::load {

// A client without characters that misbehaves in one way, and returns a second after the server has closed it:
//   flood      ten thousand messages a second
//   malformed  a proper hello, then ten bad packets a second
//   silent     connects and sends nothing
//   half_open  sends the first half of a hello, and ends its sending
class BadClient final : public VirtualClient, private ConnectionEvents {
 public:
  BadClient(const ClientContext& context, std::uint32_t number, Misbehaviour kind);

  std::int64_t act(std::int64_t now_ns) override;
  void set_characters(std::uint32_t, const std::vector<LevelIndex>&, std::int64_t) override {}
  void lose_connection(std::int64_t, std::int64_t) override {}
  void leave(bool, std::int64_t) override { leave_now(); }
  [[nodiscard]] bool gone() const override { return gone_; }
  [[nodiscard]] std::size_t character_count() const override { return 0; }
  [[nodiscard]] bool counts() const override { return false; }

 private:
  void on_open(std::int64_t now_ns) override;
  void on_packet(std::span<const std::uint8_t> packet, std::int64_t arrival_ns) override;
  void on_closed(std::string_view reason, std::int64_t now_ns) override;
  void leave_now();
  void misbehave(std::int64_t now_ns);

  const ClientContext* context_;
  std::uint32_t number_;
  Misbehaviour kind_;
  Random random_;
  std::unique_ptr<ClientConnection> connection_;
  bool open_ = false, gone_ = false;
  // The reason of the server's last goodbye.
  std::string goodbye_;
  // When the client connects, and when it misbehaves again.
  std::int64_t connect_ns_ = 0, next_ns_ = kNever_ns;
};

// Makes a packet that no server should accept: with flipped bits, noise, an impossible length or a NaN, or a message
// that only servers send.
std::vector<std::uint8_t> make_bad_packet(Random& random, std::int64_t now_ns);

}  // namespace hairnet::load
