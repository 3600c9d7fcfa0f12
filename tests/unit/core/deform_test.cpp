#include "core/ffd/deform.hpp"

#include <gtest/gtest.h>
#include <hwy/targets.h>

#include <algorithm>
#include <cstring>
#include <numeric>
#include <thread>
#include <tuple>

#include "core/ffd/reference_deform.hpp"
#include "tests/support/case_name.hpp"
#include "tests/unit/core/deform_cases.hpp"

namespace hairnet {
namespace {

using namespace deform_cases;
using support::random_vec;

bool same_bits(std::span<const Vec3f> a, std::span<const Vec3f> b) {
  return a.size() == b.size() && std::memcmp(a.data(), b.data(), a.size_bytes()) == 0;
}

// Runs each test with every kind of FFD, by every instruction set that this machine has.
using Case = std::tuple<support::Named<FfdKind>, support::Named<std::int64_t>>;
class WideDeformCases : public testing::TestWithParam<Case> {
 protected:
  void SetUp() override { hwy::SetSupportedTargetsForTest(std::get<1>(GetParam()).value); }
  void TearDown() override { hwy::SetSupportedTargetsForTest(0); }
  static FfdKind kind() { return std::get<0>(GetParam()).value; }
};

std::vector<support::Named<std::int64_t>> instruction_sets() {
  std::vector<support::Named<std::int64_t>> sets;
  for (const std::int64_t set : hwy::SupportedAndGeneratedTargets()) sets.push_back({hwy::TargetName(set), set});
  return sets;
}
INSTANTIATE_TEST_SUITE_P(AllTargets, WideDeformCases,
                         testing::Combine(testing::ValuesIn(kFfdKinds), testing::ValuesIn(instruction_sets())),
                         support::CaseName());

// The allowed error is the rounding of x itself and that of t. The latter is some 1e-7 of a cell for every cell from
// the origin, times the difference of u across a cell. Both grow with the extrapolation outside the grid (reach()).
TEST_P(WideDeformCases, agrees_with_the_reference_wherever_the_point_is) {
  constexpr float kDisplaced_m = 0.05f;
  // The smallest lattice of quadratic FFD, one with a different count on each axis, and that of the high level.
  for (const std::array<int, 3> dims : {std::array{3, 3, 3}, {6, 5, 4}, {10, 10, 10}}) {
    const Lattice lattice = make_lattice(dims);
    const Points points = make_points(lattice, 5);
    const std::vector<Vec3f> displacements = random_displacements(lattice, kDisplaced_m, 6);
    std::vector<Vec3f> moved(points.x.size()), tangents(points.x.size()), moved_alone(points.x.size());
    const Deformer deformer = points.deformer(lattice, kind());
    deformer.deform(displacements, moved, tangents);
    deformer.deform(displacements, moved_alone);
    EXPECT_TRUE(same_bits(moved, moved_alone));
    for (std::size_t p = 0; p < points.x.size(); ++p) {
      const DeformedPoint exact =
          reference_deform(lattice, kind(),
                           {points.x[p].cast<double>(), double{points.blend[p]},
                            points.rest.direction[p].cast<double>(), double{points.rest.blend_slope[p]}},
                           displacements);
      const double displaced = kDisplaced_m * reach(lattice, points.x[p]);
      EXPECT_LT((moved[p].cast<double>() - exact.x).norm(), 1e-7 * points.x[p].cast<double>().norm() + 3e-6 * displaced)
          << points.x[p].transpose();
      // The slope of linear FFD jumps from cell to cell.
      const Vec3f g = (points.x[p] - lattice.origin).cwiseQuotient(lattice.spacing);
      const bool on_border = (g.array() - g.array().round()).abs().minCoeff() < 1e-4f;
      if (kind() == FfdKind::linear && on_border) continue;
      const double slope = displaced / double{lattice.spacing.minCoeff()} + 100 * displaced;
      EXPECT_LT((tangents[p].cast<double>() - exact.tangent).norm(), 3e-7 + 3e-6 * slope) << points.x[p].transpose();
    }
  }
}

TEST_P(WideDeformCases, affine_displacements_move_points_and_tangents_affinely) {
  const Lattice lattice = make_lattice({6, 5, 4});
  std::mt19937 random(7);
  Mat3f turn;
  for (int a = 0; a < 3; ++a) turn.col(a) = random_vec(random, 0.5f);
  const Vec3f shift = random_vec(random, 0.1f);
  std::vector<Vec3f> displacements(lattice.node_count());
  for (std::uint32_t n = 0; n < displacements.size(); ++n) displacements[n] = turn * lattice.node(n) + shift;
  Points points = make_points(lattice, 8);
  std::ranges::fill(points.blend, 1.0f);
  std::ranges::fill(points.rest.blend_slope, 0.0f);
  std::vector<Vec3f> moved(points.x.size()), tangents(points.x.size());
  points.deformer(lattice, kind()).deform(displacements, moved, tangents);
  for (std::size_t p = 0; p < points.x.size(); ++p) {
    const Vec3f& x = points.x[p];
    const double far = reach(lattice, x);
    EXPECT_LT((moved[p] - (x + turn * x + shift)).norm(), 5e-7 * far) << x.transpose();
    const Vec3f& t = points.rest.direction[p];
    EXPECT_LT((tangents[p] - (t + turn * t)).norm(), 3e-6 * far) << x.transpose();
  }
}

TEST_P(WideDeformCases, weights_sum_to_one_so_exactly_that_a_shift_of_all_nodes_is_that_shift) {
  const Lattice lattice = make_lattice({5, 6, 4});
  Points points = make_points(lattice, 9);
  std::ranges::fill(points.blend, 1.0f);
  std::ranges::fill(points.rest.blend_slope, 0.0f);
  // Numbers without a short binary form, so that weights that do not sum up to 1 exactly would show.
  const Vec3f shift(0.0123f, -0.0456f, 0.0789f);
  const std::vector<Vec3f> displacements(lattice.node_count(), shift);
  std::vector<Vec3f> moved(points.x.size()), tangents(points.x.size());
  points.deformer(lattice, kind()).deform(displacements, moved, tangents);
  for (std::size_t p = 0; p < points.x.size(); ++p) {
    EXPECT_EQ(moved[p], points.x[p] + shift);
    EXPECT_EQ(tangents[p], points.rest.direction[p]);
  }
}

// Clients draw any part of a groom's points. A point must not tremble when the part changes.
TEST_P(WideDeformCases, a_point_has_the_same_bits_in_any_order_and_any_company) {
  const Lattice lattice = make_lattice({6, 5, 4});
  const Points points = make_points(lattice, 10);
  const std::vector<Vec3f> displacements = random_displacements(lattice, 0.05f, 11);
  std::vector<Vec3f> moved(points.x.size()), tangents(points.x.size());
  points.deformer(lattice, kind()).deform(displacements, moved, tangents);
  std::vector<std::size_t> order(points.x.size());
  std::iota(order.begin(), order.end(), std::size_t{0});
  std::mt19937 random(12);
  for (const double share : {1.0, 0.5, 0.02, 0.001}) {
    std::ranges::shuffle(order, random);
    order.resize(static_cast<std::size_t>(share * static_cast<double>(points.x.size())));
    Points some;
    std::vector<Vec3f> expected_moved, expected_tangents;
    for (const std::size_t p : order) {
      some.x.push_back(points.x[p]);
      some.blend.push_back(points.blend[p]);
      some.rest.direction.push_back(points.rest.direction[p]);
      some.rest.blend_slope.push_back(points.rest.blend_slope[p]);
      expected_moved.push_back(moved[p]);
      expected_tangents.push_back(tangents[p]);
    }
    std::vector<Vec3f> some_moved(order.size()), some_tangents(order.size());
    some.deformer(lattice, kind()).deform(displacements, some_moved, some_tangents);
    EXPECT_TRUE(same_bits(some_moved, expected_moved)) << share;
    EXPECT_TRUE(same_bits(some_tangents, expected_tangents)) << share;
  }
}

// The kernel handles whole vectors, and may read kDeformOverhang = 64 entries beyond the end. All numbers of points up
// to 70 end at every place within a vector. The entry before the output and the one after it must stay untouched. Node
// 21 of 4 x 4 x 4 is the inner node (1, 1, 1).
TEST_P(WideDeformCases, writes_all_points_and_nothing_else_for_any_number) {
  const Lattice lattice = make_lattice({4, 4, 4});
  const std::vector<Vec3f> displacements = random_displacements(lattice, 0.05f, 13);
  std::mt19937 random(14);
  const Vec3f untouched = Vec3f::Constant(-77);
  for (std::size_t count = 0; count <= 70; ++count) {
    Points points;
    for (std::size_t p = 0; p < count; ++p) points.add(lattice.node(21) + random_vec(random, 0.01f), random);
    std::vector<Vec3f> moved(count + 2, untouched), tangents(count + 2, untouched);
    points.deformer(lattice, kind())
        .deform(displacements, std::span(moved).subspan(1, count), std::span(tangents).subspan(1, count));
    for (const auto& out : {moved, tangents}) {
      EXPECT_EQ(out.front(), untouched);
      EXPECT_EQ(out.back(), untouched);
      EXPECT_EQ(std::count(out.begin(), out.end(), untouched), 2) << count;
    }
  }
}

TEST_P(WideDeformCases, numbers_stay_finite_however_far_away_a_point_is) {
  const Lattice lattice = make_lattice({5, 5, 5});
  const std::vector<Vec3f> displacements = random_displacements(lattice, 0.05f, 15);
  std::mt19937 random(16);
  Points points;
  for (const float far : {1e3f, 1e10f, 1e30f, 1e37f}) {
    for (int sign = 0; sign < 8; ++sign) {
      points.add(far * Vec3f(sign & 1 ? 1.0f : -1.0f, sign & 2 ? 1.0f : -1.0f, sign & 4 ? 1.0f : -1.0f), random);
      points.add(Vec3f(0, -0.2f, -0.1f), random);
    }
  }
  std::vector<Vec3f> moved(points.x.size()), tangents(points.x.size()), home(1);
  points.deformer(lattice, kind()).deform(displacements, moved, tangents);
  for (std::size_t p = 0; p < points.x.size(); ++p) {
    EXPECT_TRUE(moved[p].allFinite()) << points.x[p].transpose();
    EXPECT_TRUE(tangents[p].allFinite()) << points.x[p].transpose();
    if (p % 2 == 0) continue;
    Deformer(lattice, {&points.x[p], 1}, {&points.blend[p], 1}, kind()).deform(displacements, home);
    // The point's neighbours in the vector, which are absurdly far away, must not change it.
    EXPECT_EQ(moved[p], home[0]);
  }
}

// One Deformer serves all characters with the same hairstyle, from several threads.
TEST_P(WideDeformCases, several_threads_may_deform_at_once) {
  const Lattice lattice = make_lattice({6, 5, 4});
  const Points points = make_points(lattice, 17);
  const Deformer deformer = points.deformer(lattice, kind());
  struct Shape {
    std::vector<Vec3f> displacements, alone, together;
  };
  std::vector<Shape> shapes;
  for (unsigned n = 0; n < 4; ++n) {
    shapes.push_back({random_displacements(lattice, 0.05f, n), std::vector<Vec3f>(points.x.size()), {}});
    shapes.back().together = shapes.back().alone;
    deformer.deform(shapes.back().displacements, shapes.back().alone);
  }
  std::vector<std::thread> threads;
  for (Shape& shape : shapes) {
    threads.emplace_back([&] {
      for (int n = 0; n < 20; ++n) deformer.deform(shape.displacements, shape.together);
    });
  }
  for (std::thread& thread : threads) thread.join();
  for (const Shape& shape : shapes) EXPECT_TRUE(same_bits(shape.alone, shape.together));
}

TEST(Deformer, has_tangents_only_when_it_was_given_those_at_rest) {
  const Lattice lattice = make_lattice({4, 4, 4});
  const Points points = make_points(lattice, 18);
  EXPECT_TRUE(points.deformer(lattice, FfdKind::quadratic).has_tangents());
  EXPECT_FALSE(Deformer(lattice, points.x, points.blend, FfdKind::quadratic).has_tangents());
  EXPECT_EQ(points.deformer(lattice, FfdKind::linear).point_count(), points.x.size());
}

TEST(DeformerDeathTest, points_out_of_another_count_stop_the_program) {
  const Lattice lattice{Vec3f::Zero(), Vec3f::Ones(), {3, 3, 3}};
  const std::vector<Vec3f> points(2, Vec3f::Ones()), displacements(27, Vec3f::Zero());
  const Deformer deformer(lattice, points, {}, FfdKind::quadratic);
  std::vector<Vec3f> points_out(1);
  EXPECT_DEATH(deformer.deform(displacements, points_out), "assertion failed: points_out.size\\(\\) == point_count_");
}

}  // namespace
}  // namespace hairnet
