#include "core/hair_cards/far_cards.hpp"

#include <gtest/gtest.h>

#include <algorithm>
#include <cstring>
#include <numeric>
#include <random>
#include <set>

#include "core/ffd/deform.hpp"
#include "core/hair_cards/centreline_clusters.hpp"
#include "core/levels/build.hpp"
#include "tests/support/build_grooms.hpp"
#include "tests/support/equal_levels.hpp"

namespace hairnet {
namespace {

double length_of(std::span<const Vec3f> line) {
  double length = 0;
  for (std::size_t i = 1; i < line.size(); ++i) length += static_cast<double>((line[i] - line[i - 1]).norm());
  return length;
}

std::vector<double> lengths_of(const FarCards& far) {
  std::vector<double> lengths;
  std::vector<Vec3f> middle;
  for (const FarCard& card : far.cards) {
    middle_of(far, card, middle);
    lengths.push_back(length_of(middle));
  }
  return lengths;
}

std::size_t strands_of(const FarCards& far) {
  return std::accumulate(far.cards.begin(), far.cards.end(), std::size_t{0},
                         [](std::size_t sum, const FarCard& card) { return sum + card.strand_count; });
}

std::string fault_with(Groom groom, FarCards far) {
  groom.far_cards = std::move(far);
  return validate(groom);
}

// Hangs straight down from y = 0.1, 20 cm wide, in the plane z = 0.1.
constexpr float kSheetWidth = 0.2f, kSheetLength = 0.3f, kSheetZ = 0.1f;
Groom make_sheet(std::size_t strand_count = 2000) {
  Groom groom;
  std::mt19937 random(3);
  std::uniform_real_distribution<float> x(-kSheetWidth / 2, kSheetWidth / 2);
  for (std::size_t s = 0; s < strand_count; ++s)
    support::add(groom, support::straight({x(random), 0.1f, kSheetZ}, {0, -1, 0}, kSheetLength, 10));
  return groom;
}

TEST(CentrelineClusters, contain_every_centreline_once) {
  const Groom groom = support::make_head_of_hair(500);
  const std::vector<Centreline> centrelines = make_centrelines(groom);
  ASSERT_EQ(centrelines.size(), 500u);
  std::vector<std::uint32_t> members;
  for (std::uint32_t c = 0; c < centrelines.size(); c += 2) members.push_back(c);
  for (const std::size_t count : {1u, 7u, 60u, 250u, 1000u}) {
    std::multiset<std::uint32_t> found;
    const auto clusters = cluster_centrelines(centrelines, members, count);
    EXPECT_LE(clusters.size(), count);
    for (const auto& cluster : clusters) {
      EXPECT_FALSE(cluster.empty());
      found.insert(cluster.begin(), cluster.end());
    }
    EXPECT_EQ(std::vector(found.begin(), found.end()), members);
  }
}

TEST(CentrelineClusters, keep_apart_what_lies_apart) {
  Groom groom;
  for (int s = 0; s < 60; ++s) {
    const float place = 0.2f * static_cast<float>(s % 3), jitter = 1e-4f * static_cast<float>(s);
    support::add(groom, support::straight({place + jitter, 0, 0}, {0, -1, 0}, 0.2f, 4));
  }
  const std::vector<Centreline> centrelines = make_centrelines(groom);
  std::vector<std::uint32_t> members(centrelines.size());
  std::iota(members.begin(), members.end(), 0u);
  const auto clusters = cluster_centrelines(centrelines, members, 3);
  ASSERT_EQ(clusters.size(), 3u);
  for (const auto& cluster : clusters) {
    EXPECT_EQ(cluster.size(), 20u);
    for (const std::uint32_t c : cluster) EXPECT_EQ(c % 3, cluster[0] % 3);
  }
}

TEST(FarCards, replace_every_strand_with_a_length_and_every_card_once) {
  const Groom odd = support::make_odd_groom();
  EXPECT_EQ(strands_of(make_far_cards(odd, 30)), make_centrelines(odd).size());
  EXPECT_EQ(fault_with(odd, make_far_cards(odd, 30)), "");
  Groom groom = support::make_head_of_hair(300);
  for (int i = 0; i < 10; ++i) {
    const float x = 0.01f * static_cast<float>(i);
    groom.add_card(std::vector<Vec3f>{{x, 0.1f, 0}, {x + 0.01f, 0.1f, 0}, {x, 0, 0}, {x + 0.01f, 0, 0}}, {});
  }
  EXPECT_EQ(strands_of(make_far_cards(groom, 40)), 310u);
}

TEST(FarCards, are_of_one_group_each_and_rooted_or_not) {
  // Groups and kinds each at a place of their own, their strands taking turns.
  Groom groom;
  for (int s = 0; s < 600; ++s) {
    const auto kind = static_cast<std::uint16_t>(s % 4);
    const Vec3f root(0.3f * static_cast<float>(kind) + 0.0001f * static_cast<float>(s), 0.1f, 0);
    support::add(groom, support::straight(root, {0, -1, 0}, 0.2f, 5),
                 {.root_length_m = 0.01f * static_cast<float>(kind + 1),
                  .group = static_cast<std::uint16_t>(kind / 2),
                  .rooted = kind % 2 == 0});
  }
  for (const std::size_t count : {1u, 4u, 50u}) {
    const FarCards far = make_far_cards(groom, count);
    EXPECT_GE(far.cards.size(), 4u) << "none of the kinds goes without";
    EXPECT_LE(far.cards.size(), std::max<std::size_t>(count, 4));
    for (const FarCard& card : far.cards) {
      const int kind = 2 * card.group + (card.rooted ? 0 : 1);
      for (std::uint32_t p = card.points.begin; p < card.points.end; ++p)
        EXPECT_NEAR(far.points[p].x(), 0.3f * static_cast<float>(kind) + 0.03f, 0.08f);
      EXPECT_NEAR(card.root_length_m, 0.01f * static_cast<float>(kind + 1), 1e-6f);
    }
  }
}

TEST(FarCards, of_a_flat_sheet_lie_in_it_and_are_as_wide_in_all) {
  const FarCards far = make_far_cards(make_sheet(), 12);
  ASSERT_EQ(far.cards.size(), 12u);
  std::vector<std::array<float, 2>> spans;
  double widths = 0;
  for (const FarCard& card : far.cards) {
    float low = 1, high = -1;
    for (std::uint32_t p = card.points.begin; p < card.points.end; ++p) {
      EXPECT_NEAR(far.points[p].z(), kSheetZ, 1e-4f);
      low = std::min(low, far.points[p].x());
      high = std::max(high, far.points[p].x());
    }
    spans.push_back({low, high});
    widths += static_cast<double>(high - low);
  }
  EXPECT_NEAR(widths, static_cast<double>(kSheetWidth), 0.25 * static_cast<double>(kSheetWidth));
  std::ranges::sort(spans);
  EXPECT_NEAR(spans.front()[0], -kSheetWidth / 2, 0.005f);
  EXPECT_NEAR(spans.back()[1], kSheetWidth / 2, 0.005f);
  for (std::size_t i = 1; i < spans.size(); ++i) EXPECT_LT(spans[i][0], spans[i - 1][1]) << "a gap between cards";
}

TEST(FarCards, are_as_long_as_the_strands_they_stand_for) {
  for (const double length : lengths_of(make_far_cards(make_sheet(), 12)))
    EXPECT_NEAR(length, static_cast<double>(kSheetLength), 1e-3);
  const Groom head = support::make_head_of_hair(2000);
  const double strand = length_of(head.strand_points(0));
  for (const double length : lengths_of(make_far_cards(head, 150))) EXPECT_NEAR(length, strand, 0.2 * strand);
}

TEST(FarCards, do_not_shrink_where_their_strands_part) {
  Groom groom;
  for (int s = -20; s <= 20; ++s)
    support::add(groom, support::straight({0, 0.1f, 0.1f}, {0.04f * static_cast<float>(s), -1, 0}, 0.3f, 10));
  const std::vector<double> lengths = lengths_of(make_far_cards(groom, 1));
  ASSERT_EQ(lengths.size(), 1u);
  EXPECT_GT(lengths[0], 0.29);
  EXPECT_LT(lengths[0], 0.34);
}

TEST(FarCards, of_curls_are_as_long_as_the_curls_hang_and_as_wide_as_they_turn) {
  Groom groom = support::make_head_of_hair(100);
  constexpr std::uint16_t kCurls = 2;
  for (int s = 0; s < 100; ++s) {
    const Vec3f root(0.0005f * static_cast<float>(s % 10), 0.1f, 0.1f + 0.0005f * static_cast<float>(s / 10));
    support::add(groom, support::curl(root, 0.012f, 0.2f, 10, 200), {.group = kCurls});
  }
  const FarCards far = make_far_cards(groom, 20);
  const std::vector<double> lengths = lengths_of(far);
  std::size_t count = 0;
  for (std::size_t i = 0; i < far.cards.size(); ++i) {
    const FarCard& card = far.cards[i];
    if (card.group != kCurls) continue;
    ++count;
    EXPECT_NEAR(lengths[i], 0.22, 0.03) << "the curls hang 0.2 m and are 0.78 m long";
    for (std::uint32_t p = card.points.begin + 4; p + 4 < card.points.end; p += 2)
      EXPECT_NEAR((far.points[p + 1] - far.points[p]).norm(), 0.03f, 0.012f) << "turns of 0.024 m";
  }
  EXPECT_GT(count, 2u);
}

TEST(FarCards, are_as_many_as_asked_for_where_there_is_hair_enough) {
  const Groom groom = support::make_head_of_hair(1000);
  EXPECT_TRUE(make_far_cards(groom, 0).cards.empty());
  for (const std::size_t count : {2u, 10u, 100u, 300u}) {
    const std::size_t got = make_far_cards(groom, count).cards.size();
    EXPECT_LE(got, count);
    EXPECT_GE(got, count * 9 / 10);
  }
  EXPECT_LE(make_far_cards(support::make_head_of_hair(5), 4096).cards.size(), 5u);
  EXPECT_TRUE(make_far_cards({}, 400).cards.empty());
  EXPECT_EQ(far_card_count_for({}), 0u);
  EXPECT_EQ(far_card_count_for(support::make_head_of_hair(6)), 6u);
  EXPECT_EQ(far_card_count_for(make_sheet(5000)), 400u);
}

TEST(FarCards, never_outnumber_what_a_groom_may_have_or_leave_its_bounds) {
  Groom groom;
  std::mt19937 random(5);
  std::uniform_real_distribution<float> place(-9.99f, 9.99f);
  for (int s = 0; s < 5000; ++s) {
    const Vec3f root(place(random), place(random), place(random)), tip(place(random), place(random), place(random));
    support::add(groom, {root, 0.5f * (root + tip), tip},
                 {.group = static_cast<std::uint16_t>(s < 4000 ? 0 : s % 256)});
  }
  ASSERT_EQ(validate(groom), "");
  EXPECT_EQ(fault_with(groom, make_far_cards(groom, 4096)), "");
}

TEST(FarCardsDeathTest, asserts_that_no_more_are_wanted_than_a_groom_may_have) {
  EXPECT_DEATH(make_far_cards(make_sheet(10), 4097), "far_card_count_max");
}

TEST(FarCards, of_identical_strands_are_valid) {
  Groom groom;
  for (int s = 0; s < 50; ++s) support::add(groom, support::straight({0.013f, 0.1f, 0.07f}, {0.3f, -1, 0.2f}, 0.3f, 7));
  const FarCards far = make_far_cards(groom, 10);
  EXPECT_EQ(strands_of(far), 50u);
  EXPECT_EQ(fault_with(groom, far), "");
}

TEST(FarCards, are_the_same_bits_again) {
  const Groom groom = support::make_head_of_hair(1500);
  const FarCards a = make_far_cards(groom, 200), b = make_far_cards(groom, 200);
  ASSERT_EQ(a.points.size(), b.points.size());
  EXPECT_EQ(std::memcmp(a.points.data(), b.points.data(), a.points.size() * sizeof(Vec3f)), 0);
}

TEST(FarCards, leave_levels_as_they_are) {
  Groom groom = support::make_head_of_hair(200);
  groom.body.mesh.vertices = {{0, 0, 0}, {0.1f, 0, 0}, {0, 0.1f, 0}};
  groom.body.mesh.triangles = {{0, 1, 2}};
  groom.body.bone_weights.assign(3, {1, 0, 0, 0, 0});
  const auto without = build_levels(groom, {});
  groom.far_cards = make_far_cards(groom, 30);
  ASSERT_EQ(validate(groom), "");
  const auto with = build_levels(groom, {});
  for (std::size_t i = 0; i < without->levels.size(); ++i) support::expect_equal(without->levels[i], with->levels[i]);
}

TEST(FarCards, look_away_from_the_head_and_run_from_root_to_tip) {
  Groom groom = support::make_head_of_hair(2000);
  groom.far_cards = make_far_cards(groom, 150);
  const FarCards& far = groom.far_cards;
  const std::vector<float> blend = far_card_blend(groom);
  const RestTangents rest = far_card_tangents(far, blend);
  const std::vector<Vec3f> normals = far_card_normals(far, rest);
  std::size_t away = 0, count = 0;
  for (const FarCard& card : far.cards) {
    for (std::uint32_t p = card.points.begin; p < card.points.end; ++p) {
      EXPECT_NEAR(normals[p].norm(), 1, 1e-4f);
      EXPECT_NEAR(rest.direction[p].norm(), 1, 1e-4f);
      const Vec3f out = far.points[p] - Vec3f(0, std::min(far.points[p].y(), 0.0f), 0);
      if (std::abs(rest.direction[p].dot(out)) > 0.7f * out.norm()) continue;  // runs towards it or away itself
      away += normals[p].dot(out) > 0;
      ++count;
    }
    const Vec3f course = far.points[card.points.end - 2] - far.points[card.points.begin];
    EXPECT_GT(course.dot(rest.direction[card.points.begin + card.points.count() / 2]), 0);
  }
  EXPECT_GT(count, far.points.size() / 2);
  EXPECT_GT(away, count * 98 / 100);
}

TEST(FarCardBlend, rises_along_the_middle_from_the_root_and_is_1_without_one) {
  Groom groom = support::make_head_of_hair(400);
  for (StrandProperties& strand : groom.strands) strand.rooted = strand.group == 0;
  groom.far_cards = make_far_cards(groom, 40);
  const std::vector<float> blend = far_card_blend(groom);
  ASSERT_EQ(blend.size(), groom.far_cards.points.size());
  const RestTangents rest = far_card_tangents(groom.far_cards, blend);
  for (const FarCard& card : groom.far_cards.cards) {
    const auto [begin, end] = card.points;
    EXPECT_EQ(blend[begin], card.rooted ? 0 : 1);
    EXPECT_GT(blend[end - 1], 0.99f);
    for (std::uint32_t p = begin; p < end; p += 2) {
      EXPECT_EQ(blend[p], blend[p + 1]);
      EXPECT_GE(blend[p], p > begin ? blend[p - 2] : 0);
      if (!card.rooted) {
        EXPECT_EQ(rest.blend_slope[p], 0);
      } else if (blend[p] < 0.9f) {
        EXPECT_GT(rest.blend_slope[p], 1);
      }
    }
  }
}

TEST(FarCards, take_their_root_length_from_a_material_set_later) {
  Groom groom = support::make_head_of_hair(100);
  groom.far_cards = make_far_cards(groom, 20);
  Material material;
  material.root_length_m = 0.07f;
  set_group_material(1, material, groom);
  for (const FarCard& card : groom.far_cards.cards)
    EXPECT_NEAR(card.root_length_m, card.group == 1 ? 0.07f : 0.02f, 1e-6f);
  set_material(material, groom);
  for (const FarCard& card : groom.far_cards.cards) EXPECT_EQ(card.root_length_m, 0.07f);
}

TEST(FarCards, are_refused_in_one_line_when_they_are_invalid) {
  Groom groom = support::make_head_of_hair(50);
  const FarCards sound = make_far_cards(groom, 10);
  ASSERT_EQ(fault_with(groom, sound), "");
  const auto fault = [&](auto spoil) {
    FarCards far = sound;
    spoil(far);
    const std::string reason = fault_with(groom, far);
    EXPECT_EQ(reason.find('\n'), std::string::npos);
    return reason;
  };
  EXPECT_NE(fault([](FarCards& f) { f.cards[1].points.begin += 2; }), "");
  EXPECT_NE(fault([](FarCards& f) { f.cards[1].points.end = ~0u; }), "");
  EXPECT_NE(fault([](FarCards& f) { f.cards.back().points.end -= 1; }), "") << "one without its partner";
  EXPECT_NE(fault([](FarCards& f) { f.cards.back().points.end -= 2; }), "") << "points of nobody's";
  EXPECT_NE(fault([](FarCards& f) { f.cards.back().points.end = f.cards.back().points.begin + 2; }), "");
  EXPECT_NE(fault([](FarCards& f) { f.cards.clear(); }), "");
  EXPECT_NE(fault([](FarCards& f) { f.cards[0].group = 2; }), "");
  EXPECT_NE(fault([](FarCards& f) { f.cards[0].strand_count = 0; }), "");
  EXPECT_NE(fault([](FarCards& f) { f.cards[0].strand_count = 51; }), "");
  EXPECT_NE(fault([](FarCards& f) { f.cards[0].root_length_m = std::nanf(""); }), "");
  EXPECT_NE(fault([](FarCards& f) { f.points[3].y() = std::nanf(""); }), "");
  EXPECT_NE(fault([](FarCards& f) { f.points[3].y() = 11; }), "");
  EXPECT_NE(fault([](FarCards& f) { f.add(std::vector<Vec3f>(130, Vec3f::Zero()), {}); }), "") << "65 pairs";
  EXPECT_EQ(fault([](FarCards& f) { f.add(std::vector<Vec3f>(128, Vec3f::Zero()), {}); }), "");
  EXPECT_NE(fault([](FarCards& f) {
              for (int i = 0; i < 4090; ++i) f.add(std::vector<Vec3f>(4, Vec3f::Zero()), {});
            }),
            "");
}

}  // namespace
}  // namespace hairnet
