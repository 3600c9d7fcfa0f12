#include "tests/tools/web_messages.hpp"

#include <string>

#include "tests/tools/hex.hpp"

namespace hairnet {
namespace {

using Json = nlohmann::ordered_json;

template <class Number>
Json text(Number number) {
  return std::to_string(number);
}

template <class Enum>
Json number(Enum value) {
  return static_cast<unsigned>(value);
}

Json three(const auto& v) {
  return {v[0], v[1], v[2]};
}

Json body_of(const wire::Hello& m) {
  return {{"type", "hello"},
          {"protocolVersion", m.protocol_version},
          {"clientName", m.client_name},
          {"room", m.room},
          {"token", m.token},
          {"role", number(m.role)},
          {"session", text(m.session)},
          {"secret", hex(m.secret)}};
}
Json body_of(const wire::GroomOffer& m) {
  return {{"type", "groomOffer"}, {"hash", hex(m.hash)}, {"byteCount", text(m.byte_count)}};
}
Json body_of(const wire::GroomChunk& m) {
  return {{"type", "groomChunk"}, {"hash", hex(m.hash)}, {"offset", text(m.offset)}, {"bytes", hex(m.bytes)}};
}
Json state_of(const wire::HairState& s) {
  return {{"level", number(s.level)},
          {"stepM", s.step_m},
          {"displacements", s.displacements},
          {"velocities", s.velocities}};
}
Json body_of(const wire::AddCharacter& m) {
  return {{"type", "addCharacter"},
          {"character", m.character},
          {"groom", hex(m.groom)},
          {"level", number(m.level)},
          {"state", m.state ? state_of(*m.state) : Json()}};
}
Json body_of(const wire::SetLevel& m) {
  return {{"type", "setLevel"}, {"character", m.character}, {"level", number(m.level)}};
}
Json body_of(const wire::RemoveCharacter& m) {
  return {{"type", "removeCharacter"}, {"character", m.character}};
}
Json body_of(const wire::PoseBatch& m) {
  Json poses = Json::array();
  for (const wire::PoseSample& p : m.poses) {
    poses.push_back({{"character", p.character},
                     {"sequence", p.sequence},
                     {"captureTimeNs", text(p.capture_time_ns)},
                     {"teleport", p.teleport},
                     {"pose", to_json(p.pose)}});
  }
  return {{"type", "poseBatch"}, {"poses", poses}};
}
Json body_of(const wire::Welcome& m) {
  return {{"type", "welcome"},
          {"protocolVersion", m.protocol_version},
          {"session", text(m.session)},
          {"tickRateHz", m.tick_rate_hz},
          {"tick", text(m.tick)},
          {"characterCountMax", m.character_count_max},
          {"groomBytesMax", text(m.groom_bytes_max)},
          {"room", m.room},
          {"secret", hex(m.secret)},
          {"resumed", m.resumed},
          {"resumeGraceS", m.resume_grace_s},
          {"poseDelayNs", text(m.pose_delay_ns)}};
}
Json body_of(const wire::GroomNeed& m) {
  return {{"type", "groomNeed"}, {"hash", hex(m.hash)}, {"offset", text(m.offset)}};
}
Json body_of(const wire::GroomStatus& m) {
  return {{"type", "groomStatus"}, {"hash", hex(m.hash)}, {"state", number(m.state)}};
}
Json body_of(const wire::GroomData& m) {
  return {{"type", "groomData"},
          {"hash", hex(m.hash)},
          {"byteCount", text(m.byte_count)},
          {"offset", text(m.offset)},
          {"bytes", hex(m.bytes)}};
}
Json body_of(const wire::CharacterAdded& m) {
  return {{"type", "characterAdded"},
          {"character", m.character},
          {"groom", hex(m.groom)},
          {"level", number(m.level)},
          {"member", m.member}};
}
Json body_of(const wire::CharacterRemoved& m) {
  return {{"type", "characterRemoved"}, {"character", m.character}};
}
Json body_of(const wire::MemberJoined& m) {
  return {{"type", "memberJoined"},
          {"member", m.member},
          {"session", text(m.session)},
          {"character", m.character},
          {"groom", hex(m.groom)}};
}
Json body_of(const wire::MemberLeft& m) {
  return {{"type", "memberLeft"}, {"member", m.member}};
}
Json body_of(const wire::LevelRecord& m) {
  return {
      {"type", "levelRecord"}, {"groom", hex(m.groom)}, {"level", number(m.level)}, {"geometry", to_json(m.geometry)}};
}
Json body_of(const wire::FrameBatch& m) {
  Json frames = Json::array();
  for (const wire::Frame& f : m.frames) {
    frames.push_back({{"member", f.member},
                      {"level", number(f.level)},
                      {"errorClass", number(f.error_class)},
                      {"discontinuous", f.discontinuous},
                      {"asleep", f.asleep},
                      {"velocities", f.velocities},
                      {"order", f.order},
                      {"stride", f.stride},
                      {"stepStride", f.step_stride},
                      {"content", hex(f.content)}});
  }
  return {{"type", "frameBatch"}, {"tick", text(m.tick)}, {"sampleTimeNs", text(m.sample_time_ns)}, {"frames", frames}};
}
Json body_of(const wire::Error& m) {
  return {{"type", "error"},
          {"reason", number(m.reason)},
          {"character", m.character},
          {"groom", m.groom == wire::GroomHash{} ? Json() : Json(hex(m.groom))},
          {"detail", m.detail}};
}
Json body_of(const wire::Goodbye& m) {
  return {{"type", "goodbye"}, {"reason", number(m.reason)}, {"detail", m.detail}};
}
Json body_of(const wire::SetMaterial& m) {
  const MaterialScale& s = m.scale;
  return {{"type", "setMaterial"},
          {"character", m.character},
          {"scale",
           {{"stiffness", s.stiffness},
            {"damping", s.damping},
            {"density", s.density},
            {"etherDamping", s.ether_damping},
            {"airDrag", s.air_drag},
            {"gelPerS2", s.gel_per_s2}}}};
}
Json body_of(const wire::SetWind& m) {
  const Wind& w = m.wind;
  return {{"type", "setWind"},
          {"wind",
           {{"meanMPerS", three(w.mean_m_per_s)},
            {"gustRatio", w.gust_ratio},
            {"gustPeriodS", w.gust_period_s},
            {"turbulenceRmsMPerS", w.turbulence_rms_m_per_s},
            {"turbulenceScaleM", w.turbulence_scale_m},
            {"seed", text(w.seed)}}}};
}
Json body_of(const wire::Observe& m) {
  return {{"type", "observe"},
          {"mode", number(m.mode)},
          {"count", m.count},
          {"radiusM", m.radius_m},
          {"from", m.from ? three(*m.from) : Json()},
          {"members", m.members},
          {"errorClass", number(m.error_class)},
          {"stride", m.stride},
          {"velocities", m.velocities}};
}
Json body_of(const wire::ReportImportance& m) {
  Json members = Json::array();
  for (const wire::MemberImportance& each : m.members)
    members.push_back({{"member", each.member}, {"screenHeight", each.screen_height}, {"inView", each.in_view}});
  return {{"type", "reportImportance"}, {"members", members}};
}
Json body_of(const wire::RequestKeyframes& m) {
  return {{"type", "requestKeyframes"}, {"members", m.members}};
}
Json body_of(const wire::GroomRequest& m) {
  return {{"type", "groomRequest"}, {"hash", hex(m.hash)}, {"offset", text(m.offset)}};
}

Json range_of(const PointRange& range) {
  return {{"begin", range.begin}, {"end", range.end}};
}

Json flat_triangles(const std::vector<std::array<std::uint32_t, 3>>& triangles) {
  Json out = Json::array();
  for (const auto& triangle : triangles) append(triangle, out);
  return out;
}

Json material_of(const Material& m) {
  return {{"axialStiffnessN", m.axial_stiffness_n},
          {"attachmentStiffnessNPerM", m.attachment_stiffness_n_per_m},
          {"dampingRatio", m.damping_ratio},
          {"linearDensityKgPerM", m.linear_density_kg_per_m},
          {"airDragNsPerM2", m.air_drag_ns_per_m2},
          {"etherMassRatio", m.ether_mass_ratio},
          {"etherStiffnessPerS2", m.ether_stiffness_per_s2},
          {"etherDampingRatio", m.ether_damping_ratio},
          {"rootLengthM", m.root_length_m},
          {"thicknessM", m.thickness_m},
          {"metaballPotentialJ", m.metaball_potential_j}};
}

Json strands_of(const Groom& groom) {
  Json out{{"count", groom.strand_count()}, {"begin", groom.strand_begin}};
  for (const char* name : {"radiusM", "hairCount", "rootLengthM", "group", "rooted"}) out[name] = Json::array();
  for (const StrandProperties& s : groom.strands) {
    out["radiusM"].push_back(s.radius_m);
    out["hairCount"].push_back(s.hair_count);
    out["rootLengthM"].push_back(s.root_length_m);
    out["group"].push_back(s.group);
    out["rooted"].push_back(s.rooted ? 1 : 0);
  }
  return out;
}

void add_features(const Groom& groom, Json& out) {
  out["rootBlends"] = Json::array();
  for (const RootBlend& blend : groom.root_blends) {
    Json curve = Json::array();
    for (const auto& point : blend.points) append(point, curve);
    out["rootBlends"].push_back(curve);
  }
  for (const char* name : {"clumps", "threads", "cards", "cloths", "knots"}) out[name] = Json::array();
  for (const Clump& c : groom.clumps) {
    out["clumps"].push_back(
        {{"strand", c.strand}, {"copyCount", c.copy_count}, {"radiusM", c.radius_m}, {"tipRadiusM", c.tip_radius_m}});
  }
  for (const Thread& t : groom.threads) {
    out["threads"].push_back({{"points", range_of(t.points)},
                              {"group", t.group},
                              {"rooted", t.rooted},
                              {"rootLengthM", t.root_length_m},
                              {"radiusM", t.radius_m},
                              {"colour", three(t.colour)}});
  }
  for (const HairCard& s : groom.cards) {
    out["cards"].push_back({{"points", range_of(s.points)},
                            {"group", s.properties.group},
                            {"rooted", s.properties.rooted},
                            {"rootLengthM", s.properties.root_length_m},
                            {"hairCount", s.properties.hair_count}});
  }
  for (const Cloth& c : groom.cloths) {
    out["cloths"].push_back({{"points", range_of(c.points)},
                             {"group", c.group},
                             {"triangles", flat_triangles(c.triangles)},
                             {"rootDistanceM", c.root_distance_m},
                             {"rootLengthM", c.root_length_m},
                             {"colour", three(c.colour)},
                             {"opacity", c.opacity}});
  }
  for (const Knot& k : groom.knots) out["knots"].push_back({{"points", k.points}});
  Json cards = Json::array();
  for (const FarCard& s : groom.far_cards.cards) {
    cards.push_back({{"points", range_of(s.points)},
                     {"rootLengthM", s.root_length_m},
                     {"strandCount", s.strand_count},
                     {"group", s.group},
                     {"rooted", s.rooted}});
  }
  out["farCards"] = {{"points", flat(groom.far_cards.points)}, {"cards", cards}};
}

}  // namespace

nlohmann::ordered_json flat(std::span<const Vec3f> vectors) {
  Json out = Json::array();
  for (const Vec3f& v : vectors) append(v, out);
  return out;
}

nlohmann::ordered_json to_json(const wire::Message& message) {
  return std::visit([](const auto& m) { return body_of(m); }, message);
}

nlohmann::ordered_json to_json(const LevelGeometry& g) {
  return {{"lattice",
           {{"origin", three(g.lattice.origin)}, {"spacing", three(g.lattice.spacing)}, {"dims", g.lattice.dims}}},
          {"activeNodes", g.active_nodes},
          {"trimmedNodes", g.trimmed_nodes},
          {"trimmedBegin", g.trimmed_begin},
          {"trimmedFrom", g.trimmed_from},
          {"trimmedWeights", g.trimmed_weights}};
}

nlohmann::ordered_json to_json(const Pose& pose) {
  Json out = Json::array();
  for (const RigidTransform& bone : pose.bones) {
    append(bone.rotation.coeffs(), out);
    append(bone.position, out);
  }
  return out;
}

nlohmann::ordered_json to_json(const Groom& groom) {
  Json out{{"name", groom.name},
           {"groupNames", groom.group_names},
           {"points", flat(groom.points)},
           {"strands", strands_of(groom)},
           {"material", material_of(groom.materials.base)}};
  out["groupMaterials"] = Json::array();
  for (const GroupMaterial& g : groom.materials.groups)
    out["groupMaterials"].push_back({{"group", g.group}, {"material", material_of(g.material)}});
  add_features(groom, out);
  Json weights = Json::array();
  for (const auto& each : groom.body.bone_weights) append(each, weights);
  out["body"] = {{"vertices", flat(groom.body.mesh.vertices)},
                 {"boneWeights", weights},
                 {"triangles", flat_triangles(groom.body.mesh.triangles)},
                 {"joints", flat(groom.body.joints)},
                 {"fittedFromRoots", groom.body.fitted_from_roots}};
  return out;
}

}  // namespace hairnet
