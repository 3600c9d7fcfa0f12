#include "core/learnt/learnt_kernel.hpp"

#undef HWY_TARGET_INCLUDE
#define HWY_TARGET_INCLUDE "core/learnt/learnt_kernel.cpp"
#include <hwy/foreach_target.h>  // compiles this file once more for each instruction set
//
#include <hwy/highway.h>

HWY_BEFORE_NAMESPACE();
namespace hairnet {
namespace HWY_NAMESPACE {
namespace hn = hwy::HWY_NAMESPACE;

// Each lane is a character. Several rows of a matrix are summed at once, for one or two registers of characters, so
// that the many sums hide how long each multiply-add takes.
using D = hn::CappedTag<float, kLearntWidth>;
using V = hn::Vec<D>;
constexpr std::size_t kLanes = hn::MaxLanes(D());
constexpr std::size_t kRegisters = kLearntWidth / kLanes < 2 ? 1 : 2;
constexpr D kD{};

template <std::size_t kRows>
struct Sums {
  V at[kRows][kRegisters];

  HWY_INLINE void set(std::size_t row, float value) {
    for (std::size_t v = 0; v < kRegisters; ++v) at[row][v] = hn::Set(kD, value);
  }
  // Adds the products of each row's weights with `count` numbers.
  HWY_INLINE void add(const float* const (&weights)[kRows], const float* numbers, std::size_t count) {
    for (std::size_t i = 0; i < count; ++i, numbers += kLearntWidth) {
      V x[kRegisters];
      for (std::size_t v = 0; v < kRegisters; ++v) x[v] = hn::Load(kD, numbers + v * kLanes);
      for (std::size_t row = 0; row < kRows; ++row) {
        const V w = hn::Set(kD, weights[row][i]);
        for (std::size_t v = 0; v < kRegisters; ++v) at[row][v] = hn::MulAdd(w, x[v], at[row][v]);
      }
    }
  }
};

// The function f of LearntHair: f(x) = x (27 + x^2) / (27 + 9 x^2), with x limited to -3 to 3.
HWY_INLINE V squash(V x) {
  const V a = hn::Min(hn::Max(x, hn::Set(kD, -3.0f)), hn::Set(kD, 3.0f)), square = hn::Mul(a, a);
  const V above = hn::Mul(a, hn::Add(hn::Set(kD, 27.0f), square));
  return hn::Div(above, hn::MulAdd(hn::Set(kD, 9.0f), square, hn::Set(kD, 27.0f)));
}
// The function s of LearntHair: s(a) = (1 + f(a)) / 2, between 0 and 1.
HWY_INLINE V gate(V x) {
  return hn::MulAdd(hn::Set(kD, 0.5f), squash(x), hn::Set(kD, 0.5f));
}

// Computes the hidden numbers `first` and `first + 1` of all lanes.
HWY_INLINE void step_two(const LearntHair& hair, std::size_t first, const float* inputs, const float* hidden,
                         float* out) {
  const std::size_t n = hair.hidden_count;
  const float* const x = hair.input_weights.data() + first * kPoseInputCount;
  const float* const h = hair.hidden_weights.data() + first * n;
  const float* const bias = hair.bias.data() + first;
  // The sums are two of z, two of r, and two of N x, whose place two of N' h take later. The product N' h has its own
  // sum, as r multiplies it before it joins N x.
  Sums<6> sums;
  for (std::size_t i = 0; i < 2; ++i) {
    sums.set(i, bias[i]);
    sums.set(2 + i, bias[2 * n + i]);
    sums.set(4 + i, bias[n + i]);
  }
  constexpr std::size_t kIn = kPoseInputCount;
  sums.add({x, x + kIn, x + 2 * n * kIn, x + (2 * n + 1) * kIn, x + n * kIn, x + (n + 1) * kIn}, inputs, kIn);
  if (!hair.wind.weights.empty()) {
    constexpr std::size_t kAir = kAirInputCount;
    const float* const u = hair.wind.weights.data() + first * kAir;
    sums.add({u, u + kAir, u + 2 * n * kAir, u + (2 * n + 1) * kAir, u + n * kAir, u + (n + 1) * kAir},
             inputs + kIn * kLearntWidth, kAir);
  }
  V own[2][kRegisters];
  for (std::size_t i = 0; i < 2; ++i) {
    for (std::size_t v = 0; v < kRegisters; ++v) own[i][v] = sums.at[4 + i][v];
    sums.set(4 + i, 0);
  }
  sums.add({h, h + n, h + 2 * n * n, h + (2 * n + 1) * n, h + n * n, h + (n + 1) * n}, hidden, n);
  for (std::size_t i = 0; i < 2; ++i) {
    const V rest = squash(hn::Set(kD, bias[n + i]));
    for (std::size_t v = 0; v < kRegisters; ++v) {
      const std::size_t at = (first + i) * kLearntWidth + v * kLanes;
      const V before = hn::Load(kD, hidden + at);
      const V target = hn::Sub(squash(hn::MulAdd(gate(sums.at[2 + i][v]), sums.at[4 + i][v], own[i][v])), rest);
      hn::Store(hn::MulAdd(gate(sums.at[i][v]), hn::Sub(target, before), before), kD, out + at);
    }
  }
}

// One tick of all lanes: first the hidden numbers in pairs, then the coefficients in fours.
void learnt_kernel_here(const LearntHair& hair, const float* inputs, const float* hidden, float* hidden_out,
                        float* coefficients_out) {
  const std::size_t n = hair.hidden_count;
  for (std::size_t lane = 0; lane < kLearntWidth; lane += kRegisters * kLanes) {
    for (std::size_t i = 0; i < n; i += 2) step_two(hair, i, inputs + lane, hidden + lane, hidden_out + lane);
    for (std::size_t k = 0; k < hair.mode_count; k += 4) {
      const float* const w = hair.output_weights.data() + k * n;
      Sums<4> sums;
      for (std::size_t row = 0; row < 4; ++row) sums.set(row, 0);
      sums.add({w, w + n, w + 2 * n, w + 3 * n}, hidden_out + lane, n);
      for (std::size_t row = 0; row < 4; ++row) {
        for (std::size_t v = 0; v < kRegisters; ++v) {
          hn::Store(sums.at[row][v], kD, coefficients_out + (k + row) * kLearntWidth + lane + v * kLanes);
        }
      }
    }
  }
}

}  // namespace HWY_NAMESPACE
}  // namespace hairnet
HWY_AFTER_NAMESPACE();

#if HWY_ONCE
namespace hairnet {
namespace {
HWY_EXPORT(learnt_kernel_here);
}  // namespace

void learnt_kernel(const LearntHair& hair, const float* inputs, const float* hidden, float* hidden_out,
                   float* coefficients_out) {
  HWY_DYNAMIC_DISPATCH(learnt_kernel_here)(hair, inputs, hidden, hidden_out, coefficients_out);
}

}  // namespace hairnet
#endif
