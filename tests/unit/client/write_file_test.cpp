#include "client/files/write_file.hpp"

#include <gmock/gmock.h>
#include <gtest/gtest.h>
#include <stdlib.h>
#include <unistd.h>

#include <filesystem>

namespace hairnet {
namespace {

using testing::AllOf;
using testing::HasSubstr;
using testing::StartsWith;

class WriteFile : public testing::Test {
 protected:
  void SetUp() override {
    std::string made = (std::filesystem::temp_directory_path() / "hairnet_write_XXXXXX").string();
    ASSERT_NE(::mkdtemp(made.data()), nullptr);
    folder_ = made;
  }
  void TearDown() override { std::filesystem::remove_all(folder_); }
  std::string fault_of(const std::string& path) {
    const Result<void> possible = check_can_write({"", path});
    return possible ? "" : possible.error();
  }
  std::filesystem::path folder_;
};

TEST_F(WriteFile, says_before_any_work_whether_a_file_can_be_written) {
  const std::string file = folder_ / "a.png", lost = folder_ / "none" / "a.png";
  EXPECT_EQ(fault_of(""), "");
  EXPECT_EQ(fault_of(file), "");
  EXPECT_FALSE(std::filesystem::exists(file)) << "nothing is written";
  EXPECT_EQ(fault_of("a.png"), "") << "in the working folder";
  EXPECT_EQ(fault_of("/dev/null"), "");
  EXPECT_THAT(fault_of(lost), AllOf(StartsWith(lost + ": there is no folder "), HasSubstr("make it first")));
  EXPECT_THAT(fault_of(folder_), HasSubstr("is a folder, not a file"));
}

TEST_F(WriteFile, a_folder_that_may_not_be_written_is_named) {
  if (::geteuid() == 0) GTEST_SKIP() << "root may write everywhere";
  std::filesystem::permissions(folder_, std::filesystem::perms::owner_read | std::filesystem::perms::owner_exec);
  EXPECT_THAT(fault_of(folder_ / "a.png"), AllOf(HasSubstr(folder_.string()), HasSubstr("Permission denied")));
}

}  // namespace
}  // namespace hairnet
