#include "client/link/address.hpp"

#include <algorithm>
#include <array>
#include <charconv>
#include <utility>

#include "core/assert.hpp"

namespace hairnet::link {
namespace {

// A scheme has a name, a transport and a default port.
struct Scheme {
  std::string_view name;
  Transport transport;
  std::uint16_t port;
};
constexpr std::array<Scheme, 4> kSchemes{{{"tcp", Transport::tcp, 7420},
                                          {"tls", Transport::tls, 7420},
                                          {"ws", Transport::ws, 80},
                                          {"wss", Transport::wss, 443}}};
// The longest name of a host, about that of the DNS (RFC 1035).
constexpr std::size_t kHostBytesMax = 255;

Refusal refuse(std::string_view text, std::string_view error) {
  return Refusal("'" + std::string(text) + "': " + std::string(error));
}

// Whether the text may be part of a request line: no blanks, no control characters.
bool is_printable(std::string_view text) {
  return std::all_of(text.begin(), text.end(), [](char c) { return c > ' ' && c < '\x7f'; });
}

}  // namespace

Result<Address> parse_address(std::string_view text) {
  std::string_view rest = text;
  // No scheme means tcp://.
  Scheme scheme = kSchemes[0];
  if (const std::size_t at = rest.find("://"); at != std::string_view::npos) {
    const auto known =
        std::find_if(kSchemes.begin(), kSchemes.end(), [&](const Scheme& s) { return s.name == rest.substr(0, at); });
    if (known == kSchemes.end()) return refuse(text, "begins with none of tcp://, tls://, ws://, wss://");
    scheme = *known;
    rest.remove_prefix(at + 3);
  }
  Address address;
  address.transport = scheme.transport;
  address.port = scheme.port;
  if (const std::size_t slash = rest.find('/'); slash != std::string_view::npos) {
    if (!address.web_socket()) return refuse(text, "only ws:// and wss:// have a path");
    address.path = rest.substr(slash);
    rest = rest.substr(0, slash);
  }
  // Host and path become lines of an HTTP request: a line break in them could add headers.
  if (!is_printable(rest) || !is_printable(address.path))
    return refuse(text, "holds blanks or characters beyond ASCII");
  std::string_view port;
  bool has_port = false;
  if (rest.starts_with('[')) {
    const std::size_t close = rest.find(']');
    if (close == std::string_view::npos) return refuse(text, "a bracket is not closed");
    address.host = rest.substr(1, close - 1);
    rest.remove_prefix(close + 1);
    has_port = rest.starts_with(':');
    if (!has_port && !rest.empty()) return refuse(text, "only :PORT may follow the bracket");
    port = has_port ? rest.substr(1) : "";
  } else {
    const std::size_t colon = rest.find(':');
    has_port = colon != std::string_view::npos;
    // Without brackets nobody could say where an IPv6 address ends and its port begins.
    if (has_port && rest.find(':', colon + 1) != std::string_view::npos)
      return refuse(text, "an IPv6 address stands in brackets, as in [::1]:7420");
    address.host = rest.substr(0, colon);
    port = has_port ? rest.substr(colon + 1) : "";
  }
  if (address.host.empty() || address.host.size() > kHostBytesMax) return refuse(text, "names no host");
  if (!has_port) return address;
  // from_chars takes no sign and no blanks, and refuses what exceeds 16 bits.
  const auto [end, error] = std::from_chars(port.data(), port.data() + port.size(), address.port);
  if (error != std::errc() || end != port.data() + port.size() || address.port == 0)
    return refuse(text, "the port is not a number in 1 ... 65535");
  return address;
}

Result<TransportChoice> parse_transport_choice(std::string_view text) {
  if (text == "auto") return TransportChoice::automatic;
  if (text == "webtransport") return TransportChoice::webtransport;
  if (text == "address") return TransportChoice::address;
  return refuse(text, "is none of auto, webtransport, address");
}

std::string_view to_string(Transport transport) {
  const auto scheme =
      std::find_if(kSchemes.begin(), kSchemes.end(), [&](const Scheme& s) { return s.transport == transport; });
  HAIRNET_ASSERT(scheme != kSchemes.end());
  return scheme->name;
}

std::string Address::authority_at(std::uint16_t other_port) const {
  // Only an IPv6 address has a colon; the parser has taken its brackets off.
  const bool bracketed = host.find(':') != std::string::npos;
  return (bracketed ? "[" + host + "]" : host) + ":" + std::to_string(other_port);
}

std::string to_string(const Address& address) {
  const std::string text = std::string(to_string(address.transport)) + "://" + address.authority();
  return address.web_socket() ? text + address.path : text;
}

}  // namespace hairnet::link
