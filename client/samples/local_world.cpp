// Simulates hair in this program, without a server: a head that shakes for three seconds. Prints how far the tip of its
// first strand swings from where it hangs at rest.
#include <cstdio>

#include "client/assets/made/made.hpp"
#include "client/draw/hair_points.hpp"
#include "core/levels/build.hpp"
#include "core/world/world.hpp"

using namespace hairnet;

int main() {
  const auto groom = std::make_shared<const Groom>(*make_hairstyle("bob", {.strand_count = 600}));
  std::fprintf(stderr, "building the levels of the hair\n");
  // This takes seconds, so a program that starts often stores the levels by wire::encode_levels().
  const std::shared_ptr<const LevelSet> levels = build_levels(*groom);
  const std::shared_ptr<const Level> high(levels, &(*levels)[LevelIndex::high]);
  draw::HairPoints hair(groom, {high, &high->geometry}, high->skin);
  const Motion motion = *make_motion("shake");

  World world({.tick_s = 1.0 / 60});
  const CharacterId id = world.add({levels, LevelIndex::high, motion.sample(0)});
  std::vector<Vec3f> grid(high->geometry.lattice.node_count()), points(groom->points.size()), rest(points.size());
  const std::size_t tip = groom->strand_begin[1] - 1;
  for (int tick = 1; tick <= 180; ++tick) {
    const Pose pose = motion.sample(tick / 60.0);
    world.set_pose(id, pose);
    world.step();
    // The World moves active nodes alone; strands are deformed by all nodes of the grid.
    expand_displacements(high->geometry, world.lattice(id).displacement, grid);
    hair.place(pose, {&high->geometry, grid}, points, {});
    // Without a lattice hair follows the head rigidly.
    hair.place(pose, {}, rest, {});
    std::printf("%.3f s: %.1f mm\n", tick / 60.0, 1e3 * static_cast<double>((points[tip] - rest[tip]).norm()));
  }
}
