#include <gmock/gmock.h>

#include <cstdio>
#include <functional>
#include <numbers>
#include <string>

#include "client/assets/import/bvh.hpp"
#include "core/geometry/rotation_between.hpp"
#include "tests/support/import_files.hpp"

namespace hairnet {
namespace {

using testing::Contains;
using testing::ElementsAre;
using testing::HasSubstr;
using testing::IsEmpty;

constexpr double kDegree = std::numbers::pi / 180;

struct Joint {
  const char* name;
  int parent;
  // The position of the joint in an upright person who faces +z, m.
  Vec3 at;
};

const std::vector<Joint>& person() {
  static const std::vector<Joint> joints{{"Hips", -1, {0, 0.95, 0}},
                                         {"Spine", 0, {0, 1.1, 0}},
                                         {"Chest", 1, {0, 1.25, -0.01}},
                                         {"Neck", 2, {0, 1.45, -0.02}},
                                         {"Head", 3, {0, 1.55, 0}},
                                         {"LeftShoulder", 2, {0.04, 1.4, 0}},
                                         {"LeftArm", 5, {0.18, 1.4, 0}},
                                         {"LeftForeArm", 6, {0.45, 1.4, 0}},
                                         {"RightShoulder", 2, {-0.04, 1.4, 0}},
                                         {"RightArm", 8, {-0.18, 1.4, 0}},
                                         {"RightForeArm", 9, {-0.45, 1.4, 0}},
                                         {"LeftUpLeg", 0, {0.09, 0.9, 0}},
                                         {"LeftFoot", 11, {0.1, 0.08, 0}},
                                         {"RightUpLeg", 0, {-0.09, 0.9, 0}},
                                         {"RightFoot", 13, {-0.1, 0.08, 0}}};
  return joints;
}

constexpr std::size_t kHead = 4, kChest = 2, kLeftShoulder = 5;

Quat turn(double degrees, const Vec3& axis) {
  return Quat(Eigen::AngleAxisd(degrees * kDegree, axis));
}

// Says how a file describes that person. The zero pose of a file depends on the axes that each joint has when the
// person is upright.
struct TestMotion {
  std::function<Quat(std::size_t)> axes = [](std::size_t) { return Quat::Identity(); };
  // Turns the person's axes to the file's.
  Quat file = Quat::Identity();
  double unit_m = 1;
  // Each joint's bone is turned so from upright, in the person's axes.
  std::vector<std::function<Quat(std::size_t)>> frames;
};

// Each joint's x axis points along the bone to its first child, as in files of 3D programs: the zero pose is one line.
Quat along_bone(std::size_t joint) {
  for (const Joint& child : person()) {
    if (child.parent == static_cast<int>(joint))
      return rotation_between<double>(Vec3::UnitX(), child.at - person()[joint].at);
  }
  return joint == 0 ? Quat::Identity() : along_bone(static_cast<std::size_t>(person()[joint].parent));
}

// These are frames: how far each joint is turned from upright. head_left turns the head alone by 40 degrees, and bowed
// bends the whole person forwards by 80.
Quat upright(std::size_t) {
  return Quat::Identity();
}
Quat head_left(std::size_t joint) {
  return joint == kHead ? turn(40, Vec3::UnitY()) : Quat::Identity();
}
Quat bowed(std::size_t) {
  return turn(80, Vec3::UnitX());
}

void write(const TestMotion& made, std::size_t joint, std::string& out) {
  const std::vector<Joint>& joints = person();
  const int parent = joints[joint].parent;
  Vec3 offset = made.file * joints[joint].at / made.unit_m;
  if (parent >= 0) {
    const auto p = static_cast<std::size_t>(parent);
    offset = made.axes(p).conjugate() * (joints[joint].at - joints[p].at) / made.unit_m;
  }
  char text[160];
  std::snprintf(text, sizeof text, "%s %s {\n OFFSET %.9g %.9g %.9g\n CHANNELS %s Zrotation Xrotation Yrotation\n",
                parent < 0 ? "ROOT" : "JOINT", joints[joint].name, offset.x(), offset.y(), offset.z(),
                parent < 0 ? "6 Xposition Yposition Zposition" : "3");
  out += text;
  for (std::size_t child = 0; child < joints.size(); ++child) {
    if (joints[child].parent == static_cast<int>(joint)) write(made, child, out);
  }
  out += "}\n";
}

void write_values(const TestMotion& made, const std::function<Quat(std::size_t)>& frame, std::size_t joint,
                  std::string& out) {
  const std::vector<Joint>& joints = person();
  const int parent = joints[joint].parent;
  const auto axes = [&](std::size_t j) { return made.file * frame(j) * made.axes(j); };
  Quat local = axes(joint);
  char text[160];
  if (parent < 0) {
    const Vec3 at = made.file * joints[joint].at / made.unit_m;
    std::snprintf(text, sizeof text, "%.9g %.9g %.9g ", at.x(), at.y(), at.z());
    out += text;
  } else {
    local = axes(static_cast<std::size_t>(parent)).conjugate() * local;
  }
  const Vec3 zxy = local.toRotationMatrix().eulerAngles(2, 0, 1) / kDegree;
  std::snprintf(text, sizeof text, "%.9g %.9g %.9g ", zxy[0], zxy[1], zxy[2]);
  out += text;
  for (std::size_t child = 0; child < joints.size(); ++child) {
    if (joints[child].parent == static_cast<int>(joint)) write_values(made, frame, child, out);
  }
}

std::string bvh(const TestMotion& made) {
  std::string out = "HIERARCHY\n";
  write(made, 0, out);
  out += "MOTION\nFrames: " + std::to_string(made.frames.size()) + "\nFrame Time: 0.02\n";
  for (const auto& frame : made.frames) {
    write_values(made, frame, 0, out);
    out += '\n';
  }
  return out;
}

Vec3 head_joint(const std::function<Quat(std::size_t)>& frame) {
  Vec3 at = person()[0].at;
  for (const auto& [joint, parent] : {std::pair<std::size_t, std::size_t>{1, 0}, {2, 1}, {3, 2}, {4, 3}})
    at += frame(parent) * (person()[joint].at - person()[parent].at);
  return at;
}

// Expects every bone to turn as its joint does in the person, whatever axes the file has, and the head joint to be
// where the joints put it.
void expect_same_motion(const TestMotion& made, const ImportedMotion& imported) {
  const Quat to_world = rotation_between<double>(made.file * Vec3::UnitY(), Vec3::UnitY()) * made.file;
  ASSERT_EQ(imported.motion.poses.size(), made.frames.size());
  for (std::size_t f = 0; f < made.frames.size(); ++f) {
    const Pose& pose = imported.motion.poses[f];
    for (const auto& [bone, joint] : {std::pair{Bone::head, kHead}, std::pair{Bone::upper_trunk, kChest},
                                      std::pair{Bone::left_shoulder, kLeftShoulder}}) {
      EXPECT_LT(pose[bone].rotation.angularDistance(to_world * made.frames[f](joint)), 1e-5)
          << f << ' ' << kBoneNames[static_cast<std::size_t>(bone)];
    }
    EXPECT_LT((pose.head().position - to_world * head_joint(made.frames[f])).norm(), 1e-5) << f;
  }
}

Result<ImportedMotion> imported(const TestMotion& made, const BvhImport& import = {}) {
  return decode_bvh(bvh(made), import);
}

TEST(ImportRestPose, an_upright_zero_pose_is_the_rest_without_a_word) {
  const TestMotion made{.frames = {bowed, head_left}};
  const auto motion = imported(made);
  ASSERT_TRUE(motion) << motion.error();
  expect_same_motion(made, *motion);
  EXPECT_THAT(motion->warnings, IsEmpty());
}

TEST(ImportRestPose, the_first_frame_is_the_rest_where_zero_bones_lie_along_x) {
  const TestMotion made{.axes = along_bone, .frames = {upright, head_left, bowed}};
  const auto motion = imported(made);
  ASSERT_TRUE(motion) << motion.error();
  expect_same_motion(made, *motion);
  EXPECT_THAT(motion->warnings, ElementsAre(HasSubstr("the first frame is taken as the rest pose")));
}

TEST(ImportRestPose, the_first_frame_is_the_rest_where_the_zero_pose_lies) {
  for (const double degrees : {90.0, -90.0}) {
    const TestMotion made{.axes = [&](std::size_t) { return turn(degrees, Vec3::UnitX()); },
                          .frames = {upright, head_left, bowed}};
    const auto motion = imported(made);
    ASSERT_TRUE(motion) << motion.error();
    expect_same_motion(made, *motion);
    EXPECT_THAT(motion->warnings, ElementsAre(HasSubstr("the first frame is taken as the rest pose")));
  }
}

TEST(ImportRestPose, a_first_frame_that_faces_any_way_gives_the_facing) {
  for (const double degrees : {20.0, 90.0, 180.0, -130.0}) {
    const TestMotion made{.axes = along_bone, .file = turn(degrees, Vec3::UnitY()), .frames = {upright, head_left}};
    const auto motion = imported(made);
    ASSERT_TRUE(motion) << motion.error();
    expect_same_motion(made, *motion);
  }
}

TEST(ImportRestPose, left_and_right_determine_where_the_zero_pose_faces) {
  for (const double degrees : {90.0, 180.0, -90.0}) {
    const TestMotion made{.file = turn(degrees, Vec3::UnitY()), .frames = {head_left, bowed}};
    // The joints have the axes of the file, so that the zero pose stands and faces that way.
    TestMotion same = made;
    same.axes = [&](std::size_t) { return made.file.conjugate(); };
    const auto motion = imported(same);
    ASSERT_TRUE(motion) << motion.error();
    expect_same_motion(same, *motion);
    EXPECT_THAT(motion->warnings, ElementsAre(HasSubstr("the rest pose faces")));
  }
}

// Programs such as Blender have +z up. The skeleton shows this, whatever axes its joints have.
TEST(ImportRestPose, z_up_is_found_from_the_skeleton) {
  TestMotion made{.file = turn(90, Vec3::UnitX()), .frames = {upright, head_left, bowed}};
  made.axes = [&](std::size_t) { return made.file.conjugate(); };
  auto motion = imported(made);
  ASSERT_TRUE(motion) << motion.error();
  expect_same_motion(made, *motion);
  EXPECT_THAT(motion->warnings, Contains(HasSubstr("+z is taken as up")));
  made.axes = along_bone;
  motion = imported(made);
  ASSERT_TRUE(motion) << motion.error();
  expect_same_motion(made, *motion);
  EXPECT_THAT(motion->warnings, Contains(HasSubstr("the first frame is taken")));
}

// No frame shows what upright is, so a guess would tilt all hair. A flag lets the user say which pose is the rest.
TEST(ImportRestPose, a_skeleton_that_is_never_upright_is_refused_and_the_flag_named) {
  const auto on_the_side = [](std::size_t) { return turn(80, Vec3::UnitZ()); };
  const TestMotion made{.axes = along_bone, .frames = {on_the_side, on_the_side}};
  const auto motion = imported(made);
  ASSERT_FALSE(motion);
  EXPECT_THAT(motion.error(), HasSubstr("--rest"));
  EXPECT_EQ(motion.error().find('\n'), std::string::npos);
  for (const RestPose rest : {RestPose::zero, RestPose::first}) {
    BvhImport import;
    import.rest = rest;
    const auto named = imported(made, import);
    ASSERT_TRUE(named) << named.error();
    EXPECT_THAT(named->warnings, Contains(HasSubstr("not upright")));
  }
}

TEST(ImportRestPose, the_flag_overrides_the_bones) {
  // The first frame bows the head; taken as the rest, that is upright.
  const auto nod = [](std::size_t joint) { return joint == kHead ? turn(30, Vec3::UnitX()) : Quat::Identity(); };
  const TestMotion made{.frames = {nod, head_left}};
  BvhImport import;
  import.rest = RestPose::first;
  const auto motion = imported(made, import);
  ASSERT_TRUE(motion) << motion.error();
  EXPECT_LT(motion->motion.poses[0].head().rotation.angularDistance(Quat::Identity()), 1e-6);
  import.rest = RestPose::zero;
  expect_same_motion(made, *imported(made, import));
}

TEST(ImportRestPose, a_unit_that_gives_the_size_of_a_person_is_used_with_a_warning) {
  for (const auto& [unit_m, name] : {std::pair{0.01, "centimetre"}, std::pair{0.001, "millimetre"},
                                     // A unit of the motion files of CMU is 1 / 0.45 inch.
                                     std::pair{0.0254, "inch"}, std::pair{0.0254 / 0.45, "CMU"}}) {
    for (const auto& axes : {std::function<Quat(std::size_t)>(upright), std::function<Quat(std::size_t)>(along_bone)}) {
      const TestMotion made{.axes = axes, .unit_m = unit_m, .frames = {upright, head_left, bowed}};
      const auto motion = imported(made);
      ASSERT_TRUE(motion) << motion.error();
      expect_same_motion(made, *motion);
      EXPECT_THAT(motion->warnings, Contains(testing::AllOf(HasSubstr(name), HasSubstr("--unit"))));
    }
  }
}

TEST(ImportRestPose, a_unit_that_is_given_is_taken_though_it_makes_a_giant) {
  const TestMotion made{.unit_m = 0.01, .frames = {upright, head_left}};
  BvhImport import;
  import.unit_m = 1;
  const auto motion = imported(made, import);
  ASSERT_TRUE(motion) << motion.error();
  EXPECT_NEAR(motion->motion.poses[0].head().position.y(), 155, 1e-3);
  EXPECT_THAT(motion->warnings, ElementsAre(HasSubstr("--unit 0.01")));
}

TEST(ImportRestPose, words_for_the_flag_are_three) {
  EXPECT_EQ(parse_rest_pose("auto").value(), RestPose::automatic);
  EXPECT_EQ(parse_rest_pose("zero").value(), RestPose::zero);
  EXPECT_EQ(parse_rest_pose("first").value(), RestPose::first);
  for (const char* text : {"", "Zero", "frame"}) EXPECT_THAT(parse_rest_pose(text).error(), HasSubstr("auto, zero"));
}

TEST(ImportRealBvh, every_file_is_upright_or_gives_a_reason) {
  if (!std::filesystem::exists(test::shared_data())) GTEST_SKIP() << "no real motions at " << test::shared_data();
  std::size_t count = 0;
  for (const auto& entry : std::filesystem::recursive_directory_iterator(test::shared_data())) {
    std::string extension = entry.path().extension().string();
    for (char& letter : extension) letter = static_cast<char>(std::tolower(static_cast<unsigned char>(letter)));
    if (!entry.is_regular_file() || extension != ".bvh") continue;
    ++count;
    const auto motion = decode_bvh(test::file_text(entry.path()));
    if (!motion) {
      std::printf("%s: %s\n", entry.path().filename().c_str(), motion.error().c_str());
      EXPECT_NE(motion.error(), "");
      EXPECT_EQ(motion.error().find('\n'), std::string::npos);
      continue;
    }
    for (const std::string& warning : motion->warnings)
      std::printf("%s: %s\n", entry.path().filename().c_str(), warning.c_str());
    const RigidTransform& head = motion->motion.poses.front().head();
    // The head must be within 60 degrees of upright, and as high as a person's head can be.
    EXPECT_GT(head.vector(Vec3::UnitY()).y(), 0.5) << entry.path();
    EXPECT_GT(head.position.y(), 0.3) << entry.path();
    EXPECT_LT(head.position.y(), 2.5) << entry.path();
  }
  EXPECT_GT(count, 0u) << "the data has BVH files";
}

}  // namespace
}  // namespace hairnet
