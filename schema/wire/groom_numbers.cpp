#include "schema/wire/groom_numbers.hpp"

#include <Eigen/Cholesky>
#include <algorithm>
#include <cmath>

#include "core/assert.hpp"

namespace hairnet::wire {
namespace {

constexpr std::size_t kPlanes = 3;  // an integer has 24 bits
constexpr std::int32_t kIntegerMax = (1 << 23) - 1;
constexpr std::size_t kRunsPerRowMin = 64;  // fewer runs do not pay for weights of their own
constexpr double kWeightUnit = 4096;

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
    std::erase_if(runs, [number](const PointRun& run) { return run.begin + number * run.stride >= run.end; });
    if (runs.empty()) return;
    body(number, std::span<const PointRun>(runs));
  }
}

// Calls body(i, step) for each coordinate i of the row; i - step is the same coordinate of the point before.
template <class Body>
void for_each_coordinate(std::size_t number, std::span<const PointRun> runs, Body body) {
  for (const PointRun& run : runs) {
    const std::size_t step = 3 * run.stride, begin = 3 * run.begin + number * step;
    const std::size_t end = std::min(begin + step, 3 * run.end);
    for (std::size_t i = begin; i < end; ++i) body(i, step);
  }
}

using Taps = std::array<std::int16_t, kGroomTaps>;
using Steps = std::array<std::int64_t, kGroomTaps>;

// From each point before coordinate i to the next one, the nearest first; 0 where there are no more.
Steps steps_before(std::span<const std::int32_t> q, std::size_t number, std::size_t i, std::size_t step) {
  Steps steps{};
  for (std::size_t t = 0; t < kGroomTaps && t + 2 <= number; ++t)
    steps[t] = std::int64_t{q[i - (t + 1) * step]} - q[i - (t + 2) * step];
  return steps;
}

std::int64_t predict(std::span<const std::int32_t> q, std::size_t number, std::size_t i, std::size_t step,
                     const Taps& taps) {
  if (number == 0) return 0;
  const Steps steps = steps_before(q, number, i, step);
  auto sum = static_cast<std::int64_t>(kWeightUnit / 2);
  for (std::size_t t = 0; t < kGroomTaps; ++t) sum += taps[t] * steps[t];
  return q[i - step] + (sum >> 12);
}
static_assert(kWeightUnit == 1 << 12);

// The weights of the smallest squared error over the row.
Taps fit_taps(std::span<const std::int32_t> q, std::size_t number, std::span<const PointRun> runs) {
  using Matrix = Eigen::Matrix<double, kGroomTaps, kGroomTaps>;
  using Vector = Eigen::Vector<double, kGroomTaps>;
  Matrix a = Matrix::Identity();  // so that a step that is always 0 has weight 0
  Vector b = Vector::Zero();
  for_each_coordinate(number, runs, [&](std::size_t i, std::size_t step) {
    const Steps steps = steps_before(q, number, i, step);
    Vector x;
    for (std::size_t t = 0; t < kGroomTaps; ++t) x[static_cast<Eigen::Index>(t)] = static_cast<double>(steps[t]);
    a += x * x.transpose();
    b += static_cast<double>(q[i] - q[i - step]) * x;
  });
  const Vector fitted = a.ldlt().solve(b);
  Taps taps{};
  for (std::size_t t = 0; t < kGroomTaps; ++t) {
    const double weight = kWeightUnit * fitted[static_cast<Eigen::Index>(t)];
    taps[t] =
        static_cast<std::int16_t>(std::clamp(std::isfinite(weight) ? std::round(weight) : 0.0, -32768.0, 32767.0));
  }
  return taps;
}

template <class Range>
void add_run(const Range& points, std::size_t stride, std::vector<PointRun>& runs) {
  runs.push_back({points.begin, points.end, stride});
}

}  // namespace

