#include <gmock/gmock.h>

#include <array>

#include "tests/support/import_files.hpp"
#include "tests/unit/client/decoded_alembic.hpp"

namespace hairnet::test {
namespace {

using testing::HasSubstr;

// Makes an archive with a part of every kind that the reader knows: transforms that move, knots, attributes, indices,
// texts and another object.
AbcBytes full_file() {
  AbcFile file;
  file.metadata_table = {"geoScope=con"};
  file.top.children = {xform("head", {0x13, 0x60, 0x30},
                             {{0, 2, 0, 30, 1, 0, 0, 0, 0, 1, 0, 0, 0, 0, 1, 0, 0, 0, 0, 1},
                              {1, 2, 0, 60, 1, 0, 0, 0, 0, 1, 0, 0, 0, 0, 1, 0, 0, 0, 0, 1}},
                             {curves("hair", {3, 3}, {row_of_strands(2), row_of_strands(2)}, kLinear,
                                     {attribute<float>("width", "con", {1})},
                                     {texts("groom_group_name", "uni", {"a", "b"}),
                                      attribute<std::int16_t>("groom_guide", "uni", {0, 1})}),
                              curves("knots", {4}, {{0, 0, 0, 0, 1, 0, 0, 2, 0, 1, 3, 0}}, kBspline,
                                     {numbers<float>(".knots", {{0, 0, 0, 0, 1, 1, 1, 1}}),
                                      indexed<float>("width", "vtx", {1, 2}, {0, 1, 0, 1})})}),
                       object_of("mesh", "AbcGeom_PolyMesh_v1")};
  return AbcWriter(file).write();
}

TEST(AlembicDamage, a_file_cut_at_any_byte_is_refused) {
  const AbcBytes whole = full_file();
  EXPECT_EQ(decoded(whole).strand_count(), 3u);
  for (std::size_t size = 0; size < whole.size(); ++size)
    EXPECT_NE(refusal(AbcBytes(whole.begin(), whole.begin() + static_cast<std::ptrdiff_t>(size))), "") << size;
}

// A changed byte may be in a count, an offset or a coordinate. Sanitizers find reads beyond the file.
TEST(AlembicDamage, any_changed_byte_is_refused_or_gives_valid_strands) {
  const AbcBytes whole = full_file();
  for (std::size_t at = 0; at < whole.size(); ++at) {
    for (const unsigned flip : {0x01u, 0x80u, 0xffu}) {
      AbcBytes changed = whole;
      changed[at] ^= static_cast<std::byte>(flip);
      const auto strands = decode_alembic(changed);
      if (strands) {
        expect_valid(*strands);
      } else {
        EXPECT_NE(strands.error(), "");
      }
      const auto motion = decode_alembic_motion(changed);
      EXPECT_TRUE(motion || !motion.error().empty());
    }
  }
}

// The counts are refused against the size of the file, before memory is taken for them.
TEST(AlembicDamage, absurd_counts_and_sizes_are_refused) {
  for (const std::uint64_t count :
       {std::uint64_t{3} << 30, ~std::uint64_t{0}, std::uint64_t{1} << 61, std::uint64_t{1} << 60}) {
    OgawaWriter group;
    const std::uint64_t at = group.group({0});
    group.set(at, count);
    EXPECT_THAT(refusal(group.finish(at)), HasSubstr("more than the file has room for"));
    OgawaWriter data;
    const std::array<std::byte, 8> bytes{};
    const std::uint64_t word = data.data(bytes);
    data.set(word & ~OgawaWriter::kEmptyData, count);
    const std::uint64_t root = data.group({word});
    EXPECT_THAT(refusal(data.finish(root)), HasSubstr("but the file ends after"));
    OgawaWriter outside;
    outside.group({0});
    EXPECT_THAT(refusal(outside.finish(count & ~OgawaWriter::kEmptyData)), HasSubstr("lies outside of the file"));
  }
}

TEST(AlembicDamage, groups_within_themselves_or_too_deep_are_refused) {
  OgawaWriter cycle;
  const std::uint64_t inner = cycle.group({0, 0}), root = cycle.group({inner});
  // The second entry of the inner group, behind its count and its first entry, becomes the group around it.
  cycle.set(inner + 16, root);
  EXPECT_THAT(refusal(cycle.finish(root)), HasSubstr("lies within itself"));
  OgawaWriter deep;
  std::uint64_t at = deep.group({OgawaWriter::kEmptyData});
  for (int i = 0; i < 300; ++i) at = deep.group({at});
  EXPECT_EQ(refusal(deep.finish(at)), "its groups lie within each other deeper than 256");
}

TEST(AlembicDamage, groups_that_share_children_do_not_multiply_work) {
  OgawaWriter bomb;
  std::uint64_t at = bomb.group({OgawaWriter::kEmptyData});
  // Each of 100 groups names the one below four times. A reader that follows every name would visit 4^100 groups.
  for (int i = 0; i < 100; ++i) at = bomb.group({at, at, at, at});
  const auto begin = std::chrono::steady_clock::now();
  EXPECT_THAT(refusal(bomb.finish(at)), HasSubstr("share more children"));
  EXPECT_LT(std::chrono::steady_clock::now() - begin, std::chrono::milliseconds(100));
}

// Builds a file whose many objects share one block of positions, which no writer needs to do. A reader that copies
// the block for each object would need a thousand times the file's size.
TEST(AlembicDamage, parts_that_share_bytes_do_not_multiply_memory) {
  AbcFile file;
  std::vector<float> many(30'000, 1.f);
  file.top.children = {curves("a", std::vector<std::int32_t>(10'000, 1), {many})};
  const AbcBytes once = AbcWriter(file).write();
  EXPECT_NE(refusal(once), "");
  // All blocks of a thousand small objects are made to be the largest block of the file.
  file.top.children.resize(1000, row("b", 1));
  AbcBytes bytes = AbcWriter(file).write();
  std::uint64_t largest = 0, large_size = 0;
  const auto word_at = [&](std::size_t i) {
    std::uint64_t word = 0;
    for (std::size_t b = 8; b-- > 0;) word = word << 8 | std::to_integer<std::uint64_t>(bytes[i + b]);
    return word;
  };
  for (std::size_t i = 16; i + 8 < bytes.size(); ++i) {
    // A block begins with its size: 4 bytes for each float, and a key of 16 bytes.
    if (word_at(i) == 4 * many.size() + 16) largest = i, large_size = word_at(i);
  }
  ASSERT_GT(large_size, 0u);
  for (std::size_t i = 16; i + 8 < bytes.size(); ++i) {
    const std::uint64_t word = word_at(i);
    if ((word & OgawaWriter::kEmptyData) == 0 || (word & ~OgawaWriter::kEmptyData) >= bytes.size()) continue;
    // The positions of a small object are nine floats behind a key of 16 bytes.
    if (word_at(word & ~OgawaWriter::kEmptyData) != 4 * 9 + 16) continue;
    for (std::size_t b = 0; b < 8; ++b)
      bytes[i + b] = static_cast<std::byte>((largest | OgawaWriter::kEmptyData) >> (8 * b));
  }
  const auto begin = std::chrono::steady_clock::now();
  EXPECT_THAT(refusal(bytes), HasSubstr("share more bytes"));
  EXPECT_LT(std::chrono::steady_clock::now() - begin, std::chrono::seconds(2));
}

// A count of 4 billion samples must be refused by comparison with the file, before memory is taken for it.
TEST(AlembicDamage, samples_and_words_that_do_not_add_up_are_refused) {
  const auto with = [](auto change) {
    AbcObj hair = row("hair", 1);
    change(hair.properties[0].children[0]);
    return refusal({hair});
  };
  EXPECT_EQ(
      with([](AbcProp& p) { p.sample_count = 4'000'000'000, p.first_changed = 1, p.last_changed = 3'999'999'999; }),
      "damaged: there are 2 blocks of data of property P, which must be 8000000000");
  EXPECT_THAT(with([](AbcProp& p) { p.sample_count = 1, p.first_changed = 7, p.last_changed = 5; }),
              HasSubstr("do not add up"));
  EXPECT_THAT(with([](AbcProp& p) { p.type = 15; }), HasSubstr("there is no type 15"));
  EXPECT_THAT(with([](AbcProp& p) { p.times = 9; }), HasSubstr("there are no times of property P"));
  EXPECT_THAT(with([](AbcProp& p) { p.samples[0].resize(7); }), HasSubstr("1 curve can be read"));
  EXPECT_THAT(with([](AbcProp& p) { p.samples[0].push_back({}), p.samples[0].push_back({}); }), "");
}

}  // namespace
}  // namespace hairnet::test
