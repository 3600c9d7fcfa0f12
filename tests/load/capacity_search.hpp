#pragma once

#include <cstdint>
#include <optional>
#include <vector>

namespace hairnet::load {

// Finds the largest number of characters that meets the thresholds. The search doubles the number until the thresholds
// fail, bisects down to the resolution, then confirms the answer with a longer run. If that run fails, the search tries
// fewer characters, until one number is confirmed. The caller does the runs: it makes the probe of next() and reports
// it.
class CapacitySearch {
 public:
  struct Limits {
    std::uint32_t first = 16;
    std::uint32_t most = 100'000;
    // The answer may be too low by this share of it.
    double resolution = 0.05;
    // Each probe is a multiple of this number, which is the number of characters of one client.
    std::uint32_t granule = 1;
    // Steps by halves over 100 000 characters need 17; more mean that the answers contradict each other.
    std::uint32_t probe_count_max = 30;
  };
  struct Probe {
    std::uint32_t characters = 0;
    bool confirms = false;
    bool passed = false;
  };

  explicit CapacitySearch(const Limits& limits);
  // How many characters to try next; none when the search is over.
  [[nodiscard]] std::optional<Probe> next() const { return next_; }
  // Tells the search how the probe of next() ended.
  void report(bool passed);
  // Returns the largest confirmed number. 0 means that even the smallest number fails, or that none was confirmed
  // within probe_count_max probes.
  [[nodiscard]] std::uint32_t capacity() const { return capacity_; }
  [[nodiscard]] bool reached_max() const { return capacity_ == most_; }
  [[nodiscard]] const std::vector<Probe>& probes() const { return probes_; }

 private:
  // Chooses the next probe.
  void go_on();
  // Rounds down to whole clients, but to one client at least.
  [[nodiscard]] std::uint32_t rounded(double characters) const;
  // Returns whether good_ and bad_ are as close as the resolution asks for.
  [[nodiscard]] bool bracketed() const;

  Limits limits_;
  // Limits::most, rounded down to whole clients.
  std::uint32_t most_ = 0;
  // The largest number that has passed and has not failed since.
  std::uint32_t good_ = 0;
  // The smallest number that has failed.
  std::optional<std::uint32_t> bad_;
  std::uint32_t capacity_ = 0;
  std::vector<Probe> probes_;
  std::optional<Probe> next_;
};

}  // namespace hairnet::load
