#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "core/levels/build.hpp"
#include "schema/wire/level_file.hpp"
#include "tests/support/equal_levels.hpp"
#include "tests/support/learnt.hpp"
#include "tests/unit/server/groom_store_fixture.hpp"
#include "tests/unit/server/memory_objects.hpp"

namespace hairnet::server {
namespace {

namespace fs = std::filesystem;
using testing::ElementsAre;
using testing::IsEmpty;
using wire::ErrorReason;
using wire::GroomState;
using Outcome = ObjectAnswer::Outcome;

constexpr std::uint64_t kFolderBytesMax = std::uint64_t{1} << 30;

std::string hex(const wire::GroomHash& hash) {
  std::string text;
  for (const std::uint8_t byte : hash) {
    text += "0123456789abcdef"[byte >> 4];
    text += "0123456789abcdef"[byte & 15];
  }
  return text;
}

// Returns the object name of a groom's levels, which has the version of the build: other versions' levels are not
// valid.
std::string levels_name(const wire::GroomHash& groom) {
  return hex(groom) + "-" + std::to_string(kBuildVersion) + ".hnlevels";
}

// Tests a groom store with a cache on disk, and behind it an object store that all servers share. Its objects are in
// memory.
class GroomObjectsTest : public GroomStoreTest {
 protected:
  GroomObjectsTest() { start(); }
  // Replaces the server by another one. Its folder is empty unless keeps_folder is true; the objects stay.
  void start(bool keeps_folder = false, const GroomStoreLimits& limits = {}) {
    if (!keeps_folder) fs::remove_all(folder_);
    store_.reset();
    builder_.reset();
    sync_.reset();
    cache_.emplace(
        folder_, kFolderBytesMax, cache_counters_,
        std::make_unique<CacheObjects>(GroomCache::objects_def(object_counters_), objects_, object_counters_));
    make(limits);
    sync_.emplace(&*cache_, nullptr, objects_, object_counters_);
    store_->find_in(*sync_);
    sent_.clear();
  }
  void run() {
    for (int round = 0; round < 4; ++round) {
      while (sync_->poll()) {
      }
      build();
    }
  }
  [[nodiscard]] std::string name() const { return hex(good_.hash) + ".hngroom"; }

