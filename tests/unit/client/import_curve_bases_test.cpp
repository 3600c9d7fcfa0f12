#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <random>

#include "client/assets/import/curve_bases.hpp"
#include "client/assets/import/curve_sets.hpp"

namespace hairnet {
namespace {

using Points = std::vector<Vec3f>;

constexpr CurveBasis kCubics[] = {CurveBasis::bezier, CurveBasis::bspline, CurveBasis::catmull_rom};

Points sampled(CurveBasis basis, CurveWrap wrap, const Points& controls, float tolerance = 1e-3f) {
  const auto curve = sample_curve(basis, wrap, controls, tolerance);
  EXPECT_TRUE(curve) << curve.error();
  Points points;
  for (const CurvePoint& point : curve.value_or(std::vector<CurvePoint>{}))
    points.push_back(value_at(point, std::span<const Vec3f>(controls)));
  return points;
}

std::string refusal(CurveBasis basis, CurveWrap wrap, std::size_t count) {
  Points controls(count);
  for (std::size_t i = 0; i < count; ++i) controls[i] = Vec3f(static_cast<float>(i * i), 1, static_cast<float>(i));
  const auto curve = sample_curve(basis, wrap, controls, 1e-3f);
  return curve ? std::string() : curve.error();
}

// Returns random control points. Each case has a seed of its own, so that no two share their points.
Points random_controls(std::size_t count, unsigned seed) {
  std::mt19937 random(seed);
  std::uniform_real_distribution<float> in(-1, 1);
  Points controls;
  for (std::size_t i = 0; i < count; ++i) controls.emplace_back(in(random), in(random), in(random));
  return controls;
}

// Returns the distance of a point from a polyline.
float distance_to(const Points& line, const Vec3f& x) {
  float nearest = (line[0] - x).norm();
  for (std::size_t i = 1; i < line.size(); ++i) {
    const Vec3f along = line[i] - line[i - 1];
    const float t =
        along.squaredNorm() > 0 ? std::clamp((x - line[i - 1]).dot(along) / along.squaredNorm(), 0.f, 1.f) : 0;
    nearest = std::min(nearest, (line[i - 1] + t * along - x).norm());
  }
  return nearest;
}

TEST(CurveBases, a_linear_curve_is_its_control_points) {
  const Points controls = random_controls(7, 1);
  EXPECT_EQ(sampled(CurveBasis::linear, CurveWrap::open, controls), controls);
  EXPECT_EQ(sampled(CurveBasis::linear, CurveWrap::pinned, controls), controls);
  Points closed = controls;
  closed.push_back(controls[0]);
  EXPECT_EQ(sampled(CurveBasis::linear, CurveWrap::periodic, controls), closed);
  EXPECT_EQ(sampled(CurveBasis::linear, CurveWrap::periodic, closed), closed) << "closed already";
}

TEST(CurveBases, even_collinear_control_points_make_a_line_without_points_between_segments) {
  Points controls;
  for (int i = 0; i < 10; ++i) controls.push_back(Vec3f(1, 2, 3) + static_cast<float>(i) * Vec3f(0.5f, -1, 0.25f));
  for (const CurveBasis basis : kCubics) {
    const Points line = sampled(basis, CurveWrap::open, controls);
    // Ten control points make three Bezier segments, and seven segments of the other bases, each with one more end.
    // A straight segment needs no point in between.
    EXPECT_EQ(line.size(), basis == CurveBasis::bezier ? 4u : 8u);
    for (const Vec3f& x : line) EXPECT_LT(distance_to({controls.front(), controls.back()}, x), 1e-5f);
  }
}

TEST(CurveBases, a_bezier_curve_hits_its_ends_and_every_third_control_point) {
  const Points controls = random_controls(10, 2), line = sampled(CurveBasis::bezier, CurveWrap::open, controls);
  EXPECT_EQ(line.front(), controls.front());
  for (std::size_t i = 0; i < 10; i += 3) EXPECT_NE(std::ranges::find(line, controls[i]), line.end()) << i;
}

// An open Catmull-Rom curve leaves out its first and last control point; they only give the direction.
TEST(CurveBases, a_catmull_rom_curve_passes_through_its_control_points) {
  const Points controls = random_controls(8, 3);
  const Points open = sampled(CurveBasis::catmull_rom, CurveWrap::open, controls),
               pinned = sampled(CurveBasis::catmull_rom, CurveWrap::pinned, controls),
               closed = sampled(CurveBasis::catmull_rom, CurveWrap::periodic, controls);
  for (std::size_t i = 0; i < 8; ++i) {
    EXPECT_NE(std::ranges::find(pinned, controls[i]), pinned.end()) << i;
    EXPECT_NE(std::ranges::find(closed, controls[i]), closed.end()) << i;
    EXPECT_EQ(std::ranges::find(open, controls[i]) != open.end(), i > 0 && i < 7) << i;
  }
  EXPECT_EQ(pinned.front(), controls.front());
  EXPECT_EQ(pinned.back(), controls.back());
}

TEST(CurveBases, a_b_spline_begins_between_its_first_points_and_pinned_at_the_first) {
  const Points controls = random_controls(6, 4);
  const Points open = sampled(CurveBasis::bspline, CurveWrap::open, controls),
               pinned = sampled(CurveBasis::bspline, CurveWrap::pinned, controls);
  EXPECT_LT((open.front() - (controls[0] + 4 * controls[1] + controls[2]) / 6).norm(), 1e-6f);
  EXPECT_LT((open.back() - (controls[3] + 4 * controls[4] + controls[5]) / 6).norm(), 1e-6f);
  EXPECT_LT((pinned.front() - controls.front()).norm(), 1e-6f);
  EXPECT_LT((pinned.back() - controls.back()).norm(), 1e-6f);
  const Points pair{Vec3f(0, 0, 0), Vec3f(3, 0, 0)};
  EXPECT_EQ(sampled(CurveBasis::bspline, CurveWrap::pinned, pair).back(), pair.back());
}

TEST(CurveBases, periodic_curves_are_closed) {
  for (const CurveBasis basis : kCubics) {
    const Points line = sampled(basis, CurveWrap::periodic, random_controls(9, 5));
    EXPECT_LT((line.front() - line.back()).norm(), 1e-6f);
  }
}

TEST(CurveBases, what_repeats_its_begin_at_its_end_is_not_closed_twice) {
  Points circle;
  for (int i = 0; i < 8; ++i)
    // Eight points, 45 degrees (0.785398 rad) apart.
    circle.emplace_back(std::cos(0.785398f * static_cast<float>(i)), 0, std::sin(0.785398f * static_cast<float>(i)));
  Points repeated = circle;
  // Some programs close a cubic curve by three more control points, equal to the first three.
  repeated.insert(repeated.end(), circle.begin(), circle.begin() + 3);
  const Points once = sampled(CurveBasis::bspline, CurveWrap::periodic, circle),
               from_repeated = sampled(CurveBasis::bspline, CurveWrap::periodic, repeated);
  ASSERT_EQ(once.size(), from_repeated.size());
  for (std::size_t i = 0; i < once.size(); ++i) EXPECT_LT((once[i] - from_repeated[i]).norm(), 1e-6f);
  Points bezier = random_controls(6, 6);
  bezier.push_back(bezier[0]);
  EXPECT_LT((sampled(CurveBasis::bezier, CurveWrap::periodic, bezier).back() - bezier[0]).norm(), 1e-6f);
}

TEST(CurveBases, the_polyline_stays_within_the_tolerance_and_finer_ones_have_more_points) {
  for (const CurveBasis basis : kCubics) {
    for (const CurveWrap wrap : {CurveWrap::open, CurveWrap::periodic, CurveWrap::pinned}) {
      const Points controls = random_controls(wrap == CurveWrap::periodic ? 12 : 13, 7);
      const Points exact = sampled(basis, wrap, controls, 1e-6f);
      std::size_t fewer = 0;
      for (const float tolerance : {0.1f, 0.01f, 0.002f}) {
        const Points line = sampled(basis, wrap, controls, tolerance);
        for (const Vec3f& x : exact) EXPECT_LT(distance_to(line, x), 1.01f * tolerance);
        EXPECT_GT(line.size(), fewer);
        fewer = line.size();
      }
      // The finest of the three tolerances must not take hundreds of points for a dozen control points.
      EXPECT_LT(fewer, 300u);
    }
  }
}

// Widths and colours belong to control points and must follow the points on the curve. Here the values are the
// heights, so that the right answer is known.
TEST(CurveBases, values_at_control_points_are_interpolated_as_positions_are) {
  const Points controls = random_controls(7, 8);
  std::vector<float> heights;
  for (const Vec3f& x : controls) heights.push_back(x.y());
  for (const CurveBasis basis : kCubics) {
    const auto curve = sample_curve(basis, CurveWrap::open, controls, 1e-3f);
    ASSERT_TRUE(curve) << curve.error();
    for (const CurvePoint& point : *curve)
      EXPECT_NEAR(value_at(point, std::span<const float>(heights)),
                  value_at(point, std::span<const Vec3f>(controls)).y(), 1e-5f);
    EXPECT_EQ(curve->front().segment, 0);
    EXPECT_EQ(curve->back().segment, basis == CurveBasis::bezier ? 2 : 4);
  }
}

Points with_knots(std::size_t order, const std::vector<float>& knots, const Points& controls) {
  const auto curve = sample_knots(order, knots, controls, 1e-3f);
  EXPECT_TRUE(curve) << curve.error();
  Points points;
  for (const CurvePoint& point : curve.value_or(std::vector<CurvePoint>{}))
    points.push_back(value_at(point, std::span<const Vec3f>(controls)));
  return points;
}

TEST(CurveBases, even_knots_make_the_b_spline_without_knots_and_knots_for_bezier_its_curve) {
  const Points seven = random_controls(7, 9), four = random_controls(4, 10);
  std::vector<float> even;
  for (int i = 0; i < 11; ++i) even.push_back(0.5f * static_cast<float>(i));
  const auto is_near = [](const Points& a, const Points& b) {
    for (const Vec3f& x : a) EXPECT_LT(distance_to(b, x), 1e-3f);
    for (const Vec3f& x : b) EXPECT_LT(distance_to(a, x), 1e-3f);
  };
  is_near(with_knots(4, even, seven), sampled(CurveBasis::bspline, CurveWrap::open, seven));
  is_near(with_knots(4, {0, 0, 0, 0, 1, 1, 1, 1}, four), sampled(CurveBasis::bezier, CurveWrap::open, four));
}

TEST(CurveBases, repeated_knots_at_the_ends_hit_the_outer_control_points_and_order_2_is_a_polyline) {
  const Points controls = random_controls(6, 11);
  const Points cubic = with_knots(4, {0, 0, 0, 0, 1, 2, 3, 3, 3, 3}, controls),
               parabola = with_knots(3, {0, 0, 0, 1, 2, 3, 4, 4, 4}, controls);
  for (const Points& line : {cubic, parabola}) {
    EXPECT_LT((line.front() - controls.front()).norm(), 1e-6f);
    EXPECT_LT((line.back() - controls.back()).norm(), 1e-6f);
  }
  EXPECT_EQ(with_knots(2, {0, 0, 1, 2, 3, 4, 5, 5}, controls), controls);
}

TEST(CurveBases, knots_that_do_not_fit_are_refused) {
  const Points controls = random_controls(5, 12);
  const auto refused = [&](std::size_t order, const std::vector<float>& knots) {
    const auto curve = sample_knots(order, knots, controls, 1e-3f);
    return curve ? std::string() : curve.error();
  };
  // A curve has as many knots as points and its order together, in ascending order.
  EXPECT_EQ(refused(4, {0, 0, 0, 0, 1, 1, 1, 1}), "has 5 points and 8 knots, which must be 4 more than the points");
  EXPECT_EQ(refused(4, {0, 0, 0, 0, 2, 1, 3, 3, 3}), "has knots that do not ascend");
  EXPECT_EQ(refused(4, std::vector<float>(9, 1.f)), "has knots that do not ascend");
  EXPECT_EQ(refused(4, std::vector<float>(9, std::nanf(""))), "has knots that do not ascend");
  EXPECT_EQ(refused(6, std::vector<float>(11, 1.f)), "is of order 6, and only 2 to 4 are read");
}

TEST(CurveBases, impossible_counts_are_refused_and_points_in_one_place_are_not) {
  EXPECT_EQ(refusal(CurveBasis::linear, CurveWrap::open, 1), "has 1 point, where a linear curve has at least 2");
  EXPECT_EQ(refusal(CurveBasis::bezier, CurveWrap::open, 8), "has 8 points, where a Bezier curve has 4, 7, 10, ...");
  EXPECT_EQ(refusal(CurveBasis::bezier, CurveWrap::periodic, 7),
            "has 7 points, where a closed Bezier curve has 3, 6, 9, ...");
  EXPECT_EQ(refusal(CurveBasis::bspline, CurveWrap::open, 3), "has 3 points, where a B-spline curve has at least 4");
  EXPECT_NE(refusal(CurveBasis::catmull_rom, CurveWrap::periodic, 2), "");
  EXPECT_NE(refusal(CurveBasis::catmull_rom, CurveWrap::pinned, 1), "");
  for (const CurveBasis basis :
       {CurveBasis::linear, CurveBasis::bezier, CurveBasis::bspline, CurveBasis::catmull_rom}) {
    for (const CurveWrap wrap : {CurveWrap::open, CurveWrap::periodic, CurveWrap::pinned})
      EXPECT_NE(refusal(basis, wrap, 0), "");
  }
  const Points same(4, Vec3f(1, 2, 3));
  EXPECT_EQ(curve_tolerance(same), 0);
  // Even a tolerance of zero divides a segment into at most kPiecesMax, 64, pieces (curve_bases.cpp).
  EXPECT_LE(sampled(CurveBasis::bspline, CurveWrap::open, same, 0).size(), 65u);
}

TEST(CurveSets, of_few_curves_each_are_thinned_as_one_list) {
  CurveSet three;
  for (std::uint32_t c = 1; c <= 3; ++c) {
    three.controls.insert(three.controls.end(), {Vec3f(0, 0, 0), Vec3f(0, static_cast<float>(c), 0)});
    three.begin.push_back(2 * c);
  }
  // In all there are one and a half times as many curves as a groom may have, so every second one is left out. If
  // each set were thinned by itself, all sets would lose the same curve, and hair of one length would vanish.
  const std::vector<CurveSet> sets(GroomLimits{}.strand_count_max / 2, three);
  const Result<ImportedStrands> strands = strands_of(sets);
  ASSERT_TRUE(strands) << strands.error();
  EXPECT_EQ(strands->strand_count(), 3 * sets.size() / 2) << "one of two";
  EXPECT_EQ(std::ranges::count(strands->points, Vec3f(0, 2, 0)), std::ranges::count(strands->points, Vec3f(0, 1, 0)));
}

}  // namespace
}  // namespace hairnet
