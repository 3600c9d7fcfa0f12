#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <set>

#include "client/assets/made/made.hpp"
#include "core/geometry/mesh_query.hpp"
#include "core/hair_cards/far_cards.hpp"
#include "tests/support/case_name.hpp"
#include "tests/support/real_hair.hpp"

// Whole hairstyles: what far cards cover of them, and that they stay off the skin.
namespace hairnet {
namespace {

enum class View { front, side, top };

// The area that is covered, in squares.
class Shadow {
 public:
  static constexpr float kSquare = 0.005f;  // m

  explicit Shadow(View view) : view_(view) {}
  void add(const Vec3f& x) { squares_.insert(square_of(x)); }
  void add_line(const Vec3f& a, const Vec3f& b) {
    const int count = steps_between(a, b);
    for (int i = 0; i <= count; ++i) add(a + static_cast<float>(i) / static_cast<float>(count) * (b - a));
  }
  // The ruled surface between two edges.
  void add_quad(const Vec3f& left, const Vec3f& right, const Vec3f& next_left, const Vec3f& next_right) {
    const int count = std::max(steps_between(left, next_left), steps_between(right, next_right));
    for (int i = 0; i <= count; ++i) {
      const float t = static_cast<float>(i) / static_cast<float>(count);
      add_line(left + t * (next_left - left), right + t * (next_right - right));
    }
  }
  // The share of its squares that `other` covers, or, with `margin`, that are at most that many squares away.
  [[nodiscard]] double share_within(const Shadow& other, int margin) const {
    std::size_t within = 0;
    for (const auto& [u, v] : squares_) {
      bool found = false;
      for (int du = -margin; du <= margin && !found; ++du) {
        for (int dv = -margin; dv <= margin && !found; ++dv) found = other.squares_.contains({u + du, v + dv});
      }
      within += found;
    }
    return static_cast<double>(within) / static_cast<double>(squares_.size());
  }

