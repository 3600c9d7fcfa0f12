#include <chrono>
#include <cstdio>
#include <memory>
#include <optional>
#include <thread>
#include <variant>
#include <vector>

#include "client/assets/made/made.hpp"
#include "client/link/link.hpp"
#include "client/link/playout.hpp"
#include "core/ffd/deform.hpp"

// A character that nods for ten seconds in the lobby of a server on this machine. Prints where the tip of its first
// strand is. The documentation of the public headers shows this file.
int main() {
  using namespace hairnet;
  link::Link connection{link::LinkOptions{}};
  if (const auto welcome = connection.connect(); !welcome) {
    std::fprintf(stderr, "%s\n", welcome.error().c_str());
    return 1;
  }
  const Groom groom = *make_hairstyle("bob");
  const Motion motion = *make_motion("nod");
  connection.add_character(1, connection.upload(groom), LevelIndex::high);

  link::Playout playout;
  std::shared_ptr<const LevelGeometry> geometry;  // of `deformer`
  std::optional<Deformer> deformer;
  std::vector<Vec3f> grid, points(groom.points.size());
  for (std::uint32_t picture = 1; picture <= 600; ++picture) {
    // Poses go to the server, frames come back.
    connection.push_poses({{.character = 1,
                            .sequence = picture,
                            .capture_time_ns = connection.now_ns(),
                            .pose = motion.sample(picture / 60.0)}});
    for (const link::Event& event : connection.poll()) {
      const auto* batch = std::get_if<link::FrameBatch>(&event);
      if (batch == nullptr) continue;
      for (const link::Frame& frame : batch->frames)
        if (frame.character == 1)
          playout.push(frame, connection.to_local_ns(batch->sample_time_ns), connection.now_ns());
    }

    // The lattice of this moment moves the points of the groom.
    const link::Playout::Sample sample = playout.sample(connection.now_ns());
    if (const auto shown = sample.geometry()) {
      if (shown != geometry) {
        geometry = shown;
        deformer.emplace(groom, geometry->lattice, FfdKind::quadratic);
        grid.resize(geometry->lattice.node_count());
      }
      expand_displacements(*geometry, sample.displacement, grid);
      deformer->deform(grid, points);
      const Vec3 tip = sample.pose.head().point(points[groom.strand_begin[1] - 1].cast<double>());
      std::printf("%.3f %.3f %.3f\n", tip.x(), tip.y(), tip.z());
    }
    std::this_thread::sleep_for(std::chrono::milliseconds(16));
  }
  connection.close();
}
