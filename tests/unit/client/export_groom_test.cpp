#include <gmock/gmock.h>
#include <unistd.h>

#include <filesystem>

#include "client/assets/load_groom.hpp"
#include "client/tools/groom/commands.hpp"
#include "client/tools/groom/save_groom.hpp"

namespace hairnet::groom {
namespace {

namespace fs = std::filesystem;
using testing::HasSubstr;

class ExportGroom : public testing::Test {
 protected:
  void SetUp() override { fs::create_directories(folder_); }
  void TearDown() override { fs::remove_all(folder_); }
  std::string exported(const std::string& from, const std::string& to) {
    ExportOptions options;
    options.groom = from;
    options.hairstyle.strand_count = 300;
    options.out = (folder_ / to).string();
    const Result<void> done = export_groom(options);
    return done ? std::string() : done.error();
  }
  fs::path folder_ = fs::path(testing::TempDir()) / ("export_groom_" + std::to_string(::getpid()));
};

TEST_F(ExportGroom, made_hair_goes_to_each_format_and_can_be_imported_again) {
  HairstyleOptions options;
  options.strand_count = 300;
  const Result<Groom> made = load_groom("made:short", options);
  ASSERT_TRUE(made) << made.error();
  for (const char* file : {"hair.abc", "hair.usda", "hair.hair", "hair.ply", "hair.npz"}) {
    ASSERT_EQ(exported("made:short", file), "") << file;
    const Result<Groom> again = load_groom((folder_ / file).string());
    ASSERT_TRUE(again) << again.error();
    EXPECT_EQ(again->strand_count(), made->strand_count()) << file;
    EXPECT_EQ(again->points.size(), made->points.size()) << file;
    // The format of Cem Yuksel has no groups.
    if (file != std::string("hair.hair")) {
      EXPECT_THAT(again->group_names, testing::UnorderedElementsAreArray(made->group_names)) << file;
    }
  }
  // No reader of glTF strands exists here, so these are only written.
  EXPECT_EQ(exported("made:short", "hair.gltf"), "");
  EXPECT_EQ(exported("made:short", "hair.glb"), "");
}

TEST_F(ExportGroom, widths_of_strands_come_back_from_each_format) {
  HairstyleOptions options;
  options.strand_count = 300;
  Result<Groom> made = load_groom("made:short", options);
  ASSERT_TRUE(made) << made.error();
  for (const bool is_one : {true, false}) {
    for (std::size_t s = 0; s < made->strand_count(); ++s)
      // Strands have one width, or each another. Some formats store one number for all strands where that is enough.
      made->strands[s].radius_m = is_one ? 3e-5f : 3e-5f + 1e-7f * static_cast<float>(s);
    ASSERT_TRUE(write_groom(*made, (folder_ / "widths.groom").string()));
    for (const char* file : {"hair.abc", "hair.usda", "hair.hair", "hair.ply", "hair.npz"}) {
      ASSERT_EQ(exported((folder_ / "widths.groom").string(), file), "") << file;
      const Result<Groom> again = load_groom((folder_ / file).string());
      ASSERT_TRUE(again) << again.error();
      ASSERT_EQ(again->strand_count(), made->strand_count()) << file;
      std::vector<float> sent, come_back;
      for (const StrandProperties& strand : made->strands) sent.push_back(strand.radius_m);
      for (const StrandProperties& strand : again->strands) come_back.push_back(strand.radius_m);
      // Groups may change the order.
      std::ranges::sort(sent);
      std::ranges::sort(come_back);
      EXPECT_THAT(come_back, testing::Pointwise(testing::FloatNear(1e-9f), sent)) << file;
    }
  }
}

TEST_F(ExportGroom, refuses_an_unknown_format_and_an_unknown_groom_in_one_line) {
  EXPECT_THAT(exported("made:short", "hair.groom"), HasSubstr("hair.groom: strands are written to .abc"));
  EXPECT_THAT(exported("nowhere.groom", "hair.abc"), HasSubstr("nowhere.groom: "));
  EXPECT_TRUE(fs::is_empty(folder_));
}

}  // namespace
}  // namespace hairnet::groom
