#pragma once

#include <memory>
#include <optional>
#include <span>
#include <string>
#include <utility>
#include <vector>

#include "client/assets/export/strand_writer.hpp"
#include "core/ffd/deform.hpp"
#include "core/ffd/strand_lengths.hpp"
#include "core/groom/groom.hpp"
#include "core/pose/pose.hpp"

namespace hairnet::sim {

// The points of a groom in the world, m, as lattices deform them: quadratic FFD (paper 4), no strand longer than at
// rest. Unlike viewers, it does not push hair out of the skin.
class WorldPoints {
 public:
  // The groom must outlive this.
  explicit WorldPoints(const Groom& groom) : groom_(groom), lengths_(groom) {}
  // Returns all points of the groom in its order, world, m, valid until the next call. `displacement` is in active
  // order, head space, m. Without a lattice the hair is as at rest.
  std::span<const Vec3f> at(const RigidTransform& head, const LevelGeometry* geometry,
                            std::span<const Vec3f> displacement);

 private:
  const Groom& groom_;
  StrandLengths lengths_;
  // These two belong together: the deformer is for this lattice.
  Lattice lattice_;
  std::optional<Deformer> deformer_;
  std::vector<Vec3f> grid_, points_;
};

// The strands of a moving groom, as a file for other programs (exported_motion_extensions): one frame a tick. The file
// appears in finish(), whole.
class StrandCache {
 public:
  // Prints what of the groom is not written on stderr. Errors name the file. The groom need not outlive the cache.
  static Result<std::unique_ptr<StrandCache>> create(const std::string& path, const Groom& groom,
                                                     const ExportedMotion& motion);
  // Adds a frame: the groom's points, at any moment in its order. After an error there is no file, and later calls
  // return the same error.
  Result<void> add(std::span<const Vec3f> points);
  Result<void> finish();

 private:
  // It is made in place, since the writer refers to its strands.
  StrandCache(std::string path, const Groom& groom) : path_(std::move(path)), strands_(exported_strands(groom)) {}

  std::string path_;
  ExportedStrands strands_;
  std::unique_ptr<StrandWriter> writer_;
  std::vector<Vec3f> points_;
  Result<void> added_;
};

}  // namespace hairnet::sim
