#include "core/hair_cards/strand_centrelines.hpp"

#include <algorithm>
#include <functional>
#include <span>

#include "core/assert.hpp"
#include "core/levels/resample.hpp"

namespace hairnet {
namespace {

constexpr double kCentrelineReach = 1.0 / 16, kOutlineReach = 1.0 / 6;

// A polyline by its arc length, and the integral of its points over that.
class ArcIntegral {
 public:
  explicit ArcIntegral(std::span<const Vec3f> line) {
    for (const Vec3f& x : line) {
      const Vec3 point = x.cast<double>();
      const double step = points_.empty() ? 0 : (point - points_.back()).norm();
      if (!points_.empty() && arcs_.back() + step == arcs_.back()) continue;  // no step, or one lost in rounding
      integrals_.push_back(points_.empty() ? Vec3(Vec3::Zero())
                                           : Vec3(integrals_.back() + 0.5 * step * (points_.back() + point)));
      arcs_.push_back(points_.empty() ? 0 : arcs_.back() + step);
      points_.push_back(point);
    }
    HAIRNET_ASSERT(integrals_.size() == points_.size());
    HAIRNET_ASSERT(points_.empty() == line.empty());
    HAIRNET_VALIDATE(std::ranges::adjacent_find(arcs_, std::greater_equal{}) == arcs_.end());
  }
  [[nodiscard]] double length() const { return arcs_.empty() ? 0 : arcs_.back(); }
  [[nodiscard]] std::size_t point_count() const { return points_.size(); }
  [[nodiscard]] const Vec3& point(std::size_t i) const { return points_[i]; }
  [[nodiscard]] double share(std::size_t i) const { return arcs_[i] / length(); }  // of the length, up to point i

  // The mean of the points from `begin` to `end`, both as shares of the length.
  [[nodiscard]] Vec3 mean(double begin, double end) const {
    HAIRNET_ASSERT(begin >= 0);
    HAIRNET_ASSERT(begin <= end);
    HAIRNET_ASSERT(end < 1.001);
    const Place from = place(begin * length()), to = place(end * length());
    const double arc = to.arc - from.arc;
    return arc > 1e-9 * length() ? Vec3((to.integral - from.integral) / arc) : from.point;
  }

 private:
  struct Place {
    double arc;
    Vec3 point, integral;
  };
  [[nodiscard]] Place place(double arc) const {
    HAIRNET_ASSERT(points_.size() >= 2);
    const auto after = std::upper_bound(arcs_.begin() + 1, arcs_.end() - 1, arc) - arcs_.begin();
    const auto i = static_cast<std::size_t>(after) - 1;
    const double step = arc - arcs_[i];
    const Vec3 point = points_[i] + step / (arcs_[i + 1] - arcs_[i]) * (points_[i + 1] - points_[i]);
    return {arc, point, integrals_[i] + 0.5 * step * (points_[i] + point)};
  }
  std::vector<Vec3> points_, integrals_;
  std::vector<double> arcs_;
};

// `reach`: half the length of the averaged piece about a point, as a share of the length. It is shorter near root and
// tip, which are not averaged.
template <std::size_t kCount>
std::array<Vec3f, kCount> sample(const ArcIntegral& line, double reach) {
  static_assert(kCount >= 2);
  HAIRNET_ASSERT(reach >= 0);
  HAIRNET_ASSERT(line.length() > 0);
  std::array<Vec3f, kCount> points;
  constexpr double kStep = 1.0 / (kCount - 1);
  for (std::size_t i = 0; i < kCount; ++i) {
    const double at = static_cast<double>(i) * kStep, own_reach = i + 1 < kCount ? std::min({reach, at, 1 - at}) : 0;
    points[i] = line.mean(at - own_reach, at + own_reach).template cast<float>();
  }
  return points;
}

// The variance of the line's points about its centreline, for each axis across it: half the mean square of their
// distances.
float variance_about(const std::array<Vec3f, kCentrelinePoints>& centreline, const ArcIntegral& line) {
  HAIRNET_ASSERT(line.point_count() >= 2);
  double sum = 0;
  for (std::size_t i = 0; i < line.point_count(); ++i) {
    const double at = line.share(i) * (kCentrelinePoints - 1);
    const std::size_t before = std::min(static_cast<std::size_t>(at), kCentrelinePoints - 2);
    const auto t = static_cast<float>(at - static_cast<double>(before));
    const Vec3f on_course = centreline[before] + t * (centreline[before + 1] - centreline[before]);
    sum += (line.point(i) - on_course.cast<double>()).squaredNorm();
  }
  return static_cast<float>(0.5 * sum / static_cast<double>(line.point_count()));
}

void append_centreline(std::span<const Vec3f> line, const StrandProperties& properties, float variance_m2,
                       std::vector<Centreline>& centrelines) {
  const ArcIntegral integral(line);
  if (integral.length() < kLengthMin) return;
  const auto points = sample<kCentrelinePoints>(integral, kCentrelineReach);
  centrelines.push_back({points, sample<kOutlinePoints>(integral, kOutlineReach),
                         variance_m2 + variance_about(points, integral), properties.root_length_m, properties.group,
                         properties.rooted});
}

// As if the hair filled the card evenly from edge to edge.
float variance_across(std::span<const Vec3f> edges) {
  HAIRNET_ASSERT(!edges.empty());
  HAIRNET_ASSERT(edges.size() % 2 == 0);
  float width_sum = 0;
  for (std::size_t i = 0; i + 1 < edges.size(); i += 2) width_sum += (edges[i + 1] - edges[i]).norm();
  const float width = 2 * width_sum / static_cast<float>(edges.size());
  return width * width / 12;
}

}  // namespace

std::vector<Centreline> make_centrelines(const Groom& groom) {
  HAIRNET_ASSERT(groom.strand_begin.size() == groom.strand_count() + 1);
  std::vector<float> lock_variance(groom.strand_count(), 0.0f);
  for (const Clump& clump : groom.clumps) {
    HAIRNET_ASSERT(clump.strand < groom.strand_count());
    const float radius = 0.5f * (clump.radius_m + clump.tip_radius_m);
    lock_variance[clump.strand] = 0.25f * radius * radius;  // of an even disc
  }
  std::vector<Centreline> centrelines;
  centrelines.reserve(groom.strand_count() + groom.cards.size());
  for (std::size_t s = 0; s < groom.strand_count(); ++s)
    append_centreline(groom.strand_points(s), groom.strands[s], lock_variance[s], centrelines);
  std::vector<Vec3f> middle;
  for (const HairCard& card : groom.cards) {
    middle_of(groom, card, middle);
    append_centreline(middle, card.properties, variance_across(groom.points_of(card.points)), centrelines);
  }
  HAIRNET_ASSERT(centrelines.size() <= groom.strand_count() + groom.cards.size());
  return centrelines;
}

float outline_length(const std::array<Vec3f, kOutlinePoints>& outline) {
  float length = 0;
  for (std::size_t i = 1; i < outline.size(); ++i) length += (outline[i] - outline[i - 1]).norm();
  return length;
}

std::array<Vec3f, kOutlinePoints> make_outline(const std::array<Vec3f, kCentrelinePoints>& line) {
  const ArcIntegral integral(line);
  if (integral.length() < kLengthMin) {
    std::array<Vec3f, kOutlinePoints> outline;
    outline.fill(line[0]);
    return outline;
  }
  return sample<kOutlinePoints>(integral, kOutlineReach);
}

}  // namespace hairnet
