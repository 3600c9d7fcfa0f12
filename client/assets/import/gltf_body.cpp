#include <Eigen/Geometry>
#include <Eigen/LU>
#include <algorithm>
#include <array>
#include <cmath>
#include <utility>

#include "client/assets/import/draco.hpp"
#include "client/assets/import/gltf_file.hpp"
#include "client/assets/import/parse_text.hpp"
#include "core/groom/groom.hpp"
#include "core/shown_text.hpp"

// The meshes of a glTF file's scene, posed by its nodes as the file has them.
namespace hairnet {
namespace {

using gltf::Json;
using gltf::member;
using gltf::whole;
using Mat4 = Eigen::Matrix4d;

constexpr std::size_t kNone = static_cast<std::size_t>(-1);
// The limit bounds the work where a small file has very many nodes that use one mesh.
constexpr std::size_t kPrimitivesMax = 10'000;
// A vertex follows up to four joints of each set, so 16 joints at most; further sets are ignored.
constexpr std::size_t kJointSetsMax = 4;

// A node has a matrix, or translation, rotation and scale, which apply from the last to the first. glTF stores matrices
// by columns, as Eigen does.
Mat4 local_transform(const Json& node) {
  Mat4 matrix = Mat4::Identity();
  if (const auto columns = gltf::numbers(member(node, "matrix"), 16))
    return Mat4(Eigen::Map<const Mat4>(columns->data()));
  if (const auto turn = gltf::numbers(member(node, "rotation"), 4)) {
    const Quat rotation((*turn)[3], (*turn)[0], (*turn)[1], (*turn)[2]);
    if (rotation.norm() > 0) matrix.topLeftCorner<3, 3>() = rotation.normalized().toRotationMatrix();
  }
  if (const auto scale = gltf::numbers(member(node, "scale"), 3))
    matrix.topLeftCorner<3, 3>() *= Vec3((*scale)[0], (*scale)[1], (*scale)[2]).asDiagonal();
  if (const auto shift = gltf::numbers(member(node, "translation"), 3))
    matrix.topRightCorner<3, 1>() = Vec3((*shift)[0], (*shift)[1], (*shift)[2]);
  return matrix;
}

// The transform of each vertex of a skin: from the mesh to the scene, by each joint. Its skeleton's pose is that of the
// nodes, which need not be the bind pose.
struct Skin {
  std::vector<Mat4> joints;
};

// What moves the vertices of a primitive.
struct Weights {
  std::vector<gltf::Numbers> joints, weights;
};

class BodyReader {
 public:
  explicit BodyReader(gltf::File file)
      : file_(std::move(file)), nodes_(gltf::elements(member(file_.json(), "nodes"))) {}

  Result<ImportedBody> read() {
    std::string error = place_nodes();
    for (std::size_t n = 0; error.empty() && n < nodes_.size(); ++n) {
      if (is_in_scene_[n]) error = read_node(n);
    }
    if (!error.empty()) return Refusal(error);
    if (body_.mesh.triangles.empty()) return Refusal("not a body: its scene has no triangles");
    if (other_primitives_ > 0)
      body_.notes.push_back(counted(other_primitives_, "part") + " of points or lines left out");
    read_joints();
    body_.states.up = Axis::plus_y;
    body_.states.unit_m = 1;
    // Avatars of VRM 0 look along -z; all others, as glTF says, along +z.
    body_.states.face = member(member(file_.json(), "extensions"), "VRM") ? Axis::minus_z : Axis::plus_z;
    body_.state_joints();
    return std::move(body_);
  }

