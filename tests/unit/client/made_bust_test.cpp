#include <gtest/gtest.h>

#include <cmath>
#include <map>

#include "client/assets/made/bust_shape.hpp"
#include "client/assets/made/made.hpp"

namespace hairnet {
namespace {

const Body& bust() {
  static const Body body = make_bust();
  return body;
}

TEST(MadeBust, is_closed_with_every_edge_met_once_from_each_side) {
  std::map<std::pair<std::uint32_t, std::uint32_t>, int> edges;
  for (const auto& t : bust().mesh.triangles) {
    for (std::size_t i = 0; i < 3; ++i) ++edges[{t[i], t[(i + 1) % 3]}];
  }
  for (const auto& [edge, count] : edges) {
    ASSERT_EQ(count, 1) << edge.first << " to " << edge.second;
    ASSERT_TRUE(edges.contains({edge.second, edge.first})) << edge.first << " to " << edge.second;
  }
}

TEST(MadeBust, is_one_piece_without_handles) {
  const auto vertices = static_cast<long>(bust().mesh.vertices.size());
  const auto triangles = static_cast<long>(bust().mesh.triangles.size());
  // By Euler's formula V - E + F = 2, and each edge belongs to two triangles, so E = 3 F / 2.
  EXPECT_EQ(2 * vertices - triangles, 4);
}

TEST(MadeBust, encloses_the_volume_of_a_head_and_shoulders_wound_outwards) {
  double volume_m3 = 0;
  for (const auto& t : bust().mesh.triangles) {
    const auto corner = [&](std::size_t i) -> Vec3 { return bust().mesh.vertices[t[i]].cast<double>(); };
    volume_m3 += corner(0).dot(corner(1).cross(corner(2))) / 6;
  }
  // The signed volume is negative for a mesh that is wound inwards. The bounds are those of an adult's head, neck
  // and shoulders: 8 and 20 litres.
  EXPECT_GT(volume_m3, 0.008);
  EXPECT_LT(volume_m3, 0.020);
}

TEST(MadeBust, has_an_adult_head_about_the_head_joint) {
  Eigen::AlignedBox3f skull, all;
  for (const Vec3f& v : bust().mesh.vertices) {
    all.extend(v);
    // 7 cm above the head joint there is the skull alone, without ears and neck.
    if (v.y() > 0.07f) skull.extend(v);
  }
  EXPECT_NEAR(skull.max().y(), 0.15, 0.01);
  EXPECT_NEAR(skull.sizes().x(), 0.155, 0.01);
  EXPECT_NEAR(skull.sizes().z(), 0.195, 0.015);
  EXPECT_NEAR(all.sizes().x(), 0.40, 0.03);
  EXPECT_NEAR(made::bust_distance(Vec3(0, -0.055, 0.090)), 0, 0.012) << "chin";
  EXPECT_LT(made::bust_distance(Vec3::Zero()), -0.03) << "the joint lies inside";
}

TEST(MadeBust, has_its_vertices_on_the_skin) {
  for (const Vec3f& v : bust().mesh.vertices) {
    ASSERT_LT(std::abs(made::bust_distance(v.cast<double>())), 2e-4) << v.transpose();
  }
}

TEST(MadeBust, weights_are_shares_and_mirror_left_and_right) {
  ASSERT_EQ(bust().bone_weights.size(), bust().mesh.vertices.size());
  double left = 0, right = 0;
  for (std::size_t i = 0; i < bust().bone_weights.size(); ++i) {
    float sum = 0;
    for (const float w : bust().bone_weights[i]) {
      ASSERT_GE(w, 0);
      sum += w;
    }
    ASSERT_NEAR(sum, 1, 1e-5);
    left += bust().bone_weights[i][static_cast<std::size_t>(Bone::left_shoulder)];
    right += bust().bone_weights[i][static_cast<std::size_t>(Bone::right_shoulder)];
  }
  // The sum of the weights says that the shoulder moves many vertices.
  EXPECT_GT(left, 100);
  EXPECT_NEAR(left / right, 1, 0.02);
}

TEST(MadeBust, turns_scalp_with_the_head_and_shoulders_with_the_clavicles) {
  for (std::size_t i = 0; i < bust().mesh.vertices.size(); ++i) {
    const Vec3f& v = bust().mesh.vertices[i];
    const auto weight = [&](Bone bone) { return bust().bone_weights[i][static_cast<std::size_t>(bone)]; };
    // From 2 cm above the head joint on, all skin turns with the head. Skin beyond x = 15 cm is the left shoulder,
    // and skin 20 cm below the joint the chest.
    if (v.y() > 0.02f) {
      ASSERT_FLOAT_EQ(weight(Bone::head), 1) << v.transpose();
    }
    if (v.x() > 0.15f && v.y() > -0.2f) {
      ASSERT_GT(weight(Bone::left_shoulder), 0.9) << v.transpose();
    }
    if (v.y() < -0.20f) {
      ASSERT_EQ(weight(Bone::head), 0) << v.transpose();
    }
  }
}

}  // namespace
}  // namespace hairnet
