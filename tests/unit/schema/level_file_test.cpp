#include "schema/wire/level_file.hpp"

#include <gtest/gtest.h>

#include <cstring>
#include <limits>
#include <random>

#include "core/levels/build.hpp"
#include "core/modes/make_modes.hpp"
#include "schema/wire/groom_file.hpp"
#include "tests/support/build_grooms.hpp"
#include "tests/support/equal_levels.hpp"
#include "tests/support/learnt.hpp"
#include "tests/support/quick_training.hpp"

namespace hairnet::wire {
namespace {

using Bytes = std::vector<std::uint8_t>;

Groom groom_of(int strand_count) {
  Groom groom = support::make_head_of_hair(strand_count);
  groom.body = support::make_plain_body();
  return groom;
}

// Builds the levels and the quickest modes of one small groom once, for all cases, and encodes them.
class LevelFile : public testing::Test {
 protected:
  static void SetUpTestSuite() {
    auto levels = std::make_shared<LevelSet>(*build_levels(groom_of(40)));
    levels->modes = make_modes(groom_of(40), levels, {}, {}, support::kQuickTraining);
    levels_ = levels;
    bytes_ = encode_levels(kGroom, *levels_);
  }
  static void TearDownTestSuite() { levels_.reset(); }
  // Returns the file with one bit flipped at that byte.
  static Bytes corrupted(std::size_t at) {
    Bytes bytes = bytes_;
    bytes[at] ^= 1;
    return bytes;
  }

