#include "schema/wire/groom_numbers.hpp"

#include <Eigen/Cholesky>
#include <algorithm>
#include <cmath>
#include <cstdlib>
#include <limits>
#include <numeric>

#include "core/assert.hpp"

namespace hairnet::wire {
namespace {

constexpr std::size_t kPlanes = 3;  // an integer has 24 bits
constexpr std::int32_t kIntegerMax = (1 << 23) - 1;
constexpr std::size_t kRunsPerRowMin = 64;  // fewer runs do not pay for weights of their own
constexpr double kWeightUnit = 4096;
constexpr std::size_t kReferencesTriedMax = 2048;  // for each run
// A row's weights are fitted to so many of its runs. A file of 100 000 strands gets no smaller by fitting them to all.
constexpr std::size_t kRunsFittedMax = 16384;
constexpr std::size_t kNone = ~std::size_t{0};

// The lowest 24 bits as a signed number.
std::int32_t wrapped(std::int64_t value) {
  return static_cast<std::int32_t>(static_cast<std::uint32_t>(value) << 8) >> 8;
}

// Byte b of integer i is at b * count + i. The sign is the lowest bit (0, -1, 1, -2 ...), so that small numbers have
// empty upper bytes.
std::vector<std::uint8_t> encode_planes(std::span<const std::int32_t> integers) {
  const std::size_t count = integers.size();
  std::vector<std::uint8_t> planes(kPlanes * count);
  for (std::size_t i = 0; i < count; ++i) {
    const auto folded = static_cast<std::uint32_t>(integers[i]) << 1 ^ static_cast<std::uint32_t>(integers[i] >> 31);
    for (std::size_t b = 0; b < kPlanes; ++b) planes[b * count + i] = static_cast<std::uint8_t>(folded >> 8 * b);
  }
  return planes;
}

// The next integers of planes, one after the other.
class PlaneReader {
 public:
  explicit PlaneReader(std::span<const std::uint8_t> planes) : planes_(planes), count_(planes.size() / kPlanes) {}
  [[nodiscard]] std::size_t count() const { return count_; }
  std::int32_t take() {
    HAIRNET_VALIDATE(next_ < count_);
    std::uint32_t folded = 0;
    for (std::size_t b = 0; b < kPlanes; ++b) folded |= std::uint32_t{planes_[b * count_ + next_]} << 8 * b;
    ++next_;
    return static_cast<std::int32_t>(folded >> 1 ^ (0u - (folded & 1)));
  }

