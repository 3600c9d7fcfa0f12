#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <algorithm>
#include <limits>

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

// Every `step`-th rooted strand of a groom, alone.
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

// Means, over the strands of `hair`, the distance between the ends of the strand and of the one in `groom` that begins
// nearest to it.
double tip_distance_m(const Groom& hair, const Groom& groom) {
  double sum = 0;
  for (std::size_t s = 0; s < hair.strand_count(); ++s) {
    const std::span<const Vec3f> strand = hair.strand_points(s);
    float best = std::numeric_limits<float>::infinity(), apart = 0;
    for (std::size_t t = 0; t < groom.strand_count(); ++t) {
      const std::span<const Vec3f> other = groom.strand_points(t);
      const float distance = (other.front() - strand.front()).norm();
      if (distance >= best) continue;
      best = distance;
      apart = (other.back() - strand.back()).norm();
    }
    sum += static_cast<double>(apart);
  }
  return sum / static_cast<double>(hair.strand_count());
}

TEST(FillStrands, covers_the_skin_between_guides_with_hair_as_theirs) {
  const Groom whole = made("bob", 3000), guides = guides_of(whole, 15);
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
  // The hairstyle that the guides were taken from has hair where the filled one has, of the same course.
  const double by_filled = tip_distance_m(whole, filled), by_guides = tip_distance_m(whole, guides);
  EXPECT_LT(by_filled, 0.75 * by_guides) << by_filled << " m, with guides alone " << by_guides;
}

TEST(FillStrands, does_not_mix_the_two_sides_of_a_parting) {
  Groom groom = guides_of(made("bob", 300), 1000);
  groom.points.clear();
  groom.strand_begin = {0};
  groom.strands.clear();
  const MeshQuery skin(groom.body.mesh);
  for (int row = 0; row < 6; ++row) {
    for (const float side : {-1.f, 1.f}) {
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
    EXPECT_GT(std::abs(strand.back().x() - strand.front().x()), 0.05f) << "strand " << s << " leads to a side";
  }
}

TEST(FillStrands, gives_the_same_bits_again) {
  Groom first = guides_of(made("short", 400), 4), second = first;
  ASSERT_TRUE(fill_strands(1000, first));
  ASSERT_TRUE(fill_strands(1000, second));
  EXPECT_EQ(first.points, second.points);
}

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
