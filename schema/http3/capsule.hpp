#pragma once

#include <cstddef>
#include <cstdint>
#include <string_view>

#include "schema/http3/varint.hpp"

namespace hairnet::http3 {

// Capsules of a session's CONNECT stream; others are skipped.
inline constexpr std::uint64_t kCloseSessionCapsule = 0x2843, kDrainSessionCapsule = 0x78ae;
inline constexpr std::size_t kCloseReasonBytesMax = 1024;

// DATA frames with one capsule. A longer reason is cut.
Bytes close_session_capsule(std::uint32_t code, std::string_view reason);
Bytes drain_session_capsule();

// Appends a DATA or HEADERS frame.
void put_frame(Bytes& out, std::uint64_t type, const Bytes& payload);

}  // namespace hairnet::http3
