#pragma once

#include <memory>
#include <span>

#include "core/build/level.hpp"
#include "core/parallel_for.hpp"

namespace hairnet {

// Carries a lattice over from one level to another (model section 8): the new nodes' displacements for which quadratic
// FFD moves hair points as the old level does, by least squares; velocities alike. Where hair says nothing about a node
// it follows the old lattice where it lies, sampled linearly. Between levels of one lattice nothing changes at all.
// Immutable, shared by all threads.
class LevelMap {
 public:
  // `points_head` are hair points at rest, `blend` the delta of each (root_blend): what hardly moves counts little.
  LevelMap(const Level& from, const Level& to, std::span<const Vec3f> points_head, std::span<const float> blend);
  ~LevelMap();

  // The same maps in less time: what each level gives to all maps from and to it is found once.
  friend void connect_levels(LevelSet& set, std::span<const Vec3f> points_head, std::span<const float> blend,
                             const ParallelFor& parallel_for);

  // An entry an active node, head space. Costs about as much as two iterations of a step.
  void apply(std::span<const Vec3f> from, std::span<Vec3f> to) const;

 private:
  struct LeastSquares;
  struct End;
  LevelMap(const End& from, const End& to);

  std::unique_ptr<const LeastSquares> least_squares_;  // null when both have the same nodes
};

// Makes the maps between all levels of a set.
void connect_levels(LevelSet& set, std::span<const Vec3f> points_head, std::span<const float> blend,
                    const ParallelFor& parallel_for = {});

}  // namespace hairnet
