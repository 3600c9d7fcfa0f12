#pragma once

#include <memory>
#include <optional>
#include <vector>

#include "client/files/npy_writer.hpp"
#include "client/tools/sim/options.hpp"
#include "client/tools/sim/strand_cache.hpp"
#include "core/groom/groom.hpp"
#include "core/solver/step.hpp"

namespace hairnet::sim {

// Every grid node of a lattice in world space, trimmed nodes through their combinations. The geometry must outlive
// this.
class GridNodes {
 public:
  explicit GridNodes(const LevelGeometry& geometry);
  // Positions, m: 3 numbers a node, in index order, valid until the next call. `displacement` is in active order, head
  // space, m.
  std::span<const float> positions(const RigidTransform& head, std::span<const Vec3f> displacement);
  // Velocities, m/s, in the same form, world. `from` to `to` is the head's last step of `step_s`; equal when it does
  // not move. `velocity_head` is in active order and head axes.
  std::span<const float> velocities(const RigidTransform& from, const RigidTransform& to, double step_s,
                                    std::span<const Vec3f> velocity_head);

 private:
  const LevelGeometry& geometry_;
  std::vector<Vec3f> active_, grid_;
  std::vector<float> row_;
};

// The .npy files of one simulated clip, row by row, and the strands as a file of other programs, frame by frame; row 0
// is the state before the first step. A file appears in finish(), whole.
class TrajectoryFiles {
 public:
  // Opens the files that `options` names. `groom` and `level` must outlive this. Errors name the file.
  static Result<TrajectoryFiles> create(const SimulateOptions& options, const Groom& groom, const Level& level,
                                        std::size_t row_count);
  // Adds a row to each file. `step_from` is the pose at which the last (sub)step of `step_s` began; `pose` when there
  // was none. Errors show in finish().
  void add_row(const Pose& step_from, const Pose& pose, double step_s, const LatticeState& state);
  Result<void> finish();

 private:
  struct File {
    std::string path;
    NpyWriter writer;
  };
  explicit TrajectoryFiles(const Level& level) : geometry_(level.geometry), nodes_(level.geometry) {}
  Result<void> open(std::optional<File>& file, const std::string& path, std::vector<std::size_t> row_shape);
  void add_points(const RigidTransform& head, std::span<const Vec3f> displacement);
  void add_pose(const Pose& pose);

  const LevelGeometry& geometry_;
  GridNodes nodes_;
  std::optional<WorldPoints> points_;
  std::vector<float> row_;
  std::unique_ptr<StrandCache> strands_file_;
  std::optional<File> positions_file_, velocities_file_, points_file_, poses_file_;
};

}  // namespace hairnet::sim
