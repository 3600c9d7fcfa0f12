#include "schema/wire/groom_file.hpp"

#include <gtest/gtest.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <cstring>
#include <fstream>
#include <iterator>
#include <limits>

#include "schema/bytes/content_hash.hpp"
#include "schema/wire/groom_numbers.hpp"
#include "schema/wire/packing.hpp"
#include "tests/support/corrupted_grooms.hpp"
#include "tests/support/learnt.hpp"
#include "tests/support/random_messages.hpp"
#include "tests/unit/schema/equal.hpp"

namespace hairnet::wire {
namespace {

using Bytes = std::vector<std::uint8_t>;

// Returns the file without its compression. The decoder takes such a file too, and a change of one of its bytes changes
// one number instead of everything behind it.
Bytes unpacked(const Groom& groom) {
  return unpack(encode_groom(groom), kPackedGroom).value();
}

// Copies the numbers that the file rounds from `got` to `sent`, so that a comparison of both is exact for all others.
// Returns the largest distance of a point or a vertex from what was sent.
float replace_rounded(const Groom& got, Groom& sent) {
  float distance_m = 0;
  const auto replace = [&](const std::vector<Vec3f>& from, std::vector<Vec3f>& to) {
    ASSERT_EQ(from.size(), to.size());
    for (std::size_t i = 0; i < to.size(); ++i) distance_m = std::max(distance_m, (from[i] - to[i]).norm());
    to = from;
  };
  replace(got.points, sent.points);
  replace(got.body.mesh.vertices, sent.body.mesh.vertices);
  EXPECT_EQ(got.body.bone_weights.size(), sent.body.bone_weights.size());
  for (std::size_t v = 0; v < sent.body.bone_weights.size(); ++v) {
    for (std::size_t bone = 0; bone < kBoneCount; ++bone)
      // A weight has steps of 1/4095 (kGroomWeightMax); the last one of a vertex makes up for the rounding of all.
      EXPECT_NEAR(got.body.bone_weights[v][bone], sent.body.bone_weights[v][bone], 0.001f);
  }
  sent.body.bone_weights = got.body.bone_weights;
  return distance_m;
}

TEST(GroomFile, gives_back_every_groom_within_a_twentieth_of_a_millimetre) {
  RandomMessages random(1);
  for (std::size_t strand_count = 0; strand_count < 60; ++strand_count) {
    Groom sent = random.groom(strand_count);
    const Result<Groom> got = decode_groom(encode_groom(sent));
    ASSERT_TRUE(got) << got.error();
    // Coordinates have steps of 0.05 mm (kGroomStep_m), so a point moves by at most 0.043 mm.
    EXPECT_LE(replace_rounded(*got, sent), 5e-5f);
    EXPECT_TRUE(equal(*got, sent));
  }
}

TEST(GroomFile, gives_back_a_groom_that_was_decoded_exactly) {
  RandomMessages random(1);
  for (std::size_t strand_count = 0; strand_count < 60; ++strand_count) {
    const Groom once = decode_groom(encode_groom(random.groom(strand_count))).value();
    EXPECT_TRUE(equal(decode_groom(encode_groom(once)).value(), once));
  }
}

// Makes 300 wavy strands of 5 to 24 points, so that each number of a point in its strand has enough strands to fit the
// weights of its prediction.
Groom make_wavy_groom() {
  Groom groom;
  groom.group_names = {"all"};
  for (int s = 0; s < 300; ++s) {
    const float a = 0.37f * static_cast<float>(s);
    std::vector<Vec3f> strand;
    for (int i = 0; i < 5 + s % 20; ++i) {
      const float x = 0.01f * static_cast<float>(i);
      strand.emplace_back(0.1f * std::cos(a) + 0.01f * std::sin(60 * x), 0.1f - x, 0.1f * std::sin(a) + 0.2f * x);
    }
    groom.add_strand(strand, {});
  }
  return groom;
}

// Neighbouring strands are alike, so the file stores how a strand differs from another one. It would be several
// times as large otherwise.
TEST(GroomFile, predicts_strands_from_each_other) {
  Groom sent = make_wavy_groom();
  const EncodedPoints encoded = encode_points(sent.points, point_runs(sent));
  EXPECT_EQ(encoded.weights.size() % kGroomWeightsPerRow, 0u);
  EXPECT_GT(encoded.weights.size(), 10 * kGroomWeightsPerRow);
  EXPECT_EQ(encoded.references.size(), 3 * sent.strand_count());
  const Bytes file = encode_groom(sent);
  EXPECT_LT(file.size(), 3 * sent.points.size()) << "less than a byte a coordinate";
  const Result<Groom> got = decode_groom(file);
  ASSERT_TRUE(got) << got.error();
  EXPECT_LE(replace_rounded(*got, sent), 5e-5f);
  EXPECT_EQ(encode_groom(*got), file);
}

// A decoder must be safe for every file. The largest weights and remainders must give finite points within the range of
// 24 bits, and no overflow.
TEST(GroomFile, points_take_any_weights_and_any_remainders) {
  const Groom groom = make_wavy_groom();
  const std::vector<PointRun> runs = point_runs(groom);
  EncodedPoints encoded = encode_points(groom.points, runs);
  std::vector<Vec3f> points;
  for (const int value : {-32768, 32767}) {
    std::ranges::fill(encoded.weights, static_cast<std::int16_t>(value));
    std::ranges::fill(encoded.planes, std::uint8_t{255});
    EXPECT_EQ(decode_points(encoded.weights, encoded.references, encoded.planes, runs, points), "");
    EXPECT_EQ(points.size(), groom.points.size());
    for (const Vec3f& point : points) ASSERT_LE(point.cwiseAbs().maxCoeff(), kGroomStep_m * (1 << 23));
  }
  encoded.planes.pop_back();
  EXPECT_NE(decode_points(encoded.weights, encoded.references, encoded.planes, runs, points), "");
}

TEST(GroomFile, copies_of_strands_refer_to_the_originals) {
  const Groom groom = make_wavy_groom();
  Groom twice = groom;
  for (std::size_t s = 0; s < groom.strand_count(); ++s) twice.add_strand(groom.strand_points(s), groom.strands[s]);
  const Bytes planes = encode_points(twice.points, point_runs(twice)).references;
  const std::size_t count = twice.strand_count();
  ASSERT_EQ(planes.size(), 3 * count);
  for (std::size_t s = groom.strand_count(); s < count; ++s) {
    const std::size_t folded = planes[s] + 256u * planes[count + s] + 65536u * planes[2 * count + s];
    // A reference says how many strands back the original is. It is stored as three byte planes, doubled so that the
    // lowest bit is free for the sign.
    EXPECT_EQ(folded, 2 * groom.strand_count());
  }
}

TEST(GroomFile, indices_too_large_for_any_groom_stay_so) {
  // Indices travel as 24 bits with a sign, so 2^23 - 1 = 8 388 607 is the largest. A larger one becomes this, which no
  // groom can have (point_count_max), so validation still refuses it.
  const std::vector<std::uint32_t> sent{7, 0, 8'388'607, 8'388'608, 1u << 24, 0xFFFFFFFF, 3};
  std::vector<std::uint32_t> got;
  EXPECT_EQ(decode_indices(encode_indices(sent), got), "");
  EXPECT_EQ(got, (std::vector<std::uint32_t>{7, 0, 8'388'607, 8'388'607, 8'388'607, 8'388'607, 3}));
  EXPECT_GE(8'388'607u, GroomLimits().point_count_max);
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
  EXPECT_EQ(std::memcmp(bytes.data() + 8, "HNGZ", 4), 0);
  EXPECT_EQ(std::memcmp(unpacked(Groom{}).data() + 8, "HNGR", 4), 0);
}

TEST(GroomFile, says_of_other_files_that_they_are_none) {
  const std::string text = "MIT License\n\nPermission is hereby granted";
  for (const std::size_t size : {std::size_t{0}, std::size_t{11}, text.size()}) {
    const Result<Groom> got = decode_groom(Bytes(text.begin(), text.begin() + static_cast<std::ptrdiff_t>(size)));
    ASSERT_FALSE(got);
    EXPECT_EQ(got.error(), "not a .groom file (it does not begin as one)");
  }
  Bytes bytes = encode_groom(Groom{});
  bytes.pop_back();
  EXPECT_EQ(decode_groom(bytes).error().find("not whole: "), 0u) << decode_groom(bytes).error();
}

TEST(GroomFile, can_contain_a_big_groom) {
  RandomMessages random(3);
  Groom groom;
  groom.group_names = {"all"};
  std::vector<Vec3f> strand(16, Vec3f(0.1f, 0.2f, 0.3f));
  for (int s = 0; s < 10'000; ++s) groom.add_strand(strand, {});
  const Bytes bytes = encode_groom(groom);
  // 160 000 points of 9 bytes and 10 000 strands of 23 bytes are 1 670 000 bytes.
  EXPECT_LT(unpacked(groom).size(), 1'700'000u) << "9 bytes a point, 23 a strand";
  EXPECT_LT(bytes.size(), 10'000u) << "all are the same";
  const Result<Groom> got = decode_groom(bytes);
  ASSERT_TRUE(got) << got.error();
  EXPECT_LE(replace_rounded(*got, groom), 5e-5f);
  EXPECT_TRUE(equal(*got, groom));
}

TEST(GroomFile, is_refused_at_every_truncation_and_with_extra_bytes) {
  RandomMessages random(4);
  const Groom groom = random.groom(5);
  for (const Bytes& bytes : {encode_groom(groom), unpacked(groom)}) {
    for (std::size_t n = 0; n < bytes.size(); ++n) {
      EXPECT_FALSE(decode_groom(Bytes(bytes.begin(), bytes.begin() + static_cast<std::ptrdiff_t>(n))));
    }
    Bytes longer = bytes;
    longer.push_back(0);
    EXPECT_FALSE(decode_groom(longer));
  }
}

// A client may upload any bytes, and the server must not crash.
TEST(GroomFile, survives_every_flipped_bit) {
  RandomMessages random(5);
  const Groom groom = random.groom(3);
  for (Bytes bytes : {encode_groom(groom), unpacked(groom)}) {
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
}

TEST(GroomFile, refuses_what_validate_refuses) {
  RandomMessages random(6);
  const auto is_refused = [&](auto corrupt) {
    Groom groom = random.groom(4);
    while (groom.points.empty()) groom = random.groom(4);
    EXPECT_TRUE(decode_groom(encode_groom(groom)));
    corrupt(groom);
    return !decode_groom(encode_groom(groom));
  };
  // Coordinates may reach 10 m (GroomLimits::coordinate_max_m).
  for (const float value :
       {std::numeric_limits<float>::quiet_NaN(), std::numeric_limits<float>::infinity(), 10.1f, -10.1f, 1e9f, -1e30f}) {
    EXPECT_TRUE(is_refused([&](Groom& g) { g.points.front().x() = value; })) << value;
    EXPECT_TRUE(is_refused([&](Groom& g) { g.body.mesh.vertices.back().z() = value; })) << value;
    EXPECT_TRUE(is_refused([&](Groom& g) { g.body.bone_weights.front()[1] = value; })) << value;
    EXPECT_TRUE(is_refused([&](Groom& g) { g.strands.front().radius_m = value; })) << value;
  }
  EXPECT_TRUE(is_refused([](Groom& g) { g.body.bone_weights.front() = {0.5f, 0.4f, 0, 0, 0}; }));
  EXPECT_TRUE(is_refused([](Groom& g) { g.body.mesh.triangles.push_back({0, 1, 50}); }));
}

// A random groom has the groups 0 and 1.
TEST(GroomFile, refuses_materials_that_no_hair_has) {
  RandomMessages random(9);
  const auto error_of = [&](auto corrupt) {
    Groom groom = random.groom(4);
    groom.materials.groups.clear();
    corrupt(groom.materials);
    const Result<Groom> got = decode_groom(encode_groom(groom));
    return got ? std::string() : got.error();
  };
  EXPECT_EQ(error_of([](MaterialSet&) {}), "");
  EXPECT_NE(error_of([](MaterialSet& m) { m.base.damping_ratio = -1; }).find("damping ratio"), std::string::npos);
  EXPECT_NE(error_of([](MaterialSet& m) { m.set(2, {}); }).find("group 2"), std::string::npos);
  EXPECT_NE(error_of([](MaterialSet& m) { m.groups = {{1, {}}, {0, {}}}; }).find("ascending"), std::string::npos);
  EXPECT_NE(error_of([](MaterialSet& m) { m.groups.resize(300); }).find("more materials"), std::string::npos);
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

// Returns the offset of the version, which is 3, in a file. FlatBuffers put it at no fixed place: the offset is that of
// a 3 for which the decoder, given a 9 instead, complains of version 9. Returns 0 when there is none.
std::size_t version_at(const Bytes& bytes) {
  for (std::size_t at = 12; at + 2 <= bytes.size(); ++at) {
    if (bytes[at] != 3 || bytes[at + 1] != 0) continue;
    Bytes other = bytes;
    other[at] = 9;
    const Result<Groom> got = decode_groom(other);
    if (!got && got.error().find("version 9") != std::string::npos) return at;
  }
  return 0;
}

// Version 0 is before the first one, 4 is the next, and 255 is the largest of a byte.
TEST(GroomFile, refuses_another_version_by_name) {
  const Bytes bytes = unpacked(Groom{});
  const std::size_t at = version_at(bytes);
  ASSERT_NE(at, 0u);
  for (const auto version : std::array<std::uint8_t, 3>{0, 4, 255}) {
    Bytes other = bytes;
    other[at] = version;
    const Result<Groom> got = decode_groom(other);
    ASSERT_FALSE(got);
    EXPECT_NE(got.error().find("version " + std::to_string(version)), std::string::npos) << got.error();
  }
}

// Reads a file that an earlier version of this library wrote. Nothing writes these formats any more, but the decoder
// must still read them.
Bytes older_groom(int version) {
  std::ifstream file(
      std::string(HAIRNET_SOURCE_DIR) + "/tests/support/older_grooms/version_" + std::to_string(version) + ".groom",
      std::ios::binary);
  return {std::istreambuf_iterator<char>(file), {}};
}

TEST(GroomFile, of_version_1_is_of_normal_hair) {
  const Result<Groom> got = decode_groom(older_groom(1));
  ASSERT_TRUE(got) << got.error();
  EXPECT_EQ(got->materials, MaterialSet{});
  EXPECT_EQ(got->strand_count(), 3u);
  ASSERT_EQ(got->points.size(), 34u);
  EXPECT_EQ(got->points.front(), Vec3f(-0.010932616889476776f, 0.0074553294107317924f, -0.30690544843673706f));
}

// People keep their groom files for years.
TEST(GroomFile, of_version_2_is_read_and_written_as_the_newest) {
  const Result<Groom> got = decode_groom(older_groom(2));
  ASSERT_TRUE(got) << got.error();
  EXPECT_EQ(got->strand_count(), 2u);
  ASSERT_EQ(got->points.size(), 68u);
  EXPECT_EQ(got->points.front(), Vec3f(0.13820800185203552f, 0.27611294388771057f, 0.34484514594078064f));
  EXPECT_EQ(got->body.mesh.vertices.size(), 37u);
  EXPECT_EQ(got->body.mesh.vertices.front(), Vec3f(0.20506231486797333f, 0.1456562727689743f, -0.6849735379219055f));
  EXPECT_FALSE(got->knots.empty() || got->threads.empty() || got->cards.empty() || got->cloths.empty());
  Groom older = *got;
  const Groom newer = decode_groom(encode_groom(older)).value();
  EXPECT_LE(replace_rounded(newer, older), 5e-5f);
  EXPECT_TRUE(equal(newer, older));
}

TEST(GroomFile, of_older_versions_survives_every_flipped_bit_and_is_refused_at_every_truncation) {
  for (const int version : {1, 2}) {
    Bytes bytes = older_groom(version);
    for (std::size_t bit = 0; bit < 8 * bytes.size(); ++bit) {
      const auto mask = static_cast<std::uint8_t>(1u << bit % 8);
      bytes[bit / 8] ^= mask;
      const Result<Groom> got = decode_groom(bytes);
      EXPECT_EQ(got ? validate(*got) : std::string(), "");
      bytes[bit / 8] ^= mask;
    }
    for (; !bytes.empty(); bytes.pop_back()) EXPECT_EQ(decode_groom(bytes).has_value(), bytes == older_groom(version));
  }
}

// Draws random grooms until one has threads, cards, cloths and knots.
Groom groom_with_features(std::uint64_t seed, std::size_t strand_count) {
  RandomMessages random(seed);
  Groom groom = random.groom(strand_count);
  while (groom.threads.empty() || groom.cards.empty() || groom.cloths.empty() || groom.knots.empty())
    groom = random.groom(strand_count);
  return groom;
}

TEST(GroomFile, with_features_is_refused_at_every_truncation) {
  const Bytes bytes = unpacked(groom_with_features(9, 5));
  ASSERT_TRUE(decode_groom(bytes)) << decode_groom(bytes).error();
  for (std::size_t n = 0; n < bytes.size(); ++n) {
    EXPECT_FALSE(decode_groom(Bytes(bytes.begin(), bytes.begin() + static_cast<std::ptrdiff_t>(n))));
  }
}

TEST(GroomFile, with_features_survives_every_flipped_bit) {
  Bytes bytes = unpacked(groom_with_features(10, 2));
  for (std::size_t bit = 0; bit < 8 * bytes.size(); ++bit) {
    const auto mask = static_cast<std::uint8_t>(1u << bit % 8);
    bytes[bit / 8] ^= mask;
    const Result<Groom> got = decode_groom(bytes);
    EXPECT_EQ(got ? validate(*got) : std::string(), "");
    bytes[bit / 8] ^= mask;
  }
}

TEST(GroomFile, is_refused_when_its_stream_or_its_numbers_are_wrong) {
  for (const auto& [name, file, error] : corrupted_grooms()) {
    const Result<Groom> got = decode_groom(file);
    ASSERT_FALSE(got) << name;
    EXPECT_NE(got.error().find(error), std::string::npos) << name << ": " << got.error();
  }
}

TEST(GroomFile, says_how_many_bytes_it_unpacks_to) {
  const Groom groom = make_wavy_groom();
  EXPECT_EQ(unpacked_bytes(encode_groom(groom), kPackedGroom), unpacked(groom).size());
  EXPECT_EQ(unpacked_bytes(unpacked(groom), kPackedGroom), unpacked(groom).size());
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
  // This is the BLAKE2b-256 of the three bytes "abc".
  const GroomHash expected{0xbd, 0xdd, 0x81, 0x3c, 0x63, 0x42, 0x39, 0x72, 0x31, 0x71, 0xef,
                           0x3f, 0xee, 0x98, 0x57, 0x9b, 0x94, 0x96, 0x4e, 0x3b, 0xb1, 0xcb,
                           0x3e, 0x42, 0x72, 0x62, 0xc8, 0xc0, 0x68, 0xd5, 0x23, 0x19};
  EXPECT_EQ(hash_groom(Bytes{'a', 'b', 'c'}), expected);
}

TEST(GroomHash, of_pieces_is_that_of_the_whole) {
  Bytes bytes(100'000);
  for (std::size_t i = 0; i < bytes.size(); ++i) bytes[i] = static_cast<std::uint8_t>(i * i >> 3);
  bytes::ContentHasher hasher;
  // The sizes of the pieces are powers of 3 modulo the prime 1009, so they are irregular and never 0.
  for (std::size_t begin = 0, size = 1; begin < bytes.size(); begin += size, size = size * 3 % 1009) {
    hasher.add(std::span(bytes).subspan(begin, std::min(size, bytes.size() - begin)));
    const bytes::ContentHasher copy = hasher;
    EXPECT_EQ(copy.hash(), hasher.hash()) << "asking changes nothing";
  }
  EXPECT_EQ(hasher.hash(), hash_groom(bytes));
  EXPECT_EQ(bytes::ContentHasher().hash(), hash_groom(Bytes{}));
}

TEST(GroomFile, has_learnt_hair_that_only_those_who_ask_for_it_see) {
  RandomMessages random(11);
  const Groom groom = decode_groom(encode_groom(random.groom(20))).value();
  const LearntHair hair = support::random_learnt_hair(3);
  const Bytes file = encode_groom(groom, &hair);
  const Result<Groom> got = decode_groom(file);
  ASSERT_TRUE(got) << got.error();
  EXPECT_TRUE(equal(*got, groom));
  const auto learnt = decode_learnt_of_groom(file);
  ASSERT_TRUE(learnt && *learnt);
  EXPECT_EQ((*learnt)->hidden_weights, hair.hidden_weights);
  EXPECT_EQ((*learnt)->wind.weights, hair.wind.weights);
  EXPECT_EQ((*learnt)->most, hair.most);
  const auto none = decode_learnt_of_groom(encode_groom(groom));
  ASSERT_TRUE(none);
  EXPECT_EQ(*none, nullptr);
  // The file is long, so only some truncations are tried; 97 is prime, so they fall at all offsets within a number.
  for (std::size_t n = 0; n < file.size(); n += 97) EXPECT_FALSE(decode_learnt_of_groom(std::span(file).first(n))) << n;
}

// An error in the learnt hair must not cost the groom itself. The first hidden weights are found in the file by their
// bytes, and become NaN.
TEST(GroomFile, with_learnt_hair_of_wrong_numbers_is_still_a_groom) {
  RandomMessages random(12);
  const LearntHair hair = support::random_learnt_hair(3);
  Bytes table = unpack(encode_groom(random.groom(20), &hair), kPackedGroom).value();
  const auto* const first = reinterpret_cast<const std::uint8_t*>(hair.hidden_weights.data());
  const auto found = std::search(table.begin(), table.end(), first, first + 16);
  ASSERT_NE(found, table.end());
  const float not_a_number = std::numeric_limits<float>::quiet_NaN();
  std::memcpy(&*found, &not_a_number, sizeof(not_a_number));
  EXPECT_TRUE(decode_groom(table));
  const auto learnt = decode_learnt_of_groom(table);
  ASSERT_FALSE(learnt);
  EXPECT_EQ(learnt.error(), "learnt hair with a weight that is not finite, or too great");
}

}  // namespace
}  // namespace hairnet::wire