  MemoryObjects objects_;
  ObjectCounters object_counters_;
  std::optional<ObjectSync> sync_;
};

TEST_F(GroomObjectsTest, a_groom_that_one_server_got_is_not_uploaded_to_the_next) {
  EXPECT_EQ(offer(kAnna, good_), ErrorReason::none);
  EXPECT_THAT(needs(kAnna), IsEmpty()) << "the store is asked first";
  run();
  EXPECT_THAT(needs(kAnna), ElementsAre(0u));
  EXPECT_EQ(send_all(kAnna, good_), ErrorReason::none);
  run();
  EXPECT_TRUE(store_->ready(good_.hash));
  EXPECT_EQ(objects_.objects.at(name()), good_.bytes);
  EXPECT_EQ(object_counters_.stored_groom.value(), 1u);
  EXPECT_EQ(object_counters_.absent_groom.value(), 1u);

  start();
  EXPECT_EQ(offer(kAnna, good_), ErrorReason::none);
  EXPECT_EQ(offer(kBert, good_), ErrorReason::none) << "both wait for the store";
  EXPECT_EQ(store_->retain(kAnna, good_.hash, now_ns_).reason, ErrorReason::none);
  run();
  EXPECT_THAT(needs(kAnna), ElementsAre(good_.bytes.size()));
  EXPECT_THAT(needs(kBert), ElementsAre(good_.bytes.size()));
  EXPECT_THAT(states(kBert), ElementsAre(GroomState::queued, GroomState::building, GroomState::ready));
  EXPECT_THAT(errors(kAnna), IsEmpty());
  EXPECT_EQ(counters_.grooms_uploaded.value(), 1u);
  EXPECT_EQ(counters_.grooms_shared.value(), 2u);
  EXPECT_EQ(object_counters_.read_groom.value(), 1u);
  EXPECT_EQ(object_counters_.bytes_read.value(), good_.bytes.size());
  EXPECT_TRUE(store_->is_cached(good_.hash)) << "the folder has it now";
  EXPECT_EQ(objects_.puts.size(), 1u) << "what came from there is not put there";
}

TEST_F(GroomObjectsTest, a_prepared_groom_comes_from_the_store) {
  objects_.objects[name()] = good_.bytes;
  store_->prepare(std::array{good_.hash, wire::GroomHash{9}}, now_ns_);
  run();
  EXPECT_TRUE(store_->ready(good_.hash));
  EXPECT_EQ(store_->groom_count(), 1u) << "the store lacks the other one";
  EXPECT_THAT(sent_, IsEmpty());
}

// Objects may be damaged, or written by somebody else. Their bytes must have the hash of the name, and an upload
// replaces an object that has not.
TEST_F(GroomObjectsTest, wrong_bytes_are_refused_and_replaced_after_the_upload) {
  std::vector<std::uint8_t> flipped = good_.bytes, longer = good_.bytes;
  flipped[good_.bytes.size() / 2] ^= 1;
  longer.push_back(0);
  std::uint64_t rejected = 0;
  for (const auto& wrong : {std::vector<std::uint8_t>{}, flipped, longer, std::vector<std::uint8_t>(100, 7)}) {
    start();
    objects_.objects[name()] = wrong;
    offer(kAnna, good_);
    run();
    EXPECT_EQ(object_counters_.rejected_hash.value(), ++rejected);
    EXPECT_TRUE(fs::is_empty(folder_));
    EXPECT_THAT(needs(kAnna), ElementsAre(0u));
    EXPECT_THAT(errors(kAnna), IsEmpty());
    send_all(kAnna, good_);
    run();
    EXPECT_TRUE(store_->ready(good_.hash));
    EXPECT_EQ(objects_.objects.at(name()), good_.bytes);
  }
  EXPECT_EQ(object_counters_.read_groom.value(), 0u);
}

TEST_F(GroomObjectsTest, without_an_answer_the_upload_is_asked_for_and_put_when_the_store_is_back) {
  for (const Outcome failure : {Outcome::unreachable, Outcome::too_large}) {
    objects_.failure = failure;
    start();
    offer(kAnna, good_);
    run();
    EXPECT_THAT(needs(kAnna), ElementsAre(0u));
  }
  EXPECT_EQ(object_counters_.rejected_size.value(), 1u);
  // A store that failed lately is left alone for a while: is_open tells whether it takes calls.
  objects_.is_open = false;
  objects_.failure = Outcome::read;
  start();
  EXPECT_EQ(offer(kAnna, good_), ErrorReason::none);
  EXPECT_THAT(needs(kAnna), ElementsAre(0u)) << "at once while the store is left alone";
  send_all(kAnna, good_);
  run();
  EXPECT_TRUE(store_->ready(good_.hash));
  EXPECT_TRUE(objects_.objects.empty());
  objects_.is_open = true;
  run();
  EXPECT_EQ(objects_.objects.at(name()), good_.bytes);
}

TEST_F(GroomObjectsTest, a_put_without_an_answer_is_tried_again_and_a_refused_one_is_not) {
  offer(kAnna, good_);
  run();
  send_all(kAnna, good_);
  build();
  objects_.failure = Outcome::unreachable;
  EXPECT_TRUE(sync_->poll());
  objects_.failure = Outcome::read;
  EXPECT_TRUE(sync_->poll());
  EXPECT_EQ(objects_.puts.size(), 2u);
  EXPECT_TRUE(objects_.objects.contains(name()));
  EXPECT_FALSE(sync_->poll());

  objects_.objects.clear();
  start(true);
  offer(kAnna, good_);
  build();
  EXPECT_EQ(cache_->waiting_puts(), 1u) << "found in the folder, and perhaps not in the store";
  objects_.failure = Outcome::refused;
  EXPECT_TRUE(sync_->poll());
  EXPECT_FALSE(sync_->poll());
  EXPECT_EQ(object_counters_.puts_dropped_refused.value(), 1u);
}

TEST_F(GroomObjectsTest, a_file_that_the_folder_lost_is_not_put) {
  offer(kAnna, good_);
  run();
  send_all(kAnna, good_);
  build();
  corrupt_kept();
  EXPECT_TRUE(sync_->poll());
  EXPECT_EQ(object_counters_.puts_dropped_absent.value(), 1u);
  EXPECT_THAT(objects_.puts, IsEmpty());
}

TEST_F(GroomObjectsTest, a_damaged_file_of_the_folder_is_replaced_from_the_store) {
  offer(kAnna, good_);
  run();
  send_all(kAnna, good_);
  run();
  corrupt_kept();
  start(true);
  offer(kAnna, good_);
  run();
  EXPECT_TRUE(store_->ready(good_.hash));
  EXPECT_EQ(cache_counters_.groom_cache_rejected_damaged.value(), 1u);
  EXPECT_EQ(object_counters_.read_groom.value(), 1u);
  EXPECT_EQ(counters_.grooms_uploaded.value(), 1u);
}

TEST_F(GroomObjectsTest, a_slow_store_is_not_waited_for_longer_than_for_anothers_upload) {
  objects_.objects[name()] = good_.bytes;
  offer(kAnna, good_);
  store_->poll(now_ns_);
  // The limit is upload_patience_ns, 5 s.
  now_ns_ += 6 * kSecond_ns;
  store_->poll(now_ns_);
  EXPECT_THAT(needs(kAnna), ElementsAre(0u));
  chunk(kAnna, good_, 0, 10);
  // The store answers at last.
  run();
  EXPECT_THAT(needs(kAnna), ElementsAre(0u)) << "and the upload goes on";
  chunk(kAnna, good_, 10, good_.bytes.size());
  run();
  EXPECT_TRUE(store_->ready(good_.hash));
  EXPECT_EQ(counters_.grooms_uploaded.value(), 1u);
}

TEST_F(GroomObjectsTest, a_session_that_leaves_while_the_store_is_asked_takes_its_groom_along) {
  objects_.objects[name()] = good_.bytes;
  offer(kAnna, good_);
  store_->release(kAnna, now_ns_);
  EXPECT_EQ(store_->groom_count(), 0u);
  offer(kBert, good_);
  run();
  EXPECT_EQ(objects_.gets.size(), 1u) << "asked once";
  EXPECT_TRUE(store_->ready(good_.hash));
  store_->release(kBert, now_ns_);
  run();
}

// Anyone can name a hash. A search for each name would let a client keep the store busy with grooms that do not exist.
TEST_F(GroomObjectsTest, a_groom_that_no_session_offers_is_not_looked_for) {
  objects_.objects[name()] = good_.bytes;
  EXPECT_EQ(store_->retain(kAnna, good_.hash, now_ns_).reason, ErrorReason::groom_unknown);
  EXPECT_FALSE(store_->fetch(kAnna, good_.hash));
  run();
  EXPECT_THAT(objects_.gets, IsEmpty());
}

TEST_F(GroomObjectsTest, chunks_that_come_while_the_store_is_asked_were_not_asked_for) {
  offer(kAnna, good_);
  EXPECT_EQ(chunk(kAnna, good_, 0, 10), ErrorReason::unexpected_message);
}

TEST_F(GroomObjectsTest, more_grooms_than_may_wait_for_the_store_are_uploaded) {
  std::vector<Upload> many;
  // At most 64 grooms wait for the store (kWantedMax in object_sync.cpp); sessions with the other six are asked for
  // their bytes at once.
  for (std::uint8_t i = 0; i < 70; ++i) many.emplace_back(std::vector<std::uint8_t>(10, i));
  for (SessionId i = 0; i < many.size(); ++i) EXPECT_EQ(offer(1 + i, many[i]), ErrorReason::none);
  EXPECT_EQ(object_counters_.finds_skipped.value(), 6u);
  EXPECT_THAT(needs(70), ElementsAre(0u));
  EXPECT_THAT(needs(1), IsEmpty());
  run();
  EXPECT_THAT(needs(1), ElementsAre(0u));
}

TEST_F(GroomObjectsTest, a_groom_of_another_length_than_offered_is_refused) {
  objects_.objects[name()] = good_.bytes;
  store_->offer(kAnna, {good_.hash, good_.bytes.size() + 1}, now_ns_);
  run();
  EXPECT_THAT(errors(kAnna), ElementsAre(ErrorReason::groom_hash_mismatch));
}

class LevelObjectsTest : public testing::Test {
 protected:
  ~LevelObjectsTest() override { fs::remove_all(folder_); }
  static const LevelSet& levels() {
    static const auto levels = build_levels(small_groom());
    return *levels;
  }
  std::unique_ptr<LevelCache> cache(const std::string& folder) {
    return std::make_unique<LevelCache>(
        folder_ / folder, kFolderBytesMax, counters_,
        std::make_unique<CacheObjects>(LevelCache::objects_def(object_counters_), objects_, object_counters_));
  }

