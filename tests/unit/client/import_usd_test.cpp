#include <gmock/gmock.h>

#include <cmath>
#include <string>

#include "client/assets/import/placement.hpp"
#include "client/assets/import/strands.hpp"
#include "client/assets/import/usda.hpp"
#include "tests/support/import_files.hpp"

namespace hairnet {
namespace {

using testing::Contains;
using testing::ElementsAre;
using testing::HasSubstr;
using testing::IsEmpty;
using testing::Not;

Result<ImportedStrands> decode(std::string_view text) {
  return decode_usd_curves(std::as_bytes(std::span(text)));
}

std::string refusal(std::string_view text) {
  const auto strands = decode(text);
  return strands ? std::string() : strands.error();
}

ImportedStrands strands_of(std::string_view text) {
  auto strands = decode(text);
  EXPECT_TRUE(strands) << strands.error();
  return strands ? std::move(*strands) : ImportedStrands{};
}

// Returns a file of one prim "hair" with these statements.
std::string file_of(const std::string& statements, const std::string& metadata = "") {
  return "#usda 1.0\n(" + metadata + ")\ndef BasisCurves \"hair\" {\n" + statements + "\n}\n";
}

const std::string kLine = "uniform token type = \"linear\"\n";
// Two curves of two points each, unless a test says more.
const std::string kTwoOfTwo = kLine + "int[] curveVertexCounts = [2, 2]\n";
const std::string kFourPoints = "point3f[] points = [(0, 0, 0), (1, 0, 0), (0, 2, 0), (0, 3, 0)]\n";

// Returns where the point (1, 2, 3) of a line comes to lie under a prim with these transforms. `above` is the parent
// prim's, `own` the curves' own.
Vec3f moved(const std::string& above, const std::string& own = "") {
  const ImportedStrands strands =
      strands_of("#usda 1.0\ndef Xform \"above\" {\n" + above + "\ndef BasisCurves \"hair\" {\n" + own + '\n' + kLine +
                 "int[] curveVertexCounts = [2]\npoint3f[] points = [(1, 2, 3), (0, 0, 0)]\n}\n}\n");
  EXPECT_THAT(strands.doubts, IsEmpty());
  return strands.points.empty() ? Vec3f::Zero() : strands.points.front();
}

std::string ordered(const std::string& ops, const std::string& order) {
  return ops + "\nuniform token[] xformOpOrder = [" + order + "]\n";
}

void expect_near(const Vec3f& got, const Vec3f& expected) {
  EXPECT_LT((got - expected).norm(), 1e-5f) << got.transpose() << " for " << expected.transpose();
}

TEST(ImportUsd, reads_curves_with_the_axis_and_unit_of_the_file) {
  const ImportedStrands strands = strands_of(file_of(kTwoOfTwo + kFourPoints, "upAxis = \"Z\"\nmetersPerUnit = 0.01"));
  EXPECT_THAT(strands.strand_begin, ElementsAre(0, 2, 4));
  EXPECT_EQ(strands.points[3], Vec3f(0, 3, 0));
  EXPECT_EQ(strands.up, Axis::plus_z);
  EXPECT_EQ(strands.unit_m, 0.01);
  EXPECT_THAT(strands.doubts, IsEmpty());
}

TEST(ImportUsd, attributes_of_the_file_itself_are_no_curves) {
  EXPECT_THAT(refusal("#usda 1.0\n" + kTwoOfTwo + kFourPoints), HasSubstr("no "));
}

TEST(ImportUsd, a_file_that_states_no_axis_and_unit_has_none) {
  const ImportedStrands strands = strands_of(file_of(kTwoOfTwo + kFourPoints));
  EXPECT_EQ(strands.up, std::nullopt);
  EXPECT_EQ(strands.unit_m, std::nullopt);
  EXPECT_THAT(strands_of(file_of(kTwoOfTwo + kFourPoints, "metersPerUnit = -1")).doubts,
              ElementsAre(HasSubstr("metersPerUnit")));
}

TEST(ImportUsd, comments_strings_and_statements_it_does_not_need_are_skipped) {
  const ImportedStrands strands = strands_of(R"(#usda 1.0
(
    """A scene with brackets ( [ { in its words."""
    doc = 'and "quotes" # that are no comment'
    customLayerData = { string a = "}", dictionary b = { double c = 1e-3 } }
    subLayers = []
)
/* a comment
   of two lines */
def Scope "Looks" { // another
    def Material "m" { token outputs:surface.connect = </Looks/m/s.outputs:surface>
        def Shader "s" { uniform token info:id = "x"; asset inputs:file = @./a)b.png@; asset b = @@@a@b.png@@@
            float inputs:w (doc = "no value")
        } } }
def BasisCurves "hair" (prepend apiSchemas = ["MaterialBindingAPI"]; kind = "component"
    customData = { string "with space" = "x" } )
{
    uniform token type = "linear"; int[] curveVertexCounts = [2, 2] (doc = "counts")
    rel material:binding = </Looks/m> (bindMaterialAs = "strongerThanDescendants")
    custom rel proxyPrim
    prepend rel things = [</a>, </b>]
    reorder properties = ["a", "b"]
    point3f[] points = [  # (9, 9, 9), not a point
        (0, 0, 0), (1.5, -2.5e-1, +.5), # ) ]
        (0, 2, 0), (0, 3, 0), ] (interpolation = "vertex")
    bool doubleSided = true
    string[] names = ["a]", 'b"', """c
d"""]
    float3[] extent = None
    timecode t = 1
}
)");
  ASSERT_EQ(strands.points.size(), 4u);
  EXPECT_EQ(strands.points[1], Vec3f(1.5f, -0.25f, 0.5f));
  EXPECT_THAT(strands.doubts, IsEmpty());
}

// Each line has one operation of USD, applied to (1, 2, 3). Angles are degrees, right-handed.
TEST(ImportUsd, transforms_are_those_of_the_scene) {
  expect_near(moved(ordered("double3 xformOp:translate = (10, 20, 30)", "\"xformOp:translate\"")), {11, 22, 33});
  expect_near(moved(ordered("float3 xformOp:scale = (2, 3, -1)", "\"xformOp:scale\"")), {2, 6, -3});
  expect_near(moved(ordered("float xformOp:rotateX = 90", "\"xformOp:rotateX\"")), {1, -3, 2});
  expect_near(moved(ordered("float xformOp:rotateY = 90", "\"xformOp:rotateY\"")), {3, 2, -1});
  expect_near(moved(ordered("float xformOp:rotateZ = 90", "\"xformOp:rotateZ\"")), {-2, 1, 3});
  // First about x, which gives (1, -3, 2), then about y.
  expect_near(moved(ordered("float3 xformOp:rotateXYZ = (90, 90, 0)", "\"xformOp:rotateXYZ\"")), {2, -3, -1});
  // First about z, which gives (-2, 1, 3), then about x.
  expect_near(moved(ordered("float3 xformOp:rotateZYX = (90, 0, 90)", "\"xformOp:rotateZYX\"")), {-2, -3, 1});
  expect_near(moved(ordered("quatf xformOp:orient = (0.70710678, 0.70710678, 0, 0)", "\"xformOp:orient\"")),
              {1, -3, 2});
  expect_near(moved(ordered("double xformOp:translateY = 5", "\"xformOp:translateY\"")), {1, 7, 3});
  // A matrix as rows, its translation in the last.
  expect_near(moved(ordered("matrix4d xformOp:transform = ( (0, 1, 0, 0), (-1, 0, 0, 0), (0, 0, 1, 0), (10, 0, 0, 1) )",
                            "\"xformOp:transform\"")),
              {8, 1, 3});
}

TEST(ImportUsd, the_last_operation_of_the_order_comes_first_and_prims_follow_those_above) {
  const std::string shift = "double3 xformOp:translate = (10, 0, 0)\n", twice = "float3 xformOp:scale = (2, 2, 2)\n";
  expect_near(moved(ordered(shift + twice, "\"xformOp:translate\", \"xformOp:scale\"")), {12, 4, 6});
  expect_near(moved(ordered(shift + twice, "\"xformOp:scale\", \"xformOp:translate\"")), {22, 4, 6});
  expect_near(moved(ordered(twice, "\"xformOp:scale\""), ordered(shift, "\"xformOp:translate\"")), {22, 4, 6});
  // What is not in the order does nothing.
  expect_near(moved(shift), {1, 2, 3});
}

// A pivot shifts, turns and shifts back: half a turn about (1, 2, 0) leaves (1, 2, 3) where it is.
TEST(ImportUsd, pivots_are_undone_and_a_reset_forgets_the_prims_above) {
  const std::string pivot =
      "float3 xformOp:translate:pivot = (1, 2, 0)\nfloat xformOp:rotateZ:turn = 180\nfloat "
      "xformOp:translateX.timeSamples = {}";
  expect_near(moved(ordered(pivot,
                            "\"xformOp:translate:pivot\", \"xformOp:rotateZ:turn\", "
                            "\"!invert!xformOp:translate:pivot\"")),
              {1, 2, 3});
  expect_near(moved(ordered("float3 xformOp:scale = (2, 2, 2)", "\"xformOp:scale\""),
                    ordered("float3 xformOp:translate = (1, 1, 1)", "\"!resetXformStack!\", \"xformOp:translate\"")),
              {2, 3, 4});
}

TEST(ImportUsd, an_operation_that_cannot_be_read_is_skipped_and_named) {
  for (const char* op : {"float3 xformOp:scale = (0, 0)", "float3 xformOp:scale", "quatf xformOp:scale = nothing"}) {
    const ImportedStrands strands = strands_of(file_of(ordered(op, "\"xformOp:scale\"") + kTwoOfTwo + kFourPoints));
    EXPECT_THAT(strands.doubts, ElementsAre(HasSubstr("xformOp:scale"))) << op;
  }
}

TEST(ImportUsd, the_first_time_with_curves_is_taken_and_told) {
  const ImportedStrands strands = strands_of(file_of(kLine + R"(
    int[] curveVertexCounts.timeSamples = { 1: [], 2.5: [2], 3: [2, 2], }
    point3f[] points ( interpolation = "vertex" )
    point3f[] points.timeSamples = { 1: [], 2.5:[(0, 0, 0), (0, 1, 0)], 3 : [(9, 9, 9)], 4: None }
)"));
  EXPECT_THAT(strands.strand_begin, ElementsAre(0, 2));
  EXPECT_EQ(strands.points[1], Vec3f(0, 1, 0));
  EXPECT_THAT(strands.notes, Contains(HasSubstr("first time")));
}

TEST(ImportUsd, a_cubic_curve_runs_through_what_its_basis_says) {
  const std::string points =
      "int[] curveVertexCounts = [4]\npoint3f[] points = [(0, 0, 0), (0, 3, 0), (3, 3, 0), (3, 0, 0)]\n";
  const auto ends = [&](const std::string& tokens) {
    const ImportedStrands strands = strands_of(file_of(tokens + points));
    return std::pair(strands.points.front(), strands.points.back());
  };
  // Curves are cubic Bezier unless the file says something else.
  EXPECT_EQ(ends("").first, Vec3f(0, 0, 0));
  EXPECT_EQ(ends("token basis = \"bezier\"\n").second, Vec3f(3, 0, 0));
  // A B-spline begins at (a + 4b + c) / 6 of its first three points, and a pinned one at the first point. A
  // Catmull-Rom curve begins at its second point.
  expect_near(ends("uniform token basis = \"bspline\"\n").first, {0.5f, 2.5f, 0});
  expect_near(ends("uniform token basis = \"bspline\"\nuniform token wrap = \"pinned\"\n").first, {0, 0, 0});
  expect_near(ends("uniform token basis = \"catmullRom\"\n").first, {0, 3, 0});
  const auto closed = ends("uniform token basis = \"bspline\"\nuniform token wrap = \"periodic\"\n");
  expect_near(closed.first, closed.second);
}

TEST(ImportUsd, a_curve_that_does_not_fit_its_basis_becomes_lines_and_one_of_a_point_is_left_out) {
  const ImportedStrands strands = strands_of(file_of(R"(
    uniform token basis = "bspline"
    int[] curveVertexCounts = [3, 1, 4]
    point3f[] points = [(0, 0, 0), (0, 1, 0), (1, 1, 0), (5, 5, 5), (0, 0, 0), (0, 1, 0), (0, 2, 0), (0, 3, 0)]
)"));
  EXPECT_EQ(strands.strand_count(), 2u);
  EXPECT_EQ(strands.points[2], Vec3f(1, 1, 0));
  EXPECT_THAT(strands.doubts,
              ElementsAre("hair: curve 1 has 1 point: 1 of 3 curves left out", HasSubstr("curve 0 has 3")));
}

TEST(ImportUsd, a_curve_with_a_point_that_is_not_finite_is_left_out) {
  // A float holds up to 3.4e38, so 1e39 is read as infinite. -1e500 is too large even for a double, and is no number
  // to the reader.
  for (const char* bad : {"inf", "-inf", "nan", "1e39", "-1e500"}) {
    const std::string points =
        std::string("point3f[] points = [(0, 0, 0), (") + bad + ", 0, 0), (0, 2, 0), (0, 3, 0)]\n";
    const auto strands = decode(file_of(kTwoOfTwo + points));
    if (std::string(bad) == "-1e500") {
      EXPECT_THAT(strands.error(), HasSubstr("no triples of numbers"));
      continue;
    }
    ASSERT_TRUE(strands) << bad << ": " << strands.error();
    EXPECT_EQ(strands->strand_count(), 1u) << bad;
    EXPECT_THAT(strands->doubts, ElementsAre(HasSubstr("curve 0 has a point that is not finite"))) << bad;
  }
}

// The file has four points. Counts that need more must neither read beyond them nor overflow.
TEST(ImportUsd, counts_that_do_not_fit_the_points_give_the_curves_that_do) {
  const auto with = [](const std::string& counts) {
    return decode(file_of(kLine + "int[] curveVertexCounts = [" + counts + "]\n" + kFourPoints));
  };
  EXPECT_EQ(with("2, 2, 2")->strand_count(), 2u);
  EXPECT_THAT(with("2, 2, 2")->doubts, ElementsAre(HasSubstr("from curve 2 on: 1 of 3 curves left out")));
  EXPECT_EQ(with("2, 9223372036854775807")->strand_count(), 1u);
  EXPECT_EQ(with("2, -2")->strand_count(), 1u);
  EXPECT_EQ(with("3")->points.size(), 3u);
  EXPECT_THAT(with("3")->doubts, ElementsAre(HasSubstr("1 of its 4 points")));
  EXPECT_THAT(with("5").error(), HasSubstr("from curve 0 on"));
  EXPECT_THAT(with("2, x").error(), HasSubstr("no whole numbers"));
}

// In USD a width may belong to a point (vertex, varying), a curve (uniform) or the whole prim (constant). Without a
// statement the number of widths decides.
TEST(ImportUsd, widths_lie_over_the_points_as_their_interpolation_says) {
  const auto widths = [](const std::string& more) {
    return strands_of(file_of(kTwoOfTwo + kFourPoints + more)).widths;
  };
  EXPECT_THAT(widths("float[] widths = [1, 3, 4, 6]\n"), ElementsAre(1, 3, 4, 6));
  EXPECT_THAT(widths("float[] widths = [1, 3, 4, 6] (interpolation = \"varying\")\n"), ElementsAre(1, 3, 4, 6));
  EXPECT_THAT(widths("float[] widths = [1, 3] (interpolation = \"uniform\")\n"), ElementsAre(1, 1, 3, 3));
  EXPECT_THAT(widths("float[] widths = [7] (interpolation = \"constant\")\n"), ElementsAre(7, 7, 7, 7));
  EXPECT_THAT(widths("float[] widths = [7]\n"), ElementsAre(7, 7, 7, 7));
  EXPECT_THAT(widths("float[] primvars:widths = [8]\nfloat[] widths = [7]\n"), ElementsAre(8, 8, 8, 8));
  EXPECT_THAT(widths("float[] widths = [1]\n" + ordered("float3 xformOp:scale = (2, 2, 2)", "\"xformOp:scale\"")),
              ElementsAre(2, 2, 2, 2));
  EXPECT_THAT(widths("float[] widths = []\n"), IsEmpty());
  const ImportedStrands strands = strands_of(file_of(kTwoOfTwo + kFourPoints + "float[] widths = [1, 2, 3]\n"));
  EXPECT_THAT(strands.widths, IsEmpty());
  EXPECT_THAT(strands.doubts, ElementsAre(HasSubstr("widths")));
}

TEST(ImportUsd, widths_at_the_ends_of_segments_are_those_of_the_curve_there) {
  const ImportedStrands strands = strands_of(file_of(
      "int[] curveVertexCounts = [7]\npoint3f[] points = [(0, 0, 0), (0, 1, 0), (0, 2, 0), (0, 3, 0), (0, 4, 0), "
      "(0, 5, 0), (0, 6, 0)]\nfloat[] widths = [0, 6, 0] (interpolation = \"varying\")\n"));
  EXPECT_THAT(strands.widths, ElementsAre(0, 6, 0));
}

// The values are red and blue, and the indices give blue to the first curve. An index of no value drops the colours.
TEST(ImportUsd, indexed_primvars_are_looked_up) {
  const std::string colours =
      "color3f[] primvars:displayColor = [(1, 0, 0), (0, 0, 1)] (interpolation = \"uniform\")\n";
  const ImportedStrands strands =
      strands_of(file_of(kTwoOfTwo + kFourPoints + colours + "int[] primvars:displayColor:indices = [1, 0]\n"));
  const Vec3f red(1, 0, 0), blue(0, 0, 1);
  EXPECT_THAT(strands.colours, ElementsAre(blue, blue, red, red));
  for (const char* bad : {"[2, 0]", "[-1, 0]", "[0]", "[]"}) {
    const ImportedStrands none =
        strands_of(file_of(kTwoOfTwo + kFourPoints + colours + "int[] primvars:displayColor:indices = " + bad + "\n"));
    EXPECT_THAT(none.colours, IsEmpty()) << bad;
    EXPECT_THAT(none.doubts, ElementsAre(HasSubstr("displayColor"))) << bad;
  }
}

// Groups come from names at the curves, then from numbers at the curves, then from the prims that hold them.
TEST(ImportUsd, groups_are_those_of_the_curves_else_the_prims) {
  const std::string more =
      "int[] primvars:groom_group_id = [4, 7] (interpolation = \"uniform\")\nfloat[] primvars:clumpid = [0, 1]\n";
  const ImportedStrands of_curves = strands_of(file_of(kTwoOfTwo + kFourPoints + more));
  EXPECT_THAT(of_curves.group_names, ElementsAre("group 4", "group 7"));
  EXPECT_THAT(of_curves.groups, ElementsAre(0, 1));
  const auto of_names = strands_of(
      file_of(kTwoOfTwo + kFourPoints + "int[] primvars:groom_group_id = [4, 7] (interpolation = \"uniform\")\n" +
              "string[] primvars:groom_group_name = [\"back\", \"top\"] (interpolation = \"uniform\")\n"));
  EXPECT_THAT(of_names.group_names, ElementsAre("back", "top")) << "names count before numbers, wherever they stand";
  EXPECT_THAT(of_curves.notes, Contains(HasSubstr("not used: clumpid")));
  const auto of_one = strands_of(file_of(
      kTwoOfTwo + kFourPoints + "string primvars:groom_group_name = \"fringe\" (interpolation = \"constant\")\n"));
  EXPECT_THAT(of_one.group_names, ElementsAre("fringe"));

  const std::string hair = kTwoOfTwo + kFourPoints + "}\n";
  const ImportedStrands of_prims = strands_of("#usda 1.0\ndef Xform \"a\" { def BasisCurves \"shape\" {\n" + hair +
                                              "}\ndef Xform \"b\" { def BasisCurves \"shape\" {\n" + hair +
                                              "}\ndef BasisCurves \"fringe\" {\n" + hair);
  EXPECT_THAT(of_prims.group_names, ElementsAre("a/shape", "b/shape", "fringe"));
  EXPECT_THAT(of_prims.groups, ElementsAre(0, 0, 1, 1, 2, 2));
  EXPECT_THAT(strands_of(file_of(kTwoOfTwo + kFourPoints)).groups, IsEmpty());
}

// Guides and hidden hair lie in many files beside the hair itself. Taking them would draw hair that the artist does
// not show.
TEST(ImportUsd, curves_that_are_not_drawn_are_skipped_and_named) {
  const std::string hair = kTwoOfTwo + kFourPoints;
  const std::string shown = "def BasisCurves \"shown\" {\n" + hair + "}\n";
  for (const auto& [other, error] :
       {std::pair<std::string, const char*>{"token visibility = \"invisible\"\n", "invisible"},
        {"uniform token purpose = \"guide\"\n", "purpose guide"},
        {"uniform token purpose = \"proxy\"\n", "purpose proxy"}}) {
    for (const std::string& inner : {other + hair + "}\n", other + "def BasisCurves \"below\" {\n" + hair + "}\n}\n"}) {
      const std::string type = inner.find("below") == std::string::npos ? "BasisCurves" : "Xform";
      const std::string hidden = "def " + type + " \"hidden\" {\n" + inner;
      const ImportedStrands strands = strands_of("#usda 1.0\n" + hidden + shown);
      EXPECT_EQ(strands.strand_count(), 2u);
      EXPECT_THAT(strands.doubts, ElementsAre(HasSubstr(error)));
      EXPECT_THAT(refusal("#usda 1.0\n" + hidden), HasSubstr(error));
    }
  }
  for (const char* begin : {"class BasisCurves \"c\" {\n", "def BasisCurves \"c\" (active = false) {\n"})
    EXPECT_EQ(strands_of("#usda 1.0\n" + shown + begin + hair + "}\n").strand_count(), 2u) << begin;
}

TEST(ImportUsd, curves_on_a_skeleton_are_taken_where_they_were_bound) {
  const ImportedStrands strands = strands_of("#usda 1.0\ndef SkelRoot \"r\" {\n" +
                                             ordered("float3 xformOp:translate = (1, 0, 0)", "\"xformOp:translate\"") +
                                             "def BasisCurves \"hair\" {\n" + kTwoOfTwo + kFourPoints + R"(
    int[] primvars:skel:jointIndices = [0, 0, 0, 0] (elementSize = 1)
    matrix4d primvars:skel:geomBindTransform = ( (2, 0, 0, 0), (0, 2, 0, 0), (0, 0, 2, 0), (0, 0, 5, 1) )
}
})");
  // The bind transform scales by 2 and shifts by 5 along z, and the prim above shifts by 1 along x.
  expect_near(strands.points[1], {3, 0, 5});
  EXPECT_THAT(strands.notes, Contains(HasSubstr("at rest")));
}

TEST(ImportUsd, the_selected_variant_is_part_of_its_prim_and_others_are_told) {
  const std::string variants = " {\n    variantSet \"style\" = {\n        \"long\" (doc = \"x\") {\n" + kTwoOfTwo +
                               kFourPoints +
                               "        }\n        \"short\" { int[] curveVertexCounts = [2] }\n    }\n}\n";
  const std::string begin = "#usda 1.0\ndef BasisCurves \"hair\" (prepend variantSets = \"style\"";
  EXPECT_EQ(strands_of(begin + "\nvariants = { string style = \"long\" })" + variants).strand_count(), 2u);
  const std::string below =
      "#usda 1.0\ndef Xform \"head\" { variantSet \"style\" = { \"long\" { def BasisCurves \"hair\" {\n" + kTwoOfTwo +
      kFourPoints + "} } } }";
  EXPECT_THAT(refusal(below), HasSubstr("variants with curves are not selected: long"));
}

TEST(ImportUsd, a_file_without_curves_says_what_it_has) {
  EXPECT_EQ(refusal("#usda 1.0\ndef Mesh \"a\" {}\ndef Mesh \"b\" {}\n"), "no curves: it has 2 meshes");
  EXPECT_EQ(refusal("#usda 1.0\n"), "no curves: it has no BasisCurves");
  EXPECT_THAT(refusal("#usda 1.0\ndef \"hair\" (references = @./hair.usdc@</root>) {}\n"),
              HasSubstr("usdcat --flatten joins it): @./hair.usdc@"));
  EXPECT_THAT(refusal("#usda 1.0\n(subLayers = [@a.usd@, @b.usd@])\n"), HasSubstr("a.usd, b.usd"));
  EXPECT_THAT(refusal(file_of("")), HasSubstr("hair: it has no counts"));
}

TEST(ImportUsd, other_files_are_refused) {
  EXPECT_THAT(refusal(""), HasSubstr("#usda"));
  EXPECT_THAT(refusal("#VRML 2.0"), HasSubstr("#usda"));
  EXPECT_THAT(refusal(std::string("PK\3\4\0\0", 6)), HasSubstr("truncated"));
  EXPECT_THAT(refusal("PK\3\4" + std::string(4, '\0') + '\x08' + std::string(30, '\0')), HasSubstr("usdcat"));
}

const std::string& whole_file() {
  static const std::string kFile = R"(#usda 1.0
( upAxis = "Y" metersPerUnit = 1 doc = """words""" )
def Xform "head" (variants = { string s = "a" }) {
  float3 xformOp:translate.timeSamples = { 1: (1, 2, 3), 2: (0, 0, 0) }
  uniform token[] xformOpOrder = ["xformOp:translate"]
  variantSet "s" = { "a" { def BasisCurves "hair" (references = @x.usd@) {
    int[] curveVertexCounts = [4] # four
    point3f[] points = [(0, 0, 0), (0, 1, 0), (1, 2, 0), (0, 3, 0)] (interpolation = "vertex")
    float[] widths = [0.1] (interpolation = "constant")
    rel material:binding = </Looks>
    string[] primvars:group_name = ['back'] (interpolation = "uniform")
    int[] primvars:group_name:indices = [0]
  } } }
}
)";
  return kFile;
}

