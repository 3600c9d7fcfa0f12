#include <algorithm>
#include <array>
#include <cmath>
#include <cstdint>

#include "client/assets/import/skull_fit.hpp"
#include "core/geometry/symmetric_matrix.hpp"

namespace hairnet {
namespace {

// More points in the sample do not refine the shape of a head.
constexpr std::size_t kSampleMax = 4000;
// With half of the points on the scalp, one in 16 draws of four is free of outliers, so 200 draws miss with a chance
// below 1 in 100 000.
constexpr int kTrialCount = 200;
// An ellipsoid's axis differs from the sphere's radius by this factor at most. A scalp shows only the top of a head.
// Without the bound, the unseen lower part could grow to any length.
constexpr double kAxisRatioMax = 1.3;
// A sphere's radius differs from the usual one by this factor at most, in both directions.
constexpr double kRadiusRatioMax = 1.7;
// The standard deviation of the logarithm of a head's radius from the usual one: 4 %. A smaller deviation forces the
// usual size on small heads; a larger one lets a narrow strip of roots choose any size.
constexpr double kRadiusDeviation = 0.04;
// The place of a root on the skin is at least this uncertain, in usual radii.
constexpr double kPointError = 0.011;
// The head's middle may lie this far from the plane of a band, in usual radii.
constexpr double kBandDeviation = 0.05;
// A head is not a sphere: errors of neighbouring points are correlated, however many there are. So all points together
// count as this many independent ones, and thousands of roots cannot outvote the usual radius.
constexpr double kIndependentPoints = 5;

struct Sphere {
  Vec3 centre;
  double radius;
};

// The numbers of Knuth's 64-bit linear congruential generator. The fit must not depend on a library's generator,
// because the same file must give the same groom everywhere.
class Draw {
 public:
  std::size_t below(std::size_t count) {
    state_ = state_ * 6364136223846793005ULL + 1442695040888963407ULL;
    return static_cast<std::size_t>((state_ >> 33) % count);
  }

