#include "tests/fidelity/strand_sample.hpp"

#include <algorithm>
#include <cmath>
#include <numbers>

#include "core/random.hpp"

namespace hairnet::fidelity {
namespace {

// Hairstyles with many points a strand still get so many strands, so that all parts of the head have some.
constexpr std::size_t kStrandsMin = 400;
// Shorter strands are left out: their lengths are compared as ratios.
constexpr double kLengthLeast_m = 0.001;

}  // namespace

StrandSample sample_strands(const Groom& groom, std::size_t point_count) {
  const std::vector<float> blend = root_blend(groom);
  const std::size_t points_a_strand = std::max<std::size_t>(1, groom.strand_begin.back() / groom.strand_count());
  const std::size_t count = std::min(groom.strand_count(), std::max(kStrandsMin, point_count / points_a_strand));
  StrandSample sample;
  for (std::size_t i = 0; i < count; ++i) {
    const std::size_t s = i * groom.strand_count() / count;
    const double length_m = polyline_length(groom.strand_points(s));
    if (length_m < kLengthLeast_m) continue;
    for (std::uint32_t p = groom.strand_begin[s]; p < groom.strand_begin[s + 1]; ++p) {
      sample.points.push_back(groom.points[p]);
      sample.blend.push_back(blend[p]);
    }
    sample.begin.push_back(static_cast<std::uint32_t>(sample.points.size()));
    sample.length_m.push_back(length_m);
  }
  Random random(1);
  const double share = static_cast<double>(point_count) / static_cast<double>(sample.points.size());
  for (std::uint32_t p = 0; p < sample.points.size(); ++p)
    if (random.unit() < share) sample.probe_points.push_back(p);
  return sample;
}

double polyline_length(std::span<const Vec3f> points) {
  double length_m = 0;
  for (std::size_t p = 1; p < points.size(); ++p) length_m += static_cast<double>((points[p] - points[p - 1]).norm());
  return length_m;
}

double inverted_share(const Level& level, const StrandSample& strands, std::span<const Vec3f> grid_displacements) {
  const std::size_t count = strands.points.size();
  std::array<std::vector<Vec3f>, 3> columns;
  std::vector<Vec3f> points(count);
  for (int axis = 0; axis < 3; ++axis) {
    const RestTangents along{std::vector<Vec3f>(count, Vec3f::Unit(axis)), std::vector<float>(count, 0.0F)};
    std::vector<Vec3f>& column = columns[static_cast<std::size_t>(axis)];
    column.resize(count);
    Deformer(level.geometry.lattice, strands.points, {}, along, FfdKind::quadratic)
        .deform(grid_displacements, points, column);
  }
  std::size_t inverted = 0;
  for (std::size_t p = 0; p < count; ++p)
    if (columns[0][p].dot(columns[1][p].cross(columns[2][p])) < 0) ++inverted;
  return static_cast<double>(inverted) / static_cast<double>(count);
}

double hanging_angle(const StrandSample& strands, std::span<const Vec3f> points_head, const Quat& head) {
  const Vec3f down_head = -(head.conjugate() * Vec3::UnitY()).cast<float>();
  std::vector<float> angles;
  for (std::size_t s = 0; s < strands.strand_count(); ++s) {
    const std::uint32_t first = strands.begin[s], last = strands.begin[s + 1] - 1;
    const Vec3f lower = points_head[last] - points_head[(first + last) / 2];
    angles.push_back(std::acos(std::clamp(lower.normalized().dot(down_head), -1.0F, 1.0F)));
  }
  return percentile(angles, 0.5);
}

double percentile(std::span<float> values, double share) {
  if (values.empty()) return 0;
  const auto nth = values.begin() + static_cast<std::ptrdiff_t>(share * static_cast<double>(values.size() - 1));
  std::nth_element(values.begin(), nth, values.end());
  return static_cast<double>(*nth);
}

}  // namespace hairnet::fidelity
