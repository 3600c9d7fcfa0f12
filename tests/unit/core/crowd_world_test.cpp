#include <gtest/gtest.h>

#include <atomic>
#include <cmath>
#include <thread>

#include "core/solver/crowd_step.hpp"
#include "core/world/world.hpp"
#include "tests/support/levels.hpp"
#include "tests/support/own_allocator.hpp"

namespace hairnet {
namespace {

using own_allocator::allocation_count;
using support::make_random_level;
using support::turned;

std::shared_ptr<const LevelSet> make_levels(unsigned seed) {
  auto levels = std::make_shared<LevelSet>();
  for (unsigned l = 0; l < 4; ++l) {
    levels->levels[l] = make_random_level({.nodes_per_axis = 4 + static_cast<int>(l % 2), .seed = seed + l});
  }
  return levels;
}

Pose pose_at(std::size_t character, int tick) {
  // Each character shakes its head with a phase of its own, and stands 0.6 m from the next one.
  const double phase = 0.3 * static_cast<double>(character), t = 0.1 * tick;
  return rigid_pose(turned(0.4 * std::sin(phase + t), {0.2, 1, 0.1}, {0.1 * std::cos(t + phase), 1.5, 2.0 * phase}));
}

// A world with many characters of two grooms and three levels. A character keeps its number while slots change;
// tick() moves all.
struct Crowd {
  World world;
  std::array<std::shared_ptr<const LevelSet>, 2> grooms{make_levels(1), make_levels(10)};
  std::vector<CharacterId> ids;
  // The numbers of the characters, in the order of `ids`.
  std::vector<std::size_t> numbers;
  int ticks = 0;

  explicit Crowd(ParallelFor parallel_for = {}) : world(def_of(std::move(parallel_for))) {}
  static WorldDef def_of(ParallelFor parallel_for) {
    WorldDef def;
    def.parallel_for = std::move(parallel_for);
    return def;
  }

  void add(std::size_t number) {
    const auto level = static_cast<LevelIndex>(number % 3);
    ids.push_back(world.add({grooms[number % 2], level, pose_at(number, ticks)}));
    numbers.push_back(number);
  }
  void remove(std::size_t number) {
    const auto at = std::find(numbers.begin(), numbers.end(), number) - numbers.begin();
    world.remove(ids[static_cast<std::size_t>(at)]);
    ids.erase(ids.begin() + at);
    numbers.erase(numbers.begin() + at);
  }
  void tick() {
    ++ticks;
    for (std::size_t i = 0; i < ids.size(); ++i) world.set_pose(ids[i], pose_at(numbers[i], ticks));
    world.step();
  }
  [[nodiscard]] std::vector<Vec3f> displacement(std::size_t number) const {
    const auto at = std::find(numbers.begin(), numbers.end(), number) - numbers.begin();
    const auto nodes = world.lattice(ids[static_cast<std::size_t>(at)]).displacement;
    return {nodes.begin(), nodes.end()};
  }
};

void run_on_threads(std::size_t thread_count, std::size_t count, const std::function<void(std::size_t)>& body) {
  std::atomic<std::size_t> next = 0;
  const auto work = [&] {
    for (std::size_t i; (i = next++) < count;) body(i);
  };
  std::vector<std::jthread> threads;
  for (std::size_t t = 0; t < thread_count; ++t) threads.emplace_back(work);
}

TEST(CrowdWorld, comes_to_the_same_bits_on_any_number_of_threads) {
  std::vector<std::uint64_t> hashes;
  for (const std::size_t thread_count : {0, 1, 2, 5}) {
    Crowd crowd(thread_count == 0 ? ParallelFor{}
                                  : [=](std::size_t count, const std::function<void(std::size_t)>& body) {
                                      run_on_threads(thread_count, count, body);
                                    });
    // 25 characters of each of the three levels are several batches of crowd_width(), at most 16, and a last one
    // that is not full.
    for (std::size_t c = 0; c < 75; ++c) crowd.add(c);
    for (int t = 0; t < 8; ++t) crowd.tick();
    hashes.push_back(crowd.world.hash());
  }
  EXPECT_EQ(hashes, std::vector(hashes.size(), hashes[0]));
}

TEST(CrowdWorld, a_character_moves_alike_alone_and_while_others_join_leave_and_switch_levels) {
  Crowd alone, crowd;
  alone.add(4);
  for (std::size_t c = 0; c < 30; ++c) crowd.add(c);
  for (int t = 0; t < 20; ++t) {
    // Each change moves characters to other lanes and batches, beside other neighbours.
    if (t == 3) crowd.add(40);
    if (t == 5) {
      for (std::size_t c = 10; c < 30; ++c) crowd.remove(c);
    }
    if (t == 9) crowd.world.set_level(crowd.ids[0], LevelIndex::medium);
    if (t == 12) crowd.remove(0);
    alone.tick();
    crowd.tick();
    ASSERT_EQ(alone.displacement(4), crowd.displacement(4)) << "tick " << t;
  }
  EXPECT_FALSE(alone.displacement(4)[5].isZero(1e-4f));
}

// A tick that allocates may wait for a lock of the allocator. Three ticks grow all buffers; none may grow after that.
TEST(CrowdWorld, allocates_nothing_once_it_has_warmed_up) {
  Crowd crowd;
  for (std::size_t c = 0; c < 70; ++c) crowd.add(c);
  for (int t = 0; t < 3; ++t) crowd.tick();
  const std::size_t before = allocation_count;
  for (int t = 0; t < 5; ++t) crowd.tick();
  EXPECT_EQ(allocation_count, before);
}

TEST(CrowdWorld, allocates_nothing_while_strides_change_and_characters_are_suspended_and_resumed) {
  Crowd crowd;
  for (std::size_t c = 0; c < 70; ++c) crowd.add(c);
  const auto change = [&](int round) {
    for (std::size_t c = 0; c < crowd.ids.size(); ++c) {
      // Strides are 1, 2 or 4 ticks. A fifth of the characters is suspended, another fifth in each round.
      crowd.world.set_stride(crowd.ids[c], 1 << (c + static_cast<std::size_t>(round)) % 3);
      crowd.world.set_suspended(crowd.ids[c], (c + static_cast<std::size_t>(round)) % 5 == 0);
    }
  };
  for (int t = 0; t < 16; ++t) {
    change(t);
    crowd.tick();
  }
  const std::size_t before = allocation_count;
  for (int t = 0; t < 8; ++t) {
    change(t);
    crowd.tick();
  }
  EXPECT_EQ(allocation_count, before);
}

}  // namespace
}  // namespace hairnet
