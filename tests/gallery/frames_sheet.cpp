#include "tests/gallery/frames_sheet.hpp"

#include <array>
#include <memory>
#include <span>
#include <string>
#include <utility>
#include <vector>

#include "core/assert.hpp"
#include "core/learning/learn_hair.hpp"
#include "core/modes/make_modes.hpp"
#include "core/world/world.hpp"
#include "schema/codec/frame.hpp"
#include "tests/gallery/sheets.hpp"
#include "tests/support/corpus.hpp"

namespace hairnet::gallery {
namespace {

// The columns: times in the motion, ascending.
constexpr std::array kTimes_s{0.6, 1.4, 2.0, 2.6, 3.2};
// The allowed errors of the rows "1 mm" and "4 mm". The first is the default of wire::Observe::error_m.
constexpr std::array<float, 2> kErrors_m{0.001f, 0.004f};

struct Row {
  std::string name;
  std::vector<Moment> moments;
  // The bytes of the hair in each frame. It is empty for the row of nodes, which no frame has; 0 stands for learnt
  // hair, which the client computes itself.
  std::vector<std::size_t> bytes;
};

// Returns the finest lattice as a client computes it from the coefficients of a frame.
Moment moment_of(const Pose& pose, const LevelSet& levels, std::span<const float> coefficients) {
  const LevelGeometry& geometry = levels[LevelIndex::high].geometry;
  Moment moment{pose, &geometry, std::vector<Vec3f>(geometry.lattice.node_count())};
  std::vector<Vec3f> active(geometry.active_nodes.size());
  displacements_of(levels.modes->basis, coefficients, active);
  expand_displacements(geometry, active, moment.grid_displacements);
  return moment;
}

// Encodes the hair with this error and decodes it again. Returns the decoded coefficients, and the bytes of the frame
// without those of the pose.
std::pair<std::vector<float>, std::size_t> through_frame(const Pose& pose, const codec::CoefficientCode& code,
                                                         std::span<const float> coefficients, float error_m) {
  const codec::Detail detail = codec::detail_for(code, coefficients, error_m);
  codec::EncodedFrame frame;
  codec::encode_frame(pose, &code, coefficients.first(detail.count), detail.step, frame);
  codec::DecodedFrame decoded;
  const bool is_decoded = codec::decode_frame(frame.bytes, &code, decoded);
  HAIRNET_ASSERT(is_decoded);
  return {decoded.coefficients, frame.bytes.size() - (frame.pose_bits + 7) / 8};
}

Result<std::shared_ptr<const LevelSet>> learnt_levels(const Hairstyle& style) {
  auto levels = std::make_shared<LevelSet>(*style.levels);
  levels->modes = make_modes(*style.groom, style.levels);
  auto hair = learn_hair(*style.groom, levels, *levels->modes);
  if (!hair) return Refusal(style.name + ": " + hair.error());
  levels->learnt = *hair;
  return levels;
}

Result<std::vector<Row>> simulate_rows(const Hairstyle& style, const std::shared_ptr<const LevelSet>& levels,
                                       const std::string& name) {
  const LevelSet& set = *levels;
  const Result<Motion> motion = fidelity::load_motion(name, style.groom->body);
  if (!motion) return Refusal(motion.error());
  const fidelity::Clip clip = fidelity::make_clip(*motion, 1 / kLearntTick_s, kTimes_s.back() + kLearntTick_s);
  WorldDef def;
  def.tick_s = kLearntTick_s;
  World world(def);
  const CharacterId high = world.add({levels, LevelIndex::high, clip.poses[0]});
  const CharacterId low = world.add({levels, LevelIndex::low, clip.poses[0]});
  const CharacterId learnt = world.add({levels, LevelIndex::learnt, clip.poses[0]});
  const codec::CoefficientCode code(set.modes->basis.deviation_m);
  std::vector<Row> rows{
      {"nodes", {}, {}}, {"1 mm", {}, {}}, {"4 mm", {}, {}}, {"low, 1 mm", {}, {}}, {"learnt", {}, {}}};
  std::vector<float> c(set.modes->basis.mode_count());
  std::size_t next = 0;
  for (std::size_t tick = 1; next < kTimes_s.size() && tick < clip.poses.size(); ++tick) {
    const Pose& pose = clip.poses[tick];
    for (const CharacterId id : {high, low, learnt}) world.set_pose(id, pose);
    world.step();
    const double time_s = (static_cast<double>(tick) - static_cast<double>(clip.lead_in_ticks)) * kLearntTick_s;
    if (time_s + 1e-9 < kTimes_s[next]) continue;
    ++next;
    Moment nodes{pose, &set[LevelIndex::high].geometry, {}};
    nodes.grid_displacements.resize(nodes.geometry->lattice.node_count());
    expand_displacements(*nodes.geometry, world.lattice(high).displacement, nodes.grid_displacements);
    rows[0].moments.push_back(std::move(nodes));
    const auto add = [&](Row& row, float error_m) {
      const auto [decoded, bytes] = through_frame(pose, code, c, error_m);
      row.moments.push_back(moment_of(pose, set, decoded));
      row.bytes.push_back(bytes);
    };
    set.modes->map(LevelIndex::high).coefficients_of(world.lattice(high).displacement, c);
    for (std::size_t i = 0; i < kErrors_m.size(); ++i) add(rows[1 + i], kErrors_m[i]);
    set.modes->map(LevelIndex::low).coefficients_of(world.lattice(low).displacement, c);
    add(rows[3], kErrors_m[0]);
    rows[4].moments.push_back(moment_of(pose, set, world.lattice(learnt).coefficients));
    rows[4].bytes.push_back(0);
  }
  return rows;
}

}  // namespace

Result<render::Image> frames_sheet(render::Renderer& renderer, const Hairstyle& style, const std::string& motion,
                                   int size_px) {
  const Result<std::shared_ptr<const LevelSet>> levels = learnt_levels(style);
  if (!levels) return Refusal(levels.error());
  const Result<std::vector<Row>> rows = simulate_rows(style, *levels, motion);
  if (!rows) return Refusal(rows.error());
  const std::size_t groom = renderer.stage().add_groom(*style.groom);
  std::vector<render::Image> tiles;
  for (const Row& row : *rows) {
    for (std::size_t i = 0; i < row.moments.size(); ++i) {
      const draw::ShownCharacter character = shown(groom, row.moments[i]);
      // The camera stands 25 degrees to the left of the face, so that one side of the hair shows as well.
      const draw::Camera camera = camera_about(character.pose.head().position, *style.groom, 25);
      Result<render::Image> tile = renderer.draw({&character, 1}, camera, {}, size_px, size_px * 5 / 4);
      if (!tile) return tile;
      render::draw_text(*tile, 6, 6, row.name, 2);
      if (!row.bytes.empty()) render::draw_text(*tile, 6, 24, std::to_string(row.bytes[i]) + " bytes", 2);
      tiles.push_back(std::move(*tile));
    }
  }
  renderer.stage().remove_groom(groom);
  return render::contact_sheet(tiles, static_cast<int>(kTimes_s.size()));
}

}  // namespace hairnet::gallery