 private:
  // Finds the nodes' transforms, from the roots of the scene downwards. Without a scene all nodes are shown. A node
  // with two parents or within itself would make the walk endless, so both are refused before transforms are computed.
  std::string place_nodes() {
    parents_.assign(nodes_.size(), kNone);
    for (std::size_t n = 0; n < nodes_.size(); ++n) {
      for (const Json& child : gltf::elements(member(nodes_[n], "children"))) {
        const auto c = whole(&child);
        if (!c || *c >= nodes_.size()) return name_of(n) + " has a child that does not exist";
        if (parents_[*c] != kNone) return name_of(*c) + " hangs on two nodes";
        parents_[*c] = n;
      }
    }
    worlds_.assign(nodes_.size(), Mat4::Identity());
    is_placed_.assign(nodes_.size(), false);
    is_in_scene_.assign(nodes_.size(), false);
    for (std::size_t n = 0; n < nodes_.size(); ++n) {
      if (parents_[n] == kNone) place_below(n);
    }
    const auto cycle = std::ranges::find(is_placed_, false);
    if (cycle != is_placed_.end())
      return name_of(static_cast<std::size_t>(cycle - is_placed_.begin())) + " hangs on itself";
    const Json* const scene = gltf::element(file_.json(), "scenes", whole(member(file_.json(), "scene")).value_or(0));
    if (!scene) is_in_scene_.assign(nodes_.size(), true);
    std::vector<std::size_t> open;
    for (const Json& root : gltf::elements(member(scene, "nodes"))) {
      const auto n = whole(&root);
      if (!n || *n >= nodes_.size()) return "its scene has a node that does not exist";
      open.push_back(*n);
    }
    for_each_below(std::move(open), is_in_scene_, [](std::size_t) {});
    return {};
  }

  // Parents are visited before their children, so their transform is ready.
  void place_below(std::size_t root) {
    for_each_below({root}, is_placed_, [this](std::size_t n) {
      worlds_[n] = local_transform(nodes_[n]);
      if (parents_[n] != kNone) worlds_[n] = worlds_[parents_[n]] * worlds_[n];
    });
  }

  // Calls `visit` with each of the nodes and those below that are not yet marked, and marks them. A stack of its own
  // keeps deep nesting from exhausting the program's.
  template <class Visit>
  void for_each_below(std::vector<std::size_t> open, std::vector<bool>& marks, Visit visit) {
    while (!open.empty()) {
      const std::size_t n = open.back();
      open.pop_back();
      if (marks[n]) continue;
      marks[n] = true;
      visit(n);
      for (const Json& child : gltf::elements(member(nodes_[n], "children"))) open.push_back(child.get<std::size_t>());
    }
  }

  [[nodiscard]] std::string name_of(std::size_t node) const {
    const std::string name = gltf::text_of(member(nodes_[node], "name"));
    return "node " + std::to_string(node) + (name.empty() ? "" : ' ' + shown(name));
  }

  // A node without a mesh is empty here, but its children may have some.
  std::string read_node(std::size_t n) {
    const auto index = whole(member(nodes_[n], "mesh"));
    if (!index) return {};
    const Json* const mesh = gltf::element(file_.json(), "meshes", *index);
    if (!mesh) return name_of(n) + " has a mesh that does not exist";
    // glTF ignores the transform of a node with a skin: the joints alone place its vertices.
    const Skin* skin = nullptr;
    if (const auto s = whole(member(nodes_[n], "skin"))) {
      if (std::string error = read_skin(*s); !error.empty()) return name_of(n) + ": " + error;
      skin = &skins_.at(*s);
    }
    for (const Json& primitive : gltf::elements(member(mesh, "primitives"))) {
      // One small mesh may be used by millions of nodes; the limit bounds the work.
      if (++primitive_count_ > kPrimitivesMax) return "it has too many meshes: join them";
      if (std::string error = read_primitive(primitive, worlds_[n], skin); !error.empty())
        return name_of(n) + ": " + error;
    }
    return {};
  }

