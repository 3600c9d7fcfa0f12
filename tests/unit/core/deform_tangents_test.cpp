#include <gtest/gtest.h>

#include <cmath>

#include "core/ffd/reference_deform.hpp"
#include "tests/support/case_name.hpp"
#include "tests/unit/core/deform_cases.hpp"

namespace hairnet {
namespace {

using namespace deform_cases;

// A helix of 1 cm radius and 3 cm pitch that hangs from a root in the lattice, by its arc length; lambda_0 is 2 cm.
RestPoint curl_at(double s) {
  constexpr double kRadius = 0.01, kPitch = 0.03, kLambda0 = 0.02;
  const double turn = 2 * M_PI, length = std::hypot(turn * kRadius, kPitch), a = turn * s / length;
  RestPoint point;
  point.x = Vec3(-0.02 + kRadius * std::cos(a), -0.12 - kPitch * s / length, -0.08 + kRadius * std::sin(a));
  point.tangent = Vec3(-kRadius * turn * std::sin(a), -kPitch, kRadius * turn * std::cos(a)) / length;
  point.delta = 1 - std::exp(-std::pow(s / kLambda0, 2));
  point.delta_slope = 2 * s / (kLambda0 * kLambda0) * (1 - point.delta);
  return point;
}

class DeformTangents : public testing::TestWithParam<support::Named<FfdKind>> {};
INSTANTIATE_TEST_SUITE_P(BothKinds, DeformTangents, testing::ValuesIn(kFfdKinds), support::CaseName());

TEST_P(DeformTangents, of_the_reference_are_the_derivative_of_the_deformed_curve) {
  const Lattice lattice = make_lattice({6, 5, 4});
  const std::vector<Vec3f> displacements = random_displacements(lattice, 0.05f, 1);
  constexpr double kStep_m = 1e-7;
  int compared = 0;
  double of_blend_max = 0;
  for (int n = 0; n < 400; ++n) {
    const double s = 0.0005 * n + kStep_m;
    const auto at = [&](double arc) {
      return reference_deform(lattice, GetParam().value, curl_at(arc), displacements);
    };
    const Vec3 forward = (at(s + kStep_m).x - at(s).x) / kStep_m, backward = (at(s).x - at(s - kStep_m).x) / kStep_m;
    // The two differences disagree across a corner of the linear field, which has no tangent.
    if ((forward - backward).norm() > 1e-4) continue;
    EXPECT_LT((at(s).tangent - 0.5 * (forward + backward)).norm(), 1e-6) << s;
    RestPoint unblended = curl_at(s);
    unblended.delta_slope = 0;
    of_blend_max = std::max(
        of_blend_max,
        (at(s).tangent - reference_deform(lattice, GetParam().value, unblended, displacements).tangent).norm());
    ++compared;
  }
  // Few of the 400 places lie at a corner of the field, so nearly all of them must be compared.
  EXPECT_GT(compared, 380);
  // The term (d delta / ds) u is large here, so a tangent without it would be found.
  EXPECT_GT(of_blend_max, 0.3);
}

TEST_P(DeformTangents, of_a_groom_agree_with_the_chords_of_the_drawn_hair) {
  const Lattice lattice = make_lattice({6, 5, 4});
  std::vector<Vec3f> displacements(lattice.node_count());
  for (std::uint32_t n = 0; n < displacements.size(); ++n) {
    const Vec3f x = lattice.node(n);
    displacements[n] = Vec3f(0.03f * std::sin(9 * x.y()), 0.1f * x.x(), 0.02f * std::cos(8 * x.y()));
  }
  Groom groom;
  groom.group_names = {"all"};
  std::vector<Vec3f> strand;
  for (int n = 0; n <= 400; ++n) strand.push_back(curl_at(0.0005 * n).x.cast<float>());
  groom.add_strand(strand, {.root_length_m = 0.02f});
  const std::vector<float> blend = root_blend(groom);
  const RestTangents rest = rest_tangents(groom, blend);
  std::vector<Vec3f> moved(strand.size()), tangents(strand.size());
  Deformer(lattice, groom.points, blend, rest, GetParam().value).deform(displacements, moved, tangents);
  // Chords cut the corners of the linear field.
  const double allowed = GetParam().value == FfdKind::quadratic ? 0.01 : 0.2;
  for (std::size_t p = 1; p + 1 < strand.size(); ++p) {
    // The points are 0.5 mm apart along the strand at rest, so two segments are 1 mm of arc.
    const Vec3f chord = (moved[p + 1] - moved[p - 1]) / 0.001f;
    EXPECT_LT((tangents[p] - chord).norm(), allowed) << p;
  }
}

TEST(RestTangents, follow_strands_threads_and_both_edges_of_cards) {
  Groom groom;
  groom.group_names = {"all"};
  const std::vector<Vec3f> line{{0, 0, 0}, {0, -0.02f, 0}, {0, -0.04f, 0}};
  groom.add_strand(line, {.root_length_m = 0.02f});
  groom.add_thread(line, {});
  const std::vector<Vec3f> edges{{0, 0, 0}, {0.01f, 0, 0}, {0, 0, 0.02f}, {0.01f, 0, 0.02f}};
  groom.add_card(edges, {.root_length_m = 0});
  const std::vector<float> blend = root_blend(groom);
  const RestTangents rest = rest_tangents(groom, blend);
  for (std::size_t p = 0; p < 6; ++p) EXPECT_LT((rest.direction[p] - Vec3f(0, -1, 0)).norm(), 1e-6f) << p;
  for (std::size_t p = 6; p < 10; ++p) EXPECT_LT((rest.direction[p] - Vec3f(0, 0, 1)).norm(), 1e-6f) << p;
  // The points 0 to 5 are the strand and the thread, and 6 to 9 the card. The strand's points are one lambda_0 = 2 cm
  // apart: its root has a one-sided difference of delta (eq. 7), its second point a central one.
  EXPECT_NEAR(rest.blend_slope[0], (1 - std::exp(-1.0)) / 0.02, 1e-3);
  EXPECT_NEAR(rest.blend_slope[1], (1 - std::exp(-4.0)) / 0.04, 1e-3);
  EXPECT_EQ(rest.blend_slope[6], 0);
}

TEST(RestTangents, are_zero_and_finite_where_no_line_leads) {
  Groom groom;
  groom.group_names = {"all"};
  const Vec3f point(0.01f, -0.02f, 0.03f);
  groom.add_strand({}, {});
  groom.add_strand(std::vector<Vec3f>{point}, {});
  groom.add_strand(std::vector<Vec3f>(3, point), {});
  // This strand leads there and back.
  groom.add_strand(std::vector<Vec3f>{point, Vec3f(0, 0, 0), point}, {});
  Cloth cloth;
  cloth.root_length_m = 0;
  groom.add_cloth(std::vector<Vec3f>{{0, 0, 0}, {0.1f, 0, 0}, {0, 0.1f, 0}}, cloth);
  const RestTangents rest = rest_tangents(groom, root_blend(groom));
  for (std::size_t p = 0; p < groom.points.size(); ++p) {
    // The last strand has the points 4 to 6. Each end has one neighbour and so a direction; the neighbours of point 5
    // lie at one place, so it has none.
    const bool has_line = p == 4 || p == 6;
    EXPECT_NEAR(rest.direction[p].norm(), has_line ? 1 : 0, 1e-6f) << p;
    EXPECT_TRUE(std::isfinite(rest.blend_slope[p])) << p;
  }
}

}  // namespace
}  // namespace hairnet
