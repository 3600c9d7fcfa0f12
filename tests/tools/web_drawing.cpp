#include "client/assets/made/made.hpp"
#include "client/draw/character_records.hpp"
#include "client/draw/draw_detail.hpp"
#include "client/draw/groom_geometry.hpp"
#include "client/draw/light_rig.hpp"
#include "client/draw/occlusion_grid.hpp"
#include "client/draw/scalp.hpp"
#include "core/hair_cards/far_cards.hpp"
#include "schema/wire/groom_file.hpp"
#include "tests/support/random_messages.hpp"
#include "tests/tools/hex.hpp"
#include "tests/tools/web_hair.hpp"
#include "tests/tools/web_messages.hpp"
#include "tests/tools/web_modes.hpp"
#include "tests/tools/web_random.hpp"

namespace hairnet {
namespace {

using Json = nlohmann::ordered_json;

// Numbers as they lie in memory (little endian), in hexadecimal: a third of their size as decimal text.
template <class Element>
std::string raw(const std::vector<Element>& numbers) {
  return hex({reinterpret_cast<const std::uint8_t*>(numbers.data()), numbers.size() * sizeof(Element)});
}

// One member of every vertex, or of every second one.
template <class Vertex, class Member>
std::string raw(const std::vector<Vertex>& vertices, Member Vertex::*member, std::size_t every = 1) {
  std::vector<Member> column;
  for (std::size_t v = 0; v < vertices.size(); v += every) column.push_back(vertices[v].*member);
  return raw(column);
}

// The vertices of triangles: there are fewer than 65,536.
std::string corners(const std::vector<std::uint32_t>& triangles) {
  return raw(std::vector<std::uint16_t>(triangles.begin(), triangles.end()));
}

template <class Vertex, class Direction>
Json mesh_of(const draw::Mesh<Vertex>& mesh, Direction Vertex::*direction) {
  return {{"rest", raw(mesh.vertices, &Vertex::rest)},
          {"direction", raw(mesh.vertices, direction)},
          {"sides", raw(mesh.vertices, &Vertex::sides)},
          {"ends", raw(mesh.vertices, &Vertex::ends)},
          {"triangles", corners(mesh.triangles)}};
}

Json cards_of(const draw::Mesh<draw::CardVertex>& mesh) {
  Json out = mesh_of(mesh, &draw::CardVertex::direction);
  out["side"] = raw(mesh.vertices, &draw::CardVertex::side);
  return out;
}

Json strands_of(const draw::GroomGeometry& geometry) {
  Json lists = Json::array();
  for (const draw::SimplifiedStrands& list : geometry.simplified_strands)
    lists.push_back({{"toleranceM", list.tolerance_m}, {"triangles", corners(list.triangles)}, {"end", raw(list.end)}});
  return {{"rest", raw(geometry.strand_points.rest)},
          {"arc", raw(geometry.strand_points.arc)},
          {"pointEnd", raw(geometry.strand_points.end)},
          {"sides", raw(geometry.strand_vertices, &draw::StrandVertex::sides, 2)},
          {"ends", raw(geometry.strand_vertices, &draw::StrandVertex::ends, 2)},
          {"strand", raw(geometry.strand_vertices, &draw::StrandVertex::strand, 2)},
          {"lists", lists}};
}

Json geometry_of(const Groom& groom) {
  const draw::GroomGeometry geometry = draw::make_groom_geometry(groom);
  Json fabric = mesh_of(geometry.fabric, &draw::FabricVertex::direction);
  fabric["albedo"] = raw(geometry.fabric.vertices, &draw::FabricVertex::albedo);
  fabric["cord"] = raw(geometry.fabric.vertices, &draw::FabricVertex::cord);
  Json body = mesh_of(geometry.body, &draw::BodyVertex::normal);
  body["shares"] = raw(geometry.body.vertices, &draw::BodyVertex::shares);
  return {{"strands", strands_of(geometry)},
          {"strandCount", geometry.strand_count},
          {"strandWidthM", geometry.strand_width_m},
          {"cards", cards_of(geometry.cards)},
          {"farCards", cards_of(geometry.far_cards)},
          {"farCardCount", geometry.far_card_count},
          {"waviness", geometry.waviness},
          {"fabric", fabric},
          {"body", body},
          {"radiusM", geometry.radius_m}};
}

// The occlusion grid of strands 1 mm wide and the scalp, at places in and about the hair.
void add_fields(const Groom& groom, WebRandom& random, Json& out) {
  const draw::OcclusionGrid occlusion(groom, 1e-3f);
  const draw::Scalp scalp(groom);
  std::vector<Vec3f> places, normals;
  std::vector<draw::Transmittance> open, on_surface;
  std::vector<float> shares;
  for (std::size_t n = 0; n < 60; ++n) {
    places.push_back(groom.points[random.below(groom.points.size())] + random.vector(n % 2 == 0 ? 0.01f : 0.1f));
    normals.push_back(random.vector(1).normalized());
    open.push_back(occlusion.at(places.back()));
    on_surface.push_back(occlusion.at(places.back(), normals.back()));
    shares.push_back(scalp.at(places.back()));
  }
  out["places"] = raw(places);
  out["normals"] = raw(normals);
  out["cellM"] = occlusion.cell_m();
  out["open"] = raw(open);
  out["onSurface"] = raw(on_surface);
  out["scalp"] = raw(shares);
}

// A made hairstyle of few strands, on a piece of its bust.
Groom small(const char* style) {
  Groom groom = make_hairstyle(style, {.length_m = 0.15, .strand_count = 10}).value();
  groom.far_cards = make_far_cards(groom, 3);
  for (Clump& clump : groom.clumps) clump.copy_count = 1;
  constexpr std::uint32_t kVertices = 100;
  TriangleMesh& mesh = groom.body.mesh;
  mesh.vertices.resize(kVertices);
  groom.body.bone_weights.resize(kVertices);
  std::erase_if(mesh.triangles, [](const auto& corners) { return *std::ranges::max_element(corners) >= kVertices; });
  return groom;
}

// A groom made at random that has something of every kind.
Groom of_every_kind() {
  for (std::uint64_t seed = 1;; ++seed) {
    Groom groom = wire::RandomMessages(seed).groom(4);
    if (!groom.clumps.empty() && !groom.threads.empty() && !groom.cards.empty() && !groom.cloths.empty() &&
        !groom.knots.empty() && !groom.far_cards.cards.empty())
      return groom;
  }
}

// A strand of more points than the GPU keeps to their length, a straight one along z (where the frame of a clump's
// copies begins), one without length, one of a single point; far cards reach further than all of them.
Groom of_odd_strands() {
  Groom groom;
  groom.group_names = {"all"};
  WebRandom random(23);
  std::vector<Vec3f> strand = random.vectors(300, 0.001f);
  for (std::size_t i = 0; i < strand.size(); ++i) strand[i] += Vec3f(0.1f, 0.2f - 0.001f * static_cast<float>(i), 0);
  groom.add_strand(strand, {});
  groom.add_strand(std::vector{Vec3f(0, 0.1f, 0.1f), Vec3f(0, 0.1f, 0.15f), Vec3f(0, 0.1f, 0.2f)}, {});
  groom.add_strand(std::vector{Vec3f(0.1f, 0, 0), Vec3f(0.1f, 0, 0)}, {});
  groom.add_strand(std::vector{Vec3f(0, 0, 0.1f)}, {});
  groom.clumps = {{1, 3, 0.004f, 0.002f}};
  groom.far_cards.add(
      std::vector{Vec3f(0, 0.1f, 0.1f), Vec3f(0.02f, 0.1f, 0.1f), Vec3f(0, 0, 0.9f), Vec3f(0.02f, 0, 0.9f)},
      {{}, 0.02f, 2, 0, true});
  return groom;
}

Json geometry_cases() {
  WebRandom random(21);
  Json cases = Json::array();
  for (const Groom& made : {small("plait"), small("locks"), small("strips"), of_every_kind(), of_odd_strands()}) {
    const std::vector<std::uint8_t> file = wire::encode_groom(made);
    const Groom groom = wire::decode_groom(file).value();  // with the file's rounded numbers
    Json one{{"file", hex(file)}, {"geometry", geometry_of(groom)}};
    add_fields(groom, random, one);
    cases.push_back(one);
  }
  return cases;
}

// Size, quality, count of strands and waviness, then the detail and the width of strands for them.
std::string detail_cases() {
  std::vector<std::array<float, 10>> cases;
  for (const std::size_t strands : {0u, 500u, 10'000u, 200'000u}) {
    for (const float waviness : {0.0f, 0.4f, 1.0f}) {
      for (const float quality : {0.5f, 1.0f, 2.0f}) {
        for (float px = 0; px < 1500; px = 1.4f * px + 4) {
          const draw::DrawDetail d = draw::detail_for(px, quality, strands, waviness);
          cases.push_back({px, quality, static_cast<float>(strands), waviness, d.strand_share, d.follow_hair_count,
                           d.tolerance_m, d.quadratic, d.cards, draw::width_scale(d)});
        }
      }
    }
  }
  return raw(cases);
}

Json light_cases() {
  Json cases = Json::array();
  const auto three = [](const Vec3& v) { return Json{v.x(), v.y(), v.z()}; };
  for (const Vec3& from : {Vec3(0, 0, 1), Vec3(1, 0.2, 0.1), Vec3(-2, 1.5, -3), Vec3(0.02, -4, 0.01), Vec3(0, 2, 0)}) {
    const Vec3 target(0.5, 1.6, -0.25);
    const draw::LightRig rig = draw::studio_lights({target + from, target, {0, 1, 0}, 30});
    cases.push_back({{"eye", three(target + from)},
                     {"target", three(target)},
                     {"towards", flat(rig.towards)},
                     {"colours", flat(rig.colours)},
                     {"ambient", flat(std::array{rig.ambient_above, rig.ambient_below})}});
  }
  return cases;
}

// One character as the shaders read it: its row of records, and the nodes of its lattice.
Json record_case() {
  WebRandom random(22);
  draw::ShownCharacter character;
  for (RigidTransform& bone : character.pose.bones)
    bone = {Quat(Eigen::AngleAxisd(1, random.vector(1).cast<double>().normalized())), random.vector(2).cast<double>()};
  const draw::DrawDetail detail{
      .strand_share = 0.4f, .follow_hair_count = 1.5f, .tolerance_m = 1e-3f, .quadratic = 0.25f, .cards = 0.75f};
  character.detail = detail;
  character.body_shown = false;
  character.hair_tip_colour = Vec3f(0.25f, 0.5f, 0.75f);
  character.roughness = 0.625f;
  const LevelGeometry geometry = random.geometry({3, 4, 5});
  const std::vector<Vec3f> grid = random.vectors(60, 0.1f);
  character.lattice = {&geometry, grid};
  const Eigen::AlignedBox3f rest(Vec3f(-0.2f, -0.3f, -0.1f), Vec3f(0.3f, 0.2f, 0.4f));
  const Eigen::AlignedBox3f roots(Vec3f(-0.1f, 0.05f, 0), Vec3f(0.1f, 0.25f, 0.1f));
  const draw::DensityGrid density = draw::density_grid(draw::moved_box(rest, roots, character.lattice), 3, 1e-3f);
  // The same with a lattice that moves in modes.
  const wire::HairBasis hair = make_basis(random, {3, 4, 5}, 6);
  const auto basis = std::make_shared<const Basis>(hair.basis);
  const std::vector<float> coefficients{0.1f, -0.2f, 0, 0.05f, 0.01f, 0};
  std::array characters{character, character};
  characters[1].lattice = {&hair.geometry, {}, basis, coefficients};
  draw::CharacterRecords records;
  records.begin(characters);
  for (const std::size_t number : {0, 1}) records.add(number, Vec3::Zero(), detail, 4e-4f, true, {7, 11}, &density);
  const auto middle = records.records().begin() + draw::CharacterRecords::kRecordTexels;
  const std::vector<Eigen::Vector4f> first(records.records().begin(), middle), second(middle, records.records().end());
  return {{"pose", to_json(character.pose)},
          {"hairAlbedo", flat(std::array{character.hair_colour})},
          {"hairTipAlbedo", flat(std::array{*character.hair_tip_colour})},
          {"roughness", character.roughness},
          {"skinAlbedo", flat(std::array{character.skin_colour})},
          {"strandWidthM", 4e-4},
          {"detail",
           {{"strandShare", detail.strand_share},
            {"followHairCount", detail.follow_hair_count},
            {"toleranceM", detail.tolerance_m},
            {"quadratic", detail.quadratic},
            {"cards", detail.cards}}},
          {"pointRows", {{"first", 7}, {"count", 11}}},
          {"strandBox", flat(std::array{Vec3f(rest.min()), Vec3f(rest.max())})},
          {"rootBox", flat(std::array{Vec3f(roots.min()), Vec3f(roots.max())})},
          {"lattice", {{"geometry", to_json(geometry)}, {"grid", flat(grid)}}},
          {"record", raw(first)},
          {"uploadedNodes", raw(records.uploaded_nodes())},
          {"inModes",
           {{"geometry", to_json(hair.geometry)},
            {"nodeCount", basis->node_count},
            {"deviationM", basis->deviation_m},
            {"unit", basis->unit},
            {"modes", basis->modes},
            {"coefficients", coefficients},
            {"record", raw(second)},
            {"texels", raw(draw::mode_texels(hair.geometry, *basis))}}}};
}

}  // namespace

Json drawing_cases() {
  return {
      {"geometry", geometry_cases()}, {"detail", detail_cases()}, {"lights", light_cases()}, {"record", record_case()}};
}

}  // namespace hairnet
