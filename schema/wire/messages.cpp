#include "schema/wire/messages.hpp"

#include <algorithm>

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
    case ErrorReason::token_invalid:
      return "token_invalid";
    case ErrorReason::room_invalid:
      return "room_invalid";
    case ErrorReason::observe_invalid:
      return "observe_invalid";
    case ErrorReason::state_invalid:
      return "state_invalid";
    case ErrorReason::groom_unavailable:
      return "groom_unavailable";
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
    case GoodbyeReason::token_refused:
      return "token_refused";
    case GoodbyeReason::room_refused:
      return "room_refused";
    case GoodbyeReason::session_taken_over:
      return "session_taken_over";
  }
  return "unknown";
}

std::string validate(const Observe& observe) {
  if (observe.stride != 1 && observe.stride != 2 && observe.stride != 4) return "stride is not 1, 2 or 4";
  if (observe.mode == ObserveMode::radius && !(observe.radius_m >= 0 && observe.radius_m <= kObserveRadiusMax_m))
    return "radius_m is not in [0, " + std::to_string(static_cast<int>(kObserveRadiusMax_m)) + "]";
  if (observe.from && !(observe.from->allFinite() && observe.from->cwiseAbs().maxCoeff() <= kPositionMax_m))
    return "the point it is measured from is not finite or too far";
  return {};
}

std::string validate(const HairState& state) {
  if (state.displacements.empty() || state.displacements.size() % 3 != 0) return "not 3 integers a node";
  if (!(state.step_m > 0 && state.step_m <= kHairStateStepMax_m)) return "step_m is not in (0, 0.001]";
  return {};
}

bool is_room_name(std::string_view name) {
  const auto is_plain = [](char c) {
    return (c >= 'a' && c <= 'z') || (c >= 'A' && c <= 'Z') || (c >= '0' && c <= '9') || c == '.' || c == '_' ||
           c == '-';
  };
  return name.size() <= kRoomNameBytesMax && std::all_of(name.begin(), name.end(), is_plain);
}

}  // namespace hairnet::wire
