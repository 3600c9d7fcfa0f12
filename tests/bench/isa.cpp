#include "tests/bench/isa.hpp"

#include <hwy/targets.h>

#include <algorithm>
#include <cctype>
#include <fstream>
#include <thread>

namespace hairnet::bench {
namespace {

std::string name_of(std::int64_t target) {
  std::string name = hwy::TargetName(target);
  std::ranges::transform(name, name.begin(), [](unsigned char c) { return static_cast<char>(std::tolower(c)); });
  return name;
}

// The lowest bit is the best target.
std::int64_t best() {
  const std::int64_t targets = hwy::SupportedTargets() & HWY_TARGETS;
  return targets & -targets;
}

// Makes Highway's kernels run on this instruction set only.
void force(std::int64_t target) {
  hwy::SetSupportedTargetsForTest(target);
  hwy::GetChosenTarget().Update(hwy::SupportedTargets());
}

}  // namespace

// A target of 0 means that nothing is forced. The set in use is forced again at the end.
std::vector<std::string> isa_names() {
  const std::string in_use = isa_in_use();
  hwy::SetSupportedTargetsForTest(0);
  std::vector<std::string> names;
  for (const std::int64_t target : hwy::SupportedAndGeneratedTargets()) names.push_back(name_of(target));
  [[maybe_unused]] const auto restored = use_isa(in_use);
  return names;
}

Result<void> use_isa(const std::string& name) {
  hwy::SetSupportedTargetsForTest(0);
  if (name == "best") {
    force(best());
    return {};
  }
  std::string known;
  for (const std::int64_t target : hwy::SupportedAndGeneratedTargets()) {
    if (name_of(target) == name) {
      force(target);
      return {};
    }
    known += (known.empty() ? "" : ", ") + name_of(target);
  }
  return Refusal(name + ": not among the instruction sets here (" + known + ")");
}

std::string isa_in_use() {
  return name_of(best());
}

std::string cpu_model() {
  std::ifstream info("/proc/cpuinfo");
  for (std::string line; std::getline(info, line);) {
    if (!line.starts_with("model name")) continue;
    const std::size_t begin = line.find_first_not_of(" \t", line.find(':') + 1);
    return begin == std::string::npos ? "unknown" : line.substr(begin);
  }
  return "unknown";
}

std::size_t thread_count() {
  return std::max<std::size_t>(1, std::thread::hardware_concurrency());
}

}  // namespace hairnet::bench
