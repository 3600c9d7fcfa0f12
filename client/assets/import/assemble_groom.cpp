#include <algorithm>
#include <cmath>
#include <cstdio>
#include <utility>

#include "client/assets/import/guess_unit.hpp"
#include "client/assets/import/placement.hpp"
#include "client/assets/import/skull_fit.hpp"
#include "core/geometry/mesh_query.hpp"

namespace hairnet {
namespace {

// Hairs are 0.02 to 0.2 mm wide; artists draw up to ten times wider ones to need fewer.
constexpr double kThinnest_m = 1e-5, kThickest_m = 2e-3;
// Hair of a head begins at most this far below the head joint, even a beard.
constexpr double kFarBelow_m = 0.07;

std::string decimal(double x, int digits) {
  char text[32];
  std::snprintf(text, sizeof text, "%.*g", digits, x);
  return text;
}

// Limits keep later arithmetic finite, and refuse flags in the wrong unit: a root length of 20, meant as millimetres.
std::string check(const GroomDef& def) {
  if (std::string error = validate(def.placement); !error.empty()) return error;
  if (def.body_placement) {
    if (std::string error = validate(*def.body_placement); !error.empty()) return "body: " + error;
  }
  if (!(def.hairs_in_all > 0 && def.hairs_in_all <= 1e7)) return "the count of hairs must be in (0, 1e7]";
  if (!(def.root_length_m >= 0 && def.root_length_m <= 10)) return "the root length must be in [0, 10] m";
  if (!(def.rooted_distance_m >= 0 && def.rooted_distance_m <= 1)) return "the rooted distance must be in [0, 1] m";
  const bool has_point = std::ranges::any_of(def.files, [](const StrandFile& f) { return !f.strands.points.empty(); });
  return has_point ? std::string() : "there is no strand with a point";
}

// First points of all strands, rotated and scaled but not yet shifted. The shift to the head joint is only known after
// a skull has been fitted to these points.
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

// Empty when the roots have the size of a head; else a warning with the unit that would fit.
std::string size_misfit(const UnitGuess& guess, std::span<const Vec3> roots, const Placement& placement) {
  if (guess.allows(placement.unit_m)) return {};
  Vec3 low = roots.front(), high = low;
  for (const Vec3& root : roots) {
    low = low.cwiseMin(root);
    high = high.cwiseMax(root);
  }
  const Vec3 size_m = high - low;
  const bool may_be_part = !guess.is_sure && placement.unit_m < guess.m;
  return "give --unit " + decimal(guess.m, 3) + (may_be_part ? ", unless this is a small part of a head" : "") +
         ": with the unit of " + decimal(placement.unit_m, 3) + " m the roots reach over " + decimal(size_m.x(), 3) +
         " x " + decimal(size_m.y(), 3) + " x " + decimal(size_m.z(), 3) + " m, which is not the size of a head";
}

// Estimates neck, shoulders and trunk of a mesh that reaches below the head: the shoulders are where it widens, from
// the head joint downwards. A mesh that does not widen keeps the usual joints. The sizes are those of adults: a child's
// shoulders may stay within the half width, and the usual joints then remain.
void estimate_joints(Body& body) {
  constexpr double kSlice_m = 0.01, kDeepest_m = 0.40, kShoulderHalfWidth_m = 0.10;
  std::vector<double> half_width(static_cast<std::size_t>(kDeepest_m / kSlice_m), 0.0);
  for (const Vec3f& v : body.mesh.vertices) {
    const double depth = -static_cast<double>(v.y()) / kSlice_m;
    if (depth < 0 || depth >= static_cast<double>(half_width.size())) continue;
    double& width = half_width[static_cast<std::size_t>(depth)];
    width = std::max(width, std::abs(static_cast<double>(v.x())));
  }
  // The first six slices, 6 cm below the joint, belong to jaw and neck, so the search begins below them.
  const auto widens =
      std::find_if(half_width.begin() + 6, half_width.end(), [](double width) { return width > kShoulderHalfWidth_m; });
  if (widens == half_width.end()) return;
  const auto top = -static_cast<float>(kSlice_m) * static_cast<float>(widens - half_width.begin());
  const auto set_y = [&](Bone bone, float y) { body.joints[static_cast<std::size_t>(bone)].y() = y; };
  // The heights are those of an adult's joints, relative to the place where the body widens, m.
  set_y(Bone::neck, std::min(top + 0.05f, -0.04f));
  set_y(Bone::left_shoulder, top - 0.01f);
  set_y(Bone::right_shoulder, top - 0.01f);
  set_y(Bone::upper_trunk, top - 0.12f);
}

// Inverts all triangles when more of the mesh is wound inside out than not, because the winding defines the inside.
bool wind_outwards(TriangleMesh& mesh) {
  Vec3 middle = Vec3::Zero();
  // An open mesh, such as a face without a back, has no volume of its own. Measured from its middle, its holes matter
  // least.
  for (const Vec3f& x : mesh.vertices) middle += x.cast<double>() / static_cast<double>(mesh.vertices.size());
  double volume = 0;
  for (const auto& [a, b, c] : mesh.triangles) {
    const auto corner = [&](std::uint32_t v) -> Vec3 { return mesh.vertices[v].cast<double>() - middle; };
    volume += corner(a).dot(corner(b).cross(corner(c))) / 6;
  }
  // NaN and a flat mesh count as correctly wound.
  if (!(volume < 0)) return false;
  for (auto& triangle : mesh.triangles) std::swap(triangle[1], triangle[2]);
  return true;
}

// Rotated and scaled but not yet shifted to the head joint.
TriangleMesh unshifted_mesh(const GroomDef& def, std::vector<std::string>& warnings) {
  const Placement& placement = def.body_placement ? *def.body_placement : def.placement;
  TriangleMesh mesh;
  mesh.triangles = def.body->triangles;
  for (const Vec3f& vertex : def.body->vertices) mesh.vertices.push_back(place(placement, Vec3::Zero(), vertex));
  if (wind_outwards(mesh)) warnings.emplace_back("the body's triangles were wound inside out and are turned round");
  return mesh;
}

// A body about its head joint. Its skeleton's joints replace those that its shape shows where they lie below the head.
Body body_of(TriangleMesh mesh, const Vec3& joint, const GroomDef& def) {
  const Placement& placement = def.body_placement ? *def.body_placement : def.placement;
  Body body;
  body.mesh = std::move(mesh);
  for (Vec3f& vertex : body.mesh.vertices) vertex = (vertex.cast<double>() - joint).cast<float>();
  estimate_joints(body);
  for (const Bone bone : {Bone::neck, Bone::left_shoulder, Bone::right_shoulder}) {
    const std::optional<Vec3>& in_file = def.body_joints[static_cast<std::size_t>(bone)];
    if (!in_file) continue;
    const Vec3f x = (place(placement, Vec3::Zero(), in_file->cast<float>()).cast<double>() - joint).cast<float>();
    // A joint at the head's height or beyond half a metre belongs to another rig, or to another unit. The joint
    // estimated from the shape is then better.
    constexpr float kNeck_m = 0.02f, kFar_m = 0.5f;
    if (x.allFinite() && x.y() < -kNeck_m && x.norm() < kFar_m) body.joints[static_cast<std::size_t>(bone)] = x;
  }
  generate_bone_weights(body);
  return body;
}

// Converts a point in head axes and metres to the coordinates of a file.
Vec3 to_file(const Placement& placement, const Vec3& joint) {
  return rotation_to_head(placement.up, placement.face).transpose() * joint / placement.unit_m;
}

// The head joint from the placement, in head axes and metres.
std::optional<Vec3> given_joint(const Placement& placement) {
  if (!placement.origin) return {};
  return placement.unit_m * (rotation_to_head(placement.up, placement.face) * *placement.origin);
}

std::string joint_warning(const Placement& placement, const Vec3& joint, std::string_view from) {
  const Vec3 origin = to_file(placement, joint);
  return "the head joint is estimated from the " + std::string(from) + " at " + decimal(origin.x(), 4) + "," +
         decimal(origin.y(), 4) + ',' + decimal(origin.z(), 4) + " in file units; hairnet-groom's --origin sets it";
}

// What was odd about the strands, for warnings.
struct Counts {
  std::size_t rooted = 0, far_below = 0;
  std::size_t unlikely_widths = 0;
  // The last unlikely width, as an example for the warning.
  double unlikely_width_m = 0;
};

// Appends all strands to the groom in head space. The body must be complete, since the distance to its skin decides
// which strands are rooted.
Counts add_strands(const GroomDef& def, const Vec3& origin, Groom& groom) {
  std::size_t strand_count = 0;
  for (const StrandFile& file : def.files) strand_count += file.strands.strand_count();
  const MeshQuery skin(groom.body.mesh);
  StrandProperties properties;
  // Each strand represents the same number of real hairs, whatever its file, because files do not state densities.
  properties.hair_count = static_cast<float>(def.hairs_in_all / static_cast<double>(strand_count));
  properties.root_length_m = static_cast<float>(def.root_length_m);
  Counts counts;
  std::vector<Vec3f> strand;
  for (const StrandFile& file : def.files) {
    const auto named = std::ranges::find(groom.group_names, file.group);
    properties.group = static_cast<std::uint16_t>(named - groom.group_names.begin());
    if (named == groom.group_names.end()) groom.group_names.push_back(file.group);
    for (std::size_t s = 0; s < file.strands.strand_count(); ++s) {
      properties.radius_m = StrandProperties{}.radius_m;
      // 0 means that the file says none.
      if (!file.widths.empty() && file.widths[s] > 0) {
        const double width_m = file.widths[s] * def.placement.unit_m;
        if (width_m >= kThinnest_m && width_m <= kThickest_m) {
          properties.radius_m = static_cast<float>(width_m / 2);
        } else {
          ++counts.unlikely_widths;
          counts.unlikely_width_m = width_m;
        }
      }
      strand.clear();
      for (std::uint32_t i = file.strands.strand_begin[s]; i < file.strands.strand_begin[s + 1]; ++i) {
        strand.push_back(place(def.placement, origin, file.strands.points[i]));
      }
      // The query returns an infinite distance when the skin is farther away than its limit, so one call answers the
      // question.
      properties.rooted =
          !strand.empty() && std::isfinite(skin.closest(strand[0].cast<double>(), def.rooted_distance_m).distance);
      counts.rooted += properties.rooted;
      counts.far_below += !strand.empty() && static_cast<double>(strand[0].y()) < -kFarBelow_m;
      groom.add_strand(strand, properties);
    }
  }
  return counts;
}

void warn_of_counts(const Counts& counts, std::size_t strand_count, std::vector<std::string>& warnings) {
  if (counts.far_below > 0) {
    const double percent = 100 * static_cast<double>(counts.far_below) / static_cast<double>(strand_count);
    warnings.push_back(std::to_string(counts.far_below) + " of " + std::to_string(strand_count) + " strands (" +
                       decimal(percent, 2) + " %) begin more than " + decimal(100 * kFarBelow_m, 2) +
                       " cm below the head joint, as on a back: they follow the head all the same");
  }
  if (counts.unlikely_widths > 0) {
    warnings.push_back(std::to_string(counts.unlikely_widths) + " of " + std::to_string(strand_count) +
                       " strands have a width that is no hair's, such as " + decimal(counts.unlikely_width_m, 3) +
                       " m: they are taken as " + decimal(2 * double{StrandProperties{}.radius_m}, 2) + " m wide");
  }
  if (counts.rooted == 0) {
    warnings.push_back("no strand begins on the skin: check --origin, --unit and the axes of strands and body");
  }
}

}  // namespace

Result<ImportedGroom> assemble_groom(const GroomDef& def) {
  if (std::string error = check(def); !error.empty()) return Refusal(std::move(error));
  ImportedGroom imported;
  Groom& groom = imported.groom;
  groom.name = def.name;
  imported.placement = def.placement;

  const std::vector<Vec3> roots = unshifted_roots(def);
  // The guess must not know the unit, so the roots go back to units of the file.
  std::vector<Vec3> roots_file;
  for (const Vec3& root : roots) roots_file.emplace_back(root / def.placement.unit_m);
  const UnitGuess guess = guess_unit(roots_file);
  const std::string misfit = size_misfit(guess, roots, def.placement);
  if (!misfit.empty()) imported.warnings.push_back(misfit);
  // Where the unit is surely wrong, the roots make a skull of the wrong size. The expected radius is scaled as they
  // are, so that the fit is still a skull and the user sees hair on a head with a warning.
  SkullFit skull = fit_skull_shape(
      roots, kUsualSkullRadius_m * (guess.is_sure && !misfit.empty() ? def.placement.unit_m / guess.m : 1));

  TriangleMesh mesh;
  if (def.body) mesh = unshifted_mesh(def, imported.warnings);
  const std::optional<SkullFit> skull_of_body = skull_of_mesh(mesh);
  const std::optional<Vec3> given = given_joint(def.placement);
  // The body's skull counts before the roots': it is the same for all hairstyles of one body, so they can be exchanged.
  const Vec3 joint = given ? *given : (skull_of_body ? *skull_of_body : skull).joint();
  if (def.body) {
    // A mesh without its own origin shares the strands' head joint.
    groom.body =
        body_of(std::move(mesh), def.body_placement ? given_joint(*def.body_placement).value_or(joint) : joint, def);
  } else {
    // The fit was in unshifted axes; head space has its origin in the joint.
    skull.centre -= joint;
    groom.body = skull_body(skull);
  }
  if (misfit.empty() && !skull_of_body && !skull.is_determined()) {
    imported.warnings.push_back("the roots cover too little of a head to tell its size: it is taken as one of radius " +
                                decimal(100 * skull.radius(), 2) + " cm; a body under the hair tells more");
  }
  const Counts counts = add_strands(def, to_file(def.placement, joint), groom);
  warn_of_counts(counts, groom.strand_count(), imported.warnings);
  if (!given) {
    const char* from = skull_of_body ? "body's skull" : def.body ? "roots, since the body's top is no skull," : "roots";
    imported.warnings.push_back(joint_warning(def.placement, joint, from));
  }
  // A wrong unit often shows first as coordinates beyond the limits of a groom. The misfit then explains the error
  // better.
  if (std::string error = validate(groom); !error.empty())
    return Refusal(misfit.empty() ? error : misfit + "; " + error);
  return imported;
}

}  // namespace hairnet
