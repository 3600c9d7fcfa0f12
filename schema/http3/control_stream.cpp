#include "schema/http3/control_stream.hpp"

#include <array>
#include <utility>

#include "schema/http3/stream_type.hpp"

namespace hairnet::http3 {
namespace {

// Each draft gave WebTransport another name, and clients pass over the names that they do not know. The 16 is the most
// sessions of a connection.
constexpr std::array<std::pair<std::uint64_t, std::uint64_t>, 5> kSettings{{
    {kEnableConnectProtocol, 1},
    {kH3Datagram, 1},
    {0x2b603742, 1},   // SETTINGS_ENABLE_WEBTRANSPORT, draft 2
    {0xc671706a, 16},  // SETTINGS_WEBTRANSPORT_MAX_SESSIONS, drafts 7 to 12
    {0x14e9cd29, 16},  // SETTINGS_WT_MAX_SESSIONS, draft 13 and later
}};

}  // namespace

Bytes control_stream_begin() {
  Bytes payload;
  for (const auto& [name, value] : kSettings) {
    put_varint(payload, name);
    put_varint(payload, value);
  }
  Bytes stream;
  put_varint(stream, kControlStream);
  put_varint(stream, kSettingsFrame);
  put_varint(stream, payload.size());
  stream.insert(stream.end(), payload.begin(), payload.end());
  return stream;
}

std::optional<std::map<std::uint64_t, std::uint64_t>> read_settings(std::span<const std::uint8_t> payload) {
  std::map<std::uint64_t, std::uint64_t> settings;
  while (!payload.empty()) {
    const Varint name = read_varint(payload);
    if (name.bytes == 0) return std::nullopt;
    const Varint value = read_varint(payload.subspan(name.bytes));
    if (value.bytes == 0) return std::nullopt;
    // These names are settings of HTTP/2, which HTTP/3 forbids (RFC 9114, 7.2.4.1).
    if (name.value >= 0x02 && name.value <= 0x05) return std::nullopt;
    // A name must not come twice (RFC 9114, 7.2.4).
    if (!settings.emplace(name.value, value.value).second) return std::nullopt;
    payload = payload.subspan(name.bytes + value.bytes);
  }
  return settings;
}

}  // namespace hairnet::http3
