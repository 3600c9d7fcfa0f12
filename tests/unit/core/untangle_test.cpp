#include "core/world/untangle.hpp"

#include <gtest/gtest.h>

#include <memory>

#include "core/world/world.hpp"
#include "tests/support/levels.hpp"

namespace hairnet {
namespace {

using support::turned;

class UntangleTest : public ::testing::Test {
 protected:
  // Returns the displacements of a lattice mirrored through its middle plane: every cell is inside out.
  [[nodiscard]] std::vector<Vec3f> folded() const {
    std::vector<Vec3f> displacement;
    for (const Vec3f& rest : level_.rest) displacement.emplace_back(-2 * rest.x(), 0, 0);
    return displacement;
  }
  // Returns the displacements of a lattice turned by almost half a turn as a whole: far from home, but no cell is
  // inside out.
  [[nodiscard]] std::vector<Vec3f> turned_over() const {
    const Mat3f half_turn = Eigen::AngleAxisf(3, Vec3f::UnitX()).toRotationMatrix();
    std::vector<Vec3f> displacement;
    for (const Vec3f& rest : level_.rest) displacement.emplace_back(half_turn * rest - rest);
    return displacement;
  }
  // Updates for that time with unchanged inputs, and returns the share of contact that is then switched off.
  double after(double seconds, const Pose& pose, double still_s, const std::vector<Vec3f>& displacement) {
    for (int tick = 0; tick < 30 * seconds; ++tick) untangle_.update(pose, still_s, 1.0 / 30, level_, displacement);
    return untangle_.share();
  }
  Level level_ = support::make_random_level();
  Untangle untangle_;
};

TEST_F(UntangleTest, a_lattice_turned_as_a_whole_is_not_folded) {
  EXPECT_FALSE(is_folded(level_, std::vector<Vec3f>(level_.rest.size(), Vec3f::Zero())));
  EXPECT_FALSE(is_folded(level_, turned_over()));
  EXPECT_TRUE(is_folded(level_, folded()));
}

// Untangling needs a body that has been still for 1 s, and switches contact off within another (kAfter_s and
// kUntangle_s in untangle.cpp). The body here has been still for 2 s.
TEST_F(UntangleTest, lets_contact_go_slowly_where_hair_is_folded_under_a_body_at_rest) {
  const double soon = after(0.4, rigid_pose({}), 2, folded());
  EXPECT_LT(soon, 0.5);
  EXPECT_EQ(after(2, rigid_pose({}), 2, folded()), 1);
}

TEST_F(UntangleTest, leaves_as_slowly_once_the_body_moves) {
  after(2, rigid_pose({}), 2, folded());
  const double soon = after(0.1, rigid_pose({}), 0, folded());
  EXPECT_GT(soon, 0.8);
  EXPECT_EQ(after(2, rigid_pose({}), 0, folded()), 0);
}

TEST_F(UntangleTest, lets_springs_go_too_until_the_hair_is_home) {
  const std::vector<Vec3f> home(level_.rest.size(), Vec3f::Zero());
  after(2, rigid_pose({}), 2, folded());
  EXPECT_EQ(untangle_.stiffness(), 0.01);
  // The springs keep 1 % of their stiffness (kStiffnessMin in untangle.cpp) until every node is near its design.
  after(2, rigid_pose({}), 2, turned_over());
  EXPECT_EQ(untangle_.stiffness(), 0.01) << "not folded any more, but not home";
  after(0.5, rigid_pose({}), 2, home);
  EXPECT_LT(untangle_.stiffness(), 0.8);
  after(2, rigid_pose({}), 2, home);
  EXPECT_EQ(untangle_.stiffness(), 1);
}

TEST_F(UntangleTest, unfolds_a_lattice_that_its_springs_would_keep_folded) {
  auto levels = std::make_shared<LevelSet>();
  levels->levels[0] = support::make_random_level({.spring_count = 400, .attachment_count = 0, .spring_stiffness = 20});
  // Springs are ten times as stiff as usual and the ether a tenth, so that the ether alone cannot unfold the hair.
  for (float& stiffness : levels->levels[0].ether_stiffness) stiffness *= 0.1f;
  level_ = levels->levels[0];
  World world({});
  const CharacterId id = world.add({levels, LevelIndex::high, {}});
  ASSERT_TRUE(world.set_state(id, folded(), std::vector<Vec3f>(level_.rest.size(), Vec3f::Zero())));
  const auto farthest_m = [&] {
    float max_m = 0;
    for (const Vec3f& d : world.lattice(id).displacement) max_m = std::max(max_m, d.norm());
    return max_m;
  };
  // In the first 0.8 s untangling has not begun (kAfter_s = 1 s), and the springs keep the hair folded.
  for (int tick = 0; tick < 25; ++tick) world.step();
  EXPECT_GT(farthest_m(), 0.05f);
  for (int tick = 0; tick < 30 * 10; ++tick) world.step();
  EXPECT_LT(farthest_m(), 1e-3f);
}

TEST_F(UntangleTest, does_nothing_to_hair_that_is_only_displaced_nor_to_a_body_that_lies) {
  EXPECT_EQ(after(3, rigid_pose({}), 2, turned_over()), 0);
  // A head that is tilted by more than 0.087 rad, or turned against the body by more than 0.17 rad, does not stand
  // upright (untangle.cpp).
  EXPECT_EQ(after(3, rigid_pose(turned(0.3, {1, 0, 0})), 2, folded()), 0);
  Pose looks_aside = rigid_pose({});
  looks_aside[Bone::head] = turned(0.5, {0, 1, 0});
  EXPECT_EQ(after(3, looks_aside, 2, folded()), 0);
}

}  // namespace
}  // namespace hairnet
