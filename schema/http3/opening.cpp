#include "schema/http3/opening.hpp"

#include <vector>

#include "schema/http3/capsule.hpp"
#include "schema/http3/field_section.hpp"
#include "schema/http3/stream_type.hpp"

namespace hairnet::http3 {

Bytes connect_request(std::string_view authority, std::string_view path, std::string_view origin) {
  std::vector<FieldView> fields{{":method", "CONNECT"}, {":protocol", "webtransport"},
                                {":scheme", "https"},   {":authority", authority},
                                {":path", path},        {"sec-webtransport-http3-draft02", "1"}};
  if (!origin.empty()) fields.emplace_back("origin", origin);
  Bytes frame;
  put_frame(frame, kHeadersFrame, encode_fields(fields));
  return frame;
}

Bytes channel_begin(std::uint64_t session) {
  Bytes begin;
  put_varint(begin, kSessionSignal);
  put_varint(begin, session);
  return begin;
}

Bytes one_way_begin(std::uint64_t session) {
  Bytes begin;
  put_varint(begin, kSessionStream);
  put_varint(begin, session);
  return begin;
}

}  // namespace hairnet::http3
