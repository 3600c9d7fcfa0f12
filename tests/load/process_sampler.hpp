#pragma once

#include <sys/types.h>

#include <cstdint>
#include <map>
#include <optional>
#include <string>
#include <string_view>
#include <vector>

namespace hairnet::load {

// The resources that a process has used so far, from /proc.
struct ProcessUse {
  // The time in user and in system mode of all threads, those that have ended included.
  double cpu_s = 0;
  double resident_mib = 0;
  // The time of the living threads, by name. Threads of the same name are added up.
  std::map<std::string, double> thread_cpu_s;
};
// Returns nothing when there is no such process, when it has ended and waits for its parent, or when this one may not
// look at it.
std::optional<ProcessUse> sample_process(pid_t pid);

// The resident memory of its child processes: the builds of a server's grooms.
double children_resident_mib(pid_t parent);

// The name, parent and processor time in a line of /proc/PID/stat or /proc/PID/task/TID/stat. parse_stat_line() returns
// nothing when the line is not valid, or belongs to a process or thread that has ended.
struct StatLine {
  std::string name;
  pid_t parent = 0;
  double cpu_s = 0;
};
std::optional<StatLine> parse_stat_line(std::string_view line, double ticks_per_s);

// Returns what was used between two samples. Threads that ended in between are missing from thread_cpu_s.
ProcessUse use_between(const ProcessUse& from, const ProcessUse& to);

}  // namespace hairnet::load
