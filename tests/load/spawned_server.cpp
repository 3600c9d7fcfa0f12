#include "tests/load/spawned_server.hpp"

#include <fcntl.h>
#include <fmt/format.h>
#include <signal.h>
#include <spawn.h>
#include <sys/wait.h>
#include <unistd.h>

#include <cerrno>
#include <chrono>
#include <cstring>
#include <filesystem>
#include <fstream>
#include <thread>

extern char** environ;  // NOLINT: POSIX names it

namespace hairnet::load {
namespace {

using std::chrono::milliseconds;
// A server that starts has 20 s until it must listen. A server that is told to stop has 5 s before it is killed.
constexpr milliseconds kStartWait{20'000}, kStopWait{5'000}, kPollInterval{20};

// The program itself when `name` has a slash; else the one beside this program, or the first in PATH.
std::string program_path(const std::string& name, const std::filesystem::path& own_folder) {
  const std::filesystem::path beside = own_folder / name;
  return name.find('/') == std::string::npos && access(beside.c_str(), X_OK) == 0 ? beside.string() : name;
}

}  // namespace

Result<std::unique_ptr<SpawnedServer>> SpawnedServer::start(const std::string& program,
                                                            const std::vector<std::string>& arguments,
                                                            const std::string& log) {
  std::error_code ignored;
  // The server picks a free port and writes its number to this file, which is therefore also the sign that it listens.
  const std::string port_file =
      std::filesystem::temp_directory_path(ignored) / fmt::format("hairnet-load-{}.port", getpid());
  std::filesystem::remove(port_file, ignored);
  const std::filesystem::path own_folder = std::filesystem::read_symlink("/proc/self/exe", ignored).parent_path();
  std::vector<std::string> words{program_path(program, own_folder)};
  words.insert(words.end(), arguments.begin(), arguments.end());
  // The server refuses a flag that is given twice, so the caller's arguments cannot set these.
  for (const char* word : {"--bind", "127.0.0.1", "--port", "0", "--port-file"}) words.emplace_back(word);
  words.push_back(port_file);
  std::vector<char*> argv;
  for (std::string& word : words) argv.push_back(word.data());
  argv.push_back(nullptr);

  posix_spawn_file_actions_t actions;
  posix_spawn_file_actions_init(&actions);
  posix_spawn_file_actions_addopen(&actions, 0, "/dev/null", O_RDONLY, 0);
  posix_spawn_file_actions_addopen(&actions, 1, log.c_str(), O_WRONLY | O_CREAT | O_TRUNC, 0644);
  posix_spawn_file_actions_adddup2(&actions, 1, 2);
  pid_t pid = -1;
  const int error = posix_spawnp(&pid, argv.front(), &actions, nullptr, argv.data(), environ);
  posix_spawn_file_actions_destroy(&actions);
  if (error == ENOENT && program.find('/') == std::string::npos)
    return Refusal(fmt::format("cannot start {}: it is neither in {} nor in a folder of PATH; give its whole path",
                               program, own_folder.string()));
  if (error != 0) return Refusal(fmt::format("cannot start {}: {}", program, std::strerror(error)));

  std::unique_ptr<SpawnedServer> server(new SpawnedServer(pid));
  for (milliseconds waited{0}; waited < kStartWait && server->running(); waited += kPollInterval) {
    if (std::ifstream file(port_file); file >> server->port_) {
      std::filesystem::remove(port_file, ignored);
      return server;
    }
    std::this_thread::sleep_for(kPollInterval);
  }
  return Refusal(
      fmt::format("{} {}; its output is in {}", program, server->running() ? "does not listen" : "ended at once", log));
}

bool SpawnedServer::running() {
  // waitpid returns 0 while the process runs, its number when it has ended, and -1 when there is none.
  if (!ended_) ended_ = waitpid(pid_, nullptr, WNOHANG) != 0;
  return !ended_;
}

SpawnedServer::~SpawnedServer() {
  if (!running()) return;
  kill(pid_, SIGTERM);
  for (milliseconds waited{0}; waited < kStopWait && running(); waited += kPollInterval)
    std::this_thread::sleep_for(kPollInterval);
  if (!running()) return;
  kill(pid_, SIGKILL);
  waitpid(pid_, nullptr, 0);
}

}  // namespace hairnet::load
