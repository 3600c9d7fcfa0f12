#include "schema/wire/groom_file.hpp"

#include <sodium/crypto_generichash.h>

#include <new>
#include <tuple>

#include "groom_generated.h"
#include "schema/wire/flatbuffer_convert.hpp"
#include "schema/wire/groom_features.hpp"
#include "schema/wire/text.hpp"

namespace hairnet::wire {
namespace {

constexpr std::uint16_t kGroomVersion = 2;  // version 1 has strands and a body alone

using flatbuffers::FlatBufferBuilder;

// An array of structs of Scalars as one vector of them.
template <class Scalar, class T>
auto write_scalars(FlatBufferBuilder& to, const std::vector<T>& from) {
  static_assert(sizeof(T) % sizeof(Scalar) == 0);
  return to.CreateVector(reinterpret_cast<const Scalar*>(from.data()), from.size() * (sizeof(T) / sizeof(Scalar)));
}

auto write_strands(FlatBufferBuilder& to, const Groom& groom) {
  std::vector<fb::StrandProperties> strands;
  strands.reserve(groom.strand_count());
  for (const StrandProperties& s : groom.strands)
    strands.emplace_back(s.radius_m, s.hair_count, s.root_length_m, s.group, s.rooted);
  return to.CreateVectorOfStructs(strands);
}

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

std::size_t bulk_bytes(const Groom& groom) {
  const auto bytes = [](const auto& v) { return v.size() * sizeof(v[0]); };
  return bytes(groom.points) + bytes(groom.strand_begin) + bytes(groom.strands) + bytes(groom.body.mesh.vertices) +
         bytes(groom.body.mesh.triangles) + bytes(groom.body.bone_weights) + bytes(groom.far_cards.points) +
         groom.group_names.size() * (kTextBytesMax / 16);
}

std::string read_names(const fb::Groom& in, const GroomLimits& limits, Groom& out) {
  if (!is_text(view(in.name()))) return "groom's name is not text";
  out.name = view(in.name());
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
  from_flatbuffer(*in.strand_begin(), out.strand_begin);
  from_flatbuffer(*in.points(), out.points);
  return {};
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

std::string read_body(const fb::Groom& in, Body& out) {
  if (in.vertices()->size() % 3 != 0 || in.triangles()->size() % 3 != 0 || in.bone_weights()->size() % kBoneCount != 0)
    return "body: vertices or triangles are not 3 numbers each, or bone weights not 5";
  from_flatbuffer(*in.vertices(), out.mesh.vertices);
  from_flatbuffer(*in.triangles(), out.mesh.triangles);
  from_flatbuffer(*in.bone_weights(), out.bone_weights);
  const fb::Joints& joints = *in.joints();
  out.joints = {from_flatbuffer(joints.head()), from_flatbuffer(joints.neck()), from_flatbuffer(joints.left_shoulder()),
                from_flatbuffer(joints.right_shoulder()), from_flatbuffer(joints.upper_trunk())};
  out.fitted_from_roots = in.fitted_from_roots();
  return {};
}

}  // namespace

std::vector<std::uint8_t> encode_groom(const Groom& groom) {
  FlatBufferBuilder to(bulk_bytes(groom) + 4096);
  const Body& body = groom.body;
  const fb::Joints joints = flatten_joints(body);
  std::vector<std::string> names;
  for (const std::string& name : groom.group_names) names.push_back(fit_text(name));
  // One after the other: the order of evaluation of arguments would decide the bytes.
  const auto name = to.CreateString(fit_text(groom.name));
  const auto group_names = to.CreateVectorOfStrings(names);
  const auto strands = write_strands(to, groom);
  const auto strand_begin = to.CreateVector(groom.strand_begin);
  const auto points = write_scalars<float>(to, groom.points);
  const auto vertices = write_scalars<float>(to, body.mesh.vertices);
  const auto bone_weights = write_scalars<float>(to, body.bone_weights);
  const auto triangles = write_scalars<std::uint32_t>(to, body.mesh.triangles);
  const fb::Material material = flatten_material(groom.materials.base);
  const auto group_materials = write_group_materials(to, groom.materials);
  const FlatFeatures features = write_features(to, groom);
  const auto root =
      fb::CreateGroom(to, kGroomVersion, body.fitted_from_roots, name, group_names, strands, strand_begin, points,
                      &joints, vertices, bone_weights, triangles, &material, group_materials,
                      features.root_blend_counts, features.root_blend_points, features.clumps, features.threads,
                      features.cards, features.cloths, features.cloth_triangles, features.cloth_root_distances,
                      features.knots, features.knot_points, features.far_cards, features.far_card_points);
  return finish(to, root, fb::GroomIdentifier());
}

Result<Groom> decode_groom(std::span<const std::uint8_t> bytes, const GroomLimits& limits) {
  if (bytes.size() > kGroomBytesMax)
    return Refusal(std::to_string(bytes.size()) + " bytes, more than the limit of " + std::to_string(kGroomBytesMax));
  const AlignedBytes aligned(bytes);
  const auto* root = verified_root<fb::Groom>(aligned.bytes(), fb::GroomIdentifier());
  if (!root)
    return Refusal(
        "is not a .groom file, or is damaged; hairnet-groom import makes one of .hair, .tfx and .data files");
  if (root->version() < 1 || root->version() > kGroomVersion)
    return Refusal("groom file of version " + std::to_string(root->version()) + ", not 1 to " +
                   std::to_string(kGroomVersion));
  Groom groom;
  std::string fault = read_names(*root, limits, groom);
  if (fault.empty()) fault = read_strands(*root, groom);
  if (fault.empty()) fault = read_materials(*root, limits, groom.materials);
  if (fault.empty()) fault = read_features(*root, groom);
  if (fault.empty()) fault = read_body(*root, groom.body);
  if (fault.empty()) fault = validate(groom, limits);
  if (!fault.empty()) return Refusal(std::move(fault));
  return groom;
}

GroomHash hash_groom(std::span<const std::uint8_t> groom_bytes) {
  GroomHash hash;
  static_assert(hash.size() == crypto_generichash_BYTES);
  // Fails only for sizes of hash or key out of range.
  crypto_generichash(hash.data(), hash.size(), groom_bytes.data(), groom_bytes.size(), nullptr, 0);
  return hash;
}

static_assert(sizeof(crypto_generichash_state) == 384 && alignof(crypto_generichash_state) <= 64);

GroomHasher::GroomHasher() {
  auto* state = new (state_.data()) crypto_generichash_state;
  crypto_generichash_init(state, nullptr, 0, std::tuple_size_v<GroomHash>);
}

void GroomHasher::add(std::span<const std::uint8_t> piece) {
  auto* state = std::launder(reinterpret_cast<crypto_generichash_state*>(state_.data()));
  crypto_generichash_update(state, piece.data(), piece.size());
}

GroomHash GroomHasher::hash() const {
  GroomHasher copy = *this;  // to finish a state changes it
  GroomHash hash;
  auto* state = std::launder(reinterpret_cast<crypto_generichash_state*>(copy.state_.data()));
  crypto_generichash_final(state, hash.data(), hash.size());
  return hash;
}

}  // namespace hairnet::wire
