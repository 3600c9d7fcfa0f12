#pragma once

#include <cstddef>
#include <cstdint>
#include <memory>
#include <span>
#include <string_view>
#include <vector>

namespace hairnet::load {

// The events of a connection. None is called from within a call to the ClientConnection. The ClientConnection may be
// destroyed in any of them.
class ConnectionEvents {
 public:
  virtual void on_open(std::int64_t now_ns) = 0;
  // `arrival_ns`: when it was read.
  virtual void on_packet(std::span<const std::uint8_t> packet, std::int64_t arrival_ns) = 0;
  // This is the last call. It does not come once the ClientConnection is destroyed. Over plain TCP `reason` is a word
  // such as "refused" or "reset"; over other transports it is one line of their library.
  virtual void on_closed(std::string_view reason, std::int64_t now_ns) = 0;

 protected:
  ~ConnectionEvents() = default;
};

// A connection that carries packets, or will do so after on_open(). Destroying it closes the connection at once, and
// bytes that wait are not sent.
class ClientConnection {
 public:
  virtual ~ClientConnection() = default;
  // Sends a packet, or any bytes of a BadClient or an Attacker.
  virtual void send(std::span<const std::uint8_t> bytes) = 0;
  [[nodiscard]] virtual bool has_datagrams() const { return false; }
  // A packet that may get lost or overtake others, where the transport has datagrams.
  virtual void send_unreliably(std::span<const std::uint8_t> packet) { send(packet); }
  // Ends the sending direction once the bytes that wait are sent.
  virtual void close_sending() = 0;
  // Reads only so many more bytes, until the next call.
  virtual void limit_reading(std::size_t bytes) = 0;
  [[nodiscard]] virtual std::size_t unsent_bytes() const = 0;
};

class Connector {
 public:
  virtual ~Connector() = default;
  // Always succeeds; failure to connect is on_closed. `host`: the last three numbers of the client's own loopback
  // address, 0x010002 for 127.1.0.2, if the server is on the loopback; 0: the system chooses. The limits of a server
  // by address need it.
  virtual std::unique_ptr<ClientConnection> connect(ConnectionEvents& events, std::uint32_t host) = 0;
};

}  // namespace hairnet::load
