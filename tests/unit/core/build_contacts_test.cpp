#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <set>

#include "core/geometry/mesh_query.hpp"
#include "core/levels/build.hpp"
#include "core/levels/make_skin.hpp"
#include "tests/support/build_grooms.hpp"

namespace hairnet {
namespace {

Groom make_groom_with_body() {
  Groom groom = support::make_head_of_hair(300);
  groom.body = support::make_plain_body();
  return groom;
}

TEST(Skin, every_bone_of_a_body_with_shoulders_has_a_field) {
  const auto skin = make_skin(make_groom_with_body());
  std::set<Bone> bones;
  for (const SkinDistanceField& field : *skin) bones.insert(field.bone);
  EXPECT_EQ(bones.size(), skin->size());
  EXPECT_EQ(bones.size(), kBoneCount);
}

TEST(Skin, of_a_round_head_is_the_distance_to_a_ball) {
  Groom groom = support::make_head_of_hair(50);
  support::add_ellipsoid(groom.body, {0, 0.01f, 0}, {0.09f, 0.09f, 0.09f}, Bone::head);
  const auto skin = make_skin(groom);
  ASSERT_EQ(skin->size(), 1u);
  for (const double radius : {0.06, 0.08, 0.09, 0.1, 0.11}) {
    for (const Vec3& way : {Vec3(1, 0, 0), Vec3(0.6, 0.8, 0), Vec3(-0.5, 0.5, 0.7071)}) {
      Vec3 gradient;
      const Vec3 at = Vec3(0, 0.01, 0) + radius * way.normalized();
      // The field comes from flat triangles and interpolates on a grid, so 3 mm of error are allowed.
      EXPECT_NEAR(skin_distance(skin->front(), at, &gradient), radius - 0.09, 0.003);
      EXPECT_GT(gradient.normalized().dot(way.normalized()), 0.97);
    }
  }
}

TEST(Skin, gradient_is_the_slope_of_the_distance) {
  const auto skin = make_skin(make_groom_with_body());
  const SkinDistanceField& field = skin->front();
  const double cell = static_cast<double>(field.cell_m);
  for (int n = 0; n < 50; ++n) {
    // The place lies within one cell, where the trilinear function is smooth; multiples of 0.37 spread the 50 places
    // over the cell.
    const Vec3 at =
        field.origin.cast<double>() + cell * Vec3(3.05 + 0.9 * (0.37 * n - std::floor(0.37 * n)), 4.4 + n % 5, 5.6);
    Vec3 gradient;
    skin_distance(field, at, &gradient);
    for (int a = 0; a < 3; ++a) {
      const Vec3 step = 1e-6 * Vec3::Unit(a);
      EXPECT_NEAR(gradient[a], (skin_distance(field, at + step) - skin_distance(field, at - step)) / 2e-6, 1e-4);
    }
  }
}

TEST(Skin, beyond_the_grid_grows_with_the_way_there) {
  const auto skin = make_skin(make_groom_with_body());
  const SkinDistanceField& field = skin->front();
  const Vec3 corner = field.origin.cast<double>();
  const double at_corner = skin_distance(field, corner);
  EXPECT_NEAR(skin_distance(field, corner - Vec3(0.3, 0, 0)), at_corner + 0.3, 1e-6);
}

TEST(Skin, a_groom_without_a_body_has_none_and_no_contact) {
  const Groom groom = support::make_head_of_hair(50);
  EXPECT_TRUE(make_skin(groom)->empty());
  EXPECT_EQ(build_level(groom, kLevelSpecs[2])->contacts.count(), 0u);
}

// kLevelSpecs[2] is the low level, with at most 230 contact points. They must span at least 80 % of the hair's extent
// on each axis.
TEST(ContactPoints, are_as_many_as_asked_for_at_most_and_spread_over_the_hair) {
  const Groom groom = make_groom_with_body();
  const auto level = build_level(groom, kLevelSpecs[2]);
  const ContactPoints& contacts = level->contacts;
  ASSERT_GT(contacts.count(), kLevelSpecs[2].contact_count / 2);
  EXPECT_LE(contacts.count(), kLevelSpecs[2].contact_count);
  Vec3f low = Vec3f::Constant(10), high = -low, hair_low = low, hair_high = high;
  for (const Vec3f& p : contacts.rest) {
    low = low.cwiseMin(p);
    high = high.cwiseMax(p);
  }
  for (const Vec3f& p : groom.points) {
    hair_low = hair_low.cwiseMin(p);
    hair_high = hair_high.cwiseMax(p);
  }
  EXPECT_GT(((high - low).array() / (hair_high - hair_low).array()).minCoeff(), 0.8f);
}

// Contact that pushed hair in its design would deform every hairstyle before it moves.
TEST(ContactPoints, touch_nothing_in_the_design) {
  const auto set = build_levels(make_groom_with_body());
  for (const Level& level : set->levels) {
    const ContactPoints& contacts = level.contacts;
    for (std::size_t f = 0; f < level.skin->size(); ++f) {
      for (std::size_t p = 0; p < contacts.count(); ++p) {
        const auto distance = skin_distance((*level.skin)[f], contacts.rest[p].cast<double>());
        EXPECT_LT(contacts.limit[f * contacts.count() + p], static_cast<float>(distance));
      }
    }
  }
}

TEST(ContactPoints, short_hair_never_meets_the_trunk) {
  Groom groom = make_groom_with_body();
  // Strands of a tenth of their length are some centimetres long, and the trunk begins farther below the roots.
  for (std::size_t s = 0; s < groom.strand_count(); ++s) {
    const Vec3f root = groom.points[groom.strand_begin[s]];
    for (std::uint32_t p = groom.strand_begin[s]; p < groom.strand_begin[s + 1]; ++p)
      groom.points[p] = root + 0.1f * (groom.points[p] - root);
  }
  const auto level = build_level(groom, kLevelSpecs[2]);
  const ContactPoints& contacts = level->contacts;
  for (std::size_t f = 0; f < level->skin->size(); ++f) {
    const Bone bone = (*level->skin)[f].bone;
    for (std::size_t p = 0; p < contacts.count(); ++p) {
      const float limit = contacts.limit[f * contacts.count() + p];
      if (bone == Bone::head) {
        EXPECT_GT(limit, kContactNever_m) << "all may meet the head";
      } else if (bone == Bone::upper_trunk) {
        EXPECT_EQ(limit, kContactNever_m) << "the trunk is out of reach";
      }
    }
  }
}

}  // namespace
}  // namespace hairnet
