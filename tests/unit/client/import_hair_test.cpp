#include "client/assets/import/hair_import.hpp"

#include <gmock/gmock.h>

#include <algorithm>
#include <functional>

#include "client/assets/import/guess_roots.hpp"
#include "client/assets/import/outliers.hpp"
#include "client/assets/made/made.hpp"
#include "core/levels/build.hpp"
#include "tests/support/import_files.hpp"
#include "tests/support/real_hair.hpp"

namespace hairnet {
namespace {

using testing::Contains;
using testing::HasSubstr;
using testing::Not;

using Strands = std::vector<std::vector<Vec3f>>;

Strands made(std::string_view style, std::size_t count = 200) {
  HairstyleOptions options;
  options.strand_count = count;
  const Groom groom = *make_hairstyle(style, options);
  Strands strands;
  for (std::size_t s = 0; s < groom.strand_count(); ++s) {
    const auto points = groom.strand_points(s);
    strands.emplace_back(points.begin(), points.end());
  }
  return strands;
}

StrandFile file_of(const Strands& strands, const std::string& name = "made.data") {
  StrandFile file{{}, "hair", name};
  for (const std::vector<Vec3f>& strand : strands) {
    file.strands.points.insert(file.strands.points.end(), strand.begin(), strand.end());
    file.strands.strand_begin.push_back(static_cast<std::uint32_t>(file.strands.points.size()));
  }
  return file;
}

HairParts parts_of(const Strands& strands) {
  HairParts parts;
  parts.name = "made";
  parts.strands.push_back(file_of(strands));
  return parts;
}

std::vector<Outlier> outliers_of(const Strands& strands) {
  StrandFile file = file_of(strands);
  return cut_outliers(std::span(&file, 1));
}

std::string refusal(const Strands& strands, const HairImport& import = {}) {
  const auto imported = import_hair_parts(parts_of(strands), import);
  return imported ? std::string() : imported.error();
}

Strands scaled(Strands strands, float scale, const Vec3f& by = Vec3f::Zero()) {
  for (auto& strand : strands) {
    for (Vec3f& x : strand) x = scale * x + by;
  }
  return strands;
}

Strands reversed(Strands strands) {
  for (auto& strand : strands) std::ranges::reverse(strand);
  return strands;
}

std::vector<Vec3f> straight(const Vec3f& from, const Vec3f& to, int count) {
  std::vector<Vec3f> points;
  for (int i = 0; i < count; ++i)
    points.emplace_back(from + (to - from) * static_cast<float>(i) / static_cast<float>(count - 1));
  return points;
}

// Each entry does to strand 50 of 200 what a broken exporter does to one strand of many. `word` is a part of the
// warning that must name it.
struct Corrupted {
  const char* word;
  std::function<void(Strands&)> corrupt;
};

const std::vector<Corrupted>& corrupted() {
  static const std::vector<Corrupted> all{
      // A point that is 1.6 m below the head is the origin of the scene, at the feet.
      {"strand 50 point", [](Strands& s) { s[50].push_back(Vec3f(0, -1.6f, 0)); }},
      {"strand 50 point", [](Strands& s) { s[50].insert(s[50].begin() + 5, Vec3f(0, -1.6f, 0)); }},
      {"strand 50 point", [](Strands& s) { s[50].insert(s[50].begin(), Vec3f(9, 9, 9)); }},
      {"strand 50 point", [](Strands& s) { s[50].push_back(s[50].back() + Vec3f(0.3f, -0.2f, 0)); }},
      {"strand 50 is 3.5", [](Strands& s) { s[50] = straight(s[50][0], s[50][0] - Vec3f(0, 2.5f, 2.5f), 5000); }},
      {"strand 50 is 2", [](Strands& s) { s[50] = straight(s[50][0], s[50][0] - Vec3f(0, 0, 2), 2); }},
      {"strand 50 has no length", [](Strands& s) { s[50].assign(16, s[50][0]); }},
      {"strand 50 has no length", [](Strands& s) { s[50].resize(1); }},
      {"strand 50 lies", [](Strands& s) { s[50] = straight(Vec3f(0, -2, 0), Vec3f(0, -2.1f, 0), 16); }},
  };
  return all;
}

TEST(Outliers, of_every_kind_are_named_and_leave_the_lattice_that_valid_hair_has) {
  const Strands valid = made("bob");
  const auto clean = import_hair_parts(parts_of(valid), {});
  ASSERT_TRUE(clean) << clean.error();
  EXPECT_THAT(clean->warnings, Not(Contains(HasSubstr("strand 50"))));
  const LevelSpec& spec = kLevelSpecs[static_cast<std::size_t>(LevelIndex::low)];
  const auto wanted = build_level(clean->groom, spec);
  for (std::size_t i = 0; i < corrupted().size(); ++i) {
    Strands strands = valid;
    corrupted()[i].corrupt(strands);
    const auto imported = import_hair_parts(parts_of(strands), {});
    ASSERT_TRUE(imported) << imported.error();
    EXPECT_THAT(imported->warnings, Contains(HasSubstr(std::string("made.data: ") + corrupted()[i].word))) << i;
    const auto level = build_level(imported->groom, spec);
    const Lattice &a = level->geometry.lattice, &b = wanted->geometry.lattice;
    EXPECT_EQ(a.dims, b.dims) << i;
    // One bad strand that stayed would stretch the lattice to it, and the cells over all other hair would become
    // coarse. Cutting it may change the lattice by 5 % of a cell and 1 cm.
    EXPECT_LT((a.spacing - b.spacing).cwiseAbs().maxCoeff(), 0.05f * b.spacing.maxCoeff()) << i;
    EXPECT_LT((a.origin - b.origin).norm(), 0.01f) << i;
    EXPECT_NEAR(static_cast<double>(level->rest.size()), static_cast<double>(wanted->rest.size()),
                0.05 * static_cast<double>(wanted->rest.size()))
        << i;
    HairImport strict;
    strict.strict = true;
    EXPECT_THAT(refusal(strands, strict), HasSubstr(corrupted()[i].word));
  }
}

TEST(Outliers, are_found_in_any_unit_and_at_any_place) {
  for (const float unit : {1.0f, 100.0f, 1000.0f}) {
    Strands strands = made("bob");
    strands[50].push_back(Vec3f(0, -1.6f, 0));
    EXPECT_EQ(outliers_of(scaled(strands, unit, unit * Vec3f(0, 1.6f, 0))).size(), 1u) << unit;
  }
}

TEST(Outliers, many_of_one_kind_are_told_in_few_lines) {
  Strands strands = made("bob");
  for (std::size_t s = 0; s < 20; ++s) {
    strands[s].assign(16, strands[s][0]);
    // Strands 0 to 19 lose their length, and strands 100 to 119 get a point far away.
    strands[100 + s].push_back(Vec3f(0, -1.6f, 0));
  }
  const auto imported = import_hair_parts(parts_of(strands), {});
  ASSERT_TRUE(imported) << imported.error();
  // Forty lines, one for each bad strand, would hide all other warnings.
  EXPECT_LE(imported->warnings.size(), 12u);
  EXPECT_THAT(imported->warnings, Contains(HasSubstr("20 of 200 strands have no length")));
  EXPECT_THAT(imported->warnings, Contains(HasSubstr("40 of 200 strands in all")));
  EXPECT_EQ(imported->groom.strand_count(), 180u);
}

TEST(Outliers, are_none_in_any_hairstyle) {
  for (const MadeName& style : hairstyle_names()) {
    for (const std::size_t count : {60, 300}) EXPECT_TRUE(outliers_of(made(style.name, count)).empty()) << style.name;
  }
}

TEST(Outliers, are_none_where_few_strands_are_a_style_of_their_own) {
  const Strands stubble = [] {
    Strands strands = made("short");
    for (auto& strand : strands) {
      // Each strand has a tenth of its length, as after a shave.
      for (Vec3f& x : strand) x = strand[0] + 0.1f * (x - strand[0]);
    }
    return strands;
  }();
  // Three strands that are alike make a style (kAlikeMin in outliers.cpp).
  for (const std::size_t count : {3, 10, 40}) {
    Strands with_tail = stubble;
    for (std::size_t s = 0; s < count; ++s)
      with_tail[7 * s % 200] = straight(Vec3f(0.001f * static_cast<float>(s), 0.1f, -0.1f),
                                        Vec3f(0.002f * static_cast<float>(s), -0.8f, -0.15f), 24);
    EXPECT_TRUE(outliers_of(with_tail).empty()) << "a long ponytail of " << count << " strands beside stubble";
  }
  Strands half = made("long_curly");
  for (std::size_t s = 0; s < half.size(); s += 2) {
    for (Vec3f& x : half[s]) x = half[s][0] + 0.01f * (x - half[s][0]);
  }
  EXPECT_TRUE(outliers_of(half).empty()) << "every other strand a vellus hair";
  Strands flyaways = made("bob");
  // Two strands that are 1.8 times as long as they were are below 3 times the usual size (kFar in outliers.cpp).
  for (const std::size_t s : {3, 90}) {
    for (Vec3f& x : flyaways[s]) x = flyaways[s][0] + 1.8f * (x - flyaways[s][0]);
  }
  EXPECT_TRUE(outliers_of(flyaways).empty());
}

TEST(HairImport, without_any_strand_of_a_length_is_refused_in_one_line) {
  Strands strands = made("bob");
  for (auto& strand : strands) std::fill(strand.begin(), strand.end(), strand[0]);
  EXPECT_EQ(refusal(strands), "made.data: no strand has a length: all points of each lie in one place");
}

TEST(HairImport, tells_how_much_a_far_origin_rounds) {
  const auto imported = import_hair_parts(parts_of(scaled(made("bob"), 1, Vec3f(1e5f, 0, -1e5f))), {});
  ASSERT_TRUE(imported) << imported.error();
  // At 100 km a float has steps of 7.81 mm.
  EXPECT_THAT(imported->warnings, Contains(HasSubstr("7.81 mm")));
  const auto near = import_hair_parts(parts_of(scaled(made("bob"), 100, Vec3f(0, 160, 0))), {});
  ASSERT_TRUE(near) << near.error();
  EXPECT_THAT(near->warnings, Not(Contains(HasSubstr(" mm: move"))));
}

// Hair that is taken tip first would hang from its tips. Short and made hair that is stored root first must not be
// turned by mistake.
TEST(HairImport, strands_stored_tip_first_are_turned_round_and_none_others) {
  for (const char* style : {"long_straight", "long_curly", "wavy", "bob", "side_part", "ponytail", "short"}) {
    const Strands strands = made(style, 300);
    const auto right = import_hair_parts(parts_of(strands), {}),
               turned = import_hair_parts(parts_of(reversed(strands)), {});
    ASSERT_TRUE(right) << style << ": " << right.error();
    ASSERT_TRUE(turned) << style << ": " << turned.error();
    EXPECT_EQ(turned->groom.points, right->groom.points) << style;
    EXPECT_THAT(turned->warnings, Contains(HasSubstr("tip first"))) << style;
  }
  for (const MadeName& style : hairstyle_names()) {
    const StrandFile file = file_of(made(style.name, 300));
    EXPECT_FALSE(are_tips_first(std::span(&file, 1))) << style.name;
  }
  HairImport last;
  last.roots = RootEnd::last;
  last.strict = true;
  EXPECT_EQ(refusal(reversed(made("wavy")), last), "") << "what a flag says is no doubt";
}

// Makes hair on the upper half of a ball. Apart from chance it is the same on all sides, so no side shows where the
// face is. `phase` turns it.
Strands half_ball(float phase) {
  Strands strands;
  for (int i = 0; i < 200; ++i) {
    const float y = (static_cast<float>(i) + 0.5f) / 200, ring = std::sqrt(1 - y * y);
    // The golden angle, in rad, spreads the roots evenly over the half ball.
    const float angle = 2.39996f * static_cast<float>(i) + phase;
    const Vec3f out(ring * std::cos(angle), y, ring * std::sin(angle));
    // Roots lie on a skull of 9 cm radius; tips are 16 cm from its middle, and 5 cm lower than straight out.
    strands.push_back(straight(0.09f * out, 0.16f * out - Vec3f(0, 0.05f, 0), 8));
  }
  return strands;
}

TEST(HairImport, takes_a_face_that_hair_does_not_show_where_it_usually_is_and_says_so) {
  std::size_t doubts = 0;
  // The eight turns are 45 degrees apart, so that chance does not decide.
  for (int turn = 0; turn < 8; ++turn) {
    const Strands strands = half_ball(0.785f * static_cast<float>(turn));
    const auto imported = import_hair_parts(parts_of(strands), {});
    ASSERT_TRUE(imported) << imported.error();
    EXPECT_EQ(imported->placement.face, Axis::plus_z);
    HairImport import;
    import.strict = true;
    import.flag_prefix = "--hair-";
    if (const std::string refused = refusal(strands, import); !refused.empty()) {
      ++doubts;
      EXPECT_THAT(refused, HasSubstr("--hair-face"));
      EXPECT_THAT(imported->warnings, Contains(HasSubstr("--face sets it")));
    }
    import.strands.face = Axis::minus_x;
    const auto announced = import_hair_parts(parts_of(strands), import);
    ASSERT_TRUE(announced) << announced.error();
    EXPECT_EQ(announced->placement.face, Axis::minus_x);
  }
  // The guess may be sure by chance for some turns, but not for all.
  EXPECT_GT(doubts, 0u);
}

TEST(HairImport, takes_what_is_known_instead_of_guessing_it) {
  HairImport import;
  // No guess would give any of these values for hair that is upright, in metres, with its origin in the head.
  import.strands = {Axis::plus_z, Axis::minus_y, 0.9, Vec3(1, 2, 3)};
  const auto imported = import_hair_parts(parts_of(made("bob")), import);
  ASSERT_TRUE(imported) << imported.error();
  EXPECT_EQ(imported->placement.up, Axis::plus_z);
  EXPECT_EQ(imported->placement.face, Axis::minus_y);
  EXPECT_EQ(imported->placement.unit_m, 0.9);
  EXPECT_EQ(imported->placement.origin, Vec3(1, 2, 3));
  import.strands.face = Axis::plus_z;
  EXPECT_THAT(refusal(made("bob"), import), HasSubstr("same axis"));
}

TEST(HairImport, places_real_hair_as_people_do_and_takes_nothing_off_it) {
  if (!std::filesystem::exists(test::shared_data() / "hair"))
    GTEST_SKIP() << "no real hairstyles at " << test::shared_data();
  for (const test::RealHair& real : test::kRealHair) {
    HairParts parts;
    // A ponytail's tail shows no head: the other parts of it do.
    const std::filesystem::path path = test::shared_data() / real.path;
    std::vector<std::filesystem::path> files{path};
    if (path.stem() == "tail") {
      for (const char* part : {"back.tfx", "front_top.tfx", "side.tfx"}) files.push_back(path.parent_path() / part);
    }
    std::size_t strand_count = 0;
    for (const auto& file : files) {
      auto strands = real.decode(test::file_bytes(file));
      ASSERT_TRUE(strands) << strands.error();
      strand_count += strands->strand_count();
      parts.strands.push_back({std::move(*strands), file.stem().string(), file.string()});
    }
    for (const bool tips_first : {false, true}) {
      HairParts given = parts;
      HairImport import;
      import.strict = !tips_first;
      if (tips_first) turn_round(given.strands);
      const auto imported = import_hair_parts(std::move(given), import);
      ASSERT_TRUE(imported) << real.name << ": " << imported.error();
      EXPECT_EQ(imported->placement.up, real.placement.up) << real.name;
      EXPECT_EQ(imported->placement.face, real.placement.face) << real.name;
      EXPECT_NEAR(std::log(imported->placement.unit_m / real.placement.unit_m), 0, 0.3) << real.name;
      EXPECT_EQ(imported->groom.strand_count(), strand_count) << real.name;
    }
  }
}

TEST(ImportStated, a_unit_that_a_file_states_is_taken_unless_a_flag_sets_another) {
  HairParts parts = parts_of(scaled(made("long_straight"), 100));
  // This is no usual unit, so no guess could give it.
  parts.strands[0].strands.unit_m = 0.011;
  parts.strands[0].strands.up = Axis::plus_y;
  parts.strands[0].strands.notes = {"a note"};
  parts.strands[0].strands.doubts = {"a doubt"};
  const auto stated = import_hair_parts(parts, {});
  ASSERT_TRUE(stated) << stated.error();
  EXPECT_EQ(stated->placement.unit_m, 0.011);
  EXPECT_THAT(stated->warnings, Contains("made.data: a note"));
  EXPECT_THAT(stated->warnings, Contains("made.data: a doubt"));
  HairImport import;
  import.strands.unit_m = 0.012;
  EXPECT_EQ(import_hair_parts(parts, import)->placement.unit_m, 0.012);
}

TEST(ImportStated, files_that_state_different_units_are_told_and_the_unit_is_guessed) {
  HairParts parts = parts_of(scaled(made("long_straight"), 100));
  parts.strands.push_back(parts.strands[0]);
  parts.strands[0].strands.unit_m = 0.011;
  parts.strands[1].strands.unit_m = 0.012;
  parts.strands[1].file = "other.usda";
  const auto imported = import_hair_parts(parts, {});
  ASSERT_TRUE(imported) << imported.error();
  EXPECT_EQ(imported->placement.unit_m, 0.01);
  EXPECT_THAT(imported->warnings, Contains(HasSubstr("other.usda: its unit is not that of the files before it")));
}

}  // namespace
}  // namespace hairnet
