#include <gtest/gtest.h>
#include <unistd.h>

#include <cmath>
#include <filesystem>
#include <fstream>
#include <nlohmann/json.hpp>

#include "client/assets/fitted_hair.hpp"
#include "client/assets/import/guess_placement.hpp"
#include "client/assets/import/obj.hpp"
#include "client/assets/import_hair.hpp"
#include "client/assets/load_groom.hpp"
#include "client/assets/made/made.hpp"
#include "client/tools/groom/commands.hpp"
#include "client/viewer/characters/characters_of_files.hpp"
#include "core/geometry/mesh_query.hpp"

namespace hairnet::viewer {
namespace {

// A made groom as files of another program have it: in other axes, another unit and with another origin.
struct Foreign {
  std::vector<StrandFile> files;
  TriangleMesh body;
};

// Returns a point of head space in the coordinates of a file, whose origin is 1.6 m below the head joint, on the floor.
Vec3f to_file(const Placement& placement, const Vec3f& head) {
  const Mat3 back = rotation_to_head(placement.up, placement.face).transpose();
  return (back * (head.cast<double>() + Vec3(0, 1.6, 0)) / placement.unit_m).cast<float>();
}

Groom made(const char* style) {
  HairstyleOptions options;
  options.strand_count = 600;
  return *make_hairstyle(style, options);
}

Foreign foreign(const Groom& groom, const Placement& strands, const Placement& body) {
  Foreign out;
  out.files.resize(1);
  ImportedStrands& imported = out.files[0].strands;
  for (std::size_t s = 0; s < groom.strand_count(); ++s) {
    if (!groom.strands[s].rooted) continue;
    for (const Vec3f& p : groom.strand_points(s)) imported.points.push_back(to_file(strands, p));
    imported.strand_begin.push_back(static_cast<std::uint32_t>(imported.points.size()));
  }
  out.body = groom.body.mesh;
  for (Vec3f& v : out.body.vertices) v = to_file(body, v);
  return out;
}

// Strands and the body they were made on as two .obj files, in a folder of their own.
class ImportedFiles : public ::testing::Test {
 protected:
  void SetUp() override {
    folder_ = std::filesystem::temp_directory_path() / ("hairnet_import_" + std::to_string(::getpid()));
    std::filesystem::create_directories(folder_);
    const Foreign there = foreign(made("bob"), {}, {});
    std::ofstream hair(hair_file());
    for (const Vec3f& p : there.files[0].strands.points) hair << "v " << p.transpose() << '\n';
    const std::vector<std::uint32_t>& begin = there.files[0].strands.strand_begin;
    for (std::size_t s = 0; s + 1 < begin.size(); ++s) {
      hair << 'l';
      for (std::uint32_t i = begin[s]; i < begin[s + 1]; ++i) hair << ' ' << i + 1;
      hair << '\n';
    }
    std::ofstream body(body_file());
    for (const Vec3f& p : there.body.vertices) body << "v " << p.transpose() << '\n';
    for (const auto& t : there.body.triangles) body << "f " << t[0] + 1 << ' ' << t[1] + 1 << ' ' << t[2] + 1 << '\n';
  }
  void TearDown() override { std::filesystem::remove_all(folder_); }
  [[nodiscard]] std::string hair_file() const { return (folder_ / "hair.obj").string(); }
  [[nodiscard]] std::string body_file() const { return (folder_ / "body.obj").string(); }

