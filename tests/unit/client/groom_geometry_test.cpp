// Tests the part of a groom's geometry that the CPU makes, without OpenGL.
#include <gmock/gmock.h>

#include <algorithm>
#include <cmath>
#include <map>
#include <set>

#include "client/assets/made/made.hpp"
#include "client/draw/draw_detail.hpp"
#include "client/draw/groom_geometry.hpp"
#include "client/draw/occlusion_grid.hpp"
#include "client/draw/scalp.hpp"
#include "client/render/projection.hpp"
#include "core/ffd/deform.hpp"
#include "core/ffd/strand_lengths.hpp"
#include "core/random.hpp"

namespace hairnet::draw {
namespace {

// Fills a ball of 0.1 m radius with short strands. The seed is fixed, so that the tolerances below hold in each run.
Groom ball_of_hair() {
  Groom groom;
  groom.group_names = {"hair"};
  Random random(7);
  while (groom.strand_count() < 6000) {
    const Vec3f p = (0.1 * Vec3(random.symmetric(), random.symmetric(), random.symmetric())).cast<float>();
    if (p.norm() >= 0.1f) continue;
    const std::array<Vec3f, 3> strand{p - Vec3f(0, 0.01f, 0), p, p + Vec3f(0, 0.01f, 0)};
    groom.add_strand(strand, {});
  }
  return groom;
}

float mean(const Transmittance& left) {
  float sum = 0;
  for (const float side : left) sum += side / 6;
  return sum;
}

TEST(OcclusionGrid, lets_less_light_into_the_middle_of_hair_than_to_its_surface) {
  const OcclusionGrid light(ball_of_hair(), 3e-3f);
  const Transmittance middle = light.at(Vec3f(0, 0, 0)), top = light.at(Vec3f(0, 0.1f, 0)),
                      away = light.at(Vec3f(0, 0.6f, 0));
  // The six directions are +x, -x, +y, -y, +z and -z.
  EXPECT_LT(mean(middle), 0.6f * mean(top));
  EXPECT_LT(mean(top), mean(away));
  for (const float side : away) EXPECT_EQ(side, 1);
  EXPECT_GT(top[2], 0.8f) << "from above";
  EXPECT_LT(top[3], 0.5f * top[2]) << "from below, through the ball";
}

TEST(OcclusionGrid, is_as_symmetric_as_the_hair) {
  const OcclusionGrid light(ball_of_hair(), 3e-3f);
  const Transmittance left = light.at(Vec3f(-0.09f, 0, 0)), right = light.at(Vec3f(0.09f, 0, 0));
  EXPECT_NEAR(left[1], right[0], 0.12f) << "towards the outside";
  EXPECT_NEAR(left[0], right[1], 0.12f) << "towards the middle";
}

TEST(OcclusionGrid, darkens_with_the_width_of_strands) {
  const Groom groom = ball_of_hair();
  EXPECT_LT(mean(OcclusionGrid(groom, 4e-3f).at(Vec3f::Zero())), mean(OcclusionGrid(groom, 1e-3f).at(Vec3f::Zero())));
}

TEST(OcclusionGrid, of_nothing_leaves_all_light) {
  EXPECT_EQ(OcclusionGrid(Groom{}, 1e-3f).at(Vec3f::Zero()), (Transmittance{1, 1, 1, 1, 1, 1}));
}

TEST(Scalp, is_whole_between_the_rows_of_a_parting_and_fades_out_beyond_the_hairline) {
  Groom groom;
  groom.group_names = {"hair"};
  // The roots of two fields are 3 mm apart, with a parting of 8 mm between the fields.
  for (int i = 0; i < 20; ++i) {
    for (int j = 0; j < 40; ++j) {
      for (const float side : {-1.0f, 1.0f}) {
        const Vec3f root(side * (0.004f + 0.003f * static_cast<float>(i)), 0.1f, 0.003f * static_cast<float>(j));
        groom.add_strand(std::array{root, Vec3f(root + Vec3f(0, -0.1f, 0))}, {});
      }
    }
  }
  const Scalp scalp(groom);
  EXPECT_EQ(scalp.at({0.03f, 0.1f, 0.06f}), 1);
  EXPECT_GT(scalp.at({0, 0.1f, 0.06f}), 0.9f) << "the parting";
  float before = 1;
  for (float x = 0.061f; x < 0.1f; x += 0.002f) {
    EXPECT_LE(scalp.at({x, 0.1f, 0.06f}), before);
    before = scalp.at({x, 0.1f, 0.06f});
  }
  EXPECT_EQ(before, 0);
  EXPECT_EQ(scalp.at({0.03f, 0.05f, 0.06f}), 0) << "where hair hangs but does not grow";
}

TEST(Scalp, of_nothing_is_nowhere) {
  EXPECT_EQ(Scalp(Groom{}).at(Vec3f::Zero()), 0);
}

class MadeGeometry : public testing::Test {
 protected:
  Groom groom_ = *make_hairstyle("long_curly", {.strand_count = 500});
  GroomGeometry geometry_ = make_groom_geometry(groom_);
};

TEST_F(MadeGeometry, has_every_point_of_every_strand_with_its_root_blend) {
  std::set<std::array<float, 4>> drawn;
  drawn.insert(geometry_.strand_points.rest.begin(), geometry_.strand_points.rest.end());
  const std::vector<float> blend = root_blend(groom_);
  for (std::uint32_t p = 0; p < groom_.strand_begin.back(); ++p) {
    const Vec3f& x = groom_.points[p];
    EXPECT_TRUE(drawn.contains({x.x(), x.y(), x.z(), blend[p]})) << p;
  }
}

// Far hair is drawn with fewer points. Each list says how far the drawn line may be from the points that it leaves
// out.
TEST_F(MadeGeometry, keeps_every_left_out_point_within_the_tolerance_of_the_drawn_line) {
  ASSERT_GE(geometry_.simplified_strands.size(), 3u);
  const auto position = [&](std::uint32_t vertex) {
    const auto& r = geometry_.strand_points.rest[vertex / 2];
    return Vec3f(r[0], r[1], r[2]);
  };
  std::size_t before = SIZE_MAX;
  for (const SimplifiedStrands& list : geometry_.simplified_strands) {
    EXPECT_LT(list.triangles.size(), before) << "each list is shorter than the one before";
    before = list.triangles.size();
    ASSERT_EQ(list.triangles.size() % 6, 0u);
    for (std::size_t t = 0; t < list.triangles.size(); t += 6) {
      // A segment of a strand takes two triangles, six indices, of which the first and the third are its two ends. A
      // point has two vertices, so vertices of neighbouring points are 2 apart.
      const std::uint32_t from = list.triangles[t], to = list.triangles[t + 2];
      ASSERT_LT(from, to);
      EXPECT_EQ(geometry_.strand_vertices[from].strand, geometry_.strand_vertices[to].strand);
      const Vec3f a = position(from), along = position(to) - a;
      for (std::uint32_t v = from + 2; v < to; v += 2) {
        const Vec3f away = position(v) - a;
        const float on = std::clamp(away.dot(along) / along.squaredNorm(), 0.0f, 1.0f);
        EXPECT_LE((away - on * along).norm(), list.tolerance_m * 1.001f + 1e-7f);
      }
    }
  }
}

// Straight hair has few points, and a lattice bends it between them.
TEST(GroomGeometry, divides_long_segments_for_near_pictures_and_keeps_the_points_of_the_groom_for_further_ones) {
  Groom groom;
  groom.group_names = {"hair"};
  std::vector<Vec3f> strand;
  for (int i = 0; i < 13; ++i) strand.emplace_back(0, 0.1f - 0.02f * static_cast<float>(i), 0);
  groom.add_strand(strand, {});
  const GroomGeometry geometry = make_groom_geometry(groom);
  // The 12 segments are 2 cm long, so each is divided into two (kPiece_m and kPiecesMax in strand_geometry.cpp). A
  // segment takes two triangles, six indices.
  EXPECT_EQ(geometry.strand_points.rest.size(), 25u);
  EXPECT_EQ(geometry.simplified_strands[0].triangles.size(), 6u * 24);
  EXPECT_EQ(geometry.simplified_strands[1].triangles.size(), 6u * 12);
}

TEST_F(MadeGeometry, draws_whole_strands_for_any_number_of_them) {
  for (const SimplifiedStrands& list : geometry_.simplified_strands) {
    ASSERT_EQ(list.end.size(), geometry_.strand_count + 1);
    EXPECT_EQ(list.end.back(), list.triangles.size());
    for (std::size_t n = 0; n < geometry_.strand_count; ++n) {
      for (std::uint32_t i = list.end[n]; i < list.end[n + 1]; ++i)
        EXPECT_EQ(geometry_.strand_vertices[list.triangles[i]].strand, static_cast<float>(n));
    }
  }
}

TEST_F(MadeGeometry, has_two_vertices_a_point_and_measures_points_from_the_root_of_their_strand) {
  const StrandPoints& points = geometry_.strand_points;
  ASSERT_EQ(geometry_.strand_vertices.size(), 2 * points.rest.size());
  ASSERT_EQ(points.arc.size(), points.rest.size());
  ASSERT_EQ(points.end.size(), geometry_.strand_count + 1);
  EXPECT_EQ(points.end.back(), points.rest.size());
  for (std::size_t n = 0; n < geometry_.strand_count; ++n) {
    std::vector<Vec3f> strand;
    for (std::uint32_t p = points.end[n]; p < points.end[n + 1]; ++p)
      strand.emplace_back(points.rest[p][0], points.rest[p][1], points.rest[p][2]);
    const std::uint32_t count = points.end[n + 1] - points.end[n];
    const StrandLengths lengths(strand, std::vector<std::uint32_t>{0, count});
    for (std::uint32_t i = 0; i < count; ++i) {
      EXPECT_NEAR(points.arc[points.end[n] + i][0], lengths.arc_m()[i], 1e-6f);
      EXPECT_EQ(points.arc[points.end[n] + i][1], static_cast<float>(i));
      EXPECT_EQ(geometry_.strand_vertices[2 * (points.end[n] + i)].strand, static_cast<float>(n));
    }
  }
}

// The first hundred of ten thousand must not be all of one side.
TEST(GroomGeometry, puts_strands_in_an_order_of_which_every_beginning_is_an_even_share) {
  const Groom groom = *make_hairstyle("bob");
  const GroomGeometry geometry = make_groom_geometry(groom);
  const auto mean_root = [&](std::size_t strands) {
    Vec3f sum = Vec3f::Zero();
    for (std::size_t s = 0; s < strands; ++s) {
      const auto& root = geometry.strand_points.rest[geometry.strand_points.end[s]];
      sum += Vec3f(root[0], root[1], root[2]);
    }
    return Vec3f(sum / static_cast<float>(strands));
  };
  // The mean root of 500 strands taken at random lies within some millimetres of that of all. A beginning that is
  // one side of the head would be centimetres away.
  EXPECT_LT((mean_root(500) - mean_root(geometry.strand_count)).norm(), 0.012f);
}

TEST(GroomGeometry, draws_the_copies_of_clusters_too) {
  Groom groom = *make_hairstyle("short", {.strand_count = 50});
  const std::size_t own = make_groom_geometry(groom).strand_count;
  groom.clumps.push_back({3, 5, 0.004f, 0.002f});
  const GroomGeometry geometry = make_groom_geometry(groom);
  EXPECT_EQ(geometry.strand_count, own + 5);
}

// In such a zigzag, the point farthest from the line is always the one before its end. A simplification that divides
// the strand there would recurse 200 000 deep.
TEST(GroomGeometry, takes_a_strand_of_very_many_points_that_go_ever_further) {
  Groom groom;
  groom.group_names = {"hair"};
  std::vector<Vec3f> zigzag;
  constexpr int kPoints = 200'000;
  for (int i = 0; i < kPoints; ++i) {
    const float away = 9 * static_cast<float>(i) / kPoints;
    zigzag.emplace_back(i % 2 == 0 ? away : -away, 0, static_cast<float>(i) / kPoints);
  }
  groom.add_strand(zigzag, {.rooted = false});
  const GroomGeometry geometry = make_groom_geometry(groom);
  EXPECT_GE(geometry.strand_vertices.size(), 2u * kPoints);
  for (const SimplifiedStrands& list : geometry.simplified_strands) EXPECT_FALSE(list.triangles.empty());
}

TEST(GroomGeometry, of_nothing_is_nothing) {
  const GroomGeometry geometry = make_groom_geometry(Groom{});
  EXPECT_TRUE(geometry.strand_vertices.empty());
  EXPECT_TRUE(geometry.body.triangles.empty());
  EXPECT_EQ(geometry.strand_count, 0u);
}

TEST(GroomGeometry, leaves_out_strands_without_length) {
  Groom groom;
  groom.group_names = {"hair"};
  const std::array<Vec3f, 2> point{Vec3f(0, 0.1f, 0), Vec3f(0, 0.1f, 0)};
  groom.add_strand(point, {});
  groom.add_strand(std::span(point).first(1), {});
  groom.add_strand({}, {});
  const GroomGeometry geometry = make_groom_geometry(groom);
  EXPECT_TRUE(geometry.strand_vertices.empty());
  EXPECT_EQ(geometry.simplified_strands.front().end.size(), 4u);
}

TEST(DrawDetail, falls_continuously_as_a_head_grows_smaller) {
  DrawDetail before = detail_for(2000, 1, 10'000);
  EXPECT_EQ(before.strand_share, 1);
  EXPECT_EQ(before.quadratic, 1);
  // A head that walks away shrinks by about 1 % from image to image. A larger step in any detail would be seen as a
  // flicker.
  for (float px = 2000; px > 1; px *= 0.99f) {
    const DrawDetail detail = detail_for(px, 1, 10'000);
    EXPECT_LE(detail.strand_share, before.strand_share);
    EXPECT_LE(detail.follow_hair_count, before.follow_hair_count);
    EXPECT_GE(detail.tolerance_m, before.tolerance_m);
    EXPECT_LE(detail.quadratic, before.quadratic);
    EXPECT_NEAR(detail.strand_share, before.strand_share, 0.02f) << px;
    EXPECT_NEAR(detail.quadratic, before.quadratic, 0.04f) << px;
    EXPECT_NEAR(detail.follow_hair_count, before.follow_hair_count, 0.1f) << px;
    EXPECT_NEAR(width_scale(detail), width_scale(before), 0.03f * width_scale(before)) << px;
    before = detail;
  }
  EXPECT_EQ(before.quadratic, 0);
}

TEST(DrawDetail, takes_quality_as_size_and_draws_few_strands_whole) {
  const DrawDetail better = detail_for(100, 2, 10'000), larger = detail_for(200, 1, 10'000);
  EXPECT_EQ(better.strand_share, larger.strand_share);
  EXPECT_EQ(better.follow_hair_count, larger.follow_hair_count);
  EXPECT_EQ(better.tolerance_m, larger.tolerance_m);
  EXPECT_EQ(better.quadratic, larger.quadratic);
  EXPECT_EQ(detail_for(100, 1, 500).strand_share, 1);
  EXPECT_GT(detail_for(0, 1, 10'000).strand_share, 0);
}

TEST(DrawDetail, draws_fewer_strands_wider) {
  DrawDetail all, few;
  few.strand_share = 0.1f;
  EXPECT_GT(width_scale(few), 4 * width_scale(all));
  EXPECT_LE(width_scale(few), 10 * width_scale(all));
}

TEST(Projection, puts_the_target_in_the_middle_and_up_up) {
  const Camera camera{{1, 2, 3}, {0, 1, 0}, {0, 1, 0}, 40};
  const Eigen::Matrix3d rotation = render::view_rotation(camera);
  EXPECT_LT((rotation * rotation.transpose() - Eigen::Matrix3d::Identity()).norm(), 1e-12);
  const Vec3 target = rotation * (camera.target - camera.eye);
  EXPECT_NEAR(target.x(), 0, 1e-12);
  EXPECT_NEAR(target.y(), 0, 1e-12);
  EXPECT_LT(target.z(), 0);
  EXPECT_GT((rotation * Vec3::UnitY()).y(), 0.5);
}

TEST(Projection, mends_cameras_that_see_nothing) {
  constexpr double kNan = std::numeric_limits<double>::quiet_NaN();
  for (const Camera& camera :
       {Camera{{0, 0, 0}, {0, 0, 0}, {0, 1, 0}, 30}, Camera{{kNan, 0, 0}, {0, 0, 0}, {0, 1, 0}, 30},
        Camera{{0, 1, 0}, {0, 0, 0}, {0, 1, 0}, 30}, Camera{{0, 0, 1}, {0, kNan, 0}, {0, 0, 0}, 0}}) {
    const Camera fine = render::sanitized(camera);
    EXPECT_TRUE(render::view_rotation(fine).allFinite());
    EXPECT_GT(fine.fov_deg, 0);
  }
}

}  // namespace
}  // namespace hairnet::draw
