#include <gtest/gtest.h>

#include "core/levels/build.hpp"
#include "core/levels/decimate.hpp"
#include "tests/support/case_name.hpp"
#include "tests/support/real_hair.hpp"
#include "tests/unit/core/build_lists.hpp"
#include "tests/unit/core/level_checks.hpp"

namespace hairnet {
namespace {

class RealHairs : public testing::TestWithParam<test::RealHair> {
 protected:
  void SetUp() override {
    const auto path = test::shared_data() / GetParam().path;
    if (!std::filesystem::exists(path)) GTEST_SKIP() << "no real hairstyle at " << path;
    auto groom = test::import_real(GetParam());
    ASSERT_TRUE(groom) << groom.error();
    groom_ = std::move(*groom);
  }
  Groom groom_;
};

TEST_P(RealHairs, give_valid_levels_with_all_requested_stiffeners) {
  std::array<LevelReport, 4> reports;
  const auto set = build_levels(groom_, {}, &reports);
  for (std::size_t i = 0; i < kLevelSpecs.size(); ++i) {
    support::expect_valid(set->levels[i]);
    // Real hair has far more springs than a level takes, so every level gets its full number. It may have fewer
    // attachments.
    EXPECT_EQ(reports[i].springs_after, kLevelSpecs[i].spring_count);
    EXPECT_EQ(reports[i].attachments_after, std::min(reports[i].attachments_before, kLevelSpecs[i].attachment_count));
    EXPECT_GT(reports[i].contacts, 0u);
  }
}

TEST_P(RealHairs, decimation_errs_far_less_than_a_random_part_of_the_springs_made_stiffer) {
  // The grid has 5 nodes on each axis and 200 springs remain, as in the low level.
  const Grid grid = support::grid_of(groom_, 5);
  StiffenerList springs = support::springs_of(groom_, grid);
  const std::size_t count = 200;
  const Eigen::MatrixXd all = support::weight_matrix(springs, grid.node_count());
  Eigen::MatrixXd part = Eigen::MatrixXd::Zero(all.rows(), all.cols());
  for (std::size_t i = 0; i < count; ++i) {
    const std::size_t s = i * springs.count() / count;
    const Eigen::VectorXd w = support::dense(springs, s, grid.node_count());
    part += springs.stiffness[s] * w * w.transpose();
  }
  // Decimation must beat every n-th spring made stiffer, so that both have the same stiffness in all.
  part *= all.trace() / part.trace();
  ASSERT_TRUE(decimate(grid, StiffenerKind::spring, count, springs));
  const double error = (support::weight_matrix(springs, grid.node_count()) - all).norm();
  EXPECT_LT(error, 0.5 * (part - all).norm());
  EXPECT_LT(error, 0.1 * all.norm());
}

INSTANTIATE_TEST_SUITE_P(Styles, RealHairs, testing::ValuesIn(test::kRealHair), support::CaseName());

}  // namespace
}  // namespace hairnet
