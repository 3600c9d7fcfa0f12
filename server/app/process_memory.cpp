#include "server/app/process_memory.hpp"

#include <malloc.h>
#include <sys/resource.h>
#include <unistd.h>

#include <algorithm>
#include <cstdio>
#include <filesystem>
#include <fstream>
#include <limits>
#include <memory>
#include <string>

namespace hairnet::server {
namespace {

std::size_t page_bytes() {
  return static_cast<std::size_t>(std::max(sysconf(_SC_PAGESIZE), 0L));
}

// The smallest limit of the process's control group (version 2) and of the groups above it. Without a limit it is the
// largest number.
std::size_t control_group_limit_bytes() {
  std::size_t least = std::numeric_limits<std::size_t>::max();
  std::ifstream groups("/proc/self/cgroup");
  std::string line;
  // Other lines are of control groups of version 1.
  while (std::getline(groups, line) && !line.starts_with("0::/")) {
  }
  if (!groups) return least;
  const std::filesystem::path root = "/sys/fs/cgroup";
  for (std::filesystem::path group = root / line.substr(4); group.native().size() >= root.native().size();
       group = group.parent_path()) {
    std::ifstream file(group / "memory.max");
    std::size_t bytes = 0;
    // The word "max" is no number: this group has no limit.
    if (file >> bytes) least = std::min(least, bytes);
  }
  return least;
}

// A limit of the process itself (setrlimit); the largest number where there is none.
std::size_t resource_limit_bytes(__rlimit_resource_t resource) {
  rlimit limit{};
  if (getrlimit(resource, &limit) != 0 || limit.rlim_cur == RLIM_INFINITY)
    return std::numeric_limits<std::size_t>::max();
  return static_cast<std::size_t>(limit.rlim_cur);
}

}  // namespace

// The file has all figures in pages; the second is the resident ones.
std::size_t resident_bytes() {
  const std::unique_ptr<std::FILE, int (*)(std::FILE*)> file(std::fopen("/proc/self/statm", "r"), std::fclose);
  unsigned long long total_pages = 0, resident_pages = 0;
  if (!file || std::fscanf(file.get(), "%llu %llu", &total_pages, &resident_pages) != 2) return 0;
  return static_cast<std::size_t>(resident_pages) * page_bytes();
}

std::size_t allocated_bytes() {
  const struct mallinfo2 info = mallinfo2();
  // Blocks of the heap, and large blocks that were mapped alone.
  return info.uordblks + info.hblkhd;
}

std::size_t memory_limit_bytes() {
  const auto machine = static_cast<std::size_t>(std::max(sysconf(_SC_PHYS_PAGES), 0L)) * page_bytes();
  return std::min(
      // A container sees the whole machine's memory, so its own limit has to be read apart.
      {machine, control_group_limit_bytes(), resource_limit_bytes(RLIMIT_AS), resource_limit_bytes(RLIMIT_DATA)});
}

}  // namespace hairnet::server
