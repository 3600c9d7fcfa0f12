#include "tests/whole/whole_test.hpp"

#include <signal.h>
#include <unistd.h>

#include <algorithm>
#include <chrono>
#include <cstdlib>
#include <fstream>
#include <thread>

#include "client/files/read_file.hpp"
#include "schema/wire/level_file.hpp"
#include "tests/tools/hex.hpp"
#include "tests/whole/frame_comparison.hpp"

namespace hairnet::whole {
namespace {

// A program must end within this time. Programs with sanitizers need ten times as long to build levels.
constexpr double kPatience_s = HAIRNET_SANITIZED ? 1800 : 300;
// This share of a client's ticks may be missing. A busy machine skips ticks, and more of them in a build with
// sanitizers.
constexpr double kMissedShareMax = HAIRNET_SANITIZED ? 0.5 : 0.2;

const std::filesystem::path kServer = std::filesystem::path(HAIRNET_BIN_DIR) / "hairnet-server";
// What servers of earlier tests built, so that the levels of a hairstyle are built once for all tests.
const std::filesystem::path kBuiltLevels = std::filesystem::path(HAIRNET_BIN_DIR).parent_path() / "test-levels";

// Returns whether the file was written since the server was linked. An older server may have built other levels.
bool is_of_this_server(const std::filesystem::path& file) {
  return std::filesystem::exists(file) &&
         std::filesystem::last_write_time(file) >= std::filesystem::last_write_time(kServer);
}

// Copies files under a temporary name and then renames them, because tests that run at the same time read the folder.
void copy_new_files(const std::filesystem::path& from, const std::filesystem::path& to) {
  std::filesystem::create_directories(to);
  for (const auto& entry : std::filesystem::directory_iterator(from)) {
    const std::filesystem::path file = to / entry.path().filename();
    if (!entry.is_regular_file() || entry.path().extension() == ".part" || !is_of_this_server(entry.path()) ||
        is_of_this_server(file))
      continue;
    const std::filesystem::path part = file.string() + "." + std::to_string(::getpid()) + ".part";
    std::filesystem::copy_file(entry.path(), part);
    std::filesystem::rename(part, file);
  }
}

}  // namespace

void WholeTest::SetUp() {
  const auto* info = ::testing::UnitTest::GetInstance()->current_test_info();
  folder_ = std::filesystem::temp_directory_path() /
            ("hairnet_" + std::string(info->name()).substr(0, 60) + "_" + std::to_string(::getpid()));
  std::filesystem::create_directories(folder_);
  std::filesystem::create_directories(kBuiltLevels);
  copy_new_files(kBuiltLevels, path("levels"));
}

void WholeTest::TearDown() {
  if (HasFailure()) {
    std::printf("kept: %s\n", folder_.c_str());
  } else {
    if (!has_put_learnt_hair_ && !IsSkipped()) copy_new_files(path("levels"), kBuiltLevels);
    std::filesystem::remove_all(folder_);
  }
}

std::unique_ptr<Process> WholeTest::start(const std::string& program, const Arguments& arguments,
                                          const std::string& name, int descriptor) {
  Arguments command{std::string(HAIRNET_BIN_DIR) + "/" + program};
  command.insert(command.end(), arguments.begin(), arguments.end());
  return std::make_unique<Process>(command, path(name), descriptor);
}

std::unique_ptr<Process> WholeTest::start_server(const Arguments& more, const std::string& name, int descriptor) {
  const std::string port_file = path(name + ".port");
  Arguments arguments{"--port",       "0",    "--port-file", port_file, "--level-cache", path("levels"),
                      "--learn-hair", "never"};  // learning takes longer than the tests, and other tests have it
  arguments.insert(arguments.end(), more.begin(), more.end());
  auto server = start("hairnet-server", arguments, name, descriptor);
  EXPECT_TRUE(wait_for_file(port_file, 1, *server)) << server->err();
  std::ifstream(port_file) >> port_;
  return server;
}

std::unique_ptr<Process> WholeTest::start_view(const Arguments& more, const std::string& name) {
  Arguments arguments{"--connect", "127.0.0.1:" + port_};
  arguments.insert(arguments.end(), more.begin(), more.end());
  return start("hairnet-view", arguments, name);
}

void WholeTest::finish(Process& process, int exit_code) {
  EXPECT_EQ(process.wait(kPatience_s), exit_code) << process.out() << process.err();
}

void WholeTest::drain(Process& server) {
  server.send(SIGTERM);
  finish(server, 0);
}

FrameComparison WholeTest::expect_same_frames(const std::string& received_folder, const std::string& computed_folder) {
  const Trace received(path(received_folder)), computed(path(computed_folder));
  std::vector<std::shared_ptr<const Modes>> modes;
  for (const BuiltGroom& groom : built_grooms()) modes.push_back(groom.levels->modes);
  const FrameComparison result = compare(received, computed, modes);
  std::printf("%s: %zu frames (%zu moving, %zu learnt, %zu fading), %zu ticks missed, error at most %.4f mm\n",
              received_folder.c_str(), result.frames, result.moving_frames, result.learnt_frames, result.fading,
              result.missed_ticks, result.error_mm_max);
  // Without this bound a view that received nothing but hair at rest, or no frame at all, would agree with any
  // computation.
  EXPECT_GT(result.moving_frames, 20u);
  EXPECT_EQ(result.unknown, 0u);
  EXPECT_EQ(result.levels_differ, 0u);
  EXPECT_EQ(result.poses_differ, 0u);
  EXPECT_EQ(result.hair_differs, 0u);
  EXPECT_LE(static_cast<double>(result.missed_ticks), kMissedShareMax * static_cast<double>(result.frames) + 3);
  EXPECT_TRUE(received.all_finite());
  return result;
}

std::vector<WholeTest::BuiltGroom> WholeTest::built_grooms() const {
  std::vector<BuiltGroom> built;
  for (const auto& entry : std::filesystem::directory_iterator(path("levels"))) {
    BuiltGroom groom{entry.path().string(), {}, nullptr};
    const auto digits = from_hex(entry.path().filename().string().substr(0, 2 * groom.hash.size()));
    const Result<std::vector<std::byte>> file = read_file(groom.file, std::size_t{1} << 30);
    if (!digits || !file) continue;
    std::ranges::copy(*digits, groom.hash.begin());
    const std::span bytes(reinterpret_cast<const std::uint8_t*>(file->data()), file->size());
    groom.levels = wire::decode_levels(bytes, groom.hash).levels;
    if (groom.levels) built.push_back(std::move(groom));
  }
  return built;
}

void WholeTest::put_learnt_hair(const LearntHair& hair) {
  has_put_learnt_hair_ = true;
  for (const BuiltGroom& groom : built_grooms()) {
    groom.levels->learnt = std::make_shared<const LearntHair>(hair);
    const std::vector<std::uint8_t> bytes = wire::encode_levels(groom.hash, *groom.levels);
    std::ofstream file(groom.file, std::ios::binary | std::ios::trunc);
    file.write(reinterpret_cast<const char*>(bytes.data()), static_cast<std::streamsize>(bytes.size()));
    EXPECT_TRUE(file) << groom.file;
  }
}

// Waits five minutes at most, whatever kPatience_s is, and gives up at once when the program has ended.
bool WholeTest::wait_for_file(const std::string& file, std::size_t bytes, Process& process) {
  const auto deadline = std::chrono::steady_clock::now() + std::chrono::minutes(5);
  while (std::chrono::steady_clock::now() < deadline && process.running()) {
    std::error_code none;
    const auto size = std::filesystem::file_size(file, none);
    if (!none && size >= bytes) return true;
    std::this_thread::sleep_for(std::chrono::milliseconds(5));
  }
  return false;
}

bool is_one_line(const std::string& text) {
  return !text.empty() && text.find('\n') == text.size() - 1;
}

}  // namespace hairnet::whole
