#include "server/telemetry/metric_name.hpp"

#include <algorithm>
#include <array>

namespace hairnet::server {
namespace {

struct Exact {
  std::string_view name, family, label_name, label_value;
};
// Exceptions to the naming rules: mostly a total beside counters of its parts. Both in one family would count twice in
// a sum.
constexpr std::array kExact{
    Exact{"frames_dropped", "frames_dropped", "reason", "not_finite"},
    Exact{"packets_malformed", "packets_refused", "reason", "malformed"},
    Exact{"packets_invalid", "packets_refused", "reason", "invalid"},
    Exact{"packets_oversize", "packets_refused", "reason", "oversize"},
    Exact{"messages_unexpected", "messages_refused", "reason", "unexpected"},
    Exact{"messages_over_rate", "messages_refused", "reason", "over_rate"},
    Exact{"poses_over_rate", "poses_dropped", "reason", "over_rate"},
    Exact{"characters_refused", "requests_refused", "request", "character"},
    Exact{"levels_refused", "requests_refused", "request", "level"},
    Exact{"materials_refused", "requests_refused", "request", "material"},
    Exact{"winds_refused", "requests_refused", "request", "wind"},
    Exact{"grooms_refused", "requests_refused", "request", "groom"},
    Exact{"chunks_refused", "requests_refused", "request", "chunk"},
    Exact{"hair_states_refused", "requests_refused", "request", "hair_state"},
    Exact{"observes_refused", "requests_refused", "request", "observe"},
    Exact{"downloads_refused", "requests_refused", "request", "download"},
    Exact{"connections_tcp", "connections_opened", "transport", "tcp"},
    Exact{"connections_websocket", "connections_opened", "transport", "websocket"},
    Exact{"connections_http", "connections_opened", "transport", "http"},
};

struct Part {
  std::string_view before, family, label_name;  // what follows `before` is the label's value
};
constexpr std::array kParts{
    Part{"sessions_closed_", "sessions_closed_by_server", "reason"},
    Part{"bytes_read_", "received_bytes", "transport"},
    Part{"bytes_written_", "sent_bytes", "transport"},
    Part{"packets_read_", "received_packets", "transport"},
    Part{"packets_written_", "sent_packets", "transport"},
    Part{"http_responses_", "http_responses", "code"},
    Part{"characters_at_", "characters", "level"},
    Part{"characters_in_state_", "characters_by_state", "state"},
    Part{"step_cost_seconds_at_", "step_cost_seconds", "level"},
};

// DUTY_ns_total: time spent on something.
constexpr std::string_view kNanoseconds = "_ns_total";

// Counters named THINGS_refused_REASON and similarly.
constexpr std::array<std::string_view, 5> kVerbs{"_rejected_", "_refused_", "_dropped_", "_failed_", "_closed_"};

MetricName unprefixed(std::string_view name) {
  const auto exact = std::find_if(kExact.begin(), kExact.end(), [&](const Exact& e) { return e.name == name; });
  if (exact != kExact.end())
    return {std::string(exact->family), std::string(exact->label_name), std::string(exact->label_value), 1};
  for (const Part& part : kParts) {
    if (name.starts_with(part.before))
      return {std::string(part.family), std::string(part.label_name), std::string(name.substr(part.before.size())), 1};
  }
  if (name.ends_with(kNanoseconds))
    return {"duty_seconds", "duty", std::string(name.substr(0, name.size() - kNanoseconds.size())), 1e-9};
  for (const std::string_view verb : kVerbs) {
    const std::size_t at = name.find(verb);
    if (at != std::string_view::npos)
      return {std::string(name.substr(0, at + verb.size() - 1)), "reason", std::string(name.substr(at + verb.size())),
              1};
  }
  return {std::string(name), "", "", 1};
}

}  // namespace

MetricName metric_name(std::string_view name, MetricKind kind) {
  MetricName made = unprefixed(name);
  made.family = "hairnet_" + made.family + (kind == MetricKind::counter ? "_total" : "");
  return made;
}

}  // namespace hairnet::server
