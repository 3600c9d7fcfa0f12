#include "client/tools/command_line/progress_bar.hpp"

#include <unistd.h>

#include <algorithm>
#include <cmath>
#include <cstdio>
#include <utility>

namespace hairnet {
namespace {

// The bar has this many letters.
constexpr int kBarCells = 30;
// A terminal is redrawn at this interval at most: quick enough for the eye, and slow enough to cost nothing.
constexpr auto kRedrawInterval = std::chrono::milliseconds(50);
// A log gets lines at this interval, since it cannot be redrawn.
constexpr auto kLineInterval = std::chrono::seconds(10);

}  // namespace

ProgressBar::ProgressBar(std::string title) : title_(std::move(title)), is_terminal_(::isatty(STDERR_FILENO) == 1) {}

ProgressBar::~ProgressBar() {
  // Back to the line's start, then clear to its end.
  if (is_terminal_ && drawn_) std::fputs("\r\x1b[K", stderr);
}

void ProgressBar::show(double fraction, std::string_view stage) {
  const bool new_stage = !drawn_ || stage != stage_;
  if (new_stage) stage_ = stage;
  const Clock::time_point now = Clock::now();
  // A new stage shows at once, since it may be short.
  if (!new_stage && now - drawn_at_ < (is_terminal_ ? kRedrawInterval : kLineInterval)) return;
  drawn_at_ = now;
  drawn_ = true;
  const double share = std::isfinite(fraction) ? std::clamp(fraction, 0.0, 1.0) : 0.0;
  if (is_terminal_)
    draw(share);
  else if (new_stage)
    std::fprintf(stderr, "%s: %s\n", title_.c_str(), stage_.c_str());
  else
    std::fprintf(stderr, "%s: %s, %.0f %%%s\n", title_.c_str(), stage_.c_str(), 100 * share, left(share).c_str());
}

std::string ProgressBar::left(double fraction) const {
  // Before 5 % of the work or 5 s, an estimate of the time left would be wrong by far.
  constexpr double kFractionMin = 0.05, kTaken_s_min = 5;
  const double taken_s = std::chrono::duration<double>(Clock::now() - begun_).count();
  if (fraction < kFractionMin || taken_s < kTaken_s_min) return {};
  const double left_s = taken_s * (1 - fraction) / fraction;
  // From 100 s on the time left is told in minutes.
  const bool is_long = left_s >= 100;
  return ", " + std::to_string(std::lround(is_long ? left_s / 60 : left_s)) + (is_long ? " min left" : " s left");
}

void ProgressBar::draw(double fraction) const {
  const int full = static_cast<int>(std::lround(fraction * kBarCells));
  const std::string bar =
      std::string(static_cast<std::size_t>(full), '#') + std::string(static_cast<std::size_t>(kBarCells - full), '.');
  std::fprintf(stderr, "\r\x1b[K%s [%s] %3.0f%% %s%s", title_.c_str(), bar.c_str(), 100 * fraction, stage_.c_str(),
               left(fraction).c_str());
  // A line without an end stays in the buffer otherwise.
  std::fflush(stderr);
}

}  // namespace hairnet
