#pragma once

#include <memory>
#include <optional>
#include <span>
#include <vector>

#include "core/ffd/deform.hpp"
#include "core/ffd/skin_push.hpp"
#include "core/ffd/strand_lengths.hpp"
#include "core/groom/groom.hpp"
#include "core/modes/moved_lattice.hpp"

namespace hairnet::draw {

// Places all points of a groom's hair on the processor, as the shaders do: FFD (paper 4), then out of the skin, then no
// strand longer than at rest. Engines that draw hair by themselves use it, and tests compare shaders with it. Make one
// for all characters of a groom whose lattices have the same geometry: it keeps no state of theirs, but memory to work
// in. One thread.
class HairPoints {
 public:
  // `geometry` is that of the lattices; null: they are at rest. `skin` is null where it is not known. It shares all
  // three.
  HairPoints(std::shared_ptr<const Groom> groom, std::shared_ptr<const LevelGeometry> geometry,
             std::shared_ptr<const Skin> skin);

  // Writes world space, m, in the groom's order: one entry for each of its points, which is asserted. Floats are a
  // millimetre coarse at 10 km from the origin. `tangents` may be empty; they are derivatives by the length at rest, so
  // they do not have unit length. Asserts that a lattice has this geometry. Scale is not applied: the caller scales by
  // itself.
  void place(const Pose& pose, const MovedLattice& lattice, std::span<Vec3f> points, std::span<Vec3f> tangents);

  [[nodiscard]] const Groom& groom() const { return *groom_; }
  [[nodiscard]] const LevelGeometry* geometry() const { return geometry_.get(); }
  [[nodiscard]] bool has_skin() const { return push_.has_value(); }

 private:
  std::shared_ptr<const Groom> groom_;
  std::shared_ptr<const LevelGeometry> geometry_;
  // The weight delta of eq. 7 at each point: 0 where hair stays with the skin, 1 where the lattice moves it.
  std::vector<float> blend_;
  RestTangents rest_tangents_;
  std::optional<Deformer> deformer_;
  std::optional<SkinPush> push_;
  StrandLengths lengths_;
  // Memory for the displacements of a lattice that comes as coefficients.
  std::vector<Vec3f> nodes_;
};

}  // namespace hairnet::draw
