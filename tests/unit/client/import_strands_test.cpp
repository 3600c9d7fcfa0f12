#include <gmock/gmock.h>

#include <limits>
#include <numeric>
#include <utility>

#include "client/assets/import/strands.hpp"
#include "tests/support/case_name.hpp"
#include "tests/support/import_files.hpp"

namespace hairnet {
namespace {

using test::Bytes;
using testing::HasSubstr;

constexpr std::uint32_t kHuge = std::numeric_limits<std::uint32_t>::max();

struct Made {
  const char* name;
  StrandDecoder* decode;
  std::vector<std::byte> (*file)();
  std::vector<std::uint32_t> strand_begin;
  // A file that is cut before this is refused.
  std::size_t needed_bytes;

  friend void PrintTo(const Made& made, std::ostream* out) { *out << made.name; }
};

const std::vector<Made>& all_formats() {
  static const std::vector<Made> kMade{
      // The last 16 bytes of tressfx4_file() lie behind the points and are not read.
      {"yuksel", decode_yuksel_hair, test::yuksel_file, {0, 2, 3, 6}, test::yuksel_file().size()},
      {"tressfx3", decode_tressfx, test::tressfx3_file, {0, 3, 6}, test::tressfx3_file().size()},
      {"tressfx4", decode_tressfx, test::tressfx4_file, {0, 3, 6}, test::tressfx4_file().size() - 16},
      {"usc", decode_usc_data, test::usc_file, {0, 2, 3, 6}, test::usc_file().size()},
  };
  return kMade;
}

void expect_valid(const ImportedStrands& strands, std::size_t file_bytes) {
  ASSERT_FALSE(strands.strand_begin.empty());
  EXPECT_EQ(strands.strand_begin.front(), 0u);
  EXPECT_EQ(strands.strand_begin.back(), strands.points.size());
  EXPECT_TRUE(std::ranges::is_sorted(strands.strand_begin));
  EXPECT_TRUE(std::ranges::all_of(strands.points, [](const Vec3f& x) { return x.allFinite(); }));
  // Each point takes at least three floats of the file.
  EXPECT_LE(12 * strands.points.size(), file_bytes);
}

std::string refusal(StrandDecoder* decode, const std::vector<std::byte>& bytes) {
  const auto strands = decode(bytes);
  return strands ? std::string() : strands.error();
}

class ImportStrands : public testing::TestWithParam<Made> {};

TEST_P(ImportStrands, reads_strands_root_first) {
  const auto strands = GetParam().decode(GetParam().file());
  ASSERT_TRUE(strands) << strands.error();
  EXPECT_EQ(strands->strand_begin, GetParam().strand_begin);
  ASSERT_EQ(strands->points.size(), 6u);
  for (std::size_t i = 0; i < 6; ++i) {
    const auto x = static_cast<float>(i);
    EXPECT_EQ(strands->points[i], Vec3f(x, -0.5f * x, 100 + x));
  }
}

TEST_P(ImportStrands, refuses_every_truncation_with_a_reason) {
  const std::vector<std::byte> whole = GetParam().file();
  for (std::size_t length = 0; length < GetParam().needed_bytes; ++length) {
    // A vector of exactly this size, so that reading past it shows under the sanitizer.
    const std::vector<std::byte> cut(whole.begin(), whole.begin() + static_cast<std::ptrdiff_t>(length));
    EXPECT_NE(refusal(GetParam().decode, cut), "") << length << " bytes";
  }
}

TEST_P(ImportStrands, any_corrupt_byte_is_refused_or_gives_finite_points) {
  const std::vector<std::byte> whole = GetParam().file();
  for (std::size_t at = 0; at < whole.size(); ++at) {
    // These flips change the lowest and highest bits, signs, and whole bytes.
    for (const int flip : {0x01, 0x02, 0x10, 0x40, 0x7f, 0x80, 0xff}) {
      std::vector<std::byte> bytes = whole;
      bytes[at] ^= static_cast<std::byte>(flip);
      const auto strands = GetParam().decode(bytes);
      if (strands) {
        expect_valid(*strands, bytes.size());
      } else {
        EXPECT_NE(strands.error(), "");
      }
    }
  }
}

TEST_P(ImportStrands, refuses_a_coordinate_that_is_not_finite_and_names_its_place) {
  for (const float bad : {std::numeric_limits<float>::quiet_NaN(), std::numeric_limits<float>::infinity(),
                          -std::numeric_limits<float>::infinity()}) {
    std::vector<std::byte> bytes = GetParam().file();
    // The second point's x is 1; no other 4 aligned bytes before it are.
    std::size_t at = 0;
    const auto is_one = [&](std::size_t i) {
      float value = 0, next = 0;
      std::memcpy(&value, &bytes[i], 4);
      std::memcpy(&next, &bytes[i + 4], 4);
      return value == 1.0f && next == -0.5f;
    };
    while (at + 8 <= bytes.size() && !is_one(at)) ++at;
    ASSERT_LE(at + 8, bytes.size());
    std::memcpy(&bytes[at], &bad, 4);
    EXPECT_THAT(refusal(GetParam().decode, bytes), HasSubstr("strand 0, point 1"));
  }
}

TEST_P(ImportStrands, refuses_empty_input_and_other_formats) {
  EXPECT_NE(refusal(GetParam().decode, {}), "");
  for (const Made& other : all_formats()) {
    if (other.decode == GetParam().decode) continue;
    EXPECT_NE(refusal(GetParam().decode, other.file()), "") << other.name;
  }
}

INSTANTIATE_TEST_SUITE_P(AllFormats, ImportStrands, testing::ValuesIn(all_formats()), support::CaseName());

// These counts would take 4 GiB and more if the reader believed them. The allocation would then fail under the
// sanitizer.
TEST(ImportStrandsCounts, absurd_counts_are_refused_in_every_field) {
  for (const auto& [strands, points] : {std::pair{kHuge, kHuge}, std::pair{kHuge, 1u}, std::pair{1u, kHuge},
                                        std::pair{0x10000u, 0x10000u}, std::pair{0x80000000u, 2u}}) {
    // The bits of `arrays` name the arrays of the file; 31 is all five of them.
    for (std::uint32_t arrays = 2; arrays < 32; ++arrays) {
      for (const std::uint32_t segments : {0u, 1u, kHuge}) {
        EXPECT_NE(refusal(decode_yuksel_hair, test::yuksel_header(strands, points, arrays, segments).zeros(64).take()),
                  "");
      }
    }
    // The points begin right behind the header, at 148 in version 3 and at 160 in version 4.
    EXPECT_NE(refusal(decode_tressfx, test::tressfx3_header(strands, points, 148).zeros(64).take()), "");
    EXPECT_NE(refusal(decode_tressfx, test::tressfx4_header(strands, points, 160).zeros(64).take()), "");
    EXPECT_NE(refusal(decode_usc_data, Bytes().u32(strands).u32(points).zeros(64).take()), "");
    EXPECT_NE(refusal(decode_usc_data, Bytes().u32(1).u32(points | 1u << 31).zeros(64).take()), "");
  }
  // These offsets are inside the header, or leave no room for a point in the file.
  for (const std::uint32_t offset : {0u, 100u, 250u, kHuge, kHuge - 3}) {
    EXPECT_NE(refusal(decode_tressfx, test::tressfx3_header(1, 1, offset).zeros(64).take()), "") << offset;
    EXPECT_NE(refusal(decode_tressfx, test::tressfx4_header(1, 1, offset).zeros(64).take()), "") << offset;
  }
}

TEST(ImportStrandsCounts, refuses_files_without_strands_or_points) {
  EXPECT_NE(refusal(decode_yuksel_hair, test::yuksel_header(0, 0, 2, 0).take()), "");
  // This header has one strand of one point, but the bit of the points (2) is not set.
  EXPECT_NE(refusal(decode_yuksel_hair, test::yuksel_header(1, 1, 1, 0).u16(0).take()), "");
  EXPECT_NE(refusal(decode_tressfx, test::tressfx3_header(0, 3, 148).take()), "");
  EXPECT_NE(refusal(decode_tressfx, test::tressfx3_header(3, 0, 148).take()), "");
  EXPECT_NE(refusal(decode_usc_data, Bytes().u32(0).take()), "");
}

TEST(ImportYuksel, takes_the_default_segments_where_there_is_no_array) {
  // The header has 2 strands, 6 points, the array of points only, and 2 segments as the default.
  Bytes file = test::yuksel_header(2, 6, 2, 2);
  for (std::uint32_t i = 0; i < 6; ++i) file.point(i);
  const auto strands = decode_yuksel_hair(file.take());
  ASSERT_TRUE(strands) << strands.error();
  EXPECT_EQ(strands->strand_begin, (std::vector<std::uint32_t>{0, 3, 6}));
}

TEST(ImportYuksel, refuses_segments_that_do_not_make_the_points) {
  for (const int segments : {0, 2, 0xffff}) {
    const std::string reason =
        refusal(decode_yuksel_hair,
                test::yuksel_header(1, 2, 3, 0).u16(static_cast<std::uint16_t>(segments)).point(0).point(1).take());
    EXPECT_THAT(reason, HasSubstr("header says 2"));
  }
}

TEST(ImportTressfx, refuses_other_versions) {
  for (const float version : {0.0f, 2.0f, 3.5f, 5.0f, std::numeric_limits<float>::quiet_NaN()}) {
    std::vector<std::byte> bytes = test::tressfx4_file();
    std::memcpy(bytes.data(), &version, 4);
    EXPECT_THAT(refusal(decode_tressfx, bytes), HasSubstr("version"));
  }
}

TEST(ImportUsc, keeps_strands_without_points_and_refuses_what_follows_the_last) {
  const auto strands = decode_usc_data(Bytes().u32(2).u32(0).u32(1).point(7).take());
  ASSERT_TRUE(strands) << strands.error();
  EXPECT_EQ(strands->strand_begin, (std::vector<std::uint32_t>{0, 0, 1}));
  std::vector<std::byte> longer = test::usc_file();
  longer.push_back(std::byte{0});
  EXPECT_THAT(refusal(decode_usc_data, longer), HasSubstr("too long"));
}

struct Real {
  const char* file;
  StrandDecoder* decode;
  std::size_t strand_count, point_count;
  // The bounds that the data's own list states, to its digits; equal where the list states none.
  std::array<float, 3> low, high;
};

TEST(ImportRealStrands, counts_and_bounds_are_those_the_data_set_lists) {
  if (!std::filesystem::exists(test::shared_data() / "hair"))
    GTEST_SKIP() << "no real hairstyles at " << test::shared_data();
  const std::vector<Real> files{
      {"yuksel_straight/straight.hair",
       decode_yuksel_hair,
       10'000,
       160'000,
       {-32.5f, -33.9f, -22.7f},
       {30.9f, 24.1f, 63.7f}},
      {"amd_ponytail/back.tfx", decode_tressfx, 517, 8'272, {}, {}},
      {"amd_ponytail/front_top.tfx", decode_tressfx, 876, 14'016, {}, {}},
      {"amd_ponytail/side.tfx", decode_tressfx, 3'066, 49'056, {}, {}},
      {"amd_ponytail/tail.tfx", decode_tressfx, 474, 7'584, {}, {}},
      {"harolongo/harolongo.data", decode_usc_data, 7'905, 166'005, {-11.8f, -14.3f, -18.6f}, {10.5f, 14.2f, 4.6f}},
      {"sintel/SintelHairOriginal-sintel_hair.16points.tfx",
       decode_tressfx,
       11'400,
       182'400,
       {-0.116f, 1.396f, -0.130f},
       {0.103f, 1.675f, 0.133f}},
  };
  for (const Real& real : files) {
    const std::vector<std::byte> bytes = test::file_bytes(test::shared_data() / "hair" / real.file);
    const auto strands = real.decode(bytes);
    ASSERT_TRUE(strands) << real.file << ": " << strands.error();
    EXPECT_EQ(strands->strand_count(), real.strand_count) << real.file;
    EXPECT_EQ(strands->points.size(), real.point_count) << real.file;
    expect_valid(*strands, bytes.size());
    if (real.low == real.high) continue;
    Vec3f low = strands->points.front(), high = low;
    for (const Vec3f& x : strands->points) {
      low = low.cwiseMin(x);
      high = high.cwiseMax(x);
    }
    const float tolerance = 0.003f * (high - low).maxCoeff();
    EXPECT_LT((low - Vec3f(real.low.data())).cwiseAbs().maxCoeff(), tolerance) << real.file;
    EXPECT_LT((high - Vec3f(real.high.data())).cwiseAbs().maxCoeff(), tolerance) << real.file;
  }
}

}  // namespace
}  // namespace hairnet