 private:
  std::filesystem::path folder_;
};

TEST_F(ImportedFiles, warnings_about_strands_name_their_file) {
  ::testing::internal::CaptureStderr();
  const Result<Groom> groom = load_hair({{body_file(), hair_file()}, {}, {}, {}});
  const std::string said = ::testing::internal::GetCapturedStderr();
  ASSERT_TRUE(groom) << groom.error();
  EXPECT_NE(said.find("hair.obj: taken as"), std::string::npos) << said;
  EXPECT_NE(said.find("body.obj: taken as"), std::string::npos) << said;
  EXPECT_NE(said.find("hair.obj: the head joint is estimated from the body's skull"), std::string::npos) << said;
}

TEST_F(ImportedFiles, of_a_folder_or_a_pattern_are_parts_of_one_head) {
  const std::string folder = std::filesystem::path(hair_file()).parent_path().string();
  std::ofstream(folder + "/notes.txt") << "not hair";
  const std::vector<std::string> both{body_file(), hair_file()};
  const auto files_of = [](const std::string& name) { return hair_files_of(std::array{name}); };
  EXPECT_EQ(*files_of(folder), both);
  EXPECT_EQ(*files_of(folder + "/*.obj"), both);
  EXPECT_EQ(*files_of(folder + "/h?ir.obj"), std::vector{hair_file()});
  EXPECT_EQ(*files_of("nowhere.abc"), std::vector<std::string>{"nowhere.abc"}) << "who reads it says what is wrong";
  EXPECT_NE(files_of(folder + "/*.abc").error().find("*.abc: no file has such a name"), std::string::npos);
  std::filesystem::create_directory(folder + "/empty");
  EXPECT_NE(files_of(folder + "/empty").error().find("a folder without files"), std::string::npos);
}

TEST_F(ImportedFiles, are_told_of_as_json_too) {
  groom::ImportOptions options;
  options.files.files = {hair_file()};
  options.out = hair_file() + ".groom";
  options.json = true;
  // The file has at most 600 strands. They become guides, between which others are made up to this number.
  options.import.fill = 2000;
  ::testing::internal::CaptureStdout();
  const Result<void> done = groom::import_groom(options);
  const std::string printed = ::testing::internal::GetCapturedStdout();
  ASSERT_TRUE(done) << done.error();
  const nlohmann::json announced = nlohmann::json::parse(printed);
  EXPECT_EQ(announced["strands"], 2000);
  EXPECT_EQ(announced["groups"][0]["strands"], 2000);
  EXPECT_EQ(announced["up"], "+y");
  EXPECT_NE(announced["remarks"].dump().find("are guides, between which"), std::string::npos) << printed;
  EXPECT_EQ(load_groom(options.out)->strand_count(), 2000U);
}

TEST_F(ImportedFiles, have_as_many_names_of_groups_as_there_are_files) {
  groom::ImportOptions options;
  options.files.files = {hair_file()};
  options.files.groups = {"front", "back"};
  options.out = hair_file() + ".groom";
  EXPECT_EQ(groom::import_groom(options).error(), "--group: 2 names for 1 files; give as many, or none");
}

// Both programs guess units and axes. If they guessed differently, hair would look right in one and wrong in the
// other.
TEST_F(ImportedFiles, lie_in_the_viewer_where_hairnet_groom_puts_them) {
  const std::string out = hair_file() + ".groom";
  groom::ImportOptions options;
  options.files.files = {hair_file()};
  options.out = out;
  ::testing::internal::CaptureStderr();
  ::testing::internal::CaptureStdout();
  const Result<void> done = groom::import_groom(options);
  ::testing::internal::GetCapturedStdout();
  const std::string by_groom = ::testing::internal::GetCapturedStderr();
  ASSERT_TRUE(done) << done.error();
  ::testing::internal::CaptureStderr();
  const std::array<std::string, 1> files{hair_file()};
  const auto characters = characters_of_files(files);
  const std::string by_viewer = ::testing::internal::GetCapturedStderr();
  ASSERT_TRUE(characters) << characters.error();
  EXPECT_EQ(by_groom, by_viewer) << "the same warnings";
  const Groom &seen = *characters->front().groom, written = *load_groom(out);
  ASSERT_EQ(seen.points.size(), written.points.size());
  for (std::size_t i = 0; i < seen.points.size(); ++i) EXPECT_LT((seen.points[i] - written.points[i]).norm(), 2e-4f);
}

TEST_F(ImportedFiles, are_distinguished_by_extensions_also_in_capitals) {
  const std::string hair = hair_file() + ".OBJ", motion = hair_file() + ".BVH";
  std::filesystem::copy_file(hair_file(), hair);
  std::ofstream(motion) << "HIERARCHY ROOT Head { OFFSET 0 150 0 CHANNELS 3 Zrotation Xrotation Yrotation JOINT Foot { "
                           "OFFSET 0 -150 0 } } MOTION Frames: 1 Frame Time: 0.1 0 0 0";
  ::testing::internal::CaptureStderr();
  const std::array<std::string, 2> files{hair, motion};
  const Result<std::vector<CharacterSetup>> characters = characters_of_files(files);
  const std::string said = ::testing::internal::GetCapturedStderr();
  ASSERT_TRUE(characters) << characters.error();
  // The skeleton has a height of 150 units, so a unit is guessed as 1 cm.
  EXPECT_NEAR(characters->front().motion.poses.front().head().position.y(), 1.5, 1e-6);
  EXPECT_NE(said.find(motion + ": the skeleton is 150 units tall"), std::string::npos) << said;
}

// A character with a place of its own stays there, and files get free places.
TEST_F(ImportedFiles, stand_beside_the_characters_that_are_named) {
  ViewOptions options;
  options.files = {hair_file()};
  CharacterOptions named;
  named.groom = "made:bob";
  named.motion = "made:still";
  named.hairstyle.strand_count = 60;
  options.characters = {named, named};
  options.characters[1].place = Place{5, 0, 0};
  ::testing::internal::CaptureStderr();
  const Result<std::vector<CharacterSetup>> characters = load_characters(options);
  ::testing::internal::GetCapturedStderr();
  ASSERT_TRUE(characters) << characters.error();
  ASSERT_EQ(characters->size(), 3u);
  const auto x_m = [&](std::size_t i) { return (*characters)[i].motion.poses.front().head().position.x(); };
  EXPECT_GT(x_m(2) - x_m(0), 0.5) << "one head inside another";
  EXPECT_NEAR(x_m(1), 5, 0.1);
}

constexpr std::array<const char*, 3> kStyles{"long_curly", "bob", "short"};

TEST(GuessPlacement, finds_axes_and_unit_of_hair_without_its_head) {
  for (const char* style : kStyles) {
    const Groom groom = made(style);
    for (const auto& [up, face, unit_m] :
         {std::tuple{Axis::plus_y, Axis::plus_z, 1.0}, std::tuple{Axis::plus_z, Axis::minus_y, 0.01},
          std::tuple{Axis::minus_x, Axis::plus_y, 0.0254}}) {
      const Placement placement{up, face, unit_m, {}};
      const Foreign hair = foreign(groom, placement, placement);
      const Result<Placement> guessed = guess_placement(hair.files);
      ASSERT_TRUE(guessed) << guessed.error();
      EXPECT_EQ(guessed->up, up) << style;
      EXPECT_EQ(guessed->face, face) << style;
      // Usual units differ by a factor of 2.5 and more, so a guess within a factor of 1.35 means the right one.
      EXPECT_NEAR(std::log(guessed->unit_m / unit_m), 0, 0.3) << style << ' ' << guessed->unit_m;
    }
  }
}

// Hair and body come from different programs. Each alone has a guess, and both together must meet.
TEST(GuessPlacement, a_body_in_other_axes_and_another_unit_comes_under_its_hair) {
  const Placement strands{Axis::plus_y, Axis::minus_z, 0.0254, {}}, body{Axis::plus_z, Axis::minus_y, 0.01, {}};
  const Foreign hair = foreign(made("bob"), strands, body);
  const auto together = guess_together(hair.files, hair.body);
  ASSERT_TRUE(together);
  EXPECT_EQ(together->body.up, body.up);
  EXPECT_EQ(together->body.face, body.face);
  EXPECT_EQ(together->body.unit_m, body.unit_m);
  EXPECT_EQ(together->strands.up, strands.up);
  EXPECT_EQ(together->strands.face, strands.face);
  EXPECT_EQ(together->strands.unit_m, strands.unit_m);
}

TEST(GuessPlacement, what_shows_no_head_is_refused) {
  EXPECT_FALSE(guess_placement({}));
  StrandFile file;
  for (int i = 0; i < 3; ++i) {
    file.strands.points.emplace_back(static_cast<float>(i), 0.0f, 0.0f);
    file.strands.strand_begin.push_back(static_cast<std::uint32_t>(file.strands.points.size()));
  }
  EXPECT_FALSE(guess_placement(std::span(&file, 1)));
  EXPECT_FALSE(guess_mesh_placement({}));
  TriangleMesh flat;
  for (int i = 0; i < 100; ++i) flat.vertices.emplace_back(static_cast<float>(i), 0.0f, 0.0f);
  // A line of 100 vertices has no head.
  EXPECT_FALSE(guess_mesh_placement(flat));
}

TEST(FittedHair, begins_on_the_skin_of_another_head_and_stays_off_its_inside) {
  TriangleMesh wide = make_bust().mesh;
  // The other head is the made one, but wider, higher and flatter.
  for (Vec3f& v : wide.vertices) v = Vec3f(1.15f * v.x(), 1.1f * v.y(), 0.95f * v.z());
  const Result<Groom> groom = fitted_hair(wide);
  ASSERT_TRUE(groom) << groom.error();
  const MeshQuery skin(wide);
  std::size_t inside = 0;
  for (std::size_t s = 0; s < groom->strand_count(); ++s) {
    const auto points = groom->strand_points(s);
    EXPECT_LT(skin.closest(points[0].cast<double>()).distance, 1e-5);
    for (const Vec3f& p : points.subspan(1)) inside += skin.inside(p.cast<double>());
  }
  EXPECT_LT(static_cast<double>(inside), 0.01 * static_cast<double>(groom->points.size()));
  EXPECT_FALSE(fitted_hair({}));
  TriangleMesh with_hat = made("short").body.mesh;
  for (Vec3f& v : with_hat.vertices) v.y() += 0.3f;
  const Result<Groom> refused = fitted_hair(with_hat);
  ASSERT_FALSE(refused);
  EXPECT_NE(refused.error().find("the highest part of the body is no skull"), std::string::npos) << refused.error();
}

TEST(ObjStrands, lines_are_strands_and_consecutive_edges_are_joined) {
  const auto strands = decode_obj_strands("v 0 0 0\nv 0 1 0\nv 0 2 0\nv 5 0 0\nv 5 1 0\nl 1 2\nl 2 3\nl 4 -1\n");
  ASSERT_TRUE(strands) << strands.error();
  ASSERT_EQ(strands->strand_count(), 2u);
  EXPECT_EQ(strands->strand_begin, (std::vector<std::uint32_t>{0, 3, 5}));
  EXPECT_EQ(strands->points[2].y(), 2);
  EXPECT_EQ(strands->points[4], Vec3f(5, 1, 0));
}

TEST(ObjStrands, refuses_what_is_not_there_and_finds_none_in_a_mesh) {
  EXPECT_FALSE(decode_obj_strands("v 0 0 0\nl 1 2\n"));
  EXPECT_FALSE(decode_obj_strands("v 0 0 0\nl 1\n"));
  EXPECT_FALSE(decode_obj_strands("v 0 0 nan\n"));
  const auto none = decode_obj_strands("v 0 0 0\nv 1 0 0\nv 0 1 0\nf 1 2 3\n");
  ASSERT_TRUE(none);
  EXPECT_EQ(none->strand_count(), 0u);
}

}  // namespace
}  // namespace hairnet::viewer
