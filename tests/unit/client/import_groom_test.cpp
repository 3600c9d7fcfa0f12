#include <gmock/gmock.h>

#include <cstdio>
#include <map>
#include <numbers>

#include "client/assets/import/obj.hpp"
#include "client/assets/import/placement.hpp"
#include "core/geometry/mesh_query.hpp"
#include "tests/support/import_files.hpp"

namespace hairnet {
namespace {

using testing::Contains;
using testing::ElementsAre;
using testing::HasSubstr;
using testing::Not;

// Makes hair on the scalp of a ball, whose lower end is 20 degrees below the equator. Roots are spread evenly by the
// golden angle, and each strand is a straight line of four points outwards.
ImportedStrands scalp_strands(const Vec3& centre, double radius, std::size_t count, double length = 0.1) {
  ImportedStrands out;
  const double golden = std::numbers::pi * (3 - std::sqrt(5.0));
  for (std::size_t s = 0; s < count; ++s) {
    const double y = 1 - 1.34 * (static_cast<double>(s) + 0.5) / static_cast<double>(count);
    const double ring = std::sqrt(1 - y * y), angle = golden * static_cast<double>(s);
    const Vec3 outwards(ring * std::cos(angle), y, ring * std::sin(angle));
    for (int i = 0; i < 4; ++i) out.points.push_back((centre + (radius + length * i / 3) * outwards).cast<float>());
    out.strand_begin.push_back(static_cast<std::uint32_t>(out.points.size()));
  }
  return out;
}

void append(ImportedStrands& strands, std::initializer_list<Vec3f> strand) {
  strands.points.insert(strands.points.end(), strand);
  strands.strand_begin.push_back(static_cast<std::uint32_t>(strands.points.size()));
}

GroomDef def_of(ImportedStrands strands) {
  GroomDef def;
  def.name = "made";
  def.files.push_back({std::move(strands), "hair"});
  return def;
}

double rooted_share(const Groom& groom, const std::string& group = {}) {
  std::size_t count = 0, rooted = 0;
  for (const StrandProperties& strand : groom.strands) {
    if (!group.empty() && groom.group_names[strand.group] != group) continue;
    ++count;
    rooted += strand.rooted;
  }
  return static_cast<double>(rooted) / static_cast<double>(count);
}

Vec3 middle_of(const TriangleMesh& mesh) {
  Vec3f low = mesh.vertices.front(), high = low;
  for (const Vec3f& x : mesh.vertices) {
    low = low.cwiseMin(x);
    high = high.cwiseMax(x);
  }
  return ((low + high) / 2).cast<double>();
}

// Hair without a body still needs a skin to collide with. The ball's radius is that of the scalp on which roots lie.
TEST(AssembleGroom, fits_a_skull_to_the_roots_where_there_is_no_body) {
  for (const double radius : {0.08, 0.095, 0.11}) {
    const auto imported = assemble_groom(def_of(scalp_strands(Vec3(0.3, 1.6, -0.2), radius, 2000)));
    ASSERT_TRUE(imported) << imported.error();
    const Body& body = imported->groom.body;
    EXPECT_TRUE(body.fitted_from_roots);
    EXPECT_EQ(body.bone_weights.size(), body.mesh.vertices.size());
    const Vec3 middle = middle_of(body.mesh);
    for (const Vec3f& x : body.mesh.vertices) {
      EXPECT_NEAR((x.cast<double>() - middle).norm(), radius, 0.1 * radius);
    }
    EXPECT_NEAR(middle.x(), 0, 0.1 * radius);
    EXPECT_GT(middle.y(), 0.5 * radius) << "the head joint is at the base of the skull";
    EXPECT_LT(middle.y(), radius);
    EXPECT_DOUBLE_EQ(rooted_share(imported->groom), 1);
    EXPECT_EQ(validate(imported->groom), "");
    for (const std::string& warning : imported->warnings) EXPECT_THAT(warning, Not(HasSubstr("size of a head")));
  }
}

TEST(AssembleGroom, the_skull_fit_leaves_out_a_tail_whose_roots_are_in_mid_air) {
  ImportedStrands strands = scalp_strands(Vec3(0, 1.6, 0), 0.095, 1000);
  for (int i = 0; i < 200; ++i) {
    const Vec3f root(0.001f * static_cast<float>(i % 10), 1.62f + 0.001f * static_cast<float>(i / 10), -0.16f);
    append(strands, {root, root + Vec3f(0, -0.1f, -0.05f)});
  }
  const auto imported = assemble_groom(def_of(strands));
  ASSERT_TRUE(imported) << imported.error();
  const Groom& groom = imported->groom;
  for (std::size_t s = 0; s < groom.strand_count(); ++s) EXPECT_EQ(groom.strands[s].rooted, s < 1000) << s;
}

TEST(AssembleGroom, each_file_becomes_a_group_and_files_of_one_name_share_one) {
  GroomDef def = def_of(scalp_strands(Vec3::Zero(), 0.09, 300));
  def.files.push_back({scalp_strands(Vec3::Zero(), 0.09, 100), "tail"});
  def.files.push_back({scalp_strands(Vec3::Zero(), 0.09, 50), "hair"});
  def.hairs_in_all = 90'000;
  const auto imported = assemble_groom(def);
  ASSERT_TRUE(imported) << imported.error();
  EXPECT_THAT(imported->groom.group_names, ElementsAre("hair", "tail"));
  std::map<int, int> counts;
  for (const StrandProperties& strand : imported->groom.strands) {
    ++counts[strand.group];
    // The 90 000 hairs are shared by 450 strands.
    EXPECT_FLOAT_EQ(strand.hair_count, 200);
  }
  EXPECT_EQ(counts[0], 350);
  EXPECT_EQ(counts[1], 100);
}

TEST(AssembleGroom, refuses_more_groups_than_a_groom_has) {
  GroomDef def;
  for (std::size_t i = 0; i <= GroomLimits{}.group_count_max; ++i)
    def.files.push_back({scalp_strands(Vec3::Zero(), 0.09, 10), std::to_string(i)});
  EXPECT_FALSE(assemble_groom(def));
}

TEST(AssembleGroom, a_size_that_is_no_heads_is_warned_of_with_a_unit_that_mends_it) {
  // The ball's radius is 0.95 times this in units of the file, where a head has some 0.1 m.
  for (const double size : {0.01, 0.4, 25.0, 1000.0}) {
    GroomDef def = def_of(scalp_strands(Vec3(size, 15 * size, 0), 0.95 * size, 1000, size));
    // A groom reaches 10 m at most: larger ones are refused with this reason.
    auto imported = assemble_groom(def);
    // This unit gives the ball a radius of nearly 0.3 m, three times that of a head, which is accepted with a
    // warning.
    if (!imported) {
      def.placement.unit_m = 0.3 / size;
      imported = assemble_groom(def);
    }
    ASSERT_TRUE(imported) << imported.error();
    const auto warning = std::ranges::find_if(
        imported->warnings, [](const std::string& text) { return text.find("--unit ") != std::string::npos; });
    ASSERT_NE(warning, imported->warnings.end()) << size;
    def.placement.unit_m = std::stod(warning->substr(warning->find("--unit ") + 7));
    const auto again = assemble_groom(def);
    ASSERT_TRUE(again) << again.error();
    for (const std::string& text : again->warnings) EXPECT_THAT(text, Not(HasSubstr("--unit")));
  }
}

TEST(AssembleGroom, strands_in_mid_air_are_not_rooted) {
  ImportedStrands strands = scalp_strands(Vec3::Zero(), 0.09, 500);
  // The ball has a radius of 0.09 m: strands begin on it, nowhere, above it and below it.
  append(strands, {Vec3f(0, 0.09f, 0)});
  append(strands, {});
  append(strands, {Vec3f(0, 0.15f, 0), Vec3f(0, 0.2f, 0)});
  append(strands, {Vec3f(0, 0.02f, 0), Vec3f(0, 0.2f, 0)});
  const auto imported = assemble_groom(def_of(strands));
  ASSERT_TRUE(imported) << imported.error();
  const Groom& groom = imported->groom;
  ASSERT_EQ(groom.strand_count(), 504u);
  EXPECT_TRUE(groom.strands[500].rooted);
  EXPECT_FALSE(groom.strands[501].rooted) << "without a point";
  EXPECT_FALSE(groom.strands[502].rooted) << "6 cm above the skin";
  EXPECT_FALSE(groom.strands[503].rooted) << "7 cm below the skin";
}

TEST(AssembleGroom, says_so_when_no_strand_is_on_the_body) {
  GroomDef def = def_of(scalp_strands(Vec3::Zero(), 0.09, 500));
  def.body = TriangleMesh{{{1, 0, 0}, {1.1f, 0, 0}, {1, 0.1f, 0}}, {{0, 1, 2}}};
  const auto imported = assemble_groom(def);
  ASSERT_TRUE(imported) << imported.error();
  EXPECT_THAT(imported->warnings, Contains(HasSubstr("no strand begins on the skin")));
}

TEST(AssembleGroom, body_and_strands_in_different_axes_and_units_meet) {
  // The body is a ball in centimetres that faces -z, and the strands are in metres and face +x. Both lie off the
  // origin.
  const auto fitted = assemble_groom(def_of(scalp_strands(Vec3::Zero(), 0.09, 500)));
  ASSERT_TRUE(fitted);
  TriangleMesh ball = fitted->groom.body.mesh;
  const Vec3 middle = middle_of(ball);
  // In the head's axes the skull's middle is at (0.02, 1.6, 0.3).
  const Vec3 at(0.02, 1.6, 0.3);
  for (Vec3f& x : ball.vertices) {
    const Vec3 head = x.cast<double>() - middle + at;
    x = (100 * Vec3(-head.x(), head.y(), -head.z())).cast<float>();
  }
  ImportedStrands strands = scalp_strands(at, 0.09, 500);
  for (Vec3f& x : strands.points) x = Vec3f(x.z(), x.y(), -x.x());
  GroomDef def = def_of(strands);
  def.placement.face = Axis::plus_x;
  def.body = ball;
  def.body_placement = Placement{Axis::plus_y, Axis::minus_z, 0.01, {}};
  const auto imported = assemble_groom(def);
  ASSERT_TRUE(imported) << imported.error();
  EXPECT_DOUBLE_EQ(rooted_share(imported->groom), 1);
  const MeshQuery skin(imported->groom.body.mesh);
  for (std::size_t s = 0; s < imported->groom.strand_count(); ++s) {
    EXPECT_LT(skin.closest(imported->groom.strand_points(s)[0].cast<double>()).distance, 0.005);
  }
}

TEST(AssembleGroom, a_given_origin_is_the_head_joint) {
  GroomDef def = def_of(scalp_strands(Vec3(0, 2, 0), 0.09, 300));
  def.placement.origin = Vec3(0.01, 1.9, 0.02);
  const auto imported = assemble_groom(def);
  ASSERT_TRUE(imported) << imported.error();
  const Vec3f moved = imported->groom.points[5] - def.files[0].strands.points[5];
  EXPECT_LT((moved - Vec3f(-0.01f, -1.9f, -0.02f)).norm(), 1e-5f);
  EXPECT_THAT(imported->warnings, Not(Contains(HasSubstr("estimated"))));
}

TEST(AssembleGroom, nothing_is_mirrored_by_any_axes) {
  for (int up = 0; up < 6; ++up) {
    for (int face = 0; face < 6; ++face) {
      if (up / 2 == face / 2) continue;
      const Mat3 rotation = rotation_to_head(static_cast<Axis>(up), static_cast<Axis>(face));
      EXPECT_DOUBLE_EQ(rotation.determinant(), 1);
      EXPECT_EQ(rotation * direction(static_cast<Axis>(up)), Vec3::UnitY());
      EXPECT_EQ(rotation * direction(static_cast<Axis>(face)), Vec3::UnitZ());
    }
  }
}

// Each line gives one flag a value that makes no sense, such as a unit of 0 or a face along the axis that is up.
TEST(AssembleGroom, refuses_flags_that_make_no_sense) {
  const auto refused = [](auto change) {
    GroomDef def = def_of(scalp_strands(Vec3::Zero(), 0.09, 100));
    change(def);
    const auto imported = assemble_groom(def);
    return imported ? std::string() : imported.error();
  };
  static constexpr double kNan = std::numeric_limits<double>::quiet_NaN();
  EXPECT_THAT(refused([](GroomDef& d) { d.placement.face = Axis::minus_y; }), HasSubstr("same axis"));
  for (const double unit : {0.0, -1.0, kNan, HUGE_VAL})
    EXPECT_THAT(refused([unit](GroomDef& d) { d.placement.unit_m = unit; }), HasSubstr("unit"));
  EXPECT_NE(refused([](GroomDef& d) { d.placement.unit_m = 1e30; }), "") << "10 m and more from the head";
  EXPECT_THAT(refused([](GroomDef& d) { d.placement.origin = Vec3(kNan, 0, 0); }), HasSubstr("origin"));
  EXPECT_THAT(refused([](GroomDef& d) {
                d.body = TriangleMesh{{{0, 0, 0}}, {}};
                d.body_placement = Placement{Axis::plus_y, Axis::plus_z, 0, {}};
              }),
              HasSubstr("body"));
  for (const double hairs : {0.0, kNan, 1e12}) EXPECT_NE(refused([hairs](GroomDef& d) { d.hairs_in_all = hairs; }), "");
  EXPECT_NE(refused([](GroomDef& d) { d.root_length_m = kNan; }), "");
  EXPECT_NE(refused([](GroomDef& d) { d.rooted_distance_m = -1; }), "");
  EXPECT_NE(refused([](GroomDef& d) { d.files.clear(); }), "");
  EXPECT_NE(refused([](GroomDef& d) { d.files[0].strands = ImportedStrands{}; }), "");
}

// A ball cannot be fitted to so few points or to points on a line.
TEST(AssembleGroom, few_strands_or_roots_in_a_plane_still_make_a_valid_groom) {
  for (const std::size_t count : {1, 2, 3, 4, 5, 8}) {
    ImportedStrands strands;
    for (std::size_t s = 0; s < count; ++s) {
      const auto x = 0.01f * static_cast<float>(s);
      append(strands, {Vec3f(x, 0, 0), Vec3f(x, 0.1f, 0)});
    }
    const auto imported = assemble_groom(def_of(strands));
    ASSERT_TRUE(imported) << imported.error();
    EXPECT_EQ(validate(imported->groom), "");
  }
}

struct RealGroom {
  const char* name;
  std::vector<const char*> files;
  StrandDecoder* decode;
  Placement placement;
  // The file of the body; null for a groom without one.
  const char* body;
  std::optional<Placement> body_placement;
  std::size_t strand_count;
};

std::vector<RealGroom> real_grooms() {
  return {
      {"yuksel_straight",
       {"straight.hair"},
       decode_yuksel_hair,
       {Axis::plus_z, Axis::plus_y, 0.0033, {}},
       nullptr,
       {},
       10'000},
      {"amd_ponytail",
       {"back.tfx", "front_top.tfx", "side.tfx", "tail.tfx"},
       decode_tressfx,
       {Axis::plus_y, Axis::minus_z, 0.00254, {}},
       "amd_ponytail_head_max4.obj",
       Placement{Axis::plus_y, Axis::plus_z, 0.00254, {}},
       4'933},
      {"harolongo",
       {"harolongo.data"},
       decode_usc_data,
       {Axis::plus_y, Axis::plus_z, 0.01, {}},
       "digitalsalon_female_body_scaled.obj",
       {},
       7'905},
      {"sintel", {"SintelHairOriginal-sintel_hair.16points.tfx"}, decode_tressfx, {}, "sintel.obj", {}, 11'400},
  };
}

Result<GroomDef> read_real(const RealGroom& real) {
  GroomDef def;
  def.name = real.name;
  def.placement = real.placement;
  for (const char* file : real.files) {
    const auto path = test::shared_data() / "hair" / real.name / file;
    auto strands = real.decode(test::file_bytes(path));
    if (!strands) return Refusal(path.string() + ": " + strands.error());
    def.files.push_back({std::move(*strands), path.stem().string()});
  }
  if (real.body) {
    auto mesh = decode_obj(test::file_text(test::shared_data() / "head" / real.body));
    if (!mesh) return Refusal(std::string(real.body) + ": " + mesh.error());
    def.body = std::move(*mesh);
    def.body_placement = real.body_placement;
  }
  return def;
}

class AssembleRealGrooms : public testing::Test {
 protected:
  void SetUp() override {
    if (!std::filesystem::exists(test::shared_data() / "hair"))
      GTEST_SKIP() << "no real hairstyles at " << test::shared_data();
  }
};

TEST_F(AssembleRealGrooms, strands_of_all_four_begin_on_the_body) {
  for (const RealGroom& real : real_grooms()) {
    const auto def = read_real(real);
    ASSERT_TRUE(def) << def.error();
    const auto imported = assemble_groom(*def);
    ASSERT_TRUE(imported) << real.name << ": " << imported.error();
    const Groom& groom = imported->groom;
    EXPECT_EQ(groom.strand_count(), real.strand_count) << real.name;
    EXPECT_EQ(validate(groom), "") << real.name;
    for (const std::string& group : groom.group_names) {
      std::printf("%s: rooted share of '%s': %.4f\n", real.name, group.c_str(), rooted_share(groom, group));
      // Real hair begins a little above or below the skin of its body, so a few strands may miss it.
      EXPECT_GT(rooted_share(groom, group), 0.95) << real.name << ' ' << group;
    }
    for (const std::string& warning : imported->warnings) EXPECT_THAT(warning, Not(HasSubstr("size of a head")));
  }
}

// The tail begins in a hair band behind the head, which the bust has as three rings of their own.
TEST_F(AssembleRealGrooms, the_ponytails_tail_hangs_in_mid_air_once_its_hair_band_is_taken_away) {
  auto def = read_real(real_grooms()[1]);
  ASSERT_TRUE(def) << def.error();
  TriangleMesh& mesh = *def->body;
  const std::size_t removed = std::erase_if(mesh.triangles, [&](const auto& triangle) {
    return std::ranges::all_of(triangle, [&](std::uint32_t v) {
      const Vec3f& x = mesh.vertices[v];
      // The box, in units of the file (0.1 inch), contains the hair band alone. Its three rings have 800 triangles
      // each.
      return std::abs(x.x()) < 7 && x.y() > 73 && x.y() < 86 && x.z() < -41.8f;
    });
  });
  ASSERT_EQ(removed, 3 * 800u);
  const auto imported = assemble_groom(*def);
  ASSERT_TRUE(imported) << imported.error();
  EXPECT_EQ(rooted_share(imported->groom, "tail"), 0);
  for (const char* group : {"back", "front_top", "side"})
    EXPECT_GT(rooted_share(imported->groom, group), 0.95) << group;
}

}  // namespace
}  // namespace hairnet
