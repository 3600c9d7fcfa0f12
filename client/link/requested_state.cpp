#include "client/link/requested_state.hpp"

#include <algorithm>
#include <utility>

#include "core/assert.hpp"

namespace hairnet::link {

void RequestedState::offer(const wire::GroomHash& hash, Bytes bytes) {
  HAIRNET_ASSERT(bytes);
  grooms_.try_emplace(hash, Offered{std::move(bytes), false});
}

void RequestedState::store(const wire::ClientMessage& message) {
  if (const auto* added = std::get_if<wire::AddCharacter>(&message)) return add(*added);
  if (const auto* removed = std::get_if<wire::RemoveCharacter>(&message)) return remove(removed->character);
  if (const auto* wanted = std::get_if<wire::SetLevel>(&message)) return set_level(*wanted);
  if (const auto* set = std::get_if<wire::SetAppearance>(&message)) {
    // A new server must announce the character with the newest appearance.
    if (Character* character = find(set->character)) {
      character->added.tag = set->tag;
      character->added.appearance = set->appearance;
    }
  }
  // A message type states by kResent whether it is sent again after a reconnect, and whether it belongs to the session
  // or to one character. Each type keeps the newest message alone.
  const auto store_setting = [&]<class M>(const M& m) {
    if constexpr (requires { requires M::kResent == wire::Resent::per_session; }) {
      settings_[message.index()] = m;
    } else if constexpr (requires { requires M::kResent == wire::Resent::per_character; }) {
      if (Character* character = find(m.character)) character->settings[message.index()] = m;
    }
  };
  std::visit(store_setting, message);
}

void RequestedState::store(std::span<const wire::PoseSample> poses) {
  for (const wire::PoseSample& sample : poses) {
    if (Character* character = find(sample.character)) character->pose = sample;
  }
}

RequestedState::Character* RequestedState::find(std::uint32_t character) {
  const auto found = characters_.find(character);
  return found == characters_.end() ? nullptr : &found->second;
}

void RequestedState::add(const wire::AddCharacter& added) {
  // A number that is used again is a new character, whose errors are its own.
  sent_twice_.erase(added.character);
  characters_[added.character] = {added, {}, false, {}};
}

void RequestedState::remove(std::uint32_t character) {
  characters_.erase(character);
  leaving_.insert(character);
}

void RequestedState::set_level(const wire::SetLevel& wanted) {
  if (Character* character = find(wanted.character)) character->added.level = wanted.level;
  // Rigid hair has no motion to continue.
  if (wanted.level == LevelIndex::rigid) forget_state(wanted.character);
}

void RequestedState::remember(std::uint32_t character, wire::HairState state) {
  HAIRNET_ASSERT(wire::validate(state).empty());
  if (Character* known = find(character)) known->added.state = std::move(state);
}

void RequestedState::forget_state(std::uint32_t character) {
  if (Character* known = find(character)) known->added.state.reset();
}

void RequestedState::on_ready(const wire::GroomHash& hash) {
  if (const auto found = grooms_.find(hash); found != grooms_.end()) found->second.ready = true;
}

void RequestedState::on_added(std::uint32_t character) {
  if (Character* known = find(character)) known->confirmed = true;
}

bool RequestedState::on_error(const wire::Error& error) {
  if (error.character == 0) return false;
  if (error.reason == wire::ErrorReason::character_unknown) return leaving_.erase(error.character) != 0;
  // The first AddCharacter had arrived before the connection broke. Its second one is refused, and the character is
  // there.
  if (error.reason != wire::ErrorReason::character_exists || sent_twice_.erase(error.character) == 0) return false;
  on_added(error.character);
  return true;
}

void RequestedState::forget_sessions() {
  for (auto& [number, character] : characters_) {
    for (auto& [kind, message] : character.settings) {
      // The rule itself stays: without the names it is the stricter one.
      if (auto* touch = std::get_if<wire::SetTouch>(&message)) touch->chosen.clear();
    }
  }
}

RequestedState::Resend RequestedState::take_resend(bool resumed) {
  HAIRNET_VALIDATE(std::ranges::all_of(characters_, [](const auto& c) { return c.first == c.second.added.character; }));
  Resend resend;
  sent_twice_.clear();
  for (auto& [hash, groom] : grooms_) {
    groom.ready = groom.ready && resumed;
    if (!groom.ready) resend.offers.emplace_back(hash, groom.bytes);
  }
  // A new session has no characters to remove.
  if (!resumed) leaving_.clear();
  for (const std::uint32_t character : leaving_) resend.messages.push_back(wire::RemoveCharacter{character});
  for (auto& [number, character] : characters_) {
    character.confirmed = character.confirmed && resumed;
    if (!character.confirmed) {
      // The AddCharacter comes before the settings of its character, which the server refuses for a number that it does
      // not know.
      resend.messages.push_back(character.added);
      if (resumed) sent_twice_.insert(number);
    }
    // The server may have added it before the connection broke, with an older level.
    if (resumed) resend.messages.push_back(wire::SetLevel{number, character.added.level});
    for (const auto& [kind, message] : character.settings) resend.messages.push_back(message);
    // A resumed session still has its last pose. A new one shows nothing before its first, and the program may push the
    // next one late.
    if (!resumed && character.pose) resend.poses.push_back(*character.pose);
  }
  for (const auto& [kind, message] : settings_) resend.messages.push_back(message);
  return resend;
}

}  // namespace hairnet::link