  static constexpr GroomHash kGroom{1, 2, 3};
  static std::shared_ptr<const LevelSet> levels_;
  static Bytes bytes_;
};
std::shared_ptr<const LevelSet> LevelFile::levels_;
Bytes LevelFile::bytes_;

TEST_F(LevelFile, comes_back_bit_for_bit) {
  const DecodedLevels decoded = decode_levels(bytes_, kGroom);
  ASSERT_EQ(decoded.error, LevelFileError::none) << decoded.detail;
  for (std::size_t i = 0; i < levels_->levels.size(); ++i) {
    SCOPED_TRACE(kLevelNames[i]);
    support::expect_equal(levels_->levels[i], decoded.levels->levels[i]);
  }
  EXPECT_EQ(encode_levels(kGroom, *decoded.levels), bytes_);
}

TEST_F(LevelFile, is_named_by_the_hash_of_its_groom) {
  EXPECT_EQ(level_file_name({0x01, 0xfe}), "01fe" + std::string(60, '0') + ".hnlevels");
}

TEST_F(LevelFile, brings_back_the_modes) {
  const DecodedLevels decoded = decode_levels(bytes_, kGroom);
  ASSERT_TRUE(decoded.levels && decoded.levels->modes) << decoded.detail;
  const Modes &got = *decoded.levels->modes, &sent = *levels_->modes;
  EXPECT_EQ(got.basis.modes, sent.basis.modes);
  EXPECT_EQ(got.basis.node_count, sent.basis.node_count);
  EXPECT_EQ(got.validation_error, sent.validation_error);
  for (std::size_t i = 0; i < sent.maps.size(); ++i) EXPECT_TRUE(got.maps[i].matrix() == sent.maps[i].matrix()) << i;
}

// Learning takes minutes, so a server that restarts must find all of it in the file.
TEST_F(LevelFile, brings_back_what_was_learnt) {
  LevelSet set = *levels_;
  LearntHair sent = support::random_learnt_hair(4);
  sent.wind.error = 0.25f;
  sent.wind.low_error = 0.5f;
  set.learnt = std::make_shared<LearntHair>(sent);
  const DecodedLevels decoded = decode_levels(encode_levels(kGroom, set), kGroom);
  ASSERT_TRUE(decoded.levels && decoded.levels->learnt) << decoded.detail;
  const LearntHair& got = *decoded.levels->learnt;
  EXPECT_EQ(got.hidden_count, sent.hidden_count);
  EXPECT_EQ(got.mode_count, sent.mode_count);
  EXPECT_EQ(got.input_weights, sent.input_weights);
  EXPECT_EQ(got.hidden_weights, sent.hidden_weights);
  EXPECT_EQ(got.bias, sent.bias);
  EXPECT_EQ(got.output_weights, sent.output_weights);
  EXPECT_EQ(got.most, sent.most);
  EXPECT_EQ(got.wind.weights, sent.wind.weights);
  EXPECT_EQ(got.wind.max_m_per_s, sent.wind.max_m_per_s);
  EXPECT_EQ(got.wind.error, sent.wind.error);
  EXPECT_EQ(got.wind.low_error, sent.wind.low_error);
}

TEST_F(LevelFile, with_a_network_that_cannot_be_evaluated_is_invalid) {
  LevelSet set = *levels_;
  auto hair = std::make_shared<LearntHair>(support::random_learnt_hair(4));
  set.learnt = hair;
  hair->bias.pop_back();
  EXPECT_EQ(decode_levels(encode_levels(kGroom, set), kGroom).error, LevelFileError::invalid);
  *hair = support::random_learnt_hair(4);
  hair->output_weights[3] = std::numeric_limits<float>::infinity();
  EXPECT_EQ(decode_levels(encode_levels(kGroom, set), kGroom).error, LevelFileError::invalid);
  *hair = support::random_learnt_hair(4);
  hair->wind.weights.pop_back();
  EXPECT_EQ(decode_levels(encode_levels(kGroom, set), kGroom).error, LevelFileError::invalid);
}

// Modes name nodes of the lattice, and one that does not exist would be read beyond the list.
TEST_F(LevelFile, with_modes_that_do_not_fit_its_levels_is_invalid) {
  const auto error_with = [](const auto& corrupt) {
    auto modes = std::make_shared<Modes>(*levels_->modes);
    corrupt(*modes);
    LevelSet set = *levels_;
    set.modes = modes;
    return decode_levels(encode_levels(kGroom, set), kGroom).error;
  };
  EXPECT_EQ(error_with([](Modes&) {}), LevelFileError::none);
  EXPECT_EQ(error_with([](Modes& m) { m.basis.modes.pop_back(); }), LevelFileError::invalid);
  EXPECT_EQ(error_with([](Modes& m) { m.basis.deviation_m[0] = -1; }), LevelFileError::invalid);
  EXPECT_EQ(error_with([](Modes& m) { m.validation_error.pop_back(); }), LevelFileError::invalid);
  EXPECT_EQ(error_with([](Modes& m) { m.validation_error[0] = std::numeric_limits<float>::quiet_NaN(); }),
            LevelFileError::invalid);
  EXPECT_EQ(error_with([](Modes& m) { m.maps[2] = m.maps[0]; }), LevelFileError::invalid);
  EXPECT_EQ(error_with([](Modes& m) {
              ModeMap::Matrix matrix = m.maps[1].matrix();
              matrix(0, 0) = std::numeric_limits<float>::infinity();
              m.maps[1] = ModeMap(matrix);
            }),
            LevelFileError::invalid);
}

TEST_F(LevelFile, of_a_groom_with_the_maps_made_again_is_the_whole_set) {
  const DecodedLevels decoded = decode_levels(bytes_, kGroom);
  ASSERT_TRUE(decoded.levels);
  make_level_maps(groom_of(40), *decoded.levels);
  support::expect_equal(*levels_, *decoded.levels);
}

TEST_F(LevelFile, without_springs_or_skin_comes_back) {
  Groom groom = support::make_head_of_hair(3);
  groom.materials.base.axial_stiffness_n = 0;
  groom.materials.base.attachment_stiffness_n_per_m = 0;
  const auto set = build_levels(groom);
  const DecodedLevels decoded = decode_levels(encode_levels(kGroom, *set), kGroom);
  ASSERT_EQ(decoded.error, LevelFileError::none) << decoded.detail;
  support::expect_equal(set->levels[0], decoded.levels->levels[0]);
}

TEST_F(LevelFile, is_refused_at_every_truncation) {
  for (std::size_t size = 0; size < bytes_.size(); ++size) {
    const DecodedLevels decoded = decode_levels(std::span(bytes_).first(size), kGroom);
    ASSERT_EQ(decoded.error, LevelFileError::damaged) << size;
    ASSERT_FALSE(decoded.levels);
    ASSERT_FALSE(decoded.detail.empty());
  }
}

TEST_F(LevelFile, sealed_again_at_a_truncation_is_refused_still) {
  // The first 2000 sizes cover the header and the tables; behind them lie long arrays of numbers, of which every 997th
  // byte is tried.
  for (std::size_t size = kLevelFileHeaderBytes; size < bytes_.size(); size += size < 2000 ? 1 : 997) {
    Bytes bytes(bytes_.begin(), bytes_.begin() + static_cast<std::ptrdiff_t>(size));
    set_level_file_checksum(bytes);
    ASSERT_EQ(decode_levels(bytes, kGroom).error, LevelFileError::invalid) << size;
  }
}

TEST_F(LevelFile, with_bytes_behind_it_is_refused) {
  Bytes bytes = bytes_;
  bytes.resize(bytes.size() + 8);
  EXPECT_EQ(decode_levels(bytes, kGroom).error, LevelFileError::damaged);
  set_level_file_checksum(bytes);
  EXPECT_EQ(decode_levels(bytes, kGroom).error, LevelFileError::invalid);
}

TEST_F(LevelFile, says_what_is_other_about_it) {
  // The offsets are those of the header in level_file.hpp. The magic is other.
  EXPECT_EQ(decode_levels(corrupted(0), kGroom).error, LevelFileError::not_a_level_file);
  // The layout's version is other.
  EXPECT_EQ(decode_levels(corrupted(8), kGroom).error, LevelFileError::other_version);
  // The build's version is other.
  EXPECT_EQ(decode_levels(corrupted(12), kGroom).error, LevelFileError::other_version);
  // The specs are other.
  EXPECT_EQ(decode_levels(corrupted(16), kGroom).error, LevelFileError::other_version);
  EXPECT_EQ(decode_levels(corrupted(111), kGroom).error, LevelFileError::other_version);
  // The hash of the groom is other, then the number of payload bytes, then the checksum.
  EXPECT_EQ(decode_levels(corrupted(112), kGroom).error, LevelFileError::other_groom);
  EXPECT_EQ(decode_levels(corrupted(144), kGroom).error, LevelFileError::damaged);
  EXPECT_EQ(decode_levels(corrupted(152), kGroom).error, LevelFileError::damaged);
  EXPECT_EQ(decode_levels(bytes_, GroomHash{9}).error, LevelFileError::other_groom);
  EXPECT_EQ(decode_levels(Bytes(4096, 0), kGroom).error, LevelFileError::not_a_level_file);
}

TEST_F(LevelFile, with_any_bit_flipped_is_refused) {
  std::mt19937 random(1);
  for (int n = 0; n < 500; ++n) {
    Bytes bytes = bytes_;
    bytes[random() % bytes.size()] ^= static_cast<std::uint8_t>(1u << random() % 8);
    const DecodedLevels decoded = decode_levels(bytes, kGroom);
    ASSERT_NE(decoded.error, LevelFileError::none);
    ASSERT_FALSE(decoded.levels);
  }
}

// A file with a right checksum may still be wrong, when its writer was. Each of 3000 damaged files must be refused, or
// give levels that a solver may run.
TEST_F(LevelFile, damaged_with_a_right_checksum_never_gives_an_invalid_level) {
  // These words are the limits of 16 and 32 bits, and the floats NaN (0x7FC00000) and infinity (0x7F800000).
  static constexpr std::array<std::uint32_t, 9> kNasty{0,          1,          4,          0xFFFF,    0x7FFFFFFF,
                                                       0x80000000, 0xFFFFFFFF, 0x7FC00000, 0x7F800000};
  std::mt19937 random(2);
  int accepted = 0, refused = 0;
  for (int n = 0; n < 3000; ++n) {
    Bytes bytes = bytes_;
    for (std::size_t change = 1 + random() % 3; change > 0; --change) {
      // FlatBuffers keep the few tables and offsets at both ends of the file. Half of the changes fall anywhere, a
      // quarter in the first 600 bytes of the payload, and a quarter in the last 600.
      const std::size_t span = n % 2 ? bytes.size() - kLevelFileHeaderBytes : 600;
      std::size_t at = kLevelFileHeaderBytes + random() % span;
      if (n % 4 == 2) at = bytes.size() - 1 - random() % span;
      if (random() % 2) {
        bytes[at] ^= static_cast<std::uint8_t>(1u << random() % 8);
      } else {
        const std::uint32_t word = kNasty[random() % kNasty.size()];
        at = std::min(at / 4 * 4, bytes.size() - 4);
        std::memcpy(bytes.data() + at, &word, 4);
      }
    }
    set_level_file_checksum(bytes);
    const DecodedLevels decoded = decode_levels(bytes, kGroom);
    (decoded.error == LevelFileError::none ? accepted : refused)++;
    ASSERT_EQ(decoded.error == LevelFileError::none, decoded.levels != nullptr);
    if (!decoded.levels) {
      ASSERT_EQ(decoded.error, LevelFileError::invalid);
      ASSERT_FALSE(decoded.detail.empty());
      continue;
    }
    for (std::size_t i = 0; i < kLevelSpecs.size(); ++i) {
      ASSERT_EQ(validate(decoded.levels->levels[i]), "") << "mutation " << n;
      ASSERT_EQ(decoded.levels->levels[i].geometry.lattice.dims, kLevelSpecs[i].dims);
    }
  }
  EXPECT_GT(accepted, 30) << "too wild to reach the validation of values";
  EXPECT_GT(refused, 30) << "hardly a mutation is refused";
}

}  // namespace
}  // namespace hairnet::wire
