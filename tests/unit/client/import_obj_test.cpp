#include <gmock/gmock.h>

#include <array>
#include <string>

#include "client/assets/import/obj.hpp"
#include "tests/support/import_files.hpp"

namespace hairnet {
namespace {

using testing::ElementsAre;
using testing::HasSubstr;
using Triangle = std::array<std::uint32_t, 3>;

// Four vertices in four lines, so the next line is line 5.
const std::string kSquare = "v 0 0 0\nv 1 0 0\nv 1 1 0\nv 0 1 0\n";

std::string refusal(std::string_view text) {
  const auto mesh = decode_obj(text);
  return mesh ? std::string() : mesh.error();
}

void expect_valid(const TriangleMesh& mesh) {
  for (const Vec3f& x : mesh.vertices) EXPECT_TRUE(x.allFinite());
  for (const Triangle& triangle : mesh.triangles) {
    for (const std::uint32_t corner : triangle) EXPECT_LT(corner, mesh.vertices.size());
  }
}

TEST(ImportObj, reads_faces_with_texture_and_normal_indices) {
  const auto mesh = decode_obj(kSquare + "vt 0 0\nvn 0 0 1\nf 1/1 2/1 3/1\nf 1//1 3//1 4//1\nf 1/1/1 2/1/1 4/1/1\n");
  ASSERT_TRUE(mesh) << mesh.error();
  EXPECT_EQ(mesh->vertices[2], Vec3f(1, 1, 0));
  EXPECT_THAT(mesh->triangles, ElementsAre(Triangle{0, 1, 2}, Triangle{0, 2, 3}, Triangle{0, 1, 3}));
}

TEST(ImportObj, fans_polygons_and_keeps_their_winding) {
  const auto mesh = decode_obj(kSquare + "v 0 2 0\nf 1 2 3 4 5\n");
  ASSERT_TRUE(mesh) << mesh.error();
  EXPECT_THAT(mesh->triangles, ElementsAre(Triangle{0, 1, 2}, Triangle{0, 2, 3}, Triangle{0, 3, 4}));
}

TEST(ImportObj, negative_indices_count_back_from_the_last_vertex_read) {
  const auto mesh = decode_obj(kSquare + "f -4 -3 -2\nv 5 5 5\nf -1 -2 1\n");
  ASSERT_TRUE(mesh) << mesh.error();
  EXPECT_THAT(mesh->triangles, ElementsAre(Triangle{0, 1, 2}, Triangle{4, 3, 0}));
}

TEST(ImportObj, windows_line_ends_comments_and_other_keywords_are_no_error) {
  const auto mesh = decode_obj(
      "# head\r\nmtllib a.mtl\r\no head\r\nv 0 0 0 1.0\r\n\tv  1 0 0\r\nv 0 1e0 +0\r\ng skin\r\nusemtl "
      "skin\r\ns off\r\nf 1 2 3 # last\r\n");
  ASSERT_TRUE(mesh) << mesh.error();
  EXPECT_EQ(mesh->vertices.size(), 3u);
  EXPECT_THAT(mesh->triangles, ElementsAre(Triangle{0, 1, 2}));
}

TEST(ImportObj, refuses_bad_indices_and_names_the_line) {
  // Vertices are numbered from 1, and from -1 backwards. The large numbers overflow 32 and 64 bits.
  for (const char* face : {"f 1 2 5", "f 0 1 2", "f 1 2 -5", "f 1 2 x", "f 1 2 /3", "f 1 2 3.5", "f 1 2 4294967297",
                           "f 1 2 99999999999999999999", "f 1 2 -9223372036854775808"}) {
    EXPECT_THAT(refusal(kSquare + face + "\n"), HasSubstr("line 5: no vertex")) << face;
  }
  EXPECT_THAT(refusal(kSquare + "\nf 1 2\n"), HasSubstr("line 6"));
  EXPECT_THAT(refusal("f 1 2 3\n" + kSquare), HasSubstr("line 1")) << "vertices must come before their face";
}

TEST(ImportObj, refuses_bad_coordinates_and_names_the_line) {
  for (const char* vertex :
       {"v 0 0", "v", "v 0 0 nan", "v inf 0 0", "v 0 -inf 0", "v 1e99 0 0", "v 0 0 0x10", "v a b c", "v 0,1,2"}) {
    EXPECT_THAT(refusal("v 0 0 0\n" + std::string(vertex) + "\nf 1 1 1\n"), HasSubstr("line 2: ")) << vertex;
  }
}

TEST(ImportObj, refuses_what_is_no_mesh) {
  EXPECT_THAT(refusal(""), HasSubstr("no vertices"));
  EXPECT_THAT(refusal(std::string(1000, '\0')), HasSubstr("no vertices"));
  EXPECT_THAT(refusal(kSquare), HasSubstr("no faces"));
}

TEST(ImportObj, a_reason_is_one_short_printable_line) {
  const std::string reason = refusal(kSquare + "f 1 2 " + std::string(100'000, '\x01') + "\n");
  // A reason quotes at most the beginning of a line, whatever the file holds.
  EXPECT_LT(reason.size(), 320u);
  EXPECT_EQ(reason.find_first_of(std::string("\x01\n\r", 3)), std::string::npos);
}

TEST(ImportObj, every_truncation_and_corrupt_byte_is_refused_or_gives_a_valid_mesh) {
  const std::string whole = kSquare + "f 1 2 3 4\nf -1//1 -2/3/4 1\n";
  for (std::size_t length = 0; length <= whole.size(); ++length) {
    const auto mesh = decode_obj(std::string(whole, 0, length));
    if (mesh) expect_valid(*mesh);
  }
  for (std::size_t at = 0; at < whole.size(); ++at) {
    for (int byte = 0; byte < 256; ++byte) {
      std::string text = whole;
      text[at] = static_cast<char>(byte);
      const auto mesh = decode_obj(text);
      if (mesh) {
        expect_valid(*mesh);
      } else {
        EXPECT_NE(mesh.error(), "");
      }
    }
  }
}

TEST(ImportRealObj, counts_are_those_the_data_set_lists) {
  if (!std::filesystem::exists(test::shared_data() / "head"))
    GTEST_SKIP() << "no real heads at " << test::shared_data();
  struct Real {
    const char* file;
    std::size_t vertex_count, triangle_count;
  };
  for (const Real& real :
       {Real{"amd_ponytail_head_max4.obj", 9'693, 18'574}, Real{"digitalsalon_female_head.obj", 10'822, 21'510},
        Real{"digitalsalon_female_body_scaled.obj", 27'797, 55'590}, Real{"sintel.obj", 3'046, 5'952},
        Real{"sintel-collider.obj", 341, 678}}) {
    const auto mesh = decode_obj(test::file_text(test::shared_data() / "head" / real.file));
    ASSERT_TRUE(mesh) << real.file << ": " << mesh.error();
    EXPECT_EQ(mesh->vertices.size(), real.vertex_count) << real.file;
    EXPECT_EQ(mesh->triangles.size(), real.triangle_count) << real.file;
    expect_valid(*mesh);
  }
}

// Some programs write each segment of a strand as a line of its own.
TEST(ImportObj, lines_of_two_vertices_are_joined_in_any_order_and_from_the_lower_number) {
  const auto strands = decode_obj_strands(kSquare + "v 5 0 0\nl 3 2\nl 5 4\nl 1 2\n");
  ASSERT_TRUE(strands) << strands.error();
  EXPECT_THAT(strands->strand_begin, ElementsAre(0, 3, 5));
  EXPECT_EQ(strands->points[0], Vec3f(0, 0, 0));
  EXPECT_EQ(strands->points[2], Vec3f(1, 1, 0));
  EXPECT_EQ(strands->points[3], Vec3f(0, 1, 0));
}

TEST(ImportObj, strands_of_one_root_and_several_vertices_stay_apart) {
  const auto strands = decode_obj_strands(kSquare + "l 1 2 3\nl 1 3 4\n");
  ASSERT_TRUE(strands) << strands.error();
  EXPECT_THAT(strands->strand_begin, ElementsAre(0, 3, 6));
}

TEST(ImportObj, objects_and_groups_of_lines_are_groups) {
  const auto strands = decode_obj_strands("o back\n" + kSquare + "l 1 2 3\ng top layer\nl 3 4\nl -1 -2 -3\n");
  ASSERT_TRUE(strands) << strands.error();
  EXPECT_THAT(strands->group_names, ElementsAre("back", "top"));
  EXPECT_THAT(strands->groups, ElementsAre(0, 1));
  EXPECT_THAT(strands->strand_begin, ElementsAre(0, 3, 7));
  EXPECT_THAT(decode_obj_strands("o back\n" + kSquare + "l 1 2\n")->groups, testing::IsEmpty());
}

}  // namespace
}  // namespace hairnet