  // A skin is read once, however many meshes use it.
  std::string read_skin(std::size_t index) {
    if (skins_.contains(index)) return {};
    const Json* const described = gltf::element(file_.json(), "skins", index);
    if (!described) return "there is no skin " + std::to_string(index);
    std::optional<gltf::Numbers> inverses;
    if (const auto accessor = whole(member(*described, "inverseBindMatrices"))) {
      const Result<gltf::Numbers> read = file_.numbers(*accessor, 16);
      if (!read) return read.error();
      inverses = *read;
    }
    Skin skin;
    for (const Json& joint : gltf::elements(member(*described, "joints"))) {
      // The index is checked here, so that `skins_` holds only valid transforms.
      const auto node = whole(&joint);
      if (!node || *node >= nodes_.size()) return "its skin has a joint that does not exist";
      Mat4 inverse = Mat4::Identity();
      const std::size_t row = skin.joints.size();
      if (inverses && row >= inverses->count) return "its skin has fewer matrices than joints";
      for (std::size_t i = 0; inverses && i < 16; ++i) inverse(static_cast<Eigen::Index>(i)) = inverses->at(row, i);
      skin.joints.emplace_back(worlds_[*node] * inverse);
    }
    skins_.emplace(index, std::move(skin));
    return {};
  }

  // Reads one part of a mesh: its positions, which the skin or else the node's transform `world` takes to the scene,
  // and its triangles. Returns an error, or an empty string.
  std::string read_primitive(const Json& primitive, const Mat4& world, const Skin* skin) {
    // Modes 4 to 6 are triangles, strips and fans; the others are points and lines. A part without a mode has
    // triangles.
    const std::size_t mode = whole(member(primitive, "mode")).value_or(4);
    if (mode < 4 || mode > 6) {
      ++other_primitives_;
      return {};
    }
    // A compressed part may also have its numbers as they are. It is then read like others, without Draco.
    const Json* const attributes = member(primitive, "attributes");
    const auto position = whole(member(attributes, "POSITION"));
    if (!position) return "a part has no positions";
    const Json* const accessor = gltf::element(file_.json(), "accessors", *position);
    const Json* const packed = member(member(primitive, "extensions"), "KHR_draco_mesh_compression");
    if (packed && accessor && !member(*accessor, "bufferView")) return read_draco(*packed, world, skin);
    const Result<gltf::Numbers> positions = file_.numbers(*position, 3);
    if (!positions) return positions.error();
    Weights moved_by;
    // The sets of joints must be without a gap: JOINTS_1 without JOINTS_0 means nothing.
    for (std::size_t set = 0; skin && set < kJointSetsMax; ++set) {
      const auto j = whole(member(attributes, ("JOINTS_" + std::to_string(set)).c_str()));
      const auto w = whole(member(attributes, ("WEIGHTS_" + std::to_string(set)).c_str()));
      if (!j || !w) break;
      const Result<gltf::Numbers> joints = file_.numbers(*j, 4), weights = file_.numbers(*w, 4);
      if (!joints) return joints.error();
      if (!weights) return weights.error();
      if (joints->count < positions->count || weights->count < positions->count)
        return "it has fewer weights than vertices";
      moved_by.joints.push_back(*joints);
      moved_by.weights.push_back(*weights);
    }
    const std::size_t first = body_.mesh.vertices.size();
    if (std::string error = room_for(positions->count, 0); !error.empty()) return error;
    for (std::size_t v = 0; v < positions->count; ++v) {
      const Vec3 x(positions->at(v, 0), positions->at(v, 1), positions->at(v, 2));
      // Weights decide for each vertex, so linear blend skinning happens here once and bones are generated anew for the
      // groom.
      const Result<Mat4> moved = skin ? blended(moved_by, *skin, v, world) : world;
      if (!moved) return moved.error();
      if (std::string error = add_vertex(*moved, x); !error.empty()) return error;
    }
    // A mirrored part is wound the other way round.
    return read_triangles(primitive, mode, first, !skin && world.topLeftCorner<3, 3>().determinant() < 0);
  }

