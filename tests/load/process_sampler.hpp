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
  double cpu_s = 0;  // user and system, all threads that live and have lived
  double resident_mib = 0;
  std::map<std::string, double> thread_cpu_s;  // living threads by name, equal names summed
};
// None when there is no such process, it has ended (and waits for its parent), or it may not be looked at.
std::optional<ProcessUse> sample_process(pid_t pid);

// The resident memory of its child processes: the builds of a server's grooms.
double children_resident_mib(pid_t parent);

// The line of /proc/PID/stat or /proc/PID/task/TID/stat: name and CPU seconds. None when it is not one, or of
// what has ended.
struct StatLine {
  std::string name;
  pid_t parent = 0;
  double cpu_s = 0;
};
std::optional<StatLine> parse_stat_line(std::string_view line, double ticks_per_s);

// The use between two samples, by threads that existed at both, or began between them.
ProcessUse use_between(const ProcessUse& from, const ProcessUse& to);

}  // namespace hairnet::load
