#include "core/groom/material.hpp"

#include <gmock/gmock.h>

#include <array>
#include <cmath>
#include <limits>
#include <numbers>
#include <vector>

#include "core/groom/groom.hpp"
#include "core/groom/material_scale.hpp"
#include "core/levels/build.hpp"
#include "core/number_range.hpp"
#include "tests/support/build_grooms.hpp"

namespace hairnet {
namespace {

using testing::HasSubstr;

constexpr float kNan = std::numeric_limits<float>::quiet_NaN();

// Lists every number of a Material; the assertion below fails when one is added and not listed.
constexpr std::array kNumbers{&Material::axial_stiffness_n,      &Material::attachment_stiffness_n_per_m,
                              &Material::damping_ratio,          &Material::linear_density_kg_per_m,
                              &Material::air_drag_ns_per_m2,     &Material::ether_mass_ratio,
                              &Material::ether_stiffness_per_s2, &Material::ether_damping_ratio,
                              &Material::root_length_m,          &Material::thickness_m,
                              &Material::metaball_potential_j};
static_assert(sizeof(Material) == kNumbers.size() * sizeof(float));

template <class T, class Change>
std::string error_of(Change change) {
  T value;
  change(value);
  return validate(value);
}

TEST(Material, named_ones_are_valid_and_different) {
  ASSERT_FALSE(material_names().empty());
  for (const std::string_view name : material_names()) {
    const auto material = make_material(name);
    ASSERT_TRUE(material) << name;
    EXPECT_EQ(validate(*material), "") << name;
    EXPECT_EQ(material_name(*material), name);
  }
}

TEST(Material, normal_is_the_default) {
  EXPECT_EQ(*make_material("normal"), Material{});
}

TEST(Material, a_name_that_is_not_there_is_refused_with_those_that_are) {
  const auto material = make_material("Wet");
  ASSERT_FALSE(material);
  EXPECT_THAT(material.error(), HasSubstr("'Wet'"));
  EXPECT_THAT(material.error(), HasSubstr("soft, normal, stiff, gelled, wet"));
  EXPECT_FALSE(make_material(""));
}

TEST(Material, changed_by_hand_it_is_custom) {
  Material material = *make_material("wet");
  material.damping_ratio *= 1.01f;
  EXPECT_EQ(material_name(material), "custom");
}

// The ranges stand in validate(Material) (core/groom/material.cpp). Each value here is beyond its range, or no
// number at all.
TEST(Material, refuses_values_out_of_range_and_names_them) {
  EXPECT_EQ(validate(Material{}), "");
  EXPECT_THAT(error_of<Material>([](Material& m) { m.axial_stiffness_n = kNan; }), HasSubstr("axial stiffness"));
  EXPECT_THAT(error_of<Material>([](Material& m) { m.attachment_stiffness_n_per_m = -1; }), HasSubstr("attachment"));
  EXPECT_THAT(error_of<Material>([](Material& m) { m.damping_ratio = 11; }), HasSubstr("damping ratio is 11"));
  EXPECT_THAT(error_of<Material>([](Material& m) { m.linear_density_kg_per_m = 0; }), HasSubstr("density"));
  EXPECT_THAT(error_of<Material>([](Material& m) { m.air_drag_ns_per_m2 = kNan; }), HasSubstr("air drag"));
  EXPECT_THAT(error_of<Material>([](Material& m) { m.ether_mass_ratio = 0; }), HasSubstr("ether mass"));
  EXPECT_THAT(error_of<Material>([](Material& m) { m.ether_stiffness_per_s2 = 2e5f; }), HasSubstr("ether stiffness"));
  EXPECT_THAT(error_of<Material>([](Material& m) { m.ether_damping_ratio = -0.1f; }), HasSubstr("ether damping"));
  EXPECT_THAT(error_of<Material>([](Material& m) { m.root_length_m = kNan; }), HasSubstr("root length"));
  EXPECT_THAT(error_of<Material>([](Material& m) { m.thickness_m = 0.2f; }), HasSubstr("thickness"));
  EXPECT_THAT(error_of<Material>([](Material& m) { m.metaball_potential_j = kNan; }), HasSubstr("potential"));
}

// Any number may come from a file. One that is almost zero (below NumberRange::kSmallest) or absurd must be refused
// with a message that names its range.
TEST(Material, refuses_numbers_that_are_almost_zero_and_absurd_ones_with_the_range) {
  for (const auto number : kNumbers) {
    for (const float bad : {1e-42f, 1e-13f, -1e-42f, 1e6f, 3e38f, kNan, std::numeric_limits<float>::infinity()}) {
      const std::string error = error_of<Material>([=](Material& m) { m.*number = bad; });
      EXPECT_THAT(error, HasSubstr("in [")) << bad;
    }
  }
  EXPECT_EQ(error_of<Material>([](Material& m) { m.axial_stiffness_n = 2e-13f; }),
            "axial stiffness (N per hair) is 2e-13, not 0 or in [1e-12, 10]");
  EXPECT_EQ(error_of<Material>([](Material& m) { m.axial_stiffness_n = 0; }), "");
}

TEST(Material, refuses_factors_that_are_almost_zero_and_absurd_ones) {
  const std::vector<float MaterialScale::*> numbers{&MaterialScale::stiffness, &MaterialScale::damping,
                                                    &MaterialScale::density,   &MaterialScale::ether_damping,
                                                    &MaterialScale::air_drag,  &MaterialScale::gel_per_s2};
  static_assert(sizeof(MaterialScale) == 6 * sizeof(float));
  for (const auto number : numbers) {
    for (const float bad : {1e-42f, 1e-13f, -1e-42f, 1e6f, 3e38f, kNan}) {
      EXPECT_THAT(error_of<MaterialScale>([=](MaterialScale& s) { s.*number = bad; }), HasSubstr("in [")) << bad;
    }
  }
}

TEST(Material, of_the_smallest_numbers_that_are_taken_gives_valid_levels) {
  constexpr auto kSmallest = static_cast<float>(1.01 * NumberRange::kSmallest);
  std::size_t built = 0;
  for (const auto number : kNumbers) {
    Groom groom = support::make_head_of_hair(6);
    float& value = groom.materials.base.*number;
    value = kSmallest;
    // The density and the ratio of the ether's mass have a larger smallest value of their own, and are skipped.
    if (!validate(groom).empty()) continue;
    ++built;
    const auto levels = build_levels(groom);
    for (const Level& level : levels->levels) EXPECT_EQ(validate(level), "");
  }
  EXPECT_EQ(built, kNumbers.size() - 2);
}

TEST(Material, its_damping_is_that_share_of_critical_damping_of_a_strands_axial_mode) {
  // Computes the ratio for a strand as a chain of many masses and springs, in its first mode: with the modal
  // stiffness k, mass m and damping q, it is q / (2 sqrt(k m)).
  Material material;
  material.damping_ratio = 0.3f;
  for (const double length : {0.05, 0.3, 0.9}) {
    const double q_over_k = axial_damping_time_s(material, length);
    constexpr int kPieces = 2000;
    const double k = static_cast<double>(material.axial_stiffness_n) / (length / kPieces);
    const double m = static_cast<double>(material.linear_density_kg_per_m) * length / kPieces;
    double modal_k = 0, modal_m = 0;
    const auto shape = [](int i) { return std::sin(std::numbers::pi / 2 * i / kPieces); };
    for (int i = 1; i <= kPieces; ++i) {
      modal_k += k * (shape(i) - shape(i - 1)) * (shape(i) - shape(i - 1));
      modal_m += (i == kPieces ? 0.5 : 1) * m * shape(i) * shape(i);
    }
    // The damping of a mode with stiffness k and mass m is critical at q = 2 sqrt(k m).
    EXPECT_NEAR(q_over_k * modal_k / (2 * std::sqrt(modal_k * modal_m)), 0.3, 1e-4);
  }
  material.axial_stiffness_n = 0;
  EXPECT_EQ(axial_damping_time_s(material, 0.3), 0);
}

// The arguments of LevelSpec are the nodes on each axis and the largest numbers of springs and attachments; 1000 are
// more than there are.
TEST(Material, springs_and_attachment_of_a_strand_have_its_damping) {
  Groom groom;
  support::add(groom, support::straight({0, 0.1f, 0}, {0.1f, -1, 0.05f}, 0.4f, 20));
  const auto level = build_level(groom, {{6, 6, 6}, 1000, 1000});
  ASSERT_GT(level->springs.count(), 2u);
  ASSERT_EQ(level->attachments.count(), 1u);
  const auto expected = static_cast<float>(axial_damping_time_s(Material{}, 0.4));
  for (const Stiffeners* s : {&level->springs, &level->attachments}) {
    for (std::size_t i = 0; i < s->count(); ++i)
      EXPECT_NEAR(s->damping[i] / s->stiffness[i], expected, 1e-4f * expected);
  }
}

TEST(Material, default_damping_is_about_eight_milliseconds_on_hair_of_thirty_centimetres) {
  EXPECT_NEAR(axial_damping_time_s(Material{}, 0.3), 0.008, 5e-4);
}

TEST(MaterialSet, groups_without_their_own_have_the_base) {
  MaterialSet materials;
  materials.base = *make_material("soft");
  materials.set(4, *make_material("wet"));
  materials.set(1, *make_material("stiff"));
  materials.set(4, *make_material("gelled"));
  EXPECT_EQ(materials.groups.size(), 2u);
  EXPECT_EQ(material_name(materials.of(0)), "soft");
  EXPECT_EQ(material_name(materials.of(1)), "stiff");
  EXPECT_EQ(material_name(materials.of(4)), "gelled");
  EXPECT_EQ(material_name(materials.of(5)), "soft");
  EXPECT_EQ(validate(materials, 5), "");
}

TEST(MaterialSet, refuses_missing_or_unsorted_groups_and_invalid_materials) {
  MaterialSet materials;
  materials.set(4, {});
  EXPECT_THAT(validate(materials, 4), HasSubstr("group 4: that group does not exist"));
  materials.groups.push_back({4, {}});
  EXPECT_THAT(validate(materials, 5), HasSubstr("not ascending"));
  materials.groups = {{2, {}}};
  materials.groups[0].material.damping_ratio = -1;
  EXPECT_THAT(validate(materials, 5), HasSubstr("group 2: damping ratio"));
  materials = {};
  materials.base.thickness_m = kNan;
  EXPECT_THAT(validate(materials, 5), HasSubstr("material: thickness"));
}

TEST(MaterialSet, is_part_of_a_grooms_validation) {
  Groom groom = support::make_head_of_hair(3);
  EXPECT_EQ(validate(groom), "");
  // make_head_of_hair() has two groups, 0 and 1, so group 1 may have a material and group 2 may not.
  groom.materials.set(1, {});
  EXPECT_EQ(validate(groom), "");
  groom.materials.set(2, {});
  EXPECT_THAT(validate(groom), HasSubstr("group 2"));
}

// A stiff fringe must not stiffen the rest of the hair.
TEST(MaterialSet, a_groups_material_is_in_the_springs_of_that_group_alone) {
  Groom groom;
  support::add(groom, support::straight({0, 0.1f, 0.1f}, {0, -1, 0}, 0.3f, 12), {.group = 0});
  support::add(groom, support::straight({0, 0.1f, -0.1f}, {0, -1, 0}, 0.3f, 12), {.group = 1});
  const LevelSpec spec{{6, 6, 6}, 1000, 1000};
  const auto before = build_level(groom, spec);
  Material stiff;
  stiff.axial_stiffness_n *= 10;
  groom.materials.set(0, stiff);
  const auto after = build_level(groom, spec);
  ASSERT_EQ(before->springs.count(), after->springs.count());
  std::size_t stiffened = 0;
  for (std::size_t s = 0; s < after->springs.count(); ++s) {
    const bool is_front = after->rest[after->springs.nodes[after->springs.begin[s]]].z() > 0;
    EXPECT_NEAR(after->springs.stiffness[s], (is_front ? 10 : 1) * before->springs.stiffness[s], 1e-3f);
    stiffened += is_front;
  }
  EXPECT_GT(stiffened, 0u);
  EXPECT_LT(stiffened, after->springs.count());
}

TEST(MaterialScale, the_default_changes_nothing_and_between_equals_is_the_default) {
  EXPECT_EQ(validate(MaterialScale{}), "");
  for (const std::string_view name : material_names())
    EXPECT_EQ(scale_between(*make_material(name), *make_material(name)), MaterialScale{});
}

TEST(MaterialScale, refuses_values_out_of_range_and_names_them) {
  using S = MaterialScale;
  // A scale is 1 for no change. The largest is 100 for stiffness, damping and drag (material_scale.cpp).
  EXPECT_THAT(error_of<S>([](S& s) { s.stiffness = kNan; }), HasSubstr("scale stiffness"));
  EXPECT_THAT(error_of<S>([](S& s) { s.stiffness = 101; }), HasSubstr("scale stiffness is 101"));
  EXPECT_THAT(error_of<S>([](S& s) { s.damping = -1; }), HasSubstr("scale damping"));
  EXPECT_THAT(error_of<S>([](S& s) { s.density = -1; }), HasSubstr("density"));
  EXPECT_THAT(error_of<S>([](S& s) { s.ether_damping = 1e9f; }), HasSubstr("ether_damping"));
  EXPECT_THAT(error_of<S>([](S& s) { s.air_drag = kNan; }), HasSubstr("air_drag"));
  EXPECT_THAT(error_of<S>([](S& s) { s.gel_per_s2 = -1; }), HasSubstr("gel"));
}

TEST(MaterialScale, between_any_two_named_materials_is_in_range) {
  for (const std::string_view from : material_names()) {
    for (const std::string_view to : material_names())
      EXPECT_EQ(validate(scale_between(*make_material(from), *make_material(to))), "") << from << " to " << to;
  }
}

TEST(MaterialScale, turns_what_was_built_of_one_material_into_the_other) {
  Groom groom;
  support::add(groom, support::straight({0, 0.1f, 0}, {0, -1, 0}, 0.4f, 20));
  const LevelSpec spec{{6, 6, 6}, 1000, 1000};
  const auto built = build_level(groom, spec);
  for (const std::string_view name : material_names()) {
    groom.materials.base = *make_material(name);
    const auto wanted = build_level(groom, spec);
    const MaterialScale scale = scale_between(Material{}, *make_material(name));
    for (std::size_t s = 0; s < built->springs.count(); ++s) {
      const float k = wanted->springs.stiffness[s], q = wanted->springs.damping[s];
      EXPECT_NEAR(built->springs.stiffness[s] * scale.stiffness, k, 1e-4f * k) << name;
      EXPECT_NEAR(built->springs.damping[s] * scale.damping, q, 1e-4f * q) << name;
    }
    for (std::size_t i = 0; i < built->rest.size(); ++i) {
      const float mass = built->mass[i] * scale.density;
      EXPECT_NEAR(mass, wanted->mass[i], 1e-4f * mass) << name;
      const float ether = built->ether_stiffness[i] * scale.density + scale.gel_per_s2 * mass;
      EXPECT_NEAR(ether, wanted->ether_stiffness[i], 1e-4f * ether) << name;
      EXPECT_NEAR(built->drag[i][0] * scale.air_drag, wanted->drag[i][0], 1e-4f * wanted->drag[i][0]) << name;
      // The damping of ether depends on the distance from the root, and the scale is exact at 20 cm alone. Nodes
      // within 5 cm of there must agree within 20 %.
      if (std::abs(built->rest[i].y() + 0.1f) < 0.05f) {
        EXPECT_NEAR(built->ether_damping[i] * scale.density * scale.ether_damping, wanted->ether_damping[i],
                    0.2f * wanted->ether_damping[i])
            << name;
      }
    }
  }
}

TEST(MaterialScale, gel_that_was_built_in_stays) {
  const MaterialScale scale = scale_between(*make_material("gelled"), *make_material("normal"));
  EXPECT_EQ(scale.gel_per_s2, 0);
  EXPECT_EQ(validate(scale), "");
}

}  // namespace
}  // namespace hairnet
