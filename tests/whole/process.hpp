#pragma once

#include <sys/types.h>

#include <string>
#include <vector>

namespace hairnet::whole {

// A program run by a test, its output kept in two files. Killed when it outlives the test.
class Process {
 public:
  // `output`: path without extension; .out and .err are written. Or both go to `descriptor`, where there is one.
  Process(const std::vector<std::string>& command, std::string output, int descriptor = -1);
  ~Process();
  Process(const Process&) = delete;
  Process& operator=(const Process&) = delete;

  void send(int signal) const;
  [[nodiscard]] bool running();
  // The exit code; 128 + n when signal n ended it. Kills it when it has not ended within `seconds_max`, which gives
  // 128 + SIGKILL.
  int wait(double seconds_max = 300);
  [[nodiscard]] std::string out() const;
  [[nodiscard]] std::string err() const;

 private:
  void take_status(int status);

  std::string output_;
  pid_t pid_ = -1;
  // Is -1 while the process runs.
  int exit_code_ = -1;
};

}  // namespace hairnet::whole
