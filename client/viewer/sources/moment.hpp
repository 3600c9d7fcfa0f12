#pragma once

#include <memory>
#include <vector>

#include "client/link/playout.hpp"
#include "core/modes/moved_lattice.hpp"
#include "core/pose/pose.hpp"
#include "core/skin/skin_distance_field.hpp"

namespace hairnet::viewer {

// The state of one character at one moment, copied so that drawing can wait until the stream has ended: in real time,
// drawing would delay the poses.
class Moment {
 public:
  // `geometry` is that of the lattice. It is shared, so that it stays while it is needed.
  Moment(const Pose& shown, const MovedLattice& lattice, std::shared_ptr<const LevelGeometry> geometry);
  explicit Moment(const link::Playout::Sample& sample);

  Pose pose;
  // The skin out of which the hair is pushed when it is drawn; null: it is not known.
  std::shared_ptr<const Skin> skin;

  // Valid while this object stays where it is: the spans point into it.
  [[nodiscard]] MovedLattice lattice() const { return {geometry_.get(), grid_, basis_, coefficients_}; }

 private:
  std::shared_ptr<const LevelGeometry> geometry_;
  // The displacements of all grid nodes, empty where the lattice comes as coefficients of `basis_`.
  std::vector<Vec3f> grid_;
  std::shared_ptr<const Basis> basis_;
  std::vector<float> coefficients_;
};

}  // namespace hairnet::viewer
