#include <gtest/gtest.h>

#include <cmath>
#include <numbers>

#include "core/groom/material_scale.hpp"
#include "core/levels/build.hpp"
#include "core/solver/step.hpp"
#include "tests/support/build_grooms.hpp"
#include "tests/support/case_name.hpp"

// Compares built hair in the wind, and after it, with what can be worked out by hand.
namespace hairnet {
namespace {

// The fourth level is `ether`, which has no springs.
constexpr LevelSpec kEtherOnly = kLevelSpecs[3];

// Straight strands that hang 30 cm from a row of roots.
Groom make_curtain(const Material& material = {}) {
  Groom groom;
  for (int s = 0; s < 40; ++s) {
    const Vec3f root(0.01f * static_cast<float>(s % 8), 0.1f, 0.02f * static_cast<float>(s / 8));
    support::add(groom, support::straight(root, {0, -1, 0}, 0.3f, 12));
  }
  set_material(material, groom);
  return groom;
}

Environment steady(const Vec3& mean) {
  Wind wind;
  wind.mean_m_per_s = mean;
  Environment environment;
  environment.wind = WindField(wind);
  return environment;
}

// Returns the state after 20 s (1200 steps of 1/60 s) in a steady environment.
LatticeState settled(const Level& level, const Environment& environment, const MaterialScale& material = {}) {
  LatticeState state;
  reset_to_rest(level, state);
  StepScratch scratch;
  StepInput input;
  input.step_s = 1.0 / 60;
  input.environment = &environment;
  input.material = material;
  for (int tick = 0; tick < 1200; ++tick) {
    input.time_s += input.step_s;
    EXPECT_TRUE(step(level, input, {.iterations = 20}, scratch, state));
  }
  return state;
}

double rms_m(const LatticeState& state) {
  double sum = 0;
  for (const Vec3f& d : state.displacement) sum += static_cast<double>(d.squaredNorm());
  return std::sqrt(sum / static_cast<double>(state.displacement.size()));
}

Mat3f drag_of(const Level& level, std::size_t node) {
  const auto& [xx, xy, xz, yy, yz, zz] = level.drag[node];
  return Mat3f{{xx, xy, xz}, {xy, yy, yz}, {xz, yz, zz}};
}

// In a steady wind hair comes to rest where the drag equals the force of the ether on each node.
TEST(WindOnHair, ends_where_each_nodes_drag_and_ether_balance) {
  const auto level = build_level(support::make_odd_groom(), kEtherOnly);
  const Vec3f wind(2, 0.5f, -1);
  const LatticeState state = settled(*level, steady(wind.cast<double>()));
  float displaced = 0;
  for (std::size_t i = 0; i < level->rest.size(); ++i) {
    const Vec3f balance = drag_of(*level, i) * wind / level->ether_stiffness[i];
    EXPECT_LT((state.displacement[i] - balance).norm(), 1e-5f + 1e-3f * balance.norm());
    displaced = std::max(displaced, balance.norm());
  }
  EXPECT_GT(displaced, 0.01f);
}

TEST(WindOnHair, catches_hair_across_it_and_passes_along_it) {
  const auto level = build_level(make_curtain(), kEtherOnly);
  const double across = rms_m(settled(*level, steady({2, 0, 0}))), along = rms_m(settled(*level, steady({0, -2, 0})));
  EXPECT_GT(across, 0.02);
  EXPECT_LT(along, 1e-6);
}

TEST(WindOnHair, carries_it_the_way_it_blows_and_springs_keep_its_length) {
  const auto level = build_level(make_curtain(), kLevelSpecs[0]);
  const LatticeState state = settled(*level, steady({3, 0, 0}));
  Vec3f tips = Vec3f::Zero(), roots = Vec3f::Zero();
  int tip_count = 0, root_count = 0;
  for (std::size_t i = 0; i < level->rest.size(); ++i) {
    // The curtain hangs from y = 0.1 to y = -0.2.
    if (level->rest[i].y() < -0.15f) tips += state.displacement[i], ++tip_count;
    if (level->rest[i].y() > 0.08f) roots += state.displacement[i], ++root_count;
  }
  tips /= static_cast<float>(tip_count);
  roots /= static_cast<float>(root_count);
  EXPECT_GT(tips.x(), 0.05f);
  EXPECT_GT(tips.x(), 5 * std::abs(roots.x()));
  // The strands keep their length, so their ends must rise as they move to the side.
  EXPECT_GT(tips.y(), 0);
}

TEST(WindOnHair, wet_hair_hardly_moves_soft_hair_flies) {
  const auto blown = [](std::string_view name) {
    return rms_m(settled(*build_level(make_curtain(*make_material(name)), kEtherOnly), steady({2, 0, 0})));
  };
  const double normal = blown("normal");
  EXPECT_GT(blown("soft"), 1.5 * normal);
  EXPECT_LT(blown("wet"), 0.25 * normal);
  EXPECT_LT(blown("gelled"), 0.1 * normal);
  EXPECT_LT(blown("stiff"), 0.6 * normal);
}

TEST(WindOnHair, a_change_of_material_ends_where_hair_built_of_it_does) {
  const auto built = build_level(make_curtain(), kLevelSpecs[2]);
  for (const std::string_view name : material_names()) {
    const Material wanted = *make_material(name);
    const auto other = build_level(make_curtain(wanted), kLevelSpecs[2]);
    const LatticeState a = settled(*built, steady({2, 0, 0}), scale_between({}, wanted));
    const LatticeState b = settled(*other, steady({2, 0, 0}));
    // A change of material scales attachments by the factor of the springs, though they have one of their own, so the
    // two do not end in quite the same state.
    const double tolerance_m = 0.1 * rms_m(b);
    double sum = 0;
    for (std::size_t i = 0; i < built->rest.size(); ++i)
      sum += static_cast<double>((a.displacement[i] - b.displacement[i]).squaredNorm());
    EXPECT_LT(std::sqrt(sum / static_cast<double>(built->rest.size())), tolerance_m) << name;
  }
}

// Releases all nodes 5 cm to the side. The parameter is the damping ratio zeta of the ether: an oscillator of this
// ratio passes the middle and reaches exp(-pi zeta / sqrt(1 - zeta^2)) of its start on the other side.
class Swing : public testing::TestWithParam<support::Named<float>> {};

TEST_P(Swing, of_a_node_dies_out_by_the_ratio_asked_for) {
  Material material;
  material.ether_damping_ratio = GetParam().value;
  material.air_drag_ns_per_m2 = 0;
  const auto level = build_level(make_curtain(material), kEtherOnly);
  LatticeState state;
  reset_to_rest(*level, state);
  for (Vec3f& d : state.displacement) d.x() = 0.05f;
  StepScratch scratch;
  StepInput input;
  input.step_s = 1.0 / 240;
  std::vector<float> lowest(state.displacement.size(), 0.0f);
  for (int tick = 0; tick < 480; ++tick) {
    ASSERT_TRUE(step(*level, input, {.iterations = 1}, scratch, state));
    for (std::size_t i = 0; i < lowest.size(); ++i) lowest[i] = std::min(lowest[i], state.displacement[i].x());
  }
  const double zeta = GetParam().value;
  const double overshoot = std::exp(-zeta * std::numbers::pi / std::sqrt(1 - zeta * zeta));
  for (const float low : lowest) EXPECT_NEAR(-static_cast<double>(low) / 0.05, overshoot, 0.05);
}

INSTANTIATE_TEST_SUITE_P(Ratios, Swing,
                         testing::Values(support::Named{"tenth", 0.1f}, support::Named{"fifth", 0.2f},
                                         support::Named{"half", 0.5f}),
                         support::CaseName());

}  // namespace
}  // namespace hairnet
