#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <cstring>
#include <limits>
#include <set>

#include "client/assets/made/bust_shape.hpp"
#include "client/assets/made/made.hpp"
#include "tests/support/case_name.hpp"

namespace hairnet {
namespace {

// So few strands are enough, since a style does not depend on their number.
constexpr std::size_t kFew = 600;

double arc_length_m(std::span<const Vec3f> strand) {
  double length = 0;
  for (std::size_t i = 1; i < strand.size(); ++i) length += (strand[i] - strand[i - 1]).norm();
  return length;
}

// A strand, or the line along the middle of a card.
struct Line {
  std::vector<Vec3f> points;
  StrandProperties properties;
};
std::vector<Line> lines_of(const Groom& groom) {
  std::vector<Line> lines;
  for (std::size_t s = 0; s < groom.strand_count(); ++s) {
    const auto points = groom.strand_points(s);
    lines.push_back({{points.begin(), points.end()}, groom.strands[s]});
  }
  for (const HairCard& card : groom.cards) {
    lines.push_back({{}, card.properties});
    middle_of(groom, card, lines.back().points);
  }
  return lines;
}

double mean_length_m(const Groom& groom) {
  double sum = 0;
  const std::vector<Line> lines = lines_of(groom);
  for (const Line& line : lines) sum += arc_length_m(line.points);
  return sum / static_cast<double>(lines.size());
}

bool same_bits(const Groom& a, const Groom& b) {
  return a.points.size() == b.points.size() && a.strand_begin == b.strand_begin &&
         std::memcmp(a.points.data(), b.points.data(), a.points.size() * sizeof(Vec3f)) == 0;
}

class MadeHairstyle : public testing::TestWithParam<std::string_view> {
 protected:
  static Groom make(HairstyleOptions options = {}) {
    if (options.strand_count == 0) options.strand_count = kFew;
    return make_hairstyle(GetParam(), options).value();
  }
};

TEST_P(MadeHairstyle, is_a_valid_groom) {
  const Groom groom = make();
  EXPECT_EQ(validate(groom), "");
  EXPECT_EQ(groom.name, GetParam());
  EXPECT_EQ(lines_of(groom).size(), kFew);
}

TEST_P(MadeHairstyle, never_enters_the_skin) {
  for (const double curl : {0.0, 1.0}) {
    for (const Vec3f& p : make({.curl = curl}).points) {
      // A point may lie up to 2 mm inside the surface of the bust.
      ASSERT_GT(made::bust_distance(p.cast<double>()), -0.002) << p.transpose();
    }
  }
}

// Hair that is tied, such as the tail of a ponytail, begins at its band, away from the skin. It must not be attached
// to the skull.
TEST_P(MadeHairstyle, is_rooted_on_the_skin_but_for_what_is_tied) {
  const Groom groom = make();
  for (const auto& [points, strand] : lines_of(groom)) {
    ASSERT_EQ(strand.rooted, groom.group_names[strand.group] != "tail");
    const double off_m = std::abs(made::bust_distance(points[0].cast<double>()));
    if (strand.rooted) {
      ASSERT_LT(off_m, groom.cards.empty() ? 0.002 : 0.004) << "between the edges of a wide card";
      ASSERT_GT(strand.root_length_m, 0);
    } else {
      ASSERT_GT(off_m, 0.01);
      ASSERT_EQ(strand.root_length_m, 0);
    }
  }
}

TEST_P(MadeHairstyle, leaves_eyes_and_mouth_free) {
  for (const Vec3f& p : make({.strand_count = 3000}).points) {
    // The box covers eyes and mouth, in front of the face.
    ASSERT_FALSE(std::abs(p.x()) < 0.035f && p.y() > -0.05f && p.y() < 0.045f && p.z() > 0.05f) << p.transpose();
  }
}

TEST_P(MadeHairstyle, stands_for_the_hairs_of_a_head) {
  const Groom groom = make();
  double hairs = 0;
  for (const Line& line : lines_of(groom)) hairs += static_cast<double>(line.properties.hair_count);
  // A head has about 100 000 hairs, which strands share, so that a style weighs the same with any number of strands.
  EXPECT_NEAR(hairs, 100'000, 1000);
}

TEST_P(MadeHairstyle, same_options_give_the_same_bits) {
  EXPECT_TRUE(same_bits(make({.seed = 4}), make({.seed = 4})));
  EXPECT_FALSE(same_bits(make({.seed = 4}), make({.seed = 5})));
}

TEST_P(MadeHairstyle, is_as_long_as_asked_for) {
  const double shorter = mean_length_m(make({.length_m = 0.15})), longer = mean_length_m(make({.length_m = 0.45}));
  // The lengths asked for are those of the longest strands, so the mean grows by less than their factor of 3.
  EXPECT_GT(longer, 1.2 * shorter);
}

TEST_P(MadeHairstyle, curls_as_asked_for) {
  // Curls bend strands: the chord falls behind the arc.
  const auto straightness = [](const Groom& groom) {
    double arc = 0, chord = 0;
    for (const Line& line : lines_of(groom)) {
      arc += arc_length_m(line.points);
      chord += (line.points.back() - line.points.front()).norm();
    }
    return chord / arc;
  };
  // Plaited hair cannot curl far.
  const double shorter = GetParam() == "plait" ? 0.01 : 0.05;
  EXPECT_LT(straightness(make({.length_m = 0.4, .curl = 0.8})),
            straightness(make({.length_m = 0.4, .curl = 0})) - shorter);
}

TEST_P(MadeHairstyle, can_be_made_at_the_ends_of_every_range) {
  for (const double length_m : {0.01, 1.2}) {
    for (const double curl : {0.0, 1.0}) {
      const Groom groom = make({.length_m = length_m, .curl = curl, .strand_count = 10});
      EXPECT_EQ(validate(groom), "");
      EXPECT_EQ(lines_of(groom).size(), 10u);
      for (const Vec3f& p : groom.points) ASSERT_GT(made::bust_distance(p.cast<double>()), -0.002);
    }
  }
}

std::vector<std::string_view> all_names() {
  std::vector<std::string_view> names;
  for (const MadeName& name : hairstyle_names()) names.push_back(name.name);
  return names;
}
INSTANTIATE_TEST_SUITE_P(AllHairstyles, MadeHairstyle, testing::ValuesIn(all_names()), support::CaseName());

TEST(MadeHairstyles, contain_the_five_promised_styles) {
  const auto names = all_names();
  for (const std::string_view name : {"long_straight", "long_curly", "bob", "ponytail", "short"}) {
    EXPECT_NE(std::find(names.begin(), names.end(), name), names.end()) << name;
  }
}

TEST(MadeHairstyles, refuse_what_they_cannot_make) {
  constexpr double kNan = std::numeric_limits<double>::quiet_NaN();
  EXPECT_FALSE(make_hairstyle("mohawk"));
  EXPECT_NE(make_hairstyle("mohawk").error().find("ponytail"), std::string::npos) << "names what there is";
  // A length is 0.01 to 1.2 m, a curl at most 1, and a style has 10 to 100 000 strands (hairstyles.cpp).
  for (const HairstyleOptions& options :
       {HairstyleOptions{.length_m = 0.005}, HairstyleOptions{.length_m = 1.3}, HairstyleOptions{.length_m = -1},
        HairstyleOptions{.length_m = kNan}, HairstyleOptions{.curl = 1.1}, HairstyleOptions{.curl = kNan},
        HairstyleOptions{.strand_count = 9}, HairstyleOptions{.strand_count = 100'001}}) {
    const Result<Groom> groom = make_hairstyle("bob", options);
    ASSERT_FALSE(groom);
    EXPECT_EQ(groom.error().find('\n'), std::string::npos);
  }
}

// Hair from the scalp ends at the band, and the tail begins there.
TEST(MadeHairstyles, pull_all_of_a_ponytail_to_one_band) {
  const Groom groom = make_hairstyle("ponytail", {.strand_count = kFew}).value();
  Vec3f band = Vec3f::Zero();
  int tails = 0;
  const auto in_group = [&](std::size_t s, std::string_view name) {
    return groom.group_names[groom.strands[s].group] == name;
  };
  for (std::size_t s = 0; s < groom.strand_count(); ++s) {
    if (in_group(s, "tail")) band += groom.strand_points(s)[0], ++tails;
  }
  ASSERT_GT(tails, 100);
  band /= static_cast<float>(tails);
  EXPECT_LT(band.z(), -0.08f) << "behind the crown";
  for (std::size_t s = 0; s < groom.strand_count(); ++s) {
    const auto strand = groom.strand_points(s);
    if (in_group(s, "tail")) {
      EXPECT_LT((strand.front() - band).norm(), 0.02f);
    }
    if (in_group(s, "pulled")) {
      EXPECT_LT((strand.back() - band).norm(), 0.02f);
    }
  }
}

TEST(MadeHairstyles, show_every_feature) {
  const auto made = [](std::string_view name) { return make_hairstyle(name, {.strand_count = kFew}).value(); };
  EXPECT_GT(made("plait").knots.size(), 5u);
  EXPECT_EQ(made("plait").threads.size(), 1u);
  EXPECT_EQ(made("ponytail").knots.size(), 2u);
  EXPECT_GT(made("ponytail").cloths.size(), 1u);
  EXPECT_EQ(made("veiled").cloths.size(), 1u);
  EXPECT_EQ(made("strips").cards.size(), kFew);
  EXPECT_EQ(made("locks").clumps.size(), kFew);
  const Groom gelled = made("side_part");
  ASSERT_EQ(gelled.root_blends.size(), gelled.group_names.size());
  EXPECT_TRUE(std::ranges::any_of(gelled.root_blends, [](const RootBlend& blend) { return !blend.points.empty(); }));
}

TEST(MadeHairstyles, cut_a_bob_at_one_height) {
  const Groom groom = make_hairstyle("bob", {.strand_count = kFew}).value();
  std::vector<float> tips;
  for (std::size_t s = 0; s < groom.strand_count(); ++s) {
    if (groom.group_names[groom.strands[s].group] != "fringe") tips.push_back(groom.strand_points(s).back().y());
  }
  std::sort(tips.begin(), tips.end());
  // Four of five tips lie within 3 cm of height.
  EXPECT_LT(tips[tips.size() * 9 / 10] - tips[tips.size() / 10], 0.03f);
}

}  // namespace
}  // namespace hairnet
