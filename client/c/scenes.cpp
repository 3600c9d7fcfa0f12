#include <algorithm>

#include "client/c/handles.hpp"
#include "client/draw/mode_texels.hpp"
#include "client/room/appearance.hpp"

// The characters of a scene and the geometry of grooms, for programs that draw by themselves. hairnet.h says what each
// function promises.
namespace hairnet::c {
namespace {

const hairnet_scene::Shown* at(const hairnet_scene* scene, std::size_t index) {
  return index < scene->shown.size() ? &scene->shown[index] : nullptr;
}

// Returns null for an index beyond the end, and for a character whose hair is at rest.
const hairnet_scene::Shown* moved_at(const hairnet_scene* scene, std::size_t index) {
  const hairnet_scene::Shown* one = at(scene, index);
  return one == nullptr || one->lattice.geometry == nullptr ? nullptr : one;
}

void write_lattice(const hairnet_scene& scene, const MovedLattice& moved, hairnet_lattice& out) {
  const Lattice& lattice = moved.geometry->lattice;
  for (std::size_t axis = 0; axis < 3; ++axis) {
    out.origin[axis] = lattice.origin[static_cast<Eigen::Index>(axis)];
    out.spacing[axis] = lattice.spacing[static_cast<Eigen::Index>(axis)];
    out.counts[axis] = static_cast<std::uint32_t>(lattice.dims[axis]);
  }
  if (!moved.basis) return;
  // 0 stays for a lattice without a basis, whose nodes are given as they are.
  out.basis = scene.bases.number_of(moved.basis);
  out.mode_count = static_cast<std::uint32_t>(moved.basis->mode_count());
}

void write_shown(const hairnet_scene& scene, const hairnet_scene::Shown& one, hairnet_shown& out) {
  const room::Member& member = *one.member;
  out = {};
  out.member = member.number;
  out.own = member.own;
  out.session = member.session;
  out.owners_character = member.owners_character;
  out.level = static_cast<hairnet_level>(member.sample.level);
  out.has_pose = member.pose.has_value();
  if (member.pose) write_pose(*member.pose, out.pose);
  out.has_hair = member.groom != nullptr;
  out.moves = one.lattice.geometry != nullptr;
  // An owner without a choice gets colours by its number, the same in every program.
  out.appearance = appearance_of(member.appearance.value_or(room::default_appearance(member.number)));
  out.hash = member.groom_hash.data();
  out.tag = member.tag.c_str();
  out.tag_size = member.tag.size();
  out.error = member.error.c_str();
  out.delay_s = 1e-9 * static_cast<double>(member.playout.delay_ns());
  out.coefficients = one.lattice.coefficients.data();
  out.coefficient_count = one.lattice.coefficients.size();
  if (out.moves != 0) write_lattice(scene, one.lattice, out.lattice);
}

draw::HairPoints& points_of(const hairnet_scene& scene, const hairnet_scene::Shown& shown) {
  const room::Member& member = *shown.member;
  // Addresses are a safe key: forget_unused() drops an entry with the last member that shows it, and the entry itself
  // keeps its groom alive.
  const std::pair key(member.groom.get(), shown.lattice.geometry);
  const auto found = scene.points.find(key);
  if (found != scene.points.end()) {
    // The skin comes with the basis, later than the groom. Points that were prepared without it are prepared again.
    if (found->second.has_skin() == (member.skin != nullptr)) return found->second;
    scene.points.erase(found);
  }
  const auto geometry = shown.lattice.geometry != nullptr ? shown.geometry : nullptr;
  return scene.points.try_emplace(key, member.groom, geometry, member.skin).first->second;
}

void write_vectors(std::span<const Vec3f> from, float* out) {
  for (const Vec3f& vector : from) out = std::ranges::copy(vector, out).out;
}

// The layouts that hairnet.h describes have these sizes in bytes.
static_assert(sizeof(draw::StrandVertex) == 12 && sizeof(draw::CardVertex) == 48);
static_assert(sizeof(draw::FabricVertex) == 52 && sizeof(draw::BodyVertex) == 32);

// The bytes stay the geometry's; the caller copies them to its GPU.
template <class T>
void give(const std::vector<T>& values, const void** bytes, std::size_t* size) {
  *bytes = values.data();
  *size = values.size() * sizeof(T);
}

}  // namespace

void forget_unused(hairnet_scene& scene) {
  std::erase_if(scene.points, [&](const auto& entry) {
    return std::ranges::none_of(scene.shown, [&](const auto& one) {
      return std::pair(one.member->groom.get(), one.lattice.geometry) == entry.first;
    });
  });
  scene.bases.forget_unused();
}

}  // namespace hairnet::c

