#include <gmock/gmock.h>

#include <cmath>
#include <functional>
#include <map>
#include <numbers>
#include <string>

#include "client/assets/import/guess_unit.hpp"
#include "client/assets/import/placement.hpp"
#include "client/assets/import/skull_fit.hpp"
#include "client/assets/made/made.hpp"

namespace hairnet {
namespace {

using testing::Contains;
using testing::HasSubstr;
using testing::Not;

// Says which directions from the middle of a ball have hair. The whole scalp goes down to 25 degrees below the middle,
// and spares the face.
struct Cut {
  const char* name;
  std::function<bool(const Vec3&)> has;
  // Noise of this size moves each root along the radius.
  double noise_m = 0;
};

bool whole(const Vec3& d) {
  return d.y() > -0.42 && !(d.z() > 0.5 && d.y() < 0.5);
}

const Vec3 kMiddle(0.02, 1.6, -0.03);

std::vector<Cut> cuts() {
  std::vector<Cut> all;
  for (const double noise_m : {0.0, 0.001}) {
    all.push_back({"whole scalp", whole, noise_m});
    all.push_back({"half scalp", [](const Vec3& d) { return whole(d) && d.x() > 0; }, noise_m});
    all.push_back({"sides shaved", [](const Vec3& d) { return whole(d) && std::abs(d.x()) < 0.6; }, noise_m});
    all.push_back({"strip 2 cm wide", [](const Vec3& d) { return whole(d) && std::abs(d.x()) < 0.11; }, noise_m});
    all.push_back({"nape only",
                   [](const Vec3& d) { return whole(d) && d.z() < 0 && d.y() < 0.1 && std::abs(d.x()) < 0.5; },
                   noise_m});
  }
  return all;
}

// Returns an even spread of numbers from -1 to 1, the same in each run: multiples of the golden ratio.
double noise(std::size_t i) {
  return 2 * std::fmod(0.6180339887498949 * static_cast<double>(i + 1), 1) - 1;
}

void append(ImportedStrands& strands, const Vec3& root, const Vec3& outwards) {
  for (int i = 0; i < 3; ++i) strands.points.push_back((root + 0.05 * i * outwards).cast<float>());
  strands.strand_begin.push_back(static_cast<std::uint32_t>(strands.points.size()));
}

ImportedStrands strands_of(const Cut& cut, double radius) {
  ImportedStrands strands;
  constexpr std::size_t kCount = 6000;
  // The directions lie on a Fibonacci spiral, which spreads them evenly over the ball.
  const double golden = std::numbers::pi * (3 - std::sqrt(5.0));
  for (std::size_t i = 0; i < kCount; ++i) {
    const double y = 1 - 2 * (static_cast<double>(i) + 0.5) / kCount, ring = std::sqrt(1 - y * y);
    const double angle = golden * static_cast<double>(i);
    const Vec3 d(ring * std::sin(angle), y, ring * std::cos(angle));
    if (cut.has(d)) append(strands, kMiddle + (radius + cut.noise_m * noise(i)) * d, d);
  }
  return strands;
}

// A single line of roots goes from the forehead over the top to the nape.
ImportedStrands one_root_wide(double radius, double noise_m) {
  ImportedStrands strands;
  for (std::size_t i = 0; i < 60; ++i) {
    // The angle begins 50 degrees above the horizon in front, is 90 at the top, and ends 47 degrees below the
    // horizon behind.
    const double angle = (50 + 3 * static_cast<double>(i)) * std::numbers::pi / 180;
    const Vec3 d(0, std::sin(angle), std::cos(angle));
    append(strands, kMiddle + (radius + noise_m * noise(i)) * d + Vec3(noise_m * noise(7 * i), 0, 0), d);
  }
  return strands;
}

GroomDef def_of(ImportedStrands strands) {
  GroomDef def;
  def.name = "cut";
  def.files.push_back({std::move(strands), "hair"});
  return def;
}

// Returns where the import has put the head joint, in the coordinates of the file.
Vec3 joint_of(const GroomDef& def, const Groom& groom) {
  return (def.files[0].strands.points[0] - groom.points[0]).cast<double>();
}

double radius_of(const Body& body) {
  Vec3f low = body.mesh.vertices.front(), high = low;
  for (const Vec3f& x : body.mesh.vertices) {
    low = low.cwiseMin(x);
    high = high.cwiseMax(x);
  }
  return static_cast<double>((high - low).mean()) / 2;
}

// Returns SkullFit::joint() of a ball.
Vec3 joint_of_ball(double radius) {
  return kMiddle + radius * Vec3(0, -0.8, -0.1);
}

void expect_head(const std::string& name, const GroomDef& def, double radius) {
  const auto imported = assemble_groom(def);
  ASSERT_TRUE(imported) << name << ": " << imported.error();
  EXPECT_LT((joint_of(def, imported->groom) - joint_of_ball(radius)).norm(), 0.02) << name << ' ' << radius;
  EXPECT_NEAR(radius_of(imported->groom.body), radius, 0.15 * radius) << name << ' ' << radius;
  EXPECT_THAT(imported->warnings, Not(Contains(HasSubstr("--unit")))) << name << ' ' << radius;
  for (const StrandProperties& strand : imported->groom.strands) EXPECT_TRUE(strand.rooted) << name;
}

TEST(SkullOfRoots, has_the_size_of_a_head_for_any_part_of_the_scalp) {
  for (const double radius : {0.08, 0.09, 0.1}) {
    for (const Cut& cut : cuts()) expect_head(cut.name, def_of(strands_of(cut, radius)), radius);
    for (const double noise_m : {0.0, 0.001})
      expect_head("strip one root wide", def_of(one_root_wide(radius, noise_m)), radius);
  }
}

TEST(SkullOfRoots, that_do_not_determine_its_size_give_a_warning) {
  const auto warnings = [](ImportedStrands strands) { return assemble_groom(def_of(std::move(strands)))->warnings; };
  const std::vector<Cut> all = cuts();
  // The parts 0 to 4 are cuts() without noise, and 5 to 9 the same with noise. Strips and the nape show too little.
  for (const std::size_t part : {0, 1, 2, 5, 6, 7})
    EXPECT_THAT(warnings(strands_of(all[part], 0.09)), Not(Contains(HasSubstr("too little of a head")))) << part;
  for (const std::size_t part : {3, 4, 8, 9})
    EXPECT_THAT(warnings(strands_of(all[part], 0.09)), Contains(HasSubstr("too little of a head"))) << part;
  EXPECT_THAT(warnings(one_root_wide(0.09, 0.001)), Contains(HasSubstr("too little of a head")));
}

TEST(SkullOfRoots, the_unit_of_a_part_of_a_scalp_is_guessed_as_that_of_a_whole_one) {
  for (const double unit_m : {1.0, 0.01, 0.001, 0.0254}) {
    std::vector<ImportedStrands> files{one_root_wide(0.09, 0.001)};
    for (const Cut& cut : cuts()) files.push_back(strands_of(cut, 0.09));
    for (const ImportedStrands& strands : files) {
      std::vector<Vec3> roots;
      for (std::size_t s = 0; s < strands.strand_count(); ++s)
        roots.emplace_back(strands.points[strands.strand_begin[s]].cast<double>() / unit_m);
      EXPECT_DOUBLE_EQ(guess_unit(roots).m, unit_m) << roots.size();
    }
  }
}

// A cap of roots lies between two usual units: with 0.0254 m it reaches over 7 cm, with 0.1 m over 26 cm. Of units that
// people give, the one that makes it a scalp must be believed, however far it is from the usual one.
TEST(SkullOfRoots, a_unit_that_makes_a_part_a_scalps_size_is_believed_beside_a_usual_one) {
  std::vector<Vec3> roots;
  for (int x = -5; x <= 5; ++x) {
    for (int z = -5; z <= 5; ++z) {
      const Vec3 across(0.26 * x, 0, 0.26 * z);
      if (across.norm() < 1.32) roots.push_back(across + Vec3(0, std::sqrt(1.4 * 1.4 - across.squaredNorm()), 0));
    }
  }
  const UnitGuess guess = guess_unit(roots);
  ASSERT_FALSE(guess.is_sure);
  EXPECT_TRUE(guess.allows(0.07)) << guess.m;
  EXPECT_TRUE(guess.allows(guess.m));
  EXPECT_FALSE(guess.allows(1));
  EXPECT_FALSE(guess.allows(0.001));
}

// The made bust, moved to where the file has it.
TriangleMesh bust(const Vec3f& at) {
  TriangleMesh mesh = make_bust().mesh;
  for (Vec3f& x : mesh.vertices) x += at;
  return mesh;
}

// A made hairstyle in the form of a strand file; only strands whose root `has` accepts.
ImportedStrands exported(const char* style, const std::function<bool(const Vec3f&)>& has, const Vec3f& at) {
  static std::map<std::string, Groom> made;
  Groom& groom = made[style];
  if (groom.points.empty()) {
    HairstyleOptions options;
    options.strand_count = 1200;
    groom = *make_hairstyle(style, options);
  }
  ImportedStrands strands;
  for (std::size_t s = 0; s < groom.strand_count(); ++s) {
    const auto points = groom.strand_points(s);
    if (points.empty() || !groom.strands[s].rooted || !has(points[0])) continue;
    for (const Vec3f& x : points) strands.points.emplace_back(x + at);
    strands.strand_begin.push_back(static_cast<std::uint32_t>(strands.points.size()));
  }
  return strands;
}

class HairstylesOfOneHead : public testing::Test {
 protected:
  static std::vector<ImportedStrands> styles() {
    const auto all = [](const Vec3f&) { return true; };
    std::vector<ImportedStrands> out;
    for (const char* style : {"short", "bob", "plait", "ponytail"}) out.push_back(exported(style, all, kAt));
    // The last two have shaved sides, and an undercut.
    out.push_back(exported(
        "short", [](const Vec3f& x) { return std::abs(x.x()) < 0.06f; }, kAt));
    out.push_back(exported(
        "short", [](const Vec3f& x) { return x.y() > 0.05f; }, kAt));
    return out;
  }
  // Returns hair on still less of the scalp: a strip, the back and one side.
  static std::vector<ImportedStrands> parts() {
    std::vector<ImportedStrands> out;
    out.push_back(exported(
        "short", [](const Vec3f& x) { return std::abs(x.x()) < 0.01f; }, kAt));
    out.push_back(exported(
        "short", [](const Vec3f& x) { return x.z() < -0.02f; }, kAt));
    out.push_back(exported(
        "short", [](const Vec3f& x) { return x.x() > 0; }, kAt));
    return out;
  }
  static Vec3 joint(ImportedStrands strands, bool with_body) {
    GroomDef def = def_of(std::move(strands));
    if (with_body) def.body = bust(kAt);
    const auto imported = assemble_groom(def);
    EXPECT_TRUE(imported) << imported.error();
    EXPECT_THAT(imported->warnings, Contains(HasSubstr(with_body ? "from the body's skull" : "from the roots")));
    return joint_of(def, imported->groom);
  }
  // The head joint of the bust and of all hairstyles in the coordinates of the files.
  static inline const Vec3f kAt{0.3f, 1.5f, -0.2f};
};

TEST_F(HairstylesOfOneHead, have_one_joint_over_its_body) {
  const Vec3 first = joint(styles().front(), true);
  for (const ImportedStrands& strands : styles()) EXPECT_LT((joint(strands, true) - first).norm(), 1e-6);
  for (const ImportedStrands& strands : parts()) EXPECT_LT((joint(strands, true) - first).norm(), 1e-6);
}

TEST_F(HairstylesOfOneHead, have_joints_within_a_centimetre_without_it) {
  const Vec3 first = joint(styles().front(), false);
  for (const ImportedStrands& strands : styles()) EXPECT_LT((joint(strands, false) - first).norm(), 0.01);
  for (const ImportedStrands& strands : parts()) EXPECT_LT((joint(strands, false) - first).norm(), 0.02);
  EXPECT_LT((joint(styles().front(), true) - first).norm(), 0.01) << "and near the body's";
}

TEST_F(HairstylesOfOneHead, strands_that_begin_on_its_back_are_counted) {
  GroomDef def = def_of(styles().front());
  const std::size_t of_head = def.files[0].strands.strand_count();
  for (int i = 0; i < 100; ++i) {
    // These roots are 10 to 30 cm below the head joint. Roots more than kFarBelow_m, 7 cm, below it are counted
    // (assemble_groom.cpp).
    const double down = 0.1 + 0.002 * i;
    append(def.files[0].strands, kAt.cast<double>() + Vec3(0.01 * (i % 5), -down, -0.08), Vec3(0, -0.7, -0.7));
  }
  const Vec3 without = joint(styles().front(), false);
  for (const bool with_body : {false, true}) {
    if (with_body) def.body = bust(kAt);
    const auto imported = assemble_groom(def);
    ASSERT_TRUE(imported) << imported.error();
    EXPECT_THAT(imported->warnings, Contains(HasSubstr(std::to_string(of_head + 100) + " strands (")));
    EXPECT_THAT(imported->warnings, Contains(HasSubstr("as on a back")));
    EXPECT_THAT(imported->warnings, Not(Contains(HasSubstr("--unit"))));
    EXPECT_LT((joint_of(def, imported->groom) - without).norm(), 0.02);
  }
  def.files[0].strands = styles().front();
  EXPECT_THAT(assemble_groom(def)->warnings, Not(Contains(HasSubstr("as on a back"))));
}

TEST(SkullOfMesh, is_found_by_area_however_fine_its_parts_are) {
  const TriangleMesh mesh = bust(Vec3f::Zero());
  // Each triangle of one side is divided into three.
  TriangleMesh fine = mesh;
  fine.triangles.clear();
  for (const auto& [a, b, c] : mesh.triangles) {
    if (mesh.vertices[a].x() < 0) {
      fine.triangles.push_back({a, b, c});
      continue;
    }
    const auto middle = static_cast<std::uint32_t>(fine.vertices.size());
    fine.vertices.push_back((fine.vertices[a] + fine.vertices[b] + fine.vertices[c]) / 3);
    for (const auto& [p, q] : {std::pair{a, b}, std::pair{b, c}, std::pair{c, a}})
      fine.triangles.push_back({p, q, middle});
  }
  const auto one = skull_of_mesh(mesh), other = skull_of_mesh(fine);
  ASSERT_TRUE(one && other);
  EXPECT_LT((one->joint() - other->joint()).norm(), 0.002);
  EXPECT_FALSE(skull_of_mesh({}));
  EXPECT_FALSE(skull_of_mesh({{{0, 0, 0}, {1, 0, 0}, {0, 1, 0}}, {{0, 1, 2}}}));
}

}  // namespace
}  // namespace hairnet
