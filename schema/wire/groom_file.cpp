#include "schema/wire/groom_file.hpp"

#include "core/assert.hpp"
#include "groom_generated.h"
#include "schema/bytes/content_hash.hpp"
#include "schema/wire/flatbuffer_convert.hpp"
#include "schema/wire/groom_features.hpp"
#include "schema/wire/groom_numbers.hpp"
#include "schema/wire/learnt_hair_table.hpp"
#include "schema/wire/packing.hpp"
#include "schema/wire/text.hpp"

namespace hairnet::wire {
namespace {

// The version that is written. Version 1 has only strands and a body, and version 2 has floats instead of planes.
// Readers take all three.
constexpr std::uint16_t kGroomVersion = 3;

using flatbuffers::FlatBufferBuilder;

auto write_strands(FlatBufferBuilder& to, const Groom& groom) {
  std::vector<fb::StrandProperties> strands;
  strands.reserve(groom.strand_count());
  for (const StrandProperties& s : groom.strands)
    strands.emplace_back(s.radius_m, s.hair_count, s.root_length_m, s.group, s.rooted);
  return to.CreateVectorOfStructs(strands);
}

// The order of fields is that of the struct in groom.fbs. All of them are numbers, so the compiler would not notice two
// that are exchanged; round trips in tests do.
fb::Material flatten_material(const Material& m) {
  return {m.axial_stiffness_n,      m.attachment_stiffness_n_per_m,
          m.damping_ratio,          m.linear_density_kg_per_m,
          m.air_drag_ns_per_m2,     m.ether_mass_ratio,
          m.ether_stiffness_per_s2, m.ether_damping_ratio,
          m.root_length_m,          m.thickness_m,
          m.metaball_potential_j};
}

Material read_material(const fb::Material& m) {
  return {m.axial_stiffness_n(),      m.attachment_stiffness_n_per_m(),
          m.damping_ratio(),          m.linear_density_kg_per_m(),
          m.air_drag_ns_per_m2(),     m.ether_mass_ratio(),
          m.ether_stiffness_per_s2(), m.ether_damping_ratio(),
          m.root_length_m(),          m.thickness_m(),
          m.metaball_potential_j()};
}

auto write_group_materials(FlatBufferBuilder& to, const MaterialSet& materials) {
  std::vector<fb::GroupMaterial> groups;
  for (const GroupMaterial& g : materials.groups) groups.emplace_back(flatten_material(g.material), g.group);
  return to.CreateVectorOfStructs(groups);
}

fb::Joints flatten_joints(const Body& body) {
  const auto joint = [&](Bone bone) { return to_flatbuffer(body.joints[static_cast<std::size_t>(bone)]); };
  return {joint(Bone::head), joint(Bone::neck), joint(Bone::left_shoulder), joint(Bone::right_shoulder),
          joint(Bone::upper_trunk)};
}

// The run of a body's vertices: all of them are one (PointRun in groom_numbers.hpp).
std::vector<PointRun> whole_body(std::size_t vertex_count) {
  return {{0, vertex_count, 1, {}}};
}

// Corners are written one after the other: neighbouring triangles share vertices, so the steps between indices are
// small.
std::vector<std::uint8_t> encode_triangles(const std::vector<std::array<std::uint32_t, 3>>& triangles) {
  std::vector<std::uint32_t> indices;
  for (const auto& triangle : triangles) indices.insert(indices.end(), triangle.begin(), triangle.end());
  return encode_indices(indices);
}

// Writes the number of points of each strand, and not the sums of strand_begin, since equal counts pack to almost
// nothing.
auto write_point_counts(FlatBufferBuilder& to, const Groom& groom) {
  std::vector<std::uint32_t> counts;
  counts.reserve(groom.strand_count());
  for (std::size_t s = 0; s < groom.strand_count(); ++s)
    counts.push_back(static_cast<std::uint32_t>(groom.strand_points(s).size()));
  return to.CreateVector(counts);
}

// The groom as a FlatBuffers table, which pack() then compresses.
std::vector<std::uint8_t> write_table(const Groom& groom, const LearntHair* learnt) {
  FlatBufferBuilder to(std::size_t{1} << 16);
  const Body& body = groom.body;
  const fb::Joints joints = flatten_joints(body);
  const EncodedPoints points = encode_points(groom.points, point_runs(groom));
  std::vector<std::string> names;
  // Names are made valid here, since an importer takes them from any file.
  for (const std::string& name : groom.group_names) names.push_back(fit_text(name));
  // Each part is written by a statement of its own, since the order of evaluation of arguments would decide the bytes.
  const auto name = to.CreateString(fit_text(groom.name));
  const auto group_names = to.CreateVectorOfStrings(names);
  const auto strands = write_strands(to, groom);
  // Fields of version 1 are required in the table, so they exist and are empty.
  const auto no_integers = to.CreateVector(std::vector<std::uint32_t>());
  const auto no_numbers = to.CreateVector(std::vector<float>());
  const fb::Material material = flatten_material(groom.materials.base);
  const auto group_materials = write_group_materials(to, groom.materials);
  const FlatFeatures features = write_features(to, groom);
  const auto point_counts = write_point_counts(to, groom);
  const auto point_weights = to.CreateVector(points.weights);
  const auto point_references = to.CreateVector(points.references);
  const auto point_planes = to.CreateVector(points.planes);
  const auto vertex_planes =
      to.CreateVector(encode_points(body.mesh.vertices, whole_body(body.mesh.vertices.size())).planes);
  const auto bone_weight_planes = to.CreateVector(encode_bone_weights(body.bone_weights));
  const auto triangle_planes = to.CreateVector(encode_triangles(body.mesh.triangles));
  flatbuffers::Offset<fb::LearntHair> learnt_hair;
  flatbuffers::Offset<fb::LearntWind> learnt_wind;
  if (learnt) {
    learnt_hair = write_learnt(to, *learnt);
    learnt_wind = write_wind(to, learnt->wind);
  }
  // The order in which fields are added decides the bytes as well.
  fb::GroomBuilder table(to);
  table.add_version(kGroomVersion);
  table.add_fitted_from_roots(body.fitted_from_roots);
  table.add_name(name);
  table.add_group_names(group_names);
  table.add_strands(strands);
  table.add_strand_begin(no_integers);
  table.add_points(no_numbers);
  table.add_joints(&joints);
  table.add_vertices(no_numbers);
  table.add_bone_weights(no_numbers);
  table.add_triangles(no_integers);
  table.add_material(&material);
  table.add_group_materials(group_materials);
  add_features(features, table);
  table.add_strand_point_counts(point_counts);
  table.add_point_weights(point_weights);
  table.add_point_references(point_references);
  table.add_point_planes(point_planes);
  table.add_vertex_planes(vertex_planes);
  table.add_bone_weight_planes(bone_weight_planes);
  table.add_triangle_planes(triangle_planes);
  if (learnt) {
    table.add_learnt(learnt_hair);
    table.add_learnt_wind(learnt_wind);
  }
  return finish(to, table.Finish(), fb::GroomIdentifier());
}

std::string read_names(const fb::Groom& in, const GroomLimits& limits, Groom& out) {
  if (!is_text(view(in.name()))) return "groom's name is not text";
  out.name = view(in.name());
  // Counts are compared with the limits before memory is taken for what they count.
  if (in.group_names()->size() > limits.group_count_max)
    return std::to_string(in.group_names()->size()) + " groups, more than the limit of " +
           std::to_string(limits.group_count_max);
  for (const flatbuffers::String* name : *in.group_names()) {
    if (!is_text(view(name))) return "a group's name is not text";
    out.group_names.emplace_back(view(name));
  }
  return {};
}

std::string read_strands(const fb::Groom& in, Groom& out) {
  if (!is_aligned(*in.strands())) return "strands are not aligned";
  if (in.points()->size() % 3 != 0) return "points are not 3 numbers each";
  out.strands.reserve(in.strands()->size());
  for (const fb::StrandProperties* s : *in.strands())
    out.strands.push_back({s->radius_m(), s->hair_count(), s->root_length_m(), s->group(), s->rooted()});
  // Older files have these as they are used; they are copied as a block, and validated at the end like all others.
  if (in.version() < 3) {
    from_flatbuffer(*in.strand_begin(), out.strand_begin);
    from_flatbuffer(*in.points(), out.points);
    return {};
  }
  for (const std::uint32_t count : span_of(in.strand_point_counts())) {
    // The sum has 32 bits; a forged count must not make it wrap to a small one.
    if (count > ~out.strand_begin.back()) return "more points than can be counted";
    out.strand_begin.push_back(out.strand_begin.back() + count);
  }
  return {};
}

// Reads the points of version 3. The strands and features that own them must have been read.
std::string read_points(const fb::Groom& in, Groom& out) {
  if (in.version() < 3) return {};
  return decode_points(span_of(in.point_weights()), span_of(in.point_references()), span_of(in.point_planes()),
                       point_runs(out), out.points);
}

std::string read_materials(const fb::Groom& in, const GroomLimits& limits, MaterialSet& out) {
  if (in.version() < 2) return {};
  if (!in.material() || !in.group_materials()) return "materials are missing";
  if (!is_aligned(*in.group_materials())) return "materials of groups are not aligned";
  if (in.group_materials()->size() > limits.group_count_max) return "more materials than a groom may have groups";
  out.base = read_material(*in.material());
  for (const fb::GroupMaterial* g : *in.group_materials())
    out.groups.push_back({g->group(), read_material(g->material())});
  return {};
}

std::string decode_triangles(std::span<const std::uint8_t> planes, std::vector<std::array<std::uint32_t, 3>>& out) {
  std::vector<std::uint32_t> indices;
  if (std::string error = decode_indices(planes, indices); !error.empty()) return error;
  if (indices.size() % 3 != 0) return "triangles are not 3 numbers each";
  out.resize(indices.size() / 3);
  if (!out.empty()) std::memcpy(out.data(), indices.data(), indices.size() * sizeof(indices[0]));
  return {};
}

std::string read_body(const fb::Groom& in, Body& out) {
  if (in.vertices()->size() % 3 != 0 || in.triangles()->size() % 3 != 0 || in.bone_weights()->size() % kBoneCount != 0)
    return "body: vertices or triangles are not 3 numbers each, or bone weights not 5";
  if (in.version() < 3) {
    from_flatbuffer(*in.vertices(), out.mesh.vertices);
    from_flatbuffer(*in.triangles(), out.mesh.triangles);
    from_flatbuffer(*in.bone_weights(), out.bone_weights);
  } else {
    // A vertex has three coordinates of three bytes. A rest that is no whole vertex is refused by decode_points().
    const std::span<const std::uint8_t> vertices = span_of(in.vertex_planes());
    std::string error = decode_points({}, {}, vertices, whole_body(vertices.size() / 9), out.mesh.vertices);
    if (error.empty()) error = decode_triangles(span_of(in.triangle_planes()), out.mesh.triangles);
    if (error.empty()) error = decode_bone_weights(span_of(in.bone_weight_planes()), out.bone_weights);
    if (!error.empty()) return "body: " + error;
  }
  const fb::Joints& joints = *in.joints();
  out.joints = {from_flatbuffer(joints.head()), from_flatbuffer(joints.neck()), from_flatbuffer(joints.left_shoulder()),
                from_flatbuffer(joints.right_shoulder()), from_flatbuffer(joints.upper_trunk())};
  out.fitted_from_roots = in.fitted_from_roots();
  return {};
}

Result<const fb::Groom*> root_of(std::span<const std::uint8_t> table) {
  const auto* root = verified_root<fb::Groom>(table, fb::GroomIdentifier());
  if (!root) return Refusal("not whole: cut off or damaged");
  // A newer version may mean something else by the same fields, so it is refused and not guessed.
  if (root->version() < 1 || root->version() > kGroomVersion)
    return Refusal("groom file of version " + std::to_string(root->version()) + ", not 1 to " +
                   std::to_string(kGroomVersion));
  return root;
}

// What `read` makes of the table of a file.
template <class T, class Read>
Result<T> with_table(std::span<const std::uint8_t> bytes, const Read& read) {
  if (bytes.size() > kGroomBytesMax)
    return Refusal(std::to_string(bytes.size()) + " bytes, more than the limit of " + std::to_string(kGroomBytesMax));
  const auto read_checked = [&read](std::span<const std::uint8_t> table) -> Result<T> {
    const Result<const fb::Groom*> root = root_of(table);
    return root ? read(**root) : Refusal(root.error());
  };
  // Versions 1 and 2 are the table itself.
  if (is_packed(bytes, kPackedGroom)) {
    const Result<std::vector<std::uint8_t>> table = unpack(bytes, kPackedGroom);
    return table ? read_checked(*table) : Refusal(table.error());
  }
  if (!has_identifier(bytes, fb::GroomIdentifier())) return Refusal("not a .groom file (it does not begin as one)");
  const AlignedBytes aligned(bytes);
  return read_checked(aligned.bytes());
}

Result<Groom> read_groom(const fb::Groom& root, const GroomLimits& limits) {
  Groom groom;
  std::string error = read_names(root, limits, groom);
  if (error.empty()) error = read_strands(root, groom);
  if (error.empty()) error = read_materials(root, limits, groom.materials);
  if (error.empty()) error = read_features(root, groom);
  // Points come after the features, since threads, cards and cloths say how many there are. validate() comes last: it
  // may then assume that all counts agree.
  if (error.empty()) error = read_points(root, groom);
  if (error.empty()) error = read_body(root, groom.body);
  if (error.empty()) error = validate(groom, limits);
  if (!error.empty()) return Refusal(std::move(error));
  return groom;
}

}  // namespace

std::vector<std::uint8_t> encode_groom(const Groom& groom, const LearntHair* learnt) {
  HAIRNET_ASSERT(!learnt || validate(*learnt).empty());
  // A groom is encoded once and sent many times, so the effort is worth its time.
  return pack(write_table(groom, learnt), kPackedGroom, PackEffort::most);
}

Result<Groom> decode_groom(std::span<const std::uint8_t> bytes, const GroomLimits& limits) {
  return with_table<Groom>(bytes, [&limits](const fb::Groom& root) { return read_groom(root, limits); });
}

Result<std::shared_ptr<const LearntHair>> decode_learnt_of_groom(std::span<const std::uint8_t> bytes) {
  using Learnt = std::shared_ptr<const LearntHair>;
  return with_table<Learnt>(bytes, [](const fb::Groom& root) -> Result<Learnt> {
    if (!root.learnt()) return nullptr;
    auto hair = std::make_shared<LearntHair>();
    if (std::string error = read_learnt(*root.learnt(), root.learnt_wind(), *hair); !error.empty())
      return Refusal(std::move(error));
    return hair;
  });
}

GroomHash hash_groom(std::span<const std::uint8_t> groom_bytes) {
  bytes::ContentHasher hasher;
  hasher.add(groom_bytes);
  return hasher.hash();
}

}  // namespace hairnet::wire
