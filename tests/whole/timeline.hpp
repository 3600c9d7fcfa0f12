#pragma once

#include <cstdint>
#include <functional>
#include <queue>
#include <utility>
#include <vector>

namespace hairnet::whole {

inline constexpr std::int64_t kMs = 1'000'000, kSecond_ns = 1'000'000'000;

// Simulated time, which jumps from one planned action to the next. Actions that are planned for the same time run in
// the order in which they were planned. Use it on one thread.
class Timeline {
 public:
  using Action = std::function<void()>;

  [[nodiscard]] std::int64_t now_ns() const { return now_ns_; }
  // Plans an action. One for a time that has passed runs at the present time.
  void at(std::int64_t time_ns, Action action) {
    coming_.push({std::max(time_ns, now_ns_), ++count_, std::move(action)});
  }
  void after(std::int64_t wait_ns, Action action) { at(now_ns_ + wait_ns, std::move(action)); }
  // Runs all actions before `until_ns`, or until `stop` returns true between two actions.
  void run(std::int64_t until_ns, const std::function<bool()>& stop = {}) {
    while (!coming_.empty() && coming_.top().time_ns < until_ns) {
      if (stop && stop()) return;
      // The moved-from element is popped before anything compares it.
      Coming next = std::move(const_cast<Coming&>(coming_.top()));
      coming_.pop();
      now_ns_ = next.time_ns;
      next.action();
    }
    if (!stop || !stop()) now_ns_ = std::max(now_ns_, until_ns);
  }

 private:
  struct Coming {
    std::int64_t time_ns = 0;
    std::uint64_t number = 0;
    Action action;
    bool operator<(const Coming& other) const {
      return std::pair(time_ns, number) > std::pair(other.time_ns, other.number);
    }
  };
  std::int64_t now_ns_ = 0;
  std::uint64_t count_ = 0;
  std::priority_queue<Coming> coming_;
};

}  // namespace hairnet::whole
