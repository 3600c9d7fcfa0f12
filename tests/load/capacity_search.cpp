#include "tests/load/capacity_search.hpp"

#include <algorithm>

#include "core/assert.hpp"

namespace hairnet::load {

CapacitySearch::CapacitySearch(const Limits& limits) : limits_(limits) {
  limits_.granule = std::max(limits_.granule, 1u);
  most_ = std::max(limits_.granule, limits_.most / limits_.granule * limits_.granule);
  next_ = Probe{std::min(rounded(limits_.first), most_)};
}

std::uint32_t CapacitySearch::rounded(double characters) const {
  const auto granules = static_cast<std::uint32_t>(characters / limits_.granule);
  return std::max(granules, 1u) * limits_.granule;
}

bool CapacitySearch::bracketed() const {
  const double step = std::max<double>(limits_.granule, limits_.resolution * good_);
  return bad_ && *bad_ - good_ <= step;
}

void CapacitySearch::report(bool passed) {
  HAIRNET_ASSERT(next_);
  Probe probe = *next_;
  probe.passed = passed;
  probes_.push_back(probe);
  if (passed) {
    good_ = std::max(good_, probe.characters);
    if (probe.confirms) capacity_ = probe.characters;
  } else {
    bad_ = std::min(bad_.value_or(probe.characters), probe.characters);
    // A count that passed once and then failed counts as failed: a smaller count is tried.
    if (good_ >= *bad_) good_ = 0;
    for (const Probe& earlier : probes_)
      if (earlier.passed && earlier.characters < *bad_) good_ = std::max(good_, earlier.characters);
  }
  go_on();
}

void CapacitySearch::go_on() {
  next_.reset();
  if (capacity_ > 0 || probes_.size() >= limits_.probe_count_max) return;
  if (!bad_) {
    next_ = good_ == most_ ? Probe{good_, true} : Probe{std::min(rounded(2.0 * good_), most_)};
  } else if (bracketed() && good_ > 0) {
    next_ = Probe{good_, true};
  } else if (*bad_ > limits_.granule) {
    const std::uint32_t middle = rounded(0.5 * (good_ + *bad_));
    next_ = Probe{std::clamp(middle, limits_.granule, *bad_ - limits_.granule)};
  }
}

}  // namespace hairnet::load
