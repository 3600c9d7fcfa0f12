#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <cstdio>
#include <filesystem>
#include <fstream>
#include <iterator>

#include "core/levels/build.hpp"
#include "core/world/simulation.hpp"
#include "schema/wire/groom_file.hpp"
#include "schema/wire/recording.hpp"
#include "tests/unit/server/build_quickly.hpp"
#include "tests/unit/server/poll_fixture.hpp"

namespace hairnet::server {
namespace {

using testing::Each;
using testing::ElementsAre;
using testing::IsEmpty;
using testing::Not;

constexpr double kStep_m = FakeClient::kStep_m;

class ServerPollTest : public PollTest {};

TEST_F(ServerPollTest, two_clients_of_one_groom_upload_it_once_and_both_get_its_frames) {
  start();
  // The clock of the second client is 5 s behind the server's.
  FakeClient first(*server_, now_ns_), second(*server_, now_ns_, -5'000'000'000);
  add(first);
  add(second);
  run_ms(500, {&first, &second});
  for (const FakeClient* client : {&first, &second}) {
    EXPECT_THAT(client->errors(), IsEmpty());
    EXPECT_EQ(client->connection->all<wire::Welcome>().size(), 1u);
    ASSERT_EQ(client->connection->all<wire::GroomBasis>().size(), 1u);
    ASSERT_FALSE(client->connection->all<wire::GroomStatus>().empty());
    EXPECT_EQ(client->connection->all<wire::GroomStatus>().back().state, wire::GroomState::ready);
    const auto frames = client->frames(1);
    // There are 15 ticks of 30 Hz in 500 ms; the first may come before the first pose.
    ASSERT_GE(frames.size(), 14u);
    const std::size_t nodes = BuiltModes::instance().of(hash_)->basis.node_count;
    EXPECT_EQ(frames.back().level, LevelIndex::low);
    EXPECT_EQ(frames.back().displacements.size(), 3 * nodes);
    EXPECT_THAT(frames.back().displacements, testing::Contains(testing::Ne(0)));
    EXPECT_TRUE(client->connection->valid);
  }
  EXPECT_EQ(metrics_.groom.grooms_uploaded.value(), 1u);
  EXPECT_EQ(metrics_.groom.grooms_shared.value(), 1u);
  EXPECT_EQ(metrics_.groom.groom_bytes_received.value(), bytes_.size());
}

TEST_F(ServerPollTest, a_frame_names_the_pose_and_time_that_the_step_used) {
  start();
  FakeClient client(*server_, now_ns_, 7'000'000'000);
  add(client);
  run_ms(1000, {&client});
  const auto batches = client.connection->all<wire::FrameBatch>();
  const auto frames = client.frames(1);
  // There are 30 ticks in a second; some pass before the first pose. The comparison skips ten more frames.
  ASSERT_GE(batches.size(), 25u);
  ASSERT_EQ(frames.size(), batches.size());
  for (std::size_t i = 10; i < batches.size(); ++i) {
    EXPECT_EQ(batches[i].tick, batches[i - 1].tick + 1);
    EXPECT_NEAR(static_cast<double>(batches[i].sample_time_ns - batches[i - 1].sample_time_ns), 1e9 / 30, 2);
    // Poses come every 15 ms of a motion with at most 15 rad/s^2: linear between them within 15e-3^2 / 8 * 15.
    const Pose truth = moving_pose(batches[i].sample_time_ns);
    EXPECT_EQ(frames[i].tick, batches[i].tick);
    EXPECT_LT(frames[i].pose.head().rotation.angularDistance(truth.head().rotation), 1e-3);
  }
}

TEST_F(ServerPollTest, gauges_and_histograms_show_the_current_load) {
  start();
  FakeClient client(*server_, now_ns_);
  add(client);
  // This character never has a pose, so it waits.
  client.send(wire::AddCharacter{2, hash_, LevelIndex::high}, now_ns_);
  run_ms(1500, {&client});
  TickGauges& tick = metrics_.tick.gauges;
  EXPECT_EQ(metrics_.session.gauges.clients.value(), 1);
  EXPECT_EQ(metrics_.groom.gauges.grooms.value(), 1);
  EXPECT_GT(metrics_.groom.gauges.groom_level_bytes.value(), 0);
  EXPECT_EQ(metrics_.groom.gauges.groom_upload_bytes.value(), 0);
  EXPECT_EQ(tick.characters[LevelIndex::low].value(), 1);
  EXPECT_EQ(tick.characters[LevelIndex::high].value(), 0);
  EXPECT_EQ(tick.characters_by_state_stepped.value(), 1);
  EXPECT_EQ(tick.characters_by_state_waiting.value(), 1);
  EXPECT_NEAR(tick.tick_period_seconds.value(), 1.0 / 30, 1e-12);
  // A pose every 15 ms that arrives at once is at most 15 ms old at a tick; the 40 ticks or so after the first are
  // counted.
  const Histogram& age = metrics_.tick.histograms.pose_age_seconds;
  std::uint64_t within_15_ms = 0, all = 0;
  for (std::size_t i = 0; i <= age.bound_count(); ++i) {
    all += age.count(i);
    if (i < age.bound_count() && age.bound(i) <= 0.015) within_15_ms += age.count(i);
  }
  EXPECT_GE(all, 40u);
  EXPECT_EQ(within_15_ms, all);
  EXPECT_GT(metrics_.session.histograms.sent_packet_bytes.sum(), 0);
  EXPECT_GT(metrics_.session.histograms.received_packet_bytes.sum(), 0);
}

TEST_F(ServerPollTest, a_client_that_falls_silent_is_no_late_client) {
  start();
  FakeClient client(*server_, now_ns_);
  add(client);
  run_ms(500, {&client});
  run_ms(3000);
  // The age of its last pose is counted up to a second: older ones would not have been taken.
  const Histogram& age = metrics_.tick.histograms.pose_age_seconds;
  EXPECT_EQ(age.count(age.bound_count()), 0u);
  EXPECT_GT(age.count(age.bound_count() - 1), 0u);
  // There are 90 ticks in the silent 3 s; a pose is stale after 50 ms (PoseInbox::kExtrapolationMax_ns).
  EXPECT_GT(metrics_.room.poses_stale.value(), 80u);
}

TEST_F(ServerPollTest, before_its_first_pose_a_character_has_no_frames) {
  start();
  FakeClient client(*server_, now_ns_);
  add(client);
  run_ms(200);
  EXPECT_THAT(client.frames(1), IsEmpty());
  run_ms(100, {&client});
  EXPECT_THAT(client.frames(1), Not(IsEmpty()));
}

TEST_F(ServerPollTest, a_character_added_before_its_groom_is_uploaded_is_rigid_and_then_enters_its_level) {
  start();
  FakeClient client(*server_, now_ns_);
  client.hello(now_ns_);
  client.send(wire::GroomOffer{hash_, bytes_.size()}, now_ns_);
  client.send(wire::AddCharacter{1, hash_, LevelIndex::medium}, now_ns_);
  run_ms(200, {&client});
  ASSERT_THAT(client.frames(1), Not(IsEmpty()));
  EXPECT_EQ(client.frames(1).back().level, LevelIndex::rigid);
  EXPECT_THAT(client.frames(1).back().displacements, IsEmpty());
  EXPECT_THAT(client.connection->all<wire::GroomBasis>(), IsEmpty());
  client.upload(bytes_, hash_, now_ns_);
  run_ms(200, {&client});
  EXPECT_EQ(client.frames(1).back().level, LevelIndex::medium);
  // The basis is announced before the first frame of its level.
  bool announced = false, entered = false;
  for (const wire::Envelope& envelope : client.connection->received) {
    announced |= std::holds_alternative<wire::GroomBasis>(envelope.message);
    const auto* batch = std::get_if<wire::FrameBatch>(&envelope.message);
    if (!batch || batch->frames[0].level != LevelIndex::medium) continue;
    EXPECT_TRUE(announced);
    entered = true;
  }
  EXPECT_TRUE(entered);
}

TEST_F(ServerPollTest, switching_levels_announces_one_basis_and_hair_goes_on) {
  start();
  FakeClient client(*server_, now_ns_);
  add(client, LevelIndex::low);
  run_ms(200, {&client});
  for (const LevelIndex level : {LevelIndex::ether, LevelIndex::low, LevelIndex::rigid, LevelIndex::ether}) {
    const std::size_t before = client.frames(1).size();
    client.send(wire::SetLevel{1, level}, now_ns_);
    // A second exceeds the time for which a character keeps a level (kLodDwell_s, 0.5 s), and the time in which its
    // hair eases into the rigid shape.
    run_ms(1000, {&client});
    const auto frames = client.frames(1);
    ASSERT_GT(frames.size(), before + 1);
    EXPECT_EQ(frames.back().level, level);
    EXPECT_FALSE(frames.back().discontinuous);
    const auto first = std::find_if(frames.begin() + static_cast<std::ptrdiff_t>(before), frames.end(),
                                    [&](const FakeClient::SeenFrame& frame) { return frame.level == level; });
    ASSERT_NE(first, frames.end());
    EXPECT_FALSE(first->discontinuous) << "hair goes on";
    EXPECT_EQ(frames.back().displacements.empty(), level == LevelIndex::rigid);
  }
  EXPECT_EQ(client.connection->all<wire::GroomBasis>().size(), 1u);
}

TEST_F(ServerPollTest, a_removed_character_has_no_frames_after_its_removal_message) {
  start();
  FakeClient client(*server_, now_ns_);
  add(client);
  run_ms(200, {&client});
  client.send(wire::RemoveCharacter{1}, now_ns_);
  run_ms(100);
  ASSERT_EQ(client.connection->all<wire::CharacterRemoved>().size(), 1u);
  bool removed = false;
  for (const wire::Envelope& envelope : client.connection->received) {
    removed |= std::holds_alternative<wire::CharacterRemoved>(envelope.message);
    EXPECT_FALSE(removed && std::holds_alternative<wire::FrameBatch>(envelope.message));
  }
  EXPECT_EQ(server_->scheduler().simulation().character_count(), 0u);
  client.send(wire::AddCharacter{1, hash_, LevelIndex::low}, now_ns_);
  run_ms(100, {&client});
  EXPECT_THAT(client.errors(), IsEmpty());
  EXPECT_EQ(server_->scheduler().simulation().character_count(), 1u);
}

TEST_F(ServerPollTest, a_leaving_client_removes_its_own_characters_only) {
  start();
  FakeClient leaves(*server_, now_ns_), stays(*server_, now_ns_);
  add(leaves);
  add(stays);
  run_ms(200, {&leaves, &stays});
  EXPECT_EQ(server_->scheduler().simulation().character_count(), 2u);
  leaves.send(wire::Goodbye{wire::GoodbyeReason::client_leaves, ""}, now_ns_);
  run_ms(100, {&stays});
  EXPECT_TRUE(leaves.connection->closed);
  EXPECT_EQ(server_->session_count(), 1u);
  EXPECT_EQ(server_->scheduler().simulation().character_count(), 1u);
  const std::size_t before = stays.frames(1).size();
  run_ms(100, {&stays});
  // Three ticks pass in 100 ms.
  EXPECT_GE(stays.frames(1).size(), before + 2);
}

TEST_F(ServerPollTest, a_teleport_marks_one_frame_and_leaves_the_lattice_where_it_was_on_the_head) {
  start();
  FakeClient client(*server_, now_ns_);
  add(client, LevelIndex::low);
  run_ms(300);
  client.pose(1, rigid_pose({}), now_ns_);
  // The head does not move, so the hair comes to hang in a shape that the teleport must not disturb.
  run_ms(500);
  const auto rest = client.frames(1).back();
  client.pose(1, rigid_pose({Quat::Identity(), {50, 0, 0}}), now_ns_, true);
  const std::size_t before = client.frames(1).size();
  run_ms(300);
  const auto frames = client.frames(1);
  int marked = 0;
  for (std::size_t i = before; i < frames.size(); ++i) marked += frames[i].discontinuous;
  EXPECT_EQ(marked, 1);
  EXPECT_EQ(frames.back().pose.head().position.x(), 50);
  // The hair may still settle by less than 2 mm. A teleport of 50 m that swept it along would move it far more.
  for (std::size_t i = 0; i < rest.displacements.size(); ++i)
    EXPECT_NEAR(frames.back().displacements[i] * kStep_m, rest.displacements[i] * kStep_m, 2e-3);
}

TEST_F(ServerPollTest, the_last_pose_stays_when_a_client_sends_no_more) {
  start();
  FakeClient client(*server_, now_ns_);
  add(client);
  run_ms(300, {&client});
  run_ms(1000);
  const auto frames = client.frames(1);
  // The client has been silent for a second, and the last ten frames cover a third of a second.
  EXPECT_EQ(frames.back().pose.head().position, frames[frames.size() - 10].pose.head().position);
  EXPECT_GT(metrics_.room.poses_stale.value(), 10u);
  EXPECT_FALSE(client.connection->closed);
}

TEST_F(ServerPollTest, draining_sends_goodbye_to_every_client_and_accepts_no_new_one) {
  start();
  FakeClient client(*server_, now_ns_);
  add(client);
  run_ms(100, {&client});
  // With no time to drain, clients get their goodbye at once.
  server_->drain(0, now_ns_);
  ASSERT_EQ(client.connection->all<wire::Goodbye>().size(), 1u);
  EXPECT_EQ(client.connection->all<wire::Goodbye>()[0].reason, wire::GoodbyeReason::server_draining);
  EXPECT_TRUE(client.connection->closed);
  FakeClient late(*server_, now_ns_);
  EXPECT_TRUE(late.connection->closed);
  ASSERT_EQ(late.connection->all<wire::Goodbye>().size(), 1u);
  run_ms(50);
  EXPECT_EQ(server_->session_count(), 0u);
}

TEST_F(ServerPollTest, the_wind_blows_on_all_hair_of_a_room_and_the_last_to_set_it_wins) {
  start();
  FakeClient first(*server_, now_ns_), second(*server_, now_ns_);
  add(first);
  add(second);
  first.pose(1, rigid_pose({}), now_ns_);
  second.pose(1, rigid_pose({}), now_ns_);
  run_ms(500);
  // Mean displacement along x, in head axes, of the newest frame.
  const auto blown_m = [](const FakeClient& client) {
    const auto frame = client.frames(1).back();
    double sum = 0;
    for (std::size_t i = 0; i < frame.displacements.size(); i += 3) sum += frame.displacements[i];
    return sum * kStep_m / static_cast<double>(frame.displacements.size() / 3);
  };
  // Hair that hangs without wind has no mean displacement along x: a tenth of a millimetre is allowed. A wind of 3 m/s
  // must move it by more than 2 mm.
  EXPECT_NEAR(blown_m(first), 0, 1e-4);
  const auto blow = [&](FakeClient& client, double x) {
    wire::SetWind set;
    set.wind.mean_m_per_s = {x, 0, 0};
    client.send(set, now_ns_);
    run_ms(1500);
  };
  blow(first, 3);
  EXPECT_GT(blown_m(first), 2e-3);
  EXPECT_GT(blown_m(second), 2e-3);
  blow(second, -3);
  EXPECT_LT(blown_m(first), -2e-3);
  EXPECT_LT(blown_m(second), -2e-3);
  EXPECT_THAT(first.errors(), IsEmpty());
}

TEST_F(ServerPollTest, the_wind_of_one_room_leaves_the_others_calm) {
  start();
  FakeClient windy(*server_, now_ns_), calm(*server_, now_ns_);
  add(windy, LevelIndex::low, "garden");
  add(calm, LevelIndex::low, "hall");
  wire::SetWind set;
  set.wind.mean_m_per_s = {6, 0, 0};
  windy.send(set, now_ns_);
  windy.pose(1, rigid_pose({}), now_ns_);
  calm.pose(1, rigid_pose({}), now_ns_);
  run_ms(1000);
  // Displacements count in steps of 0.5 mm (FakeClient::kStep_m): some node has moved by more than 2 mm, and in the
  // other room none.
  EXPECT_THAT(windy.frames(1).back().displacements, testing::Contains(testing::Gt(4)));
  EXPECT_THAT(calm.frames(1).back().displacements, Each(0));
}

TEST_F(ServerPollTest, a_material_is_one_characters_and_outlives_its_levels) {
  Config config;
  config.wind.mean_m_per_s = {4, 0, 0};
  start(config);
  FakeClient plain(*server_, now_ns_), gelled(*server_, now_ns_);
  add(plain);
  add(gelled);
  // The material comes before the character's first pose, and so before the character is in the World.
  gelled.send(wire::SetMaterial{1, {.gel_per_s2 = 2000}}, now_ns_);
  plain.pose(1, rigid_pose({}), now_ns_);
  gelled.pose(1, rigid_pose({}), now_ns_);
  run_ms(1500);
  const auto largest_m = [](const FakeClient& client) {
    const auto frame = client.frames(1).back();
    int most = 0;
    for (const std::int16_t d : frame.displacements) most = std::max(most, std::abs(int{d}));
    return most * kStep_m;
  };
  // Gel of 2000 1/s^2 pulls hair to its shape so strongly that the wind moves it less than a third as far. The factors
  // of 0.3 and 0.5 only tell gelled from plain hair.
  EXPECT_LT(largest_m(gelled), 0.3 * largest_m(plain));
  gelled.send(wire::SetLevel{1, LevelIndex::medium}, now_ns_);
  run_ms(1500);
  EXPECT_EQ(gelled.frames(1).back().level, LevelIndex::medium);
  EXPECT_LT(largest_m(gelled), 0.3 * largest_m(plain));
  gelled.send(wire::SetMaterial{1, {}}, now_ns_);
  run_ms(1500);
  EXPECT_GT(largest_m(gelled), 0.5 * largest_m(plain));
}

TEST_F(ServerPollTest, a_recording_steps_again_to_the_same_hash_every_tick) {
  // The recording has everything that a tick may bring: characters, levels, materials, winds, a teleport and a removal.
  // A replay from it must have the same state after each tick, or nobody could find an error by replaying it.
  const std::string path = testing::TempDir() + "hairnet_server_poll_test.hairrec";
  Config config;
  config.record = path;
  config.substeps = 2;
  config.wind.mean_m_per_s = {1, 0, 0.5};
  config.wind.turbulence_rms_m_per_s = 1;
  start(config);
  FakeClient first(*server_, now_ns_), second(*server_, now_ns_);
  add(first);
  run_ms(200, {&first});
  wire::SetWind storm;
  storm.wind.mean_m_per_s = {-3, 0, 0};
  storm.wind.gust_ratio = 0.5;
  storm.wind.turbulence_rms_m_per_s = 2;
  storm.wind.seed = 99;
  first.send(storm, now_ns_);
  first.send(wire::SetMaterial{1, {.stiffness = 4, .density = 0.5f, .gel_per_s2 = 30}}, now_ns_);
  add(second, LevelIndex::medium);
  run_ms(200, {&first, &second});
  first.send(wire::SetLevel{1, LevelIndex::high}, now_ns_);
  first.pose(1, rigid_pose({Quat::Identity(), {5, 0, 0}}), now_ns_, true);
  run_ms(200, {&second});
  second.send(wire::RemoveCharacter{1}, now_ns_);
  run_ms(100, {&first});
  server_.reset();

  std::ifstream file(path, std::ios::binary);
  const std::vector<std::uint8_t> recording{std::istreambuf_iterator<char>(file), {}};
  std::remove(path.c_str());
  std::span<const std::uint8_t> rest = recording;
  auto header = wire::take_record_entry(rest);
  ASSERT_TRUE(header) << header.error();
  WorldDef def;
  def.tick_s = 1.0 / std::get<wire::RecordingHeader>(*header).tick_rate_hz;
  def.substep_count = std::get<wire::RecordingHeader>(*header).substep_count;
  def.iterations = std::get<wire::RecordingHeader>(*header).iterations;
  Simulation simulation(def, std::get<wire::RecordingHeader>(*header).wind);
  std::size_t ticks = 0, added = 0, removed = 0, materials = 0, winds = 0;
  while (!rest.empty()) {
    auto entry = wire::take_record_entry(rest);
    ASSERT_TRUE(entry) << entry.error();
    if (const auto* groom = std::get_if<wire::RecordedGroom>(&*entry)) {
      const auto decoded = wire::decode_groom(groom->bytes);
      ASSERT_TRUE(decoded) << decoded.error();
      simulation.put_levels(wire::hash_groom(groom->bytes), build_levels(*decoded));
    } else {
      const auto& tick = std::get<wire::RecordedTick>(*entry);
      simulation.step(tick);
      ASSERT_EQ(simulation.hash(), tick.state_hash) << "tick " << tick.tick;
      ++ticks;
      added += tick.added.size();
      removed += tick.removed.size();
      materials += tick.materials.size();
      winds += tick.winds.size();
    }
  }
  EXPECT_EQ(ticks, metrics_.tick.ticks_run.value());
  EXPECT_EQ(added, 2u);
  EXPECT_EQ(removed, 1u);
  EXPECT_EQ(materials, 1u);
  EXPECT_EQ(winds, 2u) << "the room's first, and the storm";
}

TEST_F(ServerPollTest, levels_that_a_server_built_before_give_the_same_bits) {
  const std::filesystem::path folder = std::filesystem::path(testing::TempDir()) / "levels_of_a_server";
  std::filesystem::remove_all(folder);
  std::vector<std::vector<FakeClient::SeenFrame>> runs;
  std::vector<std::uint64_t> hashes;
  // The first server builds the levels and writes them into the cache; the second reads them from there.
  for (const std::uint64_t hits : {0u, 1u}) {
    Metrics metrics;
    Config config;
    config.workers = 1;
    config.build_threads = 2;
    config.level_cache = folder;
    now_ns_ = kStart_ns;
    auto created = Server::create(config, metrics, now_ns_, nullptr, build_quickly);
    ASSERT_TRUE(created) << created.error();
    server_ = std::move(*created);
    FakeClient client(*server_, now_ns_);
    add(client, LevelIndex::high);
    run_ms(300, {&client});
    // A change of levels uses the maps between levels, which are not in the cached file but made again.
    client.send(wire::SetLevel{1, LevelIndex::low}, now_ns_);
    run_ms(300, {&client});
    EXPECT_EQ(metrics.level_cache.level_cache_hits.value(), hits);
    EXPECT_EQ(metrics.level_cache.level_cache_misses.value(), 1 - hits);
    EXPECT_EQ(metrics.level_cache.level_cache_written.value(), 1 - hits);
    EXPECT_EQ(metrics.groom.grooms_ready.value(), 1u);
    runs.push_back(client.frames(1));
    hashes.push_back(server_->scheduler().simulation().hash());
    server_.reset();
  }
  std::filesystem::remove_all(folder);
  EXPECT_EQ(hashes[0], hashes[1]);
  ASSERT_EQ(runs[0].size(), runs[1].size());
  ASSERT_GT(runs[0].size(), 10u);
  for (std::size_t i = 0; i < runs[0].size(); ++i) {
    EXPECT_EQ(runs[0][i].level, runs[1][i].level);
    EXPECT_EQ(runs[0][i].displacements, runs[1][i].displacements);
  }
}

TEST_F(ServerPollTest, the_worker_count_changes_no_bit) {
  std::vector<std::vector<FakeClient::SeenFrame>> runs;
  // Nine characters are enough that four workers share them. A sum whose order depends on the workers would change its
  // last bits.
  for (const std::uint32_t workers : {1u, 4u}) {
    Metrics metrics;
    Config config;
    config.workers = workers;
    now_ns_ = kStart_ns;
    auto created = Server::create(config, metrics, now_ns_, nullptr, build_quickly);
    ASSERT_TRUE(created);
    server_ = std::move(*created);
    FakeClient client(*server_, now_ns_);
    add(client);
    for (std::uint32_t character = 2; character < 10; ++character)
      client.send(wire::AddCharacter{character, hash_, LevelIndex::low}, now_ns_);
    for (int i = 0; i < 300; ++i) {
      now_ns_ += kMs;
      if (i % 15 == 0) {
        wire::PoseBatch batch;
        for (std::uint32_t character = 1; character < 10; ++character)
          batch.poses.push_back({character, static_cast<std::uint32_t>(i + 1), now_ns_, false,
                                 moving_pose(now_ns_ + character * 100 * kMs)});
        client.send(batch, now_ns_);
      }
      server_->poll(now_ns_);
    }
    runs.push_back(client.frames(9));
    server_.reset();
  }
  ASSERT_EQ(runs[0].size(), runs[1].size());
  ASSERT_GT(runs[0].size(), 5u);
  for (std::size_t i = 0; i < runs[0].size(); ++i) EXPECT_EQ(runs[0][i].displacements, runs[1][i].displacements);
}

}  // namespace
}  // namespace hairnet::server
