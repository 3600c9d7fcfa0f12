#pragma once

#include <bit>
#include <cstdint>
#include <cstdio>
#include <map>
#include <string>
#include <vector>

#include "tests/whole/timeline.hpp"

namespace hairnet::whole {

// The record of a trial: faults, counts of each kind of event, and a hash of everything that clients received.
class Journal {
 public:
  // Further faults are left out, since the first ones matter.
  static constexpr std::size_t kFaultsMax = 20;

  Journal(std::uint64_t seed, const Timeline& timeline) : seed_(seed), timeline_(&timeline) {}

  void fault(const std::string& who, const std::string& what) {
    if (faults_.size() >= kFaultsMax) return;
    char time[32];
    std::snprintf(time, sizeof time, "%.4f", 1e-9 * static_cast<double>(timeline_->now_ns()));
    faults_.push_back("seed " + std::to_string(seed_) + ", " + time + " s, " + who + ": " + what);
  }
  void count(const std::string& event, std::uint64_t n = 1) { events_[event] += n; }
  // Mixes a number into the hash. The two factors are numbers of the generator SplitMix64, which spread each bit of a
  // value over the whole hash.
  void mix(std::uint64_t value) {
    hash_ = std::rotl(hash_ ^ (value * 0x9E3779B97F4A7C15u), 29) * 0xBF58476D1CE4E5B9u + 1;
  }

  [[nodiscard]] const std::vector<std::string>& faults() const { return faults_; }
  [[nodiscard]] const std::map<std::string, std::uint64_t>& events() const { return events_; }
  [[nodiscard]] std::uint64_t events(const std::string& event) const {
    const auto found = events_.find(event);
    return found == events_.end() ? 0 : found->second;
  }
  [[nodiscard]] std::uint64_t hash() const { return hash_; }

 private:
  std::uint64_t seed_;
  const Timeline* timeline_;
  std::vector<std::string> faults_;
  std::map<std::string, std::uint64_t> events_;
  std::uint64_t hash_ = 0;
};

}  // namespace hairnet::whole
