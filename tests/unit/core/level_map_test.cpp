#include "core/levels/level_map.hpp"

#include <gtest/gtest.h>

#include <numeric>
#include <random>

#include "client/assets/made/made.hpp"
#include "core/ffd/deform.hpp"
#include "core/levels/build.hpp"
#include "core/solver/energy.hpp"
#include "core/solver/head_motion.hpp"
#include "core/solver/step.hpp"
#include "tests/support/levels.hpp"

namespace hairnet {
namespace {

class LevelMaps : public testing::Test {
 protected:
  static void SetUpTestSuite() {
    HairstyleOptions options;
    options.strand_count = 600;
    groom_ = new Groom(*make_hairstyle("long_straight", options));
    levels_ = build_levels(*groom_);
  }
  static void TearDownTestSuite() {
    delete groom_;
    levels_.reset();
  }
  // Returns the displacements of a level's nodes in a field.
  static std::vector<Vec3f> nodes_of(LevelIndex level, const auto& field) {
    std::vector<Vec3f> nodes;
    for (const Vec3f& p : (*levels_)[level].rest) nodes.push_back(field(p));
    return nodes;
  }
  static std::vector<Vec3f> mapped(LevelIndex from, LevelIndex to, const std::vector<Vec3f>& nodes) {
    std::vector<Vec3f> out((*levels_)[to].rest.size());
    levels_->map(from, to)->apply(nodes, out);
    return out;
  }
  // Returns the strand points of the hair when the nodes of that level are displaced so.
  static std::vector<Vec3f> strands(LevelIndex level, const std::vector<Vec3f>& nodes) {
    const Level& model = (*levels_)[level];
    std::vector<Vec3f> grid(model.geometry.lattice.node_count()), points(groom_->points.size());
    expand_displacements(model.geometry, nodes, grid);
    Deformer(*groom_, model.geometry.lattice, FfdKind::quadratic).deform(grid, points);
    return points;
  }
  static double rms_m(const std::vector<Vec3f>& a, const std::vector<Vec3f>& b) {
    double sum = 0;
    for (std::size_t i = 0; i < a.size(); ++i) sum += static_cast<double>((a[i] - b[i]).squaredNorm());
    return std::sqrt(sum / static_cast<double>(a.size()));
  }

