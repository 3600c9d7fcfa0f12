// Compares the GPU's points of strands with core's FFD and StrandLengths.
#include "client/render/strand_deform_pass.hpp"

#include <gmock/gmock.h>

#include <algorithm>
#include <bit>

#include "client/assets/made/made.hpp"
#include "core/ffd/deform.hpp"
#include "core/ffd/strand_lengths.hpp"
#include "core/levels/fit_lattice.hpp"
#include "tests/support/case_name.hpp"
#include "tests/unit/client/shader_cases.hpp"

namespace hairnet::render {
using namespace draw;

namespace {

// Strands that a shader and core place must agree within 0.1 mm, as the README of the project promises.
constexpr float kPosition_m = 1e-4f;

struct Placed {
  std::vector<Vec3f> positions;
  std::vector<Eigen::Quaternionf> rotations;
};

class StrandDeformPassTest : public ShaderTest {
 protected:
  void set_up_drawing() override {
    Result<StrandDeformPass> placement = StrandDeformPass::build();
    ASSERT_TRUE(placement) << placement.error();
    placement_.emplace(std::move(*placement));
  }
  void tear_down_drawing() override { placement_.reset(); }

  // Returns the points of the second of two characters with one groom, which has the nodes. A wrong row would give the
  // points of the first, which is at rest.
  Placed by_shader(const GroomGeometry& geometry, const Nodes* nodes, float quadratic, const SkinPush& skin = {{}, 0}) {
    GroomBuffers groom(geometry);
    groom.skin().fill(skin);
    const std::size_t rows = groom.point_rows(geometry.strand_count);
    fill_records(nodes, quadratic, {0, rows}, {rows, rows});
    records_->bind();
    placement_->reserve(2 * rows, render::StrandDeformPass::kRowsMax);
    placement_->place(groom, 0, 2);

    std::vector<std::array<std::uint32_t, 4>> texels(rows * StrandDeformPass::kPointRow);
    glBindFramebuffer(GL_FRAMEBUFFER, placement_->placed());
    glReadPixels(0, static_cast<GLint>(rows), static_cast<GLsizei>(StrandDeformPass::kPointRow),
                 static_cast<GLsizei>(rows), GL_RGBA_INTEGER, GL_UNSIGNED_INT, texels.data());
    EXPECT_EQ(glGetError(), static_cast<GLenum>(GL_NO_ERROR));
    Placed placed;
    for (std::size_t p = 0; p < geometry.strand_points.rest.size(); ++p) {
      const auto& [x, y, z, turn] = texels[p];
      placed.positions.emplace_back(std::bit_cast<float>(x), std::bit_cast<float>(y), std::bit_cast<float>(z));
      // A rotation is packed into four bytes, where 1 to 255 stand for -1 to 1.
      const auto part = [&](std::uint32_t byte) { return (static_cast<float>(turn >> 8 * byte & 255u) - 128) / 127; };
      placed.rotations.emplace_back(part(3), part(0), part(1), part(2));
    }
    return placed;
  }

  static std::vector<Vec3f> rest_of(const GroomGeometry& geometry) {
    std::vector<Vec3f> rest;
    for (const auto& [x, y, z, delta] : geometry.strand_points.rest) rest.emplace_back(x, y, z);
    return rest;
  }
  [[nodiscard]] std::vector<Vec3f> by_core(const GroomGeometry& geometry, const Nodes& nodes, FfdKind kind,
                                           const SkinPush& skin = {{}, 0}) const {
    const std::vector<Vec3f> rest = rest_of(geometry);
    std::vector<float> blend;
    for (const auto& point : geometry.strand_points.rest) blend.push_back(point[3]);
    std::vector<Vec3f> points(rest.size());
    Deformer(nodes.geometry.lattice, rest, blend, kind).deform(nodes.displacements, points);
    skin.push(pose_, rest, blend, points);
    StrandLengths(rest, geometry.strand_points.end).limit(points);
    return points;
  }
  static float furthest(std::span<const Vec3f> a, std::span<const Vec3f> b) {
    float furthest_m = a.size() == b.size() ? 0.0f : 1e9f;
    for (std::size_t i = 0; i < std::min(a.size(), b.size()); ++i)
      furthest_m = a[i].allFinite() ? std::max(furthest_m, (a[i] - b[i]).norm()) : 1e9f;
    return furthest_m;
  }

