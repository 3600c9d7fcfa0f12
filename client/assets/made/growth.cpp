#include "client/assets/made/growth.hpp"

#include <algorithm>
#include <cmath>
#include <numbers>

#include "client/assets/made/bust_shape.hpp"
#include "client/assets/made/easing.hpp"

namespace hairnet::made {
namespace {

// The space in front of the face that framing hair must not enter: a tall ellipsoid, open to the front, with its centre
// and radii in head space, m. Its distance is that of an ellipsoid to first order, as in bust_shape.
const Vec3 kFaceCentre{0, 0.010, 0.125};
const Vec3 kFaceRadii{0.060, 0.100, 0.095};

// The distance to that ellipsoid, m, negative within it.
double face_distance(const Vec3& p) {
  const Vec3 q = (p - kFaceCentre).cwiseQuotient(kFaceRadii);
  const double k0 = q.norm(), k1 = q.cwiseQuotient(kFaceRadii).norm();
  return k1 < 1e-9 ? -kFaceRadii.minCoeff() : k0 * (k0 - 1) / k1;
}

// The direction out of that space: sideways and never forward, so that nothing hangs before the eyes.
Vec3 face_normal(const Vec3& p) {
  Vec3 n = (p - kFaceCentre).cwiseQuotient(kFaceRadii.cwiseProduct(kFaceRadii));
  n.z() = std::min(n.z(), 0.0);
  const double norm = n.norm();
  return norm > 1e-9 ? Vec3(n / norm) : Vec3(Vec3::UnitX());
}

// `v` without `share` of its component into the skin.
Vec3 without_inward(const Vec3& v, const Vec3& normal, double share) {
  return v - share * std::min(0.0, v.dot(normal)) * normal;
}

// Whether the last steps made no progress, as in the hollow of an armpit; if so, removes them. A path that goes to and
// fro still takes steps, so only the distance from eight steps before shows it.
bool going_round(Path& path, double step_m) {
  constexpr std::size_t kSteps = 8;
  // Eight straight steps lead 8 `step_m` away; less than four tenths of that is no progress.
  if (path.size() <= kSteps || (path.back() - path[path.size() - 1 - kSteps]).norm() > 0.4 * kSteps * step_m) {
    return false;
  }
  path.resize(path.size() - kSteps);
  return true;
}

}  // namespace

// One step after the other: choose the direction, bend towards it, avoid the face, and leave the skin. The order
// matters, since only the last may move a point out of the skin.
Path grow(const Growth& growth) {
  // Within this distance above its clearance, m, a strand is near the skin (GrowthPoint::nearness).
  constexpr double kMargin = 0.012;
  Path path{growth.start};
  Vec3 p = growth.start, direction = growth.direction.normalized();
  // The share of a turn in one step: after `bend_m` the strand has turned by 63 % of the way.
  const double turn = 1 - std::exp(-growth.step_m / growth.bend_m);
  double s = 0;
  while (s < growth.length_m) {
    // The small addend lets the last step reach the length in spite of rounding.
    const double step = std::min(growth.step_m, growth.length_m - s + 1e-6);
    const double clearance = growth.clearance(p, s);
    const double gap = bust_distance(p) - clearance;
    const double nearness = 1 - smootherstep(0, kMargin, gap);
    const bool near = nearness > 0;
    const Vec3 normal = near ? bust_normal(p) : Vec3(Vec3::Zero());
    // What leads into the skin is taken out of the preferred direction before bending, and out of the direction after
    // it; otherwise stiff hair would dive in.
    const Vec3 preferred = without_inward(growth.preferred_direction({p, s, normal, nearness}), normal, nearness);
    direction += turn * (preferred.normalized() - direction);
    if (near) {
      direction = without_inward(direction, normal, 1 - smootherstep(0, 0.3 * kMargin, gap));
    }
    direction.normalize();
    Vec3 next = p + step * direction;
    if (growth.spares_face) {
      // The first 5 cm rise over the face's space gradually, so roots at the forehead are not thrown aside.
      const double into = -face_distance(next) * smootherstep(0.0, 0.05, s);
      if (into > 0) {
        // A part of a step at a time leads the strand round the face in a curve.
        next += std::min(into, 0.6 * step) * face_normal(next);
      }
    }
    // Away from the skin, a single evaluation of the field decides.
    if (near || bust_distance(next) < clearance) {
      next = push_out(next, growth.clearance(next, s + step));
    }
    // The length counts as moved and not as intended, so pushes out of the skin neither lengthen nor shorten the
    // strand.
    const double moved = (next - p).norm();
    // A strand that moves less than a tenth of its step is caught in a hollow, and ends here.
    if (moved < 0.1 * step) {
      break;
    }
    s += moved;
    p = next;
    path.push_back(p);
    if (going_round(path, step)) {
      break;
    }
    if (growth.done && growth.done(p, s)) {
      break;
    }
  }
  return path;
}

double arc_length(const Path& path) {
  double length = 0;
  for (std::size_t i = 1; i < path.size(); ++i) {
    length += (path[i] - path[i - 1]).norm();
  }
  return length;
}

ArcSampler::ArcSampler(const Path& path) : path_(path), arc_{0} {
  for (std::size_t i = 1; i < path.size(); ++i) {
    arc_.push_back(arc_.back() + (path[i] - path[i - 1]).norm());
  }
}

// The segment is found by a binary search. Its index is clamped, so places outside continue the first or the last
// segment.
Vec3 ArcSampler::at(double s) const {
  if (path_.size() < 2) {
    return path_.front();
  }
  const auto above = std::upper_bound(arc_.begin(), arc_.end(), s);
  const auto i = std::clamp<std::ptrdiff_t>(above - arc_.begin(), 1, static_cast<std::ptrdiff_t>(arc_.size()) - 1);
  const double span = arc_[i] - arc_[i - 1];
  return span > 0 ? Vec3(path_[i - 1] + (s - arc_[i - 1]) / span * (path_[i] - path_[i - 1])) : path_[i];
}

// The frame is carried along the path without twist, which keeps loops of a curl alike in bends.
Path curled(const Path& path, const Curl& curl) {
  if (curl.radius_m <= 0 || path.size() < 3) {
    return path;
  }
  Path out{path.front()};
  Vec3 along = (path[1] - path[0]).normalized();
  // All strands use the same reference, so that neighbours with one phase curl together.
  Vec3 side = (std::abs(along.x()) < 0.9 ? Vec3::UnitX() : Vec3::UnitZ()).cross(along).normalized();
  double s = 0;
  for (std::size_t i = 1; i < path.size(); ++i) {
    const Vec3 next = i + 1 < path.size() ? path[i + 1] : path[i];
    along = (next - path[i - 1]).normalized();
    side = (side - side.dot(along) * along).normalized();  // carried along without twist
    s += (path[i] - path[i - 1]).norm();
    const double angle = curl.phase + curl.hand * 2 * std::numbers::pi * s / curl.wavelength_m;
    // The radius begins a little above 0 at the root, so that curls show early without leaving the root's place.
    const double radius = curl.radius_m * smootherstep(-0.2 * curl.onset_m, curl.onset_m, s);
    out.push_back(path[i] +
                  radius * (std::cos(angle) * side + (1 - curl.flatness) * std::sin(angle) * along.cross(side)));
  }
  return out;
}

}  // namespace hairnet::made
