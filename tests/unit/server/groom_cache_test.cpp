#include "server/grooms/groom_cache.hpp"

#include <gtest/gtest.h>
#include <sys/stat.h>
#include <unistd.h>

#include <fstream>
#include <iterator>
#include <thread>

#include "schema/wire/groom_file.hpp"

namespace hairnet::server {
namespace {

namespace fs = std::filesystem;

constexpr std::uint64_t kPlenty = std::uint64_t{1} << 30;
constexpr std::size_t kFileBytes = 5000;

struct File {
  explicit File(std::uint8_t fill) : bytes(kFileBytes, fill), hash(wire::hash_groom(bytes)) {}
  std::vector<std::uint8_t> bytes;
  wire::GroomHash hash;
};

class GroomCacheTest : public testing::Test {
 protected:
  GroomCacheTest() : folder_(fs::path(testing::TempDir()) / ("groom_cache_" + std::to_string(::getpid()))) {
    fs::remove_all(folder_);
  }
  ~GroomCacheTest() override { fs::remove_all(folder_); }

  [[nodiscard]] fs::path path(const wire::GroomHash& groom) const {
    std::string name;
    for (const std::uint8_t byte : groom) {
      name += "0123456789abcdef"[byte >> 4];
      name += "0123456789abcdef"[byte & 15];
    }
    return folder_ / (name + ".hngroom");
  }
  static void write(const fs::path& to, const std::vector<std::uint8_t>& bytes) {
    std::ofstream file(to, std::ios::binary);
    file.write(reinterpret_cast<const char*>(bytes.data()), static_cast<std::streamsize>(bytes.size()));
  }
  static void age(const fs::path& file, int hours) {
    fs::last_write_time(file, fs::file_time_type::clock::now() - std::chrono::hours(hours));
  }
  [[nodiscard]] std::size_t file_count() const {
    return static_cast<std::size_t>(std::distance(fs::directory_iterator(folder_), fs::directory_iterator()));
  }

