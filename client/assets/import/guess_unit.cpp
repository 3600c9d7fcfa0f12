#include "client/assets/import/guess_unit.hpp"

#include <algorithm>
#include <utility>
#include <vector>

#include "core/geometry/symmetric_matrix.hpp"

namespace hairnet {
namespace {

// The length from the forehead to the nape, of a scalp and of a part of one. Parts of a scalp, such as a ponytail's,
// are usually shorter than the whole.
constexpr double kScalp_m = 0.175, kPart_m = 0.16;
// A length may differ from its usual one by this much in its logarithm, factors of about 1.3 and 2.5, as heads and
// hairstyles differ. A whole scalp lies between two usual units only rarely, while a part may be any smaller piece.
constexpr double kScalpSlack = 0.24;
constexpr double kPartSlack = 0.9;
// Roots of a whole scalp have a SkullFit::conditioning above this.
constexpr double kSureConditioning = 0.025;

// The distance within which half of the roots lie from the skull, in its radii.
double misfit_of(const SkullFit& skull, std::span<const Vec3> roots) {
  std::vector<double> off;
  for (const Vec3& x : roots) off.push_back(std::abs(skull.distance(x)) / skull.radius());
  const auto middle = off.begin() + static_cast<std::ptrdiff_t>(off.size() / 2);
  std::ranges::nth_element(off, middle);
  return *middle;
}

}  // namespace

// The covariance's largest axis is the direction. Two percent at each end are cut, so that a few strays do not count.
double longest_extent(std::span<const Vec3> points) {
  Vec3 mean = Vec3::Zero();
  for (const Vec3& x : points) mean += x / static_cast<double>(points.size());
  Mat3 covariance = Mat3::Zero();
  for (const Vec3& x : points) covariance += (x - mean) * (x - mean).transpose();
  const Vec3 axis = symmetric_eigen(covariance).vectors.col(2);
  std::vector<double> along;
  for (const Vec3& x : points) along.push_back(axis.dot(x));
  std::ranges::sort(along);
  const std::size_t cut = along.size() / 50;
  return along[along.size() - 1 - cut] - along[cut];
}

// The usual radius is not known before the unit is. It is about half as large as the extent of the roots, or smaller if
// some of them are elsewhere, like a mane's.
ScalpFit fit_scalp(std::span<const Vec3> roots) {
  const double extent = longest_extent(roots);
  ScalpFit best{fit_skull_shape(roots, extent / 2)};
  best.misfit = misfit_of(best.skull, roots);
  // A smaller skull must fit twice as well to replace a larger one, because small spheres fit any part of a surface.
  for (const double share : {0.6, 0.4, 0.25}) {
    ScalpFit smaller{fit_skull_shape(roots, share * extent / 2)};
    smaller.misfit = misfit_of(smaller.skull, roots);
    if (smaller.misfit >= 0.5 * best.misfit || !smaller.skull.is_determined()) continue;
    best = std::move(smaller);
  }
  return best;
}

UnitGuess guess_unit(std::span<const Vec3> roots) {
  if (roots.empty()) return {};
  const double all = longest_extent(roots);
  if (!(all > 0 && std::isfinite(all))) return {};
  const SkullFit skull = fit_scalp(roots).skull;
  // Only a whole scalp has a size of its own. For less, only a usual unit can be trusted.
  const bool is_sure = skull.conditioning > kSureConditioning;
  const double extent = is_sure ? longest_extent(skull.inliers) : all;
  const double usual_m = is_sure ? kScalp_m : kPart_m, slack = is_sure ? kScalpSlack : kPartSlack;
  // Without a usual unit that fits, the unit is the one in which the roots have exactly the usual extent.
  const double exact_m = usual_m / extent;
  UnitGuess guess{exact_m, false, exact_m, is_sure};
  double best = slack + 1;
  for (const UsualUnit& unit : kUsualUnits) {
    const double off = std::abs(std::log(extent * unit.m / usual_m));
    // A rare unit must fit better than a common one by its rarity.
    if (!(off < slack && off + unit.rarity < best)) continue;
    guess.m = unit.m;
    guess.is_usual = true;
    best = off + unit.rarity;
  }
  return guess;
}

}  // namespace hairnet
