#include "client/assets/made/bust_shape.hpp"

#include <algorithm>
#include <cmath>

namespace hairnet::made {

const Vec3 kSkullCentre{0, 0.062, 0.005};

namespace {

// Distance to an ellipsoid, first order in |p / r| - 1: exact at the surface. The exact distance would need an
// iteration; this form costs two norms.
double ellipsoid(const Vec3& p, const Vec3& centre, const Vec3& radii) {
  const Vec3 q = (p - centre).cwiseQuotient(radii);
  const double k0 = q.norm(), k1 = q.cwiseQuotient(radii).norm();
  return k1 < 1e-9 ? -radii.minCoeff() : k0 * (k0 - 1) / k1;
}

// A capsule whose radius runs linearly from `ra` at `a` to `rb` at `b`.
double capsule(const Vec3& p, const Vec3& a, const Vec3& b, double ra, double rb) {
  const Vec3 ab = b - a;
  const double s = std::clamp((p - a).dot(ab) / ab.squaredNorm(), 0.0, 1.0);
  return (p - a - s * ab).norm() - (ra + (rb - ra) * s);
}

// Smooth union: the minimum, rounded where the two differ by less than `k`. The polynomial has a continuous slope, so
// that normals do not jump where two shapes meet.
double join(double a, double b, double k) {
  const double h = std::max(k - std::abs(a - b), 0.0) / k;
  return std::min(a, b) - h * h * k / 4;
}
// Takes `b` out of `a`: the outside of the one and the inside of the other are joined.
double carve(double a, double b, double k) {
  return -join(-a, b, k);
}

// The shapes below are those of the left half: bust_distance() mirrors points of the right half to x > 0. An ellipsoid
// has a centre and radii, a capsule two ends and their radii, in head space, m. The last argument of join() and carve()
// is the width of the rounding, m.
double cranium(const Vec3& p) {
  double d = ellipsoid(p, {0, 0.068, -0.004}, {0.0755, 0.082, 0.088});
  d = join(d, ellipsoid(p, {0, 0.078, 0.034}, {0.0635, 0.063, 0.066}), 0.03);     // forehead
  return join(d, ellipsoid(p, {0, 0.022, -0.035}, {0.058, 0.045, 0.046}), 0.04);  // back of the head
}

// The order matters: the socket is carved before the eye is put into it.
double face(const Vec3& p) {
  double d = ellipsoid(p, {0, 0.020, 0.040}, {0.0570, 0.070, 0.052});
  d = join(d, capsule(p, {0.047, -0.007, 0.018}, {0.013, -0.046, 0.071}, 0.013, 0.011), 0.03);  // jaw
  d = join(d, ellipsoid(p, {0, -0.046, 0.079}, {0.017, 0.014, 0.017}), 0.022);                  // chin
  d = join(d, ellipsoid(p, {0, -0.014, 0.069}, {0.029, 0.024, 0.023}), 0.028);                  // mouth's mound
  d = join(d, ellipsoid(p, {0.040, 0.020, 0.068}, {0.019, 0.016, 0.017}), 0.03);                // cheekbone
  d = join(d, capsule(p, {0.012, 0.062, 0.092}, {0.044, 0.064, 0.074}, 0.008, 0.007), 0.018);   // brow
  d = carve(d, ellipsoid(p, {0.031, 0.046, 0.104}, {0.017, 0.011, 0.015}), 0.014);              // eye socket
  d = join(d, ellipsoid(p, {0.031, 0.0445, 0.0825}, {0.0135, 0.0105, 0.0115}), 0.006);          // eye and lids
  d = join(d, capsule(p, {0, 0.054, 0.097}, {0, 0.013, 0.1125}, 0.0055, 0.0080), 0.016);        // nose
  d = join(d, ellipsoid(p, {0.0085, 0.007, 0.106}, {0.0075, 0.006, 0.008}), 0.008);             // nostrils
  d = join(d, ellipsoid(p, {0, -0.0160, 0.0935}, {0.0200, 0.0052, 0.0085}), 0.006);             // upper lip
  return join(d, ellipsoid(p, {0, -0.0262, 0.0915}, {0.0165, 0.0056, 0.0085}), 0.0045);         // lower lip
}

double ear(const Vec3& p) {
  // Turned out and leaning back: its own axes are a shear of the head's.
  const Vec3 q(p.x() + 0.35 * (p.z() + 0.004), p.y(), p.z() + 0.22 * (p.y() - 0.03));
  double d = ellipsoid(q, {0.0750, 0.031, -0.004}, {0.0110, 0.031, 0.0180});
  return carve(d, ellipsoid(q, {0.0880, 0.035, -0.001}, {0.0070, 0.016, 0.0090}), 0.010);
}

double neck(const Vec3& p) {
  const double d = capsule(p, {0, 0.0, -0.010}, {0, -0.175, -0.034}, 0.047, 0.050);
  return join(d, capsule(p, {0.050, -0.015, -0.012}, {0.016, -0.170, 0.016}, 0.008, 0.009), 0.03);  // side muscle
}

double torso(const Vec3& head_sided) {
  // The halves of the trunk are rounded over 17 mm where they meet, since the square root of 3e-4 is 0.017; those of
  // the face only over 3 mm, see bust_distance().
  const Vec3 p(std::sqrt(head_sided.x() * head_sided.x() + 3e-4), head_sided.y(), head_sided.z());
  double d = ellipsoid(p, {0, -0.290, -0.030}, {0.150, 0.125, 0.092});
  d = join(d, capsule(p, {0.030, -0.118, -0.048}, {0.138, -0.198, -0.042}, 0.028, 0.034), 0.06);   // trapezius
  d = join(d, capsule(p, {0.152, -0.218, -0.035}, {0.166, -0.345, -0.035}, 0.048, 0.042), 0.045);  // upper arm
  d = join(d, ellipsoid(p, {0.068, -0.222, -0.075}, {0.070, 0.065, 0.045}), 0.05);                 // shoulder blade
  d = join(d, ellipsoid(p, {0.070, -0.315, 0.038}, {0.062, 0.058, 0.044}), 0.07);                  // breast
  d = join(d, capsule(p, {0.018, -0.190, 0.026}, {0.135, -0.180, -0.018}, 0.009, 0.010), 0.045);   // collar bone
  return d;
}

}  // namespace

double bust_distance(const Vec3& point) {
  // Points of both halves are mapped to x > 0. The addend, the square of 3 mm, rounds the place where the halves meet,
  // so that they do not meet in a crease.
  const Vec3 p(std::sqrt(point.x() * point.x() + 9e-6), point.y(), point.z());
  // Farther than this from the border, m, only the head or only the trunk is evaluated. The distance is more than the
  // widest rounding, so leaving the other part out changes nothing near the skin. The two borders overlap at the neck.
  constexpr double kFar = 0.12;
  const double above = p.y() + 0.115, below = -0.06 - p.y();
  double d = neck(p);
  if (above > -kFar) {
    double head = join(cranium(p), face(p), 0.025);
    head = join(head, ear(p), 0.008);
    d = join(d, head, 0.022);
  }
  if (below > -kFar) {
    d = join(d, torso(p), 0.055);
  }
  // The bust is cut off in a bow: under the chest in the middle, through the armpits at the sides. The slope of the bow
  // is 4.6 x, whose square is about 21 x^2; dividing by the length of its normal keeps the value a distance.
  const double bow = -0.360 + 2.3 * p.x() * p.x();
  return carve(d, (p.y() - bow) / std::sqrt(1 + 21 * p.x() * p.x()), 0.02);
}

Vec3 bust_normal(const Vec3& p) {
  // Four samples on a tetrahedron. They cost a third less than central differences along three axes.
  constexpr double h = 5e-4;
  Vec3 sum = Vec3::Zero();
  for (const Vec3& e : {Vec3(1, -1, -1), Vec3(-1, -1, 1), Vec3(-1, 1, -1), Vec3(1, 1, 1)}) {
    sum += e * bust_distance(p + h * e);
  }
  const double norm = sum.norm();
  return norm > 1e-12 ? Vec3(sum / norm) : Vec3(Vec3::UnitY());
}

Vec3 push_out(Vec3 p, double clearance_m) {
  // The field is not an exact distance, so one step may fall short, and several are made. The small addend, 0.05 mm,
  // makes the last step end beyond the limit instead of before it.
  for (int i = 0; i < 12; ++i) {
    const double d = bust_distance(p);
    if (d >= clearance_m) {
      break;
    }
    p += (clearance_m - d + 5e-5) * bust_normal(p);
  }
  return p;
}

Vec3 onto_skin(Vec3 p) {
  for (int i = 0; i < 8; ++i) {
    const double d = bust_distance(p);
    if (std::abs(d) < 1e-6) {
      break;
    }
    // Steps of 0.9 cannot overshoot, where the field overestimates by up to a tenth.
    p -= 0.9 * d * bust_normal(p);
  }
  return p;
}

Vec3 skin_along(const Vec3& direction) {
  // The start lies outside of the skull. Shorter steps than the distance keep the search from passing through thin
  // parts such as an ear.
  double s = 0.16;
  for (int i = 0; i < 60; ++i) {
    const double d = bust_distance(kSkullCentre + s * direction);
    if (std::abs(d) < 1e-6) {
      break;
    }
    s -= 0.8 * d;
  }
  return kSkullCentre + s * direction;
}

}  // namespace hairnet::made
