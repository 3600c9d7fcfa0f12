#include "tests/whole/frame_comparison.hpp"

#include <algorithm>
#include <cmath>
#include <limits>
#include <utility>

namespace hairnet::whole {
namespace {

using support::read_npy;

// A change of level fades within half a second, which is 15 ticks at 30 Hz.
constexpr std::int64_t kFade_ticks = 15;
// Clients ask for an error of 1 mm where a head fills the screen (wire::Observe::error_m). The bound leaves a fifth
// more.
constexpr double kErrorMax_m = 1.2e-3;
// Learnt hair may differ more: clients compute it from poses that are rounded, and begin later than the server.
constexpr double kLearntErrorMax_m = 2.5e-3;
// The largest amounts by which schema/codec/pose_code.hpp may round the head's position, those of other bones, and
// rotations.
constexpr double kHeadMax_m = 2e-4, kBoneMax_m = 8e-3, kTurnMax_rad = 6e-3;

std::vector<Vec3f> displacement_of(const Trace& trace, std::size_t frame) {
  std::vector<Vec3f> d;
  for (std::size_t n = 0; n < trace.count(frame); ++n)
    d.emplace_back(Eigen::Map<const Vec3f>(trace.displacement(frame) + 3 * n));
  return d;
}

// The level whose nodes a frame on `level` has.
LevelIndex lattice_of(LevelIndex level) {
  return level == LevelIndex::learnt ? LevelIndex::high : level;
}

struct HairDifference {
  // The RMS error over the hair.
  double error_m = std::numeric_limits<double>::infinity();
  bool moves = false;
};

// Returns the difference if the frame has these modes. It is infinite where the numbers of nodes show that the frame
// has others.
HairDifference difference(const Trace& received, std::size_t r, const Trace& computed, std::size_t c, LevelIndex level,
                          const Modes& modes) {
  const bool fits = std::cmp_equal(modes.map(level).matrix().cols(), 3 * computed.count(c)) &&
                    received.count(r) == modes.basis.node_count;
  if (!fits) return {};
  std::vector<float> wanted(modes.basis.mode_count()), got(wanted.size());
  modes.map(level).coefficients_of(displacement_of(computed, c), wanted);
  modes.map(LevelIndex::high).coefficients_of(displacement_of(received, r), got);
  double squares = 0, motion = 0;
  for (std::size_t k = 0; k < got.size(); ++k) {
    squares += std::pow(static_cast<double>(got[k] - wanted[k]), 2);
    motion += std::pow(static_cast<double>(wanted[k]), 2);
  }
  return {std::sqrt(squares), motion > 0};
}

// Compares the hair of one frame. A trace does not name grooms, and the folder also has levels of other tests' grooms,
// some with the same number of nodes. So the groom is taken to be the one whose modes agree best.
void compare_hair(const Trace& received, std::size_t r, const Trace& computed, std::size_t c,
                  const std::vector<std::shared_ptr<const Modes>>& modes, FrameComparison& result) {
  const bool is_learnt = static_cast<LevelIndex>(computed.level(c)) == LevelIndex::learnt;
  const LevelIndex level = lattice_of(static_cast<LevelIndex>(computed.level(c)));
  if (computed.count(c) == 0) {
    result.hair_differs += received.count(r) != 0;
    return;
  }
  HairDifference best;
  for (const std::shared_ptr<const Modes>& each : modes) {
    const HairDifference one = difference(received, r, computed, c, level, *each);
    if (one.error_m < best.error_m) best = one;
  }
  result.hair_differs += !(best.error_m <= (is_learnt ? kLearntErrorMax_m : kErrorMax_m));
  if (std::isinf(best.error_m)) return;
  result.moving_frames += best.moves;
  result.learnt_frames += is_learnt;
  result.error_mm_max = std::max(result.error_mm_max, 1e3 * best.error_m);
}

// Frames have poses rounded by schema/codec/pose_code.hpp.
bool are_near(const float* got, const float* wanted) {
  for (std::size_t bone = 0; bone < kBoneCount; ++bone, got += 7, wanted += 7) {
    const Vec3f away = Eigen::Map<const Vec3f>(got) - Eigen::Map<const Vec3f>(wanted);
    const Eigen::Quaternionf p(got + 3), q(wanted + 3);
    if (!(static_cast<double>(away.norm()) <= (bone == 0 ? kHeadMax_m : kBoneMax_m))) return false;
    if (!(static_cast<double>(p.angularDistance(q)) <= kTurnMax_rad)) return false;
  }
  return true;
}

}  // namespace

Trace::Trace(const std::string& folder)
    : frames(read_npy<std::int64_t>(folder + "/frames.npy")),
      poses(read_npy<float>(folder + "/poses.npy")),
      displacements(read_npy<float>(folder + "/displacements.npy")) {
  for (std::size_t f = 0; f < frames.row_count(); ++f) by_character_and_tick[{frames.row(f)[1], frames.row(f)[0]}] = f;
}

bool Trace::all_finite() const {
  const auto finite = [](float x) { return std::isfinite(x); };
  return std::all_of(displacements.values.begin(), displacements.values.end(), finite) &&
         std::all_of(poses.values.begin(), poses.values.end(), finite);
}

FrameComparison compare(const Trace& received, const Trace& computed,
                        const std::vector<std::shared_ptr<const Modes>>& modes) {
  FrameComparison result;
  const std::pair<std::int64_t, std::int64_t>* last = nullptr;
  std::int64_t level = -1, switched = 0;
  for (const auto& [key, r] : received.by_character_and_tick) {
    const bool is_same = last && last->first == key.first;
    if (is_same && !received.asleep(received.by_character_and_tick.at(*last)))
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
    result.poses_differ += !are_near(received.poses.row(r), computed.poses.row(c));
    if (!is_same || level != computed.level(c)) switched = key.second;
    level = computed.level(c);
    if (key.second - switched < kFade_ticks)
      ++result.fading;
    else
      compare_hair(received, r, computed, c, modes, result);
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
