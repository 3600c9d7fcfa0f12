#include "schema/channel/packet_splitter.hpp"

#include <gtest/gtest.h>

#include <cstring>
#include <random>

namespace hairnet::channel {
namespace {

using Bytes = std::vector<std::uint8_t>;

// The limit of most splitters below; a small one keeps the tests quick.
constexpr std::size_t kMax_bytes = 1000;

// Returns a packet of that size: a size prefix, which does not count itself, and filling.
Bytes packet(std::size_t bytes, std::uint8_t fill) {
  Bytes out(bytes, fill);
  const auto counted = static_cast<std::uint32_t>(bytes - 4);
  std::memcpy(out.data(), &counted, 4);
  return out;
}

std::vector<Bytes> random_packets(std::mt19937& random, std::size_t count) {
  std::vector<Bytes> packets;
  for (std::size_t n = 0; n < count; ++n)
    packets.push_back(packet(wire::kPacketBytesMin + random() % (kMax_bytes - wire::kPacketBytesMin + 1),
                             static_cast<std::uint8_t>(random())));
  return packets;
}

Bytes joined(const std::vector<Bytes>& packets) {
  Bytes stream;
  for (const Bytes& p : packets) stream.insert(stream.end(), p.begin(), p.end());
  return stream;
}

TEST(PacketSplitter, gives_the_same_packets_for_any_partition) {
  std::mt19937 random(1);
  const std::vector<Bytes> sent = random_packets(random, 30);
  const Bytes stream = joined(sent);
  for (int round = 0; round < 300; ++round) {
    PacketSplitter splitter(kMax_bytes);
    std::vector<Bytes> got;
    // Every third round has pieces of up to 5 bytes, which cut size prefixes; the others have several packets in a
    // piece.
    const std::size_t piece_max = 1 + random() % (round % 3 == 0 ? 5 : 3000);
    for (std::size_t at = 0; at < stream.size();) {
      const std::size_t piece = std::min<std::size_t>(1 + random() % piece_max, stream.size() - at);
      ASSERT_TRUE(splitter.feed(std::span(stream).subspan(at, piece), [&](std::span<const std::uint8_t> p) {
        // Decoders read numbers of 8 bytes in place, so each packet must be aligned.
        EXPECT_EQ(reinterpret_cast<std::uintptr_t>(p.data()) % 8, 0u);
        got.emplace_back(p.begin(), p.end());
      }));
      at += piece;
    }
    ASSERT_EQ(got, sent);
    EXPECT_EQ(splitter.buffered_bytes(), 0u);
  }
}

TEST(PacketSplitterDeathTest, a_callback_that_calls_the_splitter_stops_the_program) {
  const Bytes whole = packet(100, 1);
  PacketSplitter splitter(kMax_bytes);
  const auto feed_again = [&](std::span<const std::uint8_t> bytes) { splitter.feed(bytes, [](auto) {}); };
  EXPECT_DEATH(splitter.feed(whole, feed_again), "assertion failed: !is_feeding_");
}

TEST(PacketSplitter, keeps_an_incomplete_packet_to_itself) {
  const Bytes whole = packet(100, 1);
  PacketSplitter splitter(kMax_bytes);
  int count = 0;
  for (std::size_t i = 0; i < whole.size(); ++i) {
    EXPECT_EQ(splitter.buffered_bytes(), i);
    EXPECT_EQ(count, 0);
    ASSERT_TRUE(splitter.feed(std::span(whole).subspan(i, 1), [&](auto) { ++count; }));
  }
  EXPECT_EQ(count, 1);
}

// After a wrong size nobody knows where the next packet begins, so the stream cannot go on.
TEST(PacketSplitter, takes_the_largest_packet_and_dies_of_a_larger_one) {
  PacketSplitter splitter(kMax_bytes);
  int count = 0;
  const auto on_packet = [&](std::span<const std::uint8_t>) { ++count; };
  EXPECT_TRUE(splitter.feed(packet(kMax_bytes, 2), on_packet));
  EXPECT_EQ(count, 1);
  EXPECT_FALSE(splitter.feed(packet(kMax_bytes + 1, 2), on_packet));
  EXPECT_FALSE(splitter.feed(packet(100, 3), on_packet)) << "a dead stream stays dead";
  EXPECT_FALSE(splitter.feed({}, on_packet));
  EXPECT_EQ(count, 1);
  EXPECT_EQ(splitter.buffered_bytes(), 0u);
  EXPECT_EQ(splitter.capacity_bytes(), 0u);
}

TEST(PacketSplitter, dies_of_a_packet_below_the_least) {
  // No packet is below kPacketBytesMin, 16 bytes. A stream with a smaller size prefix is no stream of packets.
  for (std::size_t bytes = 4; bytes < wire::kPacketBytesMin; ++bytes) {
    PacketSplitter splitter(kMax_bytes);
    EXPECT_FALSE(splitter.feed(packet(bytes, 1), [](auto) { FAIL(); }));
  }
  PacketSplitter splitter(kMax_bytes);
  int count = 0;
  EXPECT_TRUE(splitter.feed(packet(wire::kPacketBytesMin, 1), [&](auto) { ++count; }));
  EXPECT_EQ(count, 1);
}

TEST(PacketSplitter, delivers_what_came_before_the_error) {
  Bytes stream = packet(50, 1);
  const Bytes bad(4, 0xFF);
  stream.insert(stream.end(), bad.begin(), bad.end());
  PacketSplitter splitter(kMax_bytes);
  int count = 0;
  EXPECT_FALSE(splitter.feed(stream, [&](auto) { ++count; }));
  EXPECT_EQ(count, 1);
}

TEST(PacketSplitter, dies_of_the_prefix_alone_however_it_arrives) {
  // The prefix announces a size of 4 GB. Its three first bytes alone may still belong to a packet within the limit.
  const Bytes prefix(4, 0xFF);
  PacketSplitter splitter(kMax_bytes);
  for (std::size_t i = 0; i < 3; ++i) EXPECT_TRUE(splitter.feed(std::span(prefix).subspan(i, 1), [](auto) {}));
  EXPECT_FALSE(splitter.feed(std::span(prefix).subspan(3, 1), [](auto) {}));
}

// A peer may announce a packet of 64 MB and send nothing more. The splitter may take memory only for what has arrived;
// it doubles its buffer, so up to twice as much and some rounding.
TEST(PacketSplitter, allocates_for_received_bytes_and_not_for_announced_ones) {
  constexpr std::size_t kHuge_bytes = 64u << 20;
  PacketSplitter splitter(kHuge_bytes);
  const Bytes announced = packet(kHuge_bytes, 0);
  const auto ignore = [](std::span<const std::uint8_t>) {};
  ASSERT_TRUE(splitter.feed(std::span(announced).first(10), ignore));
  EXPECT_LE(splitter.capacity_bytes(), 64u);
  ASSERT_TRUE(splitter.feed(std::span(announced).subspan(10, 100'000), ignore));
  EXPECT_LE(splitter.capacity_bytes(), 300'000u);
  ASSERT_TRUE(splitter.feed(std::span(announced).subspan(100'010), ignore));
  EXPECT_LE(splitter.capacity_bytes(), kHuge_bytes);
}

// A stream may begin with a low limit. The first packet raises it here, and the limit must hold for the rest of the
// same piece already.
TEST(PacketSplitter, a_raised_limit_holds_from_the_next_packet_on) {
  PacketSplitter splitter(100);
  int count = 0;
  const auto on_packet = [&](std::span<const std::uint8_t>) {
    ++count;
    splitter.allow(kMax_bytes);
  };
  Bytes stream = packet(100, 1);
  const Bytes large = packet(kMax_bytes, 2);
  stream.insert(stream.end(), large.begin(), large.end());
  EXPECT_TRUE(splitter.feed(stream, on_packet));
  EXPECT_EQ(count, 2);
  EXPECT_FALSE(splitter.feed(packet(kMax_bytes + 1, 3), on_packet));
  EXPECT_EQ(count, 2);
}

TEST(PacketSplitter, frees_the_memory_of_a_large_packet_when_it_is_done) {
  constexpr std::size_t kLarge_bytes = 4u << 20;
  PacketSplitter splitter(kLarge_bytes);
  const auto ignore = [](std::span<const std::uint8_t>) {};
  ASSERT_TRUE(splitter.feed(packet(PacketSplitter::kRetainedBytesMax, 1), ignore));
  EXPECT_GT(splitter.capacity_bytes(), 0u) << "memory of small packets is used again";
  ASSERT_TRUE(splitter.feed(packet(kLarge_bytes, 1), ignore));
  EXPECT_EQ(splitter.capacity_bytes(), 0u);
  ASSERT_TRUE(splitter.feed(packet(100, 1), ignore));
}

}  // namespace
}  // namespace hairnet::channel
