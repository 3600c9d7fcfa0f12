#pragma once

#include <cstdint>

namespace hairnet::http3 {

// A unidirectional stream begins with one of these integers. They are HTTP/3's control and push streams (RFC 9114,
// section 6.2), the encoder and the decoder of QPACK (RFC 9204, section 4.2), and a stream of a WebTransport session.
inline constexpr std::uint64_t kControlStream = 0x00, kPushStream = 0x01, kEncoderStream = 0x02, kDecoderStream = 0x03,
                               kSessionStream = 0x54;
// A bidirectional stream that belongs to a session begins with this, where others have the type of a frame.
inline constexpr std::uint64_t kSessionSignal = 0x41;

// These are the types of frames (RFC 9114, section 7.2).
inline constexpr std::uint64_t kDataFrame = 0x00, kHeadersFrame = 0x01, kCancelPushFrame = 0x03, kSettingsFrame = 0x04,
                               kPushPromiseFrame = 0x05, kGoawayFrame = 0x07, kMaxPushIdFrame = 0x0d;

// HTTP/3 forbids these types, which are PRIORITY, PING, WINDOW_UPDATE and CONTINUATION of HTTP/2.
inline constexpr bool is_forbidden_frame(std::uint64_t type) {
  return type == 0x02 || type == 0x06 || type == 0x08 || type == 0x09;
}

}  // namespace hairnet::http3
