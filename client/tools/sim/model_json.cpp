#include "client/tools/sim/model_json.hpp"

#include <nlohmann/json.hpp>
#include <span>
#include <sstream>

#include "core/solver/contact.hpp"
#include "core/solver/node_terms.hpp"
#include "core/solver/spring.hpp"

namespace hairnet::sim {
namespace {

// Ordered, so that fields stand as the README lists them.
using Json = nlohmann::ordered_json;

template <class V>
Json vector_json(const V& v) {
  return {v[0], v[1], v[2]};
}

// Encodes stiffener `s`: nodes by grid index, with their weights, k, and q as the solver uses it at this step. The
// material is the one as built.
Json stiffener_json(const Level& level, const Stiffeners& stiffeners, float step_s, std::size_t s) {
  Json nodes = Json::array(), weights = Json::array();
  for (std::uint32_t e = stiffeners.begin[s]; e < stiffeners.begin[s + 1]; ++e) {
    nodes.push_back(level.geometry.active_nodes[stiffeners.nodes[e]]);
    // Floats are written as doubles with enough digits to read back the same bits.
    weights.push_back(stiffeners.weights[e]);
  }
  const auto [k, q] = stiffener_terms(stiffeners, {}, s, step_s);
  return {{"nodes", nodes}, {"weights", weights}, {"k", k}, {"q", q}};
}

Json springs_json(const Level& level, float step_s) {
  Json list = Json::array();
  for (std::size_t s = 0; s < level.springs.count(); ++s) {
    Json spring = stiffener_json(level, level.springs, step_s, s);
    // Only the length counts in eq. 3.
    spring["rest_length"] = level.springs.rest[s].cast<double>().norm();
    list.push_back(spring);
  }
  return list;
}

Json attachments_json(const Level& level, float step_s) {
  Json list = Json::array();
  for (std::size_t s = 0; s < level.attachments.count(); ++s) {
    Json attachment = stiffener_json(level, level.attachments, step_s, s);
    // An attachment is drawn to this point, which moves with the head (eq. 5).
    attachment["rest"] = vector_json(level.attachments.rest[s]);
    list.push_back(attachment);
  }
  return list;
}

// The paper's ether (3.2) with the damping that the solver uses.
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
      // The set's own entries are active indices; a reader has grid nodes only.
      from.push_back(g.active_nodes[g.trimmed_from[e]]);
      weights.push_back(g.trimmed_weights[e]);
    }
    list.push_back({{"node", g.trimmed_nodes[t]}, {"from", from}, {"weights", weights}});
  }
  return list;
}

Json skin_json(const Skin& skin) {
  Json list = Json::array();
  for (const SkinDistanceField& field : skin) {
    list.push_back({{"bone", kBoneNames[static_cast<std::size_t>(field.bone)]},
                    {"origin", vector_json(field.origin)},
                    {"cell", field.cell_m},
                    {"dims", field.dims},
                    {"distance", field.distance}});
  }
  return list;
}

Json contacts_json(const Level& level) {
  const ContactPoints& contacts = level.contacts;
  Json list = Json::array();
  for (std::size_t p = 0; p < contacts.count(); ++p) {
    Json nodes = Json::array(), weights = Json::array(), limits = Json::array();
    for (std::uint32_t e = contacts.begin[p]; e < contacts.begin[p + 1]; ++e) {
      nodes.push_back(level.geometry.active_nodes[contacts.nodes[e]]);
      weights.push_back(contacts.weights[e]);
    }
    // The limits of a point lie a field apart.
    for (std::size_t f = 0; f < level.skin->size(); ++f) limits.push_back(contacts.limit[f * contacts.count() + p]);
    list.push_back({{"nodes", nodes},
                    {"weights", weights},
                    {"rest", vector_json(contacts.rest[p])},
                    {"potential", contacts.potential[p]},
                    {"limit", limits}});
  }
  return list;
}

// As short as people write it: this is for a note, not for a computation.
std::string number(double x) {
  std::ostringstream text;
  text << x;
  return text.str();
}

// These notes are for somebody who integrates the model without our code: they must change with
// core/solver/contact.hpp.
std::string contact_note() {
  return "contact acts at points of hair, core/solver/contact.hpp: x = R x0 + sum_j w_j (p_j - R p0_j), "
         "with_bone = B1 B0^-1 x(start), with_head = R1 x0 + the same sum at the start, "
         "ahead = with_head + h sum_j w_j (p'_j - R' p0_j); per field, s its trilinear distance (outside the grid plus "
         "the way there) at B1^-1 of a point, n the unit gradient at with_bone; d = limit - s(with_bone), "
         "a = d - n.(ahead - with_bone); it acts where d > 0, or a > 0 and s < limit at the middle or the end of the "
         "way; slope = 6 U / " +
         number(kContactDepth_m) + "^3, k = slope clamp(max(d, a), 0, " + number(kContactStiffnessDepth_m) +
         "), F = min(slope d^2 / 2, k h " + number(kContactRecovery_m_per_s) +
         ") for d > 0, else k d; node j gets w_j (F - k n.(with_head - with_bone)) n - "
         "w_j k W n n^T (h (p'_1j - R' p0_j)), W = sum_j w_j; a limit of " +
         number(kContactNever_m) + " means never";
}

// The constants are the solver's own, so that the text cannot fall behind.
std::string spring_note() {
  return "a spring's tension is k x, and beyond x = " + number(kStiffStrain) + " of its rest length L k (x + " +
         number(kStiffening) + " (x - " + number(kStiffStrain) + " L)), below -" + number(kBucklingStrain) +
         " k (x - " + number(kBuckling) + " (x + " + number(kBucklingStrain) +
         " L)); its stiffness is the slope at the step's start";
}

// The parts of this model that differ from the paper's equations, or that these leave open. They are a part of the
// file, since it travels without our pages.
Json notes_json() {
  return {
      contact_note(),
      spring_note(),
      "spring forces are linearised about the step's start with the positive semi-definite part only (k e e^T, q e "
      "e^T)",
      "every q, of springs, attachments and ether, is what the solver uses at this rate and substeps: the material's "
      "less what backward Euler adds by itself, max(q - h k, -h k / 3), h the length of a substep; it may be negative",
      "the lattice as a whole is drawn towards the design, in displacement and velocity against the head's, where "
      "a node would be farther from it than 2.5 times the diagonal of the box of its lattice",
      "gravity acts on every node's whole mass, ether's included, as g - R g0, g0 = (0, -9.81, 0)",
      "drag tensors Q are in head axes and turn with the head: f = -R Q R^T (p' - wind)",
      "at a reset the lattice moves rigidly with the head: displacements and velocities keep their components in head "
      "axes, and no step is made",
      "a tick's substeps interpolate the poses (position linear, rotation slerp)"};
}

}  // namespace

std::string encode_model_json(const ModelDump& dump) {
  const Level& level = *dump.level;
  // All values of q depend on it: a dump is for one rate and number of substeps.
  const auto step_s = static_cast<float>(1 / (dump.rate_hz * dump.substep_count));
  const Lattice& lattice = level.geometry.lattice;
  Json json;
  json["format"] = "hairnet-model";
  json["version"] = 2;
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
  json["skin"] = skin_json(*level.skin);
  json["contacts"] = contacts_json(level);
  json["wind"] = vector_json(dump.wind_m_per_s);
  json["resets"] = dump.resets;
  json["notes"] = notes_json();
  // One line: it is long, and programs read it.
  return json.dump() + "\n";
}

}  // namespace hairnet::sim
