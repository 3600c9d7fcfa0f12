#include "core/build/body_balls.hpp"

#include <algorithm>
#include <array>
#include <cmath>
#include <numbers>

namespace hairnet {
namespace {

constexpr std::array<std::size_t, kBoneCount> kBallsPerBone{2, 1, 1, 1, 2};
constexpr double kReachLeast = 0.35, kReachMost = 0.55;  // m from the head joint
constexpr int kSamplesPerAxis = 28;                      // of the inside, along the longest axis
constexpr std::size_t kSamplesLeast = 12;                // a bone with fewer has no part of this body
constexpr int kMeansRounds = 24;
constexpr double kHairMargin = 0.05;  // m that hair may swing beyond its farthest point

double reach(const Groom& groom) {
  const Vec3f joint = groom.body.joints[static_cast<std::size_t>(Bone::head)];
  double farthest2 = 0;
  for (const Vec3f& point : groom.points) {
    farthest2 = std::max(farthest2, static_cast<double>((point - joint).squaredNorm()));
  }
  return std::clamp(std::sqrt(farthest2) + kHairMargin, kReachLeast, kReachMost);
}

// The bone that moves the skin nearest to a point most.
std::size_t bone_at(const Body& body, const MeshQuery& skin, const Vec3& point) {
  const MeshQuery::Closest closest = skin.closest(point);
  std::array<double, kBoneCount> weights{};
  for (int corner = 0; corner < 3; ++corner) {
    const auto& vertex_weights = body.bone_weights[body.mesh.triangles[closest.triangle][corner]];
    for (std::size_t bone = 0; bone < kBoneCount; ++bone) {
      weights[bone] += closest.barycentric[corner] * static_cast<double>(vertex_weights[bone]);
    }
  }
  return static_cast<std::size_t>(std::ranges::max_element(weights) - weights.begin());
}

// A regular sample of the inside of the mesh within `reach_m` of the head joint, by bone.
std::array<std::vector<Vec3>, kBoneCount> sample_inside(const Body& body, const MeshQuery& skin, double reach_m) {
  const Vec3 joint = body.joints[static_cast<std::size_t>(Bone::head)].cast<double>();
  Vec3 low = joint, high = joint;
  for (const Vec3f& vertex : body.mesh.vertices) {
    low = low.cwiseMin(vertex.cast<double>());
    high = high.cwiseMax(vertex.cast<double>());
  }
  low = low.cwiseMax(joint - Vec3::Constant(reach_m));
  high = high.cwiseMin(joint + Vec3::Constant(reach_m));
  const double step = std::max((high - low).maxCoeff() / kSamplesPerAxis, 1e-3);
  std::array<std::vector<Vec3>, kBoneCount> samples;
  for (double z = low[2] + step / 2; z < high[2]; z += step) {
    for (double y = low[1] + step / 2; y < high[1]; y += step) {
      for (double x = low[0] + step / 2; x < high[0]; x += step) {
        const Vec3 point(x, y, z);
        if ((point - joint).norm() > reach_m || !skin.inside(point)) continue;
        samples[bone_at(body, skin, point)].push_back(point);
      }
    }
  }
  return samples;
}

std::size_t nearest_index(const std::vector<Vec3>& points, const Vec3& to) {
  std::size_t best = 0;
  for (std::size_t i = 1; i < points.size(); ++i) {
    if ((points[i] - to).squaredNorm() < (points[best] - to).squaredNorm()) best = i;
  }
  return best;
}

// Centres of k clusters: Lloyd's rounds from samples as far apart as can be. Each centre is a sample, so that it is
// inside even where the part bends.
std::vector<Vec3> cluster_centres(const std::vector<Vec3>& samples, std::size_t cluster_count) {
  Vec3 mean = Vec3::Zero();
  for (const Vec3& s : samples) mean += s / static_cast<double>(samples.size());
  std::vector<Vec3> centres;
  while (centres.size() < cluster_count) {
    const auto distance2 = [&](const Vec3& s) {
      return centres.empty() ? (s - mean).squaredNorm() : (s - centres[nearest_index(centres, s)]).squaredNorm();
    };
    centres.push_back(*std::ranges::max_element(samples, {}, distance2));
  }
  for (int round = 0; round < kMeansRounds; ++round) {
    std::vector<Vec3> sums(cluster_count, Vec3::Zero());
    std::vector<double> counts(cluster_count, 0);
    for (const Vec3& s : samples) {
      const std::size_t cluster = nearest_index(centres, s);
      sums[cluster] += s;
      counts[cluster] += 1;
    }
    for (std::size_t c = 0; c < cluster_count; ++c) {
      if (counts[c] > 0) centres[c] = sums[c] / counts[c];
    }
  }
  for (Vec3& centre : centres) centre = samples[nearest_index(samples, centre)];
  return centres;
}

// Median distance to the skin over directions spread evenly (a spiral by the golden angle).
double typical_radius(const MeshQuery& skin, const Vec3& centre) {
  constexpr int kDirections = 101;
  constexpr double kFarthest = 1;  // m
  std::vector<double> distances;
  for (int i = 0; i < kDirections; ++i) {
    const double y = 1 - 2 * (i + 0.5) / kDirections, ring = std::sqrt(1 - y * y);
    const double angle = i * std::numbers::pi * (3 - std::sqrt(5.0));
    const Vec3 direction(ring * std::cos(angle), y, ring * std::sin(angle));
    const auto hit = skin.first_hit(centre, direction, kFarthest);
    distances.push_back(hit ? hit->distance : kFarthest);
  }
  std::ranges::nth_element(distances, distances.begin() + kDirections / 2);
  return distances[kDirections / 2];
}

}  // namespace

BodyShape place_balls(const Groom& groom) {
  BodyShape shape{MeshQuery(groom.body.mesh), {}};
  if (shape.skin.empty()) return shape;
  const auto samples = sample_inside(groom.body, shape.skin, reach(groom));
  for (std::size_t bone = 0; bone < kBoneCount; ++bone) {
    if (samples[bone].size() < kSamplesLeast) continue;
    for (const Vec3& centre : cluster_centres(samples[bone], kBallsPerBone[bone])) {
      shape.balls.push_back({static_cast<Bone>(bone), centre, typical_radius(shape.skin, centre)});
    }
  }
  return shape;
}

}  // namespace hairnet
