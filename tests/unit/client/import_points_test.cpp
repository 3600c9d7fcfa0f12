#include <gmock/gmock.h>

#include <string>

#include "client/assets/import/edge_chains.hpp"
#include "client/assets/import/strands.hpp"
#include "schema/bytes/deflate.hpp"
#include "tests/support/import_files.hpp"

// Strands as points in text and arrays: .ply, .npy, .npz and the text of TressFX 2.
namespace hairnet {
namespace {

using testing::Contains;
using testing::ElementsAre;
using testing::HasSubstr;
using testing::IsEmpty;

using Decode = Result<ImportedStrands> (*)(std::span<const std::byte>);

Result<ImportedStrands> decode(Decode function, std::string_view text) {
  // A vector of exactly this size, so that reading past it shows under the sanitizer.
  const std::vector<char> bytes(text.begin(), text.end());
  return function(std::as_bytes(std::span(bytes)));
}

std::string refusal(Decode function, std::string_view text) {
  const auto strands = decode(function, text);
  return strands ? std::string() : strands.error();
}

ImportedStrands strands_of_file(Decode function, std::string_view text) {
  auto strands = decode(function, text);
  EXPECT_TRUE(strands) << strands.error();
  return strands ? std::move(*strands) : ImportedStrands{};
}

std::string little_endian(std::uint64_t value, int bytes) {
  std::string text;
  for (int i = 0; i < bytes; ++i, value >>= 8) text.push_back(static_cast<char>(value));
  return text;
}

std::string number(float value, bool is_big) {
  std::string text = little_endian(std::bit_cast<std::uint32_t>(value), 4);
  if (is_big) std::ranges::reverse(text);
  return text;
}

void expect_valid(const ImportedStrands& strands) {
  EXPECT_EQ(strands.strand_begin.back(), strands.points.size());
  EXPECT_TRUE(std::ranges::is_sorted(strands.strand_begin));
  for (const Vec3f& x : strands.points) EXPECT_TRUE(x.allFinite());
  EXPECT_TRUE(strands.colours.empty() || strands.colours.size() == strands.points.size());
}

void expect_refused_or_valid_with_any_byte_changed(Decode function, const std::string& whole) {
  for (std::size_t at = 0; at < whole.size(); ++at) {
    // These are bytes that mean something in the formats: zero, tab, line end, space, minus, a digit, a letter, and
    // limits of signed and unsigned bytes.
    for (const int changed : {0, 1, 9, 10, 32, 45, 57, 65, 127, 128, 255}) {
      std::string text = whole;
      text[at] = static_cast<char>(changed);
      const auto strands = decode(function, text);
      if (strands) {
        expect_valid(*strands);
      } else {
        EXPECT_NE(strands.error(), "");
      }
    }
  }
}

TEST(EdgeChains, edges_in_any_order_and_direction_become_chains) {
  const std::vector<std::array<std::uint32_t, 2>> edges{{2, 1}, {5, 4}, {0, 1}, {2, 3}};
  const Chains chains = chain_edges(edges, 6);
  ASSERT_EQ(chains.count(), 2u);
  EXPECT_THAT(chains.vertices, ElementsAre(4, 5, 0, 1, 2, 3));
}

TEST(EdgeChains, where_three_meet_the_third_begins_another_chain_and_rings_are_cut_open) {
  const std::vector<std::array<std::uint32_t, 2>> fork{{0, 1}, {1, 2}, {1, 3}};
  EXPECT_THAT(chain_edges(fork, 4).vertices, ElementsAre(0, 1, 2, 1, 3));
  const std::vector<std::array<std::uint32_t, 2>> ring{{0, 1}, {1, 2}, {2, 0}, {3, 3}};
  EXPECT_THAT(chain_edges(ring, 4).vertices, ElementsAre(3, 3, 0, 1, 2, 0));
  EXPECT_EQ(chain_edges({}, 0).count(), 0u);
}

const std::string kFourVertices =
    "ply\nformat ascii 1.0\nelement vertex 4\nproperty float x\nproperty float y\nproperty float z\n";
const std::string kFourRows = "0 0 0\n1 0 0\n0 2 0\n0 3 0\n";

TEST(ImportPly, edges_join_vertices_to_strands) {
  const ImportedStrands strands = strands_of_file(
      decode_ply, kFourVertices +
                      "comment made\nelement edge 2\nproperty int vertex1\nproperty int vertex2\nproperty "
                      "uchar red\nend_header\n" +
                      kFourRows + "3 2 9\n0 1 9\n");
  EXPECT_THAT(strands.strand_begin, ElementsAre(0, 2, 4));
  EXPECT_EQ(strands.points[0], Vec3f(0, 2, 0));
  EXPECT_THAT(strands.doubts, IsEmpty());
}

std::string binary_ply(bool is_big) {
  std::string file =
      std::string("ply\nformat binary_") + (is_big ? "big" : "little") +
      "_endian 1.0\nelement vertex 4\nproperty float x\nproperty float y\nproperty float z\nproperty uchar red\n"
      "property uchar green\nproperty uchar blue\nproperty uint8 strand_id\nend_header\n";
  for (const int i : {0, 1, 2, 3}) {
    for (const float x : {static_cast<float>(i), 0.5f, -2.0f}) file += number(x, is_big);
    file += std::string{'\xff', '\0', '\x33'} + static_cast<char>(i % 2);
  }
  return file;
}

TEST(ImportPly, a_number_at_each_vertex_tells_its_strand) {
  for (const bool is_big : {false, true}) {
    const ImportedStrands strands = strands_of_file(decode_ply, binary_ply(is_big));
    EXPECT_THAT(strands.strand_begin, ElementsAre(0, 2, 4));
    EXPECT_EQ(strands.points[1], Vec3f(2, 0.5f, -2));
    ASSERT_EQ(strands.colours.size(), 4u);
    EXPECT_LT((strands.colours[0] - Vec3f(1, 0, 0.2f)).norm(), 1e-6f);
  }
}

TEST(ImportPly, strands_may_be_lists_of_vertices_or_numbers_of_points) {
  const ImportedStrands lists = strands_of_file(
      decode_ply, kFourVertices + "element strand 2\nproperty list uchar int vertex_indices\nend_header\n" + kFourRows +
                      "3 3 2 1\n2 0 1\n");
  EXPECT_THAT(lists.strand_begin, ElementsAre(0, 3, 5));
  EXPECT_EQ(lists.points[0], Vec3f(0, 3, 0));
  const std::string counts = kFourVertices + "element strand 2\nproperty int num_points\nend_header\n" + kFourRows;
  EXPECT_THAT(strands_of_file(decode_ply, counts + "2\n2\n").strand_begin, ElementsAre(0, 2, 4));
  EXPECT_THAT(refusal(decode_ply, counts + "2\n3\n"), HasSubstr("5 points, and there are 4"));
  EXPECT_THAT(refusal(decode_ply, counts + "2\n-3\n"), HasSubstr("no whole number"));
}

TEST(ImportPly, points_alone_are_strands_of_as_many_points_as_make_the_jumps) {
  std::string file =
      "ply\nformat ascii 1.0\nelement vertex 500\nproperty float x\nproperty float y\nproperty float z\n"
      "property float nx\nend_header\n";
  for (int i = 0; i < 500; ++i)
    // Five strands of 100 points stand 0.1 apart, and their points follow each other every 0.01, so jumps come after
    // every 100.
    file += std::to_string(0.1 * (i / 100)) + " " + std::to_string(0.01 * (i % 100)) + " 0 0\n";
  const ImportedStrands strands = strands_of_file(decode_ply, file);
  EXPECT_THAT(strands.strand_begin, ElementsAre(0, 100, 200, 300, 400, 500));
  EXPECT_THAT(strands.doubts, Contains(HasSubstr("of 100 points each")));
}

TEST(ImportPly, what_has_no_strands_says_what_it_has) {
  EXPECT_THAT(refusal(decode_ply, kFourVertices + "end_header\n" + kFourRows), HasSubstr("without edges"));
  EXPECT_EQ(refusal(decode_ply, kFourVertices + "element face 1\nproperty list uchar int vertex_indices\nend_header\n" +
                                    kFourRows + "3 0 1 2\n"),
            "no strands: it has a mesh of 1 face");
}

// The counts overflow 32 or 64 bits, or need more bytes than the file has.
TEST(ImportPly, counts_that_do_not_fit_and_indices_of_no_vertex_are_refused) {
  for (const char* count : {"5", "4294967296", "18446744073709551615", "99999999999999999999", "-1"}) {
    const std::string file = "ply\nformat binary_little_endian 1.0\nelement vertex " + std::string(count) +
                             "\nproperty float x\nproperty float y\nproperty float z\nend_header\n" +
                             std::string(48, '\0');
    EXPECT_NE(refusal(decode_ply, file), "") << count;
  }
  EXPECT_THAT(refusal(decode_ply, "ply\nformat ascii 1.0\nelement nothing 99999999\nend_header\n1\n"),
              HasSubstr("truncated"));
  for (const char* edge : {"0 4", "-1 0", "0.5 1", "nan 1", "x 1"})
    EXPECT_NE(
        refusal(decode_ply, kFourVertices + "element edge 1\nproperty int vertex1\nproperty int vertex2\nend_header\n" +
                                kFourRows + edge + "\n"),
        "")
        << edge;
  EXPECT_NE(
      refusal(decode_ply, kFourVertices + "element strand 1\nproperty list uint int vertex_indices\nend_header\n" +
                              kFourRows + "4000000000 1\n"),
      "");
}

TEST(ImportPly, damage_is_refused_with_a_reason) {
  for (const bool is_big : {false, true}) {
    const std::string whole = binary_ply(is_big);
    for (std::size_t length = 0; length < whole.size(); ++length)
      EXPECT_NE(refusal(decode_ply, whole.substr(0, length)), "") << length << " bytes";
    expect_refused_or_valid_with_any_byte_changed(decode_ply, whole);
  }
}

std::string npy(const std::string& type, const std::string& shape, const std::string& values, bool is_fortran = false) {
  const std::string header = "{'descr': '" + type + "', 'fortran_order': " + (is_fortran ? "True" : "False") +
                             ", 'shape': (" + shape + "), }\n";
  return std::string("\x93NUMPY\1\0", 8) + little_endian(header.size(), 2) + header + values;
}

// Returns the numbers 0 to 11. As two strands of two points these are (0, 1, 2), (3, 4, 5) and (6, 7, 8), (9, 10, 11).
std::string twelve(bool is_big = false) {
  std::string values;
  for (int i = 0; i < 12; ++i) values += number(static_cast<float>(i), is_big);
  return values;
}

TEST(ImportNpy, reads_arrays_of_strands_points_and_coordinates) {
  for (const std::string& file :
       {npy("<f4", "2, 2, 3", twelve()), npy(">f4", "2, 2, 3", twelve(true)), npy("<f4", "1, 2, 2, 3", twelve())}) {
    const ImportedStrands strands = strands_of_file(decode_npy, file);
    EXPECT_THAT(strands.strand_begin, ElementsAre(0, 2, 4));
    EXPECT_EQ(strands.points[3], Vec3f(9, 10, 11));
  }
  std::string doubles, halves;
  for (int i = 0; i < 12; ++i) doubles += little_endian(std::bit_cast<std::uint64_t>(static_cast<double>(i)), 8);
  EXPECT_EQ(strands_of_file(decode_npy, npy("<f8", "2, 2, 3", doubles)).points[3], Vec3f(9, 10, 11));
  // As half floats these are 0, 1, -2, 0.5, the greatest number and the smallest above zero.
  for (const std::uint64_t half : {0x0000, 0x3c00, 0xc000, 0x3800, 0x7bff, 0x0001}) halves += little_endian(half, 2);
  const ImportedStrands of_halves = strands_of_file(decode_npy, npy("<f2", "1, 2, 3", halves));
  EXPECT_EQ(of_halves.points[0], Vec3f(0, 1, -2));
  EXPECT_EQ(of_halves.points[1], Vec3f(0.5f, 65'504, 0x1p-24f));
}

TEST(ImportNpy, an_array_by_columns_is_turned) {
  const ImportedStrands strands = strands_of_file(decode_npy, npy("<f4", "2, 2, 3", twelve(), true));
  // Strand s, point p, coordinate a is number s + 2 p + 4 a.
  EXPECT_EQ(strands.points[1], Vec3f(2, 6, 10));
  EXPECT_EQ(strands.points[2], Vec3f(1, 5, 9));
}

TEST(ImportNpy, strands_filled_up_with_nan_end_before_it) {
  const std::string nan = number(NAN, false) + number(NAN, false) + number(NAN, false);
  // Both strands have two points, and a third one of NaN, since an array has rows of one length.
  const std::string padded = twelve().substr(0, 24) + nan + twelve().substr(24) + nan;
  const ImportedStrands shorter = strands_of_file(decode_npy, npy("<f4", "2, 3, 3", padded));
  EXPECT_THAT(shorter.strand_begin, ElementsAre(0, 2, 4));
  EXPECT_THAT(shorter.notes, Contains(HasSubstr("2 strands filled up with nan")));
}

TEST(ImportNpy, other_arrays_are_refused_with_what_they_are) {
  EXPECT_THAT(refusal(decode_npy, npy("|O", "2,", "")), HasSubstr("Python objects"));
  EXPECT_THAT(refusal(decode_npy, npy("<f4", "4, 3", twelve())), HasSubstr("<f4 (4, 3)"));
  EXPECT_THAT(refusal(decode_npy, npy("<i4", "2, 2, 3", twelve())), HasSubstr("<i4 (2, 2, 3)"));
  for (const char* shape : {"3, 2, 3", "18446744073709551615, 18446744073709551615, 3", "4294967296, 4294967296, 3",
                            "0, 2, 3", "2, x, 3", "-1, 2, 3", "99999999999999999999, 2, 3"})
    EXPECT_NE(refusal(decode_npy, npy("<f4", shape, twelve())), "") << shape;
}

// Makes a zip archive of these arrays, as NumPy writes one: stored, or packed by deflate.
std::string npz(const std::vector<std::pair<std::string, std::string>>& files, bool is_packed) {
  std::string archive, directory;
  for (const auto& [name, content] : files) {
    std::string packed = content;
    if (is_packed) {
      const std::span<const std::uint8_t> bytes(reinterpret_cast<const std::uint8_t*>(content.data()), content.size());
      const auto stream = bytes::deflated(bytes, bytes::PackEffort::most);
      packed.assign(stream.begin(), stream.end());
    }
    // These fields stand in both kinds of header of a zip archive: version 2.0, flags, the method (8 is deflate),
    // time, date and checksum (all 0), packed size, size, and the length of the name.
    const std::string about = little_endian(20, 2) + little_endian(0, 2) + little_endian(is_packed ? 8 : 0, 2) +
                              little_endian(0, 8) + little_endian(packed.size(), 4) + little_endian(content.size(), 4) +
                              little_endian(name.size() + 4, 2);
    directory += "PK\1\2" + little_endian(20, 2) + about + little_endian(0, 12) + little_endian(archive.size(), 4) +
                 name + ".npy";
    archive += "PK\3\4" + about + little_endian(0, 2) + name + ".npy" + packed;
  }
  const std::string end = "PK\5\6" + little_endian(0, 4) + little_endian(files.size(), 2) +
                          little_endian(files.size(), 2) + little_endian(directory.size(), 4) +
                          little_endian(archive.size(), 4) + little_endian(0, 2);
  return archive + directory + end;
}

TEST(ImportNpz, takes_the_array_of_strands_stored_or_packed) {
  for (const bool is_packed : {false, true}) {
    const ImportedStrands strands = strands_of_file(
        decode_npy,
        npz({{"root_uv", npy("<f4", "2, 2", twelve())}, {"positions", npy("<f4", "2, 2, 3", twelve())}}, is_packed));
    EXPECT_EQ(strands.points[3], Vec3f(9, 10, 11));
    EXPECT_THAT(strands.notes, Contains(HasSubstr("is positions")));
  }
  EXPECT_EQ(strands_of_file(decode_npy, npz({{"anything", npy("<f4", "2, 2, 3", twelve())}}, true)).strand_count(), 2u);
}

TEST(ImportNpz, positions_and_strand_begin_make_strands_of_any_number_of_points) {
  std::string begins;
  // The strands have one point, none, and three.
  for (const std::uint64_t begin : {0, 1, 1, 4}) begins += little_endian(begin, 4);
  const auto with = [&](const std::string& points, const std::string& numbers) {
    return npz({{"frames", npy("<f4", "1, 4, 3", twelve())}, {"positions", points}, {"strand_begin", numbers}}, true);
  };
  const std::string points = npy("<f4", "4, 3", twelve());
  const ImportedStrands strands = strands_of_file(decode_npy, with(points, npy("<i4", "4,", begins)));
  // Strands of one point and of none are left out.
  EXPECT_THAT(strands.strand_begin, ElementsAre(0, 3));
  EXPECT_EQ(strands.points[0], Vec3f(3, 4, 5));
  for (const auto& [shape, reason] :
       {std::pair{"3,", "does not end"}, std::pair{"5,", "truncated"}, std::pair{"2, 2", "no points of"}})
    EXPECT_THAT(refusal(decode_npy, with(points, npy("<i4", shape, begins))), HasSubstr(reason));
  EXPECT_THAT(refusal(decode_npy, with(npy("<f4", "5, 3", twelve()), npy("<i4", "4,", begins))),
              HasSubstr("truncated"));
  for (const std::uint64_t wrong : {std::uint64_t{5}, ~std::uint64_t{0}}) {
    const std::string numbers = little_endian(0, 8) + little_endian(wrong, 8) + little_endian(4, 8);
    EXPECT_THAT(refusal(decode_npy, with(points, npy("<i8", "3,", numbers))), HasSubstr("which is not between 0 and"));
  }
  const std::string whole = with(points, npy("<u4", "4,", begins));
  for (std::size_t length = 0; length < whole.size(); ++length)
    EXPECT_NE(refusal(decode_npy, whole.substr(0, length)), "") << length << " bytes";
  expect_refused_or_valid_with_any_byte_changed(decode_npy, whole);
}

TEST(ImportNpz, an_archive_without_strands_lists_its_arrays) {
  const std::string parameters =
      npz({{"theta", npy("<f4", "12,", twelve())}, {"beta", npy("<f4", "3, 4", twelve())}}, true);
  EXPECT_THAT(refusal(decode_npy, parameters), HasSubstr("theta <f4 (12), beta <f4 (3, 4)"));
  EXPECT_THAT(refusal(decode_npy, npz({}, false)), HasSubstr("no arrays"));
}

TEST(ImportNpz, damage_is_refused_with_a_reason) {
  for (const bool is_packed : {false, true}) {
    const std::string whole = npz({{"strands", npy("<f4", "2, 2, 3", twelve())}}, is_packed);
    for (std::size_t length = 0; length < whole.size(); ++length)
      EXPECT_NE(refusal(decode_npy, whole.substr(0, length)), "") << length << " bytes";
    expect_refused_or_valid_with_any_byte_changed(decode_npy, whole);
  }
  const std::string one = npy("<f4", "2, 2, 3", twelve());
  for (std::size_t length = 0; length < one.size(); ++length)
    EXPECT_NE(refusal(decode_npy, one.substr(0, length)), "") << length << " bytes";
  expect_refused_or_valid_with_any_byte_changed(decode_npy, one);
}

const std::string kTressfxText =
    "scale 1.0\r\nrotation 0 0 0\r\nnumFollowHairsPerGuideHair 4\r\nnumStrands 2\r\nis sorted 1\r\n"
    "strand 0 numVerts 2 texcoord 0.000000 0.522833\r\n0 1 2\r\n3 4.5 -5e-1\r\n"
    "strand 1 numVerts 3 texcoord 0.1 0.2\r\n1 1 1\r\n\r\n2 2 2\r\n3 3 3\r\n";

TEST(ImportTressfxText, reads_strands) {
  const ImportedStrands strands = strands_of_file(decode_tressfx, kTressfxText);
  EXPECT_THAT(strands.strand_begin, ElementsAre(0, 2, 5));
  EXPECT_EQ(strands.points[1], Vec3f(3, 4.5f, -0.5f));
}

// People edit such text files by hand, so the message must name the line.
TEST(ImportTressfxText, wrong_counts_and_lines_are_refused_with_their_place) {
  const auto with = [](const std::string& from, const std::string& to) {
    std::string text = kTressfxText;
    text.replace(text.find(from), from.size(), to);
    return refusal(decode_tressfx, text);
  };
  EXPECT_THAT(with("numStrands 2", "numStrands 3"), HasSubstr("says 3 strands, and has 2"));
  EXPECT_THAT(with("numStrands 2", "numStrands 4294967295"), HasSubstr("and has 2"));
  EXPECT_THAT(with("numStrands 2", "numStrands 1"), HasSubstr("line 9: more follows"));
  EXPECT_THAT(with("numVerts 2", "numVerts 1"), HasSubstr("line 8: expected strand 1"));
  EXPECT_THAT(with("numVerts 2", "numVerts 4000000000"), HasSubstr("line 9: a point needs 3 numbers"));
  EXPECT_THAT(with("numVerts 3", "numVerts 4"), HasSubstr("truncated in strand 1: 3 of 4 points"));
  EXPECT_THAT(with("4.5", "x"), HasSubstr("line 8"));
  EXPECT_THAT(with("numStrands 2", "numStrands"), HasSubstr("no line begins with numStrands"));
  for (std::size_t length = 0; length < kTressfxText.rfind(" 3\r\n"); ++length)
    EXPECT_NE(refusal(decode_tressfx, kTressfxText.substr(0, length)), "") << length << " bytes";
  expect_refused_or_valid_with_any_byte_changed(decode_tressfx, kTressfxText);
}

}  // namespace
}  // namespace hairnet
