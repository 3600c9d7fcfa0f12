#pragma once

#include <memory>
#include <string>
#include <vector>

#include "tests/unit/server/session_fixture.hpp"

namespace hairnet::server {

// The present time of the tests and the end of their tokens, in seconds since 1970.
inline constexpr std::int64_t kUnixNow_s = 1000, kUnixEnd_s = 2000;

// Sessions of a server that needs tokens, in a registry. A token is valid until kUnixEnd_s. A client's address is ""
// when the limits of one address do not apply to it; otherwise its sessions count for the address.
class SubjectTest : public SessionTest {
 protected:
  struct Client {
    std::shared_ptr<FakeConnection> connection = std::make_shared<FakeConnection>();
    PacketSink* sink = nullptr;
    [[nodiscard]] bool is_welcome() const { return connection->all<wire::Welcome>().size() == 1; }
    [[nodiscard]] wire::Welcome welcome() const { return connection->all<wire::Welcome>().at(0); }
    [[nodiscard]] std::vector<wire::ErrorReason> errors() const {
      std::vector<wire::ErrorReason> reasons;
      for (const auto& error : connection->all<wire::Error>()) reasons.push_back(error.reason);
      return reasons;
    }
    [[nodiscard]] std::vector<wire::GoodbyeReason> goodbyes() const {
      std::vector<wire::GoodbyeReason> reasons;
      for (const auto& goodbye : connection->all<wire::Goodbye>()) reasons.push_back(goodbye.reason);
      return reasons;
    }
  };

  SubjectTest() {
    // Any key does. The limits are larger than SessionTest's, so that only those that a test sets are reached.
    context_.token_key.emplace(std::vector<std::uint8_t>(32, 7));
    context_.unix_time_s = [this] { return unix_s_; };
    context_.limits.session_count_max = context_.limits.character_count_max = 100;
    context_.limits.characters_per_session_max = 10;
    context_.limits.messages_burst = 1000;
  }
  // The claims of a token of this subject, which allows everything until kUnixEnd_s. An empty subject: the token names
  // nobody.
  static channel::TokenClaims claims(const std::string& subject) {
    channel::TokenClaims claims;
    claims.subject = subject;
    claims.expires_s = kUnixEnd_s;
    return claims;
  }
  // Connects from `address`, and sends the hello. The client is not welcome if the server refuses it.
  Client connect(const wire::Hello& hello, const std::string& address = "") {
    Client client;
    client.connection->address = address;
    client.sink = registry_.open(client.connection, now_ns_);
    send(client, hello);
    return client;
  }
  [[nodiscard]] wire::Hello hello_with(const channel::TokenClaims& claims) const {
    wire::Hello hello;
    hello.token = channel::sign(claims, *context_.token_key);
    hello.role = claims.role;
    return hello;
  }
  Client join(const channel::TokenClaims& claims, const std::string& address = "") {
    return connect(hello_with(claims), address);
  }
  // Joins without a token. From this call on the server needs no tokens.
  Client join_without_token(const std::string& address) {
    context_.token_key.reset();
    return connect(wire::Hello{}, address);
  }
  // Connects again, and asks for the session of `client` with its secret.
  Client resume(const Client& client, wire::Hello hello, const std::string& address = "") {
    hello.session = client.welcome().session;
    hello.secret = client.welcome().secret;
    return connect(hello, address);
  }
  void send(Client& client, const wire::Message& message) {
    client.sink->on_packet(wire::encode_packet({now_ns_, message}), now_ns_);
  }
  void add(Client& client, std::uint32_t character) {
    send(client, wire::AddCharacter{character, groom_service_.known, LevelIndex::low});
  }
  // The session becomes detached; leave() ends it.
  void break_connection(Client& client) { client.sink->on_closed("reset", now_ns_); }
  void leave(Client& client) { send(client, wire::Goodbye{wire::GoodbyeReason::client_leaves, ""}); }
  // The registry checks tokens and rules once a second.
  void poll_next_second() {
    now_ns_ += kSecond_ns;
    registry_.poll(now_ns_);
  }

  std::int64_t unix_s_ = kUnixNow_s;
  SessionRegistry registry_{context_};
};

}  // namespace hairnet::server
