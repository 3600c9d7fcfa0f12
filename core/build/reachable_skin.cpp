#include "core/build/reachable_skin.hpp"

#include <algorithm>
#include <cmath>
#include <limits>

namespace hairnet {
namespace {

constexpr double kPointCount = 1500;
constexpr std::size_t kHairPointsMost = 600;
constexpr double kLongStrand = 0.95;                     // quantile of the strands' lengths
constexpr double kReachLeast = 0.03, kReachMost = 0.25;  // m
constexpr double kFreeAbove = 0.05;                      // m without skin above a point that hair can come to
constexpr double kSkip = 1e-4;                           // m

double strand_length(const Groom& groom, std::size_t strand) {
  const auto points = groom.strand_points(strand);
  double length = 0;
  for (std::size_t i = 1; i < points.size(); ++i) length += static_cast<double>((points[i] - points[i - 1]).norm());
  return length;
}

double reach_of(const Groom& groom) {
  std::vector<double> lengths;
  for (std::size_t s = 0; s < groom.strand_count(); ++s) lengths.push_back(strand_length(groom, s));
  if (lengths.empty()) return kReachLeast;
  const auto nth = lengths.begin() + static_cast<std::ptrdiff_t>(kLongStrand * static_cast<double>(lengths.size() - 1));
  std::ranges::nth_element(lengths, nth);
  return std::clamp(0.5 * *nth, kReachLeast, kReachMost);
}

std::vector<Vec3> some_of(const HairSample& hair) {
  std::vector<Vec3> points;
  const std::size_t stride = hair.points.size() / kHairPointsMost + 1;
  for (std::size_t p = 0; p < hair.points.size(); p += stride) points.push_back(hair.points[p].cast<double>());
  return points;
}

double distance_to(const std::vector<Vec3>& points, const Vec3& from) {
  double least2 = std::numeric_limits<double>::infinity();
  for (const Vec3& point : points) least2 = std::min(least2, (point - from).squaredNorm());
  return std::sqrt(least2);
}

// The box around the hair, grown by what hair can reach.
struct Reach {
  Reach(const std::vector<Vec3>& hair, double reach_m) {
    for (const Vec3& point : hair) {
      low = low.cwiseMin(point - Vec3::Constant(reach_m));
      high = high.cwiseMax(point + Vec3::Constant(reach_m));
    }
  }
  [[nodiscard]] bool holds(const Vec3& p) const { return (p - low).minCoeff() > 0 && (high - p).minCoeff() > 0; }

  Vec3 low = Vec3::Constant(std::numeric_limits<double>::infinity()), high = -low;
};

struct Triangle {
  Triangle(const TriangleMesh& mesh, const std::array<std::uint32_t, 3>& indices) : corners(indices) {
    const Vec3 a = mesh.vertices[indices[0]].cast<double>(), b = mesh.vertices[indices[1]].cast<double>(),
               c = mesh.vertices[indices[2]].cast<double>();
    middle = (a + b + c) / 3;
    const Vec3 cross = (b - a).cross(c - a);
    area = 0.5 * cross.norm();
    normal = area > 0 ? Vec3(cross.normalized()) : Vec3::Zero();
  }
  std::array<std::uint32_t, 3> corners;
  Vec3 middle, normal;
  double area;
};

std::array<double, kBoneCount> bone_weights(const Body& body, const Triangle& triangle) {
  std::array<double, kBoneCount> weights{};
  for (const std::uint32_t corner : triangle.corners) {
    for (std::size_t b = 0; b < kBoneCount; ++b) weights[b] += static_cast<double>(body.bone_weights[corner][b]) / 3;
  }
  return weights;
}

}  // namespace

std::vector<SkinPoint> reachable_skin(const Groom& groom, const HairSample& sample, const MeshQuery& skin) {
  const double reach_m = reach_of(groom);
  const std::vector<Vec3> hair = some_of(sample);
  const Reach reach(hair, reach_m);
  std::vector<Triangle> triangles;
  double area = 0;
  for (const auto& indices : groom.body.mesh.triangles) {
    const Triangle triangle(groom.body.mesh, indices);
    if (triangle.area == 0 || !reach.holds(triangle.middle)) continue;
    triangles.push_back(triangle);
    area += triangle.area;
  }

  std::vector<SkinPoint> points;
  double owed = 0;  // points, for the area passed by
  for (const Triangle& triangle : triangles) {
    owed += kPointCount * triangle.area / area;
    const double count = std::round(owed);
    if (count < 1) continue;
    owed -= count;
    const double weight = count * (1 - distance_to(hair, triangle.middle) / reach_m);
    const Vec3& normal = triangle.normal;
    if (weight <= 0 || skin.first_hit(triangle.middle + kSkip * normal, normal, kFreeAbove)) continue;
    points.push_back({triangle.middle, normal, bone_weights(groom.body, triangle), weight});
  }
  return points;
}

}  // namespace hairnet
