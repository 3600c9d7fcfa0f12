#pragma once

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <atomic>
#include <map>
#include <memory>
#include <utility>
#include <vector>

#include "server/session/session.hpp"
#include "server/session/session_registry.hpp"
#include "tests/unit/server/fake_connection.hpp"

namespace hairnet::server {

inline constexpr std::int64_t kSecond_ns = 1'000'000'000;

// A store of grooms with `known` in memory and `kept` on disk. It refuses every uploaded chunk.
class FakeGroomService final : public GroomService {
 public:
  void open(SessionId session, const GroomShare& share, std::int64_t) override {
    strands_max[session] = share.strand_count_max;
    token_holders[session] = share.token_holder;
  }
  Refused offer(SessionId, const wire::GroomOffer&, std::int64_t) override { return {}; }
  ChunkAnswer chunk(SessionId, wire::GroomChunk, std::int64_t) override {
    return {{wire::ErrorReason::unexpected_message, "not asked for"}};
  }
  Refused retain(SessionId, const wire::GroomHash& groom, std::int64_t) override {
    return groom == known ? Refused{} : Refused{wire::ErrorReason::groom_unknown, "offer it first"};
  }
  void resend_states(SessionId session, std::int64_t) override { resent.push_back(session); }
  std::shared_ptr<const std::vector<std::uint8_t>> bytes(const wire::GroomHash& groom) override {
    const auto found = more.find(groom);
    return groom == known ? file : found == more.end() ? nullptr : found->second;
  }
  bool fetch(SessionId session, const wire::GroomHash& groom) override {
    if (groom != kept) return false;
    fetched.push_back(session);
    return true;
  }
  [[nodiscard]] bool is_cached(const wire::GroomHash& groom) const override { return groom == kept; }
  [[nodiscard]] std::vector<wire::GroomHash> in_use() const override { return used; }
  void release(SessionId session, std::int64_t) override { released.push_back(session); }

  std::vector<wire::GroomHash> used;
  wire::GroomHash known{1}, kept{2};
  // More grooms in memory, beside `known`.
  std::map<wire::GroomHash, std::shared_ptr<const std::vector<std::uint8_t>>> more;
  std::vector<SessionId> released, resent, fetched;
  std::map<SessionId, std::uint64_t> strands_max;
  std::map<SessionId, std::uint32_t> token_holders;
  std::shared_ptr<const std::vector<std::uint8_t>> file =
      std::make_shared<const std::vector<std::uint8_t>>(200'000, std::uint8_t{7});
};

// A session over a fake connection. Its limits are small, so that tests reach them, and time passes only when a test
// adds to now_ns_.
class SessionTest : public testing::Test {
 protected:
  void send(const wire::Message& message) { session_.on_message({now_ns_, message}, now_ns_); }
  void hello() { send(wire::Hello{wire::kProtocolVersion, "test", "", "", wire::Role::participant, 0, {}}); }
  [[nodiscard]] std::vector<wire::ErrorReason> errors() const {
    std::vector<wire::ErrorReason> reasons;
    for (const auto& error : connection_->all<wire::Error>()) reasons.push_back(error.reason);
    return reasons;
  }
  [[nodiscard]] std::vector<wire::GoodbyeReason> goodbyes() const {
    std::vector<wire::GoodbyeReason> reasons;
    for (const auto& goodbye : connection_->all<wire::Goodbye>()) reasons.push_back(goodbye.reason);
    return reasons;
  }
  // Returns the messages of type T that the session has passed on to the tick since the last call. The other commands
  // that waited are dropped.
  template <class T>
  std::vector<T> requests() {
    std::vector<T> found;
    for (FromClient& command : commands<FromClient>()) {
      if (T* message = std::get_if<T>(&command.message)) found.push_back(std::move(*message));
    }
    return found;
  }
  // Does the same for commands of type T.
  template <class T>
  std::vector<T> commands() {
    std::vector<Command> taken;
    commands_.take_all(taken);
    std::vector<T> found;
    for (Command& command : taken) {
      if (T* c = std::get_if<T>(&command)) found.push_back(std::move(*c));
    }
    return found;
  }
  static SessionLimits small_limits() {
    SessionLimits limits;
    limits.session_count_max = 2;
    limits.character_count_max = 3;
    limits.characters_per_session_max = 2;
    limits.messages_per_s = 10;
    limits.messages_burst = 40;
    limits.poses_per_s = 100;
    limits.poses_burst = 100;
    return limits;
  }
  static wire::PoseBatch one_pose(const Pose& pose, std::int64_t at_ns, std::uint32_t character = 1) {
    return {{{character, 1, at_ns, false, pose}}};
  }

  // Further sessions that a test opens stay open until its end.
  std::vector<std::unique_ptr<Session>> kept_;
  SessionCounters counters_;
  CommandQueue commands_{1000};
  FakeGroomService groom_service_;
  std::atomic<std::uint64_t> tick_{42};
  // The server runs 30 ticks a second, takes grooms of up to 1 MiB, and is at tick 42.
  SessionContext context_{small_limits(), counters_, commands_, groom_service_, 30, 1 << 20, tick_};
  std::int64_t now_ns_ = 100 * kSecond_ns;
  std::shared_ptr<FakeConnection> connection_ = std::make_shared<FakeConnection>();
  // The session under test, with the ID 7.
  Session session_{7, connection_, context_, now_ns_};
};

}  // namespace hairnet::server
