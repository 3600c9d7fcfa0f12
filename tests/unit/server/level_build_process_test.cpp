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

// The processes of the builds are this program.
int main(int argc, char** argv) {
  hairnet::ignore_broken_pipes();
  if (argc == 2 && std::string_view(argv[1]) == hairnet::server::kLevelBuildFlag)
    return hairnet::server::run_level_build_process();
  testing::InitGoogleMock(&argc, argv);
  return RUN_ALL_TESTS();
}

namespace hairnet::server {
namespace {

BuildFault always() {
  return BuildFault::none;
}

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
  ASSERT_EQ(own.fault, BuildFault::none) << own.detail;
  ASSERT_TRUE(own.levels && here.levels);
  support::expect_equal(*here.levels, *own.levels);
  EXPECT_FALSE(has_children());
}

TEST(LevelBuildProcess, of_bytes_that_are_no_groom_says_so) {
  Ordered order(small_groom());
  order.file.assign(500, 7);
  const LevelBuild build = order.build();
  EXPECT_EQ(build.fault, BuildFault::invalid);
  EXPECT_FALSE(build.detail.empty());
  EXPECT_FALSE(build.levels);
}

TEST(LevelBuildProcess, that_takes_too_much_memory_ends_alone) {
  if (HAIRNET_SANITIZED) GTEST_SKIP() << "sanitizers need terabytes of addresses, so the limit is off";
  Ordered order(support::make_zigzag(40'000));
  order.def.memory_bytes_max = 16 << 20;
  const LevelBuild build = order.build();
  EXPECT_EQ(build.fault, BuildFault::memory) << build.detail;
  EXPECT_THAT(build.detail, testing::HasSubstr("16 MiB"));
  EXPECT_FALSE(has_children());
}

TEST(LevelBuildProcess, ends_when_it_may_not_go_on) {
  for (const BuildFault fault : {BuildFault::time, BuildFault::dropped}) {
    Ordered order(support::make_zigzag(10'000));
    int looks = 0;
    EXPECT_EQ(order.build([&] { return ++looks > 3 ? fault : BuildFault::none; }).fault, fault);
    EXPECT_EQ(looks, 4) << "it is not asked again";
    EXPECT_FALSE(has_children());
  }
}

TEST(LevelBuildProcess, without_descriptors_or_processes_is_a_fault_of_the_server) {
  const Ordered order(small_groom());
  for (const auto resource : {RLIMIT_NOFILE, RLIMIT_NPROC}) {
    if (resource == RLIMIT_NPROC && ::geteuid() == 0) continue;  // it does not bind root
    rlimit limit{};
    ASSERT_EQ(::getrlimit(resource, &limit), 0);
    const rlimit none{0, limit.rlim_max};
    ASSERT_EQ(::setrlimit(resource, &none), 0);
    const LevelBuild build = order.build();
    ASSERT_EQ(::setrlimit(resource, &limit), 0);
    EXPECT_EQ(build.fault, BuildFault::server) << build.detail;
    EXPECT_THAT(build.detail, testing::StartsWith("no "));
  }
}

TEST(LevelBuildProcess, that_aborts_is_no_fault_of_the_server_as_it_would_again) {
  Ordered order(support::make_zigzag(10'000));
  int looks = 0;
  const LevelBuild aborted = order.build([&] {
    if (++looks == 3) {
      EXPECT_EQ(::kill(child_of_this_process(), SIGABRT), 0);
    }
    return BuildFault::none;
  });
  EXPECT_EQ(aborted.fault, BuildFault::crash);
}

TEST(LevelBuildProcess, that_is_killed_is_a_fault_of_that_build_only) {
  Ordered order(support::make_zigzag(10'000));
  int looks = 0;
  const LevelBuild killed = order.build([&] {
    if (++looks == 3) {
      EXPECT_EQ(::kill(child_of_this_process(), SIGKILL), 0);
    }
    return BuildFault::none;
  });
  EXPECT_EQ(killed.fault, BuildFault::server);
  EXPECT_THAT(killed.detail, testing::HasSubstr("signal 9"));
  EXPECT_EQ(Ordered(small_groom()).build().fault, BuildFault::none);
}

}  // namespace
}  // namespace hairnet::server
