#include "tests/whole/process.hpp"

#include <fcntl.h>
#include <signal.h>
#include <spawn.h>
#include <sys/wait.h>

#include <chrono>
#include <fstream>
#include <iterator>
#include <stdexcept>
#include <thread>
#include <utility>

extern char** environ;  // NOLINT: POSIX names it

namespace hairnet::whole {
namespace {

std::string content_of(const std::string& path) {
  std::ifstream file(path, std::ios::binary);
  return {std::istreambuf_iterator<char>(file), {}};
}

}  // namespace

Process::Process(const std::vector<std::string>& command, std::string output, int descriptor)
    : output_(std::move(output)) {
  std::vector<char*> arguments;
  for (const std::string& argument : command) arguments.push_back(const_cast<char*>(argument.c_str()));
  arguments.push_back(nullptr);
  posix_spawn_file_actions_t actions;
  posix_spawn_file_actions_init(&actions);
  const std::string out = output_ + ".out", err = output_ + ".err";
  posix_spawn_file_actions_addopen(&actions, 0, "/dev/null", O_RDONLY, 0);
  for (const auto& [number, file] : {std::pair(1, out), std::pair(2, err)}) {
    // With a descriptor both outputs go there, for example into a pipe that the test reads. Otherwise each goes to its
    // file.
    if (descriptor >= 0)
      posix_spawn_file_actions_adddup2(&actions, descriptor, number);
    else
      posix_spawn_file_actions_addopen(&actions, number, file.c_str(), O_WRONLY | O_CREAT | O_TRUNC, 0644);
  }
  // This test program ignores broken pipes, and a child would inherit that. The child gets the default instead, as from
  // a shell.
  posix_spawnattr_t attributes;
  posix_spawnattr_init(&attributes);
  sigset_t broken_pipe;
  sigemptyset(&broken_pipe);
  sigaddset(&broken_pipe, SIGPIPE);
  posix_spawnattr_setsigdefault(&attributes, &broken_pipe);
  posix_spawnattr_setflags(&attributes, POSIX_SPAWN_SETSIGDEF);
  const int fault = posix_spawn(&pid_, arguments[0], &actions, &attributes, arguments.data(), environ);
  posix_spawnattr_destroy(&attributes);
  posix_spawn_file_actions_destroy(&actions);
  if (fault != 0) throw std::runtime_error("cannot run " + command[0]);
}

Process::~Process() {
  if (!running()) return;
  send(SIGKILL);
  int status = 0;
  waitpid(pid_, &status, 0);
}

void Process::send(int signal) const {
  if (exit_code_ < 0) kill(pid_, signal);
}

void Process::take_status(int status) {
  // A process that a signal has ended gets 128 and the signal's number, as in a shell.
  exit_code_ = WIFEXITED(status) ? WEXITSTATUS(status) : 128 + WTERMSIG(status);
}

bool Process::running() {
  if (exit_code_ >= 0) return false;
  int status = 0;
  if (waitpid(pid_, &status, WNOHANG) == pid_) take_status(status);
  return exit_code_ < 0;
}

int Process::wait(double seconds_max) {
  const auto deadline = std::chrono::steady_clock::now() + std::chrono::duration<double>(seconds_max);
  while (running() && std::chrono::steady_clock::now() < deadline)
    std::this_thread::sleep_for(std::chrono::milliseconds(5));
  if (running()) {
    send(SIGKILL);
    int status = 0;
    waitpid(pid_, &status, 0);
    take_status(status);
  }
  return exit_code_;
}

std::string Process::out() const {
  return content_of(output_ + ".out");
}
std::string Process::err() const {
  return content_of(output_ + ".err");
}

}  // namespace hairnet::whole
