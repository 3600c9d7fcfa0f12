#pragma once

#include <array>
#include <optional>
#include <span>
#include <string>
#include <string_view>
#include <vector>

#include "client/assets/import/strands.hpp"
#include "core/geometry/triangle_mesh.hpp"
#include "core/groom/groom.hpp"
#include "core/result.hpp"

namespace hairnet {

// An axis of a file, with its direction.
enum class Axis : std::uint8_t { plus_x, minus_x, plus_y, minus_y, plus_z, minus_z };
Result<Axis> parse_axis(std::string_view text);  // "+x", "-z", "y"

// The text is one that `parse_axis` reads.
std::string_view name_of(Axis axis);  // "+x"
Vec3 direction(Axis axis);
bool parallel(Axis a, Axis b);  // or opposite

// Turns file axes so that `up` becomes +Y and `face` +Z; the third axis is up x face, so that nothing is mirrored. The
// two must not be parallel.
Mat3 rotation_to_head(Axis up, Axis face);

// The conversion of a file's coordinates to head space: rotate (up to +Y, face to +Z), shift, scale. A file point x
// becomes unit_m R (x - origin). Head space is in metres, +Y up, +Z out of the face.
struct Placement {
  Axis up = Axis::plus_y;
  Axis face = Axis::plus_z;
  // The length of a unit of the file, m.
  double unit_m = 1;
  // The head joint in file coordinates. Without it, it comes from the body's skull, else from the roots.
  std::optional<Vec3> origin;
};

// What is known of a placement; the rest is guessed. Guesses do not change the values that are here.
struct KnownPlacement {
  std::optional<Axis> up, face;
  std::optional<double> unit_m;
  std::optional<Vec3> origin;
};

// Returns an error for parallel axes and for a unit that is not finite and positive.
std::string validate(const Placement& placement);
// `origin` is in file coordinates, and replaces that of the placement, which may not be known yet.
Vec3f place(const Placement& placement, const Vec3& origin, const Vec3f& file_point);

// The strands of a file, or of one group of it.
struct StrandFile {
  // The points alone, without the values that some formats give for points or strands.
  ImportedStrands strands;
  // The strands go to the group of this name.
  std::string group;
  // The file's name, for messages.
  std::string file = {};
  // Each strand's diameter, like StrandGroup::widths.
  std::vector<float> widths = {};
};

// What assemble_groom needs. All guesses are made before: everything here is taken as it is.
struct GroomDef {
  std::string name;
  std::vector<StrandFile> files;
  // It has the same file coordinates as the strands, unless `body_placement` says which others.
  std::optional<TriangleMesh> body;
  // Places the strands.
  Placement placement;
  std::optional<Placement> body_placement;
  // The joints of the body's skeleton in the body's file; the others are estimated from its shape.
  std::array<std::optional<Vec3>, kBoneCount> body_joints;
  // Real hairs on the head, which are shared evenly over the strands.
  double hairs_in_all = 100'000;
  double root_length_m = 0.02;
  // A first point within this distance of the skin is on the skull.
  double rooted_distance_m = 0.015;
};

// A groom in head space that `validate` accepts.
struct ImportedGroom {
  Groom groom;
  // The placement by which the strands were converted.
  Placement placement;
  // Lines about what is odd but may be meant, such as hair that has not the size of a head.
  std::vector<std::string> warnings;
};

// Converts strands and body to a groom in head space. Computes bone weights, fits a skull to the roots when there is no
// body, and marks strands as rooted by their distance to the skin. Warnings cover what is odd but may be meant; an
// error covers what makes no valid groom.
Result<ImportedGroom> assemble_groom(const GroomDef& def);

}  // namespace hairnet
