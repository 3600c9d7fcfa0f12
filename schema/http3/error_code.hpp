#pragma once

#include <cstdint>

namespace hairnet::http3 {

// Codes that end a connection or a stream (RFC 9114, section 8.1; RFC 9204, section 6; RFC 9297; WebTransport).
enum class ErrorCode : std::uint64_t {
  datagram_error = 0x33,
  no_error = 0x100,
  general_protocol_error = 0x101,
  stream_creation_error = 0x103,
  closed_critical_stream = 0x104,
  frame_unexpected = 0x105,
  frame_error = 0x106,
  excessive_load = 0x107,
  id_error = 0x108,
  settings_error = 0x109,
  missing_settings = 0x10a,
  request_rejected = 0x10b,
  message_error = 0x10e,
  decompression_failed = 0x200,
  encoder_stream_error = 0x201,
  // The stream belongs to a session that does not exist (yet).
  session_unknown = 0x3994bd84,
  // The session has ended, which ends its streams too.
  session_gone = 0x170d7b68,
  // This is a session's own error 0: it has its channel already, or gives a download up.
  session_error = 0x52e4a40fa8db,
};

}  // namespace hairnet::http3
