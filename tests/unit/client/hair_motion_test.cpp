#include "client/draw/hair_motion.hpp"

#include <gmock/gmock.h>

#include <cmath>
#include <limits>
#include <numeric>

#include "core/ffd/deform.hpp"
#include "core/random.hpp"

namespace hairnet::draw {
namespace {

// The radius of a ball about the head. The swing is stored in the cube around this ball.
constexpr float kBall_m = 0.45f;

// A lattice from -0.5 to 0.5 m whose nodes move by `moved`.
struct Nodes {
  LevelGeometry geometry;
  std::vector<Vec3f> displacements;

  template <class Moved>
  explicit Nodes(const Moved& moved) {
    geometry.lattice = {Vec3f::Constant(-0.5f), Vec3f::Constant(0.1f), {11, 11, 11}};
    for (std::uint32_t n = 0; n < geometry.lattice.node_count(); ++n)
      displacements.push_back(moved(geometry.lattice.node(n)));
  }
  [[nodiscard]] MovedLattice shown() const { return {&geometry, displacements}; }
  [[nodiscard]] HairMotion::Nodes before() const { return {geometry.lattice, displacements}; }
  // Moves a point by linear FFD, with which hair is drawn from afar.
  [[nodiscard]] Vec3f moved(const Vec3f& rest) const {
    Vec3f to;
    Deformer(geometry.lattice, {&rest, 1}, {}, FfdKind::linear).deform(displacements, {&to, 1});
    return to;
  }
};

Vec3f random_vector(Random& random, double most) {
  return (most * Vec3(random.symmetric(), random.symmetric(), random.symmetric())).cast<float>();
}

Nodes rough(std::uint64_t seed) {
  Random random(seed);
  return Nodes([&](const Vec3f&) { return random_vector(random, 0.05); });
}

// Returns nodes that bend hair to the side, the lower the further.
Nodes bent(float share) {
  return Nodes([=](const Vec3f& x) { return Vec3f(share * x.y() * x.y(), 0, 0.3f * share * x.y()); });
}

MovingCharacter character(std::uint64_t id, const MovedLattice& lattice, double x_m = 0, float head_px = 100) {
  return {id, {Quat::Identity(), {x_m, 0, 0}}, lattice, kBall_m, head_px};
}

// Returns the swing at a place as the GPU reads it: linear between the 8 x 8 x 8 nodes of a cube about the head.
Vec3f swing_at(const HairMotion& motion, std::size_t slice, const Vec3f& head) {
  constexpr std::size_t kSide = HairMotion::kSwingNodes;
  const Vec3f node = (0.5f + 0.5f * head.array() / kBall_m) * (kSide - 1);
  Vec3f sum = Vec3f::Zero();
  for (std::size_t corner = 0; corner < 8; ++corner) {
    float share = 1;
    std::size_t at = slice * kSide * kSide * kSide, stride = 1;
    for (int axis = 0; axis < 3; ++axis) {
      const std::size_t low = std::min(static_cast<std::size_t>(node[axis]), kSide - 2), upper = corner >> axis & 1;
      const float t = node[axis] - static_cast<float>(low);
      share *= upper != 0 ? t : 1 - t;
      at += (low + upper) * stride;
      stride *= kSide;
    }
    sum += share * motion.swing()[at].head<3>();
  }
  return sum;
}

TEST(HairMotion, displacement_between_nodes_is_that_of_linear_ffd) {
  const Nodes one = rough(1);
  Random random(3);
  for (int i = 0; i < 100; ++i) {
    const Vec3f rest = random_vector(random, 0.49);
    EXPECT_LT((displacement_at(one.before(), rest) - (one.moved(rest) - rest)).norm(), 1e-6f);
  }
  EXPECT_TRUE(displacement_at({}, Vec3f::Zero()).isZero());
}

TEST(HairMotion, displacement_beyond_a_lattice_is_that_of_its_border) {
  const HairMotion::Nodes nodes = rough(1).before();
  EXPECT_EQ(displacement_at(nodes, {0.9f, 0.12f, -0.31f}), displacement_at(nodes, {0.5f, 0.12f, -0.31f}));
  EXPECT_EQ(displacement_at(nodes, {0.1f, -1e9f, 7}), displacement_at(nodes, {0.1f, -0.5f, 0.5f}));
}

TEST(HairMotion, swing_leads_from_where_hair_is_to_where_it_was) {
  const Nodes before = bent(0.2f), now = bent(0.35f);
  HairMotion motion;
  const MovingCharacter first = character(1, before.shown()), second = character(1, now.shown(), 0.05);
  EXPECT_TRUE(motion.motions({&first, 1}).empty());
  const auto motions = motion.motions({&second, 1});
  ASSERT_EQ(motions.size(), 1u);
  EXPECT_DOUBLE_EQ(motions[0].head_before.position.x(), 0);
  EXPECT_DOUBLE_EQ(motions[0].head.position.x(), 0.05);
  Random random(5);
  float furthest_m = 0;
  for (int i = 0; i < 200; ++i) {
    const Vec3f rest = random_vector(random, 0.25), is = now.moved(rest), was = before.moved(rest);
    furthest_m = std::max(furthest_m, (is - was).norm());
    // The nodes of the swing are 13 cm apart, so between them it is off by up to 1.5 mm. Hair moves by more than 8 mm.
    EXPECT_LT((is + swing_at(motion, 0, is) - was).norm(), 1.5e-3f);
  }
  EXPECT_GT(furthest_m, 8e-3f);
}

// A shader has room for the motion of kMovingMax characters. Those that fill most of the image need it most, and one
// that has just appeared has no motion.
TEST(HairMotion, motions_are_those_of_the_largest_characters_that_were_in_the_picture_before) {
  HairMotion motion;
  std::vector<MovingCharacter> all;
  for (std::uint64_t n = 0; n < HairMotion::kMovingMax + 3; ++n)
    all.push_back(character(n + 1, {}, 0.1 * static_cast<double>(n), static_cast<float>(n)));
  static_cast<void>(motion.motions(std::span(all).first(all.size() - 1)));
  const auto motions = motion.motions(all);
  ASSERT_EQ(motions.size(), HairMotion::kMovingMax);
  EXPECT_DOUBLE_EQ(motions[0].head.position.x(), 0.1 * (HairMotion::kMovingMax + 1));
  motion.forget();
  EXPECT_TRUE(motion.motions(all).empty());
}

TEST(HairMotion, character_without_an_id_has_no_motion) {
  HairMotion motion;
  const MovingCharacter one = character(0, {});
  static_cast<void>(motion.motions({&one, 1}));
  EXPECT_TRUE(motion.motions({&one, 1}).empty());
}

TEST(HairMotion, lattice_of_the_picture_before_may_be_gone) {
  HairMotion motion;
  {
    const Nodes before = bent(0.2f);
    const MovingCharacter one = character(1, before.shown());
    static_cast<void>(motion.motions({&one, 1}));
  }
  const MovingCharacter rigid = character(1, {});
  ASSERT_EQ(motion.motions({&rigid, 1}).size(), 1u);
  // The hair is rigid now, so it was bent(0.2) away: 0.2 times the square of 0.3.
  EXPECT_NEAR(swing_at(motion, 0, {0, -0.3f, 0}).x(), 0.2f * 0.09f, 1.5e-3f);
}

TEST(HairMotion, lattice_that_is_not_finite_moves_nothing) {
  Nodes broken = bent(0.2f);
  broken.displacements[7].y() = std::numeric_limits<float>::quiet_NaN();
  HairMotion motion;
  const MovingCharacter first = character(1, broken.shown()), second = character(1, {});
  static_cast<void>(motion.motions({&first, 1}));
  ASSERT_EQ(motion.motions({&second, 1}).size(), 1u);
  for (const Eigen::Vector4f& moved : motion.swing()) EXPECT_EQ(moved.norm(), 0);
}

}  // namespace
}  // namespace hairnet::draw