 private:
  std::uint64_t state_ = 1;
};

// The sphere through four points; none where they are nearly in a plane.
std::optional<Sphere> sphere_through(const std::array<Vec3, 4>& points) {
  const Vec3 a = points[1] - points[0], b = points[2] - points[0], c = points[3] - points[0];
  const double size = std::max({a.norm(), b.norm(), c.norm()}), volume = a.dot(b.cross(c));
  // Four points that are nearly in a plane give a sphere of any size.
  if (!(std::abs(volume) > 1e-4 * size * size * size)) return {};
  // The centre has equal distances: edge . to_centre = edge^2 / 2 for each edge, by Cramer's rule.
  const Vec3 to_centre =
      (a.squaredNorm() * b.cross(c) + b.squaredNorm() * c.cross(a) + c.squaredNorm() * a.cross(b)) / (2 * volume);
  return Sphere{points[0] + to_centre, to_centre.norm()};
}

// The two spheres of a given radius through three points. Where the points lie too far apart for that, both are the
// sphere about the middle of the points. These spheres help where the roots cover so little of a head that four of them
// show no radius.
std::vector<Sphere> spheres_through(const std::array<Vec3, 4>& points, double radius) {
  const Vec3 a = points[1] - points[0], b = points[2] - points[0], normal = a.cross(b);
  const double area = normal.norm();
  if (!(area > 1e-4 * std::max(a.squaredNorm(), b.squaredNorm()))) return {};
  // The centre is above the middle of the circle through the points, at the height that makes the radius.
  const Vec3 to_middle = (a.squaredNorm() * b.cross(normal) + b.squaredNorm() * normal.cross(a)) / (2 * area * area);
  const double height = std::sqrt(std::max(0.0, radius * radius - to_middle.squaredNorm()));
  if (!(to_middle.norm() < kRadiusRatioMax * radius)) return {};
  const Vec3 middle = points[0] + to_middle, up = height / area * normal;
  return {{middle + up, radius}, {middle - up, radius}};
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

// Least median of squares (Rousseeuw 1984): up to half of the points may be outliers. Of spheres that fit equally well
// it takes the most usual one.
std::optional<Sphere> robust_sphere(std::span<const Vec3> points, double usual_radius) {
  Draw draw;
  std::optional<Sphere> best;
  double best_score = 0;
  for (int trial = 0; trial < kTrialCount; ++trial) {
    std::array<Vec3, 4> four;
    for (Vec3& x : four) x = points[draw.below(points.size())];
    std::vector<Sphere> spheres = spheres_through(four, usual_radius);
    if (const std::optional<Sphere> free = sphere_through(four)) spheres.push_back(*free);
    for (const Sphere& sphere : spheres) {
      const double off = std::log(sphere.radius / usual_radius);
      if (!(std::abs(off) < std::log(kRadiusRatioMax))) continue;
      // A deviation of the radius by a factor e costs as much as a quarter of the usual radius in distance.
      const double score = median_distance(sphere, points) + 0.25 * usual_radius * off * off;
      if (best && score >= best_score) continue;
      best = sphere;
      best_score = score;
    }
  }
  return best;
}

std::vector<Vec3> near(const Sphere& sphere, std::span<const Vec3> points, double distance_max) {
  std::vector<Vec3> out;
  for (const Vec3& x : points) {
    if (std::abs((x - sphere.centre).norm() - sphere.radius) <= distance_max) out.push_back(x);
  }
  return out;
}

// Points of a band that is too narrow to determine the head's middle across it. A parting or a single row of hair is
// such a band.
struct RootBand {
  Vec3 middle, across;
};

// Returns none for points that are no band. A patch is one of these: it is thinnest towards the head's middle.
std::optional<RootBand> band_of(std::span<const Vec3> points, const Vec3& centre) {
  Vec3 mean = Vec3::Zero();
  for (const Vec3& x : points) mean += x / static_cast<double>(points.size());
  Mat3 covariance = Mat3::Zero();
  for (const Vec3& x : points) covariance += (x - mean) * (x - mean).transpose();
  const SymmetricEigen<3> axes = symmetric_eigen(covariance);
  // A narrow band is thinner than this share of the arc's height.
  constexpr double kNarrow = 1.0 / 3;
  if (!(axes.values[0] < kNarrow * kNarrow * axes.values[1])) return {};
  // The smallest eigenvalue belongs to the direction across the band.
  const Vec3 across = axes.vectors.col(0);
  // A patch is thin along the radius, not along the surface: its thinnest direction then points to the centre, and the
  // cosine to it is above 0.7 on average.
  double inwards = 0;
  for (const Vec3& x : points) inwards += std::abs(across.dot((x - centre).normalized()));
  if (inwards > 0.7 * static_cast<double>(points.size())) return {};
  return RootBand{mean, across};
}

// The weight of Cauchy: points much farther than `spread` count almost nothing, and the pull of an outlier has a limit.
double weight_of(double residual, double spread) {
  const double far = residual / spread;
  return 1 / (1 + far * far);
}

// One step towards the most probable sphere: Gauss-Newton on the weighted distances, for the centre and the logarithm
// of the radius, which is pulled towards the usual one. `spread` is the usual distance of points from the surface.
void refine(Sphere& sphere, std::span<const Vec3> inliers, double spread, double usual_radius,
            const std::optional<RootBand>& band) {
  Eigen::Matrix4d normal = Eigen::Matrix4d::Zero();
  Eigen::Vector4d right = Eigen::Vector4d::Zero();
  double weights = 0, squares = 0;
  for (const Vec3& x : inliers) {
    const Vec3 from_centre = x - sphere.centre;
    const double distance = from_centre.norm(), residual = distance - sphere.radius;
    if (!(distance > 0)) continue;
    // The residual's derivatives by the centre and by the logarithm of the radius.
    Eigen::Vector4d gradient;
    gradient << -from_centre / distance, -sphere.radius;
    const double weight = weight_of(residual, spread);
    normal += weight * gradient * gradient.transpose();
    right -= weight * residual * gradient;
    weights += weight;
    squares += weight * residual * residual;
  }
  // The error of a point is at least kPointError, because a scalp is no sphere.
  const double least = kPointError * usual_radius;
  const double precision = kIndependentPoints / (weights * (least * least + squares / weights));
  normal *= precision;
  right *= precision;
  // The pull becomes weaker far from the usual radius, so that a clear fit of a small or a large head wins.
  const double off = std::log(sphere.radius / usual_radius);
  const double radius_precision = weight_of(off, 3 * kRadiusDeviation) / (kRadiusDeviation * kRadiusDeviation);
  normal(3, 3) += radius_precision;
  right(3) -= radius_precision * off;
  // Keeps a step small in directions that the points do not determine.
  normal.diagonal().head<3>().array() += 1 / (usual_radius * usual_radius);
  if (band) {
    const double band_precision = std::pow(kBandDeviation * usual_radius, -2);
    normal.topLeftCorner<3, 3>() += band_precision * band->across * band->across.transpose();
    right.head<3>() -= band_precision * band->across.dot(sphere.centre - band->middle) * band->across;
  }
  const Eigen::Vector4d step = solve_symmetric(normal, right);
  // A system that cannot be solved leaves the sphere as it is. The limits below keep one step from leaving the head.
  if (!step.allFinite()) return;
  const double most = 0.2 * usual_radius;
  sphere.centre += step.head<3>().cwiseMax(-most).cwiseMin(most);
  sphere.radius *= std::exp(std::clamp(step(3), -0.2, 0.2));
}

// Directions have no unit, so the number does not depend on the unit of the file.
double conditioning_of(const Sphere& sphere, std::span<const Vec3> inliers) {
  Eigen::Matrix4d information = Eigen::Matrix4d::Zero();
  for (const Vec3& x : inliers) {
    Eigen::Vector4d gradient;
    gradient << (x - sphere.centre).normalized(), 1;
    information += gradient * gradient.transpose() / static_cast<double>(inliers.size());
  }
  return symmetric_eigen(information).values[0];
}

using Vec6 = Eigen::Matrix<double, 6, 1>;
using Mat6 = Eigen::Matrix<double, 6, 6>;

// One weighted Gauss-Newton step on the distances to the ellipsoid, for its centre and the logarithms of its axes. The
// ridge pulls both towards the sphere, with the weight of a tenth of the points. `gradient` is that of a distance,
// which is a length for the logarithms and a number for the centre; the ridge of the logarithms is scaled by the radius
// likewise.
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
    const double weight = weight_of(residual, spread);
    normal += weight * gradient * gradient.transpose();
    right -= weight * residual * gradient;
  }
  constexpr double kShapeRidge = 0.1;
  const double ridge = kShapeRidge * static_cast<double>(inliers.size()) * sphere.radius * sphere.radius;
  for (int axis = 0; axis < 3; ++axis) {
    normal(axis, axis) += kShapeRidge * static_cast<double>(inliers.size());
    right[axis] -= kShapeRidge * static_cast<double>(inliers.size()) * (fit.centre[axis] - sphere.centre[axis]);
    normal(3 + axis, 3 + axis) += ridge;
    right[3 + axis] -= ridge * std::log(fit.semi_axes[axis] / sphere.radius);
  }
  const Vec6 step = solve_symmetric(normal, right);
  if (!step.allFinite()) return;
  const double most = 0.2 * sphere.radius;
  fit.centre += step.head<3>().cwiseMax(-most).cwiseMin(most);
  for (int axis = 0; axis < 3; ++axis) {
    const double grown = fit.semi_axes[axis] * std::exp(std::clamp(step[3 + axis], -0.2, 0.2));
    fit.semi_axes[axis] = std::clamp(grown, sphere.radius / kAxisRatioMax, sphere.radius * kAxisRatioMax);
  }
}

// Without a usable fit, the roots' mean is the top of a head of usual size.
SkullFit usual_skull(std::span<const Vec3> points, double usual_radius) {
  SkullFit fit;
  fit.semi_axes = Vec3::Constant(usual_radius);
  fit.inliers.assign(points.begin(), points.end());
  if (points.empty()) return fit;
  Vec3 mean = Vec3::Zero();
  for (const Vec3& x : points) mean += x / static_cast<double>(points.size());
  fit.centre = mean - Vec3(0, usual_radius, 0);
  return fit;
}

}  // namespace

