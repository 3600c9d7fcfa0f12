#include "tests/wasm/same_bits.hpp"

#include <algorithm>
#include <memory>
#include <numeric>
#include <vector>

#include "client/draw/groom_geometry.hpp"
#include "core/ffd/deform.hpp"
#include "core/ffd/skin_push.hpp"
#include "core/learnt/learnt_hair.hpp"
#include "core/levels/build.hpp"
#include "core/modes/moved_lattice.hpp"
#include "core/random.hpp"
#include "core/world/world.hpp"
#include "schema/wire/basis_file.hpp"
#include "schema/wire/groom_file.hpp"
#include "schema/wire/learnt_file.hpp"
#include "schema/wire/level_file.hpp"
#include "schema/wire/packing.hpp"
#include "tests/wasm/session.hpp"

namespace hairnet::same_bits {
namespace {

// The coordinates are from -size to size. Each is drawn in a statement of its own, since the order in which arguments
// are evaluated differs between compilers.
Vec3f vector(Random& random, float size) {
  const auto number = [&] { return size * static_cast<float>(random.symmetric()); };
  const float x = number(), y = number(), z = number();
  return {x, y, z};
}

std::vector<Vec3f> vectors(Random& random, std::size_t count, float size) {
  std::vector<Vec3f> all(count);
  for (Vec3f& one : all) one = vector(random, size);
  return all;
}

// A lattice about the points, with 6 x 7 x 5 nodes, so that a mix-up of axes shows. Flat hair gets cells of at least 1
// cm.
Lattice lattice_about(std::span<const Vec3f> points) {
  Vec3f low = points[0], high = points[0];
  for (const Vec3f& point : points) {
    low = low.cwiseMin(point);
    high = high.cwiseMax(point);
  }
  Lattice lattice;
  lattice.dims = {6, 7, 5};
  lattice.origin = low;
  for (int a = 0; a < 3; ++a)
    lattice.spacing[a] =
        std::max(0.01f, (high[a] - low[a]) / static_cast<float>(lattice.dims[static_cast<std::size_t>(a)] - 1));
  return lattice;
}

// One member of each element.
template <class Element, class Member>
std::vector<Member> column(const std::vector<Element>& elements, Member Element::*member) {
  std::vector<Member> out;
  for (const Element& element : elements) out.push_back(element.*member);
  return out;
}

// The light of a vertex is a byte for each of several directions, and a byte is now and then the next one. So only the
// mean over all vertices is compared: with 0.05, one vertex in twenty may have such a byte.
template <class Vertex>
void light_of(std::string_view what, const std::vector<Vertex>& vertices, Results& out) {
  double sum = 0;
  for (const Vertex& vertex : vertices)
    sum += std::accumulate(vertex.sides.begin(), vertex.sides.end(), 0.0) + vertex.ends[0] + vertex.ends[1];
  const double mean = vertices.empty() ? 0 : sum / static_cast<double>(vertices.size());
  out.near(0.05, std::string("light of ") + std::string(what), {&mean, 1});
}

// Compares what a page draws: strands, hair cards, fabric and the body.
void geometry_of(const Groom& groom, Results& out) {
  const draw::GroomGeometry geometry = draw::make_groom_geometry(groom);
  out.equal("points of strands", geometry.strand_points.rest);
  out.equal("lengths of strands", geometry.strand_points.arc);
  out.equal("strands of vertices", column(geometry.strand_vertices, &draw::StrandVertex::strand));
  light_of("strands", geometry.strand_vertices, out);
  for (const draw::SimplifiedStrands& list : geometry.simplified_strands)
    out.equal("triangles of strands", list.triangles);
  out.equal("points of cards", column(geometry.cards.vertices, &draw::CardVertex::rest));
  out.equal("directions of cards", column(geometry.cards.vertices, &draw::CardVertex::direction));
  out.equal("sides of cards", column(geometry.cards.vertices, &draw::CardVertex::side));
  light_of("cards", geometry.cards.vertices, out);
  out.equal("points of fabric", column(geometry.fabric.vertices, &draw::FabricVertex::rest));
  out.equal("directions of fabric", column(geometry.fabric.vertices, &draw::FabricVertex::direction));
  out.equal("colours of fabric", column(geometry.fabric.vertices, &draw::FabricVertex::albedo));
  light_of("fabric", geometry.fabric.vertices, out);
  out.equal("points of the body", column(geometry.body.vertices, &draw::BodyVertex::rest));
  // The fourth of these is the share of scalp, which an exponential of the C library gives.
  std::vector<std::uint16_t> normals;
  double scalp = 0;
  for (const draw::BodyVertex& vertex : geometry.body.vertices) {
    normals.insert(normals.end(), vertex.normal.begin(), vertex.normal.begin() + 3);
    scalp += vertex.normal[3];
  }
  scalp /= static_cast<double>(std::max<std::size_t>(geometry.body.vertices.size(), 1));
  out.equal("normals of the body", normals);
  out.near(1, "scalp, in bits of halves, on the mean", {&scalp, 1});
  out.equal("bones of the body", column(geometry.body.vertices, &draw::BodyVertex::shares));
  light_of("body", geometry.body.vertices, out);
  out.equal("triangles of the body", geometry.body.triangles);
}

void of_groom(std::span<const std::uint8_t> file, Results& out) {
  out.equal("hash", wire::hash_groom(file));
  const Result<Groom> groom = wire::decode_groom(file);
  HAIRNET_ASSERT(groom);
  out.equal("points", groom->points);
  out.equal("ends", groom->strand_begin);
  out.equal("vertices", groom->body.mesh.vertices);
  out.equal("weights of bones", groom->body.bone_weights);
  const std::vector<float> blend = root_blend(*groom);
  out.equal("blend", blend);
  const RestTangents tangents = rest_tangents(*groom, blend);
  out.equal("directions", tangents.direction);
  geometry_of(*groom, out);

  const Lattice lattice = lattice_about(groom->points);
  Random random(1);
  // Each node moves by up to 3 cm on each axis, as much as hair may swing.
  const std::vector<Vec3f> nodes = vectors(random, lattice.node_count(), 0.03f);
  std::vector<Vec3f> points(groom->points.size()), directions(groom->points.size());
  for (const FfdKind kind : {FfdKind::linear, FfdKind::quadratic}) {
    const Deformer deformer(lattice, groom->points, blend, tangents, kind);
    deformer.deform(nodes, points, directions);
    out.equal("deformed points", points);
    out.equal("deformed directions", directions);
  }
}

void of_basis(std::span<const std::uint8_t> file, Results& out) {
  const Result<wire::HairBasis> hair = wire::decode_basis(file);
  HAIRNET_ASSERT(hair);
  out.equal("active nodes", hair->geometry.active_nodes);
  out.equal("modes", hair->basis.modes);
  Random random(2);
  std::vector<float> coefficients;
  for (const float deviation_m : hair->basis.deviation_m)
    coefficients.push_back(deviation_m * static_cast<float>(random.symmetric()));
  std::vector<Vec3f> scratch;
  const MovedLattice lattice{&hair->geometry, {}, std::make_shared<const Basis>(hair->basis), coefficients};
  const std::span<const Vec3f> nodes = nodes_of(lattice, scratch);
  out.equal("nodes", nodes);

  codec::EncodedFrame frame;
  const codec::CoefficientCode code(hair->basis.deviation_m);
  // Step 0 is the finest error of coefficients, and step 3 an error eight times as large.
  for (const unsigned step : {0u, 3u}) {
    codec::encode_frame(rigid_pose({Quat(0.5, -0.5, 0.5, 0.5), Vec3(1, 1.5, -2)}), &code, coefficients, step, frame);
    out.equal("frame", frame.bytes);
    codec::DecodedFrame decoded;
    const bool is_whole = codec::decode_frame(frame.bytes, &code, decoded);
    HAIRNET_ASSERT(is_whole);
    out.equal("coefficients of the frame", decoded.coefficients);
  }

  // Points are pushed to 6 mm outside of the skin. The 200 points of each field lie up to 16 cells from its corner on
  // each axis, inside its grid and far outside.
  const SkinPush push(hair->skin, 0.006f);
  out.equal("nodes of the skin", push.nodes());
  std::vector<Vec3f> points;
  for (const SkinDistanceField& field : hair->skin) {
    for (int i = 0; i < 200; ++i) points.push_back(field.origin + field.cell_m * (vector(random, 8) + Vec3f(8, 8, 8)));
  }
  const std::vector<Vec3f> rest = points;
  Pose pose = rigid_pose({});
  pose[Bone::left_shoulder].position = Vec3(0.01, 0.03, 0);
  push.push(pose, rest, {}, points);
  out.equal("points out of the skin", points);
}

// A head that goes to and fro without a sine.
Pose moved_pose(int tick) {
  const double t = tick % 40 / 10.0 - 2, swing = tick % 80 < 40 ? t : -t;
  const Quat turn = Quat(1, 0.1 * swing, 0.3 * swing, 0.05).normalized();
  return rigid_pose({turn, Vec3(0.1 * swing, 1.6, 0.05)});
}

void of_learnt(std::span<const std::uint8_t> file, Results& out) {
  const Result<LearntHair> hair = wire::decode_learnt(file);
  HAIRNET_ASSERT(hair);
  out.equal("weights", hair->hidden_weights);
  LearntState state;
  std::vector<float> coefficients(hair->mode_count), all;
  for (int tick = 0; tick < 60; ++tick) {
    const Pose pose = moved_pose(tick);
    LearntMember member{.state = &state, .pose = &pose, .coefficients = coefficients};
    step_learnt(*hair, {&member, 1});
    all.insert(all.end(), coefficients.begin(), coefficients.end());
  }
  out.equal("coefficients", all);
}

void of_session(std::span<const std::uint8_t> steps, Results& out) {
  SessionClient client;
  for (const Step& step : read_steps(steps)) client.take(step);
  client.write(out);
}

void of_world(std::span<const std::uint8_t> file, const wire::GroomHash& groom, Results& out) {
  wire::DecodedLevels decoded = wire::decode_levels(file, groom);
  HAIRNET_ASSERT(decoded.levels);
  // Ticks that are one step each: between the poses of longer ones it interpolates, by the C library's sine.
  WorldDef def;
  def.tick_s = 1.0 / 60;
  World world(def);
  std::vector<CharacterId> characters;
  for (const LevelIndex level : {LevelIndex::high, LevelIndex::medium, LevelIndex::low, LevelIndex::ether})
    characters.push_back(world.add({decoded.levels, level, moved_pose(0), 0}));
  std::vector<double> still, windy;  // displacements, m
  for (int tick = 1; tick < 60; ++tick) {
    // The first half second is in still air, and the second in wind with gusts. Each is compared at its last tick.
    if (tick == 30) {
      Wind wind;
      wind.mean_m_per_s = Vec3(2, 0, 1);
      wind.gust_ratio = 0.5;
      wind.turbulence_rms_m_per_s = 0.5;
      Environment environment;
      environment.wind = WindField(wind);
      world.set_environment(environment);
    }
    for (const CharacterId id : characters) world.set_pose(id, moved_pose(tick));
    world.step();
    if (tick != 29 && tick != 59) continue;
    for (const CharacterId id : characters) {
      for (const Vec3f& d : world.lattice(id).displacement) {
        for (int axis = 0; axis < 3; ++axis) (tick == 29 ? still : windy).push_back(d[axis]);
      }
    }
  }
  out.near(1e-5, "still air", still);
  out.near(1e-5, "wind", windy);
}

}  // namespace

std::string results_of(std::span<const std::uint8_t> cases) {
  Results out;
  // The hash of the last groom, whose levels follow.
  wire::GroomHash groom{};
  for (Reader from(cases); !from.is_at_end();) {
    const Case one = take_case(from);
    out.begin_case(one.kind, one.name);
    if (one.kind == "groom") {
      groom = wire::hash_groom(one.input);
      of_groom(one.input, out);
    }
    if (one.kind == "basis") of_basis(one.input, out);
    if (one.kind == "learnt") of_learnt(one.input, out);
    if (one.kind == "session") of_session(one.input, out);
    if (one.kind == "levels") of_world(one.input, groom, out);
  }
  return out.lines();
}

}  // namespace hairnet::same_bits