 private:
  static int steps_between(const Vec3f& a, const Vec3f& b) {
    return 1 + static_cast<int>((b - a).norm() / (0.4f * kSquare));
  }
  [[nodiscard]] std::array<int, 2> square_of(const Vec3f& x) const {
    const float u = view_ == View::side ? x.z() : x.x(), v = view_ == View::top ? x.z() : x.y();
    return {static_cast<int>(std::floor(u / kSquare)), static_cast<int>(std::floor(v / kSquare))};
  }
  View view_;
  std::set<std::array<int, 2>> squares_;
};

void add_ribbon(std::span<const Vec3f> edges, Shadow& shadow) {
  for (std::size_t i = 0; i + 3 < edges.size(); i += 2)
    shadow.add_quad(edges[i], edges[i + 1], edges[i + 2], edges[i + 3]);
}

Shadow shadow_of_hair(const Groom& groom, View view) {
  Shadow shadow(view);
  for (std::size_t s = 0; s < groom.strand_count(); ++s) {
    const auto points = groom.strand_points(s);
    for (std::size_t i = 1; i < points.size(); ++i) shadow.add_line(points[i - 1], points[i]);
  }
  for (const HairCard& card : groom.cards) add_ribbon(groom.points_of(card.points), shadow);
  return shadow;
}

Shadow shadow_of_cards(const FarCards& far, View view) {
  Shadow shadow(view);
  for (const FarCard& card : far.cards) {
    add_ribbon({far.points.data() + card.points.begin, far.points.data() + card.points.end}, shadow);
  }
  return shadow;
}

void expect_covered(const Groom& groom, const FarCards& far) {
  for (const View view : {View::front, View::side, View::top}) {
    const Shadow hair = shadow_of_hair(groom, view), cards = shadow_of_cards(far, view);
    const double covered = hair.share_within(cards, 0), beside = 1 - cards.share_within(hair, 2);
    EXPECT_GT(covered, 0.8) << "view " << static_cast<int>(view);
    EXPECT_GT(hair.share_within(cards, 2), 0.95) << "view " << static_cast<int>(view);
    EXPECT_LT(beside, 0.1) << "view " << static_cast<int>(view);
  }
}

// The greatest depth of the cards' points, and of the middles of their quads, in the body, m.
double depth_in(const MeshQuery& skin, const FarCards& far) {
  double deepest = 0;
  const auto look_at = [&](const Vec3f& x) {
    if (skin.inside(x.cast<double>())) deepest = std::max(deepest, skin.closest(x.cast<double>()).distance);
  };
  for (const FarCard& card : far.cards) {
    for (std::uint32_t p = card.points.begin; p < card.points.end; ++p) look_at(far.points[p]);
    for (std::uint32_t p = card.points.begin; p + 3 < card.points.end; p += 2) {
      look_at(0.25f * (far.points[p] + far.points[p + 1] + far.points[p + 2] + far.points[p + 3]));
    }
  }
  return deepest;
}

void expect_sound(Groom groom) {
  const std::size_t count = far_card_count_for(groom);
  const FarCards far = make_far_cards(groom, count);
  EXPECT_GE(far.cards.size(), count * 9 / 10);
  const MeshQuery skin(groom.body.mesh);
  EXPECT_LT(depth_in(skin, far), 0.0005);
  expect_covered(groom, far);
  groom.far_cards = far;
  EXPECT_EQ(validate(groom), "");
}

class FarCardsOfMadeHair : public testing::TestWithParam<std::string_view> {};

TEST_P(FarCardsOfMadeHair, cover_it_and_stay_off_the_skin) {
  expect_sound(make_hairstyle(GetParam(), {.strand_count = 3000}).value());
}

INSTANTIATE_TEST_SUITE_P(Made, FarCardsOfMadeHair,
                         testing::Values("long_straight", "long_curly", "wavy", "bob", "side_part", "ponytail", "short",
                                         "plait", "veiled", "locks", "strips"),
                         support::CaseName());

class FarCardsOfRealHair : public testing::TestWithParam<test::RealHair> {};

TEST_P(FarCardsOfRealHair, cover_it_and_stay_off_the_skin) {
  const auto path = test::shared_data() / GetParam().path;
  if (!std::filesystem::exists(path)) GTEST_SKIP() << "no real hairstyle at " << path;
  auto groom = test::import_real(GetParam());
  ASSERT_TRUE(groom) << groom.error();
  expect_sound(std::move(*groom));
}

INSTANTIATE_TEST_SUITE_P(Styles, FarCardsOfRealHair, testing::ValuesIn(test::kRealHair), support::CaseName());

// Left for right, and its strands in another order, so that the clusters are others.
Groom mirrored(const Groom& groom) {
  Groom mirror;
  mirror.group_names = groom.group_names;
  mirror.body = groom.body;
  for (Vec3f& x : mirror.body.mesh.vertices) x.x() = -x.x();
  for (auto& [a, b, c] : mirror.body.mesh.triangles) std::swap(b, c);
  for (std::size_t s = groom.strand_count(); s-- > 0;) {
    std::vector<Vec3f> strand(groom.strand_points(s).begin(), groom.strand_points(s).end());
    for (Vec3f& x : strand) x.x() = -x.x();
    mirror.add_strand(strand, groom.strands[s]);
  }
  return mirror;
}

TEST(FarCards, of_a_mirrored_groom_cover_the_mirrored_places) {
  const Groom groom = make_hairstyle("side_part", {.strand_count = 3000}).value();
  const FarCards far = make_far_cards(groom, 300);
  FarCards back = make_far_cards(mirrored(groom), 300);
  for (Vec3f& x : back.points) x.x() = -x.x();
  for (const View view : {View::front, View::side, View::top}) {
    const Shadow a = shadow_of_cards(far, view), b = shadow_of_cards(back, view);
    EXPECT_GT(a.share_within(b, 1), 0.97);
    EXPECT_GT(b.share_within(a, 1), 0.97);
  }
}

}  // namespace
}  // namespace hairnet
