#include "client/link/lattice_blend.hpp"

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <map>
#include <random>

#include "client/assets/made/made.hpp"
#include "client/link/switch_blend.hpp"
#include "core/ffd/deform.hpp"
#include "core/levels/build.hpp"

namespace hairnet::link {
namespace {

constexpr std::int64_t kMs = 1'000'000;

// A groom with lattices of every level, and hair points as either blend has them.
class LatticeBlendTest : public ::testing::Test {
 protected:
  static void SetUpTestSuite() {
    HairstyleOptions options;
    options.strand_count = 150;
    groom_ = new Groom(*make_hairstyle("bob", options));
    for (std::size_t i = 0; i < 3; ++i) {
      const auto level = build_level(*groom_, kLevelSpecs[i]);
      geometries_[i] = std::make_shared<const LevelGeometry>(level->geometry);
      deformers_[i] = std::make_unique<Deformer>(*groom_, geometries_[i]->lattice, FfdKind::quadratic);
    }
  }
  static void TearDownTestSuite() {
    delete groom_;
    for (auto& deformer : deformers_) deformer.reset();
  }

  // Hair that swings by centimetres; each level shows another shape. Rigid has none.
  Playout::Sample sample(LevelIndex level, std::int64_t time_ns) {
    displacement_.clear();
    if (level == LevelIndex::rigid) return {true, {}, level, {}, time_ns, {}};
    const auto& geometry = geometries_[static_cast<std::size_t>(level)];
    std::mt19937 random(static_cast<unsigned>(level) + 1);
    const double phase = 5e-9 * static_cast<double>(time_ns) + static_cast<double>(level);
    std::uniform_real_distribution<float> any(-0.02f, 0.02f);
    displacement_.resize(geometry->active_nodes.size());
    for (Vec3f& d : displacement_) d = static_cast<float>(std::sin(phase)) * Vec3f(any(random), any(random), 0.03f);
    return {true, {}, level, displacement_, time_ns, geometry};
  }

  static std::vector<Vec3f> deformed(std::span<const LatticeLayer> layers) {
    std::vector<Vec3f> points = groom_->points, of_layer(points.size());
    for (const LatticeLayer& layer : layers) {
      const auto level = std::find_if(geometries_.begin(), geometries_.end(),
                                      [&](const auto& geometry) { return geometry.get() == layer.geometry; });
      deformers_[static_cast<std::size_t>(level - geometries_.begin())]->deform(layer.grid_displacements, of_layer);
      for (std::size_t i = 0; i < points.size(); ++i) points[i] += layer.weight * (of_layer[i] - groom_->points[i]);
    }
    return points;
  }

  // The result of a display that blends points.
  std::vector<Vec3f> shown_by_points(const Playout::Sample& s, bool discontinuous) {
    std::vector<Vec3f> points = groom_->points;
    if (!s.displacement.empty()) {
      std::vector<Vec3f> grid(s.geometry->lattice.node_count());
      expand_displacements(*s.geometry, s.displacement, grid);
      deformers_[static_cast<std::size_t>(s.level)]->deform(grid, points);
    }
    points_.apply(s.level, s.time_ns, discontinuous, points);
    return points;
  }

  static float furthest(const std::vector<Vec3f>& a, const std::vector<Vec3f>& b) {
    float most = 0;
    for (std::size_t i = 0; i < a.size(); ++i) most = std::max(most, (a[i] - b[i]).norm());
    return most;
  }

  static inline Groom* groom_ = nullptr;
  static inline std::array<std::shared_ptr<const LevelGeometry>, 3> geometries_;
  static inline std::array<std::unique_ptr<Deformer>, 3> deformers_;
  std::vector<Vec3f> displacement_;
  SwitchBlend points_;
  LatticeBlend lattices_;
};

constexpr float kRounding_m = 1e-6f;

TEST_F(LatticeBlendTest, one_layer_of_full_weight_while_the_level_stays) {
  for (std::int64_t now = 0; now < 100 * kMs; now += 10 * kMs) {
    lattices_.apply(sample(LevelIndex::low, now));
    ASSERT_EQ(lattices_.layers().size(), 1u);
    EXPECT_EQ(lattices_.layers()[0].weight, 1);
    EXPECT_EQ(lattices_.layers()[0].geometry, geometries_[2].get());
  }
}

TEST_F(LatticeBlendTest, the_field_is_what_blended_points_show_over_switches_and_switches_during_a_fade) {
  // Level and when it begins, in ms: alone, then within the fade of the one before, into rigid and back.
  const std::vector<std::pair<LevelIndex, int>> script{
      {LevelIndex::high, 0},     {LevelIndex::low, 100},   {LevelIndex::medium, 1000}, {LevelIndex::low, 1130},
      {LevelIndex::rigid, 2000}, {LevelIndex::high, 2200}, {LevelIndex::medium, 3000}, {LevelIndex::low, 3390}};
  std::size_t blended = 0, doubly = 0;
  float largest = 0;
  for (int ms = 0; ms < 4000; ms += 10) {
    LevelIndex level = LevelIndex::high;
    for (const auto& [to, from_ms] : script) level = ms >= from_ms ? to : level;
    const Playout::Sample s = sample(level, ms * kMs);
    const std::vector<Vec3f> wanted = shown_by_points(s, false);
    lattices_.apply(s);
    ASSERT_LT(furthest(deformed(lattices_.layers()), wanted), kRounding_m) << ms << " ms";
    ASSERT_LE(lattices_.layers().size(), kLatticeLayersMax);
    blended += lattices_.layers().size() == 3;
    doubly += lattices_.layers().size() == 5;
    largest = std::max(
        largest,
        furthest(wanted, deformed(lattices_.layers().first(std::min<std::size_t>(1, lattices_.layers().size())))));
  }
  EXPECT_GT(largest, 0.01f) << "nothing to blend: the case tests nothing";
  EXPECT_GT(blended, 50u);
  EXPECT_GT(doubly, 20u);
}

TEST_F(LatticeBlendTest, a_third_switch_drops_what_is_weakest_and_keeps_five_layers) {
  LevelIndex level = LevelIndex::high;
  for (int ms = 0; ms < 3000; ms += 10) {
    if (ms % 60 == 0) level = static_cast<LevelIndex>((ms / 60) % 3);
    lattices_.apply(sample(level, ms * kMs));
    ASSERT_LE(lattices_.layers().size(), kLatticeLayersMax);
    float sum = 0;
    for (const LatticeLayer& layer : lattices_.layers()) sum += layer.weight;
    ASSERT_NEAR(sum, 1, 1e-6f);
  }
}

TEST_F(LatticeBlendTest, a_teleport_is_shown_as_it_is) {
  lattices_.apply(sample(LevelIndex::high, 0));
  lattices_.apply(sample(LevelIndex::low, 10 * kMs));
  EXPECT_EQ(lattices_.layers().size(), 3u);
  lattices_.apply(sample(LevelIndex::low, 20 * kMs), true);
  EXPECT_EQ(lattices_.layers().size(), 1u);
  lattices_.apply(sample(LevelIndex::high, 30 * kMs), true);
  EXPECT_EQ(lattices_.layers().size(), 1u);
}

TEST_F(LatticeBlendTest, rigid_hair_has_no_layers_and_what_was_never_valid_shows_nothing) {
  lattices_.apply({});
  EXPECT_TRUE(lattices_.layers().empty());
  lattices_.apply(sample(LevelIndex::rigid, 0));
  EXPECT_TRUE(lattices_.layers().empty());
}

}  // namespace
}  // namespace hairnet::link
