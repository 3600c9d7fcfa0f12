#include "tests/whole/refusals.hpp"

#include <string_view>

namespace hairnet::whole {

std::vector<std::string> missing_refusals(const std::map<std::string, std::uint64_t>& events) {
  // For each kind of bad client what it hears, or what the server counts.
  constexpr std::string_view kRefusals[] = {
      "silent sent away, handshake_timeout",
      "connection refused, too many of its address",
      "connection refused, too soon",
      "flood sent away, over_rate",
      "server: poses_thinned",
      "server: poses_dropped_over_rate",
      "server: sessions_closed_by_server_slow",
      "rejoiner sent away, server_full",
      "server: sessions_refused_full",
      "server: sessions_refused_subject",
      "server: sessions_refused_address",
      "resumer sent away, over_rate",
      "server: sessions_refused_early",
      "groom_trickler got limit_exceeded",
      "server: grooms_refused_stalled",
      "server: grooms_refused_limit",
      "server: grooms_refused_rate",
      "groom_heaper got groom_invalid",
      "groom_heaper got groom_build_queue_full",
      "server: grooms_refused_build_time",
      "server: grooms_refused_build_memory",
      "drip_reader cut off, the server closed",
      "shuffler sent away, over_rate",
      "hoarder got limit_exceeded",
      "chooser sent away, over_rate",
      "windmaker got limit_exceeded",
      "datagram_corrupter got malformed",
      "datagram_corrupter sent away, protocol_error",
      "server: datagrams_dropped",
  };
  std::vector<std::string> missing;
  for (const std::string_view refusal : kRefusals) {
    if (!events.contains(std::string(refusal))) missing.emplace_back(refusal);
  }
  return missing;
}

}  // namespace hairnet::whole
