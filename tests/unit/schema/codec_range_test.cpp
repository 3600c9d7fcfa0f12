#include <gtest/gtest.h>

#include "tests/support/codec_frames.hpp"

namespace hairnet::codec {
namespace {

constexpr std::int16_t kUntouched = 12345;

FrameIntegers blank(std::size_t node_count, bool velocities) {
  FrameIntegers out;
  out.nodes.assign(3 * node_count, kUntouched);
  if (velocities) out.velocities.assign(3 * node_count, kUntouched);
  return out;
}

TEST(NodeRanges, each_keep_to_their_bytes_and_decode_alone) {
  RandomFrames random(1);
  for (int round = 0; round < 120; ++round) {
    const LevelGeometry geometry = round % 2 ? random.geometry() : RandomFrames::full_grid({10, 9, 8});
    const Neighbours neighbours(geometry);
    const std::size_t count = neighbours.node_count();
    const bool velocities = round % 3 == 0;
    const int bits = 1 + round % 16;
    const FrameIntegers frame = random.frame(count, bits, velocities);
    std::vector<FrameIntegers> past;
    for (int n = 0; n < round % 4; ++n) past.push_back(random.frame(count, bits, false));
    std::vector<const FrameIntegers*> history;
    for (const FrameIntegers& earlier : past) history.push_back(&earlier);

    const std::size_t bytes_max = kRangeBytesMin + random.below(1200);
    const std::vector<EncodedRange> ranges = encode_ranges(frame, history, &neighbours, bytes_max);
    std::size_t next = 0;
    for (std::size_t r = 0; r < ranges.size(); ++r) {
      const auto& [nodes, bytes] = ranges[r];
      ASSERT_EQ(nodes.first, next);
      next += nodes.count;
      ASSERT_LE(bytes.size(), bytes_max);
      // This one alone: its nodes are right and no other is touched.
      FrameIntegers got = blank(count, velocities);
      ASSERT_TRUE(decode_range(bytes, nodes, r == 0, history, &neighbours, velocities, got));
      if (r == 0) {
        EXPECT_EQ(got.bones, frame.bones);
      }
      for (std::size_t i = 0; i < 3 * count; ++i) {
        const bool inside = i >= 3 * nodes.first && i < 3 * (nodes.first + nodes.count);
        ASSERT_EQ(got.nodes[i], inside ? frame.nodes[i] : kUntouched);
        if (velocities) {
          ASSERT_EQ(got.velocities[i], inside ? frame.velocities[i] : kUntouched);
        }
      }
    }
    ASSERT_EQ(next, count);
  }
}

TEST(NodeRanges, of_a_high_lattice_are_two_or_three_datagrams) {
  const MovingLattice moving = step_made_lattice(LevelIndex::high, 30, 20);
  const Neighbours neighbours(moving.geometry);
  const std::vector<FrameIntegers> frames = quantised(moving, ErrorClass::half_mm, false);
  for (const FrameIntegers& frame : frames) EXPECT_LE(encode_ranges(frame, {}, &neighbours, 1085).size(), 3u);
}

TEST(NodeRanges, of_a_rigid_frame_are_one) {
  RandomFrames random(2);
  const FrameIntegers frame = random.frame(0, 1, false);
  const std::vector<EncodedRange> ranges = encode_ranges(frame, {}, nullptr, kRangeBytesMin);
  ASSERT_EQ(ranges.size(), 1u);
  EXPECT_EQ(ranges[0].nodes.count, 0u);
  FrameIntegers got;
  ASSERT_TRUE(decode_range(ranges[0].bytes, ranges[0].nodes, true, {}, nullptr, false, got));
  EXPECT_EQ(got.bones, frame.bones);
}

TEST(NodeRanges, beyond_the_lattice_are_refused) {
  RandomFrames random(3);
  const Neighbours neighbours(RandomFrames::full_grid({4, 4, 4}));
  const FrameIntegers frame = random.frame(64, 8, false);
  std::vector<std::uint8_t> bytes;
  encode_frame(frame, {}, &neighbours, bytes);
  FrameIntegers got = blank(64, false);
  EXPECT_TRUE(decode_range(bytes, {0, 64}, true, {}, &neighbours, false, got));
  for (const NodeRange range : {NodeRange{0, 65}, {1, 64}, {64, 1}, {65, 0}, {0xFFFFFFFF, 2}, {2, 0xFFFFFFFF}})
    EXPECT_FALSE(decode_range(bytes, range, true, {}, &neighbours, false, got));
  FrameIntegers fewer = blank(63, false);
  EXPECT_FALSE(decode_range(bytes, {0, 64}, true, {}, &neighbours, false, fewer));
}

}  // namespace
}  // namespace hairnet::codec
