#include "schema/codec/hand_code.hpp"

#include <algorithm>
#include <bit>

#include "core/assert.hpp"
#include "schema/codec/integers.hpp"
#include "schema/limits.hpp"

namespace hairnet::codec {
namespace {

constexpr unsigned kNumberBits = 5, kShapeWidthBits = 5;
static_assert(kHandShapesMax == 1 << kNumberBits);

// The bits of a hand without its shapes, and of one shape, where their integers have so many bits.
constexpr std::size_t hand_bits(std::size_t place) {
  return 1 + 2 * kNumberBits + 1 + kPointWidthBits + 3 * place + 2 + 3 * kRotationBits + 3 * kShapeWidthBits;
}
constexpr std::size_t shape_bits(std::size_t from, std::size_t axis, std::size_t radius) {
  return 2 + 3 * from + 3 * axis + radius;
}

// The most bytes that valid hands take: as many hands as shapes are allowed, all as far and as large as they may be.
constexpr std::size_t valid_bytes_max() {
  // Zigzag doubles integers that have a sign. The quotient of a whole number of steps may lie a little below it.
  constexpr auto width = [](double length_m, std::uint32_t factor) {
    const auto steps = static_cast<std::uint32_t>(length_m / kHandStep_m * (1 + 1e-12));
    return static_cast<std::size_t>(std::bit_width(factor * steps));
  };
  const std::size_t hand = hand_bits(width(kHandPlaceMax_m, 2));
  const std::size_t shape =
      shape_bits(width(kHandSizeMax_m, 2), width(2 * kHandSizeMax_m, 2), width(kHandSizeMax_m, 1));
  return (kHandShapesMax * (hand + shape) + 1 + 7) / 8;
}
static_assert(valid_bytes_max() == wire::kHandsBytesMax);

// A shape whose lengths are integers, in steps of kHandStep_m. `axis` leads from one end to the other.
struct CodedShape {
  Integers from, axis;
  std::int32_t radius = 0;
  bool is_capsule = false, is_inside_out = false;
};

CodedShape coded(const HandShape& shape) {
  CodedShape out{to_integers(shape.from, kHandStep_m), to_integers(shape.to, kHandStep_m)};
  for (std::size_t c = 0; c < 3; ++c) out.axis[c] -= out.from[c];
  // A radius of 0 is not valid, so the smallest ones grow to one step.
  out.radius = std::max(to_integers({shape.radius_m, 0, 0}, kHandStep_m)[0], 1);
  out.is_capsule = width_of(out.axis) > 0;
  out.is_inside_out = shape.is_inside_out;
  return out;
}

HandShape shape_of(const CodedShape& coded) {
  // The sum is that of steps, because a sum of lengths could exceed a limit by its rounding.
  Integers to = coded.from;
  for (std::size_t c = 0; c < 3; ++c) to[c] += coded.axis[c];
  return {from_integers(coded.from, kHandStep_m), from_integers(to, kHandStep_m), kHandStep_m * coded.radius,
          coded.is_inside_out};
}

// How many bits each integer of a hand's shapes has.
struct Widths {
  unsigned from = 0, axis = 0, radius = 0;
};

void put_hand(const Hand& hand, BitWriter& writer) {
  std::vector<CodedShape> shapes;
  Widths widths;
  for (const HandShape& shape : hand.shapes) {
    const CodedShape& next = shapes.emplace_back(coded(shape));
    widths.from = std::max(widths.from, width_of(next.from));
    widths.axis = std::max(widths.axis, width_of(next.axis));
    widths.radius = std::max(widths.radius, static_cast<unsigned>(std::bit_width(std::uint32_t(next.radius))));
  }
  writer.put(hand.first_number, kNumberBits);
  writer.put(shapes.size() - 1, kNumberBits);
  writer.put(hand.has_jumped, 1);
  put_point(to_integers(hand.place.position, kHandStep_m), writer);
  put_rotation(hand.place.rotation.normalized(), writer);
  for (const unsigned width : {widths.from, widths.axis, widths.radius}) writer.put(width, kShapeWidthBits);
  for (const CodedShape& shape : shapes) {
    writer.put(shape.is_capsule, 1);
    writer.put(shape.is_inside_out, 1);
    put_integers(shape.from, widths.from, writer);
    if (shape.is_capsule) put_integers(shape.axis, widths.axis, writer);
    writer.put(static_cast<std::uint32_t>(shape.radius), widths.radius);
  }
}

Hand take_hand(BitReader& reader) {
  Hand hand;
  hand.first_number = static_cast<std::uint8_t>(reader.take(kNumberBits));
  hand.shapes.resize(1 + reader.take(kNumberBits));
  hand.has_jumped = reader.take(1) != 0;
  hand.place.position = from_integers(take_point(reader), kHandStep_m);
  hand.place.rotation = take_rotation(reader);
  Widths widths;
  for (unsigned* width : {&widths.from, &widths.axis, &widths.radius})
    *width = std::min(static_cast<unsigned>(reader.take(kShapeWidthBits)), kWidthMax);
  for (HandShape& shape : hand.shapes) {
    CodedShape next{};
    next.is_capsule = reader.take(1) != 0;
    next.is_inside_out = reader.take(1) != 0;
    next.from = take_integers(reader, widths.from);
    if (next.is_capsule) next.axis = take_integers(reader, widths.axis);
    next.radius = static_cast<std::int32_t>(reader.take(widths.radius));
    shape = shape_of(next);
  }
  return hand;
}

}  // namespace

std::vector<std::uint8_t> encode_hands(std::span<const Hand> hands) {
  std::size_t shape_count = 0;
  for (const Hand& hand : hands) shape_count += hand.shapes.size();
  const std::size_t bits =
      hands.size() * hand_bits(kWidthMax) + shape_count * shape_bits(kWidthMax, kWidthMax, kWidthMax);
  std::vector<std::uint8_t> bytes(bits / 8 + 1 + kWriterSlackBytes);
  BitWriter writer(bytes.data());
  for (const Hand& hand : hands) {
    HAIRNET_ASSERT(!hand.shapes.empty() && hand.first_number + hand.shapes.size() <= kHandShapesMax);
    writer.put(1, 1);
    put_hand(hand, writer);
  }
  writer.put(0, 1);
  bytes.resize(writer.finish());
  return bytes;
}

std::string decode_hands(std::span<const std::uint8_t> bytes, std::vector<Hand>& hands) {
  hands.clear();
  BitReader reader(bytes);
  while (reader.take(1) != 0) {
    // Each hand has at least one shape, so more hands than shapes are refused before they take memory.
    if (hands.size() == kHandShapesMax) return "hands: more than " + std::to_string(kHandShapesMax);
    hands.push_back(take_hand(reader));
    // A hand that is cut off has been read as zeros. It has at most 32 shapes, so the work before this check is
    // bounded.
    if (reader.beyond_end()) return "hands: cut off";
  }
  // validate() sees the rounded hands, as everyone will use them: numbers that ascend, sizes and places in range.
  return reader.ends_here() ? validate(hands) : "hands: more bytes than hands";
}

std::vector<Hand> rounded_to_wire(std::span<const Hand> hands) {
  std::vector<Hand> out;
  // The way through the bytes is the only definition of rounding, so this cannot differ from what a receiver decodes.
  const std::string error = decode_hands(encode_hands(hands), out);
  HAIRNET_ASSERT(error.empty());
  return out;
}

}  // namespace hairnet::codec
