#include <gmock/gmock.h>

#include <cstdio>
#include <numbers>
#include <string>

#include "client/assets/import/bvh.hpp"
#include "client/assets/import/bvh_file.hpp"
#include "tests/support/import_files.hpp"

namespace hairnet {
namespace {

using testing::ElementsAre;
using testing::HasSubstr;

constexpr double kDegree = std::numbers::pi / 180;

// Returns a motion of two frames, 50 a second, of a person who faces +z. The head joint is at a height of 1.5 m. The
// first frame is the bind pose; `head_values` are the last three numbers of the second one, in the channels of `order`.
std::string person(const std::string& head_values = "0 0 0", const std::string& order = "Zrotation Xrotation Yrotation",
                   const std::string& root_values = "0 1 0 0 0 0") {
  const std::string row = root_values + " 0 0 0 0 0 0 " + head_values + "\n";
  return "HIERARCHY\nROOT Hips\n{\n OFFSET 0 1 0\n CHANNELS 6 Xposition Yposition Zposition Zrotation Xrotation "
         "Yrotation\n JOINT Chest\n {\n  OFFSET 0 0.2 0\n  CHANNELS 3 Zrotation Xrotation Yrotation\n  JOINT Neck\n  "
         "{\n   OFFSET 0 0.2 0\n   CHANNELS 3 Zrotation Xrotation Yrotation\n   JOINT Head\n   {\n    OFFSET 0 0.1 0\n "
         "   CHANNELS 3 " +
         order +
         "\n    End Site\n    {\n     OFFSET 0 0.2 0\n    }\n   }\n  }\n }\n JOINT Foot\n {\n  OFFSET 0 -1 0\n  "
         "CHANNELS 0\n }\n}\nMOTION\nFrames: 2\nFrame Time: 0.02\n0 1 0 0 0 0 0 0 0 0 0 0 0 0 0\n" +
         row;
}

std::string with(std::string text, const std::string& what, const std::string& by) {
  const std::size_t at = text.find(what);
  EXPECT_NE(at, std::string::npos) << what;
  return text.replace(at, what.size(), by);
}

std::string refusal(std::string_view text, const BvhImport& import = {}) {
  const auto motion = decode_bvh(text, import);
  return motion ? std::string() : motion.error();
}

Pose second_pose(const std::string& text, const BvhImport& import = {}) {
  const auto motion = decode_bvh(text, import);
  EXPECT_TRUE(motion) << motion.error();
  return motion ? motion->motion.poses.at(1) : Pose{};
}

// Multiplies the rotations about the axes that `order` names, from left to right: "zxy" is Rz Rx Ry.
Quat turn(double x_deg, double y_deg, double z_deg, const char* order) {
  Quat out = Quat::Identity();
  for (; *order != 0; ++order) {
    const int axis = *order - 'x';
    out = out * Quat(Eigen::AngleAxisd(Vec3(x_deg, y_deg, z_deg)[axis] * kDegree, Vec3::Unit(axis)));
  }
  return out;
}

void expect_same(const RigidTransform& a, const RigidTransform& b) {
  EXPECT_LT(a.rotation.angularDistance(b.rotation), 1e-6);
  EXPECT_LT((a.position - b.position).norm(), 1e-6);
}

TEST(ImportBvh, the_bind_pose_is_identity_rotation_at_the_head_joint) {
  const auto motion = decode_bvh(person());
  ASSERT_TRUE(motion) << motion.error();
  EXPECT_NEAR(motion->motion.rate_hz, 50, 1e-9);
  ASSERT_EQ(motion->motion.poses.size(), 2u);
  for (const Pose& pose : motion->motion.poses) {
    for (const RigidTransform& bone : pose.bones) expect_same(bone, {Quat::Identity(), Vec3(0, 1.5, 0)});
  }
}

TEST(ImportBvh, a_known_yaw_of_the_head_joint_is_the_heads_yaw) {
  const Pose pose = second_pose(person("0 0 30"));
  expect_same(pose.head(), {turn(0, 30, 0, "y"), Vec3(0, 1.5, 0)});
  EXPECT_GT(pose.head().vector(Vec3::UnitZ()).x(), 0.49) << "positive yaw turns the face to +x";
  expect_same(pose[Bone::neck], {Quat::Identity(), Vec3(0, 1.5, 0)});
  expect_same(pose[Bone::upper_trunk], {Quat::Identity(), Vec3(0, 1.5, 0)});
}

TEST(ImportBvh, a_turn_of_the_root_turns_all_bones_about_it) {
  const Pose pose = second_pose(person("0 0 0", "Zrotation Xrotation Yrotation", "3 1 2 0 90 0"));
  for (const RigidTransform& bone : pose.bones) expect_same(bone, {turn(90, 0, 0, "x"), Vec3(3, 1, 2.5)});
}

TEST(ImportBvh, rotations_apply_in_the_files_order) {
  expect_same(second_pose(person("20 30 40", "Zrotation Xrotation Yrotation")).head(),
              {turn(30, 40, 20, "zxy"), Vec3(0, 1.5, 0)});
  expect_same(second_pose(person("20 30 40", "Xrotation Yrotation Zrotation")).head(),
              {turn(20, 30, 40, "xyz"), Vec3(0, 1.5, 0)});
  expect_same(second_pose(person("20 30 40", "Yrotation Xrotation Zrotation")).head(),
              {turn(30, 20, 40, "yxz"), Vec3(0, 1.5, 0)});
}

TEST(ImportBvh, positions_of_a_joint_with_six_channels_take_its_offsets_place) {
  const std::string six = with(person("0.1 0.15 0.2 0 0 0"), "CHANNELS 3 Zrotation Xrotation Yrotation\n    End",
                               "CHANNELS 6 Xposition Yposition Zposition Zrotation Xrotation Yrotation\n    End");
  const auto motion = decode_bvh(with(six, "0 0 0 0 0 0 0 0 0\n", "0 0 0 0 0 0 0 0.1 0 0 0 0\n"));
  ASSERT_TRUE(motion) << motion.error();
  expect_same(motion->motion.poses[0].head(), {Quat::Identity(), Vec3(0, 1.5, 0)});
  expect_same(motion->motion.poses[1].head(), {Quat::Identity(), Vec3(0.1, 1.55, 0.2)});
}

TEST(ImportBvh, unit_and_axes_become_metres_with_y_up_and_z_out_of_the_face) {
  // The same person in inches, seen in axes where up is z and the face looks along -y.
  const std::string turned =
      "HIERARCHY ROOT Hips { OFFSET 0 0 40 CHANNELS 6 Xposition Yposition Zposition Zrotation Xrotation Yrotation "
      "JOINT "
      "Head { OFFSET 0 0 20 CHANNELS 3 Zrotation Xrotation Yrotation End Site { OFFSET 0 0 4 } } }\nMOTION Frames: 2 "
      "Frame Time: 0.1\n0 0 40 0 0 0 0 0 0\n10 -20 40 0 0 0 90 0 0\n";
  BvhImport import;
  import.up = Axis::plus_z;
  import.face = Axis::minus_y;
  import.unit_m = 0.0254;
  const Pose pose = second_pose(turned, import);
  expect_same(pose.head(), {turn(0, 90, 0, "y"), 0.0254 * Vec3(10, 60, 20)});
  import.face = Axis::plus_z;
  EXPECT_THAT(refusal(turned, import), HasSubstr("same axis"));
  import.face = Axis::minus_y;
  for (const double unit : {0.0, -1.0, std::numeric_limits<double>::quiet_NaN()}) {
    import.unit_m = unit;
    EXPECT_THAT(refusal(turned, import), HasSubstr("unit"));
  }
}

// With a unit of 1 cm the head joint of this person is at 1.5 cm. The warning must name a unit that mends this.
TEST(ImportBvh, warns_of_a_skeleton_that_is_no_person_with_a_unit_that_makes_it_one) {
  BvhImport import;
  import.unit_m = 0.01;
  const auto motion = decode_bvh(person(), import);
  ASSERT_TRUE(motion);
  const auto warning = std::ranges::find_if(
      motion->warnings, [](const std::string& text) { return text.find("--unit") != std::string::npos; });
  ASSERT_NE(warning, motion->warnings.end());
  import.unit_m = std::stod(warning->substr(warning->find("--unit") + 6));
  const auto again = decode_bvh(person(), import);
  ASSERT_TRUE(again);
  for (const std::string& text : again->warnings) EXPECT_THAT(text, testing::Not(HasSubstr("--unit")));
}

TEST(ImportBvh, finds_joints_by_usual_names_and_reports_them) {
  const auto motion = decode_bvh(with(person(), "JOINT Head", "JOINT mixamorig:Head"));
  ASSERT_TRUE(motion) << motion.error();
  // The joints have the order of Bone: head, neck, left and right shoulder, upper trunk. The file has no shoulders.
  EXPECT_THAT(motion->joints, ElementsAre("mixamorig:Head", "Neck", "", "", "Chest"));
  EXPECT_EQ(std::ranges::count_if(motion->warnings, [](const auto& w) { return w.find("shoulder") != w.npos; }), 2);
}

TEST(ImportBvh, takes_named_joints_and_refuses_names_that_are_not_there) {
  const std::string text = with(person("0 0 30"), "JOINT Head", "JOINT Skull");
  EXPECT_THAT(refusal(text), HasSubstr("Skull")) << "the reason lists the names there are";
  BvhImport import;
  import.joint_names[0] = "Skull";
  expect_same(second_pose(text, import).head(), {turn(0, 30, 0, "y"), Vec3(0, 1.5, 0)});
  import.joint_names[2] = "Wing";
  EXPECT_THAT(refusal(text, import), HasSubstr("Wing"));
}

TEST(ImportBvh, names_of_joints_in_other_scripts_are_shown_and_found) {
  const std::string kanji = with(with(person("0 20 0"), "Head", "\u982d"), "Chest", "\u80f8\u202e\x01");
  EXPECT_THAT(refusal(kanji), HasSubstr("\u982d"));
  EXPECT_THAT(refusal(kanji), HasSubstr("\u80f8\\u202e\\u0001")) << "nothing that turns or ends the line";
  BvhImport import;
  import.joint_names[0] = "\u982d";
  const auto motion = decode_bvh(kanji, import);
  ASSERT_TRUE(motion) << motion.error();
  EXPECT_EQ(motion->joints[0], "\u982d") << "and not another joint without a Latin letter";
  EXPECT_THAT(refusal(with(person(), "MOTION", "\xffMOTION")), HasSubstr("\\xffMOTION"));
}

TEST(ImportBvh, windows_line_ends_and_tabs_change_nothing) {
  std::string windows;
  for (const char letter : person("20 30 40"))
    windows += letter == '\n' ? "\r\n" : letter == ' ' ? "\t" : std::string(1, letter);
  const Pose a = second_pose(person("20 30 40")), b = second_pose(windows);
  for (std::size_t i = 0; i < kBoneCount; ++i) expect_same(a.bones[i], b.bones[i]);
}

TEST(ImportBvh, refuses_every_truncation_with_a_reason) {
  const std::string whole = person("0 0 x0");
  // Cut inside the last number, the rest may still be a number.
  const std::size_t last = whole.find_last_of(' ');
  for (std::size_t length = 0; length <= last; ++length)
    EXPECT_NE(refusal(std::string(whole, 0, length)), "") << length;
}

TEST(ImportBvh, any_corrupt_byte_is_refused_or_gives_valid_poses) {
  const std::string whole = person("20 30 40");
  for (std::size_t at = 0; at < whole.size(); ++at) {
    for (const char byte : {'\0', ' ', '\n', '{', '}', '-', '.', '9', 'e', 'n', 'J', '\x7f', '\xff'}) {
      std::string text = whole;
      text[at] = byte;
      const auto motion = decode_bvh(text);
      if (motion) {
        EXPECT_FALSE(motion->motion.poses.empty());
        EXPECT_TRUE(std::ranges::all_of(motion->motion.poses, is_valid)) << at << ' ' << byte;
        EXPECT_TRUE(motion->motion.rate_hz > 0 && std::isfinite(motion->motion.rate_hz)) << at << ' ' << byte;
      } else {
        EXPECT_NE(motion.error(), "");
      }
    }
  }
}

TEST(ImportBvh, refuses_numbers_that_are_not_finite_and_names_the_line) {
  for (const char* bad : {"nan", "inf", "-inf", "1e400", "1e39", "--1", "0x1", "1,5"}) {
    // The second frame is line 35 of person(), and the offset of the chest is in line 8.
    EXPECT_THAT(refusal(person("0 0 " + std::string(bad))), HasSubstr("line 35")) << bad;
  }
  EXPECT_THAT(refusal(with(person(), "OFFSET 0 0.2 0", "OFFSET 0 nan 0")), HasSubstr("line 8"));
}

TEST(ImportBvh, huge_positions_are_refused_and_huge_angles_give_valid_poses) {
  for (const std::string huge : {"1e30", "-3e38"}) {
    EXPECT_THAT(refusal(person("0 0 0", "Zrotation Xrotation Yrotation", huge + " 1 0 0 0 0")), HasSubstr("too large"));
    const auto turned = decode_bvh(person("0 0 " + huge));
    ASSERT_TRUE(turned) << huge << ": " << turned.error();
    EXPECT_EQ(turned->motion.poses.size(), 2u);
    EXPECT_TRUE(std::ranges::all_of(turned->motion.poses, is_valid)) << huge;
  }
}

TEST(ImportBvh, refuses_poses_that_are_not_finite_once_rounded_to_float) {
  BvhImport import;
  // Coordinates may be up to kFarthest_m, 1e6 m, away (bvh.cpp).
  import.unit_m = 1000;
  const std::string far = person("0 0 0", "Zrotation Xrotation Yrotation", "3e38 1 0 0 0 0");
  EXPECT_THAT(refusal(far, import), HasSubstr("too large"));
  import.unit_m = 1;
  EXPECT_THAT(refusal(person("0 0 0", "Zrotation Xrotation Yrotation", "2e6 1 0 0 0 0"), import),
              HasSubstr("too large"));
  EXPECT_EQ(refusal(person("0 0 0", "Zrotation Xrotation Yrotation", "9e5 1 0 0 0 0"), import), "");
}

// A count beyond the file's rows would read past its end or take memory without end.
TEST(ImportBvh, refuses_absurd_counts_and_times) {
  for (const char* count :
       {"0", "-1", "1", "3", "4294967295", "18446744073709551615", "99999999999999999999", "x", "2.5"}) {
    EXPECT_NE(refusal(with(person(), "Frames: 2", "Frames: " + std::string(count))), "") << count;
  }
  for (const char* time : {"0", "-0.02", "nan", "inf", "1e9", "x"}) {
    EXPECT_NE(refusal(with(person(), "Time: 0.02", "Time: " + std::string(time))), "") << time;
  }
  for (const char* count : {"-1", "7", "4294967295"}) {
    EXPECT_NE(refusal(with(person(), "CHANNELS 6", "CHANNELS " + std::string(count))), "") << count;
  }
}

TEST(ImportBvh, a_frame_time_too_small_for_a_rate_is_refused) {
  for (const char* time : {"1e-320", "1e-300", "1e-30"}) {
    EXPECT_NE(refusal(with(person(), "Time: 0.02", "Time: " + std::string(time))), "") << time;
  }
}

TEST(ImportBvh, refuses_joints_nested_deeper_than_256_and_takes_256) {
  // The same as in bvh_file.cpp.
  constexpr int kDepthMax = 256;
  const auto nested = [](int depth) {
    std::string text = "HIERARCHY ROOT Head { OFFSET 0 1 0 CHANNELS 3 Zrotation Xrotation Yrotation ";
    for (int i = 1; i < depth; ++i) text += "JOINT j { OFFSET 0 0 0 ";
    for (int i = 0; i < depth; ++i) text += "} ";
    return text + "MOTION Frames: 1 Frame Time: 0.1 0 0 0";
  };
  EXPECT_EQ(refusal(nested(kDepthMax)), "");
  EXPECT_THAT(refusal(nested(kDepthMax + 1)), HasSubstr(std::to_string(kDepthMax)));
  EXPECT_NE(refusal(nested(100'000)), "");
}

TEST(ImportBvh, work_stays_in_proportion_to_the_file) {
  // The file has many joints without channels, and many frames of one value. Joints times frames are 9e9, far more than
  // the file has bytes; the limit on processor time fails the case if the work is that large.
  std::string text = "HIERARCHY ROOT Head { OFFSET 0 1 0 CHANNELS 1 Xrotation ";
  constexpr int kJoints = 30'000, kFrames = 300'000;
  for (int i = 0; i < kJoints; ++i) text += "JOINT j { } ";
  text += "} MOTION Frames: " + std::to_string(kFrames) + " Frame Time: 0.1";
  for (int i = 0; i < kFrames; ++i) text += " 0";
  const auto motion = decode_bvh(text);
  ASSERT_TRUE(motion) << motion.error();
  EXPECT_EQ(motion->motion.poses.size(), static_cast<std::size_t>(kFrames));
}

TEST(ImportBvh, refuses_what_is_no_bvh) {
  for (const char* text : {"", " \r\n", "MOTION", "HIERARCHY", "HIERARCHY MOTION Frames: 1 Frame Time: 1",
                           "HIERARCHY ROOT {", "HIERARCHY ROOT Head { } MOTION Frames: 1 Frame Time: 1 0",
                           "HIERARCHY ROOT Head { End Site { } }", "HIERARCHY ROOT Head { JOINT"}) {
    EXPECT_NE(refusal(text), "") << text;
  }
}

TEST(ImportBvh, a_reason_is_one_short_line) {
  const std::string many = with(person(), "JOINT Head", "JOINT " + std::string(100'000, '\x01'));
  const std::string reason = refusal(many);
  EXPECT_NE(reason, "");
  EXPECT_LT(reason.size(), 600u);
  EXPECT_EQ(reason.find_first_of("\n\r\x01"), std::string::npos);
}

// Wrong units or axes would put the head below the floor or on its side, and hair would hang upwards.
TEST(ImportRealBvh, heads_of_real_motions_are_where_people_carry_them) {
  const auto folder = test::shared_data() / "motion";
  if (!std::filesystem::exists(folder)) GTEST_SKIP() << "no real motions at " << folder;
  for (const auto& [file, frames] :
       {std::pair{"cmu_scaled_131_01.bvh", 995u}, std::pair{"cmu_scaled_131_02.bvh", 1248u}}) {
    const auto motion = decode_bvh(test::file_text(folder / file));
    ASSERT_TRUE(motion) << file << ": " << motion.error();
    EXPECT_EQ(motion->motion.poses.size(), frames);
    EXPECT_NEAR(motion->motion.rate_hz, 120, 0.1);
    for (const std::string& joint : motion->joints) EXPECT_NE(joint, "") << file;
    EXPECT_GT(motion->motion.poses.front().head().vector(Vec3::UnitY()).y(), 0.9) << "begins upright";
    EXPECT_GT(motion->motion.poses.front().head().position.y(), 1.2);
    std::size_t standing = 0;
    for (const Pose& pose : motion->motion.poses) {
      ASSERT_TRUE(is_valid(pose));
      const double height_m = pose.head().position.y();
      EXPECT_GT(height_m, 0.5);
      EXPECT_LT(height_m, 1.9);
      standing += height_m > 1.2 && pose[Bone::upper_trunk].vector(Vec3::UnitY()).y() > 0.7;
    }
    EXPECT_GT(standing, frames * 3 / 4) << file << ": he bows now and then, and looks at the floor as he walks";
  }
}

}  // namespace
}  // namespace hairnet
