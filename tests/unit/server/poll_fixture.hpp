#pragma once

#include <gtest/gtest.h>

#include <memory>
#include <string>
#include <vector>

#include "schema/wire/groom_file.hpp"
#include "tests/unit/server/build_quickly.hpp"
#include "tests/unit/server/fake_client.hpp"
#include "tests/unit/server/small_groom.hpp"

namespace hairnet::server {

inline constexpr std::int64_t kMs = 1'000'000;
inline constexpr std::int64_t kStart_ns = 1'000'000'000'000;

// The head turns about the vertical and sways.
inline Pose moving_pose(std::int64_t at_ns, double phase_s = 0) {
  const double t = static_cast<double>(at_ns - kStart_ns) * 1e-9 + phase_s;
  return rigid_pose({Quat(Eigen::AngleAxisd(0.6 * std::sin(5 * t), Vec3::UnitY())), {0.1 * std::sin(3 * t), 1.6, 0}});
}

// The whole server on the test's thread, without a socket. Time passes only in run_ms().
class PollTest : public testing::Test {
 protected:
  // Ends the server that runs, and starts one.
  void start(Config config = {}) {
    config.workers = 2;
    server_.reset();
    auto created = Server::create(config, metrics_, now_ns_, nullptr, build_, {}, learn_);
    ASSERT_TRUE(created) << created.error();
    server_ = std::move(*created);
  }
  // Runs the server for `count` milliseconds; each client sends a pose of its character 1 every 15 ms.
  void run_ms(int count, const std::vector<FakeClient*>& senders = {}) {
    for (int i = 0; i < count; ++i) {
      now_ns_ += kMs;
      for (std::size_t c = 0; i % 15 == 0 && c < senders.size(); ++c)
        senders[c]->pose(1, moving_pose(now_ns_, static_cast<double>(c)), now_ns_);
      server_->poll(now_ns_);
    }
  }
  // Joins the room, uploads the small groom and adds character 1. The character has no frames before its first pose.
  void add(FakeClient& client, LevelIndex level = LevelIndex::low, const std::string& room = "") {
    client.hello(now_ns_, room);
    client.upload(bytes_, hash_, now_ns_);
    client.send(wire::AddCharacter{1, hash_, level}, now_ns_);
  }
  std::unique_ptr<FakeClient> join(const std::string& room = "", LevelIndex level = LevelIndex::low) {
    auto client = std::make_unique<FakeClient>(*server_, now_ns_);
    add(*client, level, room);
    return client;
  }

  BuildLevels build_ = build_quickly;
  // Hair is learnt only where Config says so.
  LearnHair learn_ = learn_hair_in_process;
  Metrics metrics_;
  std::int64_t now_ns_ = kStart_ns;
  std::vector<std::uint8_t> bytes_ = wire::encode_groom(small_groom());
  wire::GroomHash hash_ = wire::hash_groom(bytes_);
  std::unique_ptr<Server> server_;
};

}  // namespace hairnet::server
