#include "tests/load/live_view.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <cstdio>

namespace hairnet::load {
namespace {

// Output that is no terminal gets a line every two seconds of the run, so that a log of an hour stays readable.
constexpr double kLineInterval_s = 2;
constexpr int kBarWidth = 50;

double per_s(std::uint64_t count, const WindowFigures& window) {
  return window.duration_s > 0 ? static_cast<double>(count) / window.duration_s : 0;
}

std::string level_mix(const WindowFigures& window) {
  std::string text;
  for (std::size_t i = 0; i < kLevelCount; ++i) {
    if (window.frames == 0 || window.frames_by_level[i] == 0) continue;
    text += fmt::format("{}{} {:.0f} %", text.empty() ? "" : ", ", kLevelNames[i],
                        100.0 * static_cast<double>(window.frames_by_level[i]) / static_cast<double>(window.frames));
  }
  return text.empty() ? "-" : text;
}

}  // namespace

std::string to_line(const RunProgress& p) {
  const WindowFigures& w = p.latest;
  return fmt::format(
      "{:6.1f}/{:.0f} s {:<10} {} clients, {} characters; p50 {:.1f} p99 {:.1f} max {:.1f} ms; {:.0f} "
      "frames/s, {:.0f} missed; {:.0f} kB/s; errors {}; server {:.2f} cores, generator {:.2f}, lag {:.1f} ms\n",
      p.time_s, p.duration_s, p.stage, p.clients, p.characters, w.latency_p50_ms, w.latency_p99_ms, w.latency_max_ms,
      per_s(w.frames, w), per_s(w.frames_missed, w), per_s(w.bytes_in, w) / 1e3, w.errors, p.server_cpu_cores,
      p.generator_cpu_cores, w.lag_max_ms);
}

std::string to_screen(const RunProgress& p) {
  const WindowFigures& w = p.latest;
  const int filled = static_cast<int>(kBarWidth * std::clamp(p.time_s / p.duration_s, 0.0, 1.0));
  std::string text = fmt::format("hairnet-load  {:<16} [{}{}] {:.0f} of {:.0f} s\n", p.stage, std::string(filled, '#'),
                                 std::string(kBarWidth - filled, '.'), p.time_s, p.duration_s);
  text +=
      fmt::format("  population  {} clients, {} characters, {} misbehaving\n", p.clients, p.characters, p.bad_clients);
  text += fmt::format("  latency     p50 {:.1f}  p99 {:.1f}  max {:.1f} ms\n", w.latency_p50_ms, w.latency_p99_ms,
                      w.latency_max_ms);
  text += fmt::format("  frames      {:.0f}/s, {:.0f} missed/s; {}\n", per_s(w.frames, w), per_s(w.frames_missed, w),
                      level_mix(w));
  text += fmt::format("  bytes       in {:.0f} kB/s (frames {:.0f}), out {:.0f} kB/s\n", per_s(w.bytes_in, w) / 1e3,
                      per_s(w.content_bytes, w) / 1e3, per_s(w.bytes_out, w) / 1e3);
  text += fmt::format("  wrong       {} errors, {} poses unsent, {} unanswered, {} checks failed\n", w.errors,
                      w.poses_unsent, w.poses_unanswered, p.check_failures);
  text += fmt::format("  processes   server {:.2f} cores, {:.0f} MiB; generator {:.2f} cores, lag {:.1f} ms\n",
                      p.server_cpu_cores, p.server_resident_mib, p.generator_cpu_cores, w.lag_max_ms);
  return text;
}

void LiveView::show(const RunProgress& progress) {
  if (!is_terminal_) {
    // A time before the last one belongs to the next run of a search for capacity, whose line is shown at once.
    if (progress.time_s - shown_s_ < kLineInterval_s && progress.time_s >= shown_s_) return;
    shown_s_ = progress.time_s;
    std::fputs(to_line(progress).c_str(), out_);
    std::fflush(out_);
    return;
  }
  const std::string screen = to_screen(progress);
  // The sequence moves the cursor up to the first line of the screen that was drawn last, and the new one overwrites
  // it.
  std::string drawn = lines_ > 0 ? fmt::format("\x1b[{}A", lines_) : "";
  for (const char c : screen) drawn += c == '\n' ? "\x1b[K\n" : std::string(1, c);  // clears to the end of the line
  lines_ = static_cast<int>(std::ranges::count(screen, '\n'));
  std::fputs(drawn.c_str(), out_);
  std::fflush(out_);
}

void LiveView::end() {
  lines_ = 0;
  shown_s_ = -1e9;
}

}  // namespace hairnet::load
