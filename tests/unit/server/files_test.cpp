#include "server/files/files.hpp"

#include <gmock/gmock.h>
#include <gtest/gtest.h>
#include <sys/stat.h>
#include <unistd.h>

#include <filesystem>
#include <fstream>

namespace hairnet::server {
namespace {

using testing::ElementsAre;
using testing::HasSubstr;

class FilesTest : public testing::Test {
 protected:
  ~FilesTest() override { std::filesystem::remove_all(folder_); }
  [[nodiscard]] std::string path(const std::string& name) const { return folder_ / name; }
  std::string file(const std::string& text) {
    std::ofstream(path("file"), std::ios::binary) << text;
    return path("file");
  }
  std::string pipe() {
    EXPECT_EQ(::mkfifo(path("pipe").c_str(), 0600), 0);
    return path("pipe");
  }

  const std::filesystem::path folder_ =
      std::filesystem::path(testing::TempDir()) / ("server_files_" + std::to_string(::getpid()));
  const bool made_ = std::filesystem::create_directories(folder_);
};

// Editors of Windows may begin a file with a byte order mark, and end lines with a carriage return; both are left out.
TEST_F(FilesTest, text_is_the_same_from_every_system) {
  EXPECT_EQ(read_text_file(file("a\nb\n"), 100).value(), "a\nb\n");
  EXPECT_EQ(read_text_file(file("\xef\xbb\xbf"
                                "a\r\nb\r\n"),
                           100)
                .value(),
            "a\nb\n");
  EXPECT_EQ(read_text_file(file("\r\n\ra\r"), 100).value(), "\n\ra\r") << "a return alone ends no line";
  EXPECT_EQ(read_text_file(file(""), 100).value(), "");
}

TEST_F(FilesTest, what_is_no_file_is_refused_at_once) {
  EXPECT_EQ(read_text_file(pipe(), 100).error(), "is a pipe or device, not a file");
  EXPECT_EQ(read_text_file("/dev/zero", 100).error(), "is a pipe or device, not a file");
  EXPECT_EQ(read_text_file(folder_, 100).error(), "is a folder, not a file");
  EXPECT_EQ(read_text_file(path("absent"), 100).error(), "No such file or directory");
  EXPECT_EQ(read_text_file(file("12345"), 4).error(), "has more than 4 bytes");
  EXPECT_EQ(try_file(path("pipe")), "is a pipe or device, not a file");
  EXPECT_EQ(try_file("/dev/null"), "is a pipe or device, not a file");
  EXPECT_NE(try_file(folder_), "");
  EXPECT_NE(try_file(path("no/such/folder")), "");
}

TEST_F(FilesTest, a_file_that_is_tried_stays_as_it_was) {
  EXPECT_EQ(try_file(path("new")), "");
  EXPECT_FALSE(std::filesystem::exists(path("new")));
  const std::string old = file("text");
  EXPECT_EQ(try_file(old), "");
  EXPECT_EQ(read_text_file(old, 100).value(), "text");
}

TEST_F(FilesTest, a_folder_that_is_tried_is_made_and_stays_empty) {
  std::vector<std::string> made;
  EXPECT_EQ(try_folder(path("a/b"), made), "");
  EXPECT_THAT(made, ElementsAre(path("a"), path("a/b")));
  EXPECT_TRUE(std::filesystem::is_empty(path("a/b")));
  made.clear();
  EXPECT_EQ(try_folder(path("a/b"), made), "");
  EXPECT_THAT(made, ElementsAre());
}

TEST_F(FilesTest, a_folder_where_no_file_can_be_kept_is_named) {
  std::vector<std::string> made;
  EXPECT_THAT(try_folder("/proc", made), HasSubstr("the folder /proc cannot be written: "));
  EXPECT_THAT(try_folder(file("") + "/inside", made), HasSubstr("inside cannot be made: "));
  EXPECT_THAT(try_folder(path("file"), made), HasSubstr("cannot be made: "));
  EXPECT_THAT(made, ElementsAre());
}

TEST(TakeLine, gives_line_after_line) {
  std::string_view text = "one\n\ntwo";
  EXPECT_EQ(take_line(text), "one");
  EXPECT_EQ(take_line(text), "");
  EXPECT_EQ(take_line(text), "two");
  EXPECT_EQ(text, "");
}

}  // namespace
}  // namespace hairnet::server
