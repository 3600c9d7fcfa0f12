#include "server/app/process_gauges.hpp"

#include <sys/resource.h>

#include <filesystem>
#include <system_error>

#include "server/app/process_memory.hpp"

namespace hairnet::server {
namespace {

double seconds(const timeval& t) {
  return static_cast<double>(t.tv_sec) + static_cast<double>(t.tv_usec) * 1e-6;
}

void count_files(Gauge& gauge) {
  std::error_code error;
  std::size_t count = 0;
  for (std::filesystem::directory_iterator file("/proc/self/fd", error), end; !error && file != end;
       file.increment(error))
    ++count;
  // Listing the folder opens one file itself.
  if (!error) gauge.set(static_cast<double>(count - 1));
}

}  // namespace

void read_process(ProgramGauges& gauges) {
  rusage usage{};
  if (getrusage(RUSAGE_SELF, &usage) == 0) gauges.cpu_seconds.set(seconds(usage.ru_utime) + seconds(usage.ru_stime));
  if (const std::size_t bytes = resident_bytes()) gauges.resident_memory_bytes.set(static_cast<double>(bytes));
  count_files(gauges.open_files);
}

}  // namespace hairnet::server
