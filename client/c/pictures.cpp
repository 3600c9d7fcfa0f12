// What a GPU gets of all characters of a picture.
#include <algorithm>
#include <cmath>

#include "client/c/handles.hpp"
#include "client/draw/character_records.hpp"
#include "client/draw/hair_motion.hpp"
#include "client/draw/light_rig.hpp"

// What a picture writes for its caller lives in the handle until its next call.
struct hairnet_picture {
  hairnet::draw::CharacterRecords records;
  hairnet::draw::HairMotion motion;
  hairnet::c::BasisNumbers bases;
  // The geometry of each lattice that the program itself gives, by the index of its character in the call.
  std::vector<hairnet::LevelGeometry> geometries;
  std::vector<hairnet::draw::ShownCharacter> characters;
  // For each record, the index of its character in the call.
  std::vector<std::size_t> order;
  std::vector<hairnet_source> sources;
  std::vector<hairnet_motion> motions;
  std::vector<std::uint16_t> swing;
};

namespace hairnet::c {
namespace {

constexpr std::uint32_t kNodesMin = 2, kNodesMax = 64;  // on an axis

static_assert(HAIRNET_RECORD_TEXELS == draw::CharacterRecords::kRecordTexels);
static_assert(HAIRNET_NODE_TEXELS == draw::kLatticeRow);
static_assert(sizeof(Eigen::Vector4f) == 4 * sizeof(float));

template <class... Numbers>
bool are_finite(const Numbers&... numbers) {
  const auto is_valid = [](const auto& each) {
    return std::ranges::all_of(each, [](auto number) { return std::isfinite(number); });
  };
  return (is_valid(numbers) && ...);
}

bool is_valid(const hairnet_lattice& lattice) {
  return are_finite(lattice.origin, lattice.spacing) &&
         std::ranges::all_of(lattice.spacing, [](float each) { return each > 0; }) &&
         std::ranges::all_of(lattice.counts, [](std::uint32_t each) { return each >= kNodesMin && each <= kNodesMax; });
}

// Only the numbers that are used are checked: a caller may leave boxes unset where there is no light.
bool is_valid(const hairnet_drawn& one) {
  const auto& [share, follow_hairs, tolerance_m, quadratic] = one.detail;
  return are_finite(one.pose, one.hair, one.hair_tip, one.skin,
                    std::array{one.scale, one.roughness, one.strand_width_m, share, follow_hairs, quadratic}) &&
         (one.has_light == 0 || are_finite(one.box, one.root_box));
}

draw::DrawDetail detail_of(const hairnet_detail& detail) {
  return {detail.strand_share, detail.follow_hair_count, detail.tolerance_m, detail.quadratic};
}

Eigen::AlignedBox3f box_of(const float (&box)[6]) {
  return {Vec3f(box[0], box[1], box[2]), Vec3f(box[3], box[4], box[5])};
}

// Reads the lattice of a scene's character, or the program's own one, whose geometry goes into `geometry`. Neither: the
// hair is at rest.
hairnet_error read_lattice(const hairnet_drawn& one, LevelGeometry& geometry, MovedLattice& moved) {
  if (one.scene != nullptr) {
    if (one.index >= one.scene->shown.size()) return HAIRNET_NOT_THERE;
    moved = one.scene->shown[one.index].lattice;
  } else if (one.nodes != nullptr) {
    const auto& [origin, spacing, counts, basis, mode_count] = one.lattice;
    // An invalid lattice moves nothing, which is how a caller says that hair is at rest.
    if (!is_valid(one.lattice)) return HAIRNET_OK;
    geometry.lattice = {Vec3f(origin), Vec3f(spacing), {}};
    std::ranges::copy(counts, geometry.lattice.dims.begin());
    static_assert(sizeof(Vec3f) == 3 * sizeof(float));
    moved = {&geometry, {reinterpret_cast<const Vec3f*>(one.nodes), geometry.lattice.node_count()}};
  }
  return HAIRNET_OK;
}

hairnet_error read_character(const hairnet_drawn& one, LevelGeometry& geometry, draw::ShownCharacter& character) {
  // A character that is not drawn keeps its place and its rows of nodes, so that it can come back without a new upload.
  if (one.record == HAIRNET_NOT_DRAWN) return read_lattice(one, geometry, character.lattice);
  if (!is_valid(one)) return HAIRNET_INVALID;
  character.pose = pose_of(one.pose);
  character.scale = one.scale;
  character.hair_colour = Vec3f(one.hair);
  character.hair_tip_colour = Vec3f(one.hair_tip);
  character.skin_colour = Vec3f(one.skin);
  character.roughness = one.roughness;
  character.body_shown = one.hides_body == 0;
  return read_lattice(one, geometry, character.lattice);
}

// Finds the character of each record. Returns false unless the records of the drawn characters are 0, 1 and so on, each
// once.
bool put_in_order(std::span<const hairnet_drawn> drawn, std::vector<std::size_t>& order) {
  const auto is_drawn = [](const hairnet_drawn& one) { return one.record != HAIRNET_NOT_DRAWN; };
  order.assign(static_cast<std::size_t>(std::ranges::count_if(drawn, is_drawn)), drawn.size());
  for (std::size_t i = 0; i < drawn.size(); ++i) {
    if (!is_drawn(drawn[i])) continue;
    // drawn.size() marks a place that nobody has taken. With as many characters as places, each once means all.
    if (drawn[i].record >= order.size() || order[drawn[i].record] != drawn.size()) return false;
    order[drawn[i].record] = i;
  }
  return true;
}

hairnet_error read(hairnet_picture& picture, std::span<const hairnet_drawn> drawn, std::size_t rows_max) {
  if (!put_in_order(drawn, picture.order) || picture.order.size() > rows_max) return HAIRNET_INVALID;
  picture.characters.assign(drawn.size(), {});
  // All places exist before the loop: lattices point into this vector, which must not grow meanwhile.
  picture.geometries.resize(drawn.size());
  for (std::size_t i = 0; i < drawn.size(); ++i) {
    const hairnet_error error = read_character(drawn[i], picture.geometries[i], picture.characters[i]);
    if (error != HAIRNET_OK) return error;
  }
  return HAIRNET_OK;
}

// Returns the number of grids of density.
std::size_t add_records(hairnet_picture& picture, std::span<const hairnet_drawn> drawn) {
  std::size_t grids = 0;
  for (const std::size_t i : picture.order) {
    const hairnet_drawn& one = drawn[i];
    const draw::DrawDetail detail = detail_of(one.detail);
    std::optional<draw::DensityGrid> density;
    if (one.has_light != 0)
      density = draw::density_of({box_of(one.box), box_of(one.root_box), one.strand_width_m, one.strand_count}, detail,
                                 picture.characters[i].lattice, grids);
    picture.records.add(i, Vec3::Zero(), detail, one.strand_width_m, {one.first_row, one.row_count},
                        density ? &*density : nullptr);
    if (density) ++grids;
  }
  return grids;
}

// Maps head space to picture space, the scale of the character included.
void write_transform(const RigidTransform& head, float scale, double (&out)[16]) {
  Eigen::Matrix4d transform = Eigen::Matrix4d::Identity();
  transform.topLeftCorner<3, 3>() = static_cast<double>(scale) * head.rotation.toRotationMatrix();
  transform.topRightCorner<3, 1>() = head.position;
  // Eigen stores columns one after the other, as shaders take them.
  std::ranges::copy(transform.reshaped(), out);
}

}  // namespace
}  // namespace hairnet::c

