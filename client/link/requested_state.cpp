#include "client/link/requested_state.hpp"

#include <utility>

namespace hairnet::link {

void RequestedState::offer(const wire::GroomHash& hash, Bytes bytes) {
  grooms_.try_emplace(hash, Offered{std::move(bytes), false});
}

void RequestedState::add(const wire::AddCharacter& added) {
  sent_twice_.erase(added.character);
  characters_[added.character] = {added.groom, added.level, {}, false};
  states_.erase(added.character);
  if (added.state) states_[added.character] = *added.state;
}

void RequestedState::set_level(const wire::SetLevel& wanted) {
  if (const auto found = characters_.find(wanted.character); found != characters_.end())
    found->second.level = wanted.level;
  if (wanted.level == LevelIndex::rigid) states_.erase(wanted.character);
}

void RequestedState::set_material(const wire::SetMaterial& wanted) {
  if (const auto found = characters_.find(wanted.character); found != characters_.end())
    found->second.material = wanted.scale;
}

void RequestedState::remove(std::uint32_t character) {
  characters_.erase(character);
  states_.erase(character);
  leaving_.insert(character);
}

void RequestedState::remember(std::uint32_t character, wire::HairState state) {
  if (characters_.contains(character)) states_[character] = std::move(state);
}

void RequestedState::on_ready(const wire::GroomHash& hash) {
  if (const auto found = grooms_.find(hash); found != grooms_.end()) found->second.ready = true;
}

void RequestedState::on_added(std::uint32_t character) {
  if (const auto found = characters_.find(character); found != characters_.end()) found->second.confirmed = true;
}

bool RequestedState::on_error(const wire::Error& error) {
  if (error.character == 0) return false;
  if (error.reason == wire::ErrorReason::character_unknown) return leaving_.erase(error.character) != 0;
  if (error.reason != wire::ErrorReason::character_exists || sent_twice_.erase(error.character) == 0) return false;
  on_added(error.character);
  return true;
}

RequestedState::Resend RequestedState::take_resend(bool resumed) {
  Resend resend;
  sent_twice_.clear();
  for (auto& [hash, groom] : grooms_) {
    groom.ready = groom.ready && resumed;
    if (!groom.ready) resend.offers.emplace_back(hash, groom.bytes);
  }
  if (!resumed) leaving_.clear();
  for (const std::uint32_t character : leaving_) resend.messages.push_back(wire::RemoveCharacter{character});
  for (auto& [number, character] : characters_) {
    character.confirmed = character.confirmed && resumed;
    if (!character.confirmed) {
      wire::AddCharacter add{number, character.groom, character.level, {}};
      if (const auto state = states_.find(number); state != states_.end()) add.state = state->second;
      resend.messages.push_back(std::move(add));
      if (resumed) sent_twice_.insert(number);
    }
    // The server may have added it before the connection broke, with an older level.
    if (resumed) resend.messages.push_back(wire::SetLevel{number, character.level});
    if (character.material) resend.messages.push_back(wire::SetMaterial{number, *character.material});
  }
  if (wind_) resend.messages.push_back(*wind_);
  if (observe_) resend.messages.push_back(*observe_);
  return resend;
}

}  // namespace hairnet::link
