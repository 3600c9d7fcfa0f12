#include "schema/wire/frame_datagram.hpp"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <limits>
#include <random>

#include "tests/support/mutation.hpp"
#include "tests/support/random_messages.hpp"
#include "tests/unit/schema/equal.hpp"

namespace hairnet::wire {
namespace {

using Bytes = std::vector<std::uint8_t>;

// A datagram has 40 bits, with sign, for the clock's distance from the time of its sample.
constexpr std::int64_t kClockDistanceMax_ns = std::int64_t{1} << 39;

// Draws random batches until one has frames and fits a datagram.
FrameBatch random_batch(RandomMessages& random) {
  while (true) {
    FrameBatch batch = random.frame_batch();
    if (batch.frames.empty()) continue;
    batch.generations.resize(batch.frames.size());
    for (std::uint8_t& generation : batch.generations) generation = static_cast<std::uint8_t>(random.integer(0, 255));
    if (!encode_frame_datagram(0, batch).empty()) return batch;
  }
}

FrameBatch small_batch() {
  FrameBatch batch{1'000'000, 5'000'000'000, {}};
  for (const std::uint32_t member : {3u, 4u}) batch.frames.emplace_back().member = member;
  batch.generations = {7, 255};
  return batch;
}

const FrameBatch& batch_of(const DecodedPacket& decoded) {
  return std::get<FrameBatch>(decoded.envelope.message);
}

// Decodes a packet or a frame datagram, by their first bytes, as clients do.
DecodedPacket decoded(const Bytes& bytes) {
  return is_frame_datagram(bytes) ? decode_frame_datagram(bytes) : decode_packet(bytes);
}

TEST(FrameDatagram, brings_the_batch_as_it_was) {
  RandomMessages random(1);
  for (int n = 0; n < 2000; ++n) {
    const FrameBatch batch = random_batch(random);
    const std::int64_t clock_ns =
        batch.sample_time_ns + static_cast<std::int64_t>(random.real(-1, 1) * (kClockDistanceMax_ns - 1));
    const Bytes bytes = encode_frame_datagram(clock_ns, batch);
    ASSERT_TRUE(is_frame_datagram(bytes));
    const DecodedPacket got = decode_frame_datagram(bytes);
    ASSERT_EQ(got.error, DecodeError::none) << got.detail;
    EXPECT_EQ(got.envelope.clock_ns, clock_ns);
    EXPECT_TRUE(equal(batch_of(got), batch)) << n;
  }
}

TEST(FrameDatagram, has_at_most_20_bytes_before_its_frames_in_the_first_year) {
  FrameBatch batch = small_batch();
  // At 30 ticks a second this is the tick after a year, whose varint has 5 bytes; the fields before it have 15.
  batch.tick = 30ull * 3600 * 24 * 365;
  EXPECT_LE(frame_datagram_head_bytes(batch.tick), 20u);
  const std::size_t frames_bytes = 2 * (1 + frame_bytes(batch.frames[0]));
  EXPECT_EQ(encode_frame_datagram(0, batch).size(), frame_datagram_head_bytes(batch.tick) + frames_bytes);
}

TEST(FrameDatagram, takes_another_clock_when_it_is_sent_later) {
  for (const std::int64_t clock_ns : {0ll, 5'000'000'001ll, 5'033'000'000ll, 300'000'000'000ll}) {
    Bytes bytes = encode_frame_datagram(5'010'000'000, small_batch());
    set_clock(bytes, clock_ns);
    const DecodedPacket got = decode_frame_datagram(bytes);
    EXPECT_EQ(got.envelope.clock_ns, clock_ns);
    EXPECT_TRUE(equal(batch_of(got), small_batch()));
  }
}

TEST(FrameDatagram, takes_the_nearest_clock_where_it_cannot_say_the_right_one) {
  Bytes bytes = encode_frame_datagram(0, small_batch());
  set_clock(bytes, kTimeMax_ns);
  EXPECT_EQ(decode_frame_datagram(bytes).envelope.clock_ns, 5'000'000'000 + kClockDistanceMax_ns - 1);
  set_clock(bytes, -kTimeMax_ns);
  EXPECT_EQ(decode_frame_datagram(bytes).envelope.clock_ns, 5'000'000'000 - kClockDistanceMax_ns);
}

TEST(FrameDatagram, is_never_taken_for_a_packet_nor_a_packet_for_it) {
  RandomMessages random(2);
  for (int n = 0; n < 2000; ++n) {
    EXPECT_FALSE(is_frame_datagram(encode_packet(random.envelope(static_cast<std::size_t>(n) % kMessageKinds))));
    EXPECT_EQ(decode_packet(encode_frame_datagram(0, random_batch(random))).error, DecodeError::malformed);
  }
  // The first two bytes of a packet are those of its size prefix. A prefix that begins with "FB" means at least 0x4246
  // = 16 966 bytes, which no datagram has.
  Bytes large = encode_packet({1, GroomChunk{{}, 0, Bytes(16'000)}});
  large.resize(4 + 0x4246);
  large[0] = 'F';
  large[1] = 'B';
  EXPECT_FALSE(is_frame_datagram(large));
  EXPECT_FALSE(is_frame_datagram({}));
  EXPECT_FALSE(is_frame_datagram(Bytes{'F'}));
}

TEST(FrameDatagram, is_not_written_above_the_limit_of_datagrams) {
  FrameBatch batch = small_batch();
  // A long content takes one byte more for its length than the empty one.
  const std::size_t beside = encode_frame_datagram(0, batch).size() + 1;
  const Bytes content(kDatagramBytesMax - beside);
  batch.frames[0].content = content;
  const Bytes largest = encode_frame_datagram(0, batch);
  EXPECT_EQ(largest.size(), kDatagramBytesMax);
  EXPECT_EQ(decode_frame_datagram(largest).error, DecodeError::none);
  const Bytes more(content.size() + 1);
  batch.frames[0].content = more;
  EXPECT_TRUE(encode_frame_datagram(0, batch).empty());
}

// No decoder may read beyond the bytes that came, and a frame that is cut must not be shown.
TEST(FrameDatagram, that_is_cut_is_refused_or_has_the_frames_before_the_cut) {
  RandomMessages random(3);
  for (int n = 0; n < 100; ++n) {
    const FrameBatch batch = random_batch(random);
    const Bytes bytes = encode_frame_datagram(batch.sample_time_ns, batch);
    std::size_t whole_frames = 0;
    for (std::size_t length = 0; length < bytes.size(); ++length) {
      const DecodedPacket got = decoded(Bytes(bytes.begin(), bytes.begin() + static_cast<std::ptrdiff_t>(length)));
      ASSERT_EQ(got.error == DecodeError::none, got.detail.empty());
      if (got.error != DecodeError::none) continue;
      ++whole_frames;
      FrameBatch expected = batch;
      expected.frames.resize(whole_frames);
      expected.generations.resize(whole_frames);
      EXPECT_TRUE(equal(batch_of(got), expected)) << n << ", cut at " << length;
    }
    EXPECT_EQ(whole_frames, batch.frames.size() - 1);
  }
}

TEST(FrameDatagram, with_a_value_out_of_range_is_invalid) {
  const auto error_of = [](auto&& corrupt) {
    FrameBatch batch = small_batch();
    corrupt(batch);
    return decode_frame_datagram(encode_frame_datagram(0, batch)).error;
  };
  EXPECT_EQ(error_of([](FrameBatch&) {}), DecodeError::none);
  // Members ascend, strides are 1, 2 or 4 ticks, only frames of the level `learnt` may be marked as evaluated, and
  // times are at most kTimeMax_ns.
  EXPECT_EQ(error_of([](FrameBatch& b) { b.frames[1].member = 3; }), DecodeError::invalid) << "twice the same";
  EXPECT_EQ(error_of([](FrameBatch& b) { b.frames[1].step_stride = 8; }), DecodeError::invalid);
  EXPECT_EQ(error_of([](FrameBatch& b) { b.frames[0].evaluated = true; }), DecodeError::invalid);
  EXPECT_EQ(error_of([](FrameBatch& b) { b.sample_time_ns = kTimeMax_ns; }), DecodeError::none);
  EXPECT_EQ(error_of([](FrameBatch& b) { b.sample_time_ns = kTimeMax_ns + 1; }), DecodeError::invalid);
  FrameBatch latest = small_batch();
  latest.sample_time_ns = kTimeMax_ns;
  EXPECT_EQ(decode_frame_datagram(encode_frame_datagram(kTimeMax_ns + 1, latest)).error, DecodeError::invalid);
}

// The largest tick has 64 bits, that is 9 bytes of 7 bits and one bit in a tenth byte. A 2 there would be a 65th bit.
TEST(FrameDatagram, with_a_tick_of_too_many_bits_is_malformed) {
  FrameBatch batch = small_batch();
  batch.tick = std::numeric_limits<std::uint64_t>::max();
  Bytes bytes = encode_frame_datagram(0, batch);
  EXPECT_EQ(batch_of(decode_frame_datagram(bytes)).tick, batch.tick);
  std::uint8_t& last = bytes[frame_datagram_head_bytes(batch.tick) - 1];
  ASSERT_EQ(last, 1);
  last = 2;
  EXPECT_EQ(decode_frame_datagram(bytes).error, DecodeError::malformed);
}

TEST(FrameDatagram, that_is_damaged_never_gives_an_invalid_batch) {
  constexpr int kMutations = 40'000;
  std::mt19937 random(4);
  RandomMessages messages(4);
  int accepted = 0, refused = 0;
  for (int n = 0; n < kMutations; ++n) {
    const FrameBatch batch = random_batch(messages);
    Bytes bytes = mutated(random, encode_frame_datagram(batch.sample_time_ns, batch));
    // Three quarters get the two bytes back that mark a frame datagram; otherwise most mutations would not be one.
    if (n % 4 != 0 && bytes.size() > 2) bytes[0] = 'F', bytes[1] = 'B';
    const DecodedPacket got = decoded(bytes);
    ASSERT_EQ(got.error == DecodeError::none, got.detail.empty());
    (got.error == DecodeError::none ? accepted : refused)++;
    if (got.error != DecodeError::none) continue;
    ASSERT_EQ(batch_of(got).frames.size(), batch_of(got).generations.size());
    const Bytes again = encode_frame_datagram(got.envelope.clock_ns, batch_of(got));
    ASSERT_TRUE(equal(batch_of(decode_frame_datagram(again)), batch_of(got))) << "mutation " << n;
  }
  EXPECT_GT(accepted, kMutations / 100) << "too wild to reach the validation of values";
  EXPECT_GT(refused, kMutations / 100) << "hardly a mutation is refused";
}

}  // namespace
}  // namespace hairnet::wire
