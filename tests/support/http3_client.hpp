#pragma once

#include <string_view>
#include <utility>
#include <vector>

#include "server/http3/capsule.hpp"
#include "server/http3/stream_type.hpp"
#include "server/http3/varint.hpp"

namespace hairnet::http3 {

// What a client sends to open a session.

inline void put(Bytes& out, std::string_view text) {
  out.insert(out.end(), text.begin(), text.end());
}

// Fields as literals with literal names, without Huffman coding. Names and values have at most 126 letters.
inline Bytes fields_section(const std::vector<std::pair<std::string_view, std::string_view>>& fields) {
  Bytes section{0, 0};
  for (const auto& [name, value] : fields) {
    if (name.size() < 7) {
      section.push_back(static_cast<std::uint8_t>(0x20 | name.size()));
    } else {
      section.insert(section.end(), {0x27, static_cast<std::uint8_t>(name.size() - 7)});
    }
    put(section, name);
    section.push_back(static_cast<std::uint8_t>(value.size()));
    put(section, value);
  }
  return section;
}

inline Bytes headers_frame(const std::vector<std::pair<std::string_view, std::string_view>>& fields) {
  Bytes frame;
  put_frame(frame, kHeadersFrame, fields_section(fields));
  return frame;
}

inline Bytes connect_request(std::string_view authority = "localhost:7420", std::string_view path = "/ws",
                             std::string_view origin = "") {
  std::vector<std::pair<std::string_view, std::string_view>> fields{
      {":method", "CONNECT"}, {":protocol", "webtransport"},          {":scheme", "https"}, {":authority", authority},
      {":path", path},        {"sec-webtransport-http3-draft02", "1"}};
  if (!origin.empty()) fields.emplace_back("origin", origin);
  return headers_frame(fields);
}

inline Bytes control_stream(const Bytes& settings = {0x33, 1}) {
  Bytes stream{static_cast<std::uint8_t>(kControlStream)};
  put_frame(stream, kSettingsFrame, settings);
  return stream;
}

// What the session's channel begins with.
inline Bytes channel_begin(std::uint64_t session) {
  Bytes begin;
  put_varint(begin, kSessionSignal);
  put_varint(begin, session);
  return begin;
}

}  // namespace hairnet::http3
