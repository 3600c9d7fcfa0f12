#include "client/view/strand_ribbons.hpp"

#include <algorithm>
#include <cmath>

#include "client/view/drawable.hpp"

namespace hairnet::view {
namespace {

constexpr float kPointsWanted = 40;  // a strand, after smoothing
constexpr int kPiecesMax = 3;        // a segment is cut into
constexpr std::size_t kSlabs = 64, kBinsPerSlab = 64;

std::uint8_t to_byte(float x) {
  return static_cast<std::uint8_t>(std::lround(255.0f * std::clamp(x, 0.0f, 1.0f)));
}

std::array<std::int8_t, 4> to_bytes(const Vec3f& direction) {
  const auto one = [](float x) { return static_cast<std::int8_t>(std::lround(127.0f * std::clamp(x, -1.0f, 1.0f))); };
  return {one(direction.x()), one(direction.y()), one(direction.z()), 0};
}

int pieces_per_segment(const DrawnCharacter& character) {
  const std::size_t strands = character.strand_begin.size() - 1;
  if (strands == 0 || character.strand_points.size() <= strands) return 1;
  const float segments = static_cast<float>(character.strand_points.size() - strands) / static_cast<float>(strands);
  return std::clamp(static_cast<int>(std::lround(kPointsWanted / segments)), 1, kPiecesMax);
}

// Catmull-Rom through the points; the ends' missing neighbours are mirrored.
class Spline {
 public:
  explicit Spline(const std::vector<Vec3f>& points) : points_(points) {}

  [[nodiscard]] Vec3f position(std::size_t i, float t) const {
    const auto [a, b, c, d] = around(i);
    return 0.5f * (2 * b + t * (c - a) + t * t * (2 * a - 5 * b + 4 * c - d) + t * t * t * (3 * (b - c) + d - a));
  }
  [[nodiscard]] Vec3f tangent(std::size_t i, float t) const {
    const auto [a, b, c, d] = around(i);
    const Vec3f v = (c - a) + 2 * t * (2 * a - 5 * b + 4 * c - d) + 3 * t * t * (3 * (b - c) + d - a);
    if (v.squaredNorm() > 1e-16f) return v.normalized();
    return (c - b).squaredNorm() > 1e-16f ? Vec3f((c - b).normalized()) : Vec3f(Vec3f::UnitY());
  }

