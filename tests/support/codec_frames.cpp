#include "tests/support/codec_frames.hpp"

#include <numeric>

#include "client/assets/made/made.hpp"
#include "core/levels/build.hpp"
#include "core/world/world.hpp"

namespace hairnet::codec {

LevelGeometry RandomFrames::geometry() {
  LevelGeometry out =
      full_grid({2 + static_cast<int>(below(5)), 2 + static_cast<int>(below(5)), 2 + static_cast<int>(below(5))});
  const std::size_t keep = 1 + below(8);
  std::erase_if(out.active_nodes, [&](std::uint32_t) { return below(8) >= keep; });
  if (out.active_nodes.empty()) out.active_nodes.push_back(0);
  return out;
}

LevelGeometry RandomFrames::full_grid(const std::array<int, 3>& dims) {
  LevelGeometry out;
  out.lattice.dims = dims;
  out.active_nodes.resize(out.lattice.node_count());
  std::iota(out.active_nodes.begin(), out.active_nodes.end(), 0u);
  return out;
}

FrameIntegers RandomFrames::frame(std::size_t node_count, int bits, bool velocities) {
  FrameIntegers out;
  for (std::int32_t& bone : out.bones) bone = static_cast<std::int32_t>(random_.next()) >> below(32);
  const auto fill = [&](std::vector<std::int16_t>& integers) {
    integers.resize(3 * node_count);
    for (std::int16_t& i : integers)
      i = static_cast<std::int16_t>(static_cast<std::int16_t>(random_.next()) >> (16 - bits));
  };
  fill(out.nodes);
  if (velocities) fill(out.velocities);
  return out;
}

namespace {

// Built once a level: it takes seconds.
std::shared_ptr<const LevelSet> made_level(LevelIndex index) {
  static std::array<std::shared_ptr<const LevelSet>, 4> built;
  std::shared_ptr<const LevelSet>& made = built[static_cast<std::size_t>(index)];
  if (made) return made;
  const Groom groom = make_hairstyle("long_straight", {.strand_count = 200}).value();
  auto levels = std::make_shared<LevelSet>();
  levels->levels[static_cast<std::size_t>(index)] = *build_level(groom, kLevelSpecs[static_cast<std::size_t>(index)]);
  return made = levels;
}

}  // namespace

MovingLattice step_made_lattice(LevelIndex index, double rate_hz, std::size_t tick_count) {
  const Motion motion = make_motion("dance").value();
  const std::shared_ptr<const LevelSet> levels = made_level(index);
  MovingLattice out;
  out.geometry = (*levels)[index].geometry;
  WorldDef def;
  def.tick_s = 1 / rate_hz;
  World world(def);
  const CharacterId id = world.add({levels, index, motion.sample(0)});
  const auto lead_in = static_cast<std::size_t>(rate_hz);
  for (std::size_t tick = 1; tick <= lead_in + tick_count; ++tick) {
    world.set_pose(id, motion.sample(static_cast<double>(tick) * def.tick_s));
    world.step();
    if (tick <= lead_in) continue;
    const LatticeView lattice = world.lattice(id);
    out.poses.push_back(*lattice.pose);
    out.displacements.emplace_back(lattice.displacement.begin(), lattice.displacement.end());
    out.velocities.push_back(world.state(id).velocity);
  }
  return out;
}

std::vector<FrameIntegers> quantised(const MovingLattice& moving, ErrorClass error_class, bool velocities) {
  std::vector<FrameIntegers> out;
  for (std::size_t t = 0; t < moving.poses.size(); ++t) {
    FrameIntegers frame;
    quantise_pose(moving.poses[t], out.empty() ? nullptr : &out.back(), frame);
    quantise_nodes(moving.displacements[t], error_class, frame.nodes);
    if (velocities) quantise_velocities(moving.velocities[t], error_class, frame.velocities);
    out.push_back(std::move(frame));
  }
  return out;
}

}  // namespace hairnet::codec
