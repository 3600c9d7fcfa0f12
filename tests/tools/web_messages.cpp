#include "tests/tools/web_messages.hpp"

#include <boost/core/type_name.hpp>
#include <ranges>
#include <string>

#include "tests/support/fields.hpp"
#include "tests/tools/hex.hpp"

namespace hairnet {
namespace {

using Json = nlohmann::ordered_json;

Json three(const auto& v) {
  return {v[0], v[1], v[2]};
}

// "mean_m_per_s" to "meanMPerS": the same name in TypeScript.
std::string camel_case(std::string_view name) {
  std::string out;
  for (std::size_t i = 0; i < name.size(); ++i) {
    if (name[i] == '_') {
      out += static_cast<char>(std::toupper(static_cast<unsigned char>(name[++i])));
    } else {
      out += name[i];
    }
  }
  return out;
}

template <class T>
constexpr bool holds_structs() {
  if constexpr (std::ranges::range<T>)
    return boost::describe::has_describe_members<std::ranges::range_value_t<T>>::value;
  return false;
}

unsigned rgb(const wire::Srgb& c) {
  return unsigned{c.red} << 16 | unsigned{c.green} << 8 | c.blue;
}

// As the TypeScript tests read it: 64-bit integers as text, hashes and bytes as hexadecimal digits.
template <class T>
Json value_of(const T& value) {
  if constexpr (std::is_enum_v<T>) {
    return static_cast<unsigned>(value);
  } else if constexpr (std::is_integral_v<T> && sizeof(T) == 8) {
    return std::to_string(value);
  } else if constexpr (std::is_same_v<T, Pose>) {
    return to_json(value);
  } else if constexpr (std::is_same_v<T, wire::Appearance>) {
    return {{"hairRoot", rgb(value.hair_root)},
            {"hairTip", rgb(value.hair_tip)},
            {"skin", rgb(value.skin)},
            {"roughness", value.roughness / 255.0}};
  } else if constexpr (requires { value.has_value(); }) {
    return value ? value_of(*value) : Json();
  } else if constexpr (requires { Vec3(value.template cast<double>()); }) {
    return three(value);
  } else if constexpr (requires { hex(value); }) {
    return hex(value);
  } else if constexpr (boost::describe::has_describe_members<T>::value) {
    Json out = Json::object();
    for_each_field<T>([&](const char* name, auto field) { out[camel_case(name)] = value_of(value.*field); });
    return out;
  } else if constexpr (holds_structs<T>()) {
    Json out = Json::array();
    for (const auto& each : value) out.push_back(value_of(each));
    return out;
  } else {
    return value;
  }
}

// The kind of a message, as `type` of the TypeScript messages: "setWind" of wire::SetWind.
template <class M>
std::string kind_of() {
  std::string name = boost::core::type_name<M>();
  name.erase(0, name.rfind(':') + 1);
  name[0] = static_cast<char>(std::tolower(static_cast<unsigned char>(name[0])));
  return name;
}

template <class M>
Json body_of(const M& m) {
  Json out{{"type", kind_of<M>()}};
  out.update(value_of(m));
  return out;
}
Json body_of(const wire::Error& m) {
  Json out = body_of<wire::Error>(m);
  if (m.groom == wire::GroomHash{}) out["groom"] = Json();
  return out;
}

Json flat_triangles(const std::vector<std::array<std::uint32_t, 3>>& triangles) {
  Json out = Json::array();
  for (const auto& triangle : triangles) append(triangle, out);
  return out;
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
  for (const Clump& c : groom.clumps) out["clumps"].push_back(value_of(c));
  for (const Thread& t : groom.threads) {
    out["threads"].push_back({{"points", value_of(t.points)},
                              {"group", t.group},
                              {"rooted", t.rooted},
                              {"rootLengthM", t.root_length_m},
                              {"radiusM", t.radius_m},
                              {"colour", three(t.colour)}});
  }
  for (const HairCard& s : groom.cards) {
    out["cards"].push_back({{"points", value_of(s.points)},
                            {"group", s.properties.group},
                            {"rooted", s.properties.rooted},
                            {"rootLengthM", s.properties.root_length_m},
                            {"hairCount", s.properties.hair_count}});
  }
  for (const Cloth& c : groom.cloths) {
    out["cloths"].push_back({{"points", value_of(c.points)},
                             {"group", c.group},
                             {"triangles", flat_triangles(c.triangles)},
                             {"rootDistanceM", c.root_distance_m},
                             {"rootLengthM", c.root_length_m},
                             {"colour", three(c.colour)},
                             {"opacity", c.opacity}});
  }
  for (const Knot& k : groom.knots) out["knots"].push_back({{"points", k.points}});
  out["farCards"] = {{"points", flat(groom.far_cards.points)}, {"cards", value_of(groom.far_cards.cards)}};
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

nlohmann::ordered_json to_json(const LevelGeometry& geometry) {
  return value_of(geometry);
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
           {"material", value_of(groom.materials.base)}};
  out["groupMaterials"] = value_of(groom.materials.groups);
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
