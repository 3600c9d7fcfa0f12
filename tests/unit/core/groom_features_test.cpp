#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <cmath>
#include <functional>
#include <limits>
#include <random>
#include <vector>

#include "core/ffd/clump_strands.hpp"
#include "core/ffd/deform.hpp"
#include "core/groom/root_lengths.hpp"
#include "tests/support/build_grooms.hpp"
#include "tests/support/levels.hpp"

namespace hairnet {
namespace {

constexpr float kNan = std::numeric_limits<float>::quiet_NaN();

// Makes a small groom with one of each feature: a root blend, a clump of five copies of strand 2, a thread, a card, a
// cloth and a knot.
Groom make_full() {
  Groom groom = support::make_head_of_hair(6);
  groom.group_names.push_back("fabric");
  groom.root_blends.resize(groom.group_names.size());
  groom.root_blends[0].points = {{1, 0.3f}, {2, 0.9f}};
  groom.clumps = {{2, 5, 0.004f, 0.002f}};
  groom.add_thread(support::straight({0, 0.1f, 0}, {0, -1, 0}, 0.2f, 5), {.group = 2});
  groom.add_card(std::vector<Vec3f>{{-0.01f, 0.1f, 0}, {0.01f, 0.1f, 0}, {-0.01f, 0, 0}, {0.01f, 0, 0}}, {.group = 2});
  Cloth cloth;
  cloth.group = 2;
  cloth.triangles = {{0, 1, 2}};
  cloth.root_distance_m = {0, 0.1f, 0.1f};
  groom.add_cloth(std::vector<Vec3f>{{0, 0.1f, 0}, {0.1f, 0, 0}, {0, 0, 0.1f}}, cloth);
  groom.knots.push_back({.points = {3, 20, static_cast<std::uint32_t>(groom.points.size() - 1)}});
  return groom;
}

TEST(GroomFeatures, one_of_everything_is_valid) {
  EXPECT_EQ(validate(make_full()), "");
}

// Each line below corrupts one value of the valid groom. The limits are kRootBlendPointsMax = 64 points of a blend, 64
// copies of a clump (GroomLimits::copy_count_max), and the groom's own six strands and three groups.
TEST(GroomFeatures, are_refused_in_one_line_when_they_are_invalid) {
  const auto error = [](auto corrupt) {
    Groom groom = make_full();
    corrupt(groom);
    const std::string reason = validate(groom);
    EXPECT_EQ(reason.find('\n'), std::string::npos);
    return reason;
  };
  EXPECT_NE(error([](Groom& g) { g.root_blends.pop_back(); }), "");
  EXPECT_NE(error([](Groom& g) { g.root_blends[0].points[1][1] = 0.1f; }), "") << "falls";
  EXPECT_NE(error([](Groom& g) { g.root_blends[0].points[1][1] = 1.1f; }), "");
  EXPECT_NE(error([](Groom& g) { g.root_blends[0].points[1][0] = 1; }), "") << "does not rise";
  EXPECT_NE(error([](Groom& g) { g.root_blends[0].points[0][0] = kNan; }), "");
  EXPECT_NE(error([](Groom& g) { g.root_blends[0].points.assign(65, {1, 1}); }), "");
  EXPECT_NE(error([](Groom& g) { g.clumps[0].strand = 6; }), "");
  EXPECT_NE(error([](Groom& g) { g.clumps[0].copy_count = 65; }), "");
  EXPECT_NE(error([](Groom& g) { g.clumps[0].radius_m = kNan; }), "");
  EXPECT_NE(error([](Groom& g) { g.clumps.assign(7, g.clumps[0]); }), "") << "more than strands";
  EXPECT_NE(error([](Groom& g) { g.threads[0].group = 3; }), "");
  EXPECT_NE(error([](Groom& g) { g.threads[0].points.end -= 1; }), "") << "a point of nobody's";
  EXPECT_NE(error([](Groom& g) { g.threads[0].points.begin += 1; }), "");
  EXPECT_NE(error([](Groom& g) { g.threads[0].colour.x() = 2; }), "");
  EXPECT_NE(error([](Groom& g) { g.threads[0].axial_stiffness_n = -1; }), "");
  EXPECT_NE(error([](Groom& g) { g.threads[0].linear_density_kg_per_m = kNan; }), "");
  EXPECT_NE(error([](Groom& g) { g.cards[0].points.end += 1; }), "");
  EXPECT_NE(error([](Groom& g) { g.cards[0].properties.hair_count = 0; }), "");
  EXPECT_NE(error([](Groom& g) { g.cards[0].properties.group = 3; }), "");
  EXPECT_NE(error([](Groom& g) { g.cloths[0].triangles[0][1] = 0; }), "") << "a strand's point";
  EXPECT_NE(error([](Groom& g) { g.cloths[0].triangles[0][1] = ~0u; }), "");
  EXPECT_NE(error([](Groom& g) { g.cloths[0].triangles[0][1] = g.cloths[0].triangles[0][0]; }), "");
  EXPECT_NE(error([](Groom& g) { g.cloths[0].root_distance_m.pop_back(); }), "");
  EXPECT_NE(error([](Groom& g) { g.cloths[0].root_distance_m[1] = -1; }), "");
  EXPECT_NE(error([](Groom& g) { g.cloths[0].opacity = 1.5f; }), "");
  EXPECT_NE(error([](Groom& g) { g.cloths[0].area_density_kg_per_m2 = 0; }), "");
  EXPECT_NE(error([](Groom& g) { g.cloths[0].points.end = ~0u; }), "");
  EXPECT_NE(error([](Groom& g) { g.knots[0].points.resize(1); }), "");
  EXPECT_NE(error([](Groom& g) { g.knots[0].points[0] = static_cast<std::uint32_t>(g.points.size()); }), "");
  EXPECT_NE(error([](Groom& g) { g.knots[0].stiffness_n_per_m = kNan; }), "");
  EXPECT_NE(error([](Groom& g) { g.knots[0].mass_kg = -1; }), "");
  EXPECT_NE(error([](Groom& g) { g.points.emplace_back(0, 0, 0); }), "") << "a point of nobody's";
  EXPECT_NE(error([](Groom& g) { g.points.back().x() = kNan; }), "") << "of a cloth";
  GroomLimits limits;
  limits.fabric_count_max = 0;
  EXPECT_NE(validate(make_full(), limits), "");
}

// Every number of a feature has a range, but for colours and coordinates, which other tests cover. A number that is
// almost zero (below NumberRange::kSmallest = 1e-12) would give quotients that overflow, so it is refused like one that
// is too large.
TEST(GroomFeatures, are_refused_when_a_number_is_almost_zero_or_absurd) {
  const std::vector<std::function<float&(Groom&)>> numbers{
      [](Groom& g) -> float& { return g.strands[0].radius_m; },
      [](Groom& g) -> float& { return g.strands[0].hair_count; },
      [](Groom& g) -> float& { return g.strands[0].root_length_m; },
      [](Groom& g) -> float& { return g.cards[0].properties.hair_count; },
      [](Groom& g) -> float& { return g.clumps[0].radius_m; },
      [](Groom& g) -> float& { return g.clumps[0].tip_radius_m; },
      [](Groom& g) -> float& { return g.threads[0].root_length_m; },
      [](Groom& g) -> float& { return g.threads[0].radius_m; },
      [](Groom& g) -> float& { return g.threads[0].axial_stiffness_n; },
      [](Groom& g) -> float& { return g.threads[0].damping_time_s; },
      [](Groom& g) -> float& { return g.threads[0].pin_stiffness_n_per_m; },
      [](Groom& g) -> float& { return g.threads[0].linear_density_kg_per_m; },
      [](Groom& g) -> float& { return g.threads[0].air_drag_ns_per_m2; },
      [](Groom& g) -> float& { return g.cloths[0].root_length_m; },
      [](Groom& g) -> float& { return g.cloths[0].root_distance_m[1]; },
      [](Groom& g) -> float& { return g.cloths[0].opacity; },
      [](Groom& g) -> float& { return g.cloths[0].stretch_stiffness_n_per_m; },
      [](Groom& g) -> float& { return g.cloths[0].shear_stiffness_n_per_m; },
      [](Groom& g) -> float& { return g.cloths[0].damping_time_s; },
      [](Groom& g) -> float& { return g.cloths[0].pin_stiffness_n_per_m; },
      [](Groom& g) -> float& { return g.cloths[0].area_density_kg_per_m2; },
      [](Groom& g) -> float& { return g.cloths[0].air_drag_ns_per_m3; },
      [](Groom& g) -> float& { return g.knots[0].stiffness_n_per_m; },
      [](Groom& g) -> float& { return g.knots[0].damping_time_s; },
      [](Groom& g) -> float& { return g.knots[0].mass_kg; },
  };
  for (std::size_t i = 0; i < numbers.size(); ++i) {
    for (const float bad : {1e-42f, 1e-13f, -1e-42f, 2e6f, 3e38f, kNan}) {
      Groom groom = make_full();
      numbers[i](groom) = bad;
      EXPECT_THAT(validate(groom), testing::HasSubstr("in [")) << i << ": " << bad;
    }
  }
}

TEST(RootBlend, without_points_is_equation_7) {
  for (const double x : {0.0, 0.3, 1.0, 2.5, 40.0}) EXPECT_NEAR(blend_at({}, x), 1 - std::exp(-x * x), 1e-12) << x;
}

TEST(RootBlend, goes_through_its_points_and_stays_at_the_last) {
  const RootBlend blend{{{0.5f, 0.125f}, {2, 0.5f}, {3, 0.875f}}};
  EXPECT_EQ(blend_at(blend, 0), 0);
  EXPECT_NEAR(blend_at(blend, 0.5), 0.125, 1e-12);
  EXPECT_NEAR(blend_at(blend, 2), 0.5, 1e-12);
  EXPECT_NEAR(blend_at(blend, 3), 0.875, 1e-12);
  EXPECT_NEAR(blend_at(blend, 1e6), 0.875, 1e-12);
}

TEST(RootBlend, of_one_point_is_the_smooth_step) {
  const RootBlend blend{{{2, 1}}};
  for (double x = 0; x <= 2; x += 0.125) EXPECT_NEAR(blend_at(blend, x), x * x / 4 * (3 - x), 1e-12);
}

TEST(RootBlend, never_falls_or_leaves_0_to_1_and_has_no_kink) {
  std::mt19937 random(1);
  std::uniform_real_distribution<float> unit(0, 1);
  for (int n = 0; n < 300; ++n) {
    RootBlend blend;
    float x = 0, y = 0;
    for (int i = 1 + n % 8; i > 0; --i) {
      x += 0.05f + unit(random);
      y += (1 - y) * (unit(random) < 0.3f ? 0 : unit(random));
      blend.points.push_back({x, y});
    }
    ASSERT_EQ(validate(blend), "");
    constexpr double kStep = 1e-3;
    double before = 0, slope_before = 0;
    for (double at = kStep; at < 1.1 * static_cast<double>(x); at += kStep) {
      const double here = blend_at(blend, at), slope = (here - before) / kStep;
      ASSERT_GE(here, before - 1e-12);
      ASSERT_LE(here, 1);
      // The points are at least 0.05 apart and rise by up to 1, so a polyline could have a change of slope of 20 at a
      // point.
      ASSERT_LT(std::abs(slope - slope_before), 2.5) << "a cubic's bend, not a corner of 20";
      before = here;
      slope_before = slope;
    }
  }
}

TEST(RootBlend, of_each_group_rules_its_strands) {
  Groom groom;
  groom.group_names = {"free", "gel"};
  groom.root_blends = {{}, {{{1, 0.25f}, {4, 0.5f}}}};
  const std::vector<Vec3f> strand = support::straight(Vec3f::Zero(), -Vec3f::UnitY(), 0.1f, 5);
  groom.add_strand(strand, {.root_length_m = 0.02f, .group = 0});
  groom.add_strand(strand, {.root_length_m = 0.02f, .group = 1});
  groom.add_strand(strand, {.root_length_m = 0.04f, .group = 1});
  const std::vector<float> delta = root_blend(groom);
  EXPECT_NEAR(delta[1], 1 - std::exp(-1), 1e-6);
  // Each strand has 6 points, 0.02 m apart: point 1 of the second strand is at one lambda_0.
  EXPECT_NEAR(delta[6 + 1], 0.25, 1e-6);
  EXPECT_NEAR(delta[6 + 5], 0.5, 1e-6);
  EXPECT_NEAR(delta[12 + 2], 0.25, 1e-6) << "lambda_0 is the strand's own";
}

TEST(RootLengths, vary_smoothly_over_regions) {
  RootLengths lengths;
  lengths.root_length_m = 0.02f;
  lengths.regions = {{Vec3f(0, 0.1f, 0), 0.05f, 0.06f}, {Vec3f(0, -0.1f, 0), 0.05f, 0.01f}};
  EXPECT_FLOAT_EQ(root_length_at(lengths, Vec3f(0, 0.1f, 0)), 0.06f);
  EXPECT_FLOAT_EQ(root_length_at(lengths, Vec3f(0, -0.1f, 0)), 0.01f);
  EXPECT_FLOAT_EQ(root_length_at(lengths, Vec3f(0, 0, 0)), 0.02f);
  float before = root_length_at(lengths, Vec3f(0, -0.2f, 0));
  for (float y = -0.2f; y < 0.2f; y += 1e-3f) {
    const float here = root_length_at(lengths, Vec3f(0.01f, y, 0));
    // Neighbours are 1 mm apart. A step at the border of a region would be one to four centimetres.
    EXPECT_NEAR(here, before, 0.003f);
    EXPECT_GE(here, 0.01f - 1e-6f);
    EXPECT_LE(here, 0.06f + 1e-6f);
    before = here;
  }
}

TEST(RootLengths, are_random_within_their_spread_by_seed) {
  const auto lengths_of = [](std::uint32_t seed, int group) {
    Groom groom = support::make_head_of_hair(400);
    groom.strands[7].rooted = false;
    RootLengths lengths;
    lengths.spread = 0.4f;
    lengths.seed = seed;
    set_root_lengths(lengths, group, groom);
    std::vector<float> result;
    for (const StrandProperties& strand : groom.strands) result.push_back(strand.root_length_m);
    EXPECT_EQ(result[7], StrandProperties{}.root_length_m) << "has no root";
    return result;
  };
  const std::vector<float> first = lengths_of(1, kEveryGroup);
  EXPECT_EQ(first, lengths_of(1, kEveryGroup));
  EXPECT_NE(first, lengths_of(2, kEveryGroup));
  // The spread is 0.4, so lengths are 0.6 to 1.4 times the usual 0.02 m; 400 strands must come near both ends.
  const auto [least, most] = std::ranges::minmax(first);
  EXPECT_GE(least, 0.02f * 0.6f);
  EXPECT_LT(least, 0.02f * 0.65f);
  EXPECT_LE(most, 0.02f * 1.4f);
  EXPECT_GT(most, 0.02f * 1.35f);
  const std::vector<float> one_group = lengths_of(1, 1);
  for (std::size_t s = 0; s < first.size(); ++s)
    // make_head_of_hair() puts every second strand into group 1.
    EXPECT_EQ(one_group[s], s % 2 == 1 && s != 7 ? first[s] : StrandProperties{}.root_length_m);
}

Lattice make_lattice() {
  return {Vec3f(-0.2f, -0.3f, -0.2f), Vec3f(0.05f, 0.05f, 0.05f), {9, 10, 9}};
}

std::vector<Vec3f> random_displacements(const Lattice& lattice, float size_m) {
  std::mt19937 random(5);
  std::vector<Vec3f> displacements(lattice.node_count());
  for (Vec3f& d : displacements) d = support::random_vec(random, size_m);
  return displacements;
}

// Both edges of the card lie on the strand here, so both must move exactly as the strand.
TEST(Cards, follow_the_lattice_as_strands_at_the_same_place_do) {
  const Lattice lattice = make_lattice();
  const std::vector<Vec3f> line = support::straight(Vec3f(0.03f, 0.1f, 0), Vec3f(0.2f, -1, 0.1f), 0.2f, 9);
  Groom groom;
  groom.group_names = {"gel"};
  groom.root_blends = {{{{1, 0.2f}, {5, 0.8f}}}};
  groom.add_strand(line, {.root_length_m = 0.03f});
  std::vector<Vec3f> edges;
  for (const Vec3f& p : line) edges.insert(edges.end(), {p, p});
  groom.add_card(edges, {.root_length_m = 0.03f});
  ASSERT_EQ(validate(groom), "");
  for (const FfdKind kind : {FfdKind::quadratic, FfdKind::linear}) {
    std::vector<Vec3f> moved(groom.points.size());
    Deformer(groom, lattice, kind).deform(random_displacements(lattice, 0.05f), moved);
    for (std::size_t i = 0; i < line.size(); ++i) {
      EXPECT_EQ(moved[line.size() + 2 * i], moved[i]);
      EXPECT_EQ(moved[line.size() + 2 * i + 1], moved[i]);
    }
  }
}

TEST(Cloth, follows_the_lattice_by_its_distance_from_the_pins) {
  Groom groom = make_full();
  const std::vector<float> delta = root_blend(groom);
  const Cloth& cloth = groom.cloths[0];
  EXPECT_EQ(delta[cloth.points.begin], 0);
  EXPECT_NEAR(delta[cloth.points.begin + 1], 1, 1e-6);
  groom.cloths[0].root_distance_m.clear();
  for (std::uint32_t p = cloth.points.begin; p < cloth.points.end; ++p) EXPECT_EQ(root_blend(groom)[p], 1.0f);
}

TEST(Clusters, draw_their_strands_and_the_copies) {
  const Groom groom = make_full();
  const ClumpStrands strands(groom);
  ASSERT_EQ(strands.strand_begin().size(), groom.strand_count() + 5 + 1);
  std::vector<Vec3f> drawn(strands.point_count());
  strands.follow(groom.points, drawn);
  for (std::size_t i = 0; i < groom.strand_begin.back(); ++i) EXPECT_EQ(drawn[i], groom.points[i]);
  for (std::size_t copy = 0; copy < 5; ++copy) {
    const std::uint32_t begin = strands.strand_begin()[groom.strand_count() + copy];
    double largest = 0;
    for (std::size_t i = 0; i < groom.strand_points(2).size(); ++i) {
      const double offset = (drawn[begin + i] - groom.strand_points(2)[i]).norm();
      EXPECT_GT(offset, 1e-5);
      // The clump has a radius of 4 mm at the root.
      EXPECT_LT(offset, 0.0041);
      largest = std::max(largest, offset);
    }
    EXPECT_GT(largest, 0.0008);
  }
}

// A clump whose copies lost their distance from the strand would thicken or collapse as hair moves.
TEST(Clusters, keep_their_offsets_for_any_motion_of_the_lattice) {
  const Groom groom = make_full();
  const ClumpStrands strands(groom);
  const Lattice lattice = make_lattice();
  std::vector<Vec3f> moved(groom.points.size()), drawn(strands.point_count()), at_rest(strands.point_count());
  Deformer(groom, lattice, FfdKind::quadratic).deform(random_displacements(lattice, 0.03f), moved);
  strands.follow(moved, drawn);
  strands.follow(groom.points, at_rest);
  for (std::size_t copy = 0; copy < 5; ++copy) {
    const std::uint32_t begin = strands.strand_begin()[groom.strand_count() + copy];
    for (std::size_t i = 0; i < groom.strand_points(2).size(); ++i) {
      const std::uint32_t followed = groom.strand_begin[2] + static_cast<std::uint32_t>(i);
      EXPECT_NEAR((drawn[begin + i] - moved[followed]).norm(), (at_rest[begin + i] - groom.points[followed]).norm(),
                  1e-6);
    }
  }
}

// The strand turns through half a turn in 200 steps, so its tip moves 3 mm a step. A copy must move hardly more; one
// that jumped to the other side of its strand would move up to 10 mm.
TEST(Clusters, move_smoothly_with_their_strand) {
  Groom groom;
  groom.group_names = {"hair"};
  groom.add_strand(support::straight(Vec3f::Zero(), -Vec3f::UnitY(), 0.2f, 10), {});
  groom.clumps = {{0, 6, 0.005f, 0.003f}};
  const ClumpStrands strands(groom);
  std::vector<Vec3f> before, drawn(strands.point_count());
  for (int step = 0; step <= 200; ++step) {
    const float angle = 3.1f * static_cast<float>(step) / 200;
    const std::vector<Vec3f> moved =
        support::straight(Vec3f::Zero(), Vec3f(std::sin(angle), -std::cos(angle), 0.05f), 0.2f, 10);
    strands.follow(moved, drawn);
    for (std::size_t i = 0; i < before.size(); ++i) EXPECT_LT((drawn[i] - before[i]).norm(), 0.0045f);
    before = drawn;
  }
}

// Such strands have no direction beside which copies could lie, so NaN would be near.
TEST(Clusters, of_strands_without_length_are_still_defined) {
  Groom groom;
  groom.group_names = {"hair"};
  groom.add_strand(std::vector<Vec3f>{}, {});
  groom.add_strand(std::vector<Vec3f>(1, Vec3f::Zero()), {});
  groom.add_strand(std::vector<Vec3f>(4, Vec3f::Zero()), {});
  groom.clumps = {{0, 3}, {1, 3}, {2, 3}};
  ASSERT_EQ(validate(groom), "");
  const ClumpStrands strands(groom);
  std::vector<Vec3f> drawn(strands.point_count());
  strands.follow(groom.points, drawn);
  for (const Vec3f& p : drawn) EXPECT_TRUE(p.allFinite() && p.norm() < 0.01f);
}

}  // namespace
}  // namespace hairnet
