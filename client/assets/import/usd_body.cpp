#include <Eigen/LU>
#include <array>
#include <limits>
#include <utility>

#include "client/assets/import/imported_body.hpp"
#include "client/assets/import/parse_text.hpp"
#include "client/assets/import/usd_layer.hpp"
#include "client/assets/import/usd_transform.hpp"
#include "core/groom/groom.hpp"
#include "core/shown_text.hpp"

// The meshes of a USD file in the coordinates of its scene, where a skeleton binds them; and its skeleton's joints.
namespace hairnet {
namespace {

using Mat4 = Eigen::Matrix4d;
using usda::attribute;
using usda::Prim;

// Asked for at this time, an attribute gives its first sample.
constexpr double kAtRest = -std::numeric_limits<double>::infinity();

// What applies to a prim and to those below it.
struct PlacedPrim {
  Mat4 world = Mat4::Identity(), skel_root = Mat4::Identity();
  bool is_hidden = false;
};

// States are computed for each prim from its parent's, which precedes it.
PlacedPrim placed_below(const Prim& prim, PlacedPrim state) {
  const usda::LocalTransform local = usda::local_transform(prim);
  // The operation !resetXformStack! leaves out everything above.
  state.world = local.resets ? local.matrix : Mat4(state.world * local.matrix);
  if (prim.type == "SkelRoot") state.skel_root = state.world;
  const std::string_view active = usda::field(prim.metadata, "active");
  const std::string purpose = usda::unquoted(attribute(prim, "purpose").at(kAtRest));
  state.is_hidden = state.is_hidden || prim.specifier == "class" || prim.type == "PointInstancer" ||
                    active == "false" || active == "0" || purpose == "guide" || purpose == "proxy" ||
                    usda::unquoted(attribute(prim, "visibility").at(kAtRest)) == "invisible";
  return state;
}

Vec3 moved(const Mat4& by, const Vec3& x) {
  return by.topLeftCorner<3, 3>() * x + by.topRightCorner<3, 1>();
}

// Adds one mesh, with all its polygons as fans. Returns what is wrong; the body is then of no use.
std::string add_mesh(const Prim& prim, const PlacedPrim& state, TriangleMesh& mesh) {
  const auto counts = usda::integers(attribute(prim, "faceVertexCounts").at(kAtRest));
  const auto corners = usda::integers(attribute(prim, "faceVertexIndices").at(kAtRest));
  const auto points = usda::triples(attribute(prim, "points").at(kAtRest));
  if (!counts || !corners || !points) return "it has no faces, or no points";
  // A skeleton places what it binds. The points of a bound mesh lie in the skeleton's space after the bind transform;
  // the prim's own transform does not apply.
  const auto bound = usda::matrix_of(attribute(prim, "primvars:skel:geomBindTransform").at(kAtRest));
  const Mat4 world = bound ? Mat4(state.skel_root * *bound) : state.world;
  const std::size_t first = mesh.vertices.size();
  if (points->size() > GroomLimits{}.vertex_count_max - first)
    return "the body has more than " + std::to_string(GroomLimits{}.vertex_count_max) + " vertices: reduce it";
  for (const Vec3f& x : *points) {
    mesh.vertices.emplace_back(moved(world, x.cast<double>()).cast<float>());
    if (!mesh.vertices.back().allFinite()) return "a vertex is not finite";
  }
  // A mirrored transform turns the winding round once more.
  const bool is_left_handed = usda::unquoted(attribute(prim, "orientation").at(kAtRest)) == "leftHanded";
  const bool turns_round = is_left_handed != (world.topLeftCorner<3, 3>().determinant() < 0);
  std::size_t at = 0;
  for (const std::int64_t count : *counts) {
    // The comparison subtracts from what is left, so no sum can overflow.
    if (count < 0 || static_cast<std::uint64_t>(count) > corners->size() - at)
      return "its faceVertexCounts do not fit its faceVertexIndices";
    const std::size_t end = at + static_cast<std::size_t>(count);
    for (std::size_t i = at; i < end; ++i) {
      const std::int64_t vertex = (*corners)[i];
      if (vertex < 0 || static_cast<std::uint64_t>(vertex) >= points->size())
        return "a face has a vertex that does not exist";
      if (i < at + 2) continue;
      const auto corner = [&](std::size_t k) {
        return static_cast<std::uint32_t>(first + static_cast<std::size_t>((*corners)[k]));
      };
      mesh.triangles.push_back({corner(at), corner(turns_round ? i : i - 1), corner(turns_round ? i - 1 : i)});
    }
    at = end;
  }
  return {};
}

// The joints of a bind pose, which is the pose of the mesh. Names are paths such as Hips/Spine/Head.
void add_joints(const Prim& prim, const PlacedPrim& state, ImportedBody& body) {
  const std::vector<std::string> joints = usda::strings(attribute(prim, "joints").at(kAtRest));
  const auto binds = usda::numbers(attribute(prim, "bindTransforms").at(kAtRest));
  if (!binds || binds->size() != 16 * joints.size()) return;
  for (std::size_t j = 0; j < joints.size(); ++j) {
    const std::string_view name = std::string_view(joints[j]).substr(joints[j].rfind('/') + 1);
    const double* const row = binds->data() + 16 * j + 12;  // the last row of a matrix that is written by rows
    if (const auto bone = bone_of_joint(name))
      body.add_joint(*bone, name, moved(state.skel_root, {row[0], row[1], row[2]}));
  }
}

void read_facts(std::string_view metadata, KnownPlacement& states) {
  const std::string up = usda::unquoted(usda::field(metadata, "upAxis"));
  if (up == "X") states.up = Axis::plus_x;
  if (up == "Y") states.up = Axis::plus_y;
  if (up == "Z") states.up = Axis::plus_z;
  const auto unit_m = parse_number<double>(usda::field(metadata, "metersPerUnit"));
  if (unit_m && *unit_m > 0) states.unit_m = unit_m;
}

}  // namespace

Result<ImportedBody> decode_usd_body(std::span<const std::byte> bytes) {
  std::string unpacked;
  const Result<usda::Layer> layer = usda::open_layer(bytes, usda::Content::bodies, unpacked);
  if (!layer) return Refusal(layer.error());
  ImportedBody body;
  std::size_t hidden = 0;
  std::vector<PlacedPrim> states(layer->prims.size());
  // Prim 0 is the file itself.
  for (std::size_t p = 1; p < layer->prims.size(); ++p) {
    const Prim& prim = layer->prims[p];
    states[p] = placed_below(prim, states[prim.parent]);
    // Skeletons count even where they are hidden, since they are not drawn in any case.
    if (prim.type == "Skeleton") add_joints(prim, states[p], body);
    if (prim.type != "Mesh") continue;
    if (states[p].is_hidden) {
      ++hidden;
      continue;
    }
    if (std::string error = add_mesh(prim, states[p], body.mesh); !error.empty())
      return Refusal(shown(prim.name) + ": " + error);
  }
  if (body.mesh.triangles.empty())
    return Refusal("no mesh: " +
                   (hidden > 0 ? counted(hidden, "mesh") + " hidden" : std::string("it has no prim Mesh with faces")) +
                   "; what it refers to is not read (usdcat --flatten joins it)");
  if (hidden > 0) body.notes.push_back(counted(hidden, "mesh") + " hidden or for guidance left out");
  read_facts(layer->prims[0].metadata, body.states);
  body.state_joints();
  return body;
}

}  // namespace hairnet
