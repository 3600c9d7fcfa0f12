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
// A ban in etcd may end in the year 9999, which overflows in nanoseconds. Ten years are enough.
constexpr std::int64_t kBan_s_max = 10LL * 365 * 24 * 3600;

// Whether the content of a decoded message is within its limits, as session_messages.cpp checks it for clients.
bool is_valid(const wire::SetWind& set) {
  return validate(set.wind).empty();
}
bool is_valid(const wire::SetProps& set) {
  return std::ranges::all_of(set.props, [](const wire::Prop& prop) { return wire::validate(prop).empty(); });
}

// Decodes the message that a packet sets; none where the packet is empty or not valid. Wind and props are kept as
// packets of the protocol, so that one decoder and one validation serve clients and etcd.
template <class Message>
std::optional<Message> read_kept(const std::vector<std::uint8_t>& packet) {
  if (packet.empty()) return std::nullopt;
  wire::DecodedPacket decoded = wire::decode_packet(packet);
  const auto* set = std::get_if<Message>(&decoded.envelope.message);
  if (decoded.error != wire::DecodeError::none || !set || !is_valid(*set)) return std::nullopt;
  return *set;
}

}  // namespace

void RoomKeeper::take(const std::string& room, const std::string& text, std::int64_t now_ns) {
  // The room was this server's a moment ago, before it lost its lease. What has changed since is not in the text, so
  // the server's own state is newer and stays.
  if (context_->rooms_changed.contains(room)) return;
  // What this server may still know of the room from an earlier time is replaced in whole, or a ban that was lifted
  // elsewhere would come back.
  RoomRules::OfRoom rules;
  context_->winds.erase(room);
  context_->props.forget(room);
  if (!text.empty()) {
    const Result<RoomKept> kept = parse_kept(text);
    std::string wrong = kept ? "" : kept.error();
    if (kept) {
      const auto wind = read_kept<wire::SetWind>(kept->wind);
      if (wind) context_->winds[room] = {wind->wind};
      if (!wind && !kept->wind.empty()) wrong = "its wind is not valid";
      const auto props = read_kept<wire::SetProps>(kept->props);
      if (props) context_->props.set(room, *props, context_->limits.room_count_max);
      if (!props && !kept->props.empty()) wrong = "its props are not valid";
      // Bans travel in seconds since 1970, because the monotonic clocks of two servers have nothing in common.
      const std::int64_t unix_s = context_->unix_time_s();
      for (const RoomKept::Ban& ban : kept->bans)
        if (ban.until_s > unix_s)
          rules.bans.emplace_back(ban.subject, now_ns + std::min(ban.until_s - unix_s, kBan_s_max) * kSecond_ns);
      rules.mutes = kept->mutes;
      rules.is_locked = kept->is_locked;
      rules.returning = kept->members;
    }
    if (!wrong.empty()) {
      context_->counters.rooms_kept_refused.add();
      spdlog::warn("event=room_kept_refused room={} detail={}", log_text(room), log_text(wrong));
    }
  }
  // The members of a locked room must get back in, though the lock keeps everyone else out.
  rules.return_until_ns = now_ns + kReturn_ns;
  const std::size_t left_out = context_->rules.replace(room, rules, now_ns, context_->limits.bans_max);
  context_->counters.kept_left_out.add(left_out);
  if (left_out > 0) spdlog::warn("event=room_kept_in_part room={} left_out={}", log_text(room), left_out);
}

void RoomKeeper::keep_changed(std::int64_t now_ns) {
  // The set is emptied first: a room that changes during the loop is written the next time.
  for (const std::string& room : std::exchange(context_->rooms_changed, {})) keep(room, false, now_ns);
}

void RoomKeeper::end(const std::string& room, std::int64_t now_ns) {
  context_->rooms_changed.erase(room);
  keep(room, true, now_ns);
  context_->winds.erase(room);
  context_->props.forget(room);
}

void RoomKeeper::keep(const std::string& room, bool has_ended, std::int64_t now_ns) {
  RoomRules::OfRoom rules = context_->rules.of_room(room, now_ns);
  RoomKept kept;
  // The longest bans come first: to_value() takes bans in this order while they fit into the text.
  std::ranges::sort(rules.bans, std::ranges::greater(),
                    [](const auto& ban) { return std::pair(ban.second, ban.first); });
  const std::int64_t unix_s = context_->unix_time_s();
  // The seconds are rounded up, so that a ban that moves does not end early.
  for (const auto& [subject, until_ns] : rules.bans)
    kept.bans.push_back({subject, unix_s + (until_ns - now_ns + kSecond_ns - 1) / kSecond_ns});
  // A room that has ended keeps its bans only. Its mutes, lock, wind and props would meet people who have nothing to do
  // with those who set them.
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
    if (context_->props.count(room) > 0)
      kept.props = wire::encode_packet({0, wire::SetProps{context_->props.of_room(room)}});
  }
  std::size_t left_out = 0;
  std::string text = to_value(kept, left_out);
  context_->counters.kept_left_out.add(left_out);
  if (left_out > 0) spdlog::warn("event=room_kept_in_part room={} left_out={}", log_text(room), left_out);
  context_->fleet->keep(room, std::move(text), now_ns);
}

}  // namespace hairnet::server
