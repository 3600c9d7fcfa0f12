#include <gtest/gtest.h>

#include <array>
#include <memory>

#include "tests/support/codec_frames.hpp"

// A decoder's behaviour on damaged bytes. Most useful under the address and undefined-behaviour sanitizers.
namespace hairnet::codec {
namespace {

struct Sent {
  LevelGeometry geometry;
  std::unique_ptr<Neighbours> neighbours;
  std::vector<FrameIntegers> past;
  std::vector<const FrameIntegers*> history;
  FrameIntegers frame;
  std::vector<std::uint8_t> bytes;

  [[nodiscard]] bool decodes(std::span<const std::uint8_t> from, FrameIntegers& got) const {
    // A block of exactly this size, so that a sanitizer detects reads past the end.
    const std::vector<std::uint8_t> exact(from.begin(), from.end());
    return decode_frame(exact, history, neighbours.get(), !frame.velocities.empty(), got);
  }
};

Sent random_sent(RandomFrames& random, int round) {
  Sent out;
  out.geometry = random.geometry();
  out.neighbours = std::make_unique<Neighbours>(out.geometry);
  const std::size_t count = out.neighbours->node_count();
  const int bits = 1 + round % 16;
  for (int n = 0; n < round % 4; ++n) out.past.push_back(random.frame(count, bits, false));
  for (const FrameIntegers& frame : out.past) out.history.push_back(&frame);
  out.frame = random.frame(count, bits, round % 3 == 0);
  encode_frame(out.frame, out.history, out.neighbours.get(), out.bytes);
  return out;
}

TEST(FrameDecoder, refuses_every_truncation) {
  RandomFrames random(1);
  for (int round = 0; round < 60; ++round) {
    const Sent sent = random_sent(random, round);
    FrameIntegers got;
    ASSERT_TRUE(sent.decodes(sent.bytes, got));
    for (std::size_t length = 0; length < sent.bytes.size(); ++length)
      ASSERT_FALSE(sent.decodes(std::span(sent.bytes).first(length), got)) << "round " << round << " at " << length;
  }
}

TEST(FrameDecoder, refuses_trailing_bytes) {
  RandomFrames random(2);
  for (int round = 0; round < 200; ++round) {
    const Sent sent = random_sent(random, round);
    for (const std::size_t extra : std::array<std::size_t, 4>{1, 2, 9, 100}) {
      for (const std::uint8_t value : std::array<std::uint8_t, 3>{0x00, 0xFF, 0x5A}) {
        std::vector<std::uint8_t> longer = sent.bytes;
        longer.resize(longer.size() + extra, value);
        FrameIntegers got;
        ASSERT_FALSE(sent.decodes(longer, got)) << "round " << round;
      }
    }
  }
}

TEST(FrameDecoder, refuses_bits_set_after_the_last) {
  RandomFrames random(3);
  int padded = 0;
  for (int round = 0; round < 200; ++round) {
    const Sent sent = random_sent(random, round);
    ASSERT_FALSE(sent.bytes.empty());
    std::vector<std::uint8_t> spoilt = sent.bytes;
    spoilt[spoilt.size() - 1] |= 0x80;
    FrameIntegers got;
    if (spoilt == sent.bytes || !sent.decodes(spoilt, got)) {
      ++padded;
    } else {
      EXPECT_TRUE(got.nodes != sent.frame.nodes || got.velocities != sent.frame.velocities)
          << "the bit was of no node and yet it was taken";
    }
  }
  EXPECT_GT(padded, 50);
}

TEST(FrameDecoder, takes_any_noise_for_no_more_than_a_wrong_frame) {
  RandomFrames random(4);
  int taken = 0;
  for (int round = 0; round < 20'000; ++round) {
    Sent sent = random_sent(random, round);
    std::vector<std::uint8_t> noise(random.below(300));
    const std::size_t kind = random.below(3);
    for (std::uint8_t& byte : noise)
      byte = static_cast<std::uint8_t>(kind == 0 ? random.below(256) : kind == 1 ? 0 : 1u << random.below(8));
    FrameIntegers got;
    if (sent.decodes(noise, got)) {
      ++taken;
      ASSERT_EQ(got.nodes.size(), 3 * sent.neighbours->node_count());
    }
  }
  EXPECT_LT(taken, 20'000 / 10);
}

TEST(FrameDecoder, takes_spoilt_bytes_for_no_more_than_a_wrong_frame) {
  RandomFrames random(5);
  for (int round = 0; round < 5000; ++round) {
    const Sent sent = random_sent(random, round);
    std::vector<std::uint8_t> spoilt = sent.bytes;
    for (std::size_t n = 1 + random.below(4); n > 0; --n)
      spoilt[random.below(spoilt.size())] ^= static_cast<std::uint8_t>(1u << random.below(8));
    FrameIntegers got;
    if (sent.decodes(spoilt, got)) {
      ASSERT_EQ(got.nodes.size(), sent.frame.nodes.size());
      ASSERT_EQ(got.velocities.size(), sent.frame.velocities.size());
    }
  }
}

TEST(FrameDecoder, refuses_a_history_of_other_nodes) {
  RandomFrames random(6);
  const LevelGeometry geometry = RandomFrames::full_grid({4, 4, 4});
  const Neighbours neighbours(geometry);
  const FrameIntegers frame = random.frame(64, 8, false), other = random.frame(63, 8, false);
  std::vector<std::uint8_t> bytes;
  encode_frame(frame, {}, &neighbours, bytes);
  FrameIntegers got;
  ASSERT_TRUE(decode_frame(bytes, {}, &neighbours, false, got));
  const std::vector<const FrameIntegers*> wrong{&other}, absent{nullptr}, many(4, &frame);
  EXPECT_FALSE(decode_frame(bytes, wrong, &neighbours, false, got));
  EXPECT_FALSE(decode_frame(bytes, absent, &neighbours, false, got));
  EXPECT_FALSE(decode_frame(bytes, many, &neighbours, false, got));
  EXPECT_FALSE(decode_frame(bytes, {}, nullptr, false, got)) << "nodes where none are known";
}

TEST(FrameEncoderDeathTest, a_history_of_other_nodes_stops_the_program) {
  RandomFrames random(6);
  const Neighbours neighbours(RandomFrames::full_grid({4, 4, 4}));
  const FrameIntegers frame = random.frame(64, 8, false), other = random.frame(63, 8, false);
  const std::vector<const FrameIntegers*> wrong{&other};
  std::vector<std::uint8_t> bytes;
  EXPECT_DEATH(encode_frame(frame, wrong, &neighbours, bytes), "assertion failed: earlier->nodes.size\\(\\)");
}

}  // namespace
}  // namespace hairnet::codec
