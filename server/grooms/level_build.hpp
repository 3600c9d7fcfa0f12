#pragma once

#include <cstddef>
#include <cstdint>
#include <functional>
#include <memory>
#include <span>
#include <string>

#include "core/groom/groom.hpp"
#include "core/levels/level.hpp"
#include "core/modes/snapshots.hpp"
#include "schema/wire/messages.hpp"

namespace hairnet::server {

enum class BuildError : std::uint8_t {
  none,
  // The file has more bytes than a groom may have.
  size,
  // The file is no groom, or a groom without hair.
  invalid,
  // The build takes longer than one may.
  time,
  // The build takes more memory than one may.
  memory,
  // The build ended its process without a result, and would do so again.
  crash,
  // The server has no process, memory or descriptor for the build now, or somebody ended its process.
  server,
  // Nobody uses the groom any more, or the server stops.
  dropped,
};

// Returns whether a build may go on: `none`, or else `time` or `dropped`. Any thread may call it.
using GoesOn = std::function<BuildError()>;

// How a build is done, and what it may use.
struct LevelBuildDef {
  GroomLimits groom;
  std::size_t thread_count = 1;
  std::size_t memory_bytes_max = std::size_t{2} << 30;
  // The caller ends a build that takes longer (GoesOn). The process of a build may also use no more processor time than
  // this, times its threads.
  std::int64_t ns_max = 600'000'000'000;
  ModeTraining training;
};

struct LevelBuild {
  // Null when there is an error.
  std::shared_ptr<const LevelSet> levels;
  BuildError error = BuildError::none;
  // One line about the error.
  std::string detail;
};

// Builds the levels of a groom's file, and its modes. The two implementations below give the same bits.
using BuildLevels = std::function<LevelBuild(const LevelBuildDef& def, const wire::GroomHash& hash,
                                             std::span<const std::uint8_t> file, const Groom& groom, const GoesOn&)>;

// Builds on the calling thread and helper threads. A build that is out of memory has the error `memory`.
LevelBuild build_levels_in_process(const LevelBuildDef& def, const wire::GroomHash& hash,
                                   std::span<const std::uint8_t> file, const Groom& groom, const GoesOn& goes_on);

// Builds in a process of its own: this program, started with kLevelBuildFlag, which its main() answers with
// run_level_build_process(). Whatever a groom does to a build, more memory or time than allowed or a crash, ends that
// process only. When `goes_on` returns an error, the process is killed. Such a build costs the start of a process, and
// copies of the file and the levels through a socket.
LevelBuild build_levels_in_child_process(const LevelBuildDef& def, const wire::GroomHash& hash,
                                         std::span<const std::uint8_t> file, const Groom& groom, const GoesOn& goes_on);

inline constexpr const char* kLevelBuildFlag = "--build-levels-for-parent";
// The main function of the child process. Returns the exit status.
int run_level_build_process();

}  // namespace hairnet::server
