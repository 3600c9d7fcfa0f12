#include "tests/whole/settled.hpp"

#include <set>

namespace hairnet::whole {
namespace {

using Players = std::span<const std::unique_ptr<Player>>;

std::string name_of(LevelIndex level) {
  return std::string(kLevelNames[static_cast<std::size_t>(level)]);
}

// The characters that the players of a room have, by the players' own account.
std::set<server::CharacterKey> keys_of(const std::string& room, Players players) {
  std::set<server::CharacterKey> keys;
  for (const auto& player : players) {
    if (player->plan().room != room) continue;
    const auto own = player->keys();
    keys.insert(own.begin(), own.end());
  }
  return keys;
}

}  // namespace

std::string unsettled(Players players, const std::map<std::string, Vec3>& winds_m_per_s) {
  for (const auto& player : players) {
    if (!player->is_active()) return player->name() + " is not active";
  }
  for (const auto& player : players) {
    std::set<server::CharacterKey> seen;
    for (const auto& [number, member] : player->members()) {
      if (!seen.insert(member.key).second) return player->name() + " knows a character as two members";
      if (member.own && !player->characters().contains(server::number_of(member.key)))
        return player->name() + " has a character that it removed";
    }
    const auto wind = winds_m_per_s.find(player->plan().room);
    const Vec3 wind_m_per_s = wind == winds_m_per_s.end() ? Vec3::Zero() : wind->second;
    if (!player->room_wind() || player->room_wind()->mean_m_per_s != wind_m_per_s)
      return player->name() + " does not know the wind of its room";
    if (const std::string touch = player->known_touch(); !touch.empty())
      return player->name() + " " + touch + " where all touching has ended";
    for (const auto& other : players) {
      // Bad clients may have set props, too.
      if (other->plan().room == player->plan().room && other->room_props() != player->room_props())
        return player->name() + " knows other props than " + other->name();
    }
    const auto expected = keys_of(player->plan().room, players);
    if (seen != expected)
      return player->name() + " knows " + std::to_string(seen.size()) + " members where there are " +
             std::to_string(expected.size());
    for (const auto& [number, member] : player->members()) {
      const std::string which = " of member " + std::to_string(number);
      if (member.frames == 0) return player->name() + " has no frame" + which;
      // The client may not have noticed the loss of its connection yet.
      if (member.last_ns < player->calm_since_ns()) return player->name() + " has no frame since all is calm" + which;
      for (const auto& other : players) {
        if (other->plan().room != player->plan().room || other->session() != server::session_of(member.key)) continue;
        const Player::Character& character = other->characters().at(server::number_of(member.key));
        if (!member.own && (member.tag != character.tag || member.appearance != character.appearance))
          return player->name() + " does not know the newest tag and appearance" + which;
        // It has low where nothing is learnt, or the network does not hold.
        const LevelIndex wanted = character.level == LevelIndex::learnt ? LevelIndex::low : character.level;
        if ((member.level == LevelIndex::rigid) != (wanted == LevelIndex::rigid) || member.level < wanted)
          return player->name() + " has frames on level " + name_of(member.level) + ", where " + name_of(wanted) +
                 " is wanted," + which;
      }
    }
  }
  return {};
}

}  // namespace hairnet::whole
