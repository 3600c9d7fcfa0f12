#include <gmock/gmock.h>
#include <gtest/gtest.h>
#include <sys/resource.h>
#include <sys/wait.h>
#include <unistd.h>

#include <csignal>
#include <filesystem>
#include <fstream>

#include "core/broken_pipe.hpp"
#include "schema/wire/groom_file.hpp"
#include "server/grooms/level_build.hpp"
#include "tests/support/build_grooms.hpp"
#include "tests/support/equal_levels.hpp"
#include "tests/support/quick_training.hpp"
#include "tests/unit/server/small_groom.hpp"

// A build's process is this program, started again with kLevelBuildFlag.
int main(int argc, char** argv) {
  hairnet::ignore_broken_pipes();
  if (argc == 2 && std::string_view(argv[1]) == hairnet::server::kLevelBuildFlag)
    return hairnet::server::run_level_build_process();
  testing::InitGoogleMock(&argc, argv);
  return RUN_ALL_TESTS();
}

namespace hairnet::server {
namespace {

// Lets a build go on to its end.
BuildError always() {
  return BuildError::none;
}

// All that a build needs, for one groom.
struct Ordered {
  explicit Ordered(const Groom& g)
      : file(wire::encode_groom(g)), groom(wire::decode_groom(file).value()), hash(wire::hash_groom(file)) {
    def.training = support::kQuickTraining;
  }
  [[nodiscard]] LevelBuild build(const GoesOn& goes_on = always) const {
    return build_levels_in_child_process(def, hash, file, groom, goes_on);
  }
  LevelBuildDef def;
  std::vector<std::uint8_t> file;
  Groom groom;
  wire::GroomHash hash;
};

// Returns true while a child process of this one exists: none may be left behind.
bool has_children() {
  return ::waitpid(-1, nullptr, WNOHANG) >= 0;
}

pid_t child_of_this_process() {
  for (const auto& entry : std::filesystem::directory_iterator("/proc")) {
    std::ifstream file(entry.path() / "stat");
    pid_t id = 0, parent = 0;
    std::string name, state;
    if (file >> id >> name >> state >> parent && parent == ::getpid()) return id;
  }
  return 0;
}

TEST(LevelBuildProcess, gives_the_bits_of_a_build_in_this_process) {
  Ordered order(small_groom());
  order.def.thread_count = 2;
  const LevelBuild own = order.build(),
                   here = build_levels_in_process(order.def, order.hash, order.file, order.groom, always);
  ASSERT_EQ(own.error, BuildError::none) << own.detail;
  ASSERT_TRUE(own.levels && here.levels);
  support::expect_equal(*here.levels, *own.levels);
  EXPECT_FALSE(has_children());
}

TEST(LevelBuildProcess, of_bytes_that_are_no_groom_says_so) {
  Ordered order(small_groom());
  order.file.assign(500, 7);
  const LevelBuild build = order.build();
  EXPECT_EQ(build.error, BuildError::invalid);
  EXPECT_FALSE(build.detail.empty());
  EXPECT_FALSE(build.levels);
}

TEST(LevelBuildProcess, that_takes_too_much_memory_ends_alone) {
  if (HAIRNET_SANITIZED) GTEST_SKIP() << "sanitizers need terabytes of addresses, so the limit is off";
  Ordered order(support::make_zigzag(40'000));
  order.def.memory_bytes_max = 16 << 20;
  const LevelBuild build = order.build();
  EXPECT_EQ(build.error, BuildError::memory) << build.detail;
  EXPECT_THAT(build.detail, testing::HasSubstr("16 MiB"));
  EXPECT_FALSE(has_children());
}

TEST(LevelBuildProcess, ends_when_it_may_not_go_on) {
  for (const BuildError error : {BuildError::time, BuildError::dropped}) {
    // The strand needs so many springs that its build lasts for more looks than four; the parent looks every 20 ms
    // (kLookPeriod_ms).
    Ordered order(support::make_zigzag(10'000));
    int looks = 0;
    EXPECT_EQ(order.build([&] { return ++looks > 3 ? error : BuildError::none; }).error, error);
    EXPECT_EQ(looks, 4) << "it is not asked again";
    EXPECT_FALSE(has_children());
  }
}

TEST(LevelBuildProcess, without_descriptors_or_processes_is_an_error_of_the_server) {
  const Ordered order(small_groom());
  for (const auto resource : {RLIMIT_NOFILE, RLIMIT_NPROC}) {
    // The limit on processes does not bind root.
    if (resource == RLIMIT_NPROC && ::geteuid() == 0) continue;
    rlimit limit{};
    ASSERT_EQ(::getrlimit(resource, &limit), 0);
    const rlimit none{0, limit.rlim_max};
    ASSERT_EQ(::setrlimit(resource, &none), 0);
    const LevelBuild build = order.build();
    ASSERT_EQ(::setrlimit(resource, &limit), 0);
    EXPECT_EQ(build.error, BuildError::server) << build.detail;
    EXPECT_THAT(build.detail, testing::StartsWith("no "));
  }
}

// A failed assertion aborts, and would do so at each try with the same groom. The server would try an error of its own
// again.
TEST(LevelBuildProcess, that_aborts_is_no_error_of_the_server_as_it_would_again) {
  Ordered order(support::make_zigzag(10'000));
  int looks = 0;
  const LevelBuild aborted = order.build([&] {
    if (++looks == 3) {
      EXPECT_EQ(::kill(child_of_this_process(), SIGABRT), 0);
    }
    return BuildError::none;
  });
  EXPECT_EQ(aborted.error, BuildError::crash);
}

// The kernel kills a process when the machine is out of memory: this is an error of the server, and the groom may be
// built later.
TEST(LevelBuildProcess, that_is_killed_is_an_error_of_that_build_only) {
  Ordered order(support::make_zigzag(10'000));
  int looks = 0;
  const LevelBuild killed = order.build([&] {
    if (++looks == 3) {
      EXPECT_EQ(::kill(child_of_this_process(), SIGKILL), 0);
    }
    return BuildError::none;
  });
  EXPECT_EQ(killed.error, BuildError::server);
  EXPECT_THAT(killed.detail, testing::HasSubstr("signal 9"));
  EXPECT_EQ(Ordered(small_groom()).build().error, BuildError::none);
}

}  // namespace
}  // namespace hairnet::server