SkullFit fit_skull_shape(std::span<const Vec3> points, double usual_radius) {
  std::vector<Vec3> sample;
  // A stride spreads the sample over all files, and the same points always give the same sample.
  const std::size_t stride = points.size() / kSampleMax + 1;
  for (std::size_t i = 0; i < points.size(); i += stride) {
    if (points[i].allFinite()) sample.push_back(points[i]);
  }
  std::optional<Sphere> sphere = sample.size() < 4 ? std::nullopt : robust_sphere(sample, usual_radius);
  if (!sphere) return usual_skull(sample, usual_radius);

  // A scalp is not a sphere: points within a fifth of the radius belong to it, whatever the median is. The lower bound
  // keeps exact surfaces, such as a made scalp, from rejecting almost all of their points.
  const double spread = std::max(1.5 * median_distance(*sphere, sample), 0.02 * sphere->radius);
  SkullFit fit;
  fit.inliers = near(*sphere, sample, std::clamp(3 * spread, 0.2 * sphere->radius, 0.35 * sphere->radius));
  if (fit.inliers.size() < 4) return usual_skull(sample, usual_radius);
  const std::optional<RootBand> band = band_of(fit.inliers, sphere->centre);
  // The head's middle is put into the plane of the band at first; the refinement may move it by about kBandDeviation.
  if (band) sphere->centre -= band->across.dot(sphere->centre - band->middle) * band->across;
  constexpr int kStepCount = 30;
  for (int i = 0; i < kStepCount; ++i) refine(*sphere, fit.inliers, spread, usual_radius, band);
  fit.centre = sphere->centre;
  fit.semi_axes = Vec3::Constant(sphere->radius);
  fit.conditioning = conditioning_of(*sphere, fit.inliers);
  // The ellipsoid is fitted only where the sphere is determined, since it has more unknowns.
  for (int i = 0; fit.is_determined() && i < kStepCount; ++i) refine(fit, *sphere, fit.inliers, spread);
  return fit;
}

}  // namespace hairnet
