#include "server/app/process_gauges.hpp"

#include <sys/resource.h>
#include <unistd.h>

#include <cstdio>
#include <filesystem>
#include <memory>
#include <system_error>

namespace hairnet::server {
namespace {

double seconds(const timeval& t) {
  return static_cast<double>(t.tv_sec) + static_cast<double>(t.tv_usec) * 1e-6;
}

void read_memory(Gauge& gauge) {
  const std::unique_ptr<std::FILE, int (*)(std::FILE*)> file(std::fopen("/proc/self/statm", "r"), std::fclose);
  unsigned long long total_pages = 0, resident_pages = 0;
  if (!file || std::fscanf(file.get(), "%llu %llu", &total_pages, &resident_pages) != 2) return;
  gauge.set(static_cast<double>(resident_pages) * static_cast<double>(sysconf(_SC_PAGESIZE)));
}

void count_files(Gauge& gauge) {
  std::error_code fault;
  std::size_t count = 0;
  for (std::filesystem::directory_iterator file("/proc/self/fd", fault), end; !fault && file != end;
       file.increment(fault))
    ++count;
  if (!fault) gauge.set(static_cast<double>(count - 1));  // listing the folder opens one file itself
}

}  // namespace

void read_process(ProgramGauges& gauges) {
  rusage usage{};
  if (getrusage(RUSAGE_SELF, &usage) == 0) gauges.cpu_seconds.set(seconds(usage.ru_utime) + seconds(usage.ru_stime));
  read_memory(gauges.resident_memory_bytes);
  count_files(gauges.open_files);
}

}  // namespace hairnet::server
