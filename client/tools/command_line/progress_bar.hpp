#pragma once

#include <chrono>
#include <string>
#include <string_view>

namespace hairnet {

// One line on stderr that redraws itself, with the time left once that can be told. If stderr is not a terminal, a line
// for each new stage and for every ten seconds of it.
class ProgressBar {
 public:
  explicit ProgressBar(std::string title);
  ~ProgressBar();  // clears the line
  ProgressBar(const ProgressBar&) = delete;
  ProgressBar& operator=(const ProgressBar&) = delete;

  // `fraction` in [0, 1] of the whole job, and the name of the current stage. Cheap to call often.
  void show(double fraction, std::string_view stage);

 private:
  using Clock = std::chrono::steady_clock;
  void draw(double fraction) const;
  // ", 2 min left" when the rest takes as long as what is done; empty: not known yet.
  [[nodiscard]] std::string left(double fraction) const;

  std::string title_;
  std::string stage_;
  bool is_terminal_;
  bool drawn_ = false;
  Clock::time_point begun_ = Clock::now(), drawn_at_{};
};

}  // namespace hairnet
