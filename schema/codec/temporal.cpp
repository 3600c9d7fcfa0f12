#include "schema/codec/temporal.hpp"

#include <algorithm>
#include <cstdlib>

#include "core/assert.hpp"

namespace hairnet::codec {
namespace {

using I16 = std::int16_t;

I16 wrap(int x) {
  return static_cast<I16>(x);
}

I16 step_of(I16 first, I16 second, TemporalWeights weights) {
  return wrap(wrap(wrap(weights.first * first) + wrap(weights.second * second) + 4) >> 3);
}

}  // namespace

void predict_nodes(History history, NodeRange range, TemporalWeights weights, std::span<I16> predicted,
                   std::span<std::uint16_t> motion) {
  HAIRNET_ASSERT(weights.frames <= history.size());
  HAIRNET_ASSERT(predicted.size() == 3 * std::size_t{range.count});
  HAIRNET_ASSERT(motion.size() == range.count);
  const std::size_t begin = 3 * std::size_t{range.first};
  const std::size_t count = predicted.size();
  history = history.first(weights.frames);
  if (history.empty()) {
    std::ranges::fill(predicted, I16{0});
    std::ranges::fill(motion, std::uint16_t{0});
    return;
  }
  const I16* a = history[0]->nodes.data() + begin;
  if (history.size() == 1) {
    std::copy_n(a, count, predicted.data());
    std::ranges::fill(motion, std::uint16_t{0});
    return;
  }
  const I16* b = history[1]->nodes.data() + begin;
  const I16* c = history.size() > 2 ? history[2]->nodes.data() + begin : nullptr;
  std::array<std::uint16_t, 3 * 64> size;
  for (std::size_t at = 0; at < count; at += size.size()) {
    const std::size_t n = std::min(size.size(), count - at);
    I16* out = predicted.data() + at;
    const I16 *a_at = a + at, *b_at = b + at;
    if (c) {
      const I16* c_at = c + at;
      for (std::size_t i = 0; i < n; ++i) {
        const I16 first = wrap(a_at[i] - b_at[i]), second = wrap(first - wrap(b_at[i] - c_at[i]));
        out[i] = wrap(a_at[i] + step_of(first, second, weights));
        size[i] = static_cast<std::uint16_t>(std::abs(second));
      }
    } else {
      for (std::size_t i = 0; i < n; ++i) {
        const I16 first = wrap(a_at[i] - b_at[i]);
        out[i] = wrap(a_at[i] + step_of(first, 0, weights));
        size[i] = static_cast<std::uint16_t>(std::abs(first));
      }
    }
    for (std::size_t i = 0; i < n; i += 3) {
      motion[(at + i) / 3] = static_cast<std::uint16_t>(std::min(size[i] + size[i + 1] + size[i + 2], kMotionMax));
    }
  }
}

unsigned choose_temporal(const FrameIntegers& frame, History history, NodeRange range) {
  HAIRNET_ASSERT(history.size() <= kHistoryMax);
  if (history.empty()) return 0;
  const std::size_t begin = 3 * std::size_t{range.first}, coordinates = 3 * std::size_t{range.count};
  const auto frame_from = [&](std::size_t age) {
    return history[std::min(age, history.size() - 1)]->nodes.data() + begin;
  };
  const I16 *x = frame.nodes.data() + begin, *a = frame_from(0), *b = frame_from(1), *c = frame_from(2);
  // This many coordinates are as good as all, except for 0.3 % of the bytes.
  constexpr std::size_t kSamplesMax = 96;
  std::array<I16, kSamplesMax> value, moved, first, second;
  std::size_t stride = coordinates / kSamplesMax + 1;
  if (stride % 3 == 0) ++stride;  // otherwise all samples would be of one axis
  HAIRNET_ASSERT((coordinates + stride - 1) / stride <= kSamplesMax);
  std::size_t samples = 0;
  for (std::size_t i = 0; i < coordinates; i += stride, ++samples) {
    value[samples] = x[i];
    moved[samples] = wrap(x[i] - a[i]);
    first[samples] = wrap(a[i] - b[i]);
    second[samples] = wrap(first[samples] - wrap(b[i] - c[i]));
  }
  unsigned best = 0;
  std::uint32_t least = ~0u;
  for (unsigned choice = 0; choice < 1u << kTemporalBits[history.size()]; ++choice) {
    const TemporalWeights& weights = kTemporalWeights[history.size()][choice];
    const I16* rest = weights.frames == 0 ? value.data() : moved.data();
    std::uint32_t sum = 0;
    for (std::size_t i = 0; i < samples; ++i) {
      const I16 left = wrap(rest[i] - step_of(first[i], second[i], weights));
      sum += static_cast<std::uint32_t>(left < 0 ? -left : left);
    }
    if (sum >= least) continue;
    least = sum;
    best = choice;
  }
  HAIRNET_ASSERT(kTemporalWeights[history.size()][best].frames <= history.size());
  return best;
}

}  // namespace hairnet::codec
