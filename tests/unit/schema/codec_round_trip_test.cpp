#include <gtest/gtest.h>

#include "tests/support/codec_frames.hpp"

namespace hairnet::codec {
namespace {

std::string difference(const FrameIntegers& sent, const FrameIntegers& got) {
  if (got.bones != sent.bones) return "bones";
  if (got.nodes != sent.nodes) return "nodes";
  if (got.velocities != sent.velocities) return "velocities";
  return "";
}

// Empty, or what did not come back.
std::string round_trip(const FrameIntegers& frame, History history, const Neighbours* neighbours) {
  std::vector<std::uint8_t> bytes;
  encode_frame(frame, history, neighbours, bytes);
  FrameIntegers got;
  if (!decode_frame(bytes, history, neighbours, !frame.velocities.empty(), got)) return "refused";
  return difference(frame, got);
}

std::vector<const FrameIntegers*> pointers(std::span<const FrameIntegers> frames) {
  std::vector<const FrameIntegers*> out;
  for (const FrameIntegers& frame : frames) out.push_back(&frame);
  return out;
}

TEST(FrameCodec, brings_back_any_integers_for_any_history) {
  RandomFrames random(1);
  for (int round = 0; round < 3000; ++round) {
    const LevelGeometry geometry = random.geometry();
    const Neighbours neighbours(geometry);
    ASSERT_EQ(neighbours.node_count(), geometry.active_nodes.size());
    const bool velocities = round % 3 == 0;
    const int bits = 1 + round % 16;
    const FrameIntegers frame = random.frame(neighbours.node_count(), bits, velocities);
    std::vector<FrameIntegers> history;
    for (int n = 0; n < round % 4; ++n) history.push_back(random.frame(neighbours.node_count(), bits, round % 2 == 0));
    ASSERT_EQ(round_trip(frame, pointers(history), &neighbours), "") << "round " << round;
  }
}

TEST(FrameCodec, brings_back_rigid_frames) {
  RandomFrames random(2);
  for (int round = 0; round < 1000; ++round) {
    const FrameIntegers frame = random.frame(0, 16, false);
    std::vector<FrameIntegers> history;
    for (int n = 0; n < round % 4; ++n) history.push_back(random.frame(0, 16, false));
    ASSERT_EQ(round_trip(frame, pointers(history), nullptr), "") << "round " << round;
  }
}

TEST(FrameCodec, brings_back_the_extremes_of_every_integer) {
  RandomFrames random(3);
  const LevelGeometry geometry = random.full_grid({5, 4, 3});
  const Neighbours neighbours(geometry);
  constexpr std::array<std::int16_t, 5> kNodes{-32768, 32767, 0, -1, 1};
  constexpr std::array<std::int32_t, 5> kBones{-2147483647 - 1, 2147483647, 0, -1, 1};
  for (int round = 0; round < 1000; ++round) {
    std::vector<FrameIntegers> frames(4);
    for (FrameIntegers& frame : frames) {
      frame = random.frame(neighbours.node_count(), 16, true);
      for (std::int32_t& bone : frame.bones) bone = kBones[random.below(kBones.size())];
      for (std::int16_t& node : frame.nodes) node = kNodes[random.below(kNodes.size())];
      for (std::int16_t& velocity : frame.velocities) velocity = kNodes[random.below(kNodes.size())];
    }
    const std::vector<const FrameIntegers*> history = pointers(std::span(frames).first(random.below(4)));
    ASSERT_EQ(round_trip(frames[3], history, &neighbours), "") << "round " << round;
  }
}

TEST(FrameCodec, brings_back_a_moving_lattice_at_every_class_order_and_stride) {
  for (const LevelIndex level : {LevelIndex::high, LevelIndex::low}) {
    const MovingLattice moving = step_made_lattice(level, 30, 40);
    const Neighbours neighbours(moving.geometry);
    for (std::size_t c = 0; c < kErrorClassCount; ++c) {
      const std::vector<FrameIntegers> frames = quantised(moving, static_cast<ErrorClass>(c), true);
      for (std::size_t stride : {1, 2, 4}) {
        for (std::size_t order = 0; order <= kHistoryMax; ++order) {
          for (std::size_t t = order * stride; t < frames.size(); t += 5) {
            std::vector<const FrameIntegers*> history;
            for (std::size_t n = 1; n <= order; ++n) history.push_back(&frames[t - n * stride]);
            ASSERT_EQ(round_trip(frames[t], history, &neighbours), "") << "class " << c << " order " << order;
          }
        }
      }
    }
  }
}

TEST(FrameCodec, is_shorter_the_more_of_the_past_is_known) {
  for (const LevelIndex level : {LevelIndex::high, LevelIndex::low}) {
    const MovingLattice moving = step_made_lattice(level, 30, 60);
    const Neighbours neighbours(moving.geometry);
    const std::vector<FrameIntegers> frames = quantised(moving, ErrorClass::half_mm, false);
    std::array<std::size_t, kHistoryMax + 1> bytes_of_order{};
    for (std::size_t t = 20; t < frames.size(); ++t) {
      const std::vector<const FrameIntegers*> history{&frames[t - 1], &frames[t - 2], &frames[t - 3]};
      for (std::size_t order = 0; order <= kHistoryMax; ++order) {
        std::vector<std::uint8_t> bytes;
        encode_frame(frames[t], History(history).first(order), &neighbours, bytes);
        bytes_of_order[order] += bytes.size();
      }
    }
    const std::size_t raw_bytes = (frames.size() - 20) * 2 * frames[0].nodes.size();
    EXPECT_LT(bytes_of_order[0], raw_bytes * 2 / 3);
    for (std::size_t order = 1; order <= kHistoryMax; ++order) {
      EXPECT_LT(bytes_of_order[order], bytes_of_order[order - 1]) << "order " << order;
    }
    EXPECT_LT(bytes_of_order[3], raw_bytes / 3);
  }
}

TEST(FrameCodec, takes_few_bits_for_a_lattice_that_stays) {
  RandomFrames random(4);
  const LevelGeometry geometry = random.full_grid({10, 10, 10});
  const Neighbours neighbours(geometry);
  FrameIntegers frame = random.frame(neighbours.node_count(), 10, false);
  quantise_pose(Pose{}, nullptr, frame);
  const std::vector<const FrameIntegers*> history(3, &frame);
  std::vector<std::uint8_t> bytes;
  encode_frame(frame, history, &neighbours, bytes);
  EXPECT_LT(bytes.size(), geometry.active_nodes.size() / 8 + 12) << "about a bit a node";
}

TEST(FrameCodec, appends_to_what_is_there) {
  RandomFrames random(5);
  const FrameIntegers frame = random.frame(0, 12, false);
  std::vector<std::uint8_t> alone, after{1, 2, 3};
  encode_frame(frame, {}, nullptr, alone);
  encode_frame(frame, {}, nullptr, after);
  ASSERT_EQ(after.size(), alone.size() + 3);
  EXPECT_TRUE(std::equal(alone.begin(), alone.end(), after.begin() + 3));
  EXPECT_EQ(after[2], 3);
}

}  // namespace
}  // namespace hairnet::codec