  // The blend of the joints' transforms at a vertex. The sum is divided by the total, since quantised weights need not
  // sum to 1. A vertex that no joint moves stays with its node.
  static Result<Mat4> blended(const Weights& by, const Skin& skin, std::size_t v, const Mat4& world) {
    Mat4 sum = Mat4::Zero();
    double total = 0;
    for (std::size_t set = 0; set < by.joints.size(); ++set) {
      for (std::size_t i = 0; i < 4; ++i) {
        const double weight = by.weights[set].at(v, i);
        if (!(weight > 0)) continue;
        const auto joint = static_cast<std::size_t>(std::max(by.joints[set].at(v, i), 0.0));
        if (joint >= skin.joints.size()) return Refusal("a vertex follows a joint that its skin does not have");
        sum += weight * skin.joints[joint];
        total += weight;
      }
    }
    return total > 0 ? Mat4(sum / total) : world;
  }

  // The limits are those of a groom, checked before memory is taken.
  std::string room_for(std::size_t vertices, std::size_t triangles) {
    const std::size_t most = GroomLimits{}.vertex_count_max;
    if (vertices <= most - body_.mesh.vertices.size() && triangles <= 2 * most - body_.mesh.triangles.size()) return {};
    return "the body has more than " + std::to_string(most) + " vertices or twice as many triangles: reduce it";
  }

  std::string add_vertex(const Mat4& moved, const Vec3& x) {
    body_.mesh.vertices.emplace_back((moved.topLeftCorner<3, 3>() * x + moved.topRightCorner<3, 1>()).cast<float>());
    return body_.mesh.vertices.back().allFinite() ? "" : "a vertex is not finite";
  }

  // The triangles of vertices from `first` on, by indices or in their order: each of its own, or in strips or fans.
  std::string read_triangles(const Json& primitive, std::size_t mode, std::size_t first, bool is_mirrored) {
    const std::size_t vertex_count = body_.mesh.vertices.size() - first;
    std::optional<gltf::Numbers> indices;
    if (const auto accessor = whole(member(primitive, "indices"))) {
      const Result<gltf::Numbers> read = file_.numbers(*accessor, 1);
      if (!read) return read.error();
      indices = *read;
    }
    const std::size_t count = indices ? indices->count : vertex_count;
    const std::size_t triangles = mode == 4 ? count / 3 : std::max<std::size_t>(count, 2) - 2;
    if (std::string error = room_for(0, triangles); !error.empty()) return error;
    for (std::size_t t = 0; t < triangles; ++t) {
      std::array<std::size_t, 3> corners{3 * t, 3 * t + 1, 3 * t + 2};
      // Every second triangle of a strip has the other winding, which the swap of two corners mends.
      if (mode == 5) corners = {t, t + 1 + t % 2, t + 2 - t % 2};
      if (mode == 6) corners = {0, t + 1, t + 2};
      std::array<std::uint32_t, 3>& triangle = body_.mesh.triangles.emplace_back();
      for (std::size_t i = 0; i < 3; ++i) {
        const double v = indices ? indices->at(corners[i], 0) : static_cast<double>(corners[i]);
        // The comparison also refuses the index that restarts strips, which is the largest number of its type.
        if (!(v >= 0 && v < static_cast<double>(vertex_count))) return "a triangle has a vertex that does not exist";
        triangle[i] = static_cast<std::uint32_t>(first + static_cast<std::size_t>(v));
      }
      if (is_mirrored) std::swap(triangle[1], triangle[2]);
    }
    return {};
  }

