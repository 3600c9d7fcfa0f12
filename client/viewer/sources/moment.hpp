#pragma once

#include <memory>
#include <span>
#include <utility>
#include <vector>

#include "client/link/playout.hpp"
#include "core/ffd/moved_lattice.hpp"
#include "core/levels/level.hpp"
#include "core/pose/pose.hpp"
#include "core/skin/skin_distance_field.hpp"

namespace hairnet::viewer {

// The state of one character at one moment, copied so that drawing can wait until the stream has ended.
struct Moment {
  Pose pose;
  std::vector<Vec3f> displacement;                // active order, head space, m; empty: at rest
  std::shared_ptr<const LevelGeometry> geometry;  // of the displacement
  std::shared_ptr<const Skin> skin;               // to keep the hair out of; null: not known

  Moment(const Pose& p, std::span<const Vec3f> d, std::shared_ptr<const LevelGeometry> g,
         std::shared_ptr<const Skin> s = nullptr)
      : pose(p), displacement(d.begin(), d.end()), geometry(std::move(g)), skin(std::move(s)) {}
  explicit Moment(const link::Playout::Sample& sample) : Moment(sample.pose, sample.displacement, sample.geometry()) {}
};

// The lattice of a character's hair with all nodes of the grid, for render.
class ShownLattice {
 public:
  // Asserts that the displacement fits the geometry; null: at rest.
  void show(std::span<const Vec3f> displacement, const std::shared_ptr<const LevelGeometry>& geometry);
  // Valid until the next call, or until this object is moved.
  [[nodiscard]] MovedLattice moved() const { return {geometry_.get(), grid_}; }

 private:
  std::shared_ptr<const LevelGeometry> geometry_;
  std::vector<Vec3f> grid_;
};

}  // namespace hairnet::viewer
