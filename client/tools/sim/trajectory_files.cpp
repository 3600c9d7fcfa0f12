#include "client/tools/sim/trajectory_files.hpp"

#include <utility>

#include "core/solver/head_motion.hpp"

namespace hairnet::sim {
namespace {

// Writes a vector to a row, as its `entry`-th three numbers. Rows are floats, computed in double up to here.
void put(std::vector<float>& row, std::size_t entry, const Vec3& v) {
  for (int a = 0; a < 3; ++a) row[3 * entry + a] = static_cast<float>(v[a]);
}

}  // namespace

GridNodes::GridNodes(const LevelGeometry& geometry)
    : geometry_(geometry), grid_(geometry.lattice.node_count()), row_(3 * geometry.lattice.node_count()) {}

std::span<const float> GridNodes::positions(const RigidTransform& head, std::span<const Vec3f> displacement) {
  expand_displacements(geometry_, displacement, grid_);
  for (std::uint32_t n = 0; n < grid_.size(); ++n)
    // World = head (rest + displacement): the lattice's state is in head space.
    put(row_, n, head.point((geometry_.lattice.node(n) + grid_[n]).cast<double>()));
  return row_;
}

std::span<const float> GridNodes::velocities(const RigidTransform& from, const RigidTransform& to, double step_s,
                                             std::span<const Vec3f> velocity_head) {
  // A trimmed node's displacement combines those of other nodes, so its velocity combines theirs relative to the
  // rest's, R'p^0. Combining whole velocities would miss the turn of the head, as weights need not sum to 1.
  StepInput input;
  input.from.bones[0] = from;
  input.to.bones[0] = to;
  input.step_s = step_s;
  const HeadMotion motion(input);
  active_.assign(velocity_head.begin(), velocity_head.end());
  for (std::size_t i = 0; i < active_.size(); ++i) {
    const Vec3f rest = geometry_.lattice.node(geometry_.active_nodes[i]);
    active_[i] -= motion.rigid_velocity(rest.cast<double>()).cast<float>();
  }
  expand_displacements(geometry_, active_, grid_);
  for (std::uint32_t n = 0; n < grid_.size(); ++n)
    // The rest's velocity is added again, and the sum turned to the world.
    put(row_, n, to.vector(motion.rigid_velocity(geometry_.lattice.node(n).cast<double>()) + grid_[n].cast<double>()));
  return row_;
}

Result<TrajectoryFiles> TrajectoryFiles::create(const SimulateOptions& options, const Groom& groom, const Level& level,
                                                std::size_t row_count) {
  TrajectoryFiles files(level);
  const bool has_strands = is_exported_motion(options.out);
  const std::size_t node_count = level.geometry.lattice.node_count();
  const std::size_t point_count = groom.points.size();
  // A file of strands takes the name of --out, so the array of nodes is left out then.
  for (const Result<void>& opened : {files.open(files.positions_file_, has_strands ? "" : options.out, {node_count, 3}),
                                     files.open(files.velocities_file_, options.velocities, {node_count, 3}),
                                     files.open(files.points_file_, options.points, {point_count, 3}),
                                     files.open(files.poses_file_, options.poses, {kBoneCount, 7})}) {
    if (!opened) return Refusal(opened.error());
  }
  if (has_strands) {
    auto strands = StrandCache::create(options.out, groom, {options.rate_hz, row_count});
    if (!strands) return Refusal(strands.error());
    files.strands_file_ = std::move(*strands);
  }
  // Both files show the same points, which are computed once.
  if (files.points_file_ || files.strands_file_) files.points_.emplace(groom);
  files.row_.resize(3 * point_count);
  return files;
}

Result<void> TrajectoryFiles::open(std::optional<File>& file, const std::string& path,
                                   std::vector<std::size_t> row_shape) {
  if (path.empty()) return {};
  Result<NpyWriter> writer = NpyWriter::create(path, NpyType::float32, std::move(row_shape));
  if (!writer) return Refusal(path + ": " + writer.error());
  file = File{path, std::move(*writer)};
  return {};
}

void TrajectoryFiles::add_row(const Pose& step_from, const Pose& pose, double step_s, const LatticeState& state) {
  // Every array gets its row, so that rows of all files belong together.
  if (velocities_file_)
    velocities_file_->writer.append(nodes_.velocities(step_from.head(), pose.head(), step_s, state.velocity));
  if (positions_file_) positions_file_->writer.append(nodes_.positions(pose.head(), state.displacement));
  if (points_) add_points(pose.head(), state.displacement);
  if (poses_file_) add_pose(pose);
}

void TrajectoryFiles::add_points(const RigidTransform& head, std::span<const Vec3f> displacement) {
  const std::span<const Vec3f> points = points_->at(head, &geometry_, displacement);
  // An error is returned again by finish().
  if (strands_file_) static_cast<void>(strands_file_->add(points));
  if (!points_file_) return;
  for (std::size_t i = 0; i < points.size(); ++i) put(row_, i, points[i].cast<double>());
  points_file_->writer.append(row_);
}

void TrajectoryFiles::add_pose(const Pose& pose) {
  std::array<float, 7 * kBoneCount> row{};
  for (std::size_t b = 0; b < kBoneCount; ++b) {
    for (int a = 0; a < 3; ++a) row[7 * b + a] = static_cast<float>(pose.bones[b].position[a]);
    // Eigen's order of a quaternion is x y z w, as the README states.
    for (int a = 0; a < 4; ++a) row[7 * b + 3 + a] = static_cast<float>(pose.bones[b].rotation.coeffs()[a]);
  }
  poses_file_->writer.append(row);
}

Result<void> TrajectoryFiles::finish() {
  // The first file that fails is told; the others appear or not by themselves.
  for (auto* file : {&positions_file_, &velocities_file_, &points_file_, &poses_file_}) {
    if (!*file) continue;
    if (const Result<void> finished = (*file)->writer.finish(); !finished)
      return Refusal((*file)->path + ": " + finished.error());
  }
  return strands_file_ ? strands_file_->finish() : Result<void>();
}

}  // namespace hairnet::sim
