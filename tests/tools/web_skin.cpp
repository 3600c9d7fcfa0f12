#include <array>
#include <utility>
#include <vector>

#include "core/ffd/skin_push.hpp"
#include "tests/tools/web_hair.hpp"
#include "tests/tools/web_messages.hpp"
#include "tests/tools/web_random.hpp"

namespace hairnet {
namespace {

using Json = nlohmann::ordered_json;

constexpr std::size_t kPoints = 400;

// A ball: at its edge distances go on as a byte cannot say.
SkinDistanceField ball(Bone bone, const Vec3f& centre, float radius_m, const std::array<int, 3>& dims) {
  SkinDistanceField field{bone, centre - Vec3f::Constant(0.1f), 0.0125f, dims, {}};
  for (int node = 0; node < dims[0] * dims[1] * dims[2]; ++node) {
    const std::array<int, 3> at{node % dims[0], node / dims[0] % dims[1], node / (dims[0] * dims[1])};
    const Vec3f x(static_cast<float>(at[0]), static_cast<float>(at[1]), static_cast<float>(at[2]));
    const float distance_m = (field.origin + field.cell_m * x - centre).norm() - radius_m;
    field.distance.push_back(distance_of_skin_byte(skin_byte(distance_m)));
  }
  return field;
}

Json to_json(const SkinDistanceField& field) {
  std::vector<int> bytes;
  for (const float distance_m : field.distance) bytes.push_back(skin_byte(distance_m));
  return {{"bone", static_cast<int>(field.bone)},
          {"origin", std::vector<float>(field.origin.begin(), field.origin.end())},
          {"cellM", field.cell_m},
          {"dims", field.dims},
          {"bytes", bytes}};
}

}  // namespace

Json skin_case() {
  WebRandom random(31);
  const Skin skin{ball(Bone::head, {0, 0.02f, 0.01f}, 0.08f, {17, 18, 16}),
                  ball(Bone::left_shoulder, {0.12f, -0.15f, 0}, 0.06f, {16, 12, 17})};
  const SkinPush push(skin, 0.006f);
  Pose pose = rigid_pose({Quat(Eigen::AngleAxisd(0.7, Vec3(1, 2, 3).normalized())), Vec3(3, 1, -2)});
  RigidTransform& shoulder = pose[Bone::left_shoulder];
  shoulder = shoulder * RigidTransform{Quat(Eigen::AngleAxisd(0.4, Vec3(1, 0, 1).normalized())), Vec3(0, 0.04, 0.01)};
  std::vector<Vec3f> rest, points;
  std::vector<float> blend;
  for (std::size_t p = 0; p < kPoints; ++p) {
    rest.push_back(Vec3f(0.05f, -0.05f, 0) + random.vector(0.15f));
    points.push_back(rest.back() + random.vector(0.04f));
    blend.push_back(0.5f * (random.real(1) + 1));
  }
  std::vector<Vec3f> pushed = points;
  push.push(pose, rest, blend, pushed);
  Json fields = Json::array(), bones = Json::array();
  for (const SkinDistanceField& field : skin) fields.push_back(to_json(field));
  for (const RigidTransform& bone : pose.bones) {
    for (const double number : bone.rotation.coeffs()) bones.push_back(number);
    for (const double number : bone.position) bones.push_back(number);
  }
  std::vector<int> nodes;
  for (const SkinNode& node : push.nodes())
    for (const int byte : {node.distance, node.way[0], node.way[1], node.way[2]}) nodes.push_back(byte);
  return {{"skin", fields}, {"thicknessM", push.thickness_m()}, {"pose", bones},          {"rest", flat(rest)},
          {"blend", blend}, {"points", flat(points)},           {"pushed", flat(pushed)}, {"nodes", nodes}};
}

}  // namespace hairnet
