#include <gmock/gmock.h>
#include <unistd.h>

#include <filesystem>

#include "client/files/read_file.hpp"
#include "client/files/write_file.hpp"
#include "client/tools/groom/commands.hpp"
#include "client/tools/groom/read_groom.hpp"
#include "schema/wire/level_file.hpp"

namespace hairnet::groom {
namespace {

namespace fs = std::filesystem;
using testing::HasSubstr;

class WriteLevels : public testing::Test {
 protected:
  WriteLevels() {
    fs::create_directories(folder_);
    MakeOptions options{"bob", in("bob.groom"), {}, {}};
    options.hairstyle.strand_count = 200;
    EXPECT_TRUE(make_groom(options));
  }
  ~WriteLevels() override { fs::remove_all(folder_); }

  [[nodiscard]] std::string in(const char* name) const { return folder_ / name; }

  fs::path folder_ = fs::path(testing::TempDir()) / ("write_levels_" + std::to_string(::getpid()));
};

TEST_F(WriteLevels, writes_beside_the_groom_what_serves_this_groom_alone) {
  const Result<void> done = write_levels({in("bob.groom"), ""});
  ASSERT_TRUE(done) << done.error();
  const auto bytes = read_file(in("bob.levels"), wire::kLevelFileBytesMax);
  ASSERT_TRUE(bytes) << bytes.error();
  wire::GroomHash hash = read_groom(in("bob.groom"))->hash;
  const wire::DecodedLevels levels = wire::decode_levels(as_octets(*bytes), hash);
  EXPECT_EQ(levels.error, wire::LevelFileError::none) << levels.detail;
  // A level file names its groom by the hash, so that levels of another groom are never used.
  ++hash[0];
  EXPECT_NE(wire::decode_levels(as_octets(*bytes), hash).error, wire::LevelFileError::none);
}

TEST_F(WriteLevels, what_is_no_groom_file_is_refused_in_a_line_and_nothing_is_written) {
  // A made hairstyle has no file whose hash the levels could name, so the error says how to write one.
  EXPECT_THAT(write_levels({"made:bob", in("out.levels")}).error(), HasSubstr("hairnet-groom make bob --out FILE"));
  EXPECT_THAT(write_levels({in("none.groom"), in("out.levels")}).error(), HasSubstr("none.groom: "));
  ASSERT_TRUE(write_file(in("text.groom"), std::as_bytes(std::span("no groom"))));
  EXPECT_THAT(write_levels({in("text.groom"), in("out.levels")}).error(), HasSubstr("text.groom: "));
  EXPECT_THAT(write_levels({in("bob.groom"), in("no/folder/out.levels")}).error(), HasSubstr("no/folder"));
  EXPECT_FALSE(fs::exists(in("out.levels")));
}

}  // namespace
}  // namespace hairnet::groom
