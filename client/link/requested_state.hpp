#pragma once

#include <cstdint>
#include <map>
#include <memory>
#include <optional>
#include <set>
#include <span>
#include <utility>
#include <vector>

#include "schema/wire/messages.hpp"

namespace hairnet::link {

// Everything that this client has requested (grooms, characters, levels, ...) and which of it the server has
// confirmed, so that all of it can be sent again over a new connection. No I/O; one thread.
class RequestedState {
 public:
  using Bytes = std::shared_ptr<const std::vector<std::uint8_t>>;
  using Settings = std::map<std::size_t, wire::ClientMessage>;  // the newest of each kind, by its index
  struct Character {
    wire::AddCharacter added;  // with its newest level, and the state from which a new server continues its hair
    Settings settings;         // those of Resent::per_character
    bool confirmed = false;    // CharacterAdded has come
    std::optional<wire::PoseSample> pose = {};  // the newest
  };

  void offer(const wire::GroomHash& hash, Bytes bytes);  // kept until the groom is refused
  // Stores what the message changes: the characters and their levels, and every message that has a kResent.
  void store(const wire::ClientMessage& message);
  // Stores the newest pose of each character: a new server shows the character before its next one.
  void store(std::span<const wire::PoseSample> poses);
  // Stores the state from which a new server continues the hair of the character.
  void remember(std::uint32_t character, wire::HairState state);
  void forget_state(std::uint32_t character);

  void on_ready(const wire::GroomHash& hash);
  void on_refused(const wire::GroomHash& hash) { grooms_.erase(hash); }
  void on_added(std::uint32_t character);
  void on_removed(std::uint32_t character) { leaving_.erase(character); }
  // True for an error that the caller must not see: it answers a message that was sent twice, because the connection
  // broke after the server had received the first.
  bool on_error(const wire::Error& error);

  // Forgets the sessions that the caller has named: another server gives their numbers to others.
  void forget_sessions();

  // The messages to send again after the welcome of a new connection. `resumed`: the server still has what it has
  // confirmed.
  struct Resend {
    std::vector<std::pair<wire::GroomHash, Bytes>> offers;  // first
    std::vector<wire::ClientMessage> messages;
    std::vector<wire::PoseSample> poses;  // last
  };
  Resend take_resend(bool resumed);

  [[nodiscard]] const std::map<std::uint32_t, Character>& characters() const { return characters_; }
  // Its removal may not be confirmed yet.
  [[nodiscard]] bool has_asked_for(std::uint32_t character) const {
    return characters_.contains(character) || leaving_.contains(character);
  }

 private:
  struct Offered {
    Bytes bytes;
    bool ready = false;
  };
  Character* find(std::uint32_t character);  // null: not there
  void add(const wire::AddCharacter& added);
  void remove(std::uint32_t character);
  void set_level(const wire::SetLevel& wanted);

  std::map<wire::GroomHash, Offered> grooms_;
  std::map<std::uint32_t, Character> characters_;
  std::set<std::uint32_t> leaving_;  // removed, and not confirmed
  // Characters whose AddCharacter was sent twice. The server may announce one and then refuse its second AddCharacter.
  std::set<std::uint32_t> sent_twice_;
  Settings settings_;  // those of Resent::per_session
};

}  // namespace hairnet::link