 private:
  std::optional<StrandDeformPass> placement_;
};

TEST_F(StrandDeformPassTest, leaves_hair_without_a_lattice_where_it_is) {
  const GroomGeometry geometry = make_groom_geometry(*make_hairstyle("long_curly", {.strand_count = 300}));
  const Placed still = by_shader(geometry, {}, 1);
  EXPECT_LT(furthest(still.positions, rest_of(geometry)), 1e-6f);
  for (const Eigen::Quaternionf& rotation : still.rotations)
    EXPECT_LT(rotation.angularDistance(Eigen::Quaternionf::Identity()), 1e-3f);
}

TEST_F(StrandDeformPassTest, turns_small_things_with_the_hair_even_upside_down) {
  Groom groom = *make_hairstyle("long_straight", {.strand_count = 300});
  // Without a root length all of the hair follows the lattice, and none the skull.
  for (StrandProperties& strand : groom.strands) strand.root_length_m = 0;
  const GroomGeometry geometry = make_groom_geometry(groom);
  Nodes nodes;
  nodes.geometry.lattice = fit_lattice(groom.points, {5, 5, 5});
  const Eigen::Quaternionf turn(Eigen::AngleAxisf(3.1f, Vec3f(1, 0.2f, -0.3f).normalized()));
  for (std::uint32_t n = 0; n < nodes.geometry.lattice.node_count(); ++n) {
    const Vec3f x = nodes.geometry.lattice.node(n);
    nodes.displacements.push_back(turn * x - x);
  }
  const Placed placed = by_shader(geometry, &nodes, 1);
  ASSERT_GT(placed.rotations.size(), 1000u);
  for (const Eigen::Quaternionf& rotation : placed.rotations)
    // The bytes of a rotation have steps of 1/127, so it may be off by about a hundredth of a radian.
    ASSERT_LT(rotation.normalized().angularDistance(turn), 0.03f);
}

TEST_F(StrandDeformPassTest, keeps_strands_out_of_the_skin_as_core_does) {
  const Groom groom = *make_hairstyle("long_straight", {.strand_count = 300});
  const SkinPush skin(*make_skin(groom), groom.materials.base.thickness_m);
  const GroomGeometry geometry = make_groom_geometry(groom);
  EXPECT_LT(furthest(by_shader(geometry, {}, 1, skin).positions, rest_of(geometry)), 1e-6f);
  pose_ = bent(pose_);
  const Nodes nodes = rough_nodes(fit_lattice(groom.points, {10, 10, 10}), 9);
  const std::vector<Vec3f> wanted = by_core(geometry, nodes, FfdKind::quadratic, skin);
  // Core must push some point by more than 1 cm, or the case would show nothing.
  EXPECT_GT(furthest(wanted, by_core(geometry, nodes, FfdKind::quadratic)), 0.01f);
  EXPECT_LT(furthest(by_shader(geometry, &nodes, 1, skin).positions, wanted), kPosition_m);
}

class StrandDeformPassGroom : public StrandDeformPassTest, public testing::WithParamInterface<std::string> {};

TEST_P(StrandDeformPassGroom, places_all_points_as_core_does_and_makes_no_strand_longer) {
  if (!can_load(GetParam())) GTEST_SKIP() << "NOT TESTED: no ../shared/data";
  const Result<Groom> groom = fidelity::load_groom(GetParam(), kMadeStrands);
  ASSERT_TRUE(groom) << groom.error();
  const GroomGeometry geometry = make_groom_geometry(*groom);
  const StrandPoints& points = geometry.strand_points;
  if (points.rest.empty()) GTEST_SKIP() << "has no strands";
  const Nodes nodes = rough_nodes(fit_lattice(groom->points, {10, 10, 10}), 9);
  for (const float quadratic : {0.0f, 1.0f}) {
    const Placed placed = by_shader(geometry, &nodes, quadratic);
    EXPECT_LT(
        furthest(placed.positions, by_core(geometry, nodes, quadratic > 0 ? FfdKind::quadratic : FfdKind::linear)),
        kPosition_m);
    float longest = 0;
    for (std::size_t s = 0; s < geometry.strand_count; ++s) {
      float length_m = 0;
      for (std::uint32_t p = points.end[s] + 1; p < points.end[s + 1]; ++p)
        length_m += (placed.positions[p] - placed.positions[p - 1]).norm();
      if (points.end[s + 1] > points.end[s])
        longest = std::max(longest, length_m / points.arc[points.end[s + 1] - 1][0]);
    }
    // No strand is drawn longer than it was made, whatever its nodes do.
    EXPECT_LT(longest, 1.001f);
  }
}

INSTANTIATE_TEST_SUITE_P(Grooms, StrandDeformPassGroom, testing::ValuesIn(all_grooms()), support::CaseName());

}  // namespace
}  // namespace hairnet::render
