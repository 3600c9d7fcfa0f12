#include <gtest/gtest.h>

#include <unistd.h>

#include <cstring>
#include <filesystem>
#include <fstream>
#include <sstream>
#include <string>

#include "client/files/npy_writer.hpp"

namespace hairnet {
namespace {

class Npy : public ::testing::Test {
 protected:
  void SetUp() override {
    folder_ = std::filesystem::temp_directory_path() / ("hairnet_npy_" + std::to_string(::getpid()));
    std::filesystem::create_directories(folder_);
  }
  void TearDown() override { std::filesystem::remove_all(folder_); }
  [[nodiscard]] std::string path() const { return (folder_ / "array.npy").string(); }
  [[nodiscard]] std::string content() const {
    std::ifstream file(path(), std::ios::binary);
    std::stringstream all;
    all << file.rdbuf();
    return all.str();
  }
  std::filesystem::path folder_;
};

// Returns where the data begin: after 10 bytes and the header, whose length is in the bytes 8 and 9.
std::size_t header_bytes(const std::string& file) {
  return 10 + static_cast<unsigned char>(file[8]) + 256u * static_cast<unsigned char>(file[9]);
}

TEST_F(Npy, header_is_version_1_ends_in_a_newline_and_aligns_data_to_64_bytes) {
  auto writer = NpyWriter::create(path(), NpyType::float32, {2, 3});
  ASSERT_TRUE(writer);
  ASSERT_TRUE(writer->finish());
  const std::string file = content();
  ASSERT_GE(file.size(), 10u);
  EXPECT_EQ(file.substr(0, 8), std::string("\x93NUMPY\x01\x00", 8));
  // NumPy aligns data to 64 bytes, so that an array can be mapped into memory.
  EXPECT_EQ(header_bytes(file) % 64, 0u);
  EXPECT_EQ(file[header_bytes(file) - 1], '\n');
  EXPECT_EQ(file.size(), header_bytes(file));
}

TEST_F(Npy, names_type_order_and_the_shape_that_was_written) {
  // The shape is that of one row; the number of rows is only known at the end.
  auto writer = NpyWriter::create(path(), NpyType::float32, {2, 3});
  ASSERT_TRUE(writer);
  const std::vector<float> row{1, 2, 3, 4, 5, 6};
  for (int i = 0; i < 12; ++i) writer->append(row);
  ASSERT_TRUE(writer->finish());
  EXPECT_NE(content().find("{'descr': '<f4', 'fortran_order': False, 'shape': (12, 2, 3), }"), std::string::npos);
}

TEST_F(Npy, data_follow_as_they_were_given) {
  auto writer = NpyWriter::create(path(), NpyType::int64, {});
  ASSERT_TRUE(writer);
  const std::vector<std::int64_t> values{7, -1, 1ll << 60};
  writer->append(std::span(values).first(1));
  writer->append(std::span(values).subspan(1));
  ASSERT_TRUE(writer->finish());
  const std::string file = content();
  EXPECT_NE(file.find("{'descr': '<i8', 'fortran_order': False, 'shape': (3,), }"), std::string::npos);
  ASSERT_EQ(file.size(), header_bytes(file) + 24);
  EXPECT_EQ(std::memcmp(file.data() + header_bytes(file), values.data(), 24), 0);
}

TEST_F(Npy, leaves_no_file_behind_when_not_finished) {
  {
    auto writer = NpyWriter::create(path(), NpyType::float32, {3});
    ASSERT_TRUE(writer);
    writer->append(std::vector<float>{1, 2, 3});
  }
  EXPECT_TRUE(std::filesystem::is_empty(folder_));
}

TEST_F(Npy, an_unfinished_array_leaves_the_old_one_alone) {
  std::ofstream(path()) << "old";
  { auto writer = NpyWriter::create(path(), NpyType::float32, {3}); }
  EXPECT_EQ(content(), "old");
}

TEST_F(Npy, refuses_a_folder_that_is_not_there) {
  const auto writer = NpyWriter::create((folder_ / "missing" / "a.npy").string(), NpyType::float32, {3});
  ASSERT_FALSE(writer);
  EXPECT_EQ(writer.error().find('\n'), std::string::npos);
}

}  // namespace
}  // namespace hairnet
