#include "client/tools/sim/model_json.hpp"

#include <nlohmann/json.hpp>
#include <span>

#include "core/solver/node_terms.hpp"

namespace hairnet::sim {
namespace {

using Json = nlohmann::ordered_json;

template <class V>
Json vector_json(const V& v) {
  return {v[0], v[1], v[2]};
}

// Nodes and weights of stiffener `s`, by grid index; q as the solver takes it.
Json stiffener_json(const Level& level, const Stiffeners& stiffeners, float step_s, std::size_t s) {
  Json nodes = Json::array(), weights = Json::array();
  for (std::uint32_t e = stiffeners.begin[s]; e < stiffeners.begin[s + 1]; ++e) {
    nodes.push_back(level.geometry.active_nodes[stiffeners.nodes[e]]);
    weights.push_back(stiffeners.weights[e]);
  }
  const auto [k, q] = stiffener_terms(stiffeners, {}, s, step_s);
  return {{"nodes", nodes}, {"weights", weights}, {"k", k}, {"q", q}};
}

Json springs_json(const Level& level, float step_s) {
  Json list = Json::array();
  for (std::size_t s = 0; s < level.springs.count(); ++s) {
    Json spring = stiffener_json(level, level.springs, step_s, s);
    spring["rest_length"] = level.springs.rest[s].cast<double>().norm();
    list.push_back(spring);
  }
  return list;
}

Json attachments_json(const Level& level, float step_s) {
  Json list = Json::array();
  for (std::size_t s = 0; s < level.attachments.count(); ++s) {
    Json attachment = stiffener_json(level, level.attachments, step_s, s);
    attachment["rest"] = vector_json(level.attachments.rest[s]);
    list.push_back(attachment);
  }
  return list;
}

Json ether_damping_json(const Level& level, float step_s) {
  Json list = Json::array();
  for (std::size_t i = 0; i < level.rest.size(); ++i) list.push_back(ether_damping(level, {}, i, step_s));
  return list;
}

Json trimmed_json(const LevelGeometry& g) {
  Json list = Json::array();
  for (std::size_t t = 0; t < g.trimmed_nodes.size(); ++t) {
    Json from = Json::array(), weights = Json::array();
    for (std::uint32_t e = g.trimmed_begin[t]; e < g.trimmed_begin[t + 1]; ++e) {
      from.push_back(g.active_nodes[g.trimmed_from[e]]);
      weights.push_back(g.trimmed_weights[e]);
    }
    list.push_back({{"node", g.trimmed_nodes[t]}, {"from", from}, {"weights", weights}});
  }
  return list;
}

Json metaballs_json(const Level& level) {
  Json list = Json::array();
  for (const Metaball& ball : level.metaballs) {
    list.push_back({{"bone", kBoneNames[static_cast<std::size_t>(ball.bone)]},
                    {"centre", vector_json(ball.centre)},
                    {"radius", ball.radius},
                    {"potential", ball.potential}});
  }
  return list;
}

// What this model does that model.md's formulas do not say, or leave open.
Json notes_json() {
  return {
      "a metaball's force and radial stiffness are taken at B1 B0^-1 p (where the node would end if it moved with the "
      "ball's bone over the step), not at the step's start p; the stiffness acts on p + h p'_1 - B1 B0^-1 p: "
      "f = f_ball(r) - k_r r^ r^.(p + h p'_1 - B1 B0^-1 p), r = B1 B0^-1 p - B1 c",
      "contact fades while the body is calm: once every bone has been within 0.17 rad and 0.02 m of the head's "
      "transform "
      "for 1 s (counted by ticks, reset by any pose that is not), and without wind, U is U (1 - s v), s rising "
      "linearly "
      "from 0 to 1 in a further 0.5 s, v = t^2 (3 - 2 t), t = clamp((0.087 - tilt) / 0.07, 0, 1), tilt the angle "
      "between "
      "the head's up and +Y in rad; after 3 s, k and q of springs and attachments fade alike within 1 s, to 0.01 at v "
      "= 1",
      "spring forces are linearised about the step's start with the positive semi-definite part only (k e e^T, q e "
      "e^T)",
      "every q, of springs, attachments and ether, is what the solver uses at this rate and substeps: the material's "
      "less what backward Euler adds by itself, max(q - h k, -h k / 3), h the length of a substep; it may be negative",
      "the lattice as a whole is drawn towards the design, in displacement and velocity against the head's, where a "
      "node "
      "would be farther from it than 2.5 times the diagonal of the box of its lattice",
      "gravity acts on every node's whole mass, ether's included, as g - R g0, g0 = (0, -9.81, 0)",
      "drag tensors Q are in head axes and turn with the head: f = -R Q R^T (p' - wind)",
      "a radius of 0 means that the ball is off for that node",
      "at a reset the lattice moves rigidly with the head: displacements and velocities keep their components in head "
      "axes, and no step is made",
      "a tick's substeps interpolate the poses (position linear, rotation slerp)"};
}

}  // namespace

std::string encode_model_json(const ModelDump& dump) {
  const Level& level = *dump.level;
  const auto step_s = static_cast<float>(1 / (dump.rate_hz * dump.substep_count));
  const Lattice& lattice = level.geometry.lattice;
  Json json;
  json["format"] = "hairnet-model";
  json["version"] = 1;
  json["rate_hz"] = dump.rate_hz;
  json["substeps"] = dump.substep_count;
  json["gravity"] = vector_json(dump.gravity);
  json["bones"] = kBoneNames;
  json["lattice"] = {{"origin", vector_json(lattice.origin)},
                     {"spacing", vector_json(lattice.spacing)},
                     {"dims", vector_json(lattice.dims)}};
  json["nodes"] = {{"active", level.geometry.active_nodes},
                   {"mass", level.mass},
                   {"ether_k", level.ether_stiffness},
                   {"ether_q", ether_damping_json(level, step_s)},
                   {"drag", level.drag}};
  json["trimmed"] = trimmed_json(level.geometry);
  json["springs"] = springs_json(level, step_s);
  json["attachments"] = attachments_json(level, step_s);
  json["metaballs"] = metaballs_json(level);
  json["wind"] = vector_json(dump.wind_m_per_s);
  json["resets"] = dump.resets;
  json["notes"] = notes_json();
  return json.dump() + "\n";
}

}  // namespace hairnet::sim