  std::string read_draco(const Json& packed, const Mat4& world, const Skin* skin) {
    const auto view = whole(member(packed, "bufferView")),
               position = whole(member(member(packed, "attributes"), "POSITION"));
    if (!view || !position) return "its compressed mesh is not there";
    // The weights are packed by Draco too, and only positions are unpacked.
    if (skin) return "it has a skin and is compressed by Draco: export it without compression";
    const Result<std::span<const std::byte>> bytes = file_.view(*view);
    if (!bytes) return bytes.error();
    const Result<TriangleMesh> mesh = decode_draco(*bytes, *position);
    if (!mesh) return mesh.error();
    if (std::string error = room_for(mesh->vertices.size(), mesh->triangles.size()); !error.empty()) return error;
    const auto first = static_cast<std::uint32_t>(body_.mesh.vertices.size());
    for (const Vec3f& x : mesh->vertices) {
      if (std::string error = add_vertex(world, x.cast<double>()); !error.empty()) return error;
    }
    for (const auto& [a, b, c] : mesh->triangles) body_.mesh.triangles.push_back({first + a, first + b, first + c});
    return {};
  }

  // Joints by the avatar's own list, else by the names of the joints of skins, those above first. An avatar's own list
  // counts first, because its author has set it. VRM 1 lists bones by name, VRM 0 as a list.
  void read_joints() {
    const Json* const extensions = member(file_.json(), "extensions");
    constexpr std::array<std::pair<const char*, Bone>, 4> kBones{{{"head", Bone::head},
                                                                  {"neck", Bone::neck},
                                                                  {"leftShoulder", Bone::left_shoulder},
                                                                  {"rightShoulder", Bone::right_shoulder}}};
    for (const auto& [name, bone] : kBones) {
      const Json* const human = member(member(member(extensions, "VRMC_vrm"), "humanoid"), "humanBones");
      if (const auto n = whole(member(member(human, name), "node"))) add_joint(bone, *n);
      const Json* const bones = member(member(member(extensions, "VRM"), "humanoid"), "humanBones");
      for (const Json& listed : gltf::elements(bones)) {
        if (gltf::text_of(member(listed, "bone")) != name) continue;
        if (const auto n = whole(member(listed, "node"))) add_joint(bone, *n);
      }
    }
    // Names count only for joints of a skin: a mesh called Head is no joint.
    std::vector<bool> is_joint(nodes_.size());
    for (const Json& skin : gltf::elements(member(file_.json(), "skins"))) {
      for (const Json& joint : gltf::elements(member(skin, "joints"))) {
        if (const auto n = whole(&joint); n && *n < nodes_.size()) is_joint[*n] = true;
      }
    }
    std::vector<bool> is_seen(nodes_.size());
    for (std::size_t root = 0; root < nodes_.size(); ++root) {
      if (parents_[root] != kNone) continue;
      for_each_below({root}, is_seen, [&](std::size_t n) {
        if (!is_joint[n]) return;
        if (const auto bone = bone_of_joint(gltf::text_of(member(nodes_[n], "name")))) add_joint(*bone, n);
      });
    }
  }

  void add_joint(Bone bone, std::size_t node) {
    if (node < nodes_.size())
      body_.add_joint(bone, gltf::text_of(member(nodes_[node], "name")), worlds_[node].topRightCorner<3, 1>());
  }

  gltf::File file_;
  const std::vector<Json>& nodes_;
  // The parent of each node, kNone for a root.
  std::vector<std::size_t> parents_;
  // The transform from each node to the scene.
  std::vector<Mat4> worlds_;
  // Whether the node's transform is computed, and whether the scene that is read shows the node.
  std::vector<bool> is_placed_, is_in_scene_;
  // The skins that were read, by their index in the file.
  std::map<std::size_t, Skin> skins_;
  // All parts that were read, and those among them that have no triangles.
  std::size_t primitive_count_ = 0, other_primitives_ = 0;
  ImportedBody body_;
};

}  // namespace

Result<ImportedBody> decode_gltf_body(std::span<const std::byte> bytes, const ReadBeside& read_beside) {
  Result<gltf::File> file = gltf::File::open(bytes, read_beside);
  if (!file) return Refusal(file.error());
  return BodyReader(std::move(*file)).read();
}

}  // namespace hairnet
