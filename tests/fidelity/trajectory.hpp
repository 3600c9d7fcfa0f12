#pragma once

#include <cstddef>
#include <string>
#include <vector>

#include "core/groom/groom.hpp"
#include "core/levels/level.hpp"
#include "core/result.hpp"
#include "tests/support/corpus.hpp"

namespace hairnet::fidelity {

// Displacements of a level's nodes (head space, m, active order) after each tick of a clip's motion, the lead-in left
// out.
struct Trajectory {
  std::vector<std::vector<Vec3f>> displacement;
};

// Integrates from rest, with every step's system solved to convergence. Refused when a step fails or the clip contains
// a teleport.
Result<Trajectory> integrate(const Level& level, const Clip& clip);

// An even choice of a groom's points, at most `count_max`, as a lattice deforms them (quadratic FFD, root blend).
class StrandPoints {
 public:
  StrandPoints(const Groom& groom, std::size_t count_max);

  // Positions in head space at each tick in turn.
  [[nodiscard]] std::vector<Vec3f> deform(const Level& level, const Trajectory& trajectory) const;
  [[nodiscard]] std::size_t count() const { return rest_.size(); }
  [[nodiscard]] const std::vector<Vec3f>& rest() const { return rest_; }

 private:
  std::vector<Vec3f> rest_;
  std::vector<float> blend_;
};

// Distances of points from where they should be, over all points and ticks, m.
struct Distance {
  double rms = 0, p95 = 0;
};
Distance distance(const std::vector<Vec3f>& points, const std::vector<Vec3f>& truth);

// Measures how far points are from their rest: how much there is to see beyond the head's own motion.
double rms_motion(const std::vector<Vec3f>& points, const std::vector<Vec3f>& rest);

}  // namespace hairnet::fidelity
