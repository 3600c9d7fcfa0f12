#include "client/draw/scalp.hpp"

#include <algorithm>
#include <cmath>

#include "core/smoothstep.hpp"

namespace hairnet::draw {
namespace {

// Wider than a parting: with a smaller reach, skin shows between two rows of roots.
constexpr float kReachMin_m = 0.014f;
// The area where hair usually grows.
constexpr float kSkull_m2 = 0.06f;
// The reach is this many times the spacing of the roots: grooms of few strands need a wider reach to look closed.
constexpr float kSpacings = 1.5f;
// The median density is taken over this many roots, whatever the number of strands, which bounds the cost.
constexpr std::size_t kSamples = 256;
// The root of a card counts as this many roots across its width, since a card stands for a row of hairs.
constexpr int kCardRoots = 4;
// Shares of the usual density: bare skin below the first, full scalp above the second. At a straight hairline the
// density is half.
constexpr float kBare = 0.08f, kFull = 0.4f;

std::vector<Vec3f> roots_of(const Groom& groom) {
  std::vector<Vec3f> roots;
  for (std::size_t s = 0; s < groom.strand_count(); ++s) {
    const std::span<const Vec3f> strand = groom.strand_points(s);
    if (!strand.empty() && groom.strands[s].rooted) roots.push_back(strand.front());
  }
  for (const HairCard& card : groom.cards) {
    const std::span<const Vec3f> points = groom.points_of(card.points);
    if (points.size() < 2 || !card.properties.rooted) continue;
    for (int i = 0; i < kCardRoots; ++i)
      roots.push_back(points[0] + static_cast<float>(i) / (kCardRoots - 1) * (points[1] - points[0]));
  }
  // density() searches by x.
  std::ranges::sort(roots, {}, [](const Vec3f& root) { return root.x(); });
  return roots;
}

}  // namespace

Scalp::Scalp(const Groom& groom) : roots_(roots_of(groom)) {
  if (roots_.empty()) return;
  reach_m_ = std::max(kReachMin_m, kSpacings * std::sqrt(kSkull_m2 / static_cast<float>(roots_.size())));
  std::vector<float> densities;
  const std::size_t stride = (roots_.size() + kSamples - 1) / kSamples;
  for (std::size_t r = 0; r < roots_.size(); r += stride) densities.push_back(density(roots_[r]));
  // The median: a mean would follow the few densest rows.
  const auto middle = densities.begin() + static_cast<std::ptrdiff_t>(densities.size() / 2);
  std::ranges::nth_element(densities, middle);
  usual_ = *middle;
}

float Scalp::density(const Vec3f& position) const {
  const float squared = reach_m_ * reach_m_;
  float sum = 0;
  const auto x = [](const Vec3f& root) { return root.x(); };
  for (auto root = std::ranges::lower_bound(roots_, position.x() - reach_m_, {}, x);
       root != roots_.end() && root->x() <= position.x() + reach_m_; ++root) {
    // A smooth weight, so that the scalp's edge does not show single roots.
    const float within = std::max(1 - (*root - position).squaredNorm() / squared, 0.0f);
    sum += within * within;
  }
  return sum;
}

float Scalp::at(const Vec3f& position) const {
  return smoothstep(kBare, kFull, density(position) / usual_);
}

}  // namespace hairnet::draw
