#include <Eigen/Cholesky>
#include <Eigen/LU>
#include <algorithm>
#include <cmath>
#include <cstdint>
#include <map>
#include <optional>
#include <utility>
#include <vector>

#include "core/import/placement.hpp"
#include "core/import/skull_fit.hpp"

namespace hairnet {
namespace {

constexpr double kUsualRadius_m = 0.09;
constexpr std::size_t kSampleMax = 4000;  // points looked at: a head has no more shape than these show
constexpr int kTrialCount = 300;
constexpr double kAxisRatioMax = 1.3;  // of an ellipsoid's axis to the sphere's radius

struct Sphere {
  Vec3 centre;
  double radius;
};

// The numbers of Knuth's 64-bit linear congruential generator: the fit must not depend on a library's.
class Draw {
 public:
  std::size_t below(std::size_t count) {
    state_ = state_ * 6364136223846793005ULL + 1442695040888963407ULL;
    return static_cast<std::size_t>((state_ >> 33) % count);
  }

 private:
  std::uint64_t state_ = 1;
};

std::optional<Sphere> sphere_through(const std::array<Vec3, 4>& points) {
  Mat3 edges;
  Vec3 half_squares;
  double size = 0;
  for (int i = 0; i < 3; ++i) {
    const Vec3 edge = points[static_cast<std::size_t>(i) + 1] - points[0];
    edges.row(i) = edge.transpose();
    half_squares[i] = 0.5 * edge.squaredNorm();
    size = std::max(size, edge.norm());
  }
  if (!(std::abs(edges.determinant()) > 1e-4 * size * size * size)) return {};
  const Vec3 to_centre = edges.partialPivLu().solve(half_squares);
  return Sphere{points[0] + to_centre, to_centre.norm()};
}

double median(std::vector<double>& values) {
  const auto middle = values.begin() + static_cast<std::ptrdiff_t>(values.size() / 2);
  std::nth_element(values.begin(), middle, values.end());
  return *middle;
}

double median_distance(const Sphere& sphere, std::span<const Vec3> points) {
  std::vector<double> distances;
  distances.reserve(points.size());
  for (const Vec3& x : points) distances.push_back(std::abs((x - sphere.centre).norm() - sphere.radius));
  return median(distances);
}

// Least median of squares (Rousseeuw 1984): up to half of the points may lie anywhere.
std::optional<Sphere> robust_sphere(std::span<const Vec3> points) {
  if (points.size() < 4) return {};
  Draw draw;
  std::optional<Sphere> best;
  double best_distance = 0;
  for (int trial = 0; trial < kTrialCount; ++trial) {
    std::array<Vec3, 4> four;
    for (Vec3& x : four) x = points[draw.below(points.size())];
    const std::optional<Sphere> sphere = sphere_through(four);
    if (!sphere) continue;
    const double distance = median_distance(*sphere, points);
    if (best && distance >= best_distance) continue;
    best = sphere;
    best_distance = distance;
  }
  return best;
}

using Vec6 = Eigen::Matrix<double, 6, 1>;
using Mat6 = Eigen::Matrix<double, 6, 6>;

// One weighted Gauss-Newton step on the distances to the ellipsoid, for its centre and the logarithms of its axes. The
// ridge draws the axes towards the sphere, as strongly as a tenth of the points would.
void refine(SkullFit& fit, const Sphere& sphere, std::span<const Vec3> inliers, double spread) {
  Mat6 normal = Mat6::Zero();
  Vec6 right = Vec6::Zero();
  for (const Vec3& x : inliers) {
    const Vec3 scaled = (x - fit.centre).cwiseQuotient(fit.semi_axes);
    const double length = scaled.norm();
    if (!(length > 1e-6)) continue;
    Vec6 gradient;
    gradient << -scaled.cwiseQuotient(fit.semi_axes) / length, -scaled.cwiseAbs2() / length;
    gradient *= sphere.radius;
    const double residual = sphere.radius * (length - 1);
    const double far = residual / spread;
    const double weight = 1 / (1 + far * far);
    normal += weight * gradient * gradient.transpose();
    right -= weight * residual * gradient;
  }
  const double ridge = 0.1 * static_cast<double>(inliers.size()) * sphere.radius * sphere.radius;
  for (int axis = 0; axis < 3; ++axis) {
    normal(axis, axis) += 0.01 * static_cast<double>(inliers.size());
    normal(3 + axis, 3 + axis) += ridge;
    right[3 + axis] -= ridge * std::log(fit.semi_axes[axis] / sphere.radius);
  }
  const Vec6 step = normal.ldlt().solve(right);
  if (!step.allFinite()) return;
  const double most = 0.2 * sphere.radius;
  fit.centre += step.head<3>().cwiseMax(-most).cwiseMin(most);
  for (int axis = 0; axis < 3; ++axis) {
    const double grown = fit.semi_axes[axis] * std::exp(std::clamp(step[3 + axis], -0.2, 0.2));
    fit.semi_axes[axis] = std::clamp(grown, sphere.radius / kAxisRatioMax, sphere.radius * kAxisRatioMax);
  }
}

double width_of(std::span<const Vec3> points) {
  double low = points.front().x(), high = low;
  for (const Vec3& x : points) {
    low = std::min(low, x.x());
    high = std::max(high, x.x());
  }
  return high - low;
}

std::vector<Vec3> near(const Sphere& sphere, std::span<const Vec3> points, double distance_max) {
  std::vector<Vec3> out;
  for (const Vec3& x : points) {
    if (std::abs((x - sphere.centre).norm() - sphere.radius) <= distance_max) out.push_back(x);
  }
  return out;
}

SkullFit usual_skull(std::span<const Vec3> points) {
  SkullFit fit;
  fit.semi_axes = Vec3::Constant(kUsualRadius_m);
  if (points.empty()) return fit;
  Vec3 mean = Vec3::Zero();
  for (const Vec3& x : points) mean += x / static_cast<double>(points.size());
  fit.centre = mean - Vec3(0, kUsualRadius_m, 0);
  fit.width = width_of(points);
  return fit;
}

// An icosahedron with each triangle split in four, three times over: 642 vertices on the unit sphere.
TriangleMesh unit_sphere() {
  const float g = (1 + std::sqrt(5.0f)) / 2;
  TriangleMesh mesh;
  mesh.vertices = {{-1, g, 0},  {1, g, 0},  {-1, -g, 0}, {1, -g, 0}, {0, -1, g},  {0, 1, g},
                   {0, -1, -g}, {0, 1, -g}, {g, 0, -1},  {g, 0, 1},  {-g, 0, -1}, {-g, 0, 1}};
  mesh.triangles = {{0, 11, 5},  {0, 5, 1},  {0, 1, 7},  {0, 7, 10}, {0, 10, 11}, {1, 5, 9}, {5, 11, 4},
                    {11, 10, 2}, {10, 7, 6}, {7, 1, 8},  {3, 9, 4},  {3, 4, 2},   {3, 2, 6}, {3, 6, 8},
                    {3, 8, 9},   {4, 9, 5},  {2, 4, 11}, {6, 2, 10}, {8, 6, 7},   {9, 8, 1}};
  for (Vec3f& x : mesh.vertices) x.normalize();
  for (int round = 0; round < 3; ++round) {
    std::map<std::pair<std::uint32_t, std::uint32_t>, std::uint32_t> halves;
    const auto half = [&](std::uint32_t a, std::uint32_t b) {
      const auto [at, is_new] = halves.try_emplace(std::minmax(a, b), static_cast<std::uint32_t>(mesh.vertices.size()));
      if (is_new) mesh.vertices.push_back((mesh.vertices[a] + mesh.vertices[b]).normalized());
      return at->second;
    };
    std::vector<std::array<std::uint32_t, 3>> split;
    split.reserve(4 * mesh.triangles.size());
    for (const auto& [a, b, c] : mesh.triangles) {
      const std::uint32_t ab = half(a, b), bc = half(b, c), ca = half(c, a);
      split.insert(split.end(), {{a, ab, ca}, {b, bc, ab}, {c, ca, bc}, {ab, bc, ca}});
    }
    mesh.triangles = std::move(split);
  }
  return mesh;
}

}  // namespace

SkullFit fit_skull_shape(std::span<const Vec3> points) {
  std::vector<Vec3> sample;
  const std::size_t stride = points.size() / kSampleMax + 1;
  for (std::size_t i = 0; i < points.size(); i += stride) {
    if (points[i].allFinite()) sample.push_back(points[i]);
  }
  const std::optional<Sphere> sphere = robust_sphere(sample);
  if (!sphere) return usual_skull(sample);

  // A scalp is no sphere: what lies within a fifth of the radius is still of it, whatever the median says.
  const double spread = std::max(1.5 * median_distance(*sphere, sample), 0.02 * sphere->radius);
  const std::vector<Vec3> inliers =
      near(*sphere, sample, std::clamp(3 * spread, 0.2 * sphere->radius, 0.35 * sphere->radius));
  SkullFit fit{sphere->centre, Vec3::Constant(sphere->radius), inliers.size(), 0};
  if (inliers.size() < 4) return usual_skull(sample);
  fit.width = width_of(inliers);
  constexpr int kStepCount = 30;
  for (int i = 0; i < kStepCount; ++i) refine(fit, *sphere, inliers, spread);
  return fit;
}

Body fit_skull(std::span<const Vec3f> roots_head) {
  std::vector<Vec3> roots;
  roots.reserve(roots_head.size());
  for (const Vec3f& x : roots_head) roots.push_back(x.cast<double>());
  const SkullFit fit = fit_skull_shape(roots);
  Body body;
  body.mesh = unit_sphere();
  for (Vec3f& x : body.mesh.vertices) x = (fit.centre + fit.semi_axes.cwiseProduct(x.cast<double>())).cast<float>();
  body.bone_weights.assign(body.mesh.vertices.size(), {1, 0, 0, 0, 0});
  body.fitted_from_roots = true;
  return body;
}

}  // namespace hairnet
