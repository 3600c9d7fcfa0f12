#pragma once

#include <cstdint>

namespace hairnet::http3 {

// The first integer of a unidirectional stream.
inline constexpr std::uint64_t kControlStream = 0x00, kPushStream = 0x01, kEncoderStream = 0x02, kDecoderStream = 0x03,
                               kSessionStream = 0x54;
// Begins a bidirectional stream that belongs to a session, instead of a frame's type.
inline constexpr std::uint64_t kSessionSignal = 0x41;

// Types of frames.
inline constexpr std::uint64_t kDataFrame = 0x00, kHeadersFrame = 0x01, kCancelPushFrame = 0x03, kSettingsFrame = 0x04,
                               kPushPromiseFrame = 0x05, kGoawayFrame = 0x07, kMaxPushIdFrame = 0x0d;

// HTTP/2's, which HTTP/3 forbids.
inline constexpr bool is_forbidden_frame(std::uint64_t type) {
  return type == 0x02 || type == 0x06 || type == 0x08 || type == 0x09;
}

}  // namespace hairnet::http3
