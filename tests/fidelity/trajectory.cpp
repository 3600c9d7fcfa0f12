#include "tests/fidelity/trajectory.hpp"

#include <algorithm>
#include <cmath>
#include <utility>

#include "core/ffd/deform.hpp"
#include "tests/fidelity/direct_step.hpp"

namespace hairnet::fidelity {

Result<Trajectory> integrate(const Level& level, const Clip& clip) {
  const double tick_s = 1 / clip.rate_hz;
  DirectStep solver(level);
  LatticeState rest;
  reset_to_rest(level, rest);
  WorldLattice lattice = to_world(level, clip.poses.front().head(), rest);
  Trajectory trajectory;
  for (std::size_t tick = 1; tick < clip.poses.size(); ++tick) {
    const std::string where = clip.name + ", tick " + std::to_string(tick) + ": ";
    StepInput input;
    input.from = clip.poses[tick - 1];
    input.to = clip.poses[tick];
    input.step_s = tick_s;
    // A teleport is a jump of the head that its own velocity does not explain. It resets hair, so a clip with one would
    // not measure the solver.
    const Vec3 before = tick > 1 ? head_velocity(clip.poses[tick - 2], input.from, tick_s) : Vec3::Zero();
    if (is_teleport(input.from, input.to, tick_s, before)) return Refusal(where + "a teleport");
    if (!solver.step(input, lattice)) return Refusal(where + "the step has no finite solution");
    if (tick > clip.lead_in_ticks) {
      trajectory.displacement.push_back(to_head(level, input.to.head(), lattice).displacement);
    }
  }
  return trajectory;
}

StrandPoints::StrandPoints(const Groom& groom, std::size_t count_max) {
  const std::vector<float> blend = root_blend(groom);
  const std::size_t count = std::min(count_max, groom.points.size());
  const double part = static_cast<double>(groom.points.size()) / static_cast<double>(std::max<std::size_t>(count, 1));
  for (std::size_t i = 0; i < count; ++i) {
    // Chooses one point in each of `count` equal parts, at a place in the part that differs by the golden ratio.
    // Strands often have equally many points, and equal steps would always meet the same ones.
    const double golden = 0.6180339887498949 * static_cast<double>(i);
    const double place = (static_cast<double>(i) + golden - std::floor(golden)) * part;
    const std::size_t point = std::min(static_cast<std::size_t>(place), groom.points.size() - 1);
    rest_.push_back(groom.points[point]);
    blend_.push_back(blend[point]);
  }
}

std::vector<Vec3f> StrandPoints::deform(const Level& level, const Trajectory& trajectory) const {
  const Deformer deformer(level.geometry.lattice, rest_, blend_, FfdKind::quadratic);
  std::vector<Vec3f> grid(level.geometry.lattice.node_count());
  std::vector<Vec3f> points(trajectory.displacement.size() * rest_.size());
  for (std::size_t t = 0; t < trajectory.displacement.size(); ++t) {
    expand_displacements(level.geometry, trajectory.displacement[t], grid);
    deformer.deform(grid, std::span(points).subspan(t * rest_.size(), rest_.size()));
  }
  return points;
}

Distance distance(const std::vector<Vec3f>& points, const std::vector<Vec3f>& truth) {
  std::vector<double> squares(points.size());
  double sum = 0;
  for (std::size_t i = 0; i < points.size(); ++i) {
    squares[i] = (points[i] - truth[i]).cast<double>().squaredNorm();
    sum += squares[i];
  }
  if (squares.empty()) return {};
  // The distance that 95 % of the points do not exceed.
  const auto p95 = squares.begin() + static_cast<std::ptrdiff_t>(0.95 * static_cast<double>(squares.size() - 1));
  std::ranges::nth_element(squares, p95);
  return {std::sqrt(sum / static_cast<double>(points.size())), std::sqrt(*p95)};
}

double rms_motion(const std::vector<Vec3f>& points, const std::vector<Vec3f>& rest) {
  double sum = 0;
  for (std::size_t i = 0; i < points.size(); ++i) {
    sum += (points[i] - rest[i % rest.size()]).cast<double>().squaredNorm();
  }
  return points.empty() ? 0 : std::sqrt(sum / static_cast<double>(points.size()));
}

}  // namespace hairnet::fidelity
