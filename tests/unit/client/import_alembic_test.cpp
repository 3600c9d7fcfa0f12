#include <gmock/gmock.h>

#include <chrono>
#include <filesystem>
#include <numeric>

#include "client/assets/import/alembic.hpp"
#include "client/assets/import/hair_import.hpp"
#include "core/groom/groom.hpp"
#include "tests/support/abc_writer.hpp"
#include "tests/support/import_files.hpp"
#include "tests/unit/client/decoded_alembic.hpp"

namespace hairnet {
namespace {

using test::abc_file;
using test::AbcBytes;
using test::AbcFile;
using test::AbcObj;
using test::AbcWriter;
using test::attribute;
using test::curves;
using test::decoded;
using test::expect_valid;
using test::kBspline;
using test::kLinear;
using test::numbers;
using test::OgawaWriter;
using test::refusal;
using test::row;
using test::row_of_strands;
using test::xform;
using testing::Contains;
using testing::ElementsAre;
using testing::HasSubstr;
using testing::IsEmpty;
using testing::Not;
using testing::StartsWith;

void expect_near(const Vec3f& a, const Vec3f& b) {
  EXPECT_LT((a - b).norm(), 1e-5f) << a.transpose() << " and " << b.transpose();
}

TEST(Alembic, linear_curves_are_read_as_they_are) {
  const ImportedStrands strands = decoded({row("hair", 2)});
  EXPECT_THAT(strands.strand_begin, ElementsAre(0, 3, 6));
  ASSERT_EQ(strands.points.size(), 6u);
  EXPECT_EQ(strands.points[4], Vec3f(1, 1, 0.25f));
  EXPECT_THAT(strands.notes, ElementsAre("Alembic 1.8.5 of hairnet test: 2 curves of 6 points in 1 object"));
  EXPECT_THAT(strands.doubts, IsEmpty());
  EXPECT_THAT(strands.widths, IsEmpty());
  EXPECT_THAT(strands.colours, IsEmpty());
  EXPECT_THAT(strands.guides, IsEmpty());
  EXPECT_THAT(strands.groups, IsEmpty());
}

// The three numbers of a basis are its type (0 cubic, 1 linear, 2 of any order), whether it is closed, and the basis (0
// none, 1 Bezier, 2 B-spline, 3 Catmull-Rom, 4 Hermite).
TEST(Alembic, cubic_curves_become_points_on_them) {
  const std::vector<float> four{0, 0, 0, 0, 1, 0, 1, 2, 0, 2, 3, 0};
  const ImportedStrands bspline = decoded({curves("b", {4}, {four}, kBspline)}),
                        bezier = decoded({curves("b", {4}, {four}, {0, 0, 1})}),
                        catmull = decoded({curves("b", {4}, {four}, {0, 0, 3})});
  expect_near(bspline.points.front(), Vec3f(1 / 6.f, 1, 0));
  expect_near(bspline.points.back(), Vec3f(1, 2, 0));
  expect_near(bezier.points.front(), Vec3f(0, 0, 0));
  expect_near(bezier.points.back(), Vec3f(2, 3, 0));
  expect_near(catmull.points.front(), Vec3f(0, 1, 0));
  expect_near(catmull.points.back(), Vec3f(1, 2, 0));
  const ImportedStrands closed = decoded({curves("b", {4}, {four}, {0, 1, 2})});
  expect_near(closed.points.front(), closed.points.back());
  EXPECT_GT(closed.points.size(), 5u);
}

TEST(Alembic, knots_and_orders_of_nurbs_curves_are_used_and_wrong_ones_told) {
  const std::vector<float> five{0, 0, 0, 0, 1, 0, 1, 2, 0, 2, 3, 0, 2, 4, 0};
  const auto with = [&](test::AbcBasis basis, std::vector<test::AbcProp> more) {
    return decoded({curves("maya", {5}, {five}, basis, std::move(more))});
  };
  const ImportedStrands clamped = with(kBspline, {numbers<float>(".knots", {{0, 0, 0, 0, 1, 2, 2, 2, 2}})});
  expect_near(clamped.points.front(), Vec3f(0, 0, 0));
  expect_near(clamped.points.back(), Vec3f(2, 4, 0));
  const ImportedStrands wrong = with(kBspline, {numbers<float>(".knots", {{0, 0, 0, 1}})});
  EXPECT_THAT(wrong.doubts, ElementsAre("/maya has knots that do not fit its curves, and are not used"));
  expect_near(wrong.points.front(), Vec3f(1 / 6.f, 1, 0));
  const ImportedStrands quadratic = with({2, 0, 2}, {numbers<std::uint8_t>(".orders", {{3}})});
  expect_near(quadratic.points.front(), Vec3f(0, 0, 0));
  const ImportedStrands polyline = with({2, 0, 2}, {numbers<std::uint8_t>(".orders", {{2}})});
  EXPECT_EQ(polyline.points.size(), 5u);
  // A weight pulls the curve to its point.
  const std::vector<float> knots{0, 0, 0, 0, 1, 2, 2, 2, 2};
  const ImportedStrands pulled =
      with(kBspline, {numbers<float>(".knots", {knots}), numbers<float>("w", {{1, 1, 1000, 1, 1}})});
  float nearest = 10;
  for (const Vec3f& x : pulled.points) nearest = std::min(nearest, (x - Vec3f(1, 2, 0)).norm());
  EXPECT_LT(nearest, 0.05f);
  EXPECT_THAT(refusal({curves("w", {5}, {five}, kBspline, {numbers<float>("w", {{0, 0, 0, 0, 0}})})}),
              HasSubstr("has weights that make no curve"));
}

TEST(Alembic, cubic_curves_without_a_basis_and_other_bases) {
  const std::vector<float> four{0, 0, 0, 0, 1, 0, 1, 2, 0, 2, 3, 0};
  const ImportedStrands none = decoded({curves("old", {4}, {four}, {0, 0, 0})});
  expect_near(none.points.front(), Vec3f(0, 0, 0));
  EXPECT_THAT(none.doubts, ElementsAre("/old is cubic without a basis, and is taken as B-splines"));
  EXPECT_EQ(refusal({curves("h", {4}, {four}, {0, 0, 4})}),
            "none of its curves can be read: /h has Hermite curves, which are not read: export linear, Bezier or "
            "B-spline curves");
}

TEST(Alembic, positions_of_any_type_of_numbers_are_read) {
  for (const bool is_double : {true, false}) {
    AbcObj object = row("hair", 1);
    test::AbcProp& positions = object.properties[0].children[0];
    if (is_double) {
      positions = numbers<double>("P", {{0, 0, 0, 0, 1, 0, 0, 2.5, 0}}, 3);
    } else {
      // Halves: 1 is 0x3c00, 2.5 is 0x4100.
      positions = numbers<std::uint16_t>("P", {{0, 0, 0, 0, 0x3c00, 0, 0, 0x4100, 0}}, 3);
      positions.type = 9;
    }
    const ImportedStrands strands = decoded({object});
    ASSERT_EQ(strands.points.size(), 3u);
    EXPECT_EQ(strands.points[1], Vec3f(0, 1, 0));
    EXPECT_EQ(strands.points[2], Vec3f(0, 2.5f, 0));
  }
}

// The upper digit of an operation is its kind: 0 scales, 1 shifts, 2 turns about an axis, 3 is a matrix, 4 to 6 turn
// about x, y and z. The lower one is a hint for programs, as 3 for a pivot.
TEST(Alembic, transforms_of_all_kinds_accumulate_down_the_tree) {
  const auto first_of = [](std::vector<AbcObj> objects) { return decoded(std::move(objects)).points[1]; };
  // The second point of this strand is (0, 1, 0).
  const auto hair = [] { return row("hair", 1); };
  expect_near(first_of({xform("t", {0x10}, {{1, 2, 3}}, {hair()})}), Vec3f(1, 3, 3));
  expect_near(first_of({xform("s", {0x00}, {{2, 3, 4}}, {hair()})}), Vec3f(0, 3, 0));
  expect_near(first_of({xform("r", {0x20}, {{0, 0, 2, 90}}, {hair()})}), Vec3f(-1, 0, 0));
  expect_near(first_of({xform("x", {0x40}, {{90}}, {hair()})}), Vec3f(0, 0, 1));
  expect_near(first_of({xform("y", {0x50}, {{90}}, {hair()})}), Vec3f(0, 1, 0));
  expect_near(first_of({xform("z", {0x60}, {{90}}, {hair()})}), Vec3f(-1, 0, 0));
  expect_near(first_of({xform("m", {0x30}, {{1, 0, 0, 0, 0, 0, 1, 0, 0, -1, 0, 0, 5, 6, 7, 1}}, {hair()})}),
              Vec3f(5, 6, 8));
  // A turn about the pivot (0, 2, 0) is three operations: to the pivot, the turn, and back. Each has its hint.
  expect_near(first_of({xform("p", {0x13, 0x60, 0x13}, {{0, 2, 0, 180, 0, -2, 0}}, {hair()})}), Vec3f(0, 3, 0));
  const auto nested = [&](bool inherits) {
    return first_of({xform("a", {0x10}, {{10, 0, 0}}, {xform("b", {0x00}, {{1, 2, 1}}, {hair()}, inherits)})});
  };
  expect_near(nested(true), Vec3f(10, 2, 0));
  expect_near(nested(false), Vec3f(0, 2, 0));
  expect_near(first_of({xform("empty", {}, {}, {hair()})}), Vec3f(0, 1, 0));
}

TEST(Alembic, transforms_that_cannot_be_are_refused) {
  EXPECT_EQ(refusal({xform("t", {0x10}, {{1, 2}}, {row("hair", 1)})}),
            "damaged: the transform /t: it has 2 values, where its operations need 3");
  AbcObj without = xform("t", {0x10}, {{1, 2, 3}}, {row("hair", 1)});
  without.properties[0].children.pop_back();
  expect_near(decoded({without}).points[0], Vec3f(0, 0, 0));
  EXPECT_EQ(refusal({xform("t", {0x70}, {{1}}, {row("hair", 1)})}),
            "damaged: the transform /t: there is no operation 7");
}

TEST(Alembic, widths_have_any_scope_and_grow_with_the_transform) {
  const auto widths = [](std::vector<test::AbcProp> more, double scale = 1) {
    return decoded({xform("s", {0x00}, {{scale, scale, scale}}, {row("hair", 2, std::move(more))})}).widths;
  };
  EXPECT_THAT(widths({attribute<float>("width", "con", {0.5f})}), ElementsAre(.5f, .5f, .5f, .5f, .5f, .5f));
  EXPECT_THAT(widths({attribute<float>("width", "con", {0.5f})}, 2), ElementsAre(1, 1, 1, 1, 1, 1));
  EXPECT_THAT(widths({attribute<float>("width", "uni", {1, 2})}), ElementsAre(1, 1, 1, 2, 2, 2));
  EXPECT_THAT(widths({attribute<float>("width", "vtx", {1, 2, 3, 4, 5, 6})}), ElementsAre(1, 2, 3, 4, 5, 6));
  EXPECT_THAT(widths({attribute<float>("width", "var", {1, 2, 3, 4, 5, 6})}), ElementsAre(1, 2, 3, 4, 5, 6));
  EXPECT_THAT(widths({attribute<float>("width", "con", {1, 2})}), ElementsAre(1, 1, 1, 2, 2, 2)) << "by its count";
  EXPECT_THAT(widths({test::indexed<float>("width", "uni", {7, 9}, {1, 0})}), ElementsAre(9, 9, 9, 7, 7, 7));
  EXPECT_THAT(widths({test::indexed<float>("width", "uni", {7, 9}, {1, 5})}), ElementsAre(9, 9, 9, 0, 0, 0))
      << "an index of nothing";
  EXPECT_THAT(widths({attribute<float>("width", "uni", {1, -2})}), ElementsAre(1, 1, 1, 0, 0, 0));
  EXPECT_THAT(decoded({row("hair", 2, {attribute<float>("width", "uni", {1, 2, 3})})}).notes,
              Contains("attributes that are not used: width"));
  // Cubic curves have widths at control points and at the ends of segments.
  const std::vector<float> five{0, 0, 0, 0, 1, 0, 0, 2, 0, 0, 3, 0, 0, 4, 0};
  for (const bool at_ends : {true, false}) {
    const std::vector<float> values = at_ends ? std::vector<float>{1, 2, 3} : std::vector<float>{0, 1, 2, 3, 4};
    const ImportedStrands strands =
        decoded({curves("c", {5}, {five}, kBspline, {attribute<float>("width", at_ends ? "var" : "vtx", values)})});
    for (std::size_t i = 0; i < strands.points.size(); ++i)
      EXPECT_NEAR(strands.widths[i], strands.points[i].y(), 1e-5f) << at_ends;
  }
}

// The attributes are those of Epic's guidelines for grooms in Alembic files, as other programs write them.
TEST(Alembic, epics_attributes_of_grooms_are_read) {
  const AbcObj hair =
      row("hair", 3, {attribute<float>("width", "con", {9})},
          {attribute<std::int16_t>("groom_version_major", "con", {1}),
           attribute<std::int16_t>("groom_guide", "uni", {0, 1, 0}),
           attribute<std::int32_t>("groom_group_id", "uni", {4, 4, 7}),
           attribute<std::int32_t>("groom_id", "uni", {0, 1, 2}), attribute<float>("groom_width", "uni", {1, 2, 3}),
           attribute<float>("groom_color", "con", {1, 0.5f, 0.25f}, 3),
           attribute<float>("groom_root_uv", "uni", {0, 0, 0.5f, 0.25f, 1, 1}, 2),
           attribute<float>("Cd_mine", "con", {1})});
  const ImportedStrands strands = decoded({hair});
  EXPECT_THAT(strands.guides, ElementsAre(0, 1, 0));
  EXPECT_THAT(strands.groups, ElementsAre(0, 0, 1));
  EXPECT_THAT(strands.group_names, ElementsAre("group 4", "group 7"));
  EXPECT_THAT(strands.widths, ElementsAre(1, 1, 1, 2, 2, 2, 3, 3, 3)) << "groom_width stands before width";
  ASSERT_EQ(strands.colours.size(), 9u);
  EXPECT_EQ(strands.colours[5], Vec3f(1, 0.5f, 0.25f));
  ASSERT_EQ(strands.root_uvs.size(), 3u);
  EXPECT_EQ(strands.root_uvs[1], Eigen::Vector2f(0.5f, 0.25f));
  EXPECT_THAT(strands.notes, Contains("attributes that are not used: groom_version_major, groom_id"));
  EXPECT_THAT(strands.notes, Contains("unknown attributes: Cd_mine"));
}

// The lists of attributes cover all strands of the file, so strands without an attribute need a value that means
// none.
TEST(Alembic, curves_without_an_attribute_that_others_have_get_none) {
  const AbcObj with =
      row("b", 1, {},
          {attribute<float>("groom_width", "con", {2}), attribute<float>("groom_root_uv", "uni", {1, 1}, 2),
           attribute<float>("groom_color", "con", {1, 1, 1}, 3), attribute<std::int8_t>("groom_guide", "con", {1})});
  const ImportedStrands strands = decoded({row("a", 1), with, row("c", 1)});
  EXPECT_THAT(strands.widths, ElementsAre(0, 0, 0, 2, 2, 2, 0, 0, 0));
  EXPECT_THAT(strands.guides, ElementsAre(0, 1, 0));
  ASSERT_EQ(strands.colours.size(), 9u);
  EXPECT_EQ(strands.colours[0], Vec3f(0, 0, 0));
  EXPECT_EQ(strands.colours[3], Vec3f(1, 1, 1));
  EXPECT_EQ(strands.colours[8], Vec3f(0, 0, 0));
  ASSERT_EQ(strands.root_uvs.size(), 3u);
  EXPECT_EQ(strands.root_uvs[1], Eigen::Vector2f(1, 1));
  EXPECT_EQ(strands.root_uvs[2], Eigen::Vector2f(0, 0));
}

TEST(Alembic, attributes_of_objects_above_hold_for_the_curves_below) {
  const auto said = [](const std::string& name) {
    return test::compound(".userProperties", {test::texts("groom_group_name", "con", {name})});
  };
  const ImportedStrands strands = decoded({xform("a", {}, {}, {row("x", 1), row("y", 1)}, true, {said("brows")}),
                                           xform("b", {}, {}, {row("z", 2)}, true, {said("beard")}), row("rest", 1)});
  EXPECT_THAT(strands.group_names, ElementsAre("brows", "beard", "rest"));
  EXPECT_THAT(strands.groups, ElementsAre(0, 0, 1, 1, 2));
}

TEST(Alembic, objects_are_groups_unless_each_curve_is_one) {
  EXPECT_THAT(decoded({row("hair", 2), row("fringe", 1)}).group_names, ElementsAre("hair", "fringe"));
  EXPECT_THAT(decoded({row("curve1", 1), row("curve2", 1)}).group_names, IsEmpty());
  EXPECT_THAT(decoded({row("hair", 4)}).group_names, IsEmpty());
  // A groom has no more groups than GroomLimits allows.
  std::vector<std::int32_t> ids(GroomLimits{}.group_count_max + 1);
  std::iota(ids.begin(), ids.end(), 0);
  const ImportedStrands many =
      decoded({row("hair", ids.size(), {}, {attribute<std::int32_t>("groom_group_id", "uni", ids)})});
  EXPECT_THAT(many.group_names, IsEmpty());
  EXPECT_THAT(many.doubts, ElementsAre(StartsWith(std::to_string(ids.size()) + " groups are more")));
}

// Guides steer hair in other programs and are not drawn. They count as hair only when a file has nothing else.
TEST(Alembic, groups_are_divided_and_guides_beside_strands_left_out) {
  const AbcObj hair = row("hair", 4, {},
                          {test::texts("groom_group_name", "uni", {"a", "b", "a", "guides"}),
                           attribute<std::uint8_t>("groom_guide", "uni", {0, 0, 0, 1})});
  const std::vector<StrandGroup> groups = divide_groups(decoded({hair}));
  ASSERT_EQ(groups.size(), 2u);
  EXPECT_EQ(groups[0].name, "a");
  EXPECT_EQ(groups[0].strands.strand_count(), 2u);
  EXPECT_EQ(groups[0].strands.points[3], Vec3f(2, 0, 0.5f));
  EXPECT_EQ(groups[1].strands.strand_count(), 1u);
  EXPECT_THAT(groups[0].strands.notes, Contains("1 guide beside 3 strands are left out"));
  const ImportedStrands guides = decoded({row("hair", 2, {}, {attribute<std::int32_t>("groom_guide", "con", {1})})});
  EXPECT_THAT(guides.notes, Contains(StartsWith("all curves are guides")));
  EXPECT_EQ(divide_groups(guides)[0].strands.strand_count(), 2u);
}

// Visibility in Alembic: 0 is hidden, 1 is shown, and -1 defers to the object above.
TEST(Alembic, hidden_curves_are_left_out_and_deferring_ones_are_as_those_above) {
  const auto visible = [](std::int8_t value) { return numbers<std::int8_t>("visible", {{value}}, 1, 1); };
  const auto with = [&](AbcObj object, std::int8_t value) {
    object.properties.push_back(visible(value));
    return object;
  };
  const ImportedStrands strands =
      decoded({row("shown", 1), with(row("hidden", 1), 0), with(row("deferred", 1), -1), with(row("set", 1), 1),
               with(xform("x", {}, {}, {with(row("below", 1), -1)}), 0)});
  EXPECT_EQ(strands.strand_count(), 3u);
  EXPECT_THAT(strands.notes, Contains("hidden curves are left out: /hidden, /x/below"));
  EXPECT_EQ(refusal({with(row("hair", 1), 0)}), "no curves: all are hidden: /hair");
}

TEST(Alembic, archives_without_curves_say_what_they_have) {
  EXPECT_EQ(refusal(std::vector<AbcObj>()), "no curves: it is empty");
  EXPECT_EQ(refusal({test::object_of("a", "AbcGeom_PolyMesh_v1"), test::object_of("b", "AbcGeom_Camera_v1"),
                     test::object_of("c", "AbcGeom_Camera_v1")}),
            "no curves: it has 1 mesh, 2 cameras");
  EXPECT_EQ(refusal({curves("none", {}, {{}})}), "no curves: 1 object for curves, without any");
}

// One broken strand of thousands must not cost the whole hairstyle, but its owner must hear of it.
TEST(Alembic, one_bad_curve_is_named_and_the_others_are_read) {
  std::vector<float> points = row_of_strands(4);
  points[3 * 4] = std::nanf("");
  const ImportedStrands strands = decoded({curves("hair", {3, 3, 0, 3, 3, 1}, {points})});
  EXPECT_EQ(strands.strand_count(), 3u);
  EXPECT_EQ(strands.points[3], Vec3f(2, 0, 0.5f));
  EXPECT_THAT(strands.doubts,
              ElementsAre("3 of 6 curves are left out: curve 1 of /hair has a coordinate that is not finite, or is "
                          "beyond 1e30, curve 2 of "
                          "/hair has no points, from curve 5 on, the curves of /hair have more points than the file"));
  EXPECT_EQ(decoded({curves("hair", {3, -1, 3}, {row_of_strands(3)})}).strand_count(), 1u);
  EXPECT_EQ(decoded({curves("hair", {3, 2'000'000'000, 3}, {row_of_strands(3)})}).strand_count(), 1u);
  EXPECT_THAT(decoded({curves("hair", {3}, {row_of_strands(3)})}).doubts,
              ElementsAre("/hair has 6 points behind its last curve"));
  EXPECT_THAT(decoded({row("good", 1), curves("short", {3}, {row_of_strands(1)}, kBspline)}).doubts,
              ElementsAre(HasSubstr("curve 0 of /short has 3 points, where a B-spline curve has at least 4")));
  EXPECT_EQ(refusal({curves("hair", {0, 0}, {{}})}),
            "none of its 2 curves can be read: curve 0 of /hair has no points, curve 1 of /hair has no points");
  AbcObj without = row("odd", 1);
  without.properties[0].children.erase(without.properties[0].children.begin());
  EXPECT_THAT(decoded({row("good", 1), without}).doubts, ElementsAre("objects of curves are left out: /odd has no P"));
}

TEST(Alembic, curves_that_move_give_their_points_at_each_time) {
  std::vector<float> later = row_of_strands(2);
  for (std::size_t i = 0; i < later.size(); i += 3) later[i] += 4;
  const AbcObj hair = curves("hair", {3, 3}, {row_of_strands(2), later, row_of_strands(2)});
  AbcFile file;
  // The first sample is at 2 s, and the writer's cycle of 0.5 s gives the others.
  file.stored_times_s = {2};
  file.top.children = {xform("t", {0x10}, {{0, 1, 0}, {0, 3, 0}}, {hair}), row("still", 1)};
  const AbcBytes bytes = AbcWriter(file).write();
  EXPECT_THAT(decoded(bytes).notes, Contains("curves that move are taken as they begin: /t/hair"));
  const auto motion = decode_alembic_motion(bytes);
  ASSERT_TRUE(motion) << motion.error();
  EXPECT_THAT(motion->times_s, ElementsAre(2, 2.5, 3));
  ASSERT_EQ(motion->points.size(), 3u);
  for (const auto& points : motion->points) EXPECT_EQ(points.size(), 9u);
  EXPECT_EQ(motion->points[0], decoded(bytes).points);
  expect_near(motion->points[1][4], Vec3f(5, 4, 0.25f));
  expect_near(motion->points[2][4], Vec3f(1, 4, 0.25f));
  expect_near(motion->points[2][7], Vec3f(0, 1, 0));
}

TEST(Alembic, samples_that_repeat_are_stored_once) {
  AbcObj hair = curves("hair", {3}, {row_of_strands(1), std::vector<float>(9, 1.f), row_of_strands(1)});
  test::AbcProp& positions = hair.properties[0].children[0];
  // The first four of 10 samples are alike, and those from the sixth on.
  positions.sample_count = 10;
  positions.first_changed = 4;
  positions.last_changed = 5;
  AbcFile file;
  file.top.children = {hair};
  const auto motion = decode_alembic_motion(AbcWriter(file).write());
  ASSERT_TRUE(motion) << motion.error();
  EXPECT_THAT(motion->times_s, ElementsAre(0, 1.5, 2, 2.5, 4.5)) << "the last of all samples ends the motion";
  EXPECT_EQ(motion->points[1], motion->points[0]);
  expect_near(motion->points[2][0], Vec3f(1, 1, 1));
  EXPECT_EQ(motion->points[3], motion->points[0]);
  EXPECT_EQ(motion->points[4], motion->points[0]);
}

TEST(Alembic, times_of_any_kind_are_used) {
  const AbcObj hair = curves("hair", {3}, {row_of_strands(1), std::vector<float>(9, 1.f), row_of_strands(1)});
  const auto times = [&](double cycle_s, std::vector<double> stored) {
    AbcFile file;
    file.top.children = {hair};
    file.cycle_s = cycle_s;
    file.stored_times_s = std::move(stored);
    const auto motion = decode_alembic_motion(AbcWriter(file).write());
    return motion ? motion->times_s : std::vector<double>();
  };
  EXPECT_THAT(times(0.25, {1}), ElementsAre(1, 1.25, 1.5));
  EXPECT_THAT(times(1, {0, 0.125}), ElementsAre(0, 0.125, 1)) << "two in each cycle";
  // A cycle of this length is Alembic's sign that times do not repeat.
  EXPECT_THAT(times(std::numeric_limits<double>::max() / 32, {0, 3, 7}), ElementsAre(0, 3, 7)) << "without a cycle";
}

TEST(Alembic, curves_that_change_their_points_are_taken_as_they_begin) {
  AbcObj growing = curves("growing", {3}, {row_of_strands(1), row_of_strands(2)});
  growing.properties[0].children[1] = numbers<std::int32_t>("nVertices", {{3}, {3, 3}});
  const AbcBytes bytes = abc_file({growing});
  const ImportedStrands strands = decoded(bytes);
  EXPECT_EQ(strands.strand_count(), 1u);
  EXPECT_THAT(strands.notes, Contains(HasSubstr("those of the first sample are taken: /growing")));
  const auto motion = decode_alembic_motion(bytes);
  ASSERT_TRUE(motion) << motion.error();
  EXPECT_THAT(motion->times_s, IsEmpty());
}

TEST(Alembic, words_of_properties_may_come_from_the_table) {
  AbcFile file;
  file.metadata_table = {"geoScope=uni;isGeomParam=true"};
  file.top.children = {row("hair", 2, {attribute<float>("width", "uni", {1, 2})})};
  EXPECT_THAT(decoded(AbcWriter(file).write()).widths, ElementsAre(1, 1, 1, 2, 2, 2));
}

TEST(Alembic, other_versions_and_containers_are_refused_by_name) {
  const auto versions = [](std::uint32_t file_version, std::uint32_t library_version) {
    AbcFile file;
    file.file_version = file_version;
    file.library_version = library_version;
    return refusal(AbcWriter(file).write());
  };
  // The library version 10805 means 1.8.5.
  EXPECT_EQ(versions(1, 10805), "the archive's version 1 is not read, only version 0");
  EXPECT_EQ(versions(0, 7), "damaged: there is no Alembic of version 7");
  EXPECT_EQ(versions(0, 0xffffffff), "damaged: there is no Alembic of version 4294967295");
  AbcBytes bytes = abc_file({row("hair", 1)});
  const auto with = [&](std::size_t at, unsigned value) {
    AbcBytes changed = bytes;
    changed[at] = static_cast<std::byte>(value);
    return refusal(changed);
  };
  // After the word Ogawa, byte 5 is 0xff once a file is complete, and bytes 6 and 7 are the version.
  EXPECT_EQ(with(0, 'o'), "not an Alembic file: it does not begin with Ogawa");
  EXPECT_EQ(with(5, 0), "was not written to its end: export it again");
  EXPECT_EQ(with(6, 0xf1), "Ogawa version 61697 is not read, only version 1");
  EXPECT_EQ(refusal(AbcBytes()), "not an Alembic file: it does not begin with Ogawa");
  AbcBytes hdf5;
  test::append_text(hdf5, "\x89HDF\r\n\x1a\n");
  EXPECT_EQ(refusal(hdf5), "HDF5 Alembic is not read: export it as Ogawa");
  OgawaWriter other;
  const std::uint64_t root = other.group({OgawaWriter::kEmptyData});
  EXPECT_EQ(refusal(other.finish(root)), "an Ogawa file, but not an Alembic archive");
}

// Makes hair on the upper half of a head of 9 units (cm), which hangs down at its back. A coordinate of the last
// curve is no number.
AbcBytes hair_of_a_head() {
  std::vector<float> points;
  std::vector<std::int32_t> counts(200, 8);
  for (int s = 0; s < 200; ++s) {
    const float y = (static_cast<float>(s) + 0.5f) / 200, ring = std::sqrt(1 - y * y);
    // The golden angle spreads the strands evenly over the half ball.
    const float angle = 2.39996f * static_cast<float>(s);
    for (int i = 0; i < 8; ++i) {
      const float along = static_cast<float>(i) / 7, out = 9 + 4 * along;
      points.insert(points.end(), {out * ring * std::cos(angle), out * y - 12 * along * along,
                                   out * ring * std::sin(angle) - 8 * along * along});
    }
  }
  points.back() = std::nanf("");
  return abc_file({curves("hair", counts, {points})});
}

TEST(Alembic, an_import_says_what_was_read_and_a_strict_one_refuses_what_was_left_out) {
  const auto imported = [](bool is_strict) {
    HairParts parts;
    parts.name = "head";
    parts.strands.push_back({decoded(hair_of_a_head()), "head", "head.abc"});
    HairImport import;
    import.strict = is_strict;
    return import_hair_parts(std::move(parts), import);
  };
  // The last of the 200 curves of hair_of_a_head() cannot be read.
  const auto lax = imported(false);
  ASSERT_TRUE(lax) << lax.error();
  EXPECT_EQ(lax->groom.strand_count(), 199u);
  EXPECT_THAT(lax->warnings.front(), StartsWith("head.abc: taken as up "));
  EXPECT_THAT(lax->warnings,
              Contains("head.abc: Alembic 1.8.5 of hairnet test: 199 curves of 1592 points in 1 object"));
  EXPECT_THAT(lax->warnings, Contains(HasSubstr("head.abc: 1 of 200 curves are left out: curve 199 of /hair")));
  EXPECT_EQ(lax->placement.unit_m, 0.01);
  const auto strict = imported(true);
  ASSERT_FALSE(strict);
  EXPECT_THAT(strict.error(), HasSubstr("1 of 200 curves are left out"));
}

struct RealArchive {
  const char* file;
  std::size_t strands, controls, objects;
  const char* line;
};

TEST(AlembicFiles, real_ones_have_the_counts_that_their_list_says) {
  const std::filesystem::path folder = test::shared_data() / "import" / "abc";
  if (!std::filesystem::exists(folder)) GTEST_SKIP() << "no real archives at " << folder;
  const RealArchive archives[]{
      {"cortex_curves.abc", 3, 17, 3, "Alembic 1.6.1: 3 curves of 17 points in 3 objects"},
      {"maya_curves_pivots.abc", 6, 155, 6,
       "Alembic 1.7.5 of Maya 2022 AbcExport v1.0: 6 curves of 155 points in 6 objects"},
      {"c4d_tracer_growing.abc", 1, 2, 1, "Alembic 1.5.4 of Cinema4D: 1 curve of 2 points in 1 object"}};
  for (const RealArchive& archive : archives) {
    const auto strands = decode_alembic(test::file_bytes(folder / archive.file));
    ASSERT_TRUE(strands) << archive.file << ": " << strands.error();
    EXPECT_EQ(strands->strand_count(), archive.strands) << archive.file;
    EXPECT_EQ(strands->notes.front(), archive.line);
    EXPECT_THAT(strands->doubts, IsEmpty()) << archive.file;
    expect_valid(*strands);
  }
  // The periodic curve repeats its first three control points, and is closed once.
  const ImportedStrands drawn = decoded(test::file_bytes(folder / "cortex_curves.abc"));
  std::size_t closed = 0;
  for (std::size_t s = 0; s < drawn.strand_count(); ++s)
    closed += (drawn.points[drawn.strand_begin[s]] - drawn.points[drawn.strand_begin[s + 1] - 1]).norm() < 1e-5f;
  EXPECT_EQ(closed, 1u);
  EXPECT_THAT(decoded(test::file_bytes(folder / "c4d_tracer_growing.abc")).notes,
              Contains(HasSubstr("those of the first sample are taken: /Tracer/TracerSpline")));
  EXPECT_EQ(refusal(test::file_bytes(folder / "mesh_only_maya2012.abc")), "no curves: it has 1 mesh, 4 cameras");
  EXPECT_EQ(refusal(test::file_bytes(folder / "hdf5_tree.abc")), "HDF5 Alembic is not read: export it as Ogawa");
}

TEST(AlembicFiles, real_broken_ones_are_refused_at_once) {
  const std::filesystem::path folder = test::shared_data() / "import" / "abc";
  if (!std::filesystem::exists(folder)) GTEST_SKIP() << "no real archives at " << folder;
  for (const char* file : {"bad_issue256_truncated_table.abc", "bad_version.abc"}) {
    const AbcBytes bytes = test::file_bytes(folder / file);
    const auto begin = std::chrono::steady_clock::now();
    EXPECT_NE(refusal(bytes), "") << file;
    // A damaged count must not cause a long search or a large allocation before the file is refused.
    EXPECT_LT(std::chrono::steady_clock::now() - begin, std::chrono::milliseconds(100)) << file;
  }
}

}  // namespace
}  // namespace hairnet
