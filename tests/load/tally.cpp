#include "tests/load/tally.hpp"

#include <algorithm>
#include <cmath>

namespace hairnet::load {
namespace {

// The last 12 windows stay open for late answers. An answer to a pose of an earlier window counts in the oldest open
// one.
constexpr std::int64_t kWindowsOpen = 12;

}  // namespace

void Counts::add_error(std::string_view reason) {
  const auto known = errors.find(reason);
  if (known == errors.end())
    errors.emplace(reason, 1);
  else
    ++known->second;
}

Tally::Tally(const Plan& plan, std::int64_t begin_ns, std::int64_t window_ns)
    : begin_ns_(begin_ns), window_ns_(window_ns), population_ns_(begin_ns) {
  for (std::size_t i = 0; i < plan.stages.size(); ++i) {
    ends_ns_.push_back(begin_ns + plan.stage_begin_ns(i) + std::llround(plan.stages[i].warm_s * 1e9));
    ends_ns_.push_back(begin_ns + plan.stage_begin_ns(i + 1));
  }
  // Part 2 i is the warm-up of stage i, part 2 i + 1 the rest of it; the last part is for events after the end.
  stages_.resize(ends_ns_.size() + 1);
  window_count_max_ = (ends_ns_.back() - begin_ns + window_ns - 1) / window_ns;
}

// The part of the plan that the time lies in.
StageTally& Tally::at(std::int64_t time_ns) {
  // Most calls are about the same part of the plan as the last call, so this one is tried first.
  const bool before = newest_ > 0 && time_ns < ends_ns_[newest_ - 1];
  const bool after = newest_ < ends_ns_.size() && time_ns >= ends_ns_[newest_];
  if (before || after)
    newest_ = static_cast<std::size_t>(std::ranges::upper_bound(ends_ns_, time_ns) - ends_ns_.begin());
  return stages_[newest_];
}

// The window that the time lies in. Windows in between that nothing has happened in are made, too.
Tally::Window& Tally::window_at(std::int64_t time_ns) {
  const auto first = static_cast<std::int64_t>(windows_.size());
  const std::int64_t index = std::max(first, (time_ns - begin_ns_) / window_ns_);
  if (index >= window_count_max_) return after_;
  while (first + static_cast<std::int64_t>(open_.size()) <= index) open_.emplace_back();
  return open_[static_cast<std::size_t>(index - first)];
}

void Tally::count(std::int64_t now_ns, std::uint64_t Counts::*which, std::uint64_t by) {
  at(now_ns).counts.*which += by;
  window_at(now_ns).counts.*which += by;
}

void Tally::count_error(std::int64_t now_ns, std::string_view reason) {
  at(now_ns).counts.add_error(reason);
  window_at(now_ns).counts.add_error(reason);
}

void Tally::count_bad_client_end(std::int64_t now_ns, std::string_view kind, std::string_view reason) {
  ++at(now_ns).counts.bad_client_ends[std::string(kind) + ": " + std::string(reason)];
}

void Tally::record_answer(std::int64_t captured_ns, std::int64_t arrived_ns, std::uint64_t characters) {
  StageTally& stage = at(captured_ns);
  stage.latency.record(arrived_ns - captured_ns, characters);
  stage.counts.poses_answered += characters;
  window_at(captured_ns).latency.record(arrived_ns - captured_ns, characters);
}

// A pose without an answer counts as a latency, or a server that answers nothing would have the best latencies.
void Tally::record_unanswered(std::int64_t captured_ns, std::int64_t now_ns, std::uint64_t characters) {
  StageTally& stage = at(captured_ns);
  stage.latency.record(now_ns - captured_ns, characters);
  stage.counts.poses_unanswered += characters;
  Window& window = window_at(captured_ns);
  window.latency.record(now_ns - captured_ns, characters);
  window.counts.poses_unanswered += characters;
}

void Tally::record_join(std::int64_t intended_ns, std::int64_t now_ns, bool answered) {
  StageTally& stage = at(intended_ns);
  stage.join.record(now_ns - intended_ns);
  ++(answered ? stage.counts.joins : stage.counts.joins_unanswered);
}

void Tally::record_lag(std::int64_t intended_ns, std::int64_t now_ns) {
  at(intended_ns).lag.record(now_ns - intended_ns);
  window_at(now_ns).lag.record(now_ns - intended_ns);
  lag_.record(now_ns - intended_ns);
}

void Tally::record_frame(std::int64_t now_ns, LevelIndex level, std::uint32_t stride, std::size_t content_bytes,
                         bool discontinuous, bool own) {
  const auto add = [&](Counts& counts) {
    ++(own ? counts.frames : counts.frames_of_others);
    counts.frames_discontinuous += discontinuous ? 1 : 0;
    ++counts.frames_by_level[static_cast<std::size_t>(level)];
    const auto known = std::ranges::find(kStrides, stride);
    if (known != kStrides.end()) ++counts.frames_by_stride[static_cast<std::size_t>(known - kStrides.begin())];
    counts.content_bytes += content_bytes;
  };
  add(at(now_ns).counts);
  add(window_at(now_ns).counts);
}

// With a stride of 4, a gap of 4 ticks misses nothing and is a gap of 1; one of 8 ticks misses a frame.
void Tally::record_gap(std::int64_t now_ns, std::uint64_t ticks, std::uint32_t stride) {
  Counts& counts = at(now_ns).counts;
  counts.gap_ticks_max = std::max(counts.gap_ticks_max, ticks > stride ? ticks - stride + 1 : 1);
  if (ticks > stride) count(now_ns, &Counts::frames_missed, ticks / stride - 1);
}

void Tally::record_frame_age(std::int64_t sampled_ns, std::int64_t arrived_ns) {
  at(arrived_ns).frame_age.record(arrived_ns - sampled_ns);
}

void Tally::record_frame_of_other(std::int64_t sampled_ns, std::int64_t arrived_ns, std::int64_t before_ns) {
  StageTally& stage = at(arrived_ns);
  stage.others_age.record(arrived_ns - sampled_ns);
  if (before_ns > 0) stage.others_interval.record(arrived_ns - before_ns);
}

void Tally::record_hands(std::int64_t captured_ns, std::int64_t arrived_ns) {
  at(captured_ns).hands_latency.record(arrived_ns - captured_ns);
}

void Tally::record_props(std::int64_t sent_ns, std::int64_t arrived_ns) {
  at(sent_ns).props_latency.record(arrived_ns - sent_ns);
}

void Tally::record_jitter(std::int64_t now_ns, std::int64_t deviation_ns) {
  at(now_ns).jitter.record(std::abs(deviation_ns));
}

// Sums clients and characters over the time since the last call.
void Tally::note_population(std::int64_t now_ns, std::size_t clients, std::size_t characters) {
  const double passed_s = static_cast<double>(now_ns - population_ns_) * 1e-9;
  population_ns_ = now_ns;
  const auto add = [&](Counts& counts) {
    counts.client_s += passed_s * static_cast<double>(clients);
    counts.character_s += passed_s * static_cast<double>(characters);
  };
  add(at(now_ns).counts);
  add(window_at(now_ns).counts);
}

void Tally::advance(std::int64_t now_ns) {
  while (static_cast<std::int64_t>(windows_.size()) < window_count_max_ &&
         begin_ns_ + (static_cast<std::int64_t>(windows_.size()) + kWindowsOpen) * window_ns_ <= now_ns)
    close_window(static_cast<double>(window_ns_) * 1e-9);
}

void Tally::finish(std::int64_t now_ns) {
  while (!open_.empty()) {
    const std::int64_t from_ns = begin_ns_ + static_cast<std::int64_t>(windows_.size()) * window_ns_;
    // The last window may be shorter than the others, but not empty, since rates divide by its length.
    const std::int64_t until_ns = std::min(now_ns, ends_ns_.back());
    close_window(static_cast<double>(std::clamp(until_ns - from_ns, std::int64_t{1'000'000}, window_ns_)) * 1e-9);
  }
}

void Tally::close_window(double duration_s) {
  if (open_.empty()) open_.emplace_back();
  windows_.push_back(figures_of(open_.front(), windows_.size(), duration_s));
  open_.pop_front();
}

WindowFigures Tally::latest(std::int64_t now_ns) const {
  const std::int64_t index = (now_ns - begin_ns_) / window_ns_ - 1 - static_cast<std::int64_t>(windows_.size());
  if (index < 0 || index >= static_cast<std::int64_t>(open_.size())) return {};
  return figures_of(open_[static_cast<std::size_t>(index)], windows_.size() + static_cast<std::size_t>(index),
                    static_cast<double>(window_ns_) * 1e-9);
}

WindowFigures Tally::figures_of(const Window& window, std::size_t index, double duration_s) const {
  const Counts& counts = window.counts;
  WindowFigures figures;
  figures.begin_s = static_cast<double>(static_cast<std::int64_t>(index) * window_ns_) * 1e-9;
  figures.duration_s = duration_s;
  figures.latency_p50_ms = window.latency.quantile_ms(0.5);
  figures.latency_p99_ms = window.latency.quantile_ms(0.99);
  figures.latency_max_ms = window.latency.max_ms();
  figures.lag_max_ms = window.lag.max_ms();
  figures.clients = counts.client_s / duration_s;
  figures.characters = counts.character_s / duration_s;
  figures.frames = counts.frames + counts.frames_of_others;
  figures.frames_missed = counts.frames_missed;
  figures.bytes_in = counts.bytes_in;
  figures.bytes_out = counts.bytes_out;
  figures.content_bytes = counts.content_bytes;
  figures.poses_unanswered = counts.poses_unanswered;
  figures.poses_unsent = counts.poses_unsent;
  for (const auto& [reason, count] : counts.errors) figures.errors += count;
  figures.frames_by_level = counts.frames_by_level;
  return figures;
}

}  // namespace hairnet::load
