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
  // The newest message of each kind, by its index in wire::ClientMessage.
  using Settings = std::map<std::size_t, wire::ClientMessage>;
  struct Character {
    // The request to add it, with the newest level, tag and appearance, and with the state from which a new server
    // continues its hair.
    wire::AddCharacter added;
    // The messages whose kResent is Resent::per_character.
    Settings settings;
    // The server has answered with CharacterAdded.
    bool confirmed = false;
    // The newest pose.
    std::optional<wire::PoseSample> pose = {};
  };

  // Stores the groom until the server refuses it.
  void offer(const wire::GroomHash& hash, Bytes bytes);
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
  // Returns true for an error that the caller must not see: it answers a message that was sent twice, because the
  // connection broke after the server had received the first one.
  bool on_error(const wire::Error& error);

  // Forgets the sessions that the caller has named: another server gives their numbers to others.
  void forget_sessions();

  // The messages to send again after the welcome of a new connection: first the offers, then the messages, and the
  // poses last. `resumed`: the server still has what it has confirmed.
  struct Resend {
    std::vector<std::pair<wire::GroomHash, Bytes>> offers;
    std::vector<wire::ClientMessage> messages;
    std::vector<wire::PoseSample> poses;
  };
  Resend take_resend(bool resumed);

  [[nodiscard]] const std::map<std::uint32_t, Character>& characters() const { return characters_; }
  // Whether the character was added, and its removal is not confirmed yet.
  [[nodiscard]] bool has_asked_for(std::uint32_t character) const {
    return characters_.contains(character) || leaving_.contains(character);
  }

 private:
  struct Offered {
    Bytes bytes;
    // The server has the whole groom.
    bool ready = false;
  };
  // Returns null where there is no such character.
  Character* find(std::uint32_t character);
  void add(const wire::AddCharacter& added);
  void remove(std::uint32_t character);
  void set_level(const wire::SetLevel& wanted);

  // The grooms that the caller has offered.
  std::map<wire::GroomHash, Offered> grooms_;
  // The characters that the caller has added and not removed, by their number.
  std::map<std::uint32_t, Character> characters_;
  // The characters whose removal the server has not confirmed.
  std::set<std::uint32_t> leaving_;
  // Characters whose AddCharacter was sent twice. The server may announce one and then refuse its second AddCharacter.
  std::set<std::uint32_t> sent_twice_;
  // The messages whose kResent is Resent::per_session.
  Settings settings_;
};

}  // namespace hairnet::link
