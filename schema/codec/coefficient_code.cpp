#include "schema/codec/coefficient_code.hpp"

#include <algorithm>
#include <array>
#include <bit>
#include <cmath>
#include <limits>

#include "core/assert.hpp"
#include "schema/codec/golomb.hpp"

// A header: the step, and `calm`, by which all parameters are less. Then Golomb-Rice: z = zigzag of the integer, z >> k
// zeros, a one, and the low k bits of z. After kUnaryMax zeros come a one and all bits of z. So zeros that fill the
// last byte are never a coefficient. An ideal arithmetic coder would take 4 to 6 % fewer bits, lose one or two bytes of
// that wherever a frame is cut, and divide for each number.
namespace hairnet::codec {
namespace {

constexpr unsigned kStepBits = 3, kCalmBits = 3;
constexpr unsigned kCalmMax = (1u << kCalmBits) - 1;
// After kUnaryMax zeros and a one all kWholeBits bits of z follow.
constexpr unsigned kUnaryMax = 16;
constexpr unsigned kWholeBits = 20;
constexpr int kIntegerMin = -(1 << (kWholeBits - 1)), kIntegerMax = -kIntegerMin - 1;
constexpr int kParameterMax = 16;
static_assert(kStepCount == 1u << kStepBits);
static_assert(kCoefficientHeaderBits == kStepBits + kCalmBits);
static_assert(kUnaryMax + 1 + std::max<unsigned>(kWholeBits, kParameterMax) <= 8 * kCoefficientBytesMax);

// The number of bits that z takes. An outlier would take z >> parameter zeros, so from kUnaryMax zeros on it is written
// as a whole.
unsigned bits_of(std::uint32_t z, unsigned parameter) {
  const std::uint32_t zeros = z >> parameter;
  return zeros < kUnaryMax ? zeros + 1 + parameter : kUnaryMax + 1 + kWholeBits;
}

// Rounds c * per_step to the nearest integer, to the even one of two. The result is shifted by kIntegers: from 2^23 to
// 2^24 floats are the integers, and their bits count up. std::nearbyint would be a call where SSE4.1 is not certain.
constexpr float kIntegers = 0x1.8p23f;
float shifted_nearest(float c, float per_step) {
  return std::max(std::min(c * per_step, static_cast<float>(kIntegerMax)), static_cast<float>(kIntegerMin)) + kIntegers;
}
std::int32_t integer_of(float shifted) {
  return std::bit_cast<std::int32_t>(shifted) - std::bit_cast<std::int32_t>(kIntegers);
}

// Only steps between these factors of the tolerance are tried, since the best one lies there. Finer steps waste bits
// even where 256 coefficients are rounded, and coarser ones leave no room for other errors.
constexpr float kFineStep = 0.1f, kCoarseStep = 1;

}  // namespace

CoefficientCode::CoefficientCode(std::span<const float> deviation_m) {
  for (const float deviation : deviation_m) {
    HAIRNET_ASSERT(std::isfinite(deviation) && deviation > 0);
    // The best parameter of a Laplace distribution: 2^k is near 1.375 deviations.
    const double size = 1.375 * static_cast<double>(deviation) / static_cast<double>(kFinestStep_m);
    // Modes whose coefficients are smaller than the finest step end below 0, which parameter() takes for 0.
    int parameter = -static_cast<int>(kStepCount);
    while (parameter < kParameterMax && size >= std::ldexp(1.0, parameter + 1)) ++parameter;
    parameters_.push_back(parameter);
  }
}

unsigned CoefficientCode::parameter(std::size_t k, unsigned step, unsigned calm) const {
  HAIRNET_VALIDATE(k < parameters_.size());
  return static_cast<unsigned>(std::max(parameters_[k] - static_cast<int>(step + calm), 0));
}

Detail detail_for(const CoefficientCode& code, std::span<const float> coefficients, float tolerance_m) {
  HAIRNET_ASSERT(coefficients.size() <= code.mode_count());
  HAIRNET_ASSERT(tolerance_m >= 0);
  // The sums are in double, since what is left out is a small difference of large sums.
  const double square_m2 = static_cast<double>(tolerance_m) * static_cast<double>(tolerance_m);
  double all_m2 = 0;
  for (const float c : coefficients) all_m2 += static_cast<double>(c * c);
  if (all_m2 <= square_m2) return {0, kStepCount - 1};
  Detail best{coefficients.size(), 0};
  std::size_t min_bits = std::numeric_limits<std::size_t>::max();
  // Coarse steps come first: they are soon judged, and their bits bound those of fine ones.
  for (unsigned step = kStepCount; step-- > 0;) {
    const float step_m = kFinestStep_m * static_cast<float>(1u << step), per_step = 1 / step_m;
    // The finest step is tried for any tolerance, so `best` is the answer where no step suffices.
    if (step > 0 && step_m > kCoarseStep * tolerance_m) continue;
    if (step + 1 < kStepCount && step_m < kFineStep * tolerance_m) break;
    // The squared errors of the coefficients that are rounded, and of those that are left out.
    double rounded_m2 = 0, left_m2 = all_m2;
    std::size_t bits = 0, count = 0;
    const auto is_within = [&] { return rounded_m2 + left_m2 <= square_m2; };
    // The loop adds coefficients, the most important first, until the error fits. It gives up when rounding alone
    // exceeds the tolerance or the bits exceed the best so far.
    for (; count < coefficients.size() && !is_within() && rounded_m2 <= square_m2 && bits <= min_bits; ++count) {
      const float c = coefficients[count];
      const float shifted = shifted_nearest(c, per_step), off = c - step_m * (shifted - kIntegers);
      rounded_m2 += static_cast<double>(off * off);
      left_m2 -= static_cast<double>(c * c);
      bits += bits_of(zigzag(integer_of(shifted)), code.parameter(count, step, 0));
    }
    // Among choices of equally many bits the finer step, with fewer coefficients, wins.
    if (is_within() && bits <= min_bits) {
      min_bits = bits;
      best = {count, step};
    }
  }
  return best;
}

void encode_coefficients(const CoefficientCode& code, std::span<const float> coefficients, unsigned step,
                         BitWriter& writer, std::vector<std::uint32_t>& ends) {
  HAIRNET_ASSERT(coefficients.size() <= code.mode_count());
  HAIRNET_ASSERT(step < kStepCount);
  const float per_step = 1 / (kFinestStep_m * static_cast<float>(1u << step));
  // `ends` holds the integers until their ends are known, which spares a second buffer for each frame.
  ends.clear();
  for (const float c : coefficients) {
    HAIRNET_ASSERT(std::isfinite(c));
    ends.push_back(zigzag(integer_of(shifted_nearest(c, per_step))));
  }
  const auto bits_if = [&](unsigned calm) {
    std::size_t bits = 0;
    for (std::size_t k = 0; k < ends.size(); ++k) bits += bits_of(ends[k], code.parameter(k, step, calm));
    return bits;
  };
  unsigned calm = 0;
  // The search stops at the first value that is no better. A worse choice costs bits, never correctness: any `calm` can
  // be decoded.
  for (std::size_t least = bits_if(0); calm < kCalmMax; ++calm) {
    const std::size_t bits = bits_if(calm + 1);
    if (bits >= least) break;
    least = bits;
  }
  writer.put(step, kStepBits);
  writer.put(calm, kCalmBits);
  std::uint32_t end = kCoefficientHeaderBits;
  for (std::size_t k = 0; k < ends.size(); ++k) {
    const std::uint32_t z = ends[k];
    const unsigned parameter = code.parameter(k, step, calm);
    // The zeros, the one and the low bits go out in one call: at most kUnaryMax + 1 + kWholeBits = 37 bits, below the
    // 56 of a put.
    const bool is_whole = z >> parameter >= kUnaryMax;
    const unsigned zeros = is_whole ? kUnaryMax : z >> parameter, low_bits = is_whole ? kWholeBits : parameter;
    const std::uint64_t low = z & ((std::uint64_t{1} << low_bits) - 1);
    writer.put(std::uint64_t{1} << zeros | low << (zeros + 1), zeros + 1 + low_bits);
    ends[k] = end += zeros + 1 + low_bits;
  }
}

std::size_t decode_coefficients(const CoefficientCode& code, BitReader& reader, std::span<float> out) {
  HAIRNET_ASSERT(out.size() >= code.mode_count());
  const auto step = static_cast<unsigned>(reader.take(kStepBits));
  const auto calm = static_cast<unsigned>(reader.take(kCalmBits));
  const float step_m = std::ldexp(kFinestStep_m, static_cast<int>(step));
  for (std::size_t k = 0; k < code.mode_count(); ++k) {
    const unsigned parameter = code.parameter(k, step, calm);
    // The set bit bounds the count. Past the end the reader gives zeros only, so padding reads as an outlier beyond the
    // end.
    const auto zeros = static_cast<unsigned>(std::countr_zero(reader.peek() | std::uint64_t{1} << kUnaryMax));
    reader.skip(zeros + 1);
    const auto z = static_cast<std::uint32_t>(
        zeros < kUnaryMax ? reader.take(parameter) | std::uint64_t{zeros} << parameter : reader.take(kWholeBits));
    // A frame that was cut ends within a coefficient. What is whole before it is a valid, coarser hair.
    if (reader.beyond_end()) return k;
    out[k] = step_m * static_cast<float>(unzigzag(z));
  }
  return code.mode_count();
}

}  // namespace hairnet::codec