std::vector<PointRun> point_runs(const Groom& groom) {
  std::vector<PointRun> runs;
  runs.reserve(groom.strand_begin.size());
  for (std::size_t s = 0; s + 1 < groom.strand_begin.size(); ++s)
    runs.push_back({groom.strand_begin[s], groom.strand_begin[s + 1], 1});
  for (const Thread& thread : groom.threads) add_run(thread.points, 1, runs);
  for (const HairCard& card : groom.cards) add_run(card.points, 2, runs);
  for (const Cloth& cloth : groom.cloths) add_run(cloth.points, 1, runs);
  return runs;
}

std::vector<PointRun> point_runs(const FarCards& far_cards) {
  std::vector<PointRun> runs;
  for (const FarCard& card : far_cards.cards) add_run(card.points, 2, runs);
  return runs;
}

EncodedPoints encode_points(std::span<const Vec3f> points, std::span<const PointRun> runs) {
  std::vector<std::int32_t> q;
  q.reserve(3 * points.size());
  for (const Vec3f& point : points) {
    for (const float x : point) q.push_back(quantise(x / kGroomStep_m));
  }
  EncodedPoints out;
  std::vector<std::int32_t> remainders;
  remainders.reserve(q.size());
  for_each_row(runs, [&](std::size_t number, std::span<const PointRun> row) {
    Taps taps{};
    if (number >= 2 && row.size() >= kRunsPerRowMin) {
      taps = fit_taps(q, number, row);
      out.weights.insert(out.weights.end(), taps.begin(), taps.end());
    }
    for_each_coordinate(number, row, [&](std::size_t i, std::size_t step) {
      remainders.push_back(wrapped(q[i] - predict(q, number, i, step, taps)));
    });
  });
  HAIRNET_ASSERT(remainders.size() == q.size());
  out.planes = encode_planes(remainders);
  return out;
}

std::string decode_points(std::span<const std::int16_t> weights, std::span<const std::uint8_t> planes,
                          std::span<const PointRun> runs, std::vector<Vec3f>& points) {
  PlaneReader reader(planes);
  std::size_t count = 0;
  for (const PointRun& run : runs) {
    HAIRNET_ASSERT(run.begin == count && run.begin <= run.end);
    count = run.end;
  }
  if (planes.size() != 3 * kPlanes * count)
    return std::to_string(reader.count() / 3) + " points, not " + std::to_string(count) + " as counted";
  std::vector<std::int32_t> q(3 * count);
  for_each_row(runs, [&](std::size_t number, std::span<const PointRun> row) {
    Taps taps{};
    const std::size_t first = number < 2 ? weights.size() : kGroomTaps * (number - 2);
    if (first + kGroomTaps <= weights.size())
      std::copy_n(weights.begin() + static_cast<std::ptrdiff_t>(first), kGroomTaps, taps.begin());
    for_each_coordinate(number, row, [&](std::size_t i, std::size_t step) {
      q[i] = wrapped(predict(q, number, i, step, taps) + reader.take());
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
    // Rounding misses the sum by a few units. Any more is a fault, and stays one.
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

std::vector<std::uint8_t> encode_triangles(std::span<const std::array<std::uint32_t, 3>> triangles) {
  std::vector<std::int32_t> integers;
  integers.reserve(3 * triangles.size());
  std::uint32_t before = 0;
  for (const auto& triangle : triangles) {
    for (const std::uint32_t index : triangle) {
      integers.push_back(wrapped(std::int64_t{index} - before));
      before = index;
    }
  }
  return encode_planes(integers);
}

std::string decode_triangles(std::span<const std::uint8_t> planes,
                             std::vector<std::array<std::uint32_t, 3>>& triangles) {
  if (planes.size() % (kPlanes * 3) != 0) return "triangles are not 3 numbers each";
  PlaneReader reader(planes);
  triangles.resize(reader.count() / 3);
  std::uint32_t before = 0;
  for (auto& triangle : triangles) {
    for (std::uint32_t& index : triangle) index = before += static_cast<std::uint32_t>(reader.take());
  }
  return {};
}

}  // namespace hairnet::wire
