#pragma once

#include <sys/types.h>

#include <string>
#include <vector>

namespace hairnet::whole {

// A program that a test runs. Its output goes into two files. The destructor kills a program that still runs.
class Process {
 public:
  // Standard output and error go into the files `output`.out and `output`.err, or both into `descriptor` if there is
  // one.
  Process(const std::vector<std::string>& command, std::string output, int descriptor = -1);
  ~Process();
  Process(const Process&) = delete;
  Process& operator=(const Process&) = delete;

  void send(int signal) const;
  [[nodiscard]] bool running();
  // Waits for the end and returns the exit code, which is 128 + n when signal n has ended the program. A program that
  // has not ended within `seconds_max` is killed, which gives 128 + SIGKILL.
  int wait(double seconds_max = 300);
  [[nodiscard]] std::string out() const;
  [[nodiscard]] std::string err() const;

 private:
  void take_status(int status);

  std::string output_;
  pid_t pid_ = -1;
  // The exit code; -1 while the process runs.
  int exit_code_ = -1;
};

}  // namespace hairnet::whole
