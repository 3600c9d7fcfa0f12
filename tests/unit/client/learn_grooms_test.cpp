#include <gmock/gmock.h>
#include <unistd.h>

#include <algorithm>
#include <atomic>
#include <chrono>
#include <filesystem>
#include <fstream>
#include <iterator>

#include "client/assets/made/made.hpp"
#include "client/tools/groom/commands.hpp"
#include "core/learnt/learnt_hair.hpp"
#include "core/levels/build.hpp"
#include "schema/wire/groom_file.hpp"
#include "schema/wire/level_file.hpp"
#include "tests/unit/server/poll_fixture.hpp"

namespace hairnet::groom {
namespace {

namespace fs = std::filesystem;
using testing::HasSubstr;

using Bytes = std::vector<std::uint8_t>;

// kShort learns hair that is better than the low level, in some seconds. kHardly has a learning rate of zero, so what
// it learns is always refused.
constexpr HairLearning kShort{
    .motion_count = 192, .validation_count = 16, .duration_s = 4, .hidden_count = 24, .rounds = 24};
constexpr HairLearning kHardly{.motion_count = 16, .validation_count = 16, .duration_s = 1, .rounds = 1, .rate = 0};
// So few motions give modes of low quality, in a short time.
constexpr ModeTraining kSomeTraining{.motion_count = 8, .duration_s = 2};

void write(const fs::path& to, const Bytes& bytes) {
  std::ofstream file(to, std::ios::binary);
  file.write(reinterpret_cast<const char*>(bytes.data()), static_cast<std::streamsize>(bytes.size()));
}

Bytes read(const fs::path& from) {
  std::ifstream file(from, std::ios::binary);
  return {std::istreambuf_iterator<char>(file), {}};
}

Bytes groom_bytes(const std::string& style) {
  HairstyleOptions options;
  options.strand_count = 400;
  return wire::encode_groom(*make_hairstyle(style, options));
}

// Learns the hair of one groom for the whole suite, in the folder "learnt", and gives each test a folder "levels" of
// its own.
class LearnGrooms : public server::PollTest {
 protected:
  static void SetUpTestSuite() {
    suite_ = fs::path(testing::TempDir()) / ("learn_grooms_" + std::to_string(::getpid()));
    fs::remove_all(suite_);
    fs::create_directories(suite_ / "learnt");
    write(suite_ / "long.groom", groom_bytes("long_straight"));
    LearnOptions options = options_for("learnt");
    options.learning = kShort;
    const Result<void> learnt = learn_grooms(options);
    EXPECT_TRUE(learnt) << learnt.error();
  }
  static void TearDownTestSuite() { fs::remove_all(suite_); }

  LearnGrooms() {
    fs::create_directories(suite_ / "levels");
    bytes_ = read(suite_ / "long.groom");
    hash_ = wire::hash_groom(bytes_);
  }
  ~LearnGrooms() override { fs::remove_all(suite_ / "levels"); }

  static LearnOptions options_for(const std::string& folder) {
    LearnOptions options;
    options.grooms = {(suite_ / "long.groom").string()};
    options.levels = (suite_ / folder).string();
    options.training = kSomeTraining;
    options.learning = kHardly;
    return options;
  }
  static std::string refusal(const LearnOptions& options) {
    const Result<void> learnt = learn_grooms(options);
    return learnt ? "" : learnt.error();
  }
  [[nodiscard]] fs::path file_in(const std::string& folder) const {
    return suite_ / folder / wire::level_file_name(hash_);
  }

