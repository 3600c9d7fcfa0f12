#pragma once

#include <algorithm>
#include <string_view>
#include <vector>

#include "core/assert.hpp"
#include "core/levels/build.hpp"
#include "core/mutex.hpp"

namespace hairnet {

// Combines the progress of several equal parts that are built in parallel. It calls the callbacks from one thread at a
// time, with a fraction that never decreases, and never again after the callback has cancelled.
class BuildProgress {
 public:
  BuildProgress(const BuildCallbacks& callbacks, std::size_t part_count)
      : observer_(callbacks), done_(part_count, 0.0) {
    HAIRNET_ASSERT(part_count > 0);
  }

  // False to cancel. Asserts that the part exists, and that the fraction is within 0 and 1.
  [[nodiscard]] bool at(std::size_t part, double fraction, std::string_view stage) {
    HAIRNET_ASSERT(part < done_.size());
    HAIRNET_ASSERT(fraction >= 0);
    HAIRNET_ASSERT(fraction <= 1);
    if (!observer_.progress) return true;
    const MutexLock lock(mutex_);
    // A part that has not noticed yet may report after another part was cancelled.
    if (cancelled_) return false;
    done_[part] = std::max(done_[part], fraction);
    double sum = 0;
    for (const double done : done_) sum += done;
    cancelled_ = !observer_.progress(sum / static_cast<double>(done_.size()), stage);
    return !cancelled_;
  }

  [[nodiscard]] double clock_s() {
    if (!observer_.clock_s) return 0;
    const MutexLock lock(mutex_);
    return observer_.clock_s();
  }

 private:
  // The caller owns the callbacks, longer than the build lasts.
  const BuildCallbacks& observer_;
  Mutex mutex_;
  // The finished fraction of each part.
  std::vector<double> done_;
  bool cancelled_ = false;
};

// The progress of one part of a build.
struct LevelProgress {
  BuildProgress& whole;
  std::size_t part = 0;

  [[nodiscard]] bool at(double fraction, std::string_view stage) const { return whole.at(part, fraction, stage); }
  [[nodiscard]] double clock_s() const { return whole.clock_s(); }
};

}  // namespace hairnet