using namespace hairnet;

void hairnet_choose_details(hairnet_drawn* drawn, size_t count, float quality) {
  for (hairnet_drawn& one : std::span(drawn, count)) {
    const draw::DrawDetail detail = draw::detail_for(one.head_px, quality, one.strand_count);
    one.detail = {detail.strand_share, detail.follow_hair_count, detail.tolerance_m, detail.quadratic};
  }
}

hairnet_node_sum hairnet_node_sum_for(const char* renderer) {
  return draw::node_sum_for(renderer) == draw::NodeSum::gpu ? HAIRNET_SUM_BY_GPU : HAIRNET_SUM_BY_PROCESSOR;
}

hairnet_error hairnet_picture_make(hairnet_picture** picture) {
  return c::guarded([&] {
    *picture = new hairnet_picture;
    return hairnet_error{HAIRNET_OK};
  });
}

void hairnet_picture_free(hairnet_picture* picture) {
  delete picture;
}

hairnet_error hairnet_picture_write(hairnet_picture* picture, const hairnet_drawn* drawn, size_t count,
                                    hairnet_node_sum sum, size_t rows_max, hairnet_picture_data* data) {
  return c::guarded([&] {
    const std::span all(drawn, count);
    if (const hairnet_error error = c::read(*picture, all, rows_max); error != HAIRNET_OK) return error;
    draw::CharacterRecords& records = picture->records;
    records.begin(picture->characters, sum == HAIRNET_SUM_BY_GPU ? draw::NodeSum::gpu : draw::NodeSum::processor,
                  rows_max);
    *data = {};
    data->light_grids = c::add_records(*picture, all);
    if (records.count() > 0) data->records = records.records().front().data();
    data->record_count = records.count();
    if (!records.uploaded_nodes().empty()) data->nodes = records.uploaded_nodes().front().data();
    data->nodes_rows = records.uploaded_nodes().size() / draw::kLatticeRow;
    data->node_rows = records.node_rows();
    picture->bases.forget_unused();
    picture->sources.clear();
    for (const auto& [basis, geometry, character, first, end] : records.sources()) {
      const hairnet_drawn* one = basis ? &drawn[character] : nullptr;
      picture->sources.push_back({one != nullptr ? picture->bases.number_of(basis) : 0,
                                  one != nullptr ? one->scene : nullptr, one != nullptr ? one->index : 0, first, end});
    }
    data->sources = picture->sources.data();
    data->source_count = picture->sources.size();
    return hairnet_error{HAIRNET_OK};
  });
}

