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
// last byte are never a coefficient.
namespace hairnet::codec {
namespace {

constexpr unsigned kStepBits = 3, kCalmBits = 3;
constexpr unsigned kCalmMax = (1u << kCalmBits) - 1;
constexpr unsigned kUnaryMax = 16;
constexpr unsigned kWholeBits = 20;
constexpr int kIntegerMax = (1 << (kWholeBits - 1)) - 1;
constexpr int kParameterMax = 16;
static_assert(kStepCount == 1u << kStepBits);
static_assert(kCoefficientHeaderBits == kStepBits + kCalmBits);
static_assert(kUnaryMax + 1 + std::max<unsigned>(kWholeBits, kParameterMax) <= 8 * kCoefficientBytesMax);

unsigned bits_of(std::uint32_t z, unsigned parameter) {
  const std::uint32_t zeros = z >> parameter;
  return zeros < kUnaryMax ? zeros + 1 + parameter : kUnaryMax + 1 + kWholeBits;
}

}  // namespace

CoefficientCode::CoefficientCode(std::span<const float> deviation_m) {
  for (const float deviation : deviation_m) {
    HAIRNET_ASSERT(std::isfinite(deviation) && deviation > 0);
    // The best parameter of a Laplace distribution: 2^k is near 1.375 deviations.
    const double size = 1.375 * static_cast<double>(deviation) / static_cast<double>(kFinestStep_m);
    int parameter = -static_cast<int>(kStepCount);
    while (parameter < kParameterMax && size >= std::ldexp(1.0, parameter + 1)) ++parameter;
    parameters_.push_back(parameter);
  }
}

unsigned CoefficientCode::parameter(std::size_t k, unsigned step, unsigned calm) const {
  HAIRNET_VALIDATE(k < parameters_.size());
  return static_cast<unsigned>(std::max(parameters_[k] - static_cast<int>(step + calm), 0));
}

Detail detail_for(std::span<const float> coefficients, float tolerance_m) {
  HAIRNET_ASSERT(tolerance_m >= 0);
  constexpr float kLeftOut = 0.8f;  // of the squared tolerance; the rest is for rounding
  const float square_m2 = tolerance_m * tolerance_m;
  Detail detail{coefficients.size(), 0};
  for (float left_out = 0; detail.count > 0; --detail.count) {
    const float next = coefficients[detail.count - 1];
    left_out += next * next;
    if (!(left_out <= kLeftOut * square_m2)) break;
  }
  // A rounded coefficient errs by step / sqrt(12) RMS.
  const float rounding_m2 =
      (1 - kLeftOut) * square_m2 * 12 / static_cast<float>(std::max<std::size_t>(detail.count, 1));
  while (detail.step + 1 < kStepCount) {
    const float step_m = std::ldexp(kFinestStep_m, static_cast<int>(detail.step) + 1);
    if (step_m * step_m > rounding_m2) break;
    ++detail.step;
  }
  return detail;
}

void encode_coefficients(const CoefficientCode& code, std::span<const float> coefficients, unsigned step,
                         BitWriter& writer, std::vector<std::uint32_t>& ends) {
  HAIRNET_ASSERT(coefficients.size() <= code.mode_count());
  HAIRNET_ASSERT(step < kStepCount);
  const float per_step = std::ldexp(1 / kFinestStep_m, -static_cast<int>(step));
  std::vector<std::uint32_t> integers;
  integers.reserve(coefficients.size());
  for (const float c : coefficients) {
    HAIRNET_ASSERT(std::isfinite(c));
    constexpr auto kMost = static_cast<float>(kIntegerMax);
    integers.push_back(zigzag(static_cast<std::int32_t>(std::nearbyint(std::clamp(c * per_step, -kMost, kMost)))));
  }
  const auto bits_if = [&](unsigned calm) {
    std::size_t bits = 0;
    for (std::size_t k = 0; k < integers.size(); ++k) bits += bits_of(integers[k], code.parameter(k, step, calm));
    return bits;
  };
  unsigned calm = 0;
  for (std::size_t least = bits_if(0); calm < kCalmMax; ++calm) {
    const std::size_t bits = bits_if(calm + 1);
    if (bits >= least) break;
    least = bits;
  }
  writer.put(step, kStepBits);
  writer.put(calm, kCalmBits);
  ends.clear();
  std::uint32_t end = kCoefficientHeaderBits;
  for (std::size_t k = 0; k < integers.size(); ++k) {
    const std::uint32_t z = integers[k];
    const unsigned parameter = code.parameter(k, step, calm);
    const std::uint32_t zeros = std::min(z >> parameter, kUnaryMax);
    writer.put(std::uint64_t{1} << zeros, zeros + 1);
    if (zeros < kUnaryMax) {
      writer.put(z & ((1u << parameter) - 1), parameter);
    } else {
      writer.put(z, kWholeBits);
    }
    ends.push_back(end += bits_of(z, parameter));
  }
}

std::size_t decode_coefficients(const CoefficientCode& code, BitReader& reader, std::span<float> out) {
  HAIRNET_ASSERT(out.size() >= code.mode_count());
  const auto step = static_cast<unsigned>(reader.take(kStepBits));
  const auto calm = static_cast<unsigned>(reader.take(kCalmBits));
  const float step_m = std::ldexp(kFinestStep_m, static_cast<int>(step));
  for (std::size_t k = 0; k < code.mode_count(); ++k) {
    const unsigned parameter = code.parameter(k, step, calm);
    const auto zeros = static_cast<unsigned>(std::countr_zero(reader.peek() | std::uint64_t{1} << kUnaryMax));
    reader.skip(zeros + 1);
    const auto z = static_cast<std::uint32_t>(
        zeros < kUnaryMax ? reader.take(parameter) | std::uint64_t{zeros} << parameter : reader.take(kWholeBits));
    if (reader.beyond_end()) return k;
    out[k] = step_m * static_cast<float>(unzigzag(z));
  }
  return code.mode_count();
}

}  // namespace hairnet::codec
