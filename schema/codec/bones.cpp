#include "schema/codec/bones.hpp"

#include <cmath>

#include "schema/codec/golomb.hpp"

// Position and rotation of each bone are predicted from the earlier frames, the error of one bone corrects the
// prediction of the next, and the largest component of a quaternion follows from the three others.
namespace hairnet::codec {
namespace {

using U32 = std::uint32_t;
using BoneArray = std::array<U32, kBoneIntegers>;  // unsigned: everything is modulo 2^32

constexpr std::size_t kRotation = 3;  // index of a bone's quaternion
constexpr unsigned kWeightBits = 2;   // for the choice of a prediction
constexpr unsigned kParameterBits = 5;
constexpr unsigned kHeaderBits = kWeightBits + 2 + 2 * kParameterBits, kLargestBits = 3;
constexpr unsigned kIntegerBitsMax = 65;  // of put_exponential
static_assert(kHeaderBits + kBoneCount * kLargestBits + kBoneIntegers * kIntegerBitsMax <= 8 * kBonesBytesMax);

U32 half(U32 x) {
  return static_cast<U32>(static_cast<std::int32_t>(x) >> 1);
}

// a, plus halves of the first and the second difference; missing frames continue the existing ones evenly.
BoneArray predict(History history, unsigned choice) {
  HAIRNET_ASSERT(choice < 1u << kWeightBits);
  HAIRNET_ASSERT(history.size() <= kHistoryMax);
  BoneArray out{};
  if (history.empty()) return out;
  for (std::size_t i = 0; i < kBoneIntegers; ++i) {
    const U32 a = static_cast<U32>(history[0]->bones[i]);
    const U32 b = history.size() > 1 ? static_cast<U32>(history[1]->bones[i]) : a;
    const U32 first = a - b;
    const U32 second = history.size() > 2 ? first - (b - static_cast<U32>(history[2]->bones[i])) : 0;
    out[i] = a;
    if (choice >= 1) out[i] += first;
    if (choice == 2) out[i] += half(second);
    if (choice == 3) out[i] += second;
  }
  return out;
}

struct Choices {
  unsigned weights = 0;
  bool chain_positions = false, chain_rotations = false;  // a bone's errors correct the next bone's prediction
  unsigned k_positions = 0, k_rotations = 0;
  [[nodiscard]] bool chains(std::size_t component) const {
    return component < kRotation ? chain_positions : chain_rotations;
  }
  [[nodiscard]] unsigned k(std::size_t component) const { return component < kRotation ? k_positions : k_rotations; }
};

// The component of a quaternion that is computed from the others instead of coded.
struct Largest {
  unsigned component = 0;  // 0 to 3
  bool negative = false;
};

Largest largest_of(const U32* quaternion) {
  Largest out;
  std::int64_t most = -1;
  for (unsigned c = 0; c < 4; ++c) {
    const std::int64_t value = static_cast<std::int32_t>(quaternion[c]);
    if (std::abs(value) <= most) continue;
    most = std::abs(value);
    out = {c, value < 0};
  }
  return out;
}

U32 implied(const U32* quaternion, Largest largest) {
  HAIRNET_ASSERT(largest.component < 4);
  constexpr std::int64_t kOne = std::int64_t{1} << 15;  // 1 / kRotationStep
  std::int64_t rest = kOne * kOne;
  for (unsigned c = 0; c < 4; ++c) {
    if (c == largest.component) continue;
    const std::int64_t value = std::clamp<std::int64_t>(static_cast<std::int32_t>(quaternion[c]), -kOne, kOne);
    rest -= value * value;
  }
  // Exact: the root of a whole number below 2^53 is rounded correctly, and no such number lies just below a square.
  const auto root = static_cast<U32>(std::sqrt(static_cast<double>(std::max<std::int64_t>(rest, 0))));
  return largest.negative ? 0u - root : root;
}

std::int32_t as_signed(U32 x) {
  return static_cast<std::int32_t>(x);
}

// Visits all integers in their order. visit(i, prediction, k) codes integer i and returns its value; code_largest codes
// which component is the largest, if there is no history.
template <class Visit, class CodeLargest>
void walk(const BoneArray& predicted, bool intra, const Choices& choices, BoneArray& values, Visit visit,
          CodeLargest code_largest) {
  std::array<U32, kIntegersPerBone> error{};
  for (std::size_t bone = 0; bone < kBoneCount; ++bone) {
    const U32* from = predicted.data() + kIntegersPerBone * bone;
    U32* value = values.data() + kIntegersPerBone * bone;
    const Largest largest = intra ? code_largest(value + kRotation) : largest_of(from + kRotation);
    const std::size_t skipped = kRotation + largest.component;
    for (std::size_t c = 0; c < kIntegersPerBone; ++c) {
      if (c == skipped) continue;
      const U32 expected = from[c] + (choices.chains(c) ? error[c] : 0);
      value[c] = visit(kIntegersPerBone * bone + c, expected, choices.k(c));
      error[c] = value[c] - from[c];
    }
    value[skipped] = visit(kIntegersPerBone * bone + skipped, implied(value + kRotation, largest), 0);
    error[skipped] = value[skipped] - from[skipped];
  }
}

using ZigzagBones = std::array<U32, kBoneIntegers>;

ZigzagBones zigzagged(const BoneArray& error, std::size_t chained_from) {
  ZigzagBones out;
  for (std::size_t i = 0; i < kBoneIntegers; ++i)
    out[i] = zigzag(as_signed(i < chained_from ? error[i] : error[i] - error[i - kIntegersPerBone]));
  return out;
}

// The approximate number of bits of positions or rotations.
unsigned bits_of(const ZigzagBones& integers, std::size_t begin, std::size_t end) {
  unsigned bits = 0;
  for (std::size_t bone = 0; bone < kBoneIntegers; bone += kIntegersPerBone)
    for (std::size_t c = begin; c < end; ++c) bits += static_cast<unsigned>(std::bit_width(integers[bone + c]));
  return bits;
}

// The parameter with the fewest bits for the positions' or the rotations' part of `zigzagged`, among those near its
// mean.
unsigned best_parameter(const ZigzagBones& integers, std::size_t begin, std::size_t end) {
  HAIRNET_ASSERT(begin < end && end <= kIntegersPerBone);
  std::uint64_t sum = 0;
  for (std::size_t bone = 0; bone < kBoneIntegers; bone += kIntegersPerBone)
    for (std::size_t c = begin; c < end; ++c) sum += integers[bone + c];
  const auto mean_bits = static_cast<unsigned>(std::bit_width(sum / (kBoneCount * (end - begin))));
  unsigned best = 0, least = ~0u;
  for (unsigned k = mean_bits > 4 ? mean_bits - 4 : 0; k < std::max(mean_bits, 1u); ++k) {
    unsigned bits = 0;
    for (std::size_t bone = 0; bone < kBoneIntegers; bone += kIntegersPerBone) {
      for (std::size_t c = begin; c < end; ++c)
        bits +=
            2 * static_cast<unsigned>(std::bit_width(std::uint64_t{integers[bone + c]} + (std::uint64_t{1} << k))) - k;
    }
    if (bits >= least) continue;
    least = bits;
    best = k;
  }
  HAIRNET_ASSERT(best < 1u << kParameterBits);
  return best;
}

Choices choose(const BoneArray& values, History history) {
  Choices best;
  BoneArray best_error{};
  unsigned least = ~0u;
  const unsigned weight_choices = history.size() < 2 ? 1u : history.size() < 3 ? 2u : 4u;
  for (unsigned weights = 0; weights < weight_choices; ++weights) {
    BoneArray error = predict(history, weights);
    for (std::size_t i = 0; i < kBoneIntegers; ++i) error[i] = values[i] - error[i];
    const unsigned bits = bits_of(zigzagged(error, kBoneIntegers), 0, kIntegersPerBone);
    if (bits >= least) continue;
    least = bits;
    best.weights = weights;
    best_error = error;
  }
  const ZigzagBones unchained = zigzagged(best_error, kBoneIntegers), chained = zigzagged(best_error, kIntegersPerBone);
  const auto decide = [&](std::size_t begin, std::size_t end, bool& chain, unsigned& k) {
    chain = bits_of(chained, begin, end) < bits_of(unchained, begin, end);
    k = best_parameter(chain ? chained : unchained, begin, end);
  };
  decide(0, kRotation, best.chain_positions, best.k_positions);
  decide(kRotation, kIntegersPerBone, best.chain_rotations, best.k_rotations);
  HAIRNET_ASSERT(best.weights < weight_choices);
  return best;
}

}  // namespace

void encode_bones(const FrameIntegers& frame, History history, BitWriter& writer) {
  const bool intra = history.empty();
  BoneArray values;
  for (std::size_t i = 0; i < kBoneIntegers; ++i) values[i] = static_cast<U32>(frame.bones[i]);
  const Choices best = choose(values, history);
  writer.put(best.weights, kWeightBits);
  writer.put(best.chain_positions, 1);
  writer.put(best.chain_rotations, 1);
  writer.put(best.k_positions, kParameterBits);
  writer.put(best.k_rotations, kParameterBits);
  walk(
      predict(history, best.weights), intra, best, values,
      [&](std::size_t i, U32 expected, unsigned k) {
        put_exponential(writer, zigzag(as_signed(values[i] - expected)), k);
        return values[i];
      },
      [&](const U32* quaternion) {
        const Largest largest = largest_of(quaternion);
        writer.put(largest.component, 2);
        writer.put(largest.negative, 1);
        return largest;
      });
}

void decode_bones(BitReader& reader, History history, FrameIntegers& frame) {
  Choices choices;
  choices.weights = static_cast<unsigned>(reader.take(kWeightBits));
  choices.chain_positions = reader.take(1) != 0;
  choices.chain_rotations = reader.take(1) != 0;
  choices.k_positions = static_cast<unsigned>(reader.take(kParameterBits));
  choices.k_rotations = static_cast<unsigned>(reader.take(kParameterBits));
  BoneArray values{};
  walk(
      predict(history, choices.weights), history.empty(), choices, values,
      [&](std::size_t, U32 expected, unsigned k) {
        return expected + static_cast<U32>(unzigzag(take_exponential(reader, k)));
      },
      [&](const U32*) {
        const auto component = static_cast<unsigned>(reader.take(2));
        return Largest{component, reader.take(1) != 0};
      });
  for (std::size_t i = 0; i < kBoneIntegers; ++i) frame.bones[i] = as_signed(values[i]);
}

}  // namespace hairnet::codec
