#include "core/levels/node_matrix.hpp"

#include <gtest/gtest.h>

#include <random>

namespace hairnet {
namespace {

// Makes 20 stiffeners, each of which acts on five of thirty nodes, with weights from -1 to 1.
Stiffeners some_stiffeners(std::mt19937& random) {
  Stiffeners list;
  for (int s = 0; s < 20; ++s) {
    for (int e = 0; e < 5; ++e) {
      list.nodes.push_back(static_cast<std::uint16_t>(6 * e + static_cast<int>(random() % 6)));
      list.weights.push_back(static_cast<float>(random() % 100) / 50 - 1);
    }
    list.begin.push_back(static_cast<std::uint32_t>(list.nodes.size()));
    list.stiffness.push_back(1);
  }
  return list;
}

TEST(NodeMatrix, solves_the_system_that_was_put_in) {
  constexpr std::size_t kNodes = 30;
  std::mt19937 random(4);
  const Stiffeners list = some_stiffeners(random);
  NodeMatrix matrix(kNodes, {&list});
  // The dense matrix gets the same numbers without the sparse structure. Each node has a block of 3 x 3.
  Eigen::MatrixXd dense = Eigen::MatrixXd::Zero(3 * kNodes, 3 * kNodes);
  matrix.set_zero();
  for (std::size_t i = 0; i < kNodes; ++i) {
    const double diagonal = 1 + 0.1 * static_cast<double>(i);
    // isotropic_and_axial(a, b, e) is a I + b e e^T. The diagonal keeps the matrix positive definite, as mass does.
    matrix.add(i, isotropic_and_axial(diagonal, 0, Vec3::Zero()));
    for (std::size_t c = 0; c < 3; ++c) dense(3 * i + c, 3 * i + c) += diagonal;
  }
  for (std::size_t s = 0; s < list.count(); ++s) {
    const Vec3 e = Vec3(1, 0.1 * static_cast<double>(s), -0.5).normalized();
    const std::vector<double> weights(list.weights.begin() + list.begin[s], list.weights.begin() + list.begin[s + 1]);
    const std::span nodes(list.nodes.data() + list.begin[s], 5);
    matrix.add(nodes, weights, isotropic_and_axial(0.2, 3, e));
    const Mat3 block = 0.2 * Mat3::Identity() + 3 * e * e.transpose();
    for (std::size_t i = 0; i < 5; ++i) {
      for (std::size_t j = 0; j < 5; ++j)
        dense.block<3, 3>(3 * nodes[i], 3 * nodes[j]) += weights[i] * weights[j] * block;
    }
  }
  ASSERT_TRUE(matrix.factor());
  const Eigen::MatrixXd loads = Eigen::MatrixXd::Random(3 * kNodes, 2);
  EXPECT_NEAR((dense * matrix.solve(loads) - loads).norm(), 0, 1e-10);
}

TEST(NodeMatrix, refuses_a_matrix_that_is_singular) {
  NodeMatrix matrix(2, {});
  matrix.set_zero();
  // Only the first of two nodes gets a block, so the second one could move without any force.
  matrix.add(0, isotropic_and_axial(1, 0, Vec3::Zero()));
  EXPECT_FALSE(matrix.factor());
}

TEST(NodeMatrixDeathTest, asserts_that_the_matrix_is_factored_since_its_last_change) {
  NodeMatrix matrix(1, {});
  matrix.set_zero();
  matrix.add(0, isotropic_and_axial(1, 0, Vec3::Zero()));
  const Eigen::MatrixXd loads = Eigen::MatrixXd::Ones(3, 1);
  EXPECT_DEATH(static_cast<void>(matrix.solve(loads)), "is_factored_");
  ASSERT_TRUE(matrix.factor());
  EXPECT_NEAR((matrix.solve(loads) - loads).norm(), 0, 1e-12);
  matrix.add(0, isotropic_and_axial(1, 0, Vec3::Zero()));
  EXPECT_DEATH(static_cast<void>(matrix.solve(loads)), "is_factored_");
}

TEST(NodeMatrixDeathTest, asserts_that_two_nodes_share_a_stiffener) {
  NodeMatrix matrix(2, {});
  const std::array<std::uint16_t, 2> nodes{0, 1};
  const std::array<double, 2> weights{1, -1};
  EXPECT_DEATH(matrix.add(nodes, weights, isotropic_and_axial(1, 0, Vec3::Zero())), "place != column_end");
}

}  // namespace
}  // namespace hairnet
