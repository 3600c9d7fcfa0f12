#include "tests/whole/frame_comparison.hpp"

#include <algorithm>
#include <cmath>
#include <cstring>

namespace hairnet::whole {
namespace {

using support::read_npy;

void compare_displacements(const Trace& received, std::size_t r, const Trace& computed, std::size_t c,
                           FrameComparison& result) {
  const double quantum = received.quanta.values[r];
  bool differs = false, moves = false;
  for (std::size_t i = 0; i < 3 * received.count(r); ++i) {
    const double got = received.displacement(r)[i], wanted = computed.displacement(c)[i];
    const double error = std::abs(got - wanted);
    // Half a quantum, and the rounding of quantum times integer to float.
    differs |= !(error <= quantum / 2 + 1e-6 * std::abs(wanted) + 1e-9);
    moves |= wanted != 0;
    result.error_mm_max = std::max(result.error_mm_max, 1e3 * error);
    if (quantum > 0) result.error_quanta_max = std::max(result.error_quanta_max, error / quantum);
  }
  result.displacements_differ += differs;
  result.moving_frames += moves;
}

}  // namespace

Trace::Trace(const std::string& folder)
    : frames(read_npy<std::int64_t>(folder + "/frames.npy")),
      quanta(read_npy<float>(folder + "/quanta.npy")),
      poses(read_npy<float>(folder + "/poses.npy")),
      displacements(read_npy<float>(folder + "/displacements.npy")) {
  for (std::size_t f = 0; f < frames.row_count(); ++f) by_character_and_tick[{frames.row(f)[1], frames.row(f)[0]}] = f;
}

bool Trace::all_finite() const {
  const auto finite = [](float x) { return std::isfinite(x); };
  return std::all_of(displacements.values.begin(), displacements.values.end(), finite) &&
         std::all_of(poses.values.begin(), poses.values.end(), finite);
}

FrameComparison compare(const Trace& received, const Trace& computed) {
  FrameComparison result;
  const std::pair<std::int64_t, std::int64_t>* last = nullptr;
  for (const auto& [key, r] : received.by_character_and_tick) {
    if (last && last->first == key.first && !received.asleep(received.by_character_and_tick.at(*last)))
      result.missed_ticks += static_cast<std::size_t>((key.second - last->second - 1) / received.step_stride(r));
    last = &key;
    const auto found = computed.by_character_and_tick.find(key);
    if (found == computed.by_character_and_tick.end()) {
      ++result.unknown;
      continue;
    }
    const std::size_t c = found->second;
    ++result.frames;
    result.levels_differ += received.level(r) != computed.level(c);
    result.poses_differ += std::memcmp(received.poses.row(r), computed.poses.row(c), 35 * sizeof(float)) != 0;
    if (received.count(r) != computed.count(c))
      ++result.counts_differ;
    else
      compare_displacements(received, r, computed, c, result);
  }
  return result;
}

std::map<std::int64_t, double> last_rms_mm(const Trace& trace) {
  std::map<std::int64_t, double> rms;
  for (const auto& [key, f] : trace.by_character_and_tick) {
    double sum = 0;
    for (std::size_t i = 0; i < 3 * trace.count(f); ++i)
      sum += double{trace.displacement(f)[i]} * trace.displacement(f)[i];
    rms[key.first] = trace.count(f) == 0 ? 0 : 1e3 * std::sqrt(sum / static_cast<double>(trace.count(f)));
  }
  return rms;
}

}  // namespace hairnet::whole
