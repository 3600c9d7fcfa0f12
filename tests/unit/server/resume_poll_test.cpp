#include <gmock/gmock.h>
#include <gtest/gtest.h>
#include <unistd.h>

#include <filesystem>
#include <fstream>

#include "tests/unit/server/poll_fixture.hpp"

// The whole server without a socket: what outlives a connection, and a restart.
namespace hairnet::server {
namespace {

using testing::Each;
using testing::ElementsAre;
using testing::IsEmpty;
using testing::Not;

class ResumePollTest : public PollTest {
 protected:
  ~ResumePollTest() override { std::filesystem::remove_all(folder_); }
  // The settings of a server with caches, and of its successor.
  [[nodiscard]] Config keeping() const {
    Config config;
    config.groom_cache = folder_;
    config.level_cache = folder_;
    return config;
  }

  std::filesystem::path folder_ =
      std::filesystem::path(testing::TempDir()) / ("resume_poll_" + std::to_string(::getpid()));
};

TEST_F(ResumePollTest, a_session_resumed_in_time_continues_with_its_hair) {
  start();
  const auto first = join();
  const auto other = join();
  run_ms(700, {first.get(), other.get()});
  const auto welcome = first->connection->all<wire::Welcome>().at(0);
  const auto last = first->frames(1).back();
  ASSERT_THAT(last.displacements, testing::Contains(testing::Ne(0)));
  first->break_connection(now_ns_);
  run_ms(100, {other.get()});
  EXPECT_THAT(other->connection->all<wire::MemberLeft>(), IsEmpty());
  const auto before = other->member_frames(last.member).back();
  FakeClient again(*server_, now_ns_);
  again.resume(welcome, now_ns_);
  // The head stands still without new poses, and its hair swings on. A reset would put the hair back to its design.
  run_ms(100, {other.get()});
  const auto resumed = again.frames(1);
  ASSERT_THAT(resumed, Not(IsEmpty()));
  EXPECT_LT(resumed.front().distance_m(before), 0.03f) << "less than hair swings in a tick";
  EXPECT_THAT(resumed.front().displacements, testing::Contains(testing::Ne(0)));
  for (const auto& frame : other->member_frames(last.member)) {
    EXPECT_FALSE(frame.tick > last.tick && frame.discontinuous) << frame.tick;
  }
  run_ms(300, {&again, other.get()});
  ASSERT_EQ(again.connection->all<wire::Welcome>().size(), 1u);
  EXPECT_TRUE(again.connection->all<wire::Welcome>()[0].resumed);
  ASSERT_EQ(again.connection->all<wire::CharacterAdded>().size(), 1u);
  EXPECT_EQ(again.connection->all<wire::CharacterAdded>()[0].member, last.member);
  EXPECT_EQ(again.connection->all<wire::MemberJoined>().size(), 1u);
  ASSERT_THAT(again.frames(1), Not(IsEmpty()));
  EXPECT_EQ(again.frames(1).back().level, LevelIndex::low);
  EXPECT_EQ(metrics_.groom.grooms_uploaded.value(), 1u);
}

TEST_F(ResumePollTest, a_session_not_resumed_leaves_after_its_grace) {
  start();
  const auto first = join();
  const auto other = join();
  run_ms(300, {first.get(), other.get()});
  first->break_connection(now_ns_);
  // A session outlives its connection by 10 s (SessionLimits::resume_grace_ns).
  run_ms(10'100, {other.get()});
  EXPECT_EQ(other->connection->all<wire::MemberLeft>().size(), 1u);
  EXPECT_EQ(server_->session_count(), 1u);
}

TEST_F(ResumePollTest, a_new_server_takes_the_hair_as_its_owner_last_had_it) {
  start();
  const auto client = join();
  run_ms(700, {client.get()});
  const auto last = client->frames(1).back();
  ASSERT_THAT(last.displacements, testing::Contains(testing::Ne(0)));
  start();
  FakeClient again(*server_, now_ns_);
  again.hello(now_ns_);
  again.upload(bytes_, hash_, now_ns_);
  again.send(
      wire::AddCharacter{1, hash_, LevelIndex::low, wire::HairState{FakeClient::kStep_m, last.displacements, {}}},
      now_ns_);
  run_ms(100);
  again.pose(1, last.pose, now_ns_);
  run_ms(100);
  EXPECT_THAT(again.errors(), IsEmpty());
  const auto frames = again.frames(1);
  ASSERT_THAT(frames, Not(IsEmpty()));
  EXPECT_LT(frames.front().distance_m(last), 0.03f) << "less than hair swings in a tick";
  EXPECT_THAT(frames.front().displacements, testing::Contains(testing::Ne(0)));
}

TEST_F(ResumePollTest, hair_brought_is_not_shown_rigid_while_its_levels_are_made) {
  start();
  const auto client = join();
  run_ms(700, {client.get()});
  const auto last = client->frames(1).back();
  // A hair state waits 2 s for levels (kStateWait_s in scheduler.cpp), and then the character enters rigid. The groom
  // arrives before this time, and then after it.
  for (const int upload_ms : {1000, 2500}) {
    start();
    FakeClient again(*server_, now_ns_);
    again.hello(now_ns_);
    again.send(wire::GroomOffer{hash_, bytes_.size()}, now_ns_);
    again.send(
        wire::AddCharacter{1, hash_, LevelIndex::low, wire::HairState{FakeClient::kStep_m, last.displacements, {}}},
        now_ns_);
    run_ms(upload_ms, {&again});
    if (upload_ms < 2000) {
      EXPECT_THAT(again.frames(1), IsEmpty());
    }
    again.upload(bytes_, hash_, now_ns_);
    run_ms(500, {&again});
    const auto frames = again.frames(1);
    ASSERT_THAT(frames, Not(IsEmpty()));
    EXPECT_EQ(frames.front().level, upload_ms < 2000 ? LevelIndex::low : LevelIndex::rigid);
    EXPECT_EQ(frames.back().level, LevelIndex::low);
  }
}

TEST_F(ResumePollTest, a_state_that_does_not_fit_is_refused_and_the_hair_starts_at_rest) {
  start();
  FakeClient client(*server_, now_ns_);
  client.hello(now_ns_);
  client.upload(bytes_, hash_, now_ns_);
  // The state has the displacement of one node, in steps of 0.5 mm. The lattice of the level has many nodes.
  client.send(wire::AddCharacter{1, hash_, LevelIndex::low, wire::HairState{5e-4f, {1, 2, 3}, {}}}, now_ns_);
  run_ms(50);
  client.pose(1, rigid_pose({}), now_ns_);
  run_ms(200);
  EXPECT_THAT(client.errors(), ElementsAre(wire::ErrorReason::state_invalid));
  EXPECT_THAT(client.frames(1).front().displacements, Each(0));
}

TEST_F(ResumePollTest, hair_states_wait_for_their_levels_within_a_bound) {
  Config config;
  config.state_bytes_max = 100;
  start(config);
  FakeClient client(*server_, now_ns_);
  client.hello(now_ns_);
  client.send(wire::GroomOffer{hash_, bytes_.size()}, now_ns_);
  // Each state has 30 integers of 2 bytes, so two of them exceed state_bytes_max.
  const wire::HairState state{5e-4f, std::vector<std::int16_t>(30), {}};
  for (const std::uint32_t character : {1u, 2u})
    client.send(wire::AddCharacter{character, hash_, LevelIndex::low, state}, now_ns_);
  run_ms(50);
  EXPECT_THAT(client.errors(), ElementsAre(wire::ErrorReason::state_invalid));
  EXPECT_EQ(metrics_.tick.hair_states_dropped_full.value(), 1u);
  client.send(wire::RemoveCharacter{1}, now_ns_);
  client.send(wire::AddCharacter{3, hash_, LevelIndex::low, state}, now_ns_);
  run_ms(50);
  EXPECT_EQ(metrics_.tick.hair_states_dropped_full.value(), 1u) << "there is room again";
}

TEST_F(ResumePollTest, after_a_restart_nothing_is_uploaded_or_built_again) {
  start(keeping());
  const auto before = join();
  run_ms(300, {before.get()});
  ASSERT_EQ(before->frames(1).back().level, LevelIndex::low);
  const std::uint64_t uploaded = metrics_.groom.groom_bytes_received.value();
  ASSERT_EQ(uploaded, bytes_.size());
  // The former server ends at once, without draining.
  start(keeping());
  const auto offering = join();
  FakeClient silent(*server_, now_ns_);
  silent.hello(now_ns_);
  silent.send(wire::AddCharacter{1, hash_, LevelIndex::low}, now_ns_);
  run_ms(300, {offering.get(), &silent});
  EXPECT_EQ(metrics_.groom.groom_bytes_received.value(), uploaded);
  EXPECT_EQ(metrics_.groom_cache.groom_cache_hits.value(), 1u);
  EXPECT_EQ(metrics_.level_cache.level_cache_hits.value(), 1u);
  for (const FakeClient* client : {offering.get(), &silent}) {
    EXPECT_THAT(client->errors(), IsEmpty());
    ASSERT_THAT(client->frames(1), Not(IsEmpty()));
    EXPECT_EQ(client->frames(1).back().level, LevelIndex::low);
  }
  EXPECT_EQ(offering->connection->all<wire::GroomNeed>().back().offset, bytes_.size());
  EXPECT_THAT(silent.connection->all<wire::GroomNeed>(), IsEmpty());
}

TEST_F(ResumePollTest, after_a_restart_onto_bad_files_the_groom_is_uploaded_again_without_an_error) {
  start(keeping());
  const auto before = join();
  run_ms(300, {before.get()});
  std::size_t corrupted = 0;
  for (const auto& file : std::filesystem::directory_iterator(folder_)) {
    std::filesystem::resize_file(file.path(), std::filesystem::file_size(file.path()) / 2);
    ++corrupted;
  }
  ASSERT_EQ(corrupted, 2u) << "a groom and its levels";
  start(keeping());
  FakeClient again(*server_, now_ns_);
  again.hello(now_ns_);
  again.send(wire::GroomOffer{hash_, bytes_.size()}, now_ns_);
  again.send(wire::AddCharacter{1, hash_, LevelIndex::low}, now_ns_);
  run_ms(100, {&again});
  ASSERT_EQ(again.connection->all<wire::GroomNeed>().back().offset, 0u);
  again.send(wire::GroomChunk{hash_, 0, bytes_}, now_ns_);
  run_ms(300, {&again});
  EXPECT_THAT(again.errors(), IsEmpty());
  EXPECT_EQ(again.frames(1).back().level, LevelIndex::low);
  EXPECT_EQ(metrics_.groom_cache.groom_cache_rejected_damaged.value(), 1u);
  EXPECT_EQ(metrics_.level_cache.level_cache_rejected_damaged.value(), 1u);
}

TEST_F(ResumePollTest, grooms_on_disk_are_sent_on_request) {
  start(keeping());
  const auto before = join();
  run_ms(100, {before.get()});
  start(keeping());
  FakeClient watcher(*server_, now_ns_);
  watcher.hello(now_ns_);
  watcher.send(wire::GroomRequest{hash_, 0}, now_ns_);
  watcher.send(wire::GroomRequest{wire::GroomHash{9}, 0}, now_ns_);
  run_ms(50);
  std::vector<std::uint8_t> got;
  for (const auto& data : watcher.connection->all<wire::GroomData>())
    got.insert(got.end(), data.bytes.begin(), data.bytes.end());
  EXPECT_EQ(got, bytes_);
  EXPECT_THAT(watcher.errors(), ElementsAre(wire::ErrorReason::groom_unavailable));
}

}  // namespace
}  // namespace hairnet::server
