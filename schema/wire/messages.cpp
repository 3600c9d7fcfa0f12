#include "schema/wire/messages.hpp"

namespace hairnet::wire {

const char* to_string(DecodeError error) {
  switch (error) {
    case DecodeError::none:
      return "none";
    case DecodeError::too_large:
      return "too_large";
    case DecodeError::malformed:
      return "malformed";
    case DecodeError::invalid:
      return "invalid";
  }
  return "unknown";
}

const char* to_string(ErrorReason reason) {
  switch (reason) {
    case ErrorReason::none:
      return "none";
    case ErrorReason::malformed:
      return "malformed";
    case ErrorReason::version_unsupported:
      return "version_unsupported";
    case ErrorReason::unexpected_message:
      return "unexpected_message";
    case ErrorReason::limit_exceeded:
      return "limit_exceeded";
    case ErrorReason::groom_unknown:
      return "groom_unknown";
    case ErrorReason::groom_invalid:
      return "groom_invalid";
    case ErrorReason::groom_hash_mismatch:
      return "groom_hash_mismatch";
    case ErrorReason::groom_build_queue_full:
      return "groom_build_queue_full";
    case ErrorReason::character_unknown:
      return "character_unknown";
    case ErrorReason::character_exists:
      return "character_exists";
    case ErrorReason::level_invalid:
      return "level_invalid";
    case ErrorReason::pose_invalid:
      return "pose_invalid";
    case ErrorReason::material_invalid:
      return "material_invalid";
    case ErrorReason::wind_invalid:
      return "wind_invalid";
    case ErrorReason::not_allowed:
      return "not_allowed";
  }
  return "unknown";
}

const char* to_string(GoodbyeReason reason) {
  switch (reason) {
    case GoodbyeReason::none:
      return "none";
    case GoodbyeReason::client_leaves:
      return "client_leaves";
    case GoodbyeReason::server_draining:
      return "server_draining";
    case GoodbyeReason::protocol_error:
      return "protocol_error";
    case GoodbyeReason::version_unsupported:
      return "version_unsupported";
    case GoodbyeReason::handshake_timeout:
      return "handshake_timeout";
    case GoodbyeReason::idle_timeout:
      return "idle_timeout";
    case GoodbyeReason::slow_consumer:
      return "slow_consumer";
    case GoodbyeReason::server_full:
      return "server_full";
    case GoodbyeReason::over_rate:
      return "over_rate";
  }
  return "unknown";
}

}  // namespace hairnet::wire
