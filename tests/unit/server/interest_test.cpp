#include "server/room/interest.hpp"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <algorithm>
#include <limits>
#include <random>

namespace hairnet::server {
namespace {

using testing::ElementsAre;

// Makes members 1 to 5 along x. Member 3, at the origin, belongs to the observer; member 5 has had no pose yet.
std::vector<MemberHead> row() {
  return {{1, {-3, 0, 0}, false, true},
          {2, {-1, 0, 0}, false, true},
          {3, {0, 0, 0}, true, true},
          {4, {2, 0, 0}, false, true},
          {5, {0, 0, 0}, false, false}};
}

std::vector<bool> chosen(const wire::Observe& observe, const std::vector<MemberHead>& heads = row()) {
  std::vector<bool> wanted;
  choose_members(observe, heads, wanted);
  return wanted;
}

TEST(Interest, is_in_all_by_default) {
  EXPECT_THAT(chosen({}), ElementsAre(true, true, true, true, true));
}

TEST(Interest, in_the_nearest_is_measured_from_own_heads) {
  wire::Observe observe;
  observe.mode = wire::ObserveMode::nearest;
  // The distances from the own head are 1 m for member 2, 2 m for member 4 and 3 m for member 1.
  for (const std::uint32_t count : {0u, 1u, 2u, 3u, 99u}) {
    observe.count = count;
    EXPECT_THAT(chosen(observe), ElementsAre(count >= 3, count >= 1, true, count >= 2, false)) << count;
  }
}

TEST(Interest, in_the_nearest_takes_the_lower_member_of_two_as_near) {
  wire::Observe observe;
  observe.mode = wire::ObserveMode::nearest;
  observe.count = 1;
  const std::vector<MemberHead> heads{
      {1, {0, 0, 0}, true, true}, {2, {0, 1, 0}, false, true}, {3, {1, 0, 0}, false, true}};
  EXPECT_THAT(chosen(observe, heads), ElementsAre(true, true, false));
}

TEST(Interest, within_a_radius_counts_its_edge) {
  wire::Observe observe;
  observe.mode = wire::ObserveMode::radius;
  observe.radius_m = 2;
  EXPECT_THAT(chosen(observe), ElementsAre(false, true, true, true, false));
  observe.from = Vec3f(-3, 0, 0);
  EXPECT_THAT(chosen(observe), ElementsAre(true, true, true, false, false));
}

TEST(Interest, in_a_list_ignores_absent_members) {
  wire::Observe observe;
  observe.mode = wire::ObserveMode::list;
  observe.members = {4, 77, 0, 5};
  EXPECT_THAT(chosen(observe), ElementsAre(false, false, true, true, true));
}

TEST(Interest, without_head_and_place_is_in_the_lowest_numbers) {
  std::vector<MemberHead> heads = row();
  heads[2].own = false;
  wire::Observe observe;
  observe.mode = wire::ObserveMode::nearest;
  observe.count = 2;
  EXPECT_THAT(chosen(observe, heads), ElementsAre(true, true, false, false, false));
}

// Returns the squared distance to the nearest own head, by a plain loop.
double plain_distance2(const std::vector<MemberHead>& heads, const MemberHead& head) {
  double least = std::numeric_limits<double>::infinity();
  for (const MemberHead& own : heads) {
    if (own.own && own.has_pose) least = std::min(least, (head.head - own.head).squaredNorm());
  }
  return least;
}

// A k-d tree searches many own heads, and a loop searches few (kTreePointsMin in interest.cpp). Both must find the same
// as a plain loop.
TEST(Interest, measured_from_many_own_heads_is_that_of_a_plain_loop) {
  std::mt19937 random(7);
  std::uniform_real_distribution<double> place(-20, 20);
  for (const std::size_t count : {10u, 40u, 700u}) {
    std::vector<MemberHead> heads;
    for (std::uint32_t member = 1; member <= count; ++member)
      heads.push_back({member, {place(random), place(random), place(random)}, random() % 3 != 0, random() % 10 != 0});
    std::vector<std::pair<double, std::uint32_t>> others;
    for (const MemberHead& head : heads) {
      if (!head.own && head.has_pose) others.emplace_back(plain_distance2(heads, head), head.member);
    }
    std::ranges::sort(others);
    wire::Observe observe;
    observe.mode = wire::ObserveMode::nearest;
    observe.count = static_cast<std::uint32_t>(others.size() / 3);
    const std::vector<bool> nearest = chosen(observe, heads);
    observe.mode = wire::ObserveMode::radius;
    observe.radius_m = 5;
    const std::vector<bool> within = chosen(observe, heads);
    for (std::size_t i = 0; i < others.size(); ++i) {
      const auto [m2, member] = others[i];
      EXPECT_EQ(nearest[member - 1], i < observe.count) << member << " of " << count;
      EXPECT_EQ(within[member - 1], m2 <= 25) << member << " of " << count;
    }
  }
}

// A k-d tree cannot split points that are all equal, and must not fail on them.
TEST(Interest, many_own_heads_may_be_in_one_place) {
  std::vector<MemberHead> heads;
  for (std::uint32_t member = 1; member <= 100; ++member) heads.push_back({member, {1, 2, 3}, true, true});
  heads.push_back({101, {1, 2, 4}, false, true});
  heads.push_back({102, {1, 2, 5.1}, false, true});
  wire::Observe observe;
  observe.mode = wire::ObserveMode::radius;
  observe.radius_m = 2;
  const std::vector<bool> wanted = chosen(observe, heads);
  EXPECT_TRUE(wanted[100]);
  EXPECT_FALSE(wanted[101]);
}

}  // namespace
}  // namespace hairnet::server
