#include "server/grooms/level_cache.hpp"

#include <gtest/gtest.h>
#include <sys/stat.h>
#include <unistd.h>

#include <chrono>
#include <fstream>
#include <iterator>
#include <thread>

#include "core/levels/build.hpp"
#include "schema/wire/groom_file.hpp"
#include "schema/wire/level_file.hpp"
#include "server/grooms/groom_builder.hpp"
#include "tests/support/equal_levels.hpp"
#include "tests/support/quick_training.hpp"
#include "tests/unit/server/small_groom.hpp"

namespace hairnet::server {
namespace {

namespace fs = std::filesystem;

constexpr std::uint64_t kPlenty = std::uint64_t{1} << 30;

class LevelCacheTest : public testing::Test {
 protected:
  LevelCacheTest() : folder_(fs::path(testing::TempDir()) / ("level_cache_" + std::to_string(::getpid()))) {
    fs::remove_all(folder_);
  }
  ~LevelCacheTest() override { fs::remove_all(folder_); }

  static const LevelSet& levels() {
    static const auto levels = build_levels(small_groom());
    return *levels;
  }
  static std::uint64_t file_bytes() { return wire::encode_levels({}, levels()).size(); }
  static wire::GroomHash hash(std::uint8_t n) { return wire::GroomHash{n}; }
  [[nodiscard]] fs::path path(const wire::GroomHash& groom) const { return folder_ / wire::level_file_name(groom); }
  static void write(const fs::path& to, const std::vector<std::uint8_t>& bytes) {
    std::ofstream file(to, std::ios::binary);
    file.write(reinterpret_cast<const char*>(bytes.data()), static_cast<std::streamsize>(bytes.size()));
  }
  static std::vector<std::uint8_t> read(const fs::path& from) {
    std::ifstream file(from, std::ios::binary);
    return {std::istreambuf_iterator<char>(file), {}};
  }
  [[nodiscard]] std::size_t file_count() const {
    return static_cast<std::size_t>(std::distance(fs::directory_iterator(folder_), fs::directory_iterator()));
  }
  // Sets the last use to this many hours ago: the cache takes the time of modification for it.
  void age(const fs::path& file, int hours) {
    fs::last_write_time(file, fs::file_time_type::clock::now() - std::chrono::hours(hours));
  }