using namespace hairnet;

size_t hairnet_shown_count(const hairnet_scene* scene) {
  return scene->shown.size();
}

hairnet_error hairnet_get_shown(const hairnet_scene* scene, size_t first, hairnet_shown* shown, size_t count) {
  const std::size_t there = scene->shown.size();
  // The second comparison subtracts, since first + count could wrap.
  if (first > there || count > there - first) return HAIRNET_NOT_THERE;
  return c::guarded([&] {
    for (std::size_t i = 0; i < count; ++i) c::write_shown(*scene, scene->shown[first + i], shown[i]);
    return hairnet_error{HAIRNET_OK};
  });
}

hairnet_error hairnet_shown_groom(const hairnet_scene* scene, size_t index, hairnet_groom** groom) {
  return c::guarded([&] {
    const hairnet_scene::Shown* one = c::at(scene, index);
    if (one == nullptr || !one->member->groom) return hairnet_error{HAIRNET_NOT_THERE};
    *groom = new hairnet_groom{one->member->groom, one->member->groom_file, one->member->groom_hash};
    return hairnet_error{HAIRNET_OK};
  });
}

hairnet_error hairnet_shown_points(const hairnet_scene* scene, size_t index, float* points, float* tangents,
                                   size_t point_count) {
  return c::guarded([&] {
    const hairnet_scene::Shown* one = c::at(scene, index);
    if (one == nullptr || !one->member->groom || !one->member->pose) return hairnet_error{HAIRNET_NOT_THERE};
    const std::size_t count = one->member->groom->points.size();
    if (point_count < count) return hairnet_error{HAIRNET_TOO_SMALL};
    std::vector<Vec3f> placed(count), directions(tangents == nullptr ? 0 : count);
    c::points_of(*scene, *one).place(*one->member->pose, one->lattice, placed, directions);
    c::write_vectors(placed, points);
    if (tangents != nullptr) c::write_vectors(directions, tangents);
    return hairnet_error{HAIRNET_OK};
  });
}

hairnet_error hairnet_shown_nodes(const hairnet_scene* scene, size_t index, float* nodes, size_t node_count) {
  const hairnet_scene::Shown* one = c::moved_at(scene, index);
  if (one == nullptr) return HAIRNET_NOT_THERE;
  if (node_count < one->lattice.geometry->lattice.node_count()) return HAIRNET_TOO_SMALL;
  return c::guarded([&] {
    std::vector<Vec3f> scratch;
    c::write_vectors(nodes_of(one->lattice, scratch), nodes);
    return hairnet_error{HAIRNET_OK};
  });
}

hairnet_error hairnet_shown_modes(const hairnet_scene* scene, size_t index, float* texels, size_t* count) {
  const hairnet_scene::Shown* one = c::moved_at(scene, index);
  if (one == nullptr || !one->lattice.basis) return HAIRNET_NOT_THERE;
  const LevelGeometry& geometry = *one->lattice.geometry;
  const std::size_t capacity =
      std::exchange(*count, 4 * draw::kLatticeRow * draw::mode_rows(geometry, *one->lattice.basis));
  // A caller asks for the size first, with a null buffer.
  if (texels == nullptr) return HAIRNET_OK;
  if (capacity < *count) return HAIRNET_TOO_SMALL;
  return c::guarded([&] {
    float* out = texels;
    for (const Eigen::Vector4f& texel : draw::mode_texels(geometry, *one->lattice.basis))
      out = std::ranges::copy(texel, out).out;
    return hairnet_error{HAIRNET_OK};
  });
}

