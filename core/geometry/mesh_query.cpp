#include "core/geometry/mesh_query.hpp"

#include <algorithm>
#include <cmath>
#include <numbers>

#include "core/assert.hpp"

namespace hairnet {
namespace {

// A box with at most so many triangles is not divided further.
constexpr std::uint32_t kLeafTriangles = 4;
// A cluster farther than this many of its radii counts as one dipole. A larger number is more exact and looks at more
// triangles; mesh_query.hpp states the error.
constexpr double kDipoleDistance = 2.5;

// Squared distance from a point to a box, 0 inside.
double box_distance2(const Vec3& low, const Vec3& high, const Vec3& p) {
  return (low - p).cwiseMax(p - high).cwiseMax(0).squaredNorm();
}

// Barycentric coordinates, the first for a and the second for b, of the point of segment a-b nearest to p. For a
// segment without length the result is a.
std::pair<double, double> closest_on_segment(const Vec3& a, const Vec3& b, const Vec3& p) {
  const Vec3 ab = b - a;
  const double length2 = ab.squaredNorm();
  const double t = length2 > 0 ? std::clamp((p - a).dot(ab) / length2, 0.0, 1.0) : 0.0;
  return {1 - t, t};
}

// Barycentric coordinates of the point of the triangle nearest to p: the foot of the perpendicular if it lies inside,
// else the nearest point of the three edges.
Vec3 closest_on_triangle(const Vec3& a, const Vec3& b, const Vec3& c, const Vec3& p) {
  const Vec3 normal = (b - a).cross(c - a);
  const double area2 = normal.squaredNorm();
  if (area2 > 0) {
    const double u = (c - b).cross(p - b).dot(normal) / area2;
    const double v = (a - c).cross(p - c).dot(normal) / area2;
    const double w = 1 - u - v;
    if (u >= 0 && v >= 0 && w >= 0) return {u, v, w};
  }
  const auto [ab_a, ab_b] = closest_on_segment(a, b, p);
  const auto [bc_b, bc_c] = closest_on_segment(b, c, p);
  const auto [ca_c, ca_a] = closest_on_segment(c, a, p);
  const Vec3 candidates[3] = {{ab_a, ab_b, 0}, {0, bc_b, bc_c}, {ca_a, 0, ca_c}};
  Vec3 best = candidates[0];
  double best2 = std::numeric_limits<double>::infinity();
  for (const Vec3& s : candidates) {
    const double d2 = (s[0] * a + s[1] * b + s[2] * c - p).squaredNorm();
    if (d2 < best2) {
      best2 = d2;
      best = s;
    }
  }
  return best;
}

// The distance along the ray to the triangle, from either side (Möller and Trumbore 1997). A small tolerance lets no
// ray slip between two triangles.
std::optional<double> hit_triangle(const Vec3& a, const Vec3& b, const Vec3& c, const Vec3& origin,
                                   const Vec3& direction) {
  constexpr double kSlack = 1e-9;
  const Vec3 ab = b - a, ac = c - a;
  const Vec3 cross = direction.cross(ac);
  const double determinant = ab.dot(cross);
  if (determinant == 0) return std::nullopt;
  const Vec3 from_a = origin - a;
  const double u = from_a.dot(cross) / determinant;
  if (!(u >= -kSlack && u <= 1 + kSlack)) return std::nullopt;
  const Vec3 other = from_a.cross(ab);
  const double v = direction.dot(other) / determinant;
  if (!(v >= -kSlack && u + v <= 1 + kSlack)) return std::nullopt;
  const double t = ac.dot(other) / determinant;
  return t >= 0 ? std::optional(t) : std::nullopt;
}

// Whether the ray meets the box before `limit`.
bool ray_meets_box(const Vec3& low, const Vec3& high, const Vec3& origin, const Vec3& direction, double limit) {
  double enter = 0, leave = limit;
  for (int axis = 0; axis < 3; ++axis) {
    if (direction[axis] == 0) {
      if (origin[axis] < low[axis] || origin[axis] > high[axis]) return false;
      continue;
    }
    const double t0 = (low[axis] - origin[axis]) / direction[axis];
    const double t1 = (high[axis] - origin[axis]) / direction[axis];
    enter = std::max(enter, std::min(t0, t1));
    leave = std::min(leave, std::max(t0, t1));
  }
  // The tolerance lets rays through that graze a face of the box; a triangle may lie in that face.
  return enter <= leave * (1 + 1e-12) + 1e-15;
}

// The solid angle of the triangle seen from p (Van Oosterom and Strackee 1983); 0 where p is a corner.
double triangle_solid_angle(const Vec3& a, const Vec3& b, const Vec3& c, const Vec3& p) {
  const Vec3 x = a - p, y = b - p, z = c - p;
  const double nx = x.norm(), ny = y.norm(), nz = z.norm();
  const double volume = x.dot(y.cross(z));
  const double base = nx * ny * nz + x.dot(y) * nz + y.dot(z) * nx + z.dot(x) * ny;
  return volume == 0 && base == 0 ? 0 : 2 * std::atan2(volume, base);
}

}  // namespace

MeshQuery::MeshQuery(const TriangleMesh& mesh) {
  HAIRNET_ASSERT(mesh.triangles.size() <= std::numeric_limits<std::uint32_t>::max());
  HAIRNET_VALIDATE(std::ranges::all_of(mesh.vertices, [](const Vec3f& v) { return v.allFinite(); }));
  corners_.reserve(mesh.triangles.size());
  for (std::size_t t = 0; t < mesh.triangles.size(); ++t) {
    const auto& [a, b, c] = mesh.triangles[t];
    HAIRNET_ASSERT(std::max({a, b, c}) < mesh.vertices.size());
    corners_.push_back({mesh.vertices[a].cast<double>(), mesh.vertices[b].cast<double>(),
                        mesh.vertices[c].cast<double>(), static_cast<std::uint32_t>(t)});
  }
  if (!corners_.empty()) add_box(0, static_cast<std::uint32_t>(corners_.size()));
  HAIRNET_ASSERT(corners_.empty() == boxes_.empty());
}

std::uint32_t MeshQuery::add_box(std::uint32_t begin, std::uint32_t end) {
  HAIRNET_ASSERT(begin < end);
  HAIRNET_ASSERT(end <= corners_.size());
  Box box{Vec3::Constant(std::numeric_limits<double>::infinity()),
          Vec3::Constant(-std::numeric_limits<double>::infinity()),
          begin,
          end,
          0,
          Vec3::Zero(),
          Vec3::Zero(),
          0};
  double area_sum = 0;
  for (std::uint32_t t = begin; t < end; ++t) {
    const Corners& s = corners_[t];
    box.low = box.low.cwiseMin(s.a).cwiseMin(s.b).cwiseMin(s.c);
    box.high = box.high.cwiseMax(s.a).cwiseMax(s.b).cwiseMax(s.c);
    const Vec3 area = 0.5 * (s.b - s.a).cross(s.c - s.a);
    box.dipole += area;
    box.dipole_centre += area.norm() * (s.a + s.b + s.c) / 3;
    area_sum += area.norm();
  }
  box.dipole_centre = area_sum > 0 ? Vec3(box.dipole_centre / area_sum) : Vec3(0.5 * (box.low + box.high));
  box.dipole_radius = (box.dipole_centre - box.low).cwiseMax(box.high - box.dipole_centre).norm();

  HAIRNET_VALIDATE(std::isfinite(box.dipole_radius));
  const auto index = static_cast<std::uint32_t>(boxes_.size());
  boxes_.push_back(box);
  if (end - begin <= kLeafTriangles) return index;

  int axis = 0;
  (box.high - box.low).maxCoeff(&axis);
  const std::uint32_t middle = begin + (end - begin) / 2;
  const auto key = [axis](const Corners& s) { return s.a[axis] + s.b[axis] + s.c[axis]; };
  // The triangle's number breaks ties, so the tree does not depend on the library's algorithm.
  std::nth_element(
      corners_.begin() + begin, corners_.begin() + middle, corners_.begin() + end,
      [&](const Corners& s, const Corners& t) { return key(s) != key(t) ? key(s) < key(t) : s.triangle < t.triangle; });
  add_box(begin, middle);
  const std::uint32_t second = add_box(middle, end);
  // The first child lies between the two.
  HAIRNET_ASSERT(second > index + 1);
  boxes_[index].second = second;
  return index;
}

MeshQuery::Closest MeshQuery::closest(const Vec3& point, double distance_max) const {
  HAIRNET_ASSERT(distance_max >= 0);
  Closest best;
  if (empty()) return best;
  best.distance = distance_max;
  find_closest(0, point, best);
  // A point that was found has barycentric coordinates with sum 1.
  if (best.barycentric.isZero(0)) best.distance = std::numeric_limits<double>::infinity();
  HAIRNET_ASSERT(best.distance <= distance_max || best.distance == std::numeric_limits<double>::infinity());
  HAIRNET_VALIDATE(best.barycentric.isZero(0) || std::abs(best.barycentric.sum() - 1) < 1e-6);
  return best;
}

void MeshQuery::find_closest(std::uint32_t index, const Vec3& point, Closest& best) const {
  HAIRNET_VALIDATE(index < boxes_.size());
  const Box& box = boxes_[index];
  // Nothing in the box can be nearer than the box itself.
  if (box_distance2(box.low, box.high, point) >= best.distance * best.distance) return;
  if (box.second == 0) {
    for (std::uint32_t t = box.begin; t < box.end; ++t) {
      const Corners& s = corners_[t];
      const Vec3 weights = closest_on_triangle(s.a, s.b, s.c, point);
      const Vec3 foot = weights[0] * s.a + weights[1] * s.b + weights[2] * s.c;
      const double distance = (foot - point).norm();
      if (distance < best.distance) best = {s.triangle, distance, foot, weights};
    }
    return;
  }
  const Box& first = boxes_[index + 1];
  const Box& second = boxes_[box.second];
  // The nearer box first: what is found there excludes most of the other.
  const bool first_is_nearer =
      box_distance2(first.low, first.high, point) <= box_distance2(second.low, second.high, point);
  find_closest(first_is_nearer ? index + 1 : box.second, point, best);
  find_closest(first_is_nearer ? box.second : index + 1, point, best);
}

std::optional<MeshQuery::Hit> MeshQuery::first_hit(const Vec3& origin, const Vec3& direction,
                                                   double distance_max) const {
  HAIRNET_ASSERT(std::abs(direction.squaredNorm() - 1) < 1e-3);
  std::optional<Hit> best;
  double limit = distance_max;
  if (!empty()) find_hit(0, origin, direction, best, limit);
  HAIRNET_ASSERT(!best || best->distance <= distance_max);
  return best;
}

void MeshQuery::find_hit(std::uint32_t index, const Vec3& origin, const Vec3& direction, std::optional<Hit>& best,
                         double& limit) const {
  const Box& box = boxes_[index];
  if (!ray_meets_box(box.low, box.high, origin, direction, limit)) return;
  if (box.second == 0) {
    for (std::uint32_t t = box.begin; t < box.end; ++t) {
      const Corners& s = corners_[t];
      const std::optional<double> distance = hit_triangle(s.a, s.b, s.c, origin, direction);
      if (!distance || *distance > limit) continue;
      best = Hit{s.triangle, *distance};
      limit = *distance;
    }
    return;
  }
  find_hit(index + 1, origin, direction, best, limit);
  find_hit(box.second, origin, direction, best, limit);
}

double MeshQuery::winding_number(const Vec3& point) const {
  return empty() ? 0 : solid_angle(0, point) / (4 * std::numbers::pi);
}

double MeshQuery::solid_angle(std::uint32_t index, const Vec3& point) const {
  HAIRNET_VALIDATE(index < boxes_.size());
  const Box& box = boxes_[index];
  const Vec3 to_centre = box.dipole_centre - point;
  const double distance = to_centre.norm();
  if (distance > kDipoleDistance * box.dipole_radius) {
    return box.dipole.dot(to_centre) / (distance * distance * distance);
  }
  if (box.second != 0) return solid_angle(index + 1, point) + solid_angle(box.second, point);
  double sum = 0;
  for (std::uint32_t t = box.begin; t < box.end; ++t) {
    sum += triangle_solid_angle(corners_[t].a, corners_[t].b, corners_[t].c, point);
  }
  return sum;
}

}  // namespace hairnet
