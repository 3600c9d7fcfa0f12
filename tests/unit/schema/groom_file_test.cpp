#include "schema/wire/groom_file.hpp"

#include <gtest/gtest.h>

#include <algorithm>
#include <array>
#include <cstring>
#include <limits>

#include "tests/support/random_messages.hpp"
#include "tests/unit/schema/equal.hpp"

namespace hairnet::wire {
namespace {

using Bytes = std::vector<std::uint8_t>;

TEST(GroomFile, gives_back_every_groom) {
  RandomMessages random(1);
  for (std::size_t strand_count = 0; strand_count < 60; ++strand_count) {
    const Groom sent = random.groom(strand_count);
    const Result<Groom> got = decode_groom(encode_groom(sent));
    ASSERT_TRUE(got) << got.error();
    EXPECT_TRUE(equal(*got, sent));
  }
}

TEST(GroomFile, gives_back_an_empty_groom) {
  const Result<Groom> got = decode_groom(encode_groom(Groom{}));
  ASSERT_TRUE(got) << got.error();
  EXPECT_EQ(got->strand_count(), 0u);
}

TEST(GroomFile, is_the_same_bytes_for_the_same_groom) {
  RandomMessages once(2), again(2);
  const Bytes bytes = encode_groom(once.groom(50));
  EXPECT_EQ(bytes, encode_groom(again.groom(50)));
  EXPECT_EQ(bytes, encode_groom(*decode_groom(bytes))) << "and for one that was decoded";
}

TEST(GroomFile, has_its_identifier_where_the_protocol_says) {
  const Bytes bytes = encode_groom(Groom{});
  EXPECT_EQ(std::memcmp(bytes.data() + 8, "HNGR", 4), 0);
}

TEST(GroomFile, can_contain_a_big_groom) {
  RandomMessages random(3);
  Groom groom;
  groom.group_names = {"all"};
  std::vector<Vec3f> strand(16, Vec3f(0.1f, 0.2f, 0.3f));
  for (int s = 0; s < 10'000; ++s) groom.add_strand(strand, {});
  const Bytes bytes = encode_groom(groom);
  EXPECT_LT(bytes.size(), 2'200'000u) << "12 bytes a point, 24 a strand";
  const Result<Groom> got = decode_groom(bytes);
  ASSERT_TRUE(got) << got.error();
  EXPECT_TRUE(equal(*got, groom));
}

TEST(GroomFile, is_refused_at_every_truncation_and_with_extra_bytes) {
  RandomMessages random(4);
  const Bytes bytes = encode_groom(random.groom(5));
  for (std::size_t n = 0; n < bytes.size(); ++n) {
    EXPECT_FALSE(decode_groom(Bytes(bytes.begin(), bytes.begin() + static_cast<std::ptrdiff_t>(n))));
  }
  Bytes longer = bytes;
  longer.push_back(0);
  EXPECT_FALSE(decode_groom(longer));
}

TEST(GroomFile, survives_every_flipped_bit) {
  RandomMessages random(5);
  Bytes bytes = encode_groom(random.groom(3));
  for (std::size_t bit = 0; bit < 8 * bytes.size(); ++bit) {
    const auto mask = static_cast<std::uint8_t>(1u << bit % 8);
    bytes[bit / 8] ^= mask;
    const Result<Groom> got = decode_groom(bytes);
    if (got) {
      EXPECT_EQ(validate(*got), "");
    }
    if (!got) {
      EXPECT_NE(got.error(), "");
    }
    bytes[bit / 8] ^= mask;
  }
}

TEST(GroomFile, refuses_what_validate_refuses) {
  RandomMessages random(6);
  Groom groom = random.groom(4);
  groom.points.front().x() = std::numeric_limits<float>::quiet_NaN();
  EXPECT_FALSE(decode_groom(encode_groom(groom)));
}

TEST(GroomFile, refuses_materials_that_no_hair_has) {
  RandomMessages random(9);
  const auto fault_of = [&](auto spoil) {
    Groom groom = random.groom(4);
    groom.materials.groups.clear();
    spoil(groom.materials);
    const Result<Groom> got = decode_groom(encode_groom(groom));
    return got ? std::string() : got.error();
  };
  EXPECT_EQ(fault_of([](MaterialSet&) {}), "");
  EXPECT_NE(fault_of([](MaterialSet& m) { m.base.damping_ratio = -1; }).find("damping ratio"), std::string::npos);
  EXPECT_NE(fault_of([](MaterialSet& m) { m.set(2, {}); }).find("group 2"), std::string::npos);
  EXPECT_NE(fault_of([](MaterialSet& m) { m.groups = {{1, {}}, {0, {}}}; }).find("ascending"), std::string::npos);
  EXPECT_NE(fault_of([](MaterialSet& m) { m.groups.resize(300); }).find("more materials"), std::string::npos);
}

TEST(GroomFile, refuses_more_than_the_limits_given) {
  RandomMessages random(7);
  const Bytes bytes = encode_groom(random.groom(4));
  GroomLimits limits;
  limits.strand_count_max = 3;
  EXPECT_FALSE(decode_groom(bytes, limits));
  limits = {};
  limits.group_count_max = 1;
  EXPECT_FALSE(decode_groom(bytes, limits));
  EXPECT_TRUE(decode_groom(bytes));
}

// The place of the version: the only two-byte number in the root table. Found by the decoder's answer to another value.
std::size_t version_at(const Bytes& bytes) {
  for (std::size_t at = 12; at + 2 <= bytes.size(); ++at) {
    if (bytes[at] != 2 || bytes[at + 1] != 0) continue;
    Bytes other = bytes;
    other[at] = 9;
    const Result<Groom> got = decode_groom(other);
    if (!got && got.error().find("version 9") != std::string::npos) return at;
  }
  return 0;
}

TEST(GroomFile, refuses_another_version_by_name) {
  const Bytes bytes = encode_groom(Groom{});
  const std::size_t at = version_at(bytes);
  ASSERT_NE(at, 0u);
  for (const auto version : std::array<std::uint8_t, 3>{0, 3, 255}) {
    Bytes other = bytes;
    other[at] = version;
    const Result<Groom> got = decode_groom(other);
    ASSERT_FALSE(got);
    EXPECT_NE(got.error().find("version " + std::to_string(version)), std::string::npos) << got.error();
  }
}

TEST(GroomFile, of_version_1_is_of_normal_hair) {
  RandomMessages random(10);
  Groom groom = random.groom(4);
  groom.materials.base.damping_ratio = 3;
  Bytes bytes = encode_groom(groom);
  bytes[version_at(bytes)] = 1;
  const Result<Groom> got = decode_groom(bytes);
  ASSERT_TRUE(got) << got.error();
  EXPECT_EQ(got->materials, MaterialSet{});
  groom.materials = {};
  EXPECT_TRUE(equal(*got, groom));
}

TEST(GroomFile, of_version_1_is_read) {
  // Without features the buffer is what version 1 wrote but for its number.
  Groom sent;
  sent.group_names = {"all"};
  sent.add_strand(std::vector<Vec3f>(3, Vec3f(0.1f, 0.2f, 0.3f)), {});
  const Bytes bytes = encode_groom(sent);
  int read = 0;
  for (std::size_t at = 12; at + 2 <= bytes.size(); ++at) {
    if (bytes[at] != 2 || bytes[at + 1] != 0) continue;
    Bytes older = bytes;
    older[at] = 0;
    const Result<Groom> none = decode_groom(older);
    if (none || none.error().find("version 0") == std::string::npos) continue;
    older[at] = 1;
    const Result<Groom> got = decode_groom(older);
    ASSERT_TRUE(got) << got.error();
    EXPECT_TRUE(equal(*got, sent));
    ++read;
  }
  EXPECT_EQ(read, 1);
}

TEST(GroomFile, with_features_is_refused_at_every_truncation) {
  RandomMessages random(9);
  Groom groom = random.groom(5);
  while (groom.threads.empty() || groom.cards.empty() || groom.cloths.empty() || groom.knots.empty() ||
         groom.far_cards.cards.empty())
    groom = random.groom(5);
  const Bytes bytes = encode_groom(groom);
  ASSERT_TRUE(decode_groom(bytes)) << decode_groom(bytes).error();
  for (std::size_t n = 0; n < bytes.size(); ++n) {
    EXPECT_FALSE(decode_groom(Bytes(bytes.begin(), bytes.begin() + static_cast<std::ptrdiff_t>(n))));
  }
}

TEST(GroomFile, with_features_survives_every_flipped_bit) {
  RandomMessages random(10);
  Groom groom = random.groom(2);
  while (groom.threads.empty() || groom.cards.empty() || groom.cloths.empty() || groom.knots.empty() ||
         groom.far_cards.cards.empty())
    groom = random.groom(2);
  Bytes bytes = encode_groom(groom);
  for (std::size_t bit = 0; bit < 8 * bytes.size(); ++bit) {
    const auto mask = static_cast<std::uint8_t>(1u << bit % 8);
    bytes[bit / 8] ^= mask;
    const Result<Groom> got = decode_groom(bytes);
    EXPECT_EQ(got ? validate(*got) : std::string(), "");
    bytes[bit / 8] ^= mask;
  }
}

// Two far cards, of 6 and 10 points, on one strand.
Groom make_groom_with_far_cards() {
  Groom groom;
  groom.group_names = {"all"};
  groom.add_strand(std::vector<Vec3f>(3, Vec3f(0.1f, 0.2f, 0.3f)), {});
  groom.far_cards.add(std::vector<Vec3f>(6, Vec3f(0.1f, 0, 0)), {{}, 0.0123f, 1, 0, true});
  groom.far_cards.add(std::vector<Vec3f>(10, Vec3f(0.2f, 0, 0)), {{}, 0.0123f, 1, 0, false});
  return groom;
}

// The offset of the count of the first card's points: before that of its strands and its root length.
std::size_t far_card_at(const Bytes& bytes) {
  const float root_length_m = 0.0123f;
  std::array<std::uint8_t, 12> wanted{6, 0, 0, 0, 1, 0, 0, 0};
  std::memcpy(wanted.data() + 8, &root_length_m, 4);
  const auto found = std::search(bytes.begin(), bytes.end(), wanted.begin(), wanted.end());
  return found == bytes.end() ? 0 : static_cast<std::size_t>(found - bytes.begin());
}

TEST(GroomFile, with_far_cards_that_count_other_points_than_there_are_is_refused) {
  const Bytes bytes = encode_groom(make_groom_with_far_cards());
  ASSERT_TRUE(decode_groom(bytes)) << decode_groom(bytes).error();
  const std::size_t at = far_card_at(bytes);
  ASSERT_NE(at, 0u);
  for (const auto count : std::array<std::uint8_t, 6>{0, 2, 4, 5, 8, 200}) {
    Bytes other = bytes;
    other[at] = count;
    const Result<Groom> got = decode_groom(other);
    ASSERT_FALSE(got) << int{count};
    EXPECT_NE(got.error().find("far card"), std::string::npos) << got.error();
  }
  Bytes other = bytes;
  other[at + 3] = 255;
  EXPECT_FALSE(decode_groom(other)) << "more than memory holds";
  other = bytes;
  other[at + 4] = 2;
  EXPECT_FALSE(decode_groom(other)) << "stands for two strands of one";
}

TEST(GroomFile, refuses_more_far_cards_than_the_limit) {
  const Bytes bytes = encode_groom(make_groom_with_far_cards());
  GroomLimits limits;
  limits.far_card_count_max = 1;
  EXPECT_FALSE(decode_groom(bytes, limits));
  limits = {};
  limits.far_card_pair_count_max = 4;
  EXPECT_FALSE(decode_groom(bytes, limits));
}

TEST(GroomFile, without_far_cards_spends_nothing_on_them) {
  Groom groom = make_groom_with_far_cards();
  const std::size_t with = encode_groom(groom).size();
  groom.far_cards = {};
  EXPECT_GE(with, encode_groom(groom).size() + 16 * sizeof(Vec3f) + 2 * 16);
}

TEST(GroomHash, distinguishes_and_recognises_grooms) {
  RandomMessages random(8);
  Bytes bytes = encode_groom(random.groom(5));
  const GroomHash hash = hash_groom(bytes);
  EXPECT_EQ(hash, hash_groom(bytes));
  bytes.back() ^= 1;
  EXPECT_NE(hash, hash_groom(bytes));
}

TEST(GroomHash, is_blake2b_256) {
  // BLAKE2b-256 of the three bytes "abc".
  const GroomHash expected{0xbd, 0xdd, 0x81, 0x3c, 0x63, 0x42, 0x39, 0x72, 0x31, 0x71, 0xef,
                           0x3f, 0xee, 0x98, 0x57, 0x9b, 0x94, 0x96, 0x4e, 0x3b, 0xb1, 0xcb,
                           0x3e, 0x42, 0x72, 0x62, 0xc8, 0xc0, 0x68, 0xd5, 0x23, 0x19};
  EXPECT_EQ(hash_groom(Bytes{'a', 'b', 'c'}), expected);
}

TEST(GroomHash, of_pieces_is_that_of_the_whole) {
  Bytes bytes(100'000);
  for (std::size_t i = 0; i < bytes.size(); ++i) bytes[i] = static_cast<std::uint8_t>(i * i >> 3);
  GroomHasher hasher;
  for (std::size_t begin = 0, size = 1; begin < bytes.size(); begin += size, size = size * 3 % 1009) {
    hasher.add(std::span(bytes).subspan(begin, std::min(size, bytes.size() - begin)));
    const GroomHasher copy = hasher;
    EXPECT_EQ(copy.hash(), hasher.hash()) << "asking changes nothing";
  }
  EXPECT_EQ(hasher.hash(), hash_groom(bytes));
  EXPECT_EQ(GroomHasher().hash(), hash_groom(Bytes{}));
}

}  // namespace
}  // namespace hairnet::wire