hairnet_error hairnet_shown_skin(const hairnet_scene* scene, size_t index, hairnet_skin* skin) {
  const hairnet_scene::Shown* one = c::at(scene, index);
  if (one == nullptr || !one->member->groom || !one->member->skin) return HAIRNET_NOT_THERE;
  return c::guarded([&] {
    // The grids live in the scene until the next call, so that the caller has nothing to free.
    scene->skin.emplace(*one->member->skin, one->member->groom->materials.base.thickness_m);
    scene->skin_grids.clear();
    for (const SkinGrid& grid : scene->skin->grids()) {
      hairnet_skin_grid& out = scene->skin_grids.emplace_back();
      out.bone = static_cast<std::uint32_t>(grid.bone);
      out.cell_m = grid.cell_m;
      out.first = grid.first;
      for (std::size_t axis = 0; axis < 3; ++axis) {
        out.origin[axis] = grid.origin[static_cast<Eigen::Index>(axis)];
        out.counts[axis] = static_cast<std::uint32_t>(grid.dims[axis]);
      }
    }
    const std::span<const SkinNode> nodes = scene->skin->nodes();
    *skin = {scene->skin_grids.data(), nodes.empty() ? nullptr : &nodes.front().distance, scene->skin_grids.size(),
             nodes.size(), scene->skin->thickness_m()};
    return hairnet_error{HAIRNET_OK};
  });
}

hairnet_error hairnet_geometry_make(const hairnet_groom* groom, int32_t is_coarse, hairnet_geometry** geometry) {
  return c::guarded([&] {
    const std::optional<Groom> coarse = is_coarse != 0 ? draw::coarse_groom(*groom->groom) : std::nullopt;
    if (is_coarse != 0 && !coarse) return hairnet_error{HAIRNET_NOT_THERE};
    *geometry = new hairnet_geometry{draw::make_groom_geometry(coarse ? *coarse : *groom->groom)};
    return hairnet_error{HAIRNET_OK};
  });
}

void hairnet_get_geometry_numbers(const hairnet_geometry* geometry, hairnet_geometry_numbers* numbers) {
  const draw::GroomGeometry& g = geometry->geometry;
  *numbers = {static_cast<std::uint32_t>(g.strand_count), g.strand_width_m, g.radius_m};
}

void hairnet_geometry_free(hairnet_geometry* geometry) {
  delete geometry;
}

hairnet_error hairnet_geometry_part(const hairnet_geometry* geometry, hairnet_part part, uint32_t list,
                                    const void** bytes, size_t* size) {
  const draw::GroomGeometry& g = geometry->geometry;
  const bool is_list = part == HAIRNET_STRAND_INDICES || part == HAIRNET_STRAND_INDEX_ENDS;
  // Parts other than the simplified strands exist once.
  if (list >= (is_list ? g.simplified_strands.size() : 1)) return HAIRNET_NOT_THERE;
  switch (part) {
    case HAIRNET_STRAND_POINTS:
      return c::give(g.strand_points.rest, bytes, size), HAIRNET_OK;
    case HAIRNET_STRAND_ARCS:
      return c::give(g.strand_points.arc, bytes, size), HAIRNET_OK;
    case HAIRNET_STRAND_ENDS:
      return c::give(g.strand_points.end, bytes, size), HAIRNET_OK;
    case HAIRNET_STRAND_VERTICES:
      return c::give(g.strand_vertices, bytes, size), HAIRNET_OK;
    case HAIRNET_STRAND_INDICES:
      return c::give(g.simplified_strands[list].triangles, bytes, size), HAIRNET_OK;
    case HAIRNET_STRAND_INDEX_ENDS:
      return c::give(g.simplified_strands[list].end, bytes, size), HAIRNET_OK;
    case HAIRNET_CARD_VERTICES:
      return c::give(g.cards.vertices, bytes, size), HAIRNET_OK;
    case HAIRNET_CARD_INDICES:
      return c::give(g.cards.triangles, bytes, size), HAIRNET_OK;
    case HAIRNET_FABRIC_VERTICES:
      return c::give(g.fabric.vertices, bytes, size), HAIRNET_OK;
    case HAIRNET_FABRIC_INDICES:
      return c::give(g.fabric.triangles, bytes, size), HAIRNET_OK;
    case HAIRNET_BODY_VERTICES:
      return c::give(g.body.vertices, bytes, size), HAIRNET_OK;
    case HAIRNET_BODY_INDICES:
      return c::give(g.body.triangles, bytes, size), HAIRNET_OK;
  }
  return HAIRNET_NOT_THERE;
}

size_t hairnet_geometry_lists(const hairnet_geometry* geometry, float* tolerances_m, size_t capacity) {
  const auto& lists = geometry->geometry.simplified_strands;
  for (std::size_t i = 0; tolerances_m != nullptr && i < std::min(capacity, lists.size()); ++i)
    tolerances_m[i] = lists[i].tolerance_m;
  return lists.size();
}
