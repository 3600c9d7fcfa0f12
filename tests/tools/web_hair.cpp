#include "tests/tools/web_hair.hpp"

#include <algorithm>
#include <string>
#include <vector>

#include "client/assets/made/made.hpp"
#include "client/files/read_file.hpp"
#include "core/ffd/deform.hpp"
#include "core/ffd/reference_deform.hpp"
#include "core/ffd/strand_lengths.hpp"
#include "core/hair_cards/far_cards.hpp"
#include "schema/wire/groom_file.hpp"
#include "tests/support/random_messages.hpp"
#include "tests/support/spoilt_grooms.hpp"
#include "tests/tools/hex.hpp"
#include "tests/tools/web_messages.hpp"
#include "tests/tools/web_random.hpp"

namespace hairnet {
namespace {

using Json = nlohmann::ordered_json;

// Points and tangents as the web client gives them: numbers one after the other.
struct Deformed {
  Json points = Json::array(), tangents = Json::array();
  void add(const DeformedPoint& point) {
    append(point.x, points);
    append(point.tangent, tangents);
  }
};

Json ffd_case(WebRandom& random, FfdKind kind, const std::array<int, 3>& dims) {
  const LevelGeometry geometry = random.geometry(dims);
  const std::vector<Vec3f> active = random.vectors(geometry.active_nodes.size(), 0.1f);
  std::vector<Vec3f> grid(geometry.lattice.node_count());
  expand_displacements(geometry, active, grid);
  std::vector<Vec3f> points, directions;
  std::vector<float> delta, slope;
  Deformed expected;
  for (int p = 0; p < 200; ++p) {
    // A third of them outside of the lattice, on any side.
    const Vec3f share = 0.5f * (random.vector(1.6f) + Vec3f::Ones());
    Vec3f extent;
    for (int a = 0; a < 3; ++a) extent[a] = static_cast<float>(dims[static_cast<std::size_t>(a)] - 1);
    points.push_back(geometry.lattice.origin + share.cwiseProduct(extent.cwiseProduct(geometry.lattice.spacing)));
    directions.push_back(random.vector(1).normalized());
    delta.push_back(0.5f * (random.real(1) + 1));
    slope.push_back(random.real(20));
    const RestPoint rest{points.back().cast<double>(), delta.back(), directions.back().cast<double>(), slope.back()};
    expected.add(reference_deform(geometry.lattice, kind, rest, grid));
  }
  return {{"kind", kind == FfdKind::quadratic ? "quadratic" : "linear"},
          {"geometry", to_json(geometry)},
          {"active", flat(active)},
          {"grid", flat(grid)},
          {"points", flat(points)},
          {"blend", delta},
          {"direction", flat(directions)},
          {"blendSlope", slope},
          {"deformed", expected.points},
          {"tangents", expected.tangents}};
}

// The groom of the file, whose numbers are rounded.
Json groom_case(const std::vector<std::uint8_t>& file, WebRandom& random) {
  const Groom groom = wire::decode_groom(file).value();
  const LevelGeometry geometry = random.geometry_around(groom.points);
  const std::vector<float> blend = root_blend(groom);
  const RestTangents rest = rest_tangents(groom, blend);
  const Deformer deformer(geometry.lattice, groom.points, blend, rest, FfdKind::quadratic);
  const std::vector<Vec3f> grid = random.vectors(geometry.lattice.node_count(), 0.05f);
  std::vector<Vec3f> points(groom.points.size()), tangents(groom.points.size());
  deformer.deform(grid, points, tangents);
  std::vector<Vec3f> limited = points;
  StrandLengths(groom).limit(limited);
  const std::vector<float> far_blend = far_card_blend(groom);
  const RestTangents far_rest = far_card_tangents(groom.far_cards, far_blend);
  const Json far{{"blend", far_blend},
                 {"direction", flat(far_rest.direction)},
                 {"blendSlope", far_rest.blend_slope},
                 {"normals", flat(far_card_normals(groom.far_cards, far_rest))}};
  return {{"file", hex(file)},
          {"hash", hex(wire::hash_groom(file))},
          {"groom", to_json(groom)},
          {"rootBlend", blend},
          {"farCards", far},
          {"direction", flat(rest.direction)},
          {"blendSlope", rest.blend_slope},
          {"geometry", to_json(geometry)},
          {"grid", flat(grid)},
          {"deformed", flat(points)},
          {"limited", flat(limited)},
          {"tangents", flat(tangents)}};
}

// A file that an earlier version of this library wrote.
std::vector<std::uint8_t> older_groom(const std::string& version) {
  const auto bytes = read_file(HAIRNET_SOURCE_DIR "/tests/support/older_grooms/version_" + version + ".groom").value();
  const auto* data = reinterpret_cast<const std::uint8_t*>(bytes.data());
  return {data, data + bytes.size()};
}

}  // namespace

Json ffd_cases() {
  WebRandom random(2);
  Json cases = Json::array();
  for (const FfdKind kind : {FfdKind::quadratic, FfdKind::linear}) {
    for (const std::array<int, 3>& dims : {std::array{3, 3, 3}, {5, 5, 5}, {7, 4, 10}})
      cases.push_back(ffd_case(random, kind, dims));
  }
  cases.push_back(ffd_case(random, FfdKind::linear, {2, 2, 2}));
  return cases;
}

Json groom_cases() {
  WebRandom random(3);
  Json cases = Json::array();
  for (const char* style : {"bob", "ponytail", "plait", "veiled", "locks", "strips"}) {
    // Enough strands of one style for references and weights.
    const std::size_t strand_count = std::string_view(style) == "plait" ? 100 : 40;
    Groom groom = make_hairstyle(style, {.strand_count = strand_count}).value();
    groom.far_cards = make_far_cards(groom, 6);
    groom.body.mesh.vertices.resize(3);  // the bust is large, and always the same
    groom.body.bone_weights.resize(3);
    groom.body.mesh.triangles = {{0, 1, 2}};
    cases.push_back(groom_case(wire::encode_groom(groom), random));
  }
  for (std::uint64_t seed = 1; seed <= 12; ++seed)
    cases.push_back(groom_case(wire::encode_groom(wire::RandomMessages(seed).groom(seed)), random));
  for (const char* version : {"1", "2"}) cases.push_back(groom_case(older_groom(version), random));
  cases[cases.size() - 2]["groom"]["material"] = nullptr;  // the web client says that version 1 has none
  return cases;
}

Json spoilt_groom_cases() {
  Json cases = Json::array();
  for (const wire::SpoiltGroom& spoilt : wire::spoilt_grooms())
    cases.push_back({{"name", spoilt.name}, {"file", hex(spoilt.file)}});
  return cases;
}

Json root_blend_cases() {
  Json cases = Json::array();
  for (const RootBlend& blend :
       {RootBlend{}, RootBlend{{{1, 1}}}, RootBlend{{{0.5f, 0.1f}, {1, 0.6f}, {1.5f, 0.6f}, {3, 0.95f}}},
        RootBlend{{{0.1f, 0}, {0.2f, 0.9f}, {4, 1}}}}) {
    Json curve = Json::array(), ratios = Json::array(), delta = Json::array();
    for (const auto& point : blend.points) append(point, curve);
    for (double ratio = 0; ratio < 6; ratio += 0.03125) {
      ratios.push_back(ratio);
      delta.push_back(blend_at(blend, ratio));
    }
    cases.push_back({{"curve", curve}, {"ratios", ratios}, {"delta", delta}});
  }
  return cases;
}

}  // namespace hairnet
