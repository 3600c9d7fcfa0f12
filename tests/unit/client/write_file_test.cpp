#include "client/files/write_file.hpp"

#include <fcntl.h>
#include <gmock/gmock.h>
#include <gtest/gtest.h>
#include <stdlib.h>
#include <sys/stat.h>
#include <unistd.h>

#include <filesystem>
#include <fstream>
#include <iterator>
#include <set>
#include <string>
#include <thread>

#include "client/files/npy_writer.hpp"
#include "schema/files/output_file.hpp"

namespace hairnet {
namespace {

using testing::AllOf;
using testing::HasSubstr;
using testing::StartsWith;

// Gives each test a new folder. write_file() writes a temporary file and renames it, so that a crash never leaves
// half of a file.
class WriteFile : public testing::Test {
 protected:
  void SetUp() override {
    std::string made = (std::filesystem::temp_directory_path() / "hairnet_write_XXXXXX").string();
    ASSERT_NE(::mkdtemp(made.data()), nullptr);
    folder_ = made;
  }
  void TearDown() override { std::filesystem::remove_all(folder_); }
  std::string error_of(const std::string& path) {
    const Result<void> possible = check_can_write({"", path});
    return possible ? "" : possible.error();
  }
  static bool written(const std::string& path, std::string_view text) {
    return write_file(path, std::as_bytes(std::span(text))).has_value();
  }
  static void write(const std::filesystem::path& path, std::string_view text) { std::ofstream(path) << text; }
  static std::string content(const std::filesystem::path& path) {
    std::ifstream file(path, std::ios::binary);
    return {std::istreambuf_iterator<char>(file), {}};
  }
  static std::set<std::string> names(const std::filesystem::path& folder) {
    std::set<std::string> names;
    for (const auto& entry : std::filesystem::directory_iterator(folder)) names.insert(entry.path().filename());
    return names;
  }
  std::filesystem::path folder_;
};

TEST_F(WriteFile, says_before_any_work_whether_a_file_can_be_written) {
  const std::string file = folder_ / "a.png", lost = folder_ / "none" / "a.png";
  EXPECT_EQ(error_of(""), "");
  EXPECT_EQ(error_of(file), "");
  EXPECT_FALSE(std::filesystem::exists(file)) << "nothing is written";
  EXPECT_EQ(error_of("a.png"), "") << "in the working folder";
  EXPECT_EQ(error_of("/dev/null"), "");
  EXPECT_THAT(error_of(lost), AllOf(StartsWith(lost + ": there is no folder "), HasSubstr("make it first")));
  EXPECT_THAT(error_of(folder_), HasSubstr("is a folder, not a file"));
}

// Replacing a link by a file, or opening a private file to everybody, would surprise its owner.
TEST_F(WriteFile, keeps_the_permissions_of_the_old_file_and_follows_links_also_to_what_is_not_there_yet) {
  std::filesystem::create_directory(folder_ / "far");
  const std::filesystem::path file = folder_ / "far" / "a.txt", link = folder_ / "link", new_link = folder_ / "new";
  write(file, "old");
  std::filesystem::permissions(file, std::filesystem::perms::owner_read | std::filesystem::perms::owner_write |
                                         std::filesystem::perms::group_read);
  std::filesystem::create_symlink("far/a.txt", link);
  std::filesystem::create_symlink("far/b.txt", new_link);
  EXPECT_TRUE(written(link, "new"));
  EXPECT_TRUE(written(new_link, "b"));
  EXPECT_TRUE(std::filesystem::is_symlink(link) && std::filesystem::is_symlink(new_link));
  EXPECT_EQ(content(file), "new");
  EXPECT_EQ(content(folder_ / "far" / "b.txt"), "b");
  EXPECT_EQ(std::filesystem::status(file).permissions(), std::filesystem::perms(0640));
  EXPECT_EQ(names(folder_ / "far"), (std::set<std::string>{"a.txt", "b.txt"})) << "no temporary file";
}

TEST_F(WriteFile, what_is_no_regular_file_gets_the_bytes_and_stays_what_it_is) {
  const std::filesystem::path fifo = folder_ / "fifo", null = folder_ / "null", full = folder_ / "full";
  ASSERT_EQ(::mkfifo(fifo.c_str(), 0600), 0);
  std::string heard;
  std::thread reader([&] { heard = content(fifo); });
  EXPECT_TRUE(written(fifo, "through a pipe"));
  reader.join();
  EXPECT_EQ(heard, "through a pipe");
  EXPECT_TRUE(std::filesystem::is_fifo(fifo));
  std::filesystem::create_symlink("/dev/null", null);
  EXPECT_TRUE(written(null, "nothing"));
  EXPECT_TRUE(std::filesystem::is_character_file(null));
  EXPECT_TRUE(std::filesystem::is_character_file("/dev/null"));
  // Every write to /dev/full fails as on a full disk.
  std::filesystem::create_symlink("/dev/full", full);
  const Result<void> refused = write_file(full, std::as_bytes(std::span("x")));
  ASSERT_FALSE(refused);
  EXPECT_THAT(refused.error(), HasSubstr("No space left"));
  EXPECT_TRUE(std::filesystem::is_character_file("/dev/full"));
}

TEST_F(WriteFile, an_open_descriptor_is_written_where_it_stands) {
  const std::filesystem::path file = folder_ / "shell";
  const int descriptor = ::open(file.c_str(), O_WRONLY | O_CREAT, 0600);
  ASSERT_EQ(::write(descriptor, "before ", 7), 7);
  // A path such as /dev/stdout names an open descriptor. The bytes must go to where the descriptor stands, and not
  // replace the file.
  EXPECT_TRUE(written("/dev/fd/" + std::to_string(descriptor), "and "));
  EXPECT_TRUE(written("/proc/self/fd/" + std::to_string(descriptor), "here "));
  ASSERT_EQ(::write(descriptor, "after", 5), 5);
  ::close(descriptor);
  EXPECT_EQ(content(file), "before and here after");
}

// A full disk or a crash must not destroy the result of yesterday.
TEST_F(WriteFile, a_failure_leaves_the_old_file_and_no_other) {
  write(folder_ / "a.txt", "old");
  {
    Result<OutputFile> unfinished = OutputFile::create(folder_ / "a.txt");
    ASSERT_TRUE(unfinished);
    unfinished->write(std::as_bytes(std::span("half")));
  }
  EXPECT_EQ(content(folder_ / "a.txt"), "old");
  EXPECT_EQ(names(folder_), std::set<std::string>{"a.txt"});
  EXPECT_FALSE(written(folder_ / "none" / "a.txt", "x"));
  EXPECT_FALSE(written(folder_, "x"));
}

TEST_F(WriteFile, arrays_are_written_through_pipes_with_their_number_of_rows) {
  const std::filesystem::path fifo = folder_ / "fifo";
  ASSERT_EQ(::mkfifo(fifo.c_str(), 0600), 0);
  std::string heard;
  std::thread reader([&] { heard = content(fifo); });
  Result<NpyWriter> array = NpyWriter::create(fifo, NpyType::float32, {3});
  ASSERT_TRUE(array);
  // A pipe cannot go back to its header, so the writer must store the rows until it knows their number.
  array->append(std::vector<float>{1, 2, 3, 4, 5, 6});
  EXPECT_TRUE(array->finish());
  array = Refusal("closed");
  reader.join();
  EXPECT_THAT(heard, HasSubstr("(2, 3)"));
}

TEST_F(WriteFile, a_folder_that_may_not_be_written_is_named) {
  if (::geteuid() == 0) GTEST_SKIP() << "root may write everywhere";
  std::filesystem::permissions(folder_, std::filesystem::perms::owner_read | std::filesystem::perms::owner_exec);
  EXPECT_THAT(error_of(folder_ / "a.png"), AllOf(HasSubstr(folder_.string()), HasSubstr("Permission denied")));
}

}  // namespace
}  // namespace hairnet