  static inline Groom* groom_ = nullptr;
  static inline std::shared_ptr<const LevelSet> levels_;
};

// Any level can show an affine deformation, so a change of level must lose nothing of it.
TEST_F(LevelMaps, carry_an_affine_deformation_over_exactly) {
  // The field displaces strands by several centimetres, and the error may be 0.2 mm.
  const auto affine = [](const Vec3f& p) {
    return Vec3f(0.02f + 0.3f * p.y(), -0.1f * p.x() + 0.05f * p.z(), 0.2f * p.y() - 0.01f);
  };
  for (const LevelIndex from : {LevelIndex::high, LevelIndex::medium, LevelIndex::low}) {
    for (const LevelIndex to : {LevelIndex::high, LevelIndex::medium, LevelIndex::low, LevelIndex::ether}) {
      if (from == to) continue;
      const std::vector<Vec3f> nodes = nodes_of(from, affine);
      EXPECT_LT(rms_m(strands(to, mapped(from, to, nodes)), strands(from, nodes)), 2e-4)
          << kLevelNames[static_cast<std::size_t>(from)] << " to " << kLevelNames[static_cast<std::size_t>(to)];
    }
  }
}

TEST_F(LevelMaps, from_low_to_high_strands_stay_where_they_are) {
  // The waves have amplitudes of 4 and 3 cm, and lengths of 52 and 70 cm.
  const auto wave = [](const Vec3f& p) { return Vec3f(0.04f * std::sin(12 * p.y()), 0, 0.03f * std::cos(9 * p.y())); };
  const std::vector<Vec3f> low = nodes_of(LevelIndex::low, wave);
  const std::vector<Vec3f> before = strands(LevelIndex::low, low);
  // The finer lattice cannot show a coarser one exactly, but it must within 1 mm.
  EXPECT_LT(rms_m(strands(LevelIndex::high, mapped(LevelIndex::low, LevelIndex::high, low)), before), 1e-3);
}

// The least squares fit is the best that the new level can do; what sampling the old lattice gives is worse.
TEST_F(LevelMaps, from_high_to_low_keep_strands_better_than_sampling_does) {
  // The wave has an amplitude of 4 cm and a length of 31 cm.
  const auto wave = [](const Vec3f& p) { return Vec3f(0.04f * std::sin(20 * p.y()), 0, 0); };
  const std::vector<Vec3f> high = nodes_of(LevelIndex::high, wave);
  const std::vector<Vec3f> before = strands(LevelIndex::high, high);
  const double fitted = rms_m(strands(LevelIndex::low, mapped(LevelIndex::high, LevelIndex::low, high)), before);
  const double sampled = rms_m(strands(LevelIndex::low, nodes_of(LevelIndex::low, wave)), before);
  // A fit that was hardly better would not be worth its matrices.
  EXPECT_LT(fitted, 0.8 * sampled);
}

TEST_F(LevelMaps, between_levels_of_one_lattice_change_no_bit) {
  // The ether level has the lattice of the low one.
  const std::vector<Vec3f> low = nodes_of(LevelIndex::low, [](const Vec3f& p) { return Vec3f(0.1f * p); });
  EXPECT_EQ(mapped(LevelIndex::low, LevelIndex::ether, low), low);
}

// A server may change a level again and again. If each change added a little energy, hair would start to move by
// itself.
TEST_F(LevelMaps, back_and_forth_a_thousand_times_adds_no_energy) {
  std::mt19937 random(7);
  std::normal_distribution<float> normal(0, 0.02f);
  const std::vector<Vec3f> start =
      nodes_of(LevelIndex::high, [&](const Vec3f&) { return Vec3f(normal(random), normal(random), normal(random)); });
  for (const LevelIndex other : {LevelIndex::medium, LevelIndex::low}) {
    std::vector<Vec3f> nodes = start;
    const auto energy_j = [&] {
      const Level& level = (*levels_)[LevelIndex::high];
      const LatticeState state{nodes, std::vector<Vec3f>(nodes.size(), Vec3f::Zero())};
      return energy(level, {}, HeadMotion(StepInput{}), state).elastic_j;
    };
    const double first = energy_j();
    for (int i = 0; i < 1000; ++i) nodes = mapped(other, LevelIndex::high, mapped(LevelIndex::high, other, nodes));
    EXPECT_LE(energy_j(), first);
  }
}

TEST_F(LevelMaps, count_the_memory_of_their_matrices) {
  const LevelMap& map = *levels_->map(LevelIndex::low, LevelIndex::high);
  const std::size_t low = (*levels_)[LevelIndex::low].rest.size(), high = (*levels_)[LevelIndex::high].rest.size();
  EXPECT_EQ(map.bytes(), sizeof(LevelMap) + low * high * sizeof(float));
  EXPECT_EQ(levels_->map(LevelIndex::ether, LevelIndex::low)->bytes(), sizeof(LevelMap));
}

TEST(LevelMapDeathTest, asserts_that_there_is_one_entry_for_each_node) {
  const Level from = support::make_random_level({.nodes_per_axis = 4});
  const Level to = support::make_random_level({.nodes_per_axis = 5});
  const LevelMap map(from, to, from.rest, std::vector<float>(from.rest.size(), 1.0f));
  std::vector<Vec3f> few(from.rest.size() - 1, Vec3f::Zero()), nodes(to.rest.size());
  EXPECT_DEATH(map.apply(few, nodes), "from.size\\(\\)");
  const LevelMap same(from, from, from.rest, std::vector<float>(from.rest.size(), 1.0f));
  EXPECT_DEATH(same.apply(from.rest, nodes), "from.size\\(\\) == to.size\\(\\)");
}

}  // namespace
}  // namespace hairnet
