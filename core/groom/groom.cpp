#include "core/groom/groom.hpp"

#include <cmath>

#include "core/assert.hpp"
#include "core/groom/error_text.hpp"
#include "core/groom/validate_features.hpp"

namespace hairnet {
namespace {

bool within(const Vec3f& x, float most) {
  return x.allFinite() && x.cwiseAbs().maxCoeff() <= most;
}

std::string validate_strands(const Groom& groom, const GroomLimits& limits) {
  if (groom.strand_count() > limits.strand_count_max)
    return over_limit("strands", groom.strand_count(), limits.strand_count_max);
  if (groom.points.size() > limits.point_count_max)
    return over_limit("points", groom.points.size(), limits.point_count_max);
  if (groom.group_names.size() > limits.group_count_max)
    return over_limit("groups", groom.group_names.size(), limits.group_count_max);
  if (groom.strand_begin.size() != groom.strand_count() + 1 || groom.strand_begin.front() != 0)
    return "strand offsets do not cover the points";
  for (std::size_t s = 0; s < groom.strand_count(); ++s) {
    // Offsets that descend would make spans of negative length. The last offset is compared with the points in
    // validate_features.
    if (groom.strand_begin[s] > groom.strand_begin[s + 1]) return error_at("strand", s, "offsets descend");
    if (const std::string error = error_of(groom.strands[s], groom); !error.empty())
      return error_at("strand", s, error);
  }
  for (std::size_t i = 0; i < groom.points.size(); ++i) {
    if (!within(groom.points[i], limits.coordinate_max_m))
      return error_at("point", i, too_far(limits.coordinate_max_m));
  }
  return {};
}

std::string validate_body(const Body& body, const GroomLimits& limits) {
  const TriangleMesh& mesh = body.mesh;
  if (mesh.vertices.size() > limits.vertex_count_max)
    return over_limit("body vertices", mesh.vertices.size(), limits.vertex_count_max);
  if (mesh.triangles.size() > 2 * limits.vertex_count_max)
    return over_limit("body triangles", mesh.triangles.size(), 2 * limits.vertex_count_max);
  if (body.bone_weights.size() != mesh.vertices.size()) return "bone weights are not one entry a body vertex";
  for (std::size_t v = 0; v < mesh.vertices.size(); ++v) {
    if (!within(mesh.vertices[v], limits.coordinate_max_m))
      return error_at("body vertex", v, too_far(limits.coordinate_max_m));
    float sum = 0;
    for (const float weight : body.bone_weights[v]) {
      if (!(weight >= 0 && weight <= 1.001f)) return error_at("body vertex", v, "a bone weight is not in [0, 1]");
      sum += weight;
    }
    if (std::abs(sum - 1) > 1e-3f) return error_at("body vertex", v, "bone weights do not sum to 1");
  }
  for (std::size_t t = 0; t < mesh.triangles.size(); ++t) {
    for (const std::uint32_t v : mesh.triangles[t]) {
      if (v >= mesh.vertices.size()) return error_at("body triangle", t, "a vertex does not exist");
    }
  }
  for (std::size_t b = 0; b < kBoneCount; ++b) {
    if (!within(body.joints[b], limits.coordinate_max_m)) return error_at("joint", b, too_far(limits.coordinate_max_m));
  }
  return {};
}

}  // namespace

void set_material(const Material& material, Groom& groom) {
  // Materials of groups are dropped as well: the new one is for all hair.
  groom.materials = {material, {}};
  for (StrandProperties& strand : groom.strands) {
    if (strand.rooted) strand.root_length_m = material.root_length_m;
  }
  for (auto& [points, card] : groom.cards) {
    if (card.rooted) card.root_length_m = material.root_length_m;
  }
}

void set_group_material(std::uint16_t group, const Material& material, Groom& groom) {
  HAIRNET_ASSERT(group < groom.group_names.size());
  groom.materials.set(group, material);
  for (StrandProperties& strand : groom.strands) {
    if (strand.rooted && strand.group == group) strand.root_length_m = material.root_length_m;
  }
  for (auto& [points, card] : groom.cards) {
    if (card.rooted && card.group == group) card.root_length_m = material.root_length_m;
  }
}

void Groom::add_cloth(std::span<const Vec3f> vertices, Cloth cloth) {
  cloth.points = append(vertices);
  for (auto& triangle : cloth.triangles) {
    for (std::uint32_t& corner : triangle) {
      HAIRNET_ASSERT(corner < vertices.size());
      corner += cloth.points.begin;
    }
  }
  cloths.push_back(std::move(cloth));
}

void middle_of(const Groom& groom, const HairCard& card, std::vector<Vec3f>& line) {
  HAIRNET_ASSERT(card.points.begin <= card.points.end);
  HAIRNET_ASSERT(card.points.end <= groom.points.size());
  // The points are left, right, left, right and so on.
  const std::span<const Vec3f> edges = groom.points_of(card.points);
  line.clear();
  for (std::size_t i = 0; i + 1 < edges.size(); i += 2) line.push_back(0.5f * (edges[i] + edges[i + 1]));
  HAIRNET_ASSERT(line.size() == edges.size() / 2);
}

std::string validate(const Groom& groom, const GroomLimits& limits) {
  if (groom.strand_begin.empty()) return "strand offsets are missing";
  // The order matters: features index strands, groups and points, which are checked before them.
  std::string error = validate_strands(groom, limits);
  if (error.empty()) error = validate(groom.materials, groom.group_names.size());
  if (error.empty()) error = validate_features(groom, limits);
  return error.empty() ? validate_body(groom.body, limits) : error;
}

}  // namespace hairnet
