#include "client/tools/sim/strand_cache.hpp"

#include "client/assets/print_warnings.hpp"

namespace hairnet::sim {
namespace {

bool are_equal(const Lattice& a, const Lattice& b) {
  return a.origin == b.origin && a.spacing == b.spacing && a.dims == b.dims;
}

}  // namespace

std::span<const Vec3f> WorldPoints::at(const RigidTransform& head, const LevelGeometry* geometry,
                                       std::span<const Vec3f> displacement) {
  points_ = groom_.points;
  if (geometry != nullptr) {
    // A replayed character changes its level, and with it the lattice. Making a deformer takes long, so it is kept
    // while the lattice is the same.
    if (!deformer_ || !are_equal(lattice_, geometry->lattice)) {
      lattice_ = geometry->lattice;
      deformer_.emplace(groom_, lattice_, FfdKind::quadratic);
    }
    grid_.resize(lattice_.node_count());
    expand_displacements(*geometry, displacement, grid_);
    deformer_->deform(grid_, points_);
    // No strand is longer than at rest, as viewers draw it. Without a lattice the points do not move.
    lengths_.limit(points_);
  }
  // Doubles until the last moment, for heads far from the origin.
  for (Vec3f& x : points_) x = head.point(x.cast<double>()).cast<float>();
  return points_;
}

Result<std::unique_ptr<StrandCache>> StrandCache::create(const std::string& path, const Groom& groom,
                                                         const ExportedMotion& motion) {
  std::unique_ptr<StrandCache> cache(new StrandCache(path, groom));
  if (std::string line = left_behind(groom, cache->strands_); !line.empty())
    print_warnings(path, std::vector{std::move(line)});
  auto writer = open_strand_file(path, cache->strands_, motion);
  if (!writer) return Refusal(path + ": " + writer.error());
  cache->writer_ = std::move(*writer);
  return cache;
}

Result<void> StrandCache::add(std::span<const Vec3f> points) {
  // An error stays: later frames would leave a gap.
  if (!added_) return added_;
  strands_.take_points(points, points_);
  if (const Result<void> added = writer_->add(points_); !added) added_ = Refusal(path_ + ": " + added.error());
  return added_;
}

Result<void> StrandCache::finish() {
  if (!added_) return added_;
  if (const Result<void> finished = writer_->finish(); !finished) return Refusal(path_ + ": " + finished.error());
  return {};
}

}  // namespace hairnet::sim