 private:
  std::span<const std::uint8_t> planes_;
  std::size_t count_, next_ = 0;
};

// Rounded to the nearest; kIntegerMax for what is not finite or does not fit.
std::int32_t quantise(double value) {
  return std::abs(value) <= kIntegerMax ? static_cast<std::int32_t>(std::lround(value)) : kIntegerMax;
}

// A row is the points of one number in their runs: all roots, then all second points, and so on. Calls
// body(number, runs that have it) for each row.
template <class Body>
void for_each_row(std::span<const PointRun> all, Body body) {
  std::vector<PointRun> runs(all.begin(), all.end());
  for (std::size_t number = 0;; ++number) {
    // Runs that have ended drop out. The others keep their order, which both ends rely on.
    std::erase_if(runs, [number](const PointRun& run) { return run.begin + number * run.stride >= run.end; });
    if (runs.empty()) return;
    body(number, std::span<const PointRun>(runs));
  }
}

// Calls body(i, step, reference) for each coordinate i of the row; i - step is the same coordinate of the point before,
// `reference` that of the point of the same number in the run's reference, or kNone.
template <class Body>
void for_each_coordinate(std::size_t number, std::span<const PointRun> runs, Body body) {
  for (const PointRun& run : runs) {
    const std::size_t step = 3 * run.stride, begin = 3 * run.begin + number * step;
    const std::size_t end = std::min(begin + step, 3 * run.end);
    for (std::size_t i = begin; i < end; ++i) {
      const std::size_t reference = 3 * std::size_t{run.reference.begin} + (i - 3 * run.begin);
      body(i, step, reference < 3 * std::size_t{run.reference.end} ? reference : kNone);
    }
  }
}

using Weights = std::array<std::int16_t, kGroomWeightsPerRow>;
using Steps = std::array<std::int64_t, kGroomTaps>;

// Returns the steps that lead to each point before coordinate i, the nearest first; 0 where there are no more.
Steps steps_before(std::span<const std::int32_t> q, std::size_t number, std::size_t i, std::size_t step) {
  Steps steps{};
  // The step t leads to point number - 1 - t, so it needs two points before this one.
  for (std::size_t t = 0; t < kGroomTaps && t + 2 <= number; ++t)
    steps[t] = std::int64_t{q[i - (t + 1) * step]} - q[i - (t + 2) * step];
  return steps;
}

// A weighted sum, rounded to the nearest.
std::int64_t scaled(std::int64_t sum) {
  static_assert(kWeightUnit == 1 << 12);
  return (sum + (1 << 11)) >> 12;
}

// Predicts coordinate i by the points before it in the same run.
std::int64_t predict(std::span<const std::int32_t> q, std::size_t number, std::size_t i, std::size_t step,
                     const Weights& weights) {
  // The first point of a run has none before it. Its integer is stored as it is.
  if (number == 0) return 0;
  const Steps steps = steps_before(q, number, i, step);
  std::int64_t sum = 0;
  for (std::size_t t = 0; t < kGroomTaps; ++t) sum += weights[t] * steps[t];
  return q[i - step] + scaled(sum);
}

Eigen::Vector<double, kGroomTaps> to_vector(const Steps& steps) {
  Eigen::Vector<double, kGroomTaps> x;
  for (std::size_t t = 0; t < kGroomTaps; ++t) x[static_cast<Eigen::Index>(t)] = static_cast<double>(steps[t]);
  return x;
}

// What the reference's error says of the error of coordinate i.
std::int64_t predict_error(std::span<const std::int32_t> errors, std::size_t reference, const Weights& weights) {
  return reference == kNone ? 0 : scaled(std::int64_t{weights[kGroomTaps]} * errors[reference]);
}

std::int16_t to_weight(double fitted) {
  const double weight = kWeightUnit * fitted;
  return static_cast<std::int16_t>(std::clamp(std::isfinite(weight) ? std::round(weight) : 0.0, -32768.0, 32767.0));
}

// Sets the weights of steps of the smallest squared error over the row, given the weight of the reference. A row of
// very many runs is judged by some of them, evenly.
void fit_steps(std::span<const std::int32_t> q, std::size_t number, std::span<const PointRun> row, Weights& weights) {
  using Matrix = Eigen::Matrix<double, kGroomTaps, kGroomTaps>;
  using Vector = Eigen::Vector<double, kGroomTaps>;
  if (number < 2) return;
  const double of_reference = weights[kGroomTaps] / kWeightUnit;
  // The identity keeps the matrix regular, and gives a step that is always 0 the weight 0. It is small beside sums of
  // squared integers.
  Matrix a = Matrix::Identity();
  Vector b = Vector::Zero();
  const auto add = [&](std::size_t i, std::size_t step, std::size_t reference) {
    Vector x = to_vector(steps_before(q, number, i, step));
    double y = q[i] - q[i - step];
    if (reference != kNone) {
      x -= of_reference * to_vector(steps_before(q, number, reference, step));
      y -= of_reference * (q[reference] - q[reference - step]);
    }
    a += x * x.transpose();
    b += y * x;
  };
  const std::size_t stride = 1 + (row.size() - 1) / kRunsFittedMax;
  for (std::size_t r = 0; r < row.size(); r += stride) for_each_coordinate(number, row.subspan(r, 1), add);
  const Vector fitted = a.ldlt().solve(b);
  for (std::size_t t = 0; t < kGroomTaps; ++t) weights[t] = to_weight(fitted[static_cast<Eigen::Index>(t)]);
}

// Sets the weight of the reference, likewise.
void fit_reference(std::span<const std::int32_t> errors, std::size_t number, std::span<const PointRun> row,
                   Weights& weights) {
  // The 1 keeps the quotient finite where all errors of the references are 0.
  double a = 1, b = 0;
  for_each_coordinate(number, row, [&](std::size_t i, std::size_t, std::size_t reference) {
    if (reference == kNone) return;
    a += double{1} * errors[reference] * errors[reference];
    b += double{1} * errors[reference] * errors[i];
  });
  weights[kGroomTaps] = to_weight(b / a);
}

constexpr std::size_t kBlock = 24;  // its sum has 32 bits

// Of fixed length, for compilers to vectorize.
std::int32_t distance_of_blocks(const std::int32_t* a, const std::int32_t* b) {
  std::int32_t sum = 0;
  for (std::size_t i = 0; i < kBlock; ++i) sum += std::abs(a[i] - b[i]);
  return sum;
}

std::span<const std::int32_t> errors_of(std::span<const std::int32_t> errors, const PointRun& run) {
  return errors.subspan(3 * run.begin, 3 * (run.end - run.begin));
}

std::int64_t size_of(std::span<const std::int32_t> errors) {
  return std::accumulate(errors.begin(), errors.end(), std::int64_t{0},
                         [](std::int64_t sum, std::int32_t error) { return sum + std::abs(error); });
}

// The sum of what remains of a run's errors beside another run's; at least `limit` if it is not below.
std::int64_t distance(std::span<const std::int32_t> a, std::span<const std::int32_t> b, std::int64_t limit) {
  const std::size_t both = std::min(a.size(), b.size());
  std::int64_t sum = 0;
  std::size_t i = 0;
  // The sum is compared with the limit once a block: most candidates are given up after a few.
  for (; i + kBlock <= both && sum < limit; i += kBlock) sum += distance_of_blocks(&a[i], &b[i]);
  if (sum >= limit) return sum;
  for (; i < both; ++i) sum += std::abs(a[i] - b[i]);
  return sum + size_of(a.subspan(both));
}

// What tells quickly that a run is no better reference than another. The search compares each run with 2048 of them, so
// they lie side by side.
struct RunOutline {
  std::array<std::int32_t, 3> first{};  // errors of the first point
  std::int32_t length = 0;              // numbers of the run
  std::int64_t rest = 0;                // size of the errors after the first point
};

RunOutline outline(std::span<const std::int32_t> errors) {
  if (errors.empty()) return {};
  return {{errors[0], errors[1], errors[2]}, static_cast<std::int32_t>(errors.size()), size_of(errors.subspan(3))};
}

// Is never more than distance(). Of a longer run only the beginning counts, which its rest does not tell.
std::int64_t min_distance(const RunOutline& own, const RunOutline& other) {
  std::int64_t sum = 0;
  for (std::size_t i = 0; i < 3; ++i) sum += std::abs(own.first[i] - other.first[i]);
  return other.length > own.length ? sum : sum + std::abs(own.rest - other.rest);
}

// Gives each run the earlier one of the most similar errors. Returns how many runs before it that is.
std::vector<std::int32_t> find_references(std::span<const std::int32_t> errors, std::vector<PointRun>& runs) {
  std::vector<std::int32_t> back(runs.size());
  std::vector<RunOutline> outlines;
  outlines.reserve(runs.size());
  for (const PointRun& run : runs) outlines.push_back(outline(errors_of(errors, run)));
  for (std::size_t r = 0; r < runs.size(); ++r) {
    const std::span<const std::int32_t> own = errors_of(errors, runs[r]);
    std::int64_t least = size_of(own);
    // The bound makes the search linear in the number of strands. Strands of a hairstyle lie in order, so similar ones
    // are near.
    for (std::size_t before = 1; before <= std::min(r, kReferencesTriedMax) && least > 0; ++before) {
      if (min_distance(outlines[r], outlines[r - before]) >= least) continue;
      const PointRun& other = runs[r - before];
      if (other.stride != runs[r].stride) continue;
      if (const std::int64_t d = distance(own, errors_of(errors, other), least); d < least) {
        least = d;
        back[r] = static_cast<std::int32_t>(before);
        runs[r].reference = {static_cast<std::uint32_t>(other.begin), static_cast<std::uint32_t>(other.end)};
      }
    }
  }
  return back;
}

std::string read_references(std::span<const std::uint8_t> planes, std::vector<PointRun>& runs) {
  if (planes.empty()) return {};
  if (planes.size() != kPlanes * runs.size())
    return std::to_string(planes.size() / kPlanes) + " references, not " + std::to_string(runs.size()) + " as counted";
  PlaneReader reader(planes);
  for (std::size_t r = 0; r < runs.size(); ++r) {
    const std::int32_t back = reader.take();
    // A reference ahead would read errors that are not decoded yet.
    if (back < 0 || static_cast<std::size_t>(back) > r) return "a reference to points that do not come before";
    const PointRun& other = runs[r - static_cast<std::size_t>(back)];
    if (other.stride != runs[r].stride) return "a reference to points of another kind";
    if (back > 0) runs[r].reference = {static_cast<std::uint32_t>(other.begin), static_cast<std::uint32_t>(other.end)};
  }
  return {};
}

template <class Range>
void add_run(const Range& points, std::size_t stride, std::vector<PointRun>& runs) {
  runs.push_back({points.begin, points.end, stride, {}});
}

}  // namespace

std::vector<PointRun> point_runs(const Groom& groom) {
  std::vector<PointRun> runs;
  runs.reserve(groom.strand_begin.size());
  for (std::size_t s = 0; s + 1 < groom.strand_begin.size(); ++s)
    runs.push_back({groom.strand_begin[s], groom.strand_begin[s + 1], 1, {}});
  for (const Thread& thread : groom.threads) add_run(thread.points, 1, runs);
  for (const HairCard& card : groom.cards) add_run(card.points, 2, runs);
  for (const Cloth& cloth : groom.cloths) add_run(cloth.points, 1, runs);
  return runs;
}

EncodedPoints encode_points(std::span<const Vec3f> points, std::vector<PointRun> runs) {
  std::vector<std::int32_t> q;
  q.reserve(3 * points.size());
  for (const Vec3f& point : points) {
    for (const float x : point) q.push_back(quantise(x / kGroomStep_m));
  }
  std::vector<Weights> weights;
  std::vector<std::int32_t> errors(q.size()), remainders;
  const auto fit = [&] {
    for_each_row(runs, [&](std::size_t number, std::span<const PointRun> row) {
      // Rows get weights from the first on, without gaps: runs only end from row to row, so a row never has more of
      // them than the row before.
      if (number == weights.size() && row.size() >= kRunsPerRowMin) weights.emplace_back();
      Weights of_row{};
      if (number < weights.size()) {
        fit_steps(q, number, row, weights[number]);
        of_row = weights[number];
      }
      for_each_coordinate(number, row, [&](std::size_t i, std::size_t step, std::size_t) {
        errors[i] = wrapped(q[i] - predict(q, number, i, step, of_row));
      });
      if (number < weights.size()) fit_reference(errors, number, row, weights[number]);
    });
  };
  EncodedPoints out;
  fit();
  if (!weights.empty()) {
    out.references = encode_planes(find_references(errors, runs));
    // Weights of steps and of references depend on each other, so they are fitted in turn. The references stay as they
    // were found.
    for (int round = 0; round < 2; ++round) fit();
  }
  remainders.reserve(q.size());
  for_each_row(runs, [&](std::size_t number, std::span<const PointRun> row) {
    const Weights of_row = number < weights.size() ? weights[number] : Weights{};
    for_each_coordinate(number, row, [&](std::size_t i, std::size_t, std::size_t reference) {
      remainders.push_back(wrapped(errors[i] - predict_error(errors, reference, of_row)));
    });
  });
  HAIRNET_ASSERT(remainders.size() == q.size());
  for (const Weights& of_row : weights) out.weights.insert(out.weights.end(), of_row.begin(), of_row.end());
  out.planes = encode_planes(remainders);
  return out;
}

std::string decode_points(std::span<const std::int16_t> weights, std::span<const std::uint8_t> references,
                          std::span<const std::uint8_t> planes, std::vector<PointRun> runs,
                          std::vector<Vec3f>& points) {
  PlaneReader reader(planes);
  std::size_t count = 0;
  for (const PointRun& run : runs) {
    // point_runs() gives contiguous runs for any file whose counts have been read.
    HAIRNET_ASSERT(run.begin == count && run.begin <= run.end);
    count = run.end;
  }
  if (planes.size() != 3 * kPlanes * count)
    return std::to_string(reader.count() / 3) + " points, not " + std::to_string(count) + " as counted";
  if (std::string error = read_references(references, runs); !error.empty()) return error;
  std::vector<std::int32_t> q(3 * count), errors(3 * count);
  for_each_row(runs, [&](std::size_t number, std::span<const PointRun> row) {
    Weights fitted{};
    const std::size_t first = kGroomWeightsPerRow * number;
    if (first + kGroomWeightsPerRow <= weights.size())
      std::copy_n(weights.begin() + static_cast<std::ptrdiff_t>(first), kGroomWeightsPerRow, fitted.begin());
    for_each_coordinate(number, row, [&](std::size_t i, std::size_t step, std::size_t reference) {
      // The reference comes earlier in the same row, so its error is here already. wrapped() makes any bytes valid:
      // forged ones give points that validate() refuses by their range.
      errors[i] = wrapped(reader.take() + predict_error(errors, reference, fitted));
      q[i] = wrapped(errors[i] + predict(q, number, i, step, fitted));
    });
  });
  points.resize(count);
  for (std::size_t p = 0; p < count; ++p) {
    for (std::size_t axis = 0; axis < 3; ++axis)
      points[p][static_cast<Eigen::Index>(axis)] = static_cast<float>(q[3 * p + axis] * kGroomStep_m);
  }
  return {};
}

std::vector<std::uint8_t> encode_bone_weights(std::span<const std::array<float, kBoneCount>> weights) {
  std::vector<std::int32_t> integers;
  integers.reserve(kBoneCount * weights.size());
  for (const auto& vertex : weights) {
    std::array<std::int32_t, kBoneCount> q;
    std::int32_t missing = kGroomWeightMax;
    for (std::size_t bone = 0; bone < kBoneCount; ++bone) {
      q[bone] = quantise(double{vertex[bone]} * kGroomWeightMax);
      missing -= q[bone];
    }
    // Rounding misses the sum by a few units. Any more is an error, and stays one.
    if (std::abs(missing) <= 16) *std::ranges::max_element(q) += missing;
    integers.insert(integers.end(), q.begin(), q.end());
  }
  return encode_planes(integers);
}

std::string decode_bone_weights(std::span<const std::uint8_t> planes,
                                std::vector<std::array<float, kBoneCount>>& weights) {
  if (planes.size() % (kPlanes * kBoneCount) != 0) return "bone weights are not 5 numbers each";
  PlaneReader reader(planes);
  weights.resize(reader.count() / kBoneCount);
  for (auto& vertex : weights) {
    for (float& weight : vertex) weight = static_cast<float>(double{1} * reader.take() / kGroomWeightMax);
  }
  return {};
}

std::vector<std::uint8_t> encode_indices(std::span<const std::uint32_t> indices) {
  std::vector<std::int32_t> steps;
  steps.reserve(indices.size());
  std::int32_t before = 0;
  for (const std::uint32_t index : indices) {
    // kIntegerMax is above every count of points that a groom may have, so a clamped index still fails validate().
    const auto clamped = static_cast<std::int32_t>(std::min<std::uint32_t>(index, kIntegerMax));
    steps.push_back(clamped - before);
    before = clamped;
  }
  return encode_planes(steps);
}

std::string decode_indices(std::span<const std::uint8_t> planes, std::vector<std::uint32_t>& indices) {
  if (planes.size() % kPlanes != 0) return "indices are not whole";
  PlaneReader reader(planes);
  indices.resize(reader.count());
  std::uint32_t before = 0;
  for (std::uint32_t& index : indices) index = before += static_cast<std::uint32_t>(reader.take());
  return {};
}

}  // namespace hairnet::wire
