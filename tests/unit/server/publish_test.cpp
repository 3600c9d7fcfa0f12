#include "server/tick/publish.hpp"

#include <gtest/gtest.h>

#include <limits>

#include "tests/support/levels.hpp"

namespace hairnet::server {
namespace {

class FakeOutlet final : public Outlet {
 public:
  void push(const wire::Message&, std::int64_t) override {}
  void push_frames(std::uint64_t tick, std::int64_t, std::vector<wire::Frame> pushed) override {
    ticks.push_back(tick);
    frames.insert(frames.end(), pushed.begin(), pushed.end());
  }
  std::vector<std::uint64_t> ticks;
  std::vector<wire::Frame> frames;
};

void in_turn(std::size_t count, const std::function<void(std::size_t)>& body) {
  for (std::size_t i = 0; i < count; ++i) body(i);
}

LatticeView view(const std::vector<Vec3f>& displacement) {
  LatticeView lattice;
  lattice.level = LevelIndex::low;
  lattice.displacement = displacement;
  return lattice;
}

TEST(Publish, a_frame_holds_displacements_within_half_its_quantum) {
  std::mt19937 random(3);
  for (const float size_m : {1e-5f, 0.003f, 0.3f, 3.5f, 40.0f}) {
    std::vector<Vec3f> displacement;
    for (int i = 0; i < 300; ++i) displacement.push_back(support::random_vec(random, size_m));
    const wire::Frame frame = make_frame(character_key(3, 9), Character{}, view(displacement));
    EXPECT_EQ(frame.character, 9u);
    std::vector<Vec3f> decoded;
    wire::decode_displacements(frame, decoded);
    ASSERT_EQ(decoded.size(), displacement.size());
    for (std::size_t i = 0; i < decoded.size(); ++i) {
      EXPECT_LE((decoded[i] - displacement[i]).cwiseAbs().maxCoeff(), 0.5f * frame.quantum_m + 1e-6f * size_m);
    }
    EXPECT_LE(frame.quantum_m, std::max(1e-4f, 2 * size_m / 32767)) << "no coarser than needed";
  }
}

TEST(Publish, a_rigid_character_is_a_pose_alone) {
  Character character;
  character.pose = rigid_pose({Quat::Identity(), {1, 2, 3}});
  character.discontinuous = true;
  const wire::Frame frame = make_frame(character_key(3, 9), character, LatticeView{});
  EXPECT_EQ(frame.level, LevelIndex::rigid);
  EXPECT_TRUE(frame.discontinuous);
  EXPECT_EQ(frame.pose.head().position, Vec3(1, 2, 3));
  EXPECT_TRUE(frame.displacements.empty());
}

TEST(Publish, each_observer_gets_its_own_placed_characters) {
  RoomCounters room_counters;
  TickCounters counters;
  Room room(room_counters);
  Simulation simulation(WorldDef{});
  auto first = std::make_shared<FakeOutlet>(), second = std::make_shared<FakeOutlet>();
  room.open(1, first);
  room.open(2, second);
  wire::RecordedTick inputs;
  inputs.tick = 5;
  for (const CharacterKey key : {character_key(1, 4), character_key(2, 4), character_key(2, 5), character_key(2, 6)}) {
    room.add(key, {}, LevelIndex::low);
    if (key == character_key(2, 6)) continue;  // no pose yet
    room.find(key)->placed = true;
    inputs.added.push_back({key, {}, false, LevelIndex::rigid, rigid_pose({})});
  }
  simulation.step(inputs);
  publish(room, simulation, inputs, in_turn, counters);
  ASSERT_EQ(first->frames.size(), 1u);
  EXPECT_EQ(first->frames[0].character, 4u);
  ASSERT_EQ(second->frames.size(), 2u);
  EXPECT_EQ(second->frames[1].character, 5u);
  EXPECT_EQ(second->ticks, std::vector<std::uint64_t>{5});
  EXPECT_EQ(counters.frames_published.value(), 3u);
}

}  // namespace
}  // namespace hairnet::server