void expect_valid(const ImportedStrands& strands) {
  EXPECT_EQ(strands.strand_begin.back(), strands.points.size());
  EXPECT_TRUE(std::ranges::is_sorted(strands.strand_begin));
  for (const Vec3f& x : strands.points) EXPECT_TRUE(x.allFinite());
  EXPECT_TRUE(strands.groups.empty() || strands.groups.size() == strands.strand_count());
  for (const std::size_t size : {strands.widths.size(), strands.colours.size()})
    EXPECT_TRUE(size == 0 || size == strands.points.size());
  for (const std::uint32_t group : strands.groups) EXPECT_LT(group, strands.group_names.size());
}

TEST(ImportUsd, every_truncation_is_refused_with_a_reason) {
  const std::string& whole = whole_file();
  ASSERT_EQ(refusal(whole), "");
  for (std::size_t length = 0; length < whole.rfind('}'); ++length) {
    // A vector of exactly this size, so that reading past it shows under the sanitizer.
    const std::vector<char> cut(whole.begin(), whole.begin() + static_cast<std::ptrdiff_t>(length));
    EXPECT_NE(refusal({cut.data(), cut.size()}), "") << length << " bytes";
  }
}

TEST(ImportUsd, any_changed_byte_is_refused_or_gives_finite_strands) {
  for (std::size_t at = 0; at < whole_file().size(); ++at) {
    for (const char changed :
         {'\0', '"', '(', ')', '[', ']', '{', '}', '<', '@', '#', '/', '\n', '-', '9', '=', ':', 'e', '\xff'}) {
      std::string text = whole_file();
      text[at] = changed;
      const auto strands = decode(text);
      if (strands) {
        expect_valid(*strands);
      } else {
        EXPECT_NE(strands.error(), "");
      }
    }
  }
}

