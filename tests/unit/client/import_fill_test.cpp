#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <array>
#include <cmath>

#include "client/assets/import/fill_strands.hpp"
#include "client/assets/made/made.hpp"
#include "core/geometry/mesh_query.hpp"

namespace hairnet {
namespace {

using ::testing::HasSubstr;

Groom made(const char* style, std::size_t strand_count) {
  HairstyleOptions options;
  options.strand_count = strand_count;
  return *make_hairstyle(style, options);
}

// Returns a groom of every `step`-th strand that is rooted.
Groom guides_of(const Groom& groom, std::size_t step) {
  Groom guides;
  guides.name = groom.name;
  guides.group_names = groom.group_names;
  guides.materials = groom.materials;
  guides.body = groom.body;
  for (std::size_t s = 0; s < groom.strand_count(); s += step) {
    if (groom.strands[s].rooted) guides.add_strand(groom.strand_points(s), groom.strands[s]);
  }
  return guides;
}

double hairs_of(const Groom& groom) {
  double sum = 0;
  for (const StrandProperties& strand : groom.strands) sum += static_cast<double>(strand.hair_count);
  return sum;
}

float length_of(std::span<const Vec3f> strand) {
  float length = 0;
  for (std::size_t i = 1; i < strand.size(); ++i) length += (strand[i] - strand[i - 1]).norm();
  return length;
}

// Returns the strand that a rule gives a root: it leans outwards, turns about the head and is longer at the back.
// Filled strands can be compared with the same rule.
std::array<Vec3f, 3> strand_at(const Vec3f& root) {
  const Vec3f out = (root - Vec3f(0, 0.06f, 0)).normalized();
  const Vec3f way = (out + 0.5f * Vec3f::UnitY().cross(out) - 0.8f * Vec3f::UnitY()).normalized();
  const float length = 0.2f - 0.6f * root.z();
  return {root, root + 0.4f * length * way, root + length * way};
}

Groom three_points_each(const Groom& groom) {
  Groom out = guides_of(groom, groom.strand_count());
  out.points.clear();
  out.strand_begin = {0};
  out.strands.clear();
  for (std::size_t s = 0; s < groom.strand_count(); ++s)
    out.add_strand(strand_at(groom.strand_points(s).front()), groom.strands[s]);
  return out;
}

TEST(FillStrands, covers_the_skin_between_guides_with_hair_as_theirs) {
  // There are about 200 guides. The other strands are filled in between them.
  const Groom guides = three_points_each(guides_of(made("bob", 3000), 15));
  Groom filled = guides;
  const Result<void> done = fill_strands(3000, filled);
  ASSERT_TRUE(done) << done.error();
  EXPECT_EQ(filled.strand_count(), 3000U);
  EXPECT_EQ(validate(filled), "");
  EXPECT_NEAR(hairs_of(filled), hairs_of(guides), 1e-3 * hairs_of(guides));

  const MeshQuery skin(filled.body.mesh);
  float longest = 0;
  for (std::size_t s = 0; s < guides.strand_count(); ++s)
    longest = std::max(longest, length_of(guides.strand_points(s)));
  for (std::size_t s = guides.strand_count(); s < filled.strand_count(); ++s) {
    EXPECT_LT(skin.closest(filled.strand_points(s).front().cast<double>()).distance, 1e-4);
    EXPECT_LE(length_of(filled.strand_points(s)), 1.01f * longest);
    EXPECT_GT(length_of(filled.strand_points(s)), 0.01f);
  }
  // The filled strands follow the rule of the guides far better than the nearest guide's shape does.
  double error = 0, error_of_nearest = 0;
  for (std::size_t s = guides.strand_count(); s < filled.strand_count(); ++s) {
    const std::span<const Vec3f> strand = filled.strand_points(s);
    const Vec3f root = strand.front(), tip = strand_at(root).back();
    std::size_t nearest = 0;
    for (std::size_t g = 0; g < guides.strand_count(); ++g) {
      if ((guides.points[3 * g] - root).norm() < (guides.points[3 * nearest] - root).norm()) nearest = g;
    }
    error += static_cast<double>((strand.back() - tip).norm());
    error_of_nearest +=
        static_cast<double>((root + guides.points[3 * nearest + 2] - guides.points[3 * nearest] - tip).norm());
  }
  EXPECT_LT(error, 0.5 * error_of_nearest);
}

TEST(FillStrands, does_not_mix_the_two_sides_of_a_parting) {
  Groom groom = guides_of(made("bob", 300), 1000);
  groom.points.clear();
  groom.strand_begin = {0};
  groom.strands.clear();
  const MeshQuery skin(groom.body.mesh);
  for (int row = 0; row < 6; ++row) {
    for (const float side : {-1.f, 1.f}) {
      // Roots lie 1.5 cm on both sides of the middle, in six rows, and the hair of each side leads straight away
      // from the parting.
      const Vec3 above(0.015 * static_cast<double>(side), 0.25, 0.02 * row - 0.05);
      const Vec3f root = skin.closest(above).point.cast<float>();
      groom.add_strand(std::array<Vec3f, 3>{root, root + Vec3f(0.05f * side, 0, 0), root + Vec3f(0.1f * side, 0, 0)},
                       {});
    }
  }
  groom.group_names = {"hair"};
  ASSERT_TRUE(fill_strands(500, groom));
  for (std::size_t s = 0; s < groom.strand_count(); ++s) {
    const std::span<const Vec3f> strand = groom.strand_points(s);
    // A mixture of both sides would go nowhere: its ends would lie above each other.
    EXPECT_GT(std::abs(strand.back().x() - strand.front().x()), 0.05f) << "strand " << s << " leads to a side";
  }
}

TEST(FillStrands, gives_the_same_bits_again) {
  Groom first = guides_of(made("short", 400), 4), second = first;
  ASSERT_TRUE(fill_strands(1000, first));
  ASSERT_TRUE(fill_strands(1000, second));
  EXPECT_EQ(first.points, second.points);
}

// Each refusal must leave the groom as it was, since the caller may go on without filling.
TEST(FillStrands, says_why_not) {
  const auto refusal = [](std::size_t count, Groom groom) {
    const Groom before = groom;
    const Result<void> filled = fill_strands(count, groom);
    EXPECT_EQ(groom.points, before.points) << "a refused groom is as it was";
    return filled ? std::string() : filled.error();
  };
  const Groom guides = guides_of(made("short", 400), 4);
  EXPECT_THAT(refusal(50, guides), HasSubstr("strands already"));
  Groom two = guides_of(guides, guides.strand_count() - 1);
  ASSERT_EQ(two.strand_count(), 2U);
  EXPECT_THAT(refusal(50, two), HasSubstr("2 strands begin on the skin"));
  Groom bald = guides;
  bald.body.mesh = {};
  EXPECT_THAT(refusal(500, bald), HasSubstr("no skin"));
  Groom long_strands = guides;
  EXPECT_THAT(refusal(100'000'000, long_strands), HasSubstr("points of a groom"));
}

}  // namespace
}  // namespace hairnet
