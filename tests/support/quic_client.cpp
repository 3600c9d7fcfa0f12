#include "tests/support/quic_client.hpp"

#include <arpa/inet.h>

#include <utility>

#include "tests/support/http3_client.hpp"

namespace hairnet::quic {

Address loopback(std::uint16_t port, std::uint8_t last) {
  sockaddr_in address{};
  address.sin_family = AF_INET;
  address.sin_port = htons(port);
  address.sin_addr.s_addr = htonl(0x7f000000u | last);
  return Address::of(reinterpret_cast<const sockaddr*>(&address), sizeof(address));
}

QuicClient::QuicClient(const Path& path, std::int64_t now_ns, const Options& options) {
  Options chosen = options;
  // Without pings a test knows every packet. With 60 s in place of the 15 s of QuicOptions, a test may let time pass
  // without losing this end of the connection.
  chosen.keep_alive_ns = 0;
  chosen.idle_timeout_ns = 60'000'000'000;
  link::CertificateCheck anything;
  anything.insecure = true;
  connection_ = std::move(*link::QuicConnection::create(path, anything, chosen, *this, now_ns));
}

std::vector<Bytes> QuicClient::write(std::int64_t now_ns) {
  std::vector<Bytes> packets;
  if (!is_silent_)
    connection_->write(
        [&](std::span<const std::uint8_t> packet) { packets.emplace_back(packet.begin(), packet.end()); }, now_ns);
  return packets;
}

void QuicClient::receive(std::span<const std::uint8_t> packet, std::int64_t now_ns) {
  if (!is_silent_) connection_->receive(packet, now_ns);
}

void QuicClient::on_stream_bytes(std::int64_t stream, std::span<const std::uint8_t> bytes, bool is_last) {
  Bytes& all = received[stream];
  all.insert(all.end(), bytes.begin(), bytes.end());
  if (is_last) ended[stream] = true;
  connection_->take(stream, bytes.size());
}

std::int64_t QuicClient::open_session(std::string_view authority, std::string_view path, std::string_view origin) {
  send(open_stream(true), http3::control_stream());
  const std::int64_t session = open_stream();
  send(session, http3::connect_request(authority, path, origin));
  return session;
}

std::int64_t QuicClient::open_channel(std::int64_t session) {
  const std::int64_t channel = open_stream();
  send(channel, http3::channel_begin(static_cast<std::uint64_t>(session)));
  return channel;
}

}  // namespace hairnet::quic
