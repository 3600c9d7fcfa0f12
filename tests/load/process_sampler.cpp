#include "tests/load/process_sampler.hpp"

#include <unistd.h>

#include <algorithm>
#include <charconv>
#include <filesystem>
#include <fstream>
#include <iterator>

namespace hairnet::load {
namespace {

std::string content_of(const std::string& path) {
  std::ifstream file(path, std::ios::binary);
  return {std::istreambuf_iterator<char>(file), {}};
}

// Field `index` of words parted by single spaces, from 0.
std::optional<double> field(std::string_view words, int index) {
  for (; index > 0; --index) {
    const std::size_t space = words.find(' ');
    if (space == std::string_view::npos) return std::nullopt;
    words.remove_prefix(space + 1);
  }
  double value = 0;
  const auto [end, error] = std::from_chars(words.data(), words.data() + words.size(), value);
  if (error != std::errc()) return std::nullopt;
  return value;
}

double resident_mib_of(const std::string& folder) {
  // The second field of statm is the number of pages in memory (proc(5)).
  const auto pages = field(content_of(folder + "/statm"), 1);
  return pages ? *pages * static_cast<double>(sysconf(_SC_PAGESIZE)) / (1 << 20) : 0;
}

}  // namespace

std::optional<StatLine> parse_stat_line(std::string_view line, double ticks_per_s) {
  // "PID (NAME) STATE ..."; the name may contain anything, also parentheses.
  const std::size_t open = line.find('('), close = line.rfind(')');
  if (open == std::string_view::npos || close == std::string_view::npos || close < open || close + 2 > line.size())
    return std::nullopt;
  const std::string_view rest = line.substr(close + 2);
  // A process in these states has ended, and only its parent has not noticed it yet.
  if (rest.starts_with('Z') || rest.starts_with('X')) return std::nullopt;
  // These are the fields 4, 14 and 15 of proc(5). `rest` begins at field 3.
  const auto parent = field(rest, 1), user = field(rest, 11), system = field(rest, 12);
  if (!parent || !user || !system) return std::nullopt;
  return StatLine{std::string(line.substr(open + 1, close - open - 1)), static_cast<pid_t>(*parent),
                  (*user + *system) / ticks_per_s};
}

std::optional<ProcessUse> sample_process(pid_t pid) {
  const std::string folder = "/proc/" + std::to_string(pid);
  const auto ticks_per_s = static_cast<double>(sysconf(_SC_CLK_TCK));
  const auto whole = parse_stat_line(content_of(folder + "/stat"), ticks_per_s);
  if (!whole) return std::nullopt;
  ProcessUse use;
  use.cpu_s = whole->cpu_s;
  use.resident_mib = resident_mib_of(folder);
  std::error_code error;
  for (std::filesystem::directory_iterator task(folder + "/task", error), end; !error && task != end;
       task.increment(error)) {
    if (const auto thread = parse_stat_line(content_of(task->path() / "stat"), ticks_per_s))
      // The times of all threads of one name are added, for example those of all workers.
      use.thread_cpu_s[thread->name] += thread->cpu_s;
  }
  return use;
}

double children_resident_mib(pid_t parent) {
  double sum_mib = 0;
  std::error_code error;
  for (std::filesystem::directory_iterator process("/proc", error), end; !error && process != end;
       process.increment(error)) {
    const std::string name = process->path().filename();
    if (name.find_first_not_of("0123456789") != std::string::npos) continue;
    const auto stat = parse_stat_line(content_of(process->path() / "stat"), 1);
    if (stat && stat->parent == parent) sum_mib += resident_mib_of(process->path());
  }
  return sum_mib;
}

ProcessUse use_between(const ProcessUse& from, const ProcessUse& to) {
  ProcessUse use{to.cpu_s - from.cpu_s, to.resident_mib, to.thread_cpu_s};
  for (auto& [name, cpu_s] : use.thread_cpu_s) {
    const auto before = from.thread_cpu_s.find(name);
    // Where one of several threads of a name has ended in between, their sum may have fallen.
    if (before != from.thread_cpu_s.end()) cpu_s = std::max(0.0, cpu_s - before->second);
  }
  return use;
}

}  // namespace hairnet::load
