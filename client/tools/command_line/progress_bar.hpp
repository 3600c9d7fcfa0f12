#pragma once

#include <chrono>
#include <string>
#include <string_view>

namespace hairnet {

// One line on stderr that redraws itself, with the time left once that can be told; stdout stays clean for results. If
// stderr is not a terminal, as in a log, a line for each new stage and for every ten seconds of it. One thread at a
// time may call it.
class ProgressBar {
 public:
  explicit ProgressBar(std::string title);
  // Clears the line, so that what a program prints next stands alone.
  ~ProgressBar();
  ProgressBar(const ProgressBar&) = delete;
  ProgressBar& operator=(const ProgressBar&) = delete;

  // `fraction` in [0, 1] of the whole job, and the name of the current stage. Call it as often as you like: it draws at
  // most every 50 ms. A fraction that is no number counts as 0.
  void show(double fraction, std::string_view stage);

 private:
  using Clock = std::chrono::steady_clock;
  void draw(double fraction) const;
  // Returns ", 2 min left" when the rest takes as long as what is done; empty: not known yet.
  [[nodiscard]] std::string left(double fraction) const;

  std::string title_;
  std::string stage_;
  bool is_terminal_;
  bool drawn_ = false;
  Clock::time_point begun_ = Clock::now(), drawn_at_{};
};

}  // namespace hairnet
