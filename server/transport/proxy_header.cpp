#include "server/transport/proxy_header.hpp"

#include <algorithm>
#include <array>
#include <charconv>
#include <string>
#include <string_view>

#include "core/assert.hpp"

namespace hairnet::server {
namespace {

using asio::ip::tcp;
using Status = ProxyHeader::Status;

constexpr std::string_view kTextSignature = "PROXY ";
// The specification bounds a line of version 1, with its end, by this.
constexpr std::size_t kTextBytesMax = 107;
constexpr std::string_view kBinarySignature{"\r\n\r\n\0\r\nQUIT\n", 12};
// The fixed part of version 2: 12 bytes of signature, one of version and command (4 bits each), one of family and
// protocol (4 bits each), and two with the length of the rest.
constexpr std::size_t kBinaryBytes = 16;
// Two addresses and two ports: 2 * 4 + 2 * 2 bytes, or 2 * 16 + 2 * 2.
constexpr std::size_t kV4Bytes = 12, kV6Bytes = 36;

// Compares only as many bytes as have come, so a header that comes byte by byte is incomplete and not malformed.
bool begins_like(std::string_view text, std::string_view signature) {
  const std::size_t bytes = std::min(text.size(), signature.size());
  return text.substr(0, bytes) == signature.substr(0, bytes);
}

// Removes the first word and the space behind it.
std::string_view take_word(std::string_view& text) {
  const std::size_t space = text.find(' ');
  const std::string_view word = text.substr(0, space);
  text.remove_prefix(space == std::string_view::npos ? text.size() : space + 1);
  return word;
}

bool parse_port(std::string_view text, std::uint16_t& port) {
  const auto [end, error] = std::from_chars(text.data(), text.data() + text.size(), port);
  return error == std::errc() && end == text.data() + text.size();
}

// Reads a line of version 1 without its end: "TCP4" or "TCP6", the addresses of source and destination, their ports.
// Returns the source.
std::optional<tcp::endpoint> parse_text_peer(std::string_view line) {
  const std::string_view family = take_word(line);
  const std::string source(take_word(line)), destination(take_word(line));
  std::uint16_t port = 0, ignored = 0;
  if (!parse_port(take_word(line), port) || !parse_port(take_word(line), ignored) || !line.empty()) return std::nullopt;
  // The destination is checked, too: a line with a wrong one was not written by a proxy.
  boost::system::error_code wrong_source, wrong_destination;
  const auto from = asio::ip::make_address(source, wrong_source);
  const auto to = asio::ip::make_address(destination, wrong_destination);
  const bool is_v4 = family == "TCP4";
  if (wrong_source || wrong_destination || from.is_v4() != is_v4 || to.is_v4() != is_v4) return std::nullopt;
  if (!is_v4 && family != "TCP6") return std::nullopt;
  return tcp::endpoint(from, port);
}

ProxyHeader parse_text(std::string_view text) {
  const std::size_t end = text.substr(0, kTextBytesMax).find("\r\n");
  if (end == std::string_view::npos) return {text.size() < kTextBytesMax ? Status::incomplete : Status::malformed};
  const std::string_view line = text.substr(kTextSignature.size(), end - kTextSignature.size());
  const std::size_t bytes = end + 2;
  // The proxy does not know its peer, or the family; the rest of such a line must be ignored.
  if (line == "UNKNOWN" || line.starts_with("UNKNOWN ")) return {Status::complete, bytes};
  const auto peer = parse_text_peer(line);
  return peer ? ProxyHeader{Status::complete, bytes, peer} : ProxyHeader{Status::malformed};
}

template <class Address>
tcp::endpoint endpoint_of(std::span<const std::uint8_t> addresses) {
  typename Address::bytes_type source;
  std::copy_n(addresses.begin(), source.size(), source.begin());
  // The ports follow both addresses.
  const std::size_t port = 2 * source.size();
  return {Address(source), static_cast<std::uint16_t>(addresses[port] << 8 | addresses[port + 1])};
}

ProxyHeader parse_binary(std::span<const std::uint8_t> first) {
  if (first.size() < kBinaryBytes) return {};
  const std::size_t version = first[12] >> 4, command = first[12] & 0xf, family = first[13];
  const std::size_t bytes = kBinaryBytes + (std::size_t{first[14]} << 8 | first[15]);
  // The length is a stranger's number if the peer is no proxy: it is bounded before anything waits for so many bytes.
  if (version != 2 || command > 1 || bytes > kProxyHeaderBytesMax) return {Status::malformed};
  if (first.size() < bytes) return {};
  // Values of type, length and value follow the addresses and are skipped, TLS details of the proxy among them.
  const auto addresses = first.first(bytes).subspan(kBinaryBytes);
  // LOCAL is the proxy's own connection, as for a check of health: it has no other peer.
  if (command == 0) return {Status::complete, bytes};
  // The family is IPv4 (1) or IPv6 (2), the protocol a stream (1).
  constexpr std::size_t kTcpV4 = 0x11, kTcpV6 = 0x21;
  if (family == kTcpV4 && addresses.size() >= kV4Bytes)
    return {Status::complete, bytes, endpoint_of<asio::ip::address_v4>(addresses)};
  if (family == kTcpV6 && addresses.size() >= kV6Bytes)
    return {Status::complete, bytes, endpoint_of<asio::ip::address_v6>(addresses)};
  if (family == kTcpV4 || family == kTcpV6) return {Status::malformed};
  return {Status::complete, bytes};
}

}  // namespace

ProxyHeader parse_proxy_header(std::span<const std::uint8_t> first) {
  const std::string_view text(reinterpret_cast<const char*>(first.data()), first.size());
  ProxyHeader header{Status::malformed};
  if (begins_like(text, kTextSignature))
    header = text.size() < kTextSignature.size() ? ProxyHeader{} : parse_text(text);
  else if (begins_like(text, kBinarySignature))
    header = parse_binary(first);
  HAIRNET_ASSERT(header.bytes <= first.size());
  HAIRNET_ASSERT(header.status != Status::incomplete || first.size() < kProxyHeaderBytesMax);
  return header;
}

}  // namespace hairnet::server
