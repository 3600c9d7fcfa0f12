#include <algorithm>
#include <cmath>
#include <cstdio>
#include <utility>

#include "core/geometry/mesh_query.hpp"
#include "core/import/placement.hpp"
#include "core/import/skull_fit.hpp"

namespace hairnet {
namespace {

// Where the head joint lies from the middle of the skull, in skull radii: at the base of the skull, a little behind.
const Vec3 kJointFromSkull(0, -0.8, -0.1);

constexpr double kUsualWidth_m = 0.14;  // of a scalp, ear to ear
constexpr double kRadiusMin_m = 0.06, kRadiusMax_m = 0.14;
constexpr double kWidthMin_m = 0.10, kWidthMax_m = 0.25;

std::string decimal(double x, int digits) {
  char text[32];
  std::snprintf(text, sizeof text, "%.*g", digits, x);
  return text;
}

std::string check(const GroomDef& def) {
  if (std::string fault = validate(def.placement); !fault.empty()) return fault;
  if (def.body_placement) {
    if (std::string fault = validate(*def.body_placement); !fault.empty()) return "body: " + fault;
  }
  if (!(def.hairs_in_all > 0 && def.hairs_in_all <= 1e7)) return "the count of hairs must be in (0, 1e7]";
  if (!(def.root_length_m >= 0 && def.root_length_m <= 10)) return "the root length must be in [0, 10] m";
  if (!(def.rooted_distance_m >= 0 && def.rooted_distance_m <= 1)) return "the rooted distance must be in [0, 1] m";
  const bool has_point = std::ranges::any_of(def.files, [](const StrandFile& f) { return !f.strands.points.empty(); });
  return has_point ? std::string() : "there is no strand with a point";
}

// First points of all strands, turned and scaled but not yet shifted to the head joint.
std::vector<Vec3> unshifted_roots(const GroomDef& def) {
  std::vector<Vec3> roots;
  for (const StrandFile& file : def.files) {
    for (std::size_t s = 0; s < file.strands.strand_count(); ++s) {
      const std::uint32_t first = file.strands.strand_begin[s];
      if (first == file.strands.strand_begin[s + 1]) continue;
      roots.push_back(place(def.placement, Vec3::Zero(), file.strands.points[first]).cast<double>());
    }
  }
  return roots;
}

// Empty when the roots make a head; else says what they make, and the unit that would fit.
std::string size_misfit(const SkullFit& skull, const Placement& placement) {
  const double radius_m = skull.radius();
  const bool radius_fits = radius_m >= kRadiusMin_m && radius_m <= kRadiusMax_m;
  const bool width_fits = skull.width >= kWidthMin_m && skull.width <= kWidthMax_m;
  if (radius_fits && width_fits) return {};
  if (!(skull.width > 0)) return "the roots are all in one place: there is no head to see in them";
  return "this is not the size of a head: the roots lie on a skull of radius " + decimal(100 * radius_m, 3) +
         " cm and are " + decimal(100 * skull.width, 3) + " cm wide; --unit " +
         decimal(placement.unit_m * kUsualWidth_m / skull.width, 2) + " would make it one";
}

// Neck, shoulders and trunk of a mesh that reaches below the head: the shoulders are where it widens, seen from the
// head joint downwards. A mesh that does not widen keeps the usual joints.
void estimate_joints(Body& body) {
  constexpr double kSlice_m = 0.01, kDeepest_m = 0.40, kShoulderHalfWidth_m = 0.10;
  std::vector<double> half_width(static_cast<std::size_t>(kDeepest_m / kSlice_m), 0.0);
  for (const Vec3f& v : body.mesh.vertices) {
    const double depth = -static_cast<double>(v.y()) / kSlice_m;
    if (depth < 0 || depth >= static_cast<double>(half_width.size())) continue;
    double& width = half_width[static_cast<std::size_t>(depth)];
    width = std::max(width, std::abs(static_cast<double>(v.x())));
  }
  const auto widens =
      std::find_if(half_width.begin() + 6, half_width.end(), [](double width) { return width > kShoulderHalfWidth_m; });
  if (widens == half_width.end()) return;
  const auto top = -static_cast<float>(kSlice_m) * static_cast<float>(widens - half_width.begin());
  const auto set_y = [&](Bone bone, float y) { body.joints[static_cast<std::size_t>(bone)].y() = y; };
  set_y(Bone::neck, std::min(top + 0.05f, -0.04f));
  set_y(Bone::left_shoulder, top - 0.01f);
  set_y(Bone::right_shoulder, top - 0.01f);
  set_y(Bone::upper_trunk, top - 0.12f);
}

// Turns all triangles round when more of the mesh is wound inside out than not: what is inside is told by the winding.
bool wind_outwards(TriangleMesh& mesh) {
  Vec3 middle = Vec3::Zero();
  for (const Vec3f& x : mesh.vertices) middle += x.cast<double>() / static_cast<double>(mesh.vertices.size());
  double volume = 0;
  for (const auto& [a, b, c] : mesh.triangles) {
    const auto corner = [&](std::uint32_t v) -> Vec3 { return mesh.vertices[v].cast<double>() - middle; };
    volume += corner(a).dot(corner(b).cross(corner(c))) / 6;
  }
  if (!(volume < 0)) return false;
  for (auto& triangle : mesh.triangles) std::swap(triangle[1], triangle[2]);
  return true;
}

Body placed_body(const GroomDef& def, const Vec3& origin, std::vector<std::string>& warnings) {
  const Placement& placement = def.body_placement ? *def.body_placement : def.placement;
  Body body;
  body.mesh.triangles = def.body->triangles;
  for (const Vec3f& vertex : def.body->vertices) body.mesh.vertices.push_back(place(placement, origin, vertex));
  if (wind_outwards(body.mesh))
    warnings.emplace_back("the body's triangles were wound inside out and are turned round");
  estimate_joints(body);
  generate_bone_weights(body);
  return body;
}

// The head joint in the coordinates of `placement`'s file, as given or `below` the skull that its roots or mesh show.
Vec3 origin_of(const Placement& placement, const Vec3& joint_head_axes) {
  if (placement.origin) return *placement.origin;
  return rotation_to_head(placement.up, placement.face).transpose() * joint_head_axes / placement.unit_m;
}

struct Counts {
  std::size_t rooted = 0, single = 0, empty = 0;
};

Counts add_strands(const GroomDef& def, const Vec3& origin, Groom& groom) {
  std::size_t strand_count = 0;
  for (const StrandFile& file : def.files) strand_count += file.strands.strand_count();
  const MeshQuery skin(groom.body.mesh);
  StrandProperties properties;
  properties.hair_count = static_cast<float>(def.hairs_in_all / static_cast<double>(strand_count));
  properties.root_length_m = static_cast<float>(def.root_length_m);
  Counts counts;
  std::vector<Vec3f> strand;
  for (const StrandFile& file : def.files) {
    const auto named = std::ranges::find(groom.group_names, file.group);
    properties.group = static_cast<std::uint16_t>(named - groom.group_names.begin());
    if (named == groom.group_names.end()) groom.group_names.push_back(file.group);
    for (std::size_t s = 0; s < file.strands.strand_count(); ++s) {
      strand.clear();
      for (std::uint32_t i = file.strands.strand_begin[s]; i < file.strands.strand_begin[s + 1]; ++i) {
        strand.push_back(place(def.placement, origin, file.strands.points[i]));
      }
      properties.rooted =
          !strand.empty() && std::isfinite(skin.closest(strand[0].cast<double>(), def.rooted_distance_m).distance);
      counts.rooted += properties.rooted;
      counts.single += strand.size() == 1;
      counts.empty += strand.empty();
      groom.add_strand(strand, properties);
    }
  }
  return counts;
}

void warn_of_counts(const Counts& counts, std::size_t strand_count, std::vector<std::string>& warnings) {
  if (counts.single + counts.empty > 0) {
    warnings.push_back(std::to_string(counts.single + counts.empty) + " of " + std::to_string(strand_count) +
                       " strands have fewer than two points and do not move");
  }
  if (counts.rooted == 0) {
    warnings.push_back("no strand begins on the skin: check --origin, --unit and the axes of strands and body");
  }
}

}  // namespace

Result<ImportedGroom> assemble_groom(const GroomDef& def) {
  if (std::string fault = check(def); !fault.empty()) return Refusal(std::move(fault));
  ImportedGroom imported;
  Groom& groom = imported.groom;
  groom.name = def.name;

  const SkullFit skull = fit_skull_shape(unshifted_roots(def));
  const std::string misfit = size_misfit(skull, def.placement);
  if (!misfit.empty()) imported.warnings.push_back(misfit);
  const Vec3 joint = skull.centre + skull.radius() * kJointFromSkull;
  const Vec3 origin = origin_of(def.placement, joint);
  if (def.body) {
    const Placement& body_placement = def.body_placement ? *def.body_placement : def.placement;
    // Without an origin of its own the mesh shares the strands' head joint, found in head axes.
    const Vec3 joint_found = rotation_to_head(def.placement.up, def.placement.face) * origin * def.placement.unit_m;
    groom.body = placed_body(def, origin_of(body_placement, joint_found), imported.warnings);
  } else {
    std::vector<Vec3f> roots;
    for (const Vec3& root : unshifted_roots(def)) {
      roots.push_back((root - rotation_to_head(def.placement.up, def.placement.face) * origin * def.placement.unit_m)
                          .cast<float>());
    }
    groom.body = fit_skull(roots);
  }
  const Counts counts = add_strands(def, origin, groom);
  warn_of_counts(counts, groom.strand_count(), imported.warnings);
  if (!def.placement.origin) {
    imported.warnings.push_back("the head joint was estimated at " + decimal(origin.x(), 4) + "," +
                                decimal(origin.y(), 4) + ',' + decimal(origin.z(), 4) +
                                " in file units; --origin sets it");
  }
  if (std::string fault = validate(groom); !fault.empty())
    return Refusal(misfit.empty() ? fault : fault + "; " + misfit);
  return imported;
}

}  // namespace hairnet
