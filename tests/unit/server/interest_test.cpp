#include "server/room/interest.hpp"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

namespace hairnet::server {
namespace {

using testing::ElementsAre;

// Members 1 to 5 along x; member 3, at the origin, is the observer's own; member 5 has had no pose.
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

}  // namespace
}  // namespace hairnet::server
