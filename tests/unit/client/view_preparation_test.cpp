// What is made ready on the CPU before anything is drawn: needs no OpenGL.
#include <gmock/gmock.h>

#include <algorithm>
#include <cmath>
#include <limits>
#include <random>

#include "client/view/body_surface.hpp"
#include "client/view/projection.hpp"
#include "client/view/strand_ribbons.hpp"

namespace hairnet::view {
namespace {

constexpr float kNan = std::numeric_limits<float>::quiet_NaN();

struct Strands {
  std::vector<Vec3f> points;
  std::vector<std::uint32_t> begin{0};

  void add(std::initializer_list<Vec3f> strand) {
    points.insert(points.end(), strand);
    begin.push_back(static_cast<std::uint32_t>(points.size()));
  }
  [[nodiscard]] DrawnCharacter character() const {
    DrawnCharacter c;
    c.strand_points = points;
    c.strand_begin = begin;
    return c;
  }
};

// Short strands all over a ball of 0.1 m.
Strands ball_of_hair() {
  Strands strands;
  std::mt19937 random(7);
  std::uniform_real_distribution<float> part(-0.1f, 0.1f);
  while (strands.begin.size() < 6000) {
    const Vec3f p(part(random), part(random), part(random));
    if (p.norm() < 0.1f) strands.add({p, p + Vec3f(0.01f, 0.01f, 0), p + Vec3f(0.02f, 0, 0)});
  }
  return strands;
}

TEST(LightVolume, lets_less_light_into_the_middle_of_hair_than_to_its_surface) {
  const Strands strands = ball_of_hair();
  const LightRig rig = studio_lights(Camera{});
  const LightVolume light(strands.character(), 8, rig);
  const auto middle = light.at(Vec3f(0, 0, 0)), top = light.at(Vec3f(0, 0.1f, 0)), away = light.at(Vec3f(0, 0.5f, 0));
  EXPECT_LT(middle.ambient, 0.6f * top.ambient);
  EXPECT_LT(top.ambient, away.ambient);
  EXPECT_EQ(away.ambient, 1);
  EXPECT_LT(middle.rim, light.at(0.1f * rig.towards[2]).rim);
  EXPECT_LT(middle.fill, light.at(0.1f * rig.towards[1]).fill);
}

TEST(LightVolume, darkens_with_the_number_of_copies) {
  const Strands strands = ball_of_hair();
  const LightRig rig = studio_lights(Camera{});
  const Vec3f middle(0, 0, 0);
  EXPECT_LT(LightVolume(strands.character(), 3, rig).at(middle).ambient,
            LightVolume(strands.character(), 1, rig).at(middle).ambient);
}

TEST(LightVolume, is_fully_lit_without_hair) {
  const LightVolume light(DrawnCharacter{}, 1, studio_lights(Camera{}));
  EXPECT_EQ(light.at(Vec3f(0, 0, 0)).ambient, 1);
  EXPECT_EQ(light.at(Vec3f(kNan, 0, 0)).rim, 1);
}

TEST(StrandRibbons, pass_through_every_point_in_order) {
  Strands strands;
  strands.add({{0, 0, 0}, {0, -0.01f, 0.01f}, {0.01f, -0.03f, 0.01f}, {0.01f, -0.05f, 0}});
  const StrandRibbons ribbons = make_ribbons(strands.character(), LightVolume({}, 1, studio_lights({})));
  std::size_t next = 0;
  for (const RibbonVertex& v : ribbons.vertices) {
    const Vec3f p(v.position[0], v.position[1], v.position[2]);
    if (next < strands.points.size() && (p - strands.points[next]).norm() < 1e-6f) ++next;
  }
  EXPECT_EQ(next, strands.points.size());
  EXPECT_GT(ribbons.vertices.size(), 2 * strands.points.size()) << "few points are smoothed with more";
  EXPECT_EQ(ribbons.vertices.front().along[0], 0);
  EXPECT_EQ(ribbons.vertices.back().along[0], 255);
}

TEST(StrandRibbons, leave_out_points_that_are_not_finite_and_strands_of_one_point) {
  Strands strands, clean;
  strands.add({{0, 0, 0}, {kNan, 0, 0}, {0, -0.1f, 0}});
  strands.add({{0.1f, 0, 0}});
  strands.add({});
  strands.add({{0, 0, 0}, {0, 0, INFINITY}});
  strands.add({{0, 0, 0}, {0, 3e30f, 0}});
  clean.add({{0, 0, 0}, {0, -0.1f, 0}});
  const LightVolume unlit({}, 1, studio_lights({}));
  const StrandRibbons ribbons = make_ribbons(strands.character(), unlit);
  for (const RibbonVertex& v : ribbons.vertices) {
    EXPECT_EQ(v.strand, 0u);
    for (const float x : v.position) EXPECT_LE(std::abs(x), 0.11f);
  }
  EXPECT_GE(ribbons.vertices.size(), make_ribbons(clean.character(), unlit).vertices.size());
}

TEST(StrandRibbons, are_drawn_far_to_near_and_each_quad_once) {
  const Strands strands = ball_of_hair();
  StrandRibbons ribbons = make_ribbons(strands.character(), LightVolume({}, 1, studio_lights({})));
  sort_far_to_near(ribbons, Camera{});  // looks along -z
  ASSERT_EQ(ribbons.triangles.size(), 3 * ribbons.lines.size());
  EXPECT_EQ(ribbons.slabs.front(), 0u);
  EXPECT_EQ(ribbons.slabs.back(), ribbons.triangles.size());
  float furthest = -INFINITY;
  std::vector<std::uint32_t> seen;
  for (std::size_t i = 0; i < ribbons.triangles.size(); i += 6) {
    const std::uint32_t a = ribbons.triangles[i], b = ribbons.triangles[i + 2];
    const float z = 0.5f * (ribbons.vertices[a].position[2] + ribbons.vertices[b].position[2]);
    EXPECT_GT(z, furthest - 2e-4f) << "0.2 m in 4096 bins";
    furthest = std::max(furthest, z);
    seen.push_back(a);
  }
  std::sort(seen.begin(), seen.end());
  EXPECT_EQ(std::adjacent_find(seen.begin(), seen.end()), seen.end());
}

TEST(BodySurface, has_outward_normals_and_drops_triangles_of_bad_vertices) {
  const std::vector<Vec3f> vertices{{0, 0, 0}, {1, 0, 0}, {0, 1, 0}, {kNan, 1, 1}};
  const std::vector<std::array<std::uint32_t, 3>> triangles{{0, 1, 2}, {1, 3, 2}};
  DrawnCharacter character;
  character.body_vertices = vertices;
  character.triangles = &triangles;
  const BodySurface surface = make_surface(character, LightVolume({}, 1, studio_lights({})));
  EXPECT_THAT(surface.triangles, testing::ElementsAre(0, 1, 2));
  for (std::size_t i = 0; i < 3; ++i) EXPECT_EQ(surface.vertices[i].normal[2], 32767);
}

TEST(Projection, puts_the_target_in_the_middle_and_up_above_it) {
  const Camera camera{{1, 2, 3}, {0.2f, 0.1f, -0.3f}, {0, 1, 0}, 40};
  const Mat4f m = perspective(camera, 1.5f, 0.1f, 10);
  const auto seen = [&](const Vec3f& p) { return Vec3f((m * p.homogeneous()).hnormalized()); };
  EXPECT_NEAR(seen(camera.target).x(), 0, 1e-5);
  EXPECT_NEAR(seen(camera.target).y(), 0, 1e-5);
  EXPECT_GT(seen(camera.target + Vec3f(0, 0.1f, 0)).y(), 0.01f);
  EXPECT_LT(seen(camera.target).z(), seen(camera.target + 0.5f * (camera.target - camera.eye)).z());
}

TEST(Projection, mends_cameras_that_look_nowhere) {
  for (const Camera& camera : {Camera{{0, 0, 0}, {0, 0, 0}, {0, 1, 0}, 30}, Camera{{0, 1, 0}, {0, 0, 0}, {0, 1, 0}, 30},
                               Camera{{kNan, 0, 0}, {0, kNan, 0}, {0, 0, 0}, kNan}}) {
    const Camera fine = mended(camera);
    EXPECT_TRUE(perspective(fine, 1, 0.1f, 10).allFinite());
    for (const Vec3f& light : studio_lights(fine).towards) EXPECT_NEAR(light.norm(), 1, 1e-4);
  }
}

}  // namespace
}  // namespace hairnet::view
