#pragma once

#include <cstdint>
#include <map>
#include <memory>
#include <optional>
#include <set>
#include <utility>
#include <vector>

#include "schema/wire/messages.hpp"

namespace hairnet::link {

// What a client has asked for and what of it the server has confirmed, so that all of it can be said again over a new
// connection. No I/O; one thread.
class Roster {
 public:
  using Bytes = std::shared_ptr<const std::vector<std::uint8_t>>;
  struct Character {
    wire::GroomHash groom{};
    LevelIndex level = LevelIndex::high;
    std::optional<MaterialScale> material;
    bool confirmed = false;  // CharacterAdded has come
  };

  void offer(const wire::GroomHash& hash, Bytes bytes);  // kept until the groom is refused
  void add(const wire::AddCharacter& added);
  void set_level(const wire::SetLevel& wanted);
  void set_material(const wire::SetMaterial& wanted);
  void set_wind(const wire::SetWind& wanted) { wind_ = wanted; }
  void observe(wire::Observe wanted) { observe_ = std::move(wanted); }
  void remove(std::uint32_t character);
  // The hair of a character is to go on from there, should the server have forgotten it.
  void remember(std::uint32_t character, wire::HairState state);
  void forget_state(std::uint32_t character) { states_.erase(character); }

  void on_ready(const wire::GroomHash& hash);
  void on_refused(const wire::GroomHash& hash) { grooms_.erase(hash); }
  void on_added(std::uint32_t character);
  void on_removed(std::uint32_t character) { leaving_.erase(character); }
  // True for an error that only says that the message had arrived before the connection broke, and was said twice.
  bool on_error(const wire::Error& error);

  // A new connection has its welcome. `resumed`: the server still has what it confirmed. Returns what is to be said.
  struct Again {
    std::vector<std::pair<wire::GroomHash, Bytes>> offers;  // first
    std::vector<wire::Message> messages;
  };
  Again say_again(bool resumed);

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
  std::map<wire::GroomHash, Offered> grooms_;
  std::map<std::uint32_t, Character> characters_;
  std::map<std::uint32_t, wire::HairState> states_;  // as it was when the connection broke, or as it was added with
  std::set<std::uint32_t> leaving_;                  // removed, and not confirmed
  // Characters of which the server may have heard already; it may tell of them before it refuses them.
  std::set<std::uint32_t> said_twice_;
  std::optional<wire::SetWind> wind_;
  std::optional<wire::Observe> observe_;
};

}  // namespace hairnet::link
