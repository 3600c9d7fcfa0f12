#pragma once

#include <cstdint>
#include <map>
#include <memory>
#include <optional>
#include <string>

#include "schema/wire/messages.hpp"
#include "tests/load/client_connection.hpp"

namespace hairnet::load {

// What all attackers of a stage share. It must outlive them, and is used on one thread.
struct AttackContext {
  Connector* connector = nullptr;
  // The groom of the attackers' characters, which the server has ready.
  wire::GroomHash groom{};
  // The groom that the late joiner of this stage will upload, and its size.
  wire::GroomHash late_joiner_groom{};
  std::uint64_t late_joiner_groom_bytes = 0;
  // The numbers of what attackers did and what the server answered.
  std::map<std::string, std::uint64_t, std::less<>>* events = nullptr;
};

// Events at a fixed rate, from the first call on.
class Rate {
 public:
  explicit Rate(double hz) : interval_ns_(hz > 0 ? 1e9 / hz : 0) {}
  // Returns the time of the next event if it is due. A rate of 0 has no events. Events of more than a second ago are
  // left out, so that a generator that stalled does not send them all at once.
  std::optional<std::int64_t> take(std::int64_t now_ns);

 private:
  // The next event's time is long ago at first, so that the first call counts as the time of the first event.
  double interval_ns_, next_ns_ = -1e18;
};

// A connection that attacks the server. It connects again a while after it was closed. Long packets, which carry
// frames, are read and not decoded: an attack costs the generator little.
class Attacker : private ConnectionEvents {
 public:
  Attacker(const AttackContext& context, std::uint32_t host, std::int64_t redial_ns);
  virtual ~Attacker() = default;
  Attacker(const Attacker&) = delete;
  Attacker& operator=(const Attacker&) = delete;
  // Call it every few milliseconds.
  void act(std::int64_t now_ns);

 protected:
  // This is called when the connection is open.
  virtual void begin(std::int64_t now_ns) = 0;
  // This is called at each act() while the connection is open.
  virtual void proceed(std::int64_t now_ns) = 0;
  // This is called for each message from the server, except those of more than 2 kB, which carry frames.
  virtual void hear(const wire::Message& message, std::int64_t now_ns);
  void send(wire::Message message, std::int64_t now_ns);
  void close(std::int64_t now_ns);
  void count(std::string_view event, std::uint64_t by = 1);
  [[nodiscard]] ClientConnection& connection() { return *connection_; }
  [[nodiscard]] bool is_open() const { return open_; }

  const AttackContext* context_;

 private:
  void on_open(std::int64_t now_ns) final;
  void on_packet(std::span<const std::uint8_t> packet, std::int64_t arrival_ns) final;
  void on_closed(std::string_view reason, std::int64_t now_ns) final;

  std::uint32_t host_;
  std::int64_t redial_ns_, connect_ns_ = 0;
  std::unique_ptr<ClientConnection> connection_;
  bool open_ = false;
};

}  // namespace hairnet::load
