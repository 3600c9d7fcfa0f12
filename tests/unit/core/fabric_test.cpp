#include <gtest/gtest.h>

#include <cmath>
#include <numbers>
#include <numeric>

#include "client/assets/made/made.hpp"
#include "core/ffd/deform.hpp"
#include "core/levels/build.hpp"
#include "core/levels/cloth.hpp"
#include "core/levels/threads.hpp"
#include "core/solver/step.hpp"
#include "tests/support/build_grooms.hpp"
#include "tests/support/case_name.hpp"
#include "tests/support/levels.hpp"
#include "tests/unit/core/build_lists.hpp"
#include "tests/unit/core/level_checks.hpp"

namespace hairnet {
namespace {

constexpr int kColumns = 9, kRows = 13;
constexpr float kQuad_m = 0.02f;

// Makes a rectangular sheet of quads in the plane z = 0, which hangs down from y = 0. A pinned sheet has its first row
// on the head.
Groom make_sheet(bool pinned, Cloth cloth = {}) {
  Groom groom;
  groom.group_names = {"cloth"};
  std::vector<Vec3f> vertices;
  for (int r = 0; r < kRows; ++r) {
    for (int c = 0; c < kColumns; ++c) {
      vertices.emplace_back(kQuad_m * static_cast<float>(c - kColumns / 2), -kQuad_m * static_cast<float>(r), 0.0f);
      if (pinned) cloth.root_distance_m.push_back(kQuad_m * static_cast<float>(r));
    }
  }
  const auto at = [](int c, int r) { return static_cast<std::uint32_t>(r * kColumns + c); };
  for (int r = 0; r + 1 < kRows; ++r) {
    for (int c = 0; c + 1 < kColumns; ++c) {
      cloth.triangles.push_back({at(c, r), at(c, r + 1), at(c + 1, r)});
      cloth.triangles.push_back({at(c + 1, r), at(c, r + 1), at(c + 1, r + 1)});
    }
  }
  cloth.root_length_m = 0;
  groom.add_cloth(vertices, cloth);
  return groom;
}

// The sheet is 16 cm wide and 24 cm high.
constexpr double kArea_m2 = static_cast<double>(kQuad_m * kQuad_m) * (kColumns - 1) * (kRows - 1);

// Returns twice the elastic energy by area when every point x is displaced by gradient x. This is the modulus of the
// cloth when the gradient has a norm of 1.
double modulus(const Cloth& properties, const Mat3& gradient) {
  const Groom groom = make_sheet(false, properties);
  // The lattice has no whole number of quads to a cell, so that its planes cut the edges of the cloth.
  const Grid grid(fit_lattice(groom.points, {8, 9, 3}));
  StiffenerList springs, attachments;
  add_cloth(grid, groom.points, groom.cloths[0], 0, springs, attachments);
  EXPECT_EQ(attachments.count(), 0u);
  double sum = 0;
  for (std::size_t s = 0; s < springs.count(); ++s) {
    const Vec3 span = grid.to_head(springs.ends[s][1]) - grid.to_head(springs.ends[s][0]);
    Vec3 by_weights = Vec3::Zero();
    for (const auto& [node, weight] : springs.weights(s)) by_weights += weight * (gradient * grid.node_head(node));
    const double stretch = span.normalized().dot(by_weights);
    sum += springs.stiffness[s] * stretch * stretch;
  }
  return sum / kArea_m2;
}

TEST(Cloth, resists_stretching_by_its_stiffness_for_any_mesh_and_lattice) {
  Cloth cloth;
  cloth.shear_stiffness_n_per_m = 0;
  for (const int axis : {0, 1}) {
    Mat3 stretch = Mat3::Zero();
    stretch(axis, axis) = 1;
    EXPECT_NEAR(modulus(cloth, stretch), static_cast<double>(cloth.stretch_stiffness_n_per_m),
                0.01 * static_cast<double>(cloth.stretch_stiffness_n_per_m));
  }
}

TEST(Cloth, shears_less_stiffly_than_it_stretches) {
  const Cloth cloth;
  Mat3 shear = Mat3::Zero(), stretch = Mat3::Zero();
  shear(0, 1) = 1;
  stretch(0, 0) = 1;
  EXPECT_NEAR(modulus(cloth, shear), static_cast<double>(cloth.shear_stiffness_n_per_m),
              0.02 * static_cast<double>(cloth.shear_stiffness_n_per_m));
  // Woven cloth shears easily; the default Cloth has far more stiffness along its threads.
  EXPECT_GT(modulus(cloth, stretch), 5 * modulus(cloth, shear));
}

TEST(Cloth, turns_freely) {
  Mat3 turn = Mat3::Zero();
  turn(0, 1) = 1;
  turn(1, 0) = -1;
  EXPECT_LT(modulus(Cloth{}, turn), 1e-6);
}

// drag[5] is the zz entry, across the sheet, which lies in the plane z = 0. Air passes along it freely.
TEST(Cloth, gives_its_weight_by_area_and_its_drag_across) {
  const Groom groom = make_sheet(false);
  const Grid grid(fit_lattice(groom.points, {8, 9, 3}));
  LumpedHair shares(grid.node_count());
  lump_cloth(grid, groom.points, groom.cloths[0], groom.materials.base, shares);
  const double mass = std::accumulate(shares.mass.begin(), shares.mass.end(), 0.0);
  EXPECT_NEAR(mass, static_cast<double>(Cloth{}.area_density_kg_per_m2) * kArea_m2, 1e-6 * mass);
  Vec3 moment = Vec3::Zero();
  std::array<double, 6> drag{};
  for (std::uint32_t n = 0; n < grid.node_count(); ++n) {
    moment += shares.mass[n] * grid.node_head(n);
    for (int c = 0; c < 6; ++c) drag[c] += shares.drag[n][c];
  }
  EXPECT_LT((moment / mass - Vec3(0, -0.5 * static_cast<double>(kQuad_m) * (kRows - 1), 0)).norm(), 1e-5);
  const double whole = static_cast<double>(Cloth{}.air_drag_ns_per_m3) * kArea_m2;
  EXPECT_NEAR(drag[5], whole, 1e-5 * whole);
  for (const int c : {0, 1, 2, 3, 4}) EXPECT_NEAR(drag[c], 0, 1e-9);
}

// Returns the sheet's points in world space 15 s after the head has begun to tilt about X, out of the plane of the
// sheet. The tilt takes the first two seconds; then hair comes to rest.
std::vector<Vec3> sheet_after_tilt(const Groom& groom, const Level& level, double tilt_rad) {
  LatticeState state;
  reset_to_rest(level, state);
  StepScratch scratch;
  StepInput input;
  for (int tick = 1; tick <= 450; ++tick) {
    input.from = input.to;
    input.to = rigid_pose(support::turned(tilt_rad * std::min(1.0, tick / 60.0), Vec3::UnitX()));
    EXPECT_TRUE(step(level, input, {.iterations = 40}, scratch, state));
  }
  std::vector<Vec3f> grid(level.geometry.lattice.node_count()), points(groom.points.size());
  expand_displacements(level.geometry, state.displacement, grid);
  Deformer(groom, level.geometry.lattice, FfdKind::linear).deform(grid, points);
  std::vector<Vec3> world;
  for (const Vec3f& p : points) world.push_back(input.to.head().point(p.cast<double>()));
  return world;
}

TEST(Cloth, hangs_from_its_pins_without_growing) {
  const Groom groom = make_sheet(true);
  ASSERT_EQ(validate(groom), "");
  const double tilt = 35 * std::numbers::pi / 180;
  for (const std::size_t level : {0u, 2u}) {
    const std::vector<Vec3> points = sheet_after_tilt(groom, *build_level(groom, kLevelSpecs[level]), tilt);
    const RigidTransform head = support::turned(tilt, Vec3::UnitX());
    for (int c = 0; c < kColumns; ++c) {
      const Vec3 pin = head.point(groom.points[static_cast<std::size_t>(c)].cast<double>());
      EXPECT_LT((points[static_cast<std::size_t>(c)] - pin).norm(), 0.012) << "column " << c;
    }
    const std::size_t middle = kColumns / 2, hem = (kRows - 1) * kColumns + middle;
    const Vec3 down = points[hem] - points[middle];
    // The head is tilted by 35 degrees. The sheet must hang within 12 degrees of the vertical, and have the length of
    // its design within 2 cm.
    EXPECT_LT(std::acos(-down.normalized().y()) * 180 / std::numbers::pi, 12) << down.transpose();
    EXPECT_NEAR(down.norm(), static_cast<double>(kQuad_m) * (kRows - 1), 0.02);
  }
}

TEST(Cloth, without_area_or_with_coincident_points_gives_a_valid_level) {
  Groom groom = support::make_head_of_hair(20);
  const std::vector<Vec3f> points(4, Vec3f(0, 0.1f, 0));
  Cloth cloth;
  cloth.triangles = {{0, 1, 2}, {1, 2, 3}};
  groom.add_cloth(points, cloth);
  groom.add_cloth(points, {});
  ASSERT_EQ(validate(groom), "");
  for (const LevelSpec& spec : kLevelSpecs) support::expect_valid(*build_level(groom, spec));
}

TEST(Cloth, alone_makes_a_level) {
  const auto set = build_levels(make_sheet(true), {});
  ASSERT_TRUE(set);
  for (const Level& level : set->levels) support::expect_valid(level);
  EXPECT_GT((*set)[LevelIndex::high].springs.count(), 100u);
  EXPECT_GT((*set)[LevelIndex::high].attachments.count(), 0u);
}

Groom make_threaded(float axial_stiffness_n) {
  Groom groom;
  groom.group_names = {"thread"};
  Thread thread;
  thread.axial_stiffness_n = axial_stiffness_n;
  thread.rooted = true;
  thread.root_length_m = 0;
  groom.add_thread(support::straight(Vec3f::Zero(), -Vec3f::UnitY(), 0.3f, 10), thread);
  return groom;
}

TEST(Thread, has_the_stiffness_and_weight_that_it_states) {
  const Groom groom = make_threaded(0.5f);
  ASSERT_EQ(validate(groom), "");
  const auto level = build_level(groom, kLevelSpecs[0]);
  support::expect_valid(*level);
  double compliance = 0;
  for (std::size_t s = 0; s < level->springs.count(); ++s)
    compliance += 1 / static_cast<double>(level->springs.stiffness[s]);
  // Springs in a row have the stiffness of the whole thread: 0.5 N over 0.3 m.
  EXPECT_NEAR(1 / compliance, 0.5 / 0.3, 0.01) << "springs in a row";
  const double mass = std::accumulate(level->mass.begin(), level->mass.end(), 0.0);
  // The ether has half of the thread's mass (Material::ether_mass_ratio) on top of it.
  EXPECT_NEAR(mass, 1.5 * 0.3 * static_cast<double>(Thread{}.linear_density_kg_per_m), 1e-3 * mass);
  ASSERT_EQ(level->attachments.count(), 1u);
  EXPECT_FLOAT_EQ(level->attachments.stiffness[0], Thread{}.pin_stiffness_n_per_m);
}

TEST(Thread, stretches_less_the_stiffer_it_is) {
  const auto stretch_in_a_jerk = [](float axial_n) {
    const Groom groom = make_threaded(axial_n);
    const auto level = build_level(groom, kLevelSpecs[0]);
    LatticeState state;
    reset_to_rest(*level, state);
    StepScratch scratch;
    StepInput input;
    double most = 0;
    for (int tick = 1; tick <= 30; ++tick) {
      input.from = input.to;
      const double t = tick * input.step_s;
      // The head is jerked upwards at 20 m/s^2, about 2 g.
      input.to = rigid_pose({Quat::Identity(), Vec3(0, 0.5 * 20 * t * t, 0)});
      EXPECT_TRUE(step(*level, input, {.iterations = 60}, scratch, state));
      std::vector<Vec3f> grid(level->geometry.lattice.node_count()), points(groom.points.size());
      expand_displacements(level->geometry, state.displacement, grid);
      Deformer(groom, level->geometry.lattice, FfdKind::linear).deform(grid, points);
      most = std::max(most, static_cast<double>((points.back() - points.front()).norm()) - 0.3);
    }
    return most;
  };
  // A hair has 4e-4 N. A ribbon's thread of 0.5 N must look as if it had one length.
  EXPECT_GT(stretch_in_a_jerk(0.002f), 4 * stretch_in_a_jerk(0.1f));
  EXPECT_LT(stretch_in_a_jerk(0.5f), 0.003);
}

TEST(Fabric, is_never_merged_with_hair) {
  Groom hair = support::make_head_of_hair(300);
  Groom both = hair;
  Thread thread;
  thread.axial_stiffness_n = 7;
  both.add_thread(support::straight(Vec3f(0, 0.1f, 0), -Vec3f::UnitY(), 0.2f, 10), thread);
  const auto level = build_level(both, {{7, 7, 7}, 40, 10});
  const float stiffest = *std::max_element(level->springs.stiffness.begin(), level->springs.stiffness.end());
  // A thread of 7 N over a cell's length of some 3.5 cm is a spring of 200 N/m, far stiffer than a strand of 20 hairs.
  // A merge with hair would have averaged it away.
  EXPECT_GT(stiffest, 100);
}

class FabricInHairstyles : public testing::TestWithParam<std::string_view> {};

// A fabric that pulls in its design would bend hair before anything moves. The displacements must be 0 to the bit.
TEST_P(FabricInHairstyles, leave_the_design_in_exact_equilibrium) {
  const Groom groom = make_hairstyle(GetParam(), {.strand_count = 300}).value();
  const auto set = build_levels(groom);
  for (const Level& level : set->levels) {
    support::expect_valid(level);
    LatticeState state;
    reset_to_rest(level, state);
    StepScratch scratch;
    StepInput input;
    input.from = input.to = rigid_pose({Quat::Identity(), Vec3(0.3, 1.5, -2)});
    for (int tick = 0; tick < 100; ++tick) ASSERT_TRUE(step(level, input, {}, scratch, state));
    for (const Vec3f& d : state.displacement) ASSERT_EQ(d, Vec3f(Vec3f::Zero()));
  }
}

TEST_P(FabricInHairstyles, stay_intact_when_thrown_about) {
  const Groom groom = make_hairstyle(GetParam(), {.strand_count = 300}).value();
  const Motion motion = make_motion("dance", {.duration_s = 3, .rate_hz = 30}).value();
  for (const LevelSpec& spec : kLevelSpecs) {
    const auto level = build_level(groom, spec);
    LatticeState state;
    reset_to_rest(*level, state);
    StepScratch scratch;
    StepInput input;
    input.to = motion.poses.front();
    for (const Pose& pose : motion.poses) {
      input.from = input.to;
      input.to = pose;
      ASSERT_TRUE(step(*level, input, {}, scratch, state));
    }
    // A lattice that comes apart is thrown many metres away; no node of swinging hair is 1.5 m from its design.
    for (const Vec3f& d : state.displacement) ASSERT_LT(d.norm(), 1.5f);
  }
}

INSTANTIATE_TEST_SUITE_P(Made, FabricInHairstyles, testing::Values("ponytail", "plait", "veiled", "strips", "locks"),
                         support::CaseName());

}  // namespace
}  // namespace hairnet
