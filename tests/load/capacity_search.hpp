#pragma once

#include <cstdint>
#include <optional>
#include <vector>

namespace hairnet::load {

// Finds the largest number of characters that meets the thresholds: it doubles until they fail, bisects down to the
// resolution, then confirms the answer; if that fails, it tries a little less, until one is confirmed. Pure; the caller
// does the probing.
class CapacitySearch {
 public:
  struct Limits {
    std::uint32_t first = 16;
    std::uint32_t most = 100'000;
    // Is the share of the answer by which the answer may be too low.
    double resolution = 0.05;
    // Probes are multiples of this number, the characters of one client.
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
  // Says how the probe of next() ended.
  void report(bool passed);
  // The largest confirmed count; 0: even the smallest fails, or none was confirmed in time.
  [[nodiscard]] std::uint32_t capacity() const { return capacity_; }
  [[nodiscard]] bool reached_max() const { return capacity_ == most_; }
  [[nodiscard]] const std::vector<Probe>& probes() const { return probes_; }

 private:
  void go_on();
  [[nodiscard]] std::uint32_t rounded(double characters) const;
  [[nodiscard]] bool bracketed() const;

  Limits limits_;
  std::uint32_t most_ = 0;
  // Is the largest count that passed and has not failed since.
  std::uint32_t good_ = 0;
  // Is the smallest count that failed.
  std::optional<std::uint32_t> bad_;
  std::uint32_t capacity_ = 0;
  std::vector<Probe> probes_;
  std::optional<Probe> next_;
};

}  // namespace hairnet::load
