#include "server/session/room_keeper.hpp"

#include <spdlog/spdlog.h>

#include <algorithm>
#include <set>
#include <utility>

#include "server/fleet/fleet_values.hpp"
#include "server/telemetry/log_text.hpp"

namespace hairnet::server {
namespace {

constexpr std::int64_t kSecond_ns = 1'000'000'000;
constexpr std::int64_t kBan_s_max = 10LL * 365 * 24 * 3600;

std::optional<wire::SetWind> wind_of(const std::vector<std::uint8_t>& packet) {
  if (packet.empty()) return std::nullopt;
  wire::DecodedPacket decoded = wire::decode_packet(packet);
  const auto* set = std::get_if<wire::SetWind>(&decoded.envelope.message);
  if (decoded.error != wire::DecodeError::none || !set || !validate(set->wind).empty()) return std::nullopt;
  return *set;
}

}  // namespace

void RoomKeeper::take(const std::string& room, const std::string& text, std::int64_t now_ns) {
  // It was this server's a moment ago, before it lost its lease, and what has changed since is not in the text.
  if (context_->rooms_changed.contains(room)) return;
  RoomRules::OfRoom rules;
  context_->winds.erase(room);
  if (!text.empty()) {
    const Result<RoomKept> kept = parse_kept(text);
    const std::optional<wire::SetWind> wind = kept ? wind_of(kept->wind) : std::nullopt;
    if (!kept || (!kept->wind.empty() && !wind)) {
      context_->counters.rooms_kept_refused.add();
      spdlog::warn("event=room_kept_refused room={} detail={}", log_text(room),
                   log_text(kept ? "its wind is not valid" : kept.error()));
    }
    if (kept) {
      const std::int64_t unix_s = context_->unix_time_s();
      for (const RoomKept::Ban& ban : kept->bans)
        if (ban.until_s > unix_s)
          rules.bans.emplace_back(ban.subject, now_ns + std::min(ban.until_s - unix_s, kBan_s_max) * kSecond_ns);
      rules.mutes = kept->mutes;
      rules.is_locked = kept->is_locked;
      rules.returning = kept->members;
    }
    if (wind) context_->winds[room] = {wind->wind};
  }
  rules.return_until_ns = now_ns + kReturn_ns;
  const std::size_t left_out = context_->rules.replace(room, rules, now_ns, context_->limits.bans_max);
  context_->counters.kept_left_out.add(left_out);
  if (left_out > 0) spdlog::warn("event=room_kept_in_part room={} left_out={}", log_text(room), left_out);
}

void RoomKeeper::keep_changed(std::int64_t now_ns) {
  for (const std::string& room : std::exchange(context_->rooms_changed, {})) keep(room, false, now_ns);
}

void RoomKeeper::end(const std::string& room, std::int64_t now_ns) {
  context_->rooms_changed.erase(room);
  keep(room, true, now_ns);
  context_->winds.erase(room);
}

void RoomKeeper::keep(const std::string& room, bool has_ended, std::int64_t now_ns) {
  RoomRules::OfRoom rules = context_->rules.of_room(room, now_ns);
  RoomKept kept;
  std::ranges::sort(rules.bans, std::ranges::greater(),
                    [](const auto& ban) { return std::pair(ban.second, ban.first); });
  const std::int64_t unix_s = context_->unix_time_s();
  // Rounded up, so that a ban that moves does not end early.
  for (const auto& [subject, until_ns] : rules.bans)
    kept.bans.push_back({subject, unix_s + (until_ns - now_ns + kSecond_ns - 1) / kSecond_ns});
  if (!has_ended) {
    kept.mutes = std::move(rules.mutes);
    kept.is_locked = rules.is_locked;
    if (kept.is_locked && context_->directory) {
      std::set<std::string> members;
      for (const Session* session : context_->directory->in_room(room))
        members.insert(session->identity().subject.name);
      kept.members.assign(members.begin(), members.end());
    }
    if (const auto wind = context_->winds.find(room); wind != context_->winds.end())
      kept.wind = wire::encode_packet({0, wire::SetWind{wind->second.wind}});
  }
  std::size_t left_out = 0;
  std::string text = to_value(kept, left_out);
  context_->counters.kept_left_out.add(left_out);
  if (left_out > 0) spdlog::warn("event=room_kept_in_part room={} left_out={}", log_text(room), left_out);
  context_->fleet->keep(room, std::move(text), now_ns);
}

}  // namespace hairnet::server
