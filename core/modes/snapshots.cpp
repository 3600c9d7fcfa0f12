#include "core/modes/snapshots.hpp"

#include <cmath>

#include "core/assert.hpp"
#include "core/modes/training_motion.hpp"
#include "core/world/world.hpp"

namespace hairnet {
namespace {

constexpr double kTick_s = 1.0 / 30;

// Stores one snapshot: x of all nodes, then y, then z.
void put_column(std::span<const Vec3f> displacement, auto column) {
  const auto nodes = static_cast<Eigen::Index>(displacement.size());
  HAIRNET_ASSERT(column.size() == 3 * nodes);
  const Eigen::Map<const Eigen::Matrix3Xf> values(displacement.data()->data(), 3, nodes);
  for (Eigen::Index axis = 0; axis < 3; ++axis) column.segment(axis * nodes, nodes) = values.row(axis).transpose();
}

}  // namespace

Snapshots take_snapshots(const Groom& groom, const std::shared_ptr<const LevelSet>& levels,
                         const ModeTraining& training, const std::function<bool(double)>& keep_going,
                         const ParallelFor& parallel_for) {
  const auto tick_count = static_cast<std::size_t>(training.duration_s / kTick_s);
  const auto spacing = static_cast<std::size_t>(std::lround(training.snapshot_s / kTick_s));
  HAIRNET_ASSERT(training.motion_count > 0);
  HAIRNET_ASSERT(spacing > 0);
  WorldDef def;
  def.tick_s = kTick_s;
  def.parallel_for = parallel_for;
  World world(def);
  std::vector<TrainingMotion> motions;
  std::vector<std::array<CharacterId, 4>> characters;
  for (std::uint32_t n = 0; n < training.motion_count; ++n) {
    motions.push_back(make_training_motion(n, groom.body, kTick_s, tick_count + 1));
    Environment environment;
    environment.wind = WindField(motions[n].wind);
    world.set_environment(n, environment);
    // One character for each lattice level, in the order of LevelIndex, with the same motion, wind and material.
    for (CharacterId& character : characters.emplace_back()) {
      const auto level = static_cast<LevelIndex>(&character - characters[n].data());
      character = world.add({levels, level, motions[n].poses[0], n});
      world.set_material(character, motions[n].material);
    }
  }
  Snapshots snapshots;
  const auto column_count = static_cast<Eigen::Index>(training.motion_count * (tick_count / spacing));
  for (std::size_t i = 0; i < 4; ++i) {
    snapshots.levels[i].resize(static_cast<Eigen::Index>(3 * levels->levels[i].rest.size()), column_count);
  }
  for (std::size_t tick = 1; tick <= tick_count; ++tick) {
    if (!keep_going(static_cast<double>(tick) / static_cast<double>(tick_count))) return {};
    for (std::size_t n = 0; n < motions.size(); ++n)
      for (const CharacterId character : characters[n]) world.set_pose(character, motions[n].poses[tick]);
    world.step();
    if (tick % spacing != 0) continue;
    for (std::uint32_t n = 0; n < motions.size(); ++n) {
      const auto column = static_cast<Eigen::Index>(snapshots.motion.size());
      for (std::size_t i = 0; i < 4; ++i) {
        put_column(world.lattice(characters[n][i]).displacement, snapshots.levels[i].col(column));
      }
      snapshots.motion.push_back(n);
    }
  }
  HAIRNET_ASSERT(static_cast<Eigen::Index>(snapshots.motion.size()) == column_count);
  return snapshots;
}

}  // namespace hairnet
