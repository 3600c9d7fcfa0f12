#include <gmock/gmock.h>
#include <sys/stat.h>
#include <unistd.h>

#include <cstdio>
#include <filesystem>
#include <fstream>

#include "client/assets/body_file.hpp"
#include "client/assets/import/alembic.hpp"
#include "client/assets/import/head_files.hpp"
#include "client/assets/import_hair.hpp"
#include "client/assets/load_motion.hpp"
#include "client/files/read_file.hpp"
#include "tests/support/deepmimic_clip.hpp"

namespace hairnet {
namespace {

using testing::Each;
using testing::ElementsAre;
using testing::HasSubstr;
using testing::StartsWith;

class LoadedFiles : public testing::Test {
 protected:
  void SetUp() override {
    folder_ = std::filesystem::temp_directory_path() / ("hairnet_load_" + std::to_string(::getpid()));
    std::filesystem::create_directories(folder_);
  }
  void TearDown() override { std::filesystem::remove_all(folder_); }
  [[nodiscard]] std::string path(const char* name) const { return (folder_ / name).string(); }
  [[nodiscard]] std::string written(const char* name, const std::string& text) const {
    std::ofstream(path(name)) << text;
    return path(name);
  }

 private:
  std::filesystem::path folder_;
};

// The person is 155 cm tall to the head joint, and the head is 150 cm above the foot.
constexpr const char* kInCentimetres =
    "HIERARCHY ROOT Hips { OFFSET 0 95 0 CHANNELS 6 Xposition Yposition Zposition Zrotation Xrotation Yrotation "
    "JOINT Head { OFFSET 0 60 0 CHANNELS 3 Zrotation Xrotation Yrotation } "
    "JOINT Foot { OFFSET 0 -90 0 CHANNELS 0 } }\nMOTION Frames: 1 Frame Time: 0.1\n0 95 0 0 0 0 0 0 0\n";

TEST_F(LoadedFiles, a_motions_warnings_are_lines_with_its_file_on_stderr) {
  const std::string file = written("walk.BVH", kInCentimetres);
  testing::internal::CaptureStderr();
  const Result<Motion> motion = load_motion(file);
  const std::string said = testing::internal::GetCapturedStderr();
  ASSERT_TRUE(motion) << motion.error();
  EXPECT_NEAR(motion->poses[0].head().position.y(), 1.55, 1e-6);
  EXPECT_THAT(said, HasSubstr(file + ": the skeleton is 150 units tall, so a unit is taken as a centimetre"));
}

TEST_F(LoadedFiles, what_is_no_regular_file_is_refused_and_never_waited_for) {
  ASSERT_EQ(::mkfifo(path("pipe").c_str(), 0600), 0);
  // A pipe that nobody writes to would be waited for without end, and /dev/zero has no end.
  for (const std::string& file : {path("pipe"), std::string("/dev/zero"), std::string("/dev/tty")}) {
    const auto bytes = read_file(file);
    ASSERT_FALSE(bytes) << file;
  }
  EXPECT_THAT(read_file(path("pipe")).error(), HasSubstr("is a pipe or device"));
  EXPECT_THAT(read_file(path(".")).error(), HasSubstr("is a directory"));
  EXPECT_THAT(read_file(path("nowhere")).error(), HasSubstr("cannot be opened"));
  EXPECT_THAT(read_file(written("empty", "")).error(), HasSubstr("is empty"));
  // The second argument is the largest size in bytes that is read.
  EXPECT_EQ(as_text(*read_file(written("text", "abc"), 3)), "abc");
  EXPECT_THAT(read_file(written("text", "abcd"), 3).error(), HasSubstr("limit of 3 bytes"));
}

TEST_F(LoadedFiles, a_format_is_recognised_by_an_extension_in_any_case) {
  EXPECT_EQ(strand_decoder_of("a/straight.HAIR"), decode_yuksel_hair);
  EXPECT_EQ(strand_decoder_of("Tail.Tfx"), decode_tressfx);
  EXPECT_EQ(strand_decoder_of("b.DATA"), decode_usc_data);
  EXPECT_EQ(strand_decoder_of("Groom.Abc"), decode_alembic);
  EXPECT_EQ(strand_decoder_of("b.groom"), nullptr);
  EXPECT_THAT(import_hair({{written("curls.HAIR", "no hair")}, {}, {}, {}}).error(),
              HasSubstr("curls.HAIR: not a .hair file"));
  EXPECT_THAT(import_hair({{written("x.abc", "no hair")}, {}, {}, {}}).error(),
              HasSubstr("x.abc: not an Alembic file"));
  EXPECT_THAT(read_body(written("head.OBJ", "v 0 0 0\n")).error(), HasSubstr("head.OBJ: not a mesh"));
}

// Returns a clip of one frame. The quaternion of its root is (root_w, 0, 0, 0), and all other joints are at rest.
std::string deepmimic_clip(const char* root_w) {
  std::string frame = "0, 0, 0.9, 0, " + std::string(root_w) + ", 0, 0, 0";
  for (const char* joint : {"q", "q", "q", "h", "q", "q", "h", "q", "h", "q", "q", "h"})
    frame += *joint == 'q' ? ", 1, 0, 0, 0" : ", 0";
  return R"({"Frames": [[)" + frame + "]]}";
}

TEST(DeepMimicClip, a_quaternion_of_another_length_is_normalised_with_a_warning) {
  for (const char* norm : {"0.58", "1.7", "-0.58"}) {
    const auto clip = decode_deepmimic_clip(deepmimic_clip(norm), 60);
    ASSERT_TRUE(clip) << clip.error();
    EXPECT_NEAR(clip->frames[0].rotations[0].norm(), 1, 1e-12);
    EXPECT_THAT(clip->warnings, ElementsAre(StartsWith("1 quaternions are not of unit length")));
  }
  EXPECT_THAT(decode_deepmimic_clip(deepmimic_clip("0.58"), 60)->warnings, Each(HasSubstr("0.58")));
  EXPECT_TRUE(decode_deepmimic_clip(deepmimic_clip("0.999"), 60)->warnings.empty());
}

TEST(DeepMimicClip, a_quaternion_of_zero_or_of_no_number_is_refused) {
  EXPECT_THAT(decode_deepmimic_clip(deepmimic_clip("0"), 60).error(), HasSubstr("no rotation"));
  EXPECT_FALSE(decode_deepmimic_clip(deepmimic_clip("1e999"), 60));
  EXPECT_FALSE(decode_deepmimic_clip(deepmimic_clip("null"), 60));
}

}  // namespace
}  // namespace hairnet
