#pragma once

#include <array>
#include <cstddef>
#include <functional>
#include <optional>
#include <span>
#include <string>
#include <string_view>
#include <vector>

#include "client/assets/import/placement.hpp"
#include "core/geometry/triangle_mesh.hpp"
#include "core/pose/pose.hpp"
#include "core/result.hpp"

namespace hairnet {

// A head, bust or person in its rest pose: all meshes of a file as one, in the file's coordinates. `place` converts its
// coordinates. It owns all its data.
struct ImportedBody {
  TriangleMesh mesh;
  // What the file states of its axes and unit. The origin is the joint of the head.
  KnownPlacement states;
  // Each bone turns about the joint of the file's skeleton that has its name.
  struct Joint {
    std::string name;
    Vec3 position = Vec3::Zero();
  };
  std::array<std::optional<Joint>, kBoneCount> joints;
  // Lines about what was read and what was left out.
  std::vector<std::string> notes;

  // Sets the joint of a bone, unless the bone has one already.
  void add_joint(Bone bone, std::string_view name, const Vec3& position);
  // Sets the origin in `states` from the head's joint, and the face from those of the shoulders.
  void state_joints();
};

// The bone that a joint of this name turns, in the usual rigs: mixamorig:Head, J_Bip_L_Shoulder, Bip01 Neck,
// clavicle_l, CC_Base_R_Clavicle ... None for all others, such as HeadTop_End.
std::optional<Bone> bone_of_joint(std::string_view name);

// Reads the file of that name beside the one that is decoded. The decoder has already refused names that lead out of
// the folder, so a reader may append the name to its folder.
using ReadBeside = std::function<Result<std::vector<std::byte>>(const std::string& name)>;

// A glTF 2 file, text or binary (.gltf, .glb, .vrm). Without `read_beside` it must hold its buffers itself. It does not
// read sparse accessors, morph targets, instances, or Draco together with a skin. glTF is in metres with +Y up, and
// `states` says so. The error names what is wrong, but not the file.
Result<ImportedBody> decode_gltf_body(std::span<const std::byte> bytes, const ReadBeside& read_beside = {});
// The meshes of a USD file: text, binary, or in an archive. A mesh that a skeleton binds is placed by its bind pose.
Result<ImportedBody> decode_usd_body(std::span<const std::byte> bytes);
// The faces of a .ply. Polygons become fans, so concave ones may overlap themselves.
Result<TriangleMesh> decode_ply_mesh(std::span<const std::byte> bytes);

}  // namespace hairnet
