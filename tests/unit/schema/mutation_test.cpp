#include <gtest/gtest.h>

#include <random>

#include "schema/wire/groom_file.hpp"
#include "schema/wire/messages.hpp"
#include "schema/wire/recording.hpp"
#include "tests/support/mutation.hpp"
#include "tests/support/random_messages.hpp"

// Decodes valid bytes after random damage. The decoder must refuse them with one line, or give a valid result. Most of
// these tests' worth is under the address and undefined-behaviour sanitizers.
namespace hairnet::wire {
namespace {

using Bytes = std::vector<std::uint8_t>;

constexpr int kMutations = 20'000;

TEST(Mutation, of_packets_never_gives_an_invalid_message) {
  std::mt19937 random(1);
  RandomMessages messages(1);
  int accepted = 0, refused = 0;
  for (int n = 0; n < kMutations; ++n) {
    const std::size_t kind = static_cast<std::size_t>(n) % kMessageKinds;
    const Bytes packet = mutated(random, encode_packet(messages.envelope(kind)));
    const DecodedPacket got = decode_packet(packet);
    ASSERT_EQ(got.error == DecodeError::none, got.detail.empty());
    // A refusal has a line, and a valid message has none.
    (got.error == DecodeError::none ? accepted : refused)++;
    if (got.error == DecodeError::none) {
      ASSERT_EQ(decode_packet(encode_packet(got.envelope)).error, DecodeError::none) << "mutation " << n;
    }
  }
  EXPECT_GT(accepted, kMutations / 100) << "too wild to reach the validation of values";
  EXPECT_GT(refused, kMutations / 100) << "hardly a mutation is refused";
}

TEST(Mutation, of_groom_files_never_gives_an_invalid_groom) {
  std::mt19937 random(2);
  RandomMessages messages(2);
  int accepted = 0, refused = 0;
  for (int n = 0; n < kMutations; ++n) {
    const Result<Groom> got =
        decode_groom(mutated(random, encode_groom(messages.groom(static_cast<std::size_t>(n % 8)))));
    (got ? accepted : refused)++;
    if (got) {
      ASSERT_EQ(validate(*got), "") << "mutation " << n;
    }
    if (!got) {
      ASSERT_FALSE(got.error().empty());
    }
  }
  EXPECT_GT(accepted, kMutations / 100) << "too wild to reach the validation of values";
  EXPECT_GT(refused, kMutations / 100) << "hardly a mutation is refused";
}

TEST(Mutation, of_recordings_never_stops_the_reader_from_moving_on) {
  std::mt19937 random(3);
  RandomMessages messages(3);
  int accepted = 0, refused = 0;
  for (int n = 0; n < kMutations; ++n) {
    Bytes bytes = encode_record_entry(messages.recording_header());
    const Bytes tick = mutated(random, encode_record_entry(messages.recorded_tick()));
    bytes.insert(bytes.end(), tick.begin(), tick.end());
    std::span<const std::uint8_t> rest = bytes;
    ASSERT_TRUE(take_record_entry(rest));
    while (!rest.empty()) {
      const std::size_t left = rest.size();
      const Result<RecordEntry> got = take_record_entry(rest);
      (got ? accepted : refused)++;
      if (!got) break;
      // An entry that is accepted without taking bytes would loop a reader without end.
      ASSERT_LT(rest.size(), left);
    }
  }
  EXPECT_GT(accepted, kMutations / 100) << "too wild to reach the validation of values";
  EXPECT_GT(refused, kMutations / 100) << "hardly a mutation is refused";
}

TEST(Mutation, into_noise_is_refused) {
  std::mt19937 random(4);
  for (int n = 0; n < kMutations; ++n) {
    Bytes noise(random() % 200);
    for (std::uint8_t& byte : noise) byte = static_cast<std::uint8_t>(random());
    // Noise with a right size and identifier gets past the first checks of the decoder; every second one has a
    // plausible offset of its root table too.
    if (noise.size() >= 12) {
      const auto counted = static_cast<std::uint32_t>(noise.size() - 4);
      std::memcpy(noise.data(), &counted, 4);
      std::memcpy(noise.data() + 8, "HNET", 4);
      if (n % 2) std::memcpy(noise.data() + 4, "\x10\0\0\0", 4);
    }
    const DecodedPacket got = decode_packet(noise);
    EXPECT_NE(got.error, DecodeError::none);
  }
}

}  // namespace
}  // namespace hairnet::wire
