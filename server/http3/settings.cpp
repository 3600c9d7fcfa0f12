#include "server/http3/settings.hpp"

#include <array>
#include <set>
#include <utility>

#include "server/http3/stream_type.hpp"

namespace hairnet::http3 {
namespace {

constexpr std::array<std::pair<std::uint64_t, std::uint64_t>, 5> kSettings{{
    {0x08, 1},         // SETTINGS_ENABLE_CONNECT_PROTOCOL
    {0x33, 1},         // SETTINGS_H3_DATAGRAM
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

bool are_valid_settings(std::span<const std::uint8_t> payload) {
  std::set<std::uint64_t> seen;
  while (!payload.empty()) {
    const Varint name = read_varint(payload);
    if (name.bytes == 0) return false;
    const Varint value = read_varint(payload.subspan(name.bytes));
    if (value.bytes == 0) return false;
    if (name.value >= 0x02 && name.value <= 0x05) return false;  // HTTP/2's
    if (!seen.insert(name.value).second) return false;
    payload = payload.subspan(name.bytes + value.bytes);
  }
  return true;
}

}  // namespace hairnet::http3