  fs::path folder_;
  GroomCacheCounters counters_;
  File one_{1}, two_{2}, three_{3};
};

TEST_F(GroomCacheTest, gives_back_what_was_put_and_knows_it_again_after_a_restart) {
  {
    GroomCache cache(folder_ / "deep", kPlenty, counters_);
    EXPECT_FALSE(cache.is_cached(one_.hash));
    cache.put(one_.hash, one_.bytes);
    EXPECT_TRUE(cache.is_cached(one_.hash));
  }
  GroomCache again(folder_ / "deep", kPlenty, counters_);
  EXPECT_TRUE(again.is_cached(one_.hash));
  EXPECT_FALSE(again.is_cached(two_.hash));
  const GroomCache::Bytes found = again.find(one_.hash);
  ASSERT_TRUE(found);
  EXPECT_EQ(*found, one_.bytes);
  EXPECT_FALSE(again.find(two_.hash));
  EXPECT_EQ(counters_.groom_cache_hits.value(), 1u);
  EXPECT_EQ(counters_.groom_cache_misses.value(), 1u);
}

TEST_F(GroomCacheTest, a_file_with_another_hash_than_its_name_is_removed_and_counts_as_absent) {
  GroomCache cache(folder_, kPlenty, counters_);
  std::vector<std::uint8_t> flipped = one_.bytes, longer = one_.bytes;
  flipped[kFileBytes / 2] ^= 1;
  longer.push_back(1);
  std::uint64_t rejected = 0;
  for (const auto& bytes :
       {std::vector<std::uint8_t>{}, std::vector<std::uint8_t>(one_.bytes.begin(), one_.bytes.end() - 1), flipped,
        longer, two_.bytes}) {
    write(path(one_.hash), bytes);
    cache.refresh();
    EXPECT_TRUE(cache.is_cached(one_.hash));
    EXPECT_FALSE(cache.find(one_.hash));
    EXPECT_EQ(counters_.groom_cache_rejected_damaged.value(), ++rejected);
    EXPECT_FALSE(fs::exists(path(one_.hash)));
    EXPECT_FALSE(cache.is_cached(one_.hash));
  }
  cache.put(one_.hash, one_.bytes);
  EXPECT_TRUE(cache.find(one_.hash));
  EXPECT_EQ(counters_.groom_cache_misses.value(), 0u);
}

TEST_F(GroomCacheTest, a_file_that_has_gone_meanwhile_is_a_miss) {
  GroomCache cache(folder_, kPlenty, counters_);
  cache.put(one_.hash, one_.bytes);
  fs::remove(path(one_.hash));
  EXPECT_TRUE(cache.is_cached(one_.hash)) << "as of when it last looked";
  EXPECT_FALSE(cache.find(one_.hash));
  EXPECT_FALSE(cache.is_cached(one_.hash));
  EXPECT_EQ(counters_.groom_cache_misses.value(), 1u);
}

// A pipe would block a reader, and a symbolic link could lead to any file of the machine. The cache must neither read,
// count nor remove them.
TEST_F(GroomCacheTest, what_is_no_file_of_its_own_is_neither_kept_nor_removed) {
  fs::create_directories(folder_);
  ASSERT_EQ(::mkfifo(path(one_.hash).c_str(), 0600), 0);
  fs::create_directory(path(two_.hash));
  write(folder_ / "notes.txt", one_.bytes);
  write(path(three_.hash).string() + ".backup", three_.bytes);
  fs::create_symlink(folder_ / "notes.txt", path(three_.hash));
  GroomCache cache(folder_, kPlenty, counters_);
  for (const File* file : {&one_, &two_, &three_}) EXPECT_FALSE(cache.is_cached(file->hash));
  for (const File* file : {&one_, &two_, &three_}) EXPECT_FALSE(cache.find(file->hash));
  EXPECT_EQ(file_count(), 5u);
  EXPECT_EQ(counters_.groom_cache_hits.value(), 0u);
}

// A partial file that is older than an hour was left by a server that died (kWriting in cache_folder.cpp). The cache
// has room for one file.
TEST_F(GroomCacheTest, half_written_files_of_a_dead_server_are_never_found_and_go_when_room_is_needed) {
  fs::create_directories(folder_);
  // A server writes under such a name and renames the complete file.
  const fs::path part = path(one_.hash).string() + ".part-a1b2c3";
  write(part, {one_.bytes.begin(), one_.bytes.begin() + 1000});
  age(part, 2);
  GroomCache cache(folder_, kFileBytes, counters_);
  EXPECT_FALSE(cache.is_cached(one_.hash));
  EXPECT_FALSE(cache.find(one_.hash));
  cache.put(two_.hash, two_.bytes);
  EXPECT_FALSE(fs::exists(part));
  EXPECT_TRUE(cache.find(two_.hash));
}

TEST_F(GroomCacheTest, what_was_used_least_lately_goes_first) {
  GroomCache cache(folder_, 2 * kFileBytes, counters_);
  cache.put(one_.hash, one_.bytes);
  cache.put(two_.hash, two_.bytes);
  // The file of `one_` is older than that of `two_`, until the find() below makes it the newer one.
  age(path(one_.hash), 3);
  age(path(two_.hash), 2);
  EXPECT_TRUE(cache.find(one_.hash));
  cache.put(three_.hash, three_.bytes);
  EXPECT_TRUE(cache.is_cached(one_.hash));
  EXPECT_FALSE(cache.is_cached(two_.hash));
  EXPECT_TRUE(cache.is_cached(three_.hash));
  EXPECT_EQ(counters_.groom_cache_evicted.value(), 1u);
}

TEST_F(GroomCacheTest, small_files_are_bounded_in_number) {
  // The last number allows three files: without it, files of one byte would make each put list a folder of millions.
  CacheFolder folder({folder_, ".hngroom", kPlenty, kFileBytes, "write_failed", "grooms", 3},
                     counters_.groom_cache_written, counters_.groom_cache_writes_failed, counters_.groom_cache_evicted);
  for (std::uint8_t name = 1; name <= 5; ++name) {
    EXPECT_TRUE(folder.put(wire::GroomHash{name}, std::vector<std::uint8_t>{name}));
    age(path(wire::GroomHash{name}), 10 - name);
  }
  EXPECT_EQ(file_count(), 3u);
  EXPECT_EQ(counters_.groom_cache_evicted.value(), 2u);
  EXPECT_FALSE(fs::exists(path(wire::GroomHash{2})));
  EXPECT_TRUE(fs::exists(path(wire::GroomHash{5})));
}

TEST_F(GroomCacheTest, a_folder_that_cannot_be_written_is_one_warning_and_no_failure) {
  // A file takes the folder's place: not even root may write within it.
  write(folder_, {1, 2, 3});
  testing::internal::CaptureStdout();
  {
    GroomCache cache(folder_, kPlenty, counters_);
    cache.put(one_.hash, one_.bytes);
    cache.put(two_.hash, two_.bytes);
    cache.refresh();
    EXPECT_FALSE(cache.is_cached(one_.hash));
    EXPECT_FALSE(cache.find(one_.hash));
  }
  const std::string said = testing::internal::GetCapturedStdout();
  const std::size_t first = said.find("event=groom_cache_write_failed folder=");
  EXPECT_NE(first, std::string::npos) << said;
  EXPECT_EQ(said.find("event=groom_cache_write_failed", first + 1), std::string::npos) << said;
  EXPECT_EQ(counters_.groom_cache_writes_failed.value(), 2u);
}

TEST_F(GroomCacheTest, servers_that_share_a_folder_find_whole_files_only) {
  const std::vector<const File*> files{&one_, &two_, &three_};
  std::vector<std::thread> servers;
  std::vector<GroomCacheCounters> counters(4);
  std::atomic<int> wrong{0};
  for (GroomCacheCounters& own : counters) {
    servers.emplace_back([&] {
      GroomCache cache(folder_, 2 * kFileBytes, own);
      for (std::size_t round = 0; round < 60; ++round) {
        // There is room for two of the three, so servers also evict each other's files.
        const File& file = *files[round / 2 % 3];
        const GroomCache::Bytes found = cache.find(file.hash);
        if (found && *found != file.bytes) ++wrong;
        if (!found) cache.put(file.hash, file.bytes);
      }
    });
  }
  for (std::thread& server : servers) server.join();
  EXPECT_EQ(wrong, 0);
  std::uint64_t hits = 0;
  for (const GroomCacheCounters& own : counters) {
    EXPECT_EQ(own.groom_cache_rejected_damaged.value() + own.groom_cache_rejected_unreadable.value(), 0u);
    hits += own.groom_cache_hits.value();
  }
  EXPECT_GT(hits, 0u);
}

}  // namespace
}  // namespace hairnet::server
