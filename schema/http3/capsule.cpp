#include "schema/http3/capsule.hpp"

#include "schema/http3/stream_type.hpp"

namespace hairnet::http3 {
namespace {

Bytes in_data_frame(std::uint64_t type, const Bytes& value) {
  Bytes capsule, frame;
  put_frame(capsule, type, value);
  put_frame(frame, kDataFrame, capsule);
  return frame;
}

}  // namespace

void put_frame(Bytes& out, std::uint64_t type, const Bytes& payload) {
  put_varint(out, type);
  put_varint(out, payload.size());
  out.insert(out.end(), payload.begin(), payload.end());
}

Bytes close_session_capsule(std::uint32_t code, std::string_view reason) {
  // A peer treats a longer reason as an error, and the reason would be lost with it.
  reason = reason.substr(0, kCloseReasonBytesMax);
  Bytes value;
  for (int shift = 24; shift >= 0; shift -= 8) value.push_back(static_cast<std::uint8_t>(code >> shift));
  value.insert(value.end(), reason.begin(), reason.end());
  return in_data_frame(kCloseSessionCapsule, value);
}

Bytes drain_session_capsule() {
  return in_data_frame(kDrainSessionCapsule, {});
}

}  // namespace hairnet::http3
