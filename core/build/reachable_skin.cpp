#include "core/build/reachable_skin.hpp"

#include <algorithm>
#include <cmath>
#include <limits>

namespace hairnet {
namespace {

constexpr double kPointCount = 2000;
constexpr std::size_t kHairPointsMost = 600;
constexpr double kLongStrand = 0.95;               // quantile of the strands' lengths
constexpr double kReachLeast = 0.03, kReachMost = 0.25;  // m
constexpr double kFreeAbove = 0.05;                // m without skin above a point that hair can come to
constexpr double kSkip = 1e-4;                     // m

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

std::vector<Vec3> some_hair(const Groom& groom) {
  std::vector<Vec3> points;
  const std::size_t stride = groom.points.size() / kHairPointsMost + 1;
  for (std::size_t p = 0; p < groom.points.size(); p += stride) points.push_back(groom.points[p].cast<double>());
  return points;
}

double distance_to(const std::vector<Vec3>& points, const Vec3& from) {
  double least2 = std::numeric_limits<double>::infinity();
  for (const Vec3& point : points) least2 = std::min(least2, (point - from).squaredNorm());
  return std::sqrt(least2);
}

}  // namespace

std::vector<SkinPoint> reachable_skin(const Groom& groom, const MeshQuery& skin) {
  const double reach_m = reach_of(groom);
  const std::vector<Vec3> hair = some_hair(groom);
  Vec3 low = Vec3::Constant(std::numeric_limits<double>::infinity()), high = -low;
  for (const Vec3& point : hair) {
    low = low.cwiseMin(point - Vec3::Constant(reach_m));
    high = high.cwiseMax(point + Vec3::Constant(reach_m));
  }
  struct Piece {
    Vec3 middle, area;
    std::array<std::uint32_t, 3> corners;
  };
  std::vector<Piece> pieces;
  double area_sum = 0;
  for (const auto& t : groom.body.mesh.triangles) {
    const Vec3 a = groom.body.mesh.vertices[t[0]].cast<double>(), b = groom.body.mesh.vertices[t[1]].cast<double>(),
               c = groom.body.mesh.vertices[t[2]].cast<double>();
    const Vec3 middle = (a + b + c) / 3;
    if ((middle - low).minCoeff() < 0 || (high - middle).minCoeff() < 0) continue;
    pieces.push_back({middle, 0.5 * (b - a).cross(c - a), t});
    area_sum += pieces.back().area.norm();
  }
  std::vector<SkinPoint> points;
  double owed = 0;
  for (const Piece& piece : pieces) {
    const double area = piece.area.norm();
    owed += kPointCount * area / area_sum;
    if (owed < 0.5) continue;
    const double share = std::round(owed);
    owed -= share;
    const Vec3 normal = piece.area / area;
    const double weight = share * (1 - distance_to(hair, piece.middle) / reach_m);
    if (weight <= 0 || skin.first_hit(piece.middle + kSkip * normal, normal, kFreeAbove)) continue;
    SkinPoint point{piece.middle, normal, {}, weight};
    for (const std::uint32_t corner : piece.corners) {
      for (std::size_t b = 0; b < kBoneCount; ++b) point.bone_weights[b] += static_cast<double>(groom.body.bone_weights[corner][b]) / 3;
    }
    points.push_back(point);
  }
  return points;
}

}  // namespace hairnet
