#pragma once

#include <functional>
#include <vector>

#include "client/assets/made/scalp.hpp"

namespace hairnet::made {

// A strand under construction: points a few millimetres apart, root first, head space, m.
using Path = std::vector<Vec3>;

// The tip of a strand while it grows.
struct GrowthPoint {
  Vec3 p;    // head space, m
  double s;  // arc length from the start, m
  // The normal of the skin under the tip; zero away from the skin.
  Vec3 normal;
  // How near the point is to the skin: 1 on the skin, at its clearance or below, and 0 from 12 mm above that.
  double nearness;
};

// The rules by which one strand grows. Directions need not be normalised. The functions are called at each step and
// must be pure.
struct Growth {
  Vec3 start = Vec3::Zero();
  // The strand leaves its start in this direction.
  Vec3 direction = Vec3::UnitY();
  double length_m = 0.3;
  // The strand turns to its preferred direction over this arc length: the hair's stiffness.
  double bend_m = 0.02;
  double step_m = 0.005;
  // The preferred direction at a point; not normalised, gravity included.
  std::function<Vec3(const GrowthPoint&)> preferred_direction;
  // The distance from the skin at that place.
  std::function<double(const Vec3& p, double s)> clearance;
  // The strand grows around the face instead of across it.
  bool spares_face = true;
  // Whether the strand ends here, before its length; may be empty.
  std::function<bool(const Vec3& p, double s)> done;
};

// Grows the strand step by step in its preferred direction, limited by the bending stiffness, along the skin and
// outside it. The path has at least its start. It may be shorter than `length_m` where the strand is caught in a
// hollow, and its last step may overshoot by the push out of the skin.
Path grow(const Growth& growth);

double arc_length(const Path& path);

// The point `s` metres along; beyond the end the last segment continues straight. It refers to the path, which must
// outlive it.
class ArcSampler {
 public:
  explicit ArcSampler(const Path& path);
  [[nodiscard]] Vec3 at(double s) const;
  [[nodiscard]] double length() const { return arc_.back(); }

 private:
  const Path& path_;
  std::vector<double> arc_;
};

// Winds a helix about the path. The path must be finer than the wavelength, or the helix is not seen.
struct Curl {
  // The full radius, reached at `onset_m`.
  double radius_m = 0;
  double wavelength_m = 0.1;
  // The radius grows from the root over this length.
  double onset_m = 0.1;
  double phase = 0;  // radians
  // The direction of the winding: +1 or -1.
  double hand = 1;
  // From 0, a helix, to 1, a wave in a plane.
  double flatness = 0;
};
Path curled(const Path& path, const Curl& curl);

}  // namespace hairnet::made
