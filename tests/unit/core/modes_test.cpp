#include <gtest/gtest.h>

#include <Eigen/Eigenvalues>
#include <numeric>

#include "client/assets/made/made.hpp"
#include "core/ffd/deform.hpp"
#include "core/levels/build.hpp"
#include "core/levels/level_map.hpp"
#include "core/modes/hair_metric.hpp"
#include "core/modes/leading_eigenvectors.hpp"
#include "core/modes/make_modes.hpp"
#include "core/modes/training_motion.hpp"
#include "core/random.hpp"
#include "core/world/world.hpp"

namespace hairnet {
namespace {

// A ParallelFor that does the work in the opposite order.
void last_first(std::size_t count, const std::function<void(std::size_t)>& body) {
  for (std::size_t i = count; i > 0; --i) body(i - 1);
}

class HairModes : public testing::Test {
 protected:
  // 400 strands save time: modes describe the lattice, which hardly depends on the number of strands.
  static void SetUpTestSuite() {
    HairstyleOptions options;
    options.strand_count = 400;
    groom_ = new Groom(*make_hairstyle("long_straight", options));
    levels_ = build_levels(*groom_);
    modes_ = make_modes(*groom_, levels_);
  }
  static void TearDownTestSuite() {
    delete groom_;
    levels_.reset();
    modes_.reset();
  }
  static const Level& high() { return (*levels_)[LevelIndex::high]; }
  static std::vector<Vec3f> displacements(std::span<const float> coefficients) {
    std::vector<Vec3f> nodes(high().rest.size());
    displacements_of(modes_->basis, coefficients, nodes);
    return nodes;
  }
  static std::vector<float> some_coefficients(std::uint64_t seed) {
    Random random(seed);
    std::vector<float> coefficients;
    for (const float deviation : modes_->basis.deviation_m) {
      coefficients.push_back(deviation * static_cast<float>(random.symmetric()));
    }
    return coefficients;
  }
  // Returns the mean square displacement of the hair's points when the nodes are displaced so.
  static double mean_square_m2(std::span<const Vec3f> nodes) {
    std::vector<Vec3f> grid(high().geometry.lattice.node_count()), points(groom_->points.size());
    expand_displacements(high().geometry, nodes, grid);
    Deformer(*groom_, high().geometry.lattice, FfdKind::quadratic).deform(grid, points);
    double sum = 0;
    for (std::size_t i = 0; i < points.size(); ++i) {
      sum += (points[i] - groom_->points[i]).cast<double>().squaredNorm();
    }
    return sum / static_cast<double>(points.size());
  }

