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
  // Stands on the skin under the tip; is zero away from the skin.
  Vec3 normal;
  // Is 1 on the skin, at its clearance or below, and 0 from 12 mm above that.
  double nearness;
};

// The rules by which one strand grows.
struct Growth {
  Vec3 start = Vec3::Zero();
  Vec3 direction = Vec3::UnitY();  // at the start
  double length_m = 0.3;
  double bend_m = 0.02;  // arc length over which it turns to its preferred direction: the hair's stiffness
  double step_m = 0.005;
  // The preferred direction at a point; not normalised, gravity included.
  std::function<Vec3(const GrowthPoint&)> preferred_direction;
  // The distance from the skin at that place.
  std::function<double(const Vec3& p, double s)> clearance;
  bool spares_face = true;                            // grows around the face instead of across it
  std::function<bool(const Vec3& p, double s)> done;  // ends the strand early; may be empty
};

// Grows the strand step by step in its preferred direction, limited by the bending stiffness, along the skin and
// outside it.
Path grow(const Growth& growth);

double arc_length(const Path& path);

// The point `s` metres along; beyond the end the last segment continues straight.
class ArcSampler {
 public:
  explicit ArcSampler(const Path& path);
  [[nodiscard]] Vec3 at(double s) const;
  [[nodiscard]] double length() const { return arc_.back(); }

 private:
  const Path& path_;
  std::vector<double> arc_;
};

// Winds a helix about the path.
struct Curl {
  double radius_m = 0;  // reached at `onset_m`
  double wavelength_m = 0.1;
  double onset_m = 0.1;  // the radius grows from the root over this length
  double phase = 0;      // radians
  double hand = 1;       // +1 or -1
  double flatness = 0;   // 0 helix … 1 wave in a plane
};
Path curled(const Path& path, const Curl& curl);

}  // namespace hairnet::made
