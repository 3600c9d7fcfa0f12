#include <gmock/gmock.h>

#include "client/assets/import/placement.hpp"
#include "client/assets/import/strands.hpp"
#include "client/assets/import/usd_crate.hpp"
#include "tests/support/import_files.hpp"
#include "tests/support/usd_crate_writer.hpp"

namespace hairnet {
namespace {

using test::CrateWriter;
using testing::Contains;
using testing::Each;
using testing::ElementsAre;
using testing::HasSubstr;

Result<ImportedStrands> decode(std::string_view text) {
  // A vector of exactly this size, so that reading past it shows under the sanitizer.
  const std::vector<char> bytes(text.begin(), text.end());
  return decode_usd_curves(std::as_bytes(std::span(bytes)));
}

std::string refusal(std::string_view text) {
  const auto strands = decode(text);
  return strands ? std::string() : strands.error();
}

// Makes a binary USD file with 16 lines of two points, which are enough for their counts to be packed. The lines are
// below a prim with transforms, in a variant, and their colours and widths are stored in the ways that each version
// has.
std::string hair_file(int minor, const std::string& selected = "long") {
  CrateWriter crate(minor);
  const std::string selection =
      test::in_bytes(1, 8) + test::in_bytes(crate.string("style"), 4) + test::in_bytes(crate.string(selected), 4);
  // add() takes the depth in the tree, the name, whether it is an attribute, and its fields. Numbers such as 9 or 42
  // are types of the crate format (usd_crate_writer.hpp).
  crate.add(0, "", false,
            {{"upAxis", crate.token_value("Z")},
             {"metersPerUnit", crate.stored(9, test::in_bytes(std::bit_cast<std::uint64_t>(0.01), 8))}});
  crate.add(1, "head", false,
            {{"specifier", CrateWriter::inlined(42, 0)},
             {"typeName", crate.token_value("Xform")},
             {"variantSelection", crate.stored(45, selection)}});
  // The value (1, 2, 3) is inlined as three bytes of small whole numbers.
  crate.add(
      2, "xformOp:translate", true,
      {{"typeName", crate.token_value("double3")},
       {"timeSamples", crate.samples({{1, CrateWriter::inlined(23, 0x030201)}, {2, CrateWriter::inlined(23, 0)}})}});
  crate.add(
      2, "xformOp:orient", true,
      {{"typeName", crate.token_value("quatf")}, {"default", crate.stored(17, CrateWriter::floats({0, 0, 1, 0}))}});
  crate.add(2, "xformOp:scale", true, {{"default", crate.stored(24, CrateWriter::floats({2, 2, 0.5f}))}});
  crate.add(2, "xformOp:transform", true, {{"default", CrateWriter::inlined(15, 0x01010101)}});
  crate.add(2, "xformOpOrder", true,
            {{"default", crate.tokens({"xformOp:translate", "xformOp:orient", "xformOp:scale", "xformOp:transform"})}});
  crate.add(2, "{style=long}", false, {});
  crate.add(3, "hair", false,
            {{"specifier", CrateWriter::inlined(42, 0)}, {"typeName", crate.token_value("BasisCurves")}});
  crate.add(4, "type", true, {{"default", crate.token_value("linear")}});
  crate.add(4, "curveVertexCounts", true, {{"default", crate.integers(std::vector<std::int64_t>(16, 2))}});
  std::vector<float> points;
  for (int i = 0; i < 16; ++i)
    points.insert(points.end(), {static_cast<float>(i), 0, 0, static_cast<float>(i), 0.5f, 0});
  crate.add(4, "points", true, {{"default", crate.array(24, 32, CrateWriter::floats(points))}});
  const std::string table = test::in_bytes(2, 4) + CrateWriter::floats({0.25f, 4});
  const std::vector<std::int64_t> entries{0, 1, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 1};
  const std::uint64_t widths =
      minor < 6 ? crate.array(8, 16,
                              CrateWriter::floats({0.25f, 4, 0.25f, 0.25f, 0.25f, 0.25f, 0.25f, 0.25f, 0.25f, 0.25f,
                                                   0.25f, 0.25f, 0.25f, 0.25f, 0.25f, 4}))
                : crate.array(8, 16, 't' + table + test::packed_integers(entries), true);
  crate.add(4, "widths", true, {{"default", widths}, {"interpolation", crate.token_value("uniform")}});
  crate.add(4, "primvars:displayColor", true,
            {{"default", crate.array(25, 1, test::in_bytes(0x3c00, 2) + test::in_bytes(0, 4))}});
  crate.add(1, "body", false, {{"specifier", CrateWriter::inlined(42, 0)}, {"typeName", crate.token_value("Mesh")}});
  crate.add(2, "points", true, {{"default", crate.array(24, 1, CrateWriter::floats({1, 2, 3}))}});
  return crate.file();
}

TEST(ImportUsdCrate, reads_curves_of_every_version) {
  for (int minor = 4; minor <= 10; ++minor) {
    const auto strands = decode(hair_file(minor));
    ASSERT_TRUE(strands) << minor << ": " << strands.error();
    EXPECT_EQ(strands->strand_count(), 16u);
    EXPECT_EQ(strands->up, Axis::plus_z);
    EXPECT_EQ(strands->unit_m, 0.01);
    // The last point, (15, 0.5, 0), is scaled by (2, 2, 0.5), turned by half a turn about z, and shifted by (1, 2, 3).
    EXPECT_LT((strands->points[31] - Vec3f(1 - 30, 2 - 1, 3)).norm(), 1e-5f) << strands->points[31].transpose();
    // Widths grow with the cube root of the volume: 2 times 2 times 0.5.
    const float scale = std::cbrt(2.0f);
    EXPECT_NEAR(strands->widths[1], 0.25f * scale, 1e-5f);
    EXPECT_NEAR(strands->widths[3], 4 * scale, 1e-5f);
    EXPECT_THAT(strands->colours, Each(Vec3f(1, 0, 0)));
    EXPECT_THAT(strands->doubts, testing::IsEmpty());
  }
}

TEST(ImportUsdCrate, other_versions_are_refused_with_what_to_do) {
  // The reader knows the versions 0.4 to 0.10.
  for (const int minor : {0, 3, 11, 255}) EXPECT_THAT(refusal(hair_file(minor)), HasSubstr("usdcat")) << minor;
}

TEST(ImportUsdCrate, a_variant_that_is_not_selected_is_told) {
  EXPECT_THAT(refusal(hair_file(8, "short")), HasSubstr("variants with curves are not selected: long"));
}

TEST(ImportUsdCrate, an_archive_holds_it_too) {
  const std::string crate = hair_file(8);
  // A .usdz file is a zip archive whose files are stored without compression.
  const std::string header = "PK\3\4" + test::in_bytes(20, 2) + test::in_bytes(0, 12) +
                             test::in_bytes(crate.size(), 4) + test::in_bytes(crate.size(), 4) + test::in_bytes(8, 2) +
                             test::in_bytes(2, 2) + "hair.usd" + "xx";
  EXPECT_EQ(decode(header + crate)->strand_count(), 16u);
  for (std::size_t length = 0; length < header.size() + crate.size(); length += 7)
    EXPECT_NE(refusal((header + crate).substr(0, length)), "") << length << " bytes";
}

TEST(ImportUsdCrate, every_truncation_is_refused_and_every_damage_refused_or_valid) {
  const std::string whole = hair_file(8);
  for (std::size_t length = 0; length < whole.size(); ++length)
    EXPECT_NE(refusal(whole.substr(0, length)), "") << length << " bytes";
  for (std::size_t at = 0; at < whole.size(); ++at) {
    for (const int changed : {0x01, 0x40, 0x80, 0xff}) {
      std::string text = whole;
      text[at] = static_cast<char>(text[at] ^ changed);
      const auto strands = decode(text);
      if (!strands) {
        EXPECT_NE(strands.error(), "");
        continue;
      }
      EXPECT_EQ(strands->strand_begin.back(), strands->points.size());
      for (const Vec3f& x : strands->points) EXPECT_TRUE(x.allFinite());
    }
  }
}

TEST(ImportUsdCrate, a_real_file_is_the_same_as_its_text) {
  const std::filesystem::path folder = test::shared_data() / "import/usd";
  if (!std::filesystem::exists(folder)) GTEST_SKIP() << "no files at " << folder;
  const auto binary = decode(test::file_text(folder / "blender283_hair_10.usdc"));
  const auto text = decode(test::file_text(folder / "blender283_hair_10.usda"));
  ASSERT_TRUE(binary) << binary.error();
  EXPECT_EQ(binary->strand_begin, text->strand_begin);
  for (std::size_t i = 0; i < text->points.size(); ++i) EXPECT_LT((binary->points[i] - text->points[i]).norm(), 1e-6f);
  EXPECT_EQ(binary->up, text->up);
  EXPECT_EQ(binary->unit_m, text->unit_m);
}

}  // namespace
}  // namespace hairnet