void hairnet_picture_forget(hairnet_picture* picture) {
  picture->records.forget();
}

hairnet_error hairnet_picture_motions(hairnet_picture* picture, const hairnet_drawn* drawn, size_t count,
                                      hairnet_motions* motions) {
  return c::guarded([&] {
    std::vector<draw::MovingCharacter> shown;
    std::vector<LevelGeometry> geometries(count);
    for (std::size_t i = 0; i < count; ++i) {
      const hairnet_drawn& one = drawn[i];
      // The number 0 says that the caller does not follow this character from picture to picture.
      if (one.id == 0) continue;
      if (!c::are_finite(one.pose, std::array{one.scale, one.ball_radius_m, one.head_px}))
        return hairnet_error{HAIRNET_INVALID};
      draw::MovingCharacter& moving = shown.emplace_back();
      moving = {one.id, c::pose_of(one.pose).head(), {}, one.ball_radius_m, one.head_px, one.scale};
      const hairnet_error error = c::read_lattice(one, geometries[i], moving.lattice);
      if (error != HAIRNET_OK) return error;
    }
    picture->motions.clear();
    for (const auto& [now, before, scale, scale_before, ball_radius_m] : picture->motion.motions(shown)) {
      hairnet_motion& motion = picture->motions.emplace_back();
      c::write_transform(now, scale, motion.now);
      c::write_transform(before, scale_before, motion.before);
      motion.ball_radius_m = ball_radius_m;
    }
    picture->swing.clear();
    const std::size_t nodes = picture->motions.size() * draw::HairMotion::kSwingNodes * draw::HairMotion::kSwingNodes *
                              draw::HairMotion::kSwingNodes;
    for (const Eigen::Vector4f& moved : std::span(picture->motion.swing()).first(nodes)) {
      // Half floats are enough for a blur, and halve the upload.
      for (const float each : moved) picture->swing.push_back(Eigen::half(each).x);
    }
    *motions = {picture->motions.data(), picture->motions.size(), picture->swing.data()};
    return hairnet_error{HAIRNET_OK};
  });
}

void hairnet_studio_lights(const double towards_camera[3], hairnet_lights* lights) {
  const draw::LightRig rig = draw::studio_lights(Vec3(towards_camera), Vec3::UnitY());
  for (std::size_t i = 0; i < rig.towards.size(); ++i) {
    std::ranges::copy(rig.towards[i], lights->towards[i]);
    std::ranges::copy(rig.colours[i], lights->colours[i]);
  }
  std::ranges::copy(rig.ambient_above, lights->ambient_above);
  std::ranges::copy(rig.ambient_below, lights->ambient_below);
}