  fs::path folder_ = fs::path(testing::TempDir()) / ("level_objects_" + std::to_string(::getpid()));
  LevelCacheCounters counters_;
  MemoryObjects objects_;
  ObjectCounters object_counters_;
  wire::GroomHash groom_{3};
};

TEST_F(LevelObjectsTest, levels_that_one_server_has_built_are_found_by_the_next) {
  const auto first = cache("first"), second = cache("second");
  first->put(groom_, levels());
  EXPECT_FALSE(second->find(groom_));
  EXPECT_TRUE(first->put_next());
  EXPECT_FALSE(first->put_next());
  EXPECT_THAT(objects_.puts, ElementsAre(levels_name(groom_)));
  const std::shared_ptr<LevelSet> found = second->find(groom_);
  ASSERT_TRUE(found);
  support::expect_equal((*found)[LevelIndex::high], levels()[LevelIndex::high]);
  EXPECT_EQ(object_counters_.read_levels.value(), 1u);
  EXPECT_TRUE(second->find(groom_)) << "in its folder now";
  EXPECT_EQ(counters_.level_cache_hits.value(), 1u);
  EXPECT_EQ(second->waiting_puts(), 0u);
}

TEST_F(LevelObjectsTest, levels_that_are_not_valid_are_refused_and_replaced) {
  const std::vector<std::uint8_t> good = wire::encode_levels(groom_, levels());
  std::vector<std::uint8_t> flipped = good, longer = good;
  flipped[good.size() / 2] ^= 1;
  longer.push_back(0);
  const std::vector<std::uint8_t> half(good.begin(), good.begin() + static_cast<std::ptrdiff_t>(good.size() / 2));
  const auto one = cache("one");
  std::uint64_t rejected = 0;
  for (const auto& wrong :
       {std::vector<std::uint8_t>{}, flipped, longer, half, wire::encode_levels(wire::GroomHash{4}, levels())}) {
    objects_.objects[levels_name(groom_)] = wrong;
    EXPECT_FALSE(one->find(groom_));
    EXPECT_EQ(object_counters_.rejected_levels.value(), ++rejected);
    EXPECT_TRUE(fs::is_empty(folder_ / "one"));
  }
  one->put(groom_, levels());
  EXPECT_TRUE(one->put_next());
  EXPECT_EQ(objects_.objects.at(levels_name(groom_)), good);
  EXPECT_EQ(object_counters_.stored_levels.value(), 1u);
}

// A put keeps an object that exists, because another server has built the same levels. Levels with learnt hair are
// worth more, so they replace it.
TEST_F(LevelObjectsTest, levels_of_the_store_are_kept_and_those_with_learnt_hair_replace_them) {
  objects_.objects[levels_name(groom_)] = {1, 2, 3};
  const auto one = cache("one");
  one->put(groom_, levels());
  EXPECT_TRUE(one->put_next());
  EXPECT_EQ(object_counters_.kept_levels.value(), 1u);
  EXPECT_EQ(objects_.objects.at(levels_name(groom_)).size(), 3u);
  one->put(groom_, levels());
  EXPECT_FALSE(one->put_next()) << "the store is known to have it";
  LevelSet learnt = levels();
  learnt.learnt = std::make_shared<LearntHair>(support::random_learnt_hair(4));
  one->put(groom_, learnt);
  EXPECT_TRUE(one->put_next());
  EXPECT_EQ(objects_.objects.at(levels_name(groom_)), wire::encode_levels(groom_, learnt));
}

}  // namespace
}  // namespace hairnet::server
