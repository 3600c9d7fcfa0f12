#include <gmock/gmock.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <cstddef>
#include <cstdint>
#include <cstdio>
#include <limits>
#include <string>
#include <vector>

#include "client/hairnet.h"

namespace {

using ::testing::AllOf;
using ::testing::EndsWith;
using ::testing::HasSubstr;
using ::testing::StartsWith;

struct NamedText {
  std::string name, text;
};

// What an import gives: a groom, or an error and its line of text.
struct Imported {
  hairnet_error code = HAIRNET_OK;
  std::string error, name, remarks;
  std::size_t strand_count = 0;
  std::vector<float> points;
};

Imported imported(const std::vector<NamedText>& texts, const hairnet_import_options* options = nullptr) {
  std::vector<hairnet_file> files;
  for (const NamedText& each : texts) files.push_back({each.name.c_str(), each.text.data(), each.text.size()});
  std::array<char, 512> error{};
  hairnet_groom* groom = nullptr;
  Imported out;
  out.code = hairnet_groom_import(files.data(), files.size(), options, &groom, error.data(), error.size());
  out.error = error.data();
  EXPECT_EQ(groom != nullptr, out.code == HAIRNET_OK);
  if (groom == nullptr) return out;
  out.name = hairnet_groom_name(groom);
  out.remarks = hairnet_groom_remarks(groom);
  out.strand_count = hairnet_groom_strand_count(groom);
  const float* points = hairnet_groom_points(groom);
  out.points.assign(points, points + 3 * hairnet_groom_point_count(groom));
  hairnet_groom_free(groom);
  return out;
}

struct MadeHair {
  std::vector<float> points;
  std::vector<std::uint32_t> strand_begin;
};

MadeHair make_bob() {
  hairnet_groom* groom = nullptr;
  EXPECT_EQ(hairnet_groom_make("bob", 300, &groom, nullptr, 0), HAIRNET_OK);
  const float* points = hairnet_groom_points(groom);
  const std::uint32_t* begin = hairnet_groom_strand_begin(groom);
  const std::size_t strand_count = hairnet_groom_strand_count(groom);
  MadeHair hair{{points, points + 3 * std::size_t{begin[strand_count]}}, {begin, begin + strand_count + 1}};
  hairnet_groom_free(groom);
  return hair;
}

void append(std::string& text, const char* format, double x, double y, double z) {
  std::array<char, 96> line{};
  std::snprintf(line.data(), line.size(), format, x, y, z);
  text += line.data();
}

// Returns the strands as lines of an .obj file, in centimetres with +z up and the face at -y, as many programs write
// them.
std::string obj_of(const MadeHair& hair) {
  std::string text;
  for (std::size_t p = 0; p < hair.points.size(); p += 3)
    append(text, "v %.6f %.6f %.6f\n", 100 * double{hair.points[p]}, -100 * double{hair.points[p + 2]},
           100 * double{hair.points[p + 1]});
  for (std::size_t s = 0; s + 1 < hair.strand_begin.size(); ++s) {
    text += 'l';
    for (std::uint32_t p = hair.strand_begin[s]; p < hair.strand_begin[s + 1]; ++p)
      text.append(" ").append(std::to_string(p + 1));
    text += '\n';
  }
  return text;
}

// Returns the strands as edges of a text .ply file.
std::string ply_of(const MadeHair& hair) {
  const std::size_t point_count = hair.points.size() / 3, strand_count = hair.strand_begin.size() - 1;
  std::string text = "ply\nformat ascii 1.0\nelement vertex " + std::to_string(point_count) +
                     "\nproperty float x\nproperty float y\nproperty float z\nelement edge " +
                     std::to_string(point_count - strand_count) +
                     "\nproperty int vertex1\nproperty int vertex2\nend_header\n";
  for (std::size_t p = 0; p < hair.points.size(); p += 3)
    append(text, "%.7f %.7f %.7f\n", double{hair.points[p]}, double{hair.points[p + 1]}, double{hair.points[p + 2]});
  for (std::size_t s = 0; s < strand_count; ++s) {
    for (std::uint32_t p = hair.strand_begin[s]; p + 1 < hair.strand_begin[s + 1]; ++p)
      text.append(std::to_string(p)).append(" ").append(std::to_string(p + 1)).append("\n");
  }
  return text;
}

// Returns the largest difference of a coordinate between two sets of points, m, after their middles are brought
// together.
double largest_difference(const std::vector<float>& a, const std::vector<float>& b) {
  std::array<double, 3> shift{};
  for (std::size_t i = 0; i < a.size(); ++i)
    shift[i % 3] += 3 * (double{a[i]} - double{b[i]}) / static_cast<double>(a.size());
  double most = 0;
  for (std::size_t i = 0; i < a.size(); ++i)
    most = std::max(most, std::abs(double{a[i]} - double{b[i]} - shift[i % 3]));
  return most;
}

TEST(HairnetHImport, strands_of_another_program_become_a_groom_and_lines_say_what_was_guessed) {
  const MadeHair hair = make_bob();
  const Imported groom = imported({{"bob.obj", obj_of(hair)}});
  ASSERT_EQ(groom.code, HAIRNET_OK) << groom.error;
  EXPECT_EQ(groom.name, "bob");
  EXPECT_EQ(groom.strand_count, 300u);
  ASSERT_EQ(groom.points.size(), hair.points.size());
  // The strands lie as they did, but about the head joint that their roots show.
  EXPECT_LT(largest_difference(groom.points, hair.points), 1e-4);
  EXPECT_THAT(groom.remarks, StartsWith("bob.obj: taken as up +z, face -y, 0.01 m a unit, roots first\n"));
  EXPECT_THAT(groom.remarks, EndsWith("\n"));
}

TEST(HairnetHImport, what_is_known_is_not_guessed) {
  const MadeHair hair = make_bob();
  hairnet_import_options options = HAIRNET_IMPORT_OPTIONS;
  options.name = "curls";
  options.up = "+z";
  options.face = "+x";
  options.roots = "first";
  options.unit_m = 0.02;
  const Imported groom = imported({{"bob.OBJ", obj_of(hair)}}, &options);
  ASSERT_EQ(groom.code, HAIRNET_OK) << groom.error;
  EXPECT_EQ(groom.name, "curls");
  EXPECT_THAT(groom.remarks, StartsWith("bob.OBJ: taken as up +z, face +x, 0.02 m a unit, roots first\n"));

  const auto refusal = [&](auto set) {
    hairnet_import_options wrong = HAIRNET_IMPORT_OPTIONS;
    set(wrong);
    const Imported refused = imported({{"bob.obj", obj_of(hair)}}, &wrong);
    EXPECT_EQ(refused.code, HAIRNET_INVALID);
    return refused.error;
  };
  EXPECT_THAT(refusal([](auto& wrong) { wrong.up = "north"; }), HasSubstr("up: an axis is one of"));
  EXPECT_THAT(refusal([](auto& wrong) { wrong.face = ""; }), HasSubstr("face: an axis is one of"));
  EXPECT_THAT(refusal([](auto& wrong) { wrong.roots = "tips"; }), HasSubstr("roots is not one of"));
  EXPECT_THAT(refusal([](auto& wrong) { wrong.up = "+z", wrong.face = "-z"; }), HasSubstr("the same axis"));
  for (const double unit_m : {-1.0, std::numeric_limits<double>::infinity(), std::numeric_limits<double>::quiet_NaN()})
    EXPECT_THAT(refusal([&](auto& wrong) { wrong.unit_m = unit_m; }), HasSubstr("unit_m")) << unit_m;
  // The size of the struct tells the version of hairnet.h that the program was built with; no version has 1000
  // bytes.
  EXPECT_THAT(refusal([](auto& wrong) { wrong.size = 1000; }), HasSubstr("HAIRNET_IMPORT_OPTIONS"));
}

TEST(HairnetHImport, files_of_one_head_are_one_groom) {
  const MadeHair hair = make_bob();
  MadeHair left{hair.points, {}}, right{hair.points, {}};
  for (std::size_t s = 0; s < hair.strand_begin.size(); ++s) {
    if (s <= 150) left.strand_begin.push_back(hair.strand_begin[s]);
    if (s >= 150) right.strand_begin.push_back(hair.strand_begin[s]);
  }
  // The first 150 strands go to one file and the others to a second one.
  left.points.resize(3 * std::size_t{left.strand_begin.back()});
  right.points.erase(right.points.begin(), right.points.begin() + 3 * right.strand_begin.front());
  const std::uint32_t first = right.strand_begin.front();
  for (std::uint32_t& begin : right.strand_begin) begin -= first;
  const Imported groom = imported({{"left.ply", ply_of(left)}, {"right.ply", ply_of(right)}});
  ASSERT_EQ(groom.code, HAIRNET_OK) << groom.error;
  EXPECT_EQ(groom.name, "left");
  EXPECT_EQ(groom.strand_count, 300u);
  EXPECT_LT(largest_difference(groom.points, hair.points), 1e-4);
}

TEST(HairnetHImport, bad_files_are_refused_by_their_names) {
  const std::string good = obj_of(make_bob());
  const auto refusal = [](const std::vector<NamedText>& files, hairnet_error code) {
    const Imported refused = imported(files);
    EXPECT_EQ(refused.code, code) << refused.error;
    return refused.error;
  };
  EXPECT_THAT(refusal({}, HAIRNET_INVALID), StartsWith("0 files"));
  // An import takes at most 64 files, whose names have at most 255 bytes (imports.cpp).
  EXPECT_THAT(refusal(std::vector<NamedText>(65, {"bob.obj", good}), HAIRNET_INVALID), StartsWith("65 files"));
  EXPECT_THAT(refusal({{"", good}}, HAIRNET_INVALID), HasSubstr("file 0 has no name"));
  EXPECT_THAT(refusal({{std::string(252, 'b') + ".obj", good}}, HAIRNET_INVALID), HasSubstr("256 bytes"));
  EXPECT_THAT(refusal({{"bob.abc", "no archive"}}, HAIRNET_MALFORMED), StartsWith("bob.abc: not an Alembic file"));
  EXPECT_THAT(refusal({{"bob.ply", good}}, HAIRNET_MALFORMED), StartsWith("bob.ply: "));
  EXPECT_THAT(refusal({{"bob.hair", ""}}, HAIRNET_MALFORMED), "bob.hair: is empty");
  EXPECT_THAT(refusal({{"bob", good}}, HAIRNET_MALFORMED), StartsWith("bob: strands are read from .hair "));
  EXPECT_THAT(refusal({{"bob.obj", good}, {"photo.png", "PNG"}}, HAIRNET_MALFORMED), StartsWith("photo.png: "));
  const NamedText body{"body.obj", "v 0 0 0\nv 1 0 0\nv 0 1 0\nv 0 0 1\nf 1 3 2\nf 1 2 4\nf 1 4 3\nf 2 3 4\n"};
  EXPECT_THAT(refusal({body}, HAIRNET_MALFORMED), "body.obj: holds a body and no strands of hair");
  EXPECT_THAT(refusal({{"bob.obj", good}, body, body}, HAIRNET_MALFORMED), HasSubstr("a second body"));
  // One strand shows no head, so the error names the options that would say what it does not show.
  EXPECT_THAT(refusal({{"one.obj", "v 0 0 0\nv 0 1 0\nv 0 2 0\nl 1 2 3\n"}}, HAIRNET_INVALID),
              AllOf(StartsWith("one.obj: "), HasSubstr("--unit")));
}

TEST(HairnetHImport, a_name_that_would_break_a_line_is_shown_with_escapes) {
  const std::string good = obj_of(make_bob());
  const Imported groom = imported({{"b\nob\xff \xe2\x80\xae.obj", good}});
  ASSERT_EQ(groom.code, HAIRNET_OK) << groom.error;
  EXPECT_THAT(groom.remarks, StartsWith("b\\u000aob\\xff \\u202e.obj: taken as "));
  const Imported refused = imported({{"b\nob.abc", "no archive"}});
  EXPECT_THAT(refused.error, StartsWith("b\\u000aob.abc: "));
  const Imported named = imported({{"Zoë’s 髪 (1).v2.obj", good}});
  EXPECT_EQ(named.name, "Zoë’s 髪 (1).v2") << named.error;
}

TEST(HairnetHImport, strands_without_length_are_dropped_and_counted) {
  MadeHair hair = make_bob();
  // The points of the first three strands all lie at the root.
  for (std::uint32_t s = 0; s < 3; ++s) {
    for (std::uint32_t p = hair.strand_begin[s] + 1; p < hair.strand_begin[s + 1]; ++p) {
      for (std::size_t axis = 0; axis < 3; ++axis)
        hair.points[3 * std::size_t{p} + axis] = hair.points[3 * std::size_t{hair.strand_begin[s]} + axis];
    }
  }
  const Imported groom = imported({{"bob.ply", ply_of(hair)}});
  ASSERT_EQ(groom.code, HAIRNET_OK) << groom.error;
  EXPECT_EQ(groom.strand_count, 297u);
  EXPECT_THAT(groom.remarks, HasSubstr("bob.ply: 3 of 300 strands have no length, and are dropped\n"));
}

TEST(HairnetHImport, other_grooms_have_no_remarks) {
  hairnet_groom* groom = nullptr;
  ASSERT_EQ(hairnet_groom_make("bob", 100, &groom, nullptr, 0), HAIRNET_OK);
  EXPECT_STREQ(hairnet_groom_remarks(groom), "");
  hairnet_groom_free(groom);
}

}  // namespace