 private:
  [[nodiscard]] std::array<Vec3f, 4> around(std::size_t i) const {
    const Vec3f &b = points_[i], &c = points_[i + 1];
    return {i > 0 ? points_[i - 1] : Vec3f(2 * b - c), b, c,
            i + 2 < points_.size() ? points_[i + 2] : Vec3f(2 * c - b)};
  }
  const std::vector<Vec3f>& points_;
};

std::vector<float> fractions_of_length(const std::vector<Vec3f>& points) {
  std::vector<float> length(points.size(), 0.0f);
  for (std::size_t i = 1; i < points.size(); ++i) length[i] = length[i - 1] + (points[i] - points[i - 1]).norm();
  const float whole = std::max(length.back(), 1e-9f);
  for (float& l : length) l /= whole;
  return length;
}

void add_vertex(StrandRibbons& ribbons, const Vec3f& p, const Vec3f& tangent, float fraction,
                const LightVolume::Left& left, std::uint32_t strand, bool first) {
  const auto at = static_cast<std::uint32_t>(ribbons.vertices.size());
  if (!first) ribbons.lines.insert(ribbons.lines.end(), {at - 2, at});
  const RibbonVertex vertex{{p.x(), p.y(), p.z()},
                            to_bytes(tangent),
                            {to_byte(fraction), to_byte(left.ambient), to_byte(left.fill), to_byte(left.rim)},
                            strand};
  ribbons.vertices.insert(ribbons.vertices.end(), 2, vertex);
  ribbons.box.extend(p);
}

LightVolume::Left between(const LightVolume::Left& a, const LightVolume::Left& b, float t) {
  return {std::lerp(a.ambient, b.ambient, t), std::lerp(a.fill, b.fill, t), std::lerp(a.rim, b.rim, t), 0};
}

}  // namespace

StrandRibbons make_ribbons(const DrawnCharacter& character, const LightVolume& light) {
  StrandRibbons ribbons;
  if (character.strand_begin.size() < 2) return ribbons;
  const int pieces = pieces_per_segment(character);
  ribbons.vertices.reserve(2 * static_cast<std::size_t>(pieces) * character.strand_points.size());
  ribbons.lines.reserve(ribbons.vertices.capacity());
  std::vector<Vec3f> points;
  for (std::size_t s = 0; s + 1 < character.strand_begin.size(); ++s) {
    points.clear();
    for (std::uint32_t i = character.strand_begin[s]; i < character.strand_begin[s + 1]; ++i) {
      if (drawable(character.strand_points[i])) points.push_back(character.strand_points[i]);
    }
    if (points.size() < 2) continue;
    const Spline spline(points);
    const std::vector<float> fraction = fractions_of_length(points);
    const auto strand = static_cast<std::uint32_t>(s);
    LightVolume::Left here = light.at(points[0]);
    add_vertex(ribbons, points[0], spline.tangent(0, 0), 0, here, strand, true);
    for (std::size_t i = 0; i + 1 < points.size(); ++i) {
      const LightVolume::Left next = light.at(points[i + 1]);
      for (int piece = 1; piece <= pieces; ++piece) {
        const float t = static_cast<float>(piece) / static_cast<float>(pieces);
        add_vertex(ribbons, spline.position(i, t), spline.tangent(i, t), std::lerp(fraction[i], fraction[i + 1], t),
                   between(here, next, t), strand, false);
      }
      here = next;
    }
  }
  return ribbons;
}

// Counting sort by depth into bins; quads of one bin keep their order.
void sort_far_to_near(StrandRibbons& ribbons, const Camera& camera) {
  const std::size_t quads = ribbons.lines.size() / 2;
  const Vec3f forward = (camera.target - camera.eye).normalized();
  std::vector<float> depth(quads);
  float nearest = INFINITY, furthest = -INFINITY;
  for (std::size_t q = 0; q < quads; ++q) {
    const auto& a = ribbons.vertices[ribbons.lines[2 * q]].position;
    const auto& b = ribbons.vertices[ribbons.lines[2 * q + 1]].position;
    depth[q] = 0.5f * forward.dot(Vec3f(a[0] + b[0], a[1] + b[1], a[2] + b[2]));
    nearest = std::min(nearest, depth[q]);
    furthest = std::max(furthest, depth[q]);
  }
  constexpr std::size_t kBins = kSlabs * kBinsPerSlab;
  const float scale = static_cast<float>(kBins) / std::max(furthest - nearest, 1e-6f);
  const auto bin_of = [&](float d) { return std::min(static_cast<std::size_t>((furthest - d) * scale), kBins - 1); };
  std::vector<std::uint32_t> begin(kBins + 1, 0);
  for (const float d : depth) ++begin[bin_of(d) + 1];
  for (std::size_t i = 0; i < kBins; ++i) begin[i + 1] += begin[i];

  ribbons.slabs.resize(kSlabs + 1);
  for (std::size_t i = 0; i <= kSlabs; ++i) ribbons.slabs[i] = 6 * begin[i * kBinsPerSlab];
  ribbons.triangles.resize(6 * quads);
  for (std::size_t q = 0; q < quads; ++q) {
    const std::uint32_t a = ribbons.lines[2 * q], b = ribbons.lines[2 * q + 1];
    std::uint32_t* out = &ribbons.triangles[6 * static_cast<std::size_t>(begin[bin_of(depth[q])]++)];
    for (const std::uint32_t corner : {a, a + 1, b, b, a + 1, b + 1}) *out++ = corner;
  }
}

}  // namespace hairnet::view