  static inline fs::path suite_;
};

TEST_F(LearnGrooms, a_server_with_the_folder_has_the_learnt_level_at_once) {
  build_ = [](const auto&, const auto&, const auto&, const Groom&, const server::GoesOn&) -> server::LevelBuild {
    ADD_FAILURE() << "the levels are in the folder";
    return {nullptr, server::BuildError::crash, "not built"};
  };
  server::Config config;
  config.level_cache = (suite_ / "learnt").string();
  config.grooms.learning = server::Learning::never;
  start(config);
  const auto owner = join("", LevelIndex::low);
  run_ms(1000, {owner.get()});
  EXPECT_EQ(metrics_.level_cache.level_cache_hits.value(), 1u);
  // The server must not learn again what lies in the folder.
  EXPECT_EQ(metrics_.groom.grooms_learnt.value(), 0u);
  const auto batches = owner->connection->all<wire::FrameBatch>();
  ASSERT_FALSE(batches.empty());
  ASSERT_EQ(batches.back().frames.size(), 1u);
  EXPECT_EQ(batches.back().frames[0].level, LevelIndex::learnt);
}

// Gives tests a groom file that contains its learnt hair. A server that builds levels for it gets those on which the
// hair was learnt.
class EmbeddedHair : public LearnGrooms {
 protected:
  EmbeddedHair() {
    without_ = bytes_;
    learnt_ = wire::decode_levels(read(file_in("learnt")), hash_).levels;
    LearnOptions options = options_for("learnt");
    options.embed = (suite_ / "levels").string();
    EXPECT_EQ(refusal(options), "") << "what is learnt already is embedded as well";
    bytes_ = read(suite_ / "levels" / "long.groom");
    hash_ = wire::hash_groom(bytes_);
    learn_ = [this](const Groom&, const auto&, const BuildCallbacks&) -> Result<std::shared_ptr<const LearntHair>> {
      ++learnt_here_;
      return learnt_->learnt;
    };
    build_ = [this](const auto&, const auto&, const auto&, const Groom& groom, const server::GoesOn&) {
      auto levels = std::make_shared<LevelSet>(*learnt_);
      levels->learnt = nullptr;
      make_level_maps(groom, *levels);
      return server::LevelBuild{std::move(levels), server::BuildError::none, ""};
    };
  }
  void run_until_learnt() {
    server::Config config;
    config.grooms.learning = server::Learning::always;
    start(config);
    const auto owner = join("", LevelIndex::low);
    const auto deadline = std::chrono::steady_clock::now() + std::chrono::minutes(4);
    while (metrics_.groom.grooms_learnt.value() == 0 && std::chrono::steady_clock::now() < deadline)
      run_ms(100, {owner.get()});
    EXPECT_EQ(metrics_.groom.grooms_learnt.value(), 1u);
  }
  Bytes without_;
  std::shared_ptr<LevelSet> learnt_;
  std::atomic<int> learnt_here_ = 0;
};

TEST_F(EmbeddedHair, is_that_which_was_learnt_beside_the_same_groom) {
  const auto inside = wire::decode_learnt_of_groom(bytes_);
  ASSERT_TRUE(inside && *inside);
  EXPECT_EQ((*inside)->hidden_weights, learnt_->learnt->hidden_weights);
  EXPECT_EQ((*inside)->output_weights, learnt_->learnt->output_weights);
  EXPECT_EQ((*inside)->wind.weights, learnt_->learnt->wind.weights);
  EXPECT_EQ(wire::encode_groom(*wire::decode_groom(bytes_)), without_);
  const auto nothing = wire::decode_learnt_of_groom(without_);
  ASSERT_TRUE(nothing);
  EXPECT_EQ(*nothing, nullptr);
}

TEST_F(EmbeddedHair, is_taken_over_where_it_is_good) {
  run_until_learnt();
  EXPECT_EQ(metrics_.groom.grooms_learnt_accepted.value(), 1u);
  EXPECT_EQ(metrics_.groom.grooms_learnt_file_refused.value(), 0u);
  EXPECT_EQ(learnt_here_, 0);
}

TEST_F(EmbeddedHair, is_refused_where_it_is_worse_than_the_low_level_and_learnt_there) {
  // A network without input weights does not follow the pose, so its hair is worse than the low level. It would not be
  // enough to corrupt the output weights, since the server fits them again.
  LearntHair numb = *learnt_->learnt;
  std::ranges::fill(numb.input_weights, 0.0f);
  bytes_ = wire::encode_groom(*wire::decode_groom(without_), &numb);
  hash_ = wire::hash_groom(bytes_);
  run_until_learnt();
  EXPECT_EQ(metrics_.groom.grooms_learnt_accepted.value(), 0u);
  EXPECT_EQ(metrics_.groom.grooms_learnt_file_refused.value(), 1u);
  // The server learns the hair itself then, by `learn_` of this fixture.
  EXPECT_EQ(learnt_here_, 1);
}

// With `embed` the tool writes copies of grooms. A copy in the folder of its original, or of two grooms of one name,
// would overwrite a user's file.
TEST_F(LearnGrooms, a_copy_replaces_no_file_that_was_named) {
  LearnOptions options = options_for("learnt");
  fs::create_directories(suite_ / "levels" / "copies");
  fs::copy(suite_ / "long.groom", suite_ / "levels" / "copies" / "long.groom");
  options.grooms = {(suite_ / "levels" / "copies" / "long.groom").string()};
  options.embed = (suite_ / "levels" / "copies").string();
  EXPECT_THAT(refusal(options), HasSubstr("long.groom: lies in "));
  fs::create_directories(suite_ / "levels" / "other");
  fs::copy(suite_ / "long.groom", suite_ / "levels" / "other" / "long.groom");
  options.grooms.push_back((suite_ / "levels" / "other" / "long.groom").string());
  options.embed = (suite_ / "levels").string();
  EXPECT_THAT(refusal(options), HasSubstr("another file has this name"));
  EXPECT_FALSE(fs::exists(suite_ / "levels" / "long.groom"));
}

TEST_F(LearnGrooms, hair_that_is_already_learnt_is_learnt_again_only_when_asked) {
  const Bytes before = read(file_in("learnt"));
  LearnOptions options = options_for("learnt");
  int asked = 0;
  // This stops at once if anything is learnt at all.
  options.is_stopped = [&asked] { return ++asked > 0; };
  EXPECT_EQ(refusal(options), "");
  EXPECT_EQ(asked, 0);
  options.again = true;
  EXPECT_THAT(refusal(options), HasSubstr("stopped; nothing was written"));
  EXPECT_GT(asked, 0);
  EXPECT_EQ(read(file_in("learnt")), before);
}

TEST_F(LearnGrooms, hair_that_errs_more_when_learnt_again_leaves_what_there_is) {
  const Bytes before = read(file_in("learnt"));
  LearnOptions options = options_for("learnt");
  options.again = true;
  EXPECT_EQ(refusal(options), "1 of 1 grooms have no learnt hair");
  EXPECT_EQ(read(file_in("learnt")), before);
}

TEST_F(LearnGrooms, a_stop_at_any_moment_leaves_nothing_behind) {
  // The work asks is_stopped again and again. These numbers of calls stop it at different stages.
  for (const int calls : {1, 20, 200}) {
    LearnOptions options = options_for("levels");
    options.learning = kShort;
    int asked = 0;
    options.is_stopped = [&] { return ++asked >= calls; };
    EXPECT_THAT(refusal(options), HasSubstr("long.groom: stopped; nothing was written for it")) << calls;
    EXPECT_TRUE(fs::is_empty(suite_ / "levels")) << calls;
  }
}

TEST_F(LearnGrooms, a_refused_groom_has_its_levels_without_learnt_hair_in_place_of_a_damaged_file) {
  write(file_in("levels"), Bytes(1000, 7));
  EXPECT_EQ(refusal(options_for("levels")), "1 of 1 grooms have no learnt hair");
  const wire::DecodedLevels decoded = wire::decode_levels(read(file_in("levels")), hash_);
  ASSERT_TRUE(decoded.levels) << decoded.detail;
  EXPECT_TRUE(decoded.levels->modes);
  EXPECT_FALSE(decoded.levels->learnt);
}

// Learning takes minutes, and a mistake in the command line must not show after them.
TEST_F(LearnGrooms, what_is_wrong_is_told_before_anything_is_learnt) {
  const std::string junk = (suite_ / "levels" / "junk.groom").string(), absent = (suite_ / "absent.groom").string();
  write(junk, Bytes(500, 7));
  const auto refusal_of = [&](const auto& corrupt) {
    LearnOptions options = options_for("levels");
    options.is_stopped = []() -> bool {
      ADD_FAILURE() << "it has begun";
      return true;
    };
    corrupt(options);
    return refusal(options);
  };
  EXPECT_THAT(refusal_of([](LearnOptions& o) { o.levels += "/none"; }), HasSubstr("levels/none: make it first"));
  EXPECT_THAT(refusal_of([&](LearnOptions& o) { o.levels = junk; }), HasSubstr("junk.groom: is no folder"));
  EXPECT_THAT(refusal_of([&](LearnOptions& o) { o.grooms.push_back(junk); }), HasSubstr("junk.groom: not a .groom"));
  EXPECT_THAT(refusal_of([&](LearnOptions& o) { o.grooms.push_back(absent); }), HasSubstr("absent.groom: cannot be"));
  EXPECT_THAT(refusal_of([](LearnOptions& o) { o.grooms.push_back("made:bob"); }),
              HasSubstr("hairnet-groom make bob --out"));
}

}  // namespace
}  // namespace hairnet::groom
