#include "core/ffd/clump_strands.hpp"

#include <algorithm>
#include <cmath>
#include <numbers>

#include "core/assert.hpp"

namespace hairnet {
namespace {

// The unit vector nearest to `wanted` that is normal to the strand. Where `wanted` is parallel to the strand, it is any
// normal.
Vec3f across(const Vec3f& direction, const Vec3f& wanted) {
  const Vec3f flat = wanted - wanted.dot(direction) * direction;
  return flat.squaredNorm() > 1e-8f ? Vec3f(flat.normalized()) : direction.unitOrthogonal();
}

// The clump's radius at the share s of the strand's length. Roots lie closer together, the full radius is reached after
// an eighth of the length, and the tips gather.
float radius_at(float s, float radius_m, float tip_radius_m) {
  // At the root the radius is 0.4 of the full one; 4.8 is (1 - 0.4) over an eighth.
  const float opening = std::min(1.0f, 0.4f + 4.8f * s);
  return opening * std::lerp(radius_m, tip_radius_m, s);
}

}  // namespace

ClumpStrands::ClumpStrands(const Groom& groom)
    : own_point_count_(groom.strand_begin.back()), strand_begin_(groom.strand_begin) {
  constexpr float kGoldenAngle = std::numbers::pi_v<float> * (3 - 2.2360679775f);
  for (const Clump& clump : groom.clumps) {
    HAIRNET_ASSERT(clump.strand < groom.strand_count());
    const std::uint32_t begin = groom.strand_begin[clump.strand], end = groom.strand_begin[clump.strand + 1];
    for (std::uint32_t c = 0; c < clump.copy_count; ++c) {
      // A sunflower pattern fills the disc evenly. Each strand starts at another angle, so that neighbouring clumps do
      // not look alike.
      const float ring = std::sqrt((static_cast<float>(c) + 0.7f) / static_cast<float>(clump.copy_count));
      // The modulo keeps the angle small, so that it has digits enough as a float.
      const float angle = kGoldenAngle * static_cast<float>(c + 7 * (clump.strand % 1024));
      copies_.push_back({begin, end, std::fmod(angle, 2 * std::numbers::pi_v<float>), std::min(ring, 1.0f),
                         clump.radius_m, clump.tip_radius_m});
      strand_begin_.push_back(strand_begin_.back() + (end - begin));
    }
  }
  HAIRNET_ASSERT(strand_begin_.size() == groom.strand_begin.size() + copies_.size());
}

void ClumpStrands::follow(std::span<const Vec3f> points, std::span<Vec3f> points_out) const {
  HAIRNET_ASSERT(points.size() >= own_point_count_);
  HAIRNET_ASSERT(points_out.size() == point_count());
  std::copy_n(points.begin(), own_point_count_, points_out.begin());
  std::size_t out = own_point_count_;
  for (const Copy& copy : copies_) {
    // The frame starts from a fixed direction of the head, so that it turns only with the head.
    Vec3f side = Vec3f::UnitZ();
    const auto last = static_cast<float>(copy.end - copy.begin) - 1;
    for (std::uint32_t i = copy.begin; i < copy.end; ++i) {
      const std::uint32_t before = i > copy.begin ? i - 1 : i, after = i + 1 < copy.end ? i + 1 : i;
      const Vec3f chord = points[after] - points[before];
      const Vec3f direction = chord.squaredNorm() > 1e-16f ? Vec3f(chord.normalized()) : Vec3f(-Vec3f::UnitY());
      // Each frame is the one before, turned the least: the copies follow the strand without twisting around it.
      side = across(direction, side);
      const Vec3f other = direction.cross(side);
      const float s = last > 0 ? static_cast<float>(i - copy.begin) / last : 0;
      const float offset = copy.ring * radius_at(s, copy.radius_m, copy.tip_radius_m);
      points_out[out++] = points[i] + offset * (std::cos(copy.angle) * side + std::sin(copy.angle) * other);
    }
  }
  HAIRNET_ASSERT(out == points_out.size());
}

}  // namespace hairnet
