#pragma once

#include <memory>
#include <utility>
#include <vector>

#include "tests/unit/client/link_core_driver.hpp"

namespace hairnet::link {

inline RequestedState::Bytes ten_bytes() {
  return std::make_shared<const std::vector<std::uint8_t>>(10);
}

// Starts every test with a client in session 5. Its one groom, hash_of(1), and its one character, number 7 and member
// 31 at level low, are confirmed by the server. All events are taken.
class Settled : public ::testing::Test {
 protected:
  explicit Settled(LinkCoreOptions options = {}) : d(std::move(options)) {
    d.connect(welcome_to(5));
    d.core.offer_groom(hash_of(1), ten_bytes());
    d.core.send(wire::AddCharacter{7, hash_of(1), LevelIndex::low});
    d.take_all();
    d.send(wire::GroomStatus{hash_of(1), wire::GroomState::ready});
    d.send(wire::CharacterAdded{7, hash_of(1), LevelIndex::low, 31});
    d.core.take_events();
  }
  // Ends the connection as a pulled cable does. "the cable" is the reason that Reconnecting then names.
  void break_off() { d.core.on_closed("the cable", d.now_ns); }
  // Waits until the client connects again, stores its Hello and answers with this welcome. A welcome to session 5
  // with `resumed` continues the session; another session means a server that knows nothing of the client.
  void come_back(const wire::Welcome& welcome) {
    d.open();
    hello = d.expect<wire::Hello>();
    d.send(welcome);
  }

  LinkCoreDriver d;
  wire::Hello hello;
};

}  // namespace hairnet::link
