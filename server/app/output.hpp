#pragma once

#include <string>

#include "server/app/metrics.hpp"
#include "server/threading/output_thread.hpp"

namespace hairnet::server {

// What the server writes for people, on standard error and standard output, while it runs: neither holds up a duty.
// The log goes to it while it exists. A process has one.
class Output {
 public:
  // `counters` must outlive the output. `log_level` is a name of spdlog.
  Output(const std::string& log_level, ProgramCounters& counters);
  // Waits a moment for readers to take what is left, and no longer.
  ~Output();
  Output(const Output&) = delete;
  Output& operator=(const Output&) = delete;

  // One or more whole lines, for standard output and for standard error.
  void print(std::string text) { out_.put(std::move(text)); }
  void complain(std::string text) { log_.put(std::move(text)); }

 private:
  OutputThread log_, out_;
};

}  // namespace hairnet::server
