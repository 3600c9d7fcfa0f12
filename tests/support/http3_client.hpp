#pragma once

#include <string_view>
#include <vector>

#include "schema/http3/capsule.hpp"
#include "schema/http3/field_section.hpp"
#include "schema/http3/opening.hpp"
#include "schema/http3/stream_type.hpp"
#include "schema/http3/varint.hpp"

namespace hairnet::http3 {

// Parts of what a client sends over HTTP/3 to open a WebTransport session, for tests of the server.

inline void put(Bytes& out, std::string_view text) {
  out.insert(out.end(), text.begin(), text.end());
}

inline Bytes headers_frame(const std::vector<FieldView>& fields) {
  Bytes frame;
  put_frame(frame, kHeadersFrame, encode_fields(fields));
  return frame;
}

// Returns a whole control stream: its type, then SETTINGS. The default, setting 0x33 with the value 1, is
// H3_DATAGRAM, which a client of WebTransport must announce.
inline Bytes control_stream(const Bytes& settings = {0x33, 1}) {
  Bytes stream{static_cast<std::uint8_t>(kControlStream)};
  put_frame(stream, kSettingsFrame, settings);
  return stream;
}

}  // namespace hairnet::http3