TEST(ImportUsd, nesting_is_bounded) {
  std::string prims = "#usda 1.0\n", brackets = "#usda 1.0\n(a = ";
  // Prims and brackets may be nested 256 deep (kDepthMax), and a file may have 500 000 statements (kStatementsMax in
  // usda.cpp).
  for (int i = 0; i < 100'000; ++i) {
    prims += "def \"a\"{";
    brackets += "[";
  }
  EXPECT_THAT(refusal(prims), HasSubstr("nested deeper"));
  EXPECT_THAT(refusal(brackets), HasSubstr("nested deeper"));
  std::string many = "#usda 1.0\n";
  for (int i = 0; i < 600'000; ++i) many += "def \"" + std::to_string(i) + "\"{}";
  EXPECT_THAT(refusal(many), HasSubstr("more than"));
}

TEST(ImportUsd, errors_name_the_line) {
  EXPECT_THAT(refusal("#usda 1.0\n\ndef BasisCurves hair {\n"), HasSubstr("line 3: expected a name in quotes"));
  EXPECT_THAT(refusal("#usda 1.0\ndef \"a\" {\n  float a = [1, 2)\n}"), HasSubstr("line 3: no end of the brackets"));
  EXPECT_THAT(refusal("#usda 1.0\n}\n"), HasSubstr("line 2"));
}

struct RealFile {
  const char* name;
  std::size_t curves, controls;
};

TEST(ImportUsd, real_files_have_the_curves_that_their_list_says) {
  const std::filesystem::path folder = test::shared_data() / "import/usd";
  if (!std::filesystem::exists(folder)) GTEST_SKIP() << "no files at " << folder;
  for (const RealFile& real : {RealFile{"blender283_hair_10", 10, 90},
                               {"blender293_curves_72", 72, 648},
                               {"openusd_basisCurves_zoo", 10, 70},
                               {"openusd_basicCurves", 7, 30},
                               {"openusd_moreCurves", 19, 97},
                               {"openusd_pinnedCurves", 4, 11},
                               {"openusd_bunny_varying_topology", 6, 52},
                               {"openusd_bezier_451", 451, 3739},
                               {"houdini_groom_sphere_118", 118, 1534},
                               {"houdini_curves_vary_topology", 11, 143},
                               {"houdini_curves_xform_anim", 11, 1111},
                               {"openusd_skel_curves_mesh", 10, 40}}) {
    const ImportedStrands strands = strands_of(test::file_text(folder / (std::string(real.name) + ".usda")));
    expect_valid(strands);
    EXPECT_THAT(strands.notes, Contains(HasSubstr(std::to_string(real.curves) + " curves of " +
                                                  std::to_string(real.controls) + " control points")))
        << real.name;
    EXPECT_THAT(strands.doubts, Not(Contains(HasSubstr("cannot be read")))) << real.name;
  }
}

}  // namespace
}  // namespace hairnet