  fs::path folder_;
  LevelCacheCounters counters_;
};

TEST_F(LevelCacheTest, gives_back_what_was_put_and_makes_its_folder) {
  LevelCache cache(folder_ / "deep" / "er", kPlenty, counters_);
  EXPECT_FALSE(cache.find(hash(1)));
  EXPECT_EQ(counters_.level_cache_misses.value(), 1u);
  cache.put(hash(1), levels());
  EXPECT_EQ(counters_.level_cache_written.value(), 1u);
  const auto found = cache.find(hash(1));
  ASSERT_TRUE(found);
  for (std::size_t i = 0; i < found->levels.size(); ++i) support::expect_equal(levels().levels[i], found->levels[i]);
  EXPECT_FALSE(cache.find(hash(2)));
  EXPECT_EQ(counters_.level_cache_hits.value(), 1u);
  EXPECT_EQ(counters_.level_cache_misses.value(), 2u);
}

TEST_F(LevelCacheTest, counts_what_it_cannot_use_by_reason_and_puts_good_levels_in_its_place) {
  LevelCache cache(folder_, kPlenty, counters_);
  const std::vector<std::uint8_t> good = wire::encode_levels(hash(1), levels());
  const auto corrupted = [&](std::size_t at) {
    std::vector<std::uint8_t> bytes = good;
    bytes[at] ^= 0x40;
    return bytes;
  };
  // This file has a correct checksum, and behind the header a payload that cannot be read.
  std::vector<std::uint8_t> invalid = corrupted(wire::kLevelFileHeaderBytes);
  wire::set_level_file_checksum(invalid);
  // Byte 0 is in the magic number, and byte 12 in the version of the build (level_file.hpp).
  const std::vector<std::pair<std::vector<std::uint8_t>, const Counter*>> cases{
      {{}, &counters_.level_cache_rejected_damaged},
      {{good.begin(), good.begin() + 1000}, &counters_.level_cache_rejected_damaged},
      {corrupted(good.size() / 2), &counters_.level_cache_rejected_damaged},
      {corrupted(0), &counters_.level_cache_rejected_format},
      {corrupted(12), &counters_.level_cache_rejected_version},
      {wire::encode_levels(hash(7), levels()), &counters_.level_cache_rejected_groom},
      {invalid, &counters_.level_cache_rejected_invalid}};
  for (const auto& [bytes, counter] : cases) {
    SCOPED_TRACE(counter->name().flat());
    write(path(hash(1)), bytes);
    const std::uint64_t before = counter->value();
    EXPECT_FALSE(cache.find(hash(1)));
    EXPECT_EQ(counter->value(), before + 1);
    cache.put(hash(1), levels());
    EXPECT_EQ(read(path(hash(1))), good);
  }
  EXPECT_EQ(counters_.level_cache_hits.value() + counters_.level_cache_misses.value(), 0u);
  EXPECT_EQ(file_count(), 1u);
}

TEST_F(LevelCacheTest, a_pipe_or_a_folder_in_a_files_place_neither_blocks_nor_fails) {
  LevelCache cache(folder_, kPlenty, counters_);
  ASSERT_EQ(::mkfifo(path(hash(1)).c_str(), 0600), 0);
  fs::create_directory(path(hash(2)));
  EXPECT_FALSE(cache.find(hash(1)));
  EXPECT_FALSE(cache.find(hash(2)));
  EXPECT_EQ(counters_.level_cache_rejected_unreadable.value(), 2u);
  cache.put(hash(1), levels());
  EXPECT_TRUE(cache.find(hash(1)));
  cache.put(hash(2), levels());
  EXPECT_EQ(counters_.level_cache_writes_failed.value(), 1u);
}

TEST_F(LevelCacheTest, a_folder_that_cannot_be_written_is_one_warning_and_no_failure) {
  // A file takes the folder's place: not even root may write within it.
  write(folder_, {1, 2, 3});
  testing::internal::CaptureStdout();
  {
    LevelCache cache(folder_, kPlenty, counters_);
    for (std::uint8_t n = 0; n < 3; ++n) {
      EXPECT_FALSE(cache.find(hash(n)));
      cache.put(hash(n), levels());
    }
  }
  const std::string said = testing::internal::GetCapturedStdout();
  const std::size_t first = said.find("event=level_cache_write_failed folder=");
  EXPECT_NE(first, std::string::npos) << said;
  EXPECT_EQ(said.find("event=level_cache_write_failed folder=", first + 1), std::string::npos) << said;
  EXPECT_EQ(counters_.level_cache_misses.value(), 3u);
  EXPECT_EQ(counters_.level_cache_writes_failed.value(), 3u);
  EXPECT_EQ(read(folder_).size(), 3u);
}

TEST_F(LevelCacheTest, keeps_within_its_bytes_by_removing_what_was_used_least_lately) {
  LevelCache cache(folder_, 3 * file_bytes(), counters_);
  for (std::uint8_t n = 1; n <= 3; ++n) {
    cache.put(hash(n), levels());
    age(path(hash(n)), 10 - n);
  }
  EXPECT_EQ(counters_.level_cache_evicted.value(), 0u);
  // A find is a use, so the oldest file is now the most recently used one.
  EXPECT_TRUE(cache.find(hash(1)));
  cache.put(hash(4), levels());
  EXPECT_EQ(counters_.level_cache_evicted.value(), 1u);
  EXPECT_TRUE(fs::exists(path(hash(1))));
  EXPECT_FALSE(fs::exists(path(hash(2))));
  EXPECT_TRUE(fs::exists(path(hash(3))));
  EXPECT_TRUE(fs::exists(path(hash(4))));
}

TEST_F(LevelCacheTest, levels_larger_than_the_whole_cache_are_not_kept) {
  LevelCache cache(folder_, file_bytes() - 1, counters_);
  testing::internal::CaptureStdout();
  cache.put(hash(1), levels());
  EXPECT_NE(testing::internal::GetCapturedStdout().find("more than may be kept"), std::string::npos);
  EXPECT_EQ(counters_.level_cache_writes_failed.value(), 1u);
  EXPECT_EQ(file_count(), 0u);
}

// No write takes an hour (kWriting in cache_folder.cpp), so a partial file of 2 hours is removed, and one of now is
// left to its writer. Files that the cache has not named are never touched, though they fill the folder beyond its
// bound.
TEST_F(LevelCacheTest, removes_partial_files_of_a_dead_server_and_no_other_files) {
  LevelCache cache(folder_, file_bytes(), counters_);
  const fs::path part = path(hash(1)).string() + ".part-a1b2c3";
  const std::vector<fs::path> others{folder_ / "notes.txt", folder_ / "x.hnlevels", path(hash(2)).string() + ".backup"};
  const std::vector<std::uint8_t> bytes(2 * file_bytes(), 0xA5);
  write(part, bytes);
  age(part, 2);
  const fs::path being_written = path(hash(1)).string() + ".part-d4e5f6";
  write(being_written, bytes);
  for (const fs::path& other : others) {
    write(other, bytes);
    age(other, 100);
  }
  cache.put(hash(3), levels());
  EXPECT_FALSE(fs::exists(part));
  EXPECT_EQ(read(being_written), bytes);
  EXPECT_TRUE(cache.find(hash(3)));
  for (const fs::path& other : others) EXPECT_EQ(read(other), bytes);
}

// Four servers read, write and evict three grooms in a folder that has room for two. A file that is found must be
// complete, and each miss must be followed by a write that succeeds.
TEST_F(LevelCacheTest, servers_that_share_a_folder_find_whole_files_only) {
  std::vector<std::thread> servers;
  std::vector<LevelCacheCounters> counters(4);
  for (LevelCacheCounters& own : counters) {
    servers.emplace_back([&] {
      LevelCache cache(folder_, 2 * file_bytes(), own);
      for (int round = 0; round < 40; ++round) {
        const wire::GroomHash groom = hash(static_cast<std::uint8_t>(round % 3));
        if (!cache.find(groom)) cache.put(groom, levels());
      }
    });
  }
  for (std::thread& server : servers) server.join();
  std::uint64_t hits = 0;
  for (const LevelCacheCounters& own : counters) {
    EXPECT_EQ(own.level_cache_hits.value() + own.level_cache_misses.value(), 40u);
    EXPECT_EQ(own.level_cache_written.value(), own.level_cache_misses.value());
    hits += own.level_cache_hits.value();
  }
  EXPECT_GT(hits, 0u);
}

TEST_F(LevelCacheTest, a_builder_takes_from_it_what_another_has_built) {
  const std::vector<std::uint8_t> bytes = wire::encode_groom(small_groom());
  const auto built = [&](LevelCache* cache, std::size_t thread_count) {
    GroomBuilderDef def;
    def.build.training = support::kQuickTraining;
    def.build.thread_count = thread_count;
    def.levels = cache;
    GroomBuilder builder(def);
    builder.put({1, wire::hash_groom(bytes), {bytes}});
    EXPECT_TRUE(builder.poll());
    GroomResult result;
    while (builder.take(result)) {
    }
    return result.levels;
  };
  // Levels must not depend on the cache, nor on the number of threads.
  const auto without = built(nullptr, 1);
  LevelCache cache(folder_, kPlenty, counters_);
  const auto first = built(&cache, 2), second = built(&cache, 2);
  ASSERT_TRUE(without && first && second);
  support::expect_equal(*without, *first);
  support::expect_equal(*without, *second);
  EXPECT_EQ(counters_.level_cache_misses.value(), 1u);
  EXPECT_EQ(counters_.level_cache_hits.value(), 1u);
}

TEST_F(LevelCacheTest, levels_that_were_not_built_to_the_end_are_not_kept) {
  const std::vector<std::uint8_t> bytes = wire::encode_groom(small_groom());
  LevelCache cache(folder_, kPlenty, counters_);
  GroomBuilderDef def;
  def.build.training = support::kQuickTraining;
  def.build.thread_count = 2;
  def.levels = &cache;
  GroomBuilder builder(def);
  builder.put({1, wire::hash_groom(bytes), {bytes}});
  builder.cancel();
  EXPECT_TRUE(builder.poll());
  EXPECT_EQ(counters_.level_cache_written.value(), 0u);
  EXPECT_EQ(file_count(), 0u);
}

}  // namespace
}  // namespace hairnet::server
