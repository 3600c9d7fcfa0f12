#include "core/groom/body.hpp"

#include <gtest/gtest.h>

#include <numeric>

#include "tests/support/levels.hpp"

namespace hairnet {
namespace {

// Makes 3000 vertices at random places of a cube about head, neck and shoulders, with generated weights.
Body make_cloud() {
  Body body;
  std::mt19937 random(1);
  for (int i = 0; i < 3000; ++i) body.mesh.vertices.push_back(Vec3f(0, -0.1f, 0) + support::random_vec(random, 0.3f));
  generate_bone_weights(body);
  return body;
}

TEST(Body, generated_weights_are_shares_that_sum_to_one) {
  const Body body = make_cloud();
  ASSERT_EQ(body.bone_weights.size(), body.mesh.vertices.size());
  for (const auto& weights : body.bone_weights) {
    EXPECT_NEAR(std::accumulate(weights.begin(), weights.end(), 0.0f), 1, 1e-5f);
    for (const float w : weights) EXPECT_GE(w, -1e-6f);
  }
}

TEST(Body, generated_weights_follow_the_anatomy) {
  Body body;
  // The vertices are inside the head, neck, left and right shoulder and trunk, in the order of the bones.
  body.mesh.vertices = {{0, 0.1f, 0}, {0, -0.08f, 0}, {0.16f, -0.17f, 0}, {-0.16f, -0.17f, 0}, {0, -0.35f, 0}};
  generate_bone_weights(body);
  for (std::size_t b = 0; b < kBoneCount; ++b) EXPECT_GT(body.bone_weights[b][b], 0.6f) << kBoneNames[b];
}

TEST(Body, generated_weights_have_no_step) {
  Body body;
  for (int i = 0; i < 600; ++i) body.mesh.vertices.push_back({0.08f, 0.1f - 0.001f * static_cast<float>(i), 0.02f});
  generate_bone_weights(body);
  for (std::size_t v = 1; v < body.bone_weights.size(); ++v) {
    for (std::size_t b = 0; b < kBoneCount; ++b) {
      // The vertices are 1 mm apart. A weight that jumped from bone to bone would change by up to 1.
      EXPECT_LT(std::abs(body.bone_weights[v][b] - body.bone_weights[v - 1][b]), 0.06f) << "at " << v << " mm";
    }
  }
}

TEST(Body, skin_moves_rigidly_with_a_rigid_pose) {
  const Body body = make_cloud();
  const RigidTransform whole = support::turned(0.7, {1, 2, 3}, {1, 2, 3});
  std::vector<Vec3f> out;
  skin_vertices(body, rigid_pose(whole), out);
  for (std::size_t v = 0; v < out.size(); ++v) {
    EXPECT_LT((out[v].cast<double>() - whole.point(body.mesh.vertices[v].cast<double>())).norm(), 3e-6);
  }
}

}  // namespace
}  // namespace hairnet