  static inline Groom* groom_ = nullptr;
  static inline std::shared_ptr<const LevelSet> levels_;
  static inline std::shared_ptr<const Modes> modes_;
};

TEST_F(HairModes, move_the_hair_by_the_length_of_their_coefficients) {
  for (std::uint64_t seed = 1; seed <= 4; ++seed) {
    const std::vector<float> c = some_coefficients(seed);
    const double expected = std::inner_product(c.begin(), c.end(), c.begin(), 0.0);
    // The modes are orthonormal on a sample of the hair's points and rounded to 16 bits, while this mean is over all
    // points, so 5 % are allowed.
    EXPECT_NEAR(mean_square_m2(displacements(c)), expected, 0.05 * expected);
  }
}

TEST_F(HairModes, are_orthonormal_in_the_metric_of_the_hair) {
  const Eigen::MatrixXf metric = hair_metric(*groom_, high());
  const std::size_t count = modes_->basis.mode_count();
  for (std::size_t i : {std::size_t{0}, count / 2, count - 1}) {
    for (std::size_t k : {std::size_t{0}, std::size_t{1}, count / 2, count - 1}) {
      std::vector<float> one(count), other(count);
      one[i] = other[k] = 1;
      const std::vector<Vec3f> a = displacements(one), b = displacements(other);
      using Nodes = Eigen::Map<const Eigen::Matrix3Xf>;
      const auto size = static_cast<Eigen::Index>(a.size());
      const float product = (Nodes(a[0].data(), 3, size) * metric).cwiseProduct(Nodes(b[0].data(), 3, size)).sum();
      // The rounding of the modes to 16 bits must cost no more than 2 %.
      EXPECT_NEAR(product, i == k ? 1 : 0, 0.02) << i << " and " << k;
    }
  }
}

TEST_F(HairModes, come_with_the_largest_deviation_first) {
  EXPECT_TRUE(std::ranges::is_sorted(modes_->basis.deviation_m, std::greater{}));
  // The last mode must matter far less than the first, or leaving out the last ones would save nothing.
  EXPECT_GT(modes_->basis.deviation_m.front(), 20 * modes_->basis.deviation_m.back());
}

TEST_F(HairModes, give_back_the_coefficients_that_moved_the_nodes) {
  const std::vector<float> c = some_coefficients(5);
  std::vector<float> found(c.size());
  modes_->map(LevelIndex::high).coefficients_of(displacements(c), found);
  for (std::size_t k = 0; k < c.size(); ++k) EXPECT_NEAR(found[k], c[k], 1e-4) << k;
}

TEST_F(HairModes, need_no_other_coefficients_to_find_the_first) {
  const std::vector<Vec3f> nodes = displacements(some_coefficients(6));
  std::vector<float> all(modes_->basis.mode_count()), first(10);
  modes_->map(LevelIndex::high).coefficients_of(nodes, all);
  modes_->map(LevelIndex::high).coefficients_of(nodes, first);
  for (std::size_t k = 0; k < first.size(); ++k) EXPECT_NEAR(first[k], all[k], 1e-6) << k;
}

TEST_F(HairModes, give_characters_at_once_what_they_give_each) {
  const std::size_t count = modes_->basis.mode_count();
  for (const std::size_t wanted : {count, count - 3}) {
    for (const std::size_t characters : {1u, 3u, 5u, 16u}) {
      std::vector<std::vector<Vec3f>> nodes;
      std::vector<std::vector<float>> found(characters, std::vector<float>(wanted));
      for (unsigned i = 0; i < characters; ++i) nodes.push_back(displacements(some_coefficients(20 + i)));
      const std::vector<std::span<const Vec3f>> in(nodes.begin(), nodes.end());
      const std::vector<std::span<float>> out(found.begin(), found.end());
      modes_->map(LevelIndex::high).coefficients_of(in, out);
      for (std::size_t i = 0; i < characters; ++i) {
        std::vector<float> own(wanted);
        modes_->map(LevelIndex::high).coefficients_of(nodes[i], own);
        for (std::size_t k = 0; k < wanted; ++k)
          ASSERT_NEAR(found[i][k], own[k], 1e-6) << i << " of " << characters << ", " << k;
      }
    }
  }
}

TEST_F(HairModes, of_hair_at_rest_are_zero_on_every_level) {
  for (std::size_t i = 0; i < 4; ++i) {
    std::vector<float> c(modes_->basis.mode_count(), 1);
    modes_->maps[i].coefficients_of(std::vector<Vec3f>(levels_->levels[i].rest.size(), Vec3f::Zero()), c);
    EXPECT_TRUE(std::ranges::all_of(c, [](float value) { return value == 0; })) << i;
  }
}

// Sums of squared distances over motions that the modes were not learnt from. Divided by `motion`, a sum becomes a
// share of the motion.
struct Errors {
  double motion = 0;
  // These are the errors when the first 8, the first 32, and all coefficients are used.
  std::array<double, 3> first{};
  // These are the errors of each level, from the finest on: `moved` maps the level's own lattice to the finest nodes,
  // `learnt` goes through the coefficients that the modes find for it.
  std::array<double, 4> moved{}, learnt{};
};

// Steps all four levels through the poses, and adds their errors against the finest level.
void add_errors(const Groom& groom, const std::shared_ptr<const LevelSet>& levels, const Modes& modes,
                const std::vector<Pose>& poses, Errors& errors) {
  const Eigen::MatrixXf metric = hair_metric(groom, (*levels)[LevelIndex::high]);
  World world({});
  std::array<CharacterId, 4> ids;
  for (std::size_t i = 0; i < 4; ++i) ids[i] = world.add({levels, static_cast<LevelIndex>(i), poses[0]});
  const std::size_t nodes = modes.basis.node_count;
  std::vector<Vec3f> rebuilt(nodes);
  std::vector<float> c(modes.basis.mode_count());
  for (std::size_t tick = 1; tick < poses.size(); ++tick) {
    for (const CharacterId id : ids) world.set_pose(id, poses[tick]);
    world.step();
    const std::span<const Vec3f> truth = world.lattice(ids[0]).displacement;
    const auto square = [&](bool is_error) {
      Eigen::Matrix3Xf d(3, static_cast<Eigen::Index>(nodes));
      for (std::size_t n = 0; n < nodes; ++n)
        d.col(static_cast<Eigen::Index>(n)) = is_error ? rebuilt[n] - truth[n] : truth[n];
      return static_cast<double>((d * metric).cwiseProduct(d).sum());
    };
    errors.motion += square(false);
    modes.maps[0].coefficients_of(truth, c);
    for (const std::size_t i : {0, 1, 2}) {
      displacements_of(modes.basis, std::span(c).first(std::array{std::size_t{8}, std::size_t{32}, c.size()}[i]),
                       rebuilt);
      errors.first[i] += square(true);
    }
    for (std::size_t i = 1; i < 4; ++i) {
      const std::span<const Vec3f> coarse = world.lattice(ids[i]).displacement;
      levels->map(static_cast<LevelIndex>(i), LevelIndex::high)->apply(coarse, rebuilt);
      errors.moved[i] += square(true);
      modes.maps[i].coefficients_of(coarse, c);
      displacements_of(modes.basis, c, rebuilt);
      errors.learnt[i] += square(true);
    }
  }
}

TEST_F(HairModes, span_a_dance_that_they_were_not_learnt_from) {
  const Motion dance = *make_motion("dance");
  std::vector<Pose> poses;
  for (int tick = 0; tick <= 90; ++tick) poses.push_back(dance.sample(tick / 30.0));
  Errors errors;
  add_errors(*groom_, levels_, *modes_, poses, errors);
  // Over the 90 ticks, hair must move by more than 1 cm RMS, or there is nothing to represent.
  ASSERT_GT(errors.motion, 90 * 0.01 * 0.01);
  // These are squares: 32 coefficients must take away at least 60 % of the squared error that 8 leave, and all
  // coefficients 60 % of the rest.
  EXPECT_LT(errors.first[1], 0.4 * errors.first[0]);
  EXPECT_LT(errors.first[2], 0.4 * errors.first[1]);
  // All modes together must show the dance to 15 % of its motion.
  EXPECT_LT(errors.first[2], 0.15 * 0.15 * errors.motion);
}

// Returns the mean error over eight motions, as a share of each motion. Training takes the numbers below
// ModeTraining::motion_count, so motions from 2000 on have no part in the modes.
double unseen_error(const Groom& groom, const std::shared_ptr<const LevelSet>& levels, const Modes& modes) {
  double sum = 0;
  constexpr std::uint32_t kMotions = 8;
  for (std::uint32_t number = 2000; number < 2000 + kMotions; ++number) {
    Errors errors;
    add_errors(groom, levels, modes, make_training_motion(number, groom.body, 1.0 / 30, 121).poses, errors);
    sum += std::sqrt(errors.first[2] / errors.motion);
  }
  return sum / kMotions;
}

TEST_F(HairModes, are_as_many_as_the_wanted_error_needs) {
  const std::size_t count = modes_->basis.mode_count();
  // make_modes() makes a multiple of 16 modes, at least 32 (make_modes.hpp).
  EXPECT_EQ(count % 16, 0u);
  EXPECT_GE(count, 32u);
  EXPECT_LT(count, kModeCountMax);
  const ModeTraining usual;
  ASSERT_EQ(modes_->validation_error.size(), count);
  EXPECT_TRUE(std::ranges::is_sorted(modes_->validation_error, std::greater{}));
  EXPECT_LE(modes_->validation_error.back(), usual.error_max);
  // The entry at index n is the error of n + 1 coefficients.
  EXPECT_GT(modes_->validation_error[count - 17], usual.error_max) << "sixteen fewer would not do";
}

TEST_F(HairModes, show_unseen_motion_about_as_well_as_the_validation_error_says) {
  const double said = static_cast<double>(modes_->validation_error.back());
  const double error = unseen_error(*groom_, levels_, *modes_);
  // The two errors come from other motions, so they may differ by half.
  EXPECT_GT(error, 0.5 * said);
  EXPECT_LT(error, 1.5 * said);
}

TEST_F(HairModes, are_few_where_much_error_is_allowed_and_as_many_as_there_may_be_where_none_is) {
  const auto some = make_modes(*groom_, levels_, {}, {}, {.duration_s = 2, .error_max = 0.5f});
  // An allowed error of half of the motion needs fewer than the least number of modes, 32.
  EXPECT_EQ(some->basis.mode_count(), 32u);
  const auto all = make_modes(*groom_, levels_, {}, {}, {.duration_s = 2, .error_max = 0});
  EXPECT_EQ(all->basis.mode_count(), kModeCountMax);
  EXPECT_GT(all->validation_error.back(), 0.0f);
}

TEST_F(HairModes, say_how_many_coefficients_an_error_needs) {
  Modes modes;
  modes.validation_error = {0.4f, 0.2f, 0.1f, 0.05f};
  EXPECT_EQ(modes.count_within(0.5f), 1u);
  EXPECT_EQ(modes.count_within(0.1f), 3u);
  EXPECT_EQ(modes.count_within(0.01f), 0u);
}

// With a root length of 10 m, every point of the hair counts as root and moves with the skull. Hair then never moves
// against the head, and the basis of no motion must still be valid.
TEST_F(HairModes, of_hair_that_does_not_move_are_valid) {
  Groom still = *groom_;
  for (StrandProperties& strand : still.strands) strand.root_length_m = 10;
  const auto levels = build_levels(still);
  const auto modes = make_modes(still, levels, {}, {}, {.duration_s = 1});
  EXPECT_EQ(validate(modes->basis), "");
  EXPECT_TRUE(std::ranges::all_of(modes->validation_error, [](float e) { return std::isfinite(e) && e >= 0; }));
}

TEST_F(HairModes, bring_coarse_levels_nearer_to_the_finest_on_the_mean) {
  Errors errors;
  // Training has no motion with such a number. The learnt maps must err at least 10 % less (squared) than moving the
  // coarse lattice to the finest nodes does.
  for (std::uint32_t number = 1000; number < 1008; ++number) {
    add_errors(*groom_, levels_, *modes_, make_training_motion(number, groom_->body, 1.0 / 30, 121).poses, errors);
  }
  for (const std::size_t level : {1, 2, 3}) EXPECT_LT(errors.learnt[level], 0.9 * errors.moved[level]) << level;
}

TEST_F(HairModes, are_the_same_bits_in_any_order_of_the_work) {
  const auto again = make_modes(*groom_, levels_, {}, last_first);
  EXPECT_EQ(again->basis.modes, modes_->basis.modes);
  EXPECT_EQ(again->basis.unit, modes_->basis.unit);
  EXPECT_EQ(again->basis.deviation_m, modes_->basis.deviation_m);
  for (std::size_t i = 0; i < 4; ++i) EXPECT_TRUE(again->maps[i].matrix() == modes_->maps[i].matrix()) << i;
}

// Making modes takes long, so a server must be able to stop it.
TEST_F(HairModes, can_be_cancelled_and_report_progress) {
  double last = 0;
  BuildCallbacks callbacks;
  callbacks.progress = [&](double share, std::string_view) {
    EXPECT_GE(share, last);
    EXPECT_LE(share, 1);
    last = share;
    return share < 0.3;
  };
  EXPECT_EQ(make_modes(*groom_, levels_, callbacks, {}), nullptr);
  EXPECT_GE(last, 0.3);
}

TEST_F(HairModes, that_do_not_fit_together_are_refused) {
  EXPECT_EQ(validate(modes_->basis), "");
  const auto corrupted = [](const auto& corrupt) {
    Basis basis = modes_->basis;
    corrupt(basis);
    return validate(basis);
  };
  EXPECT_NE(corrupted([](Basis& b) { b.modes.pop_back(); }), "");
  EXPECT_NE(corrupted([](Basis& b) { b.unit.pop_back(); }), "");
  EXPECT_NE(corrupted([](Basis& b) { b.node_count = 0; }), "");
  EXPECT_NE(corrupted([](Basis& b) { b.unit[0] = std::numeric_limits<float>::quiet_NaN(); }), "");
  EXPECT_NE(corrupted([](Basis& b) { b.deviation_m[3] = 0; }), "");
  EXPECT_NE(corrupted([](Basis& b) { std::swap(b.deviation_m.front(), b.deviation_m.back()); }), "");
  EXPECT_NE(corrupted([](Basis& b) { b = {}; }), "");
}

TEST(LeadingEigenvectors, are_those_of_a_dense_solver) {
  Random random(3);
  Eigen::MatrixXf x(60, 90);
  for (Eigen::Index row = 0; row < x.rows(); ++row)
    for (Eigen::Index column = 0; column < x.cols(); ++column)
      x(row, column) = static_cast<float>(random.symmetric() * std::pow(0.8, row));
  // Each row is 0.8 times as large as the one before, so the eight largest of 60 eigenvalues are well apart. The dense
  // solver sorts them ascending.
  const Eigen::MatrixXf found = leading_eigenvectors(x, 8, {});
  const Eigen::SelfAdjointEigenSolver<Eigen::MatrixXd> dense((x * x.transpose()).cast<double>());
  ASSERT_EQ(found.cols(), 8);
  for (Eigen::Index k = 0; k < 8; ++k) {
    const double cosine = found.col(k).cast<double>().dot(dense.eigenvectors().col(59 - k));
    EXPECT_NEAR(std::abs(cosine), 1, 1e-4) << k;
  }
}

TEST(TrainingMotions, are_valid_and_have_no_teleports) {
  // Every sixteen motions have all kinds (training_motion.hpp), so these are each kind twice. 151 poses are 5 s.
  for (std::uint32_t n = 0; n < 32; ++n) {
    const TrainingMotion motion = make_training_motion(n, Body{}, 1.0 / 30, 151);
    ASSERT_EQ(motion.poses.size(), 151u);
    EXPECT_EQ(validate(motion.wind), "");
    EXPECT_EQ(validate(motion.material), "");
    for (std::size_t tick = 0; tick < motion.poses.size(); ++tick) {
      ASSERT_TRUE(is_valid(motion.poses[tick])) << n << ", " << tick;
      if (tick == 0) continue;
      ASSERT_FALSE(is_teleport(motion.poses[tick - 1], motion.poses[tick], 1.0 / 30, Vec3::Zero()))
          << n << ", " << tick;
    }
  }
}

TEST(TrainingMotions, have_postures_wind_and_changed_material) {
  bool lies = false, is_windy = false, is_changed = false;
  for (std::uint32_t n = 0; n < 16; ++n) {
    const TrainingMotion motion = make_training_motion(n, Body{}, 1.0 / 30, 151);
    // A head whose up axis is nearly horizontal lies.
    for (const Pose& pose : motion.poses) lies = lies || pose.head().vector(Vec3::UnitY()).y() < 0.1;
    is_windy = is_windy || motion.wind.mean_m_per_s.norm() > 1;
    is_changed = is_changed || motion.material != MaterialScale{};
  }
  EXPECT_TRUE(lies);
  EXPECT_TRUE(is_windy);
  EXPECT_TRUE(is_changed);
}

}  // namespace
}  // namespace hairnet
