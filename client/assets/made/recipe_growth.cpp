#include "client/assets/made/recipe_growth.hpp"

#include <algorithm>
#include <cmath>
#include <numbers>

#include "client/assets/made/easing.hpp"

namespace hairnet::made {
namespace {

// Hair goes to the chest or to the back before it meets a shoulder, and stays together. Hair for the chest is led in
// front of z = 5 cm, other hair behind z = -8.5 cm, and all of it within 9 cm of the middle. For each centimetre
// beyond, the pull grows by 0.14 of gravity's, which is 1, up to a limit: so gravity still leads the hair down. The
// pull begins 4 cm above the head joint, and is whole 12 cm below it.
Vec3 parted_by_shoulders(const LooseRecipe& recipe, const Root& root, const Vec3& p) {
  const double beside = 1 - smootherstep(-0.12, 0.04, p.y());
  if (beside <= 0) {
    return Vec3::Zero();
  }
  const bool to_chest = falls_to_chest(recipe, root);
  const double ahead =
      to_chest ? std::clamp(14 * (0.050 - p.z()), 0.0, 0.8) : std::clamp(14 * (-0.085 - p.z()), -0.7, 0.0);
  const double outside = std::clamp(14 * (std::abs(p.x()) - 0.090), 0.0, 0.9);
  return beside * Vec3(p.x() > 0 ? -outside : outside, 0, ahead);
}

Vec3 along_skin(const Vec3& v, const Vec3& normal) {
  return v - v.dot(normal) * normal;
}

// The preferred direction is a sum: gravity, the comb near the root, the shoulders, the tuck at the tip, and the
// strand's own deviation.
Vec3 direction_of(const LooseRecipe& recipe, const Root& root, const StrandVariation& variation,
                  const GrowthPoint& at) {
  const double reach = at.s / recipe.comb_reach_m;
  // The comb holds only near the skin and near the root, as a hairdresser's does.
  const double held = at.nearness * std::exp(-reach * reach);
  Vec3 sum(0, -mix(1, recipe.fall, held), 0);
  if (held > 0.01) {
    sum += held * along_skin(recipe.comb(at.p, root), at.normal);
  }
  sum += parted_by_shoulders(recipe, root, at.p);
  // The last 7.5 cm turn to the middle of the neck, which is 2 cm behind the head joint.
  if (recipe.tuck > 0) {
    const double tip = smootherstep(variation.length_m - 0.075, variation.length_m, at.s);
    sum += recipe.tuck * tip * (Vec3(0, at.p.y(), -0.02) - at.p).normalized();
  }
  return sum + variation.stray * (1 - 0.5 * held);
}

// A fringe is combed ahead and down instead of away from the parting.
Vec3 fringe_direction(const LooseRecipe& recipe, const Root& root, const StrandVariation& variation,
                      const GrowthPoint& at) {
  const double held = at.nearness * std::exp(-at.s / 0.05);
  const Vec3 ahead = recipe.comb(at.p, root) * 0.5 + Vec3(recipe.fringe.sweep, 0, 0.5);
  return held * along_skin(ahead, at.normal) + Vec3(0.25 * recipe.fringe.sweep, -1, 0) + variation.stray;
}

// How far the root is from the middle of the fringe: 0 in the middle, 1 at its ends, more outside.
double fringe_edge(const Fringe& fringe, const Root& root) {
  return degrees_from_front(root) / std::max(fringe.half_angle_deg, 1e-6);
}

}  // namespace

double degrees_from_front(const Root& root) {
  return std::abs(root.azimuth) * 180 / std::numbers::pi;
}

bool falls_to_chest(const LooseRecipe& recipe, const Root& root) {
  return degrees_from_front(root) < recipe.front_deg;
}

bool in_fringe(const LooseRecipe& recipe, const Root& root) {
  const Fringe& fringe = recipe.fringe;
  const double share = fringe_edge(fringe, root);
  if (share >= 1) {
    return false;
  }
  // A swept fringe comes from its own side of the parting.
  if (fringe.sweep * recipe.comb(root.point, root).x() < 0) {
    return false;
  }
  return above_hairline(root.point) < fringe.depth_m * (1 - fringe.wedge * share * share);
}

Growth growth_of(const LooseRecipe& recipe, const Root& root, const StrandVariation& variation) {
  Growth growth;
  growth.start = root.point;
  growth.length_m = variation.length_m;
  // Short strands need finer steps to follow the scalp, and long ones do not need more than 5 mm.
  growth.step_m = std::clamp(variation.length_m / 24, 0.0015, 0.005);
  // A fringe bends more sharply, since it must turn down within a few centimetres.
  growth.bend_m = variation.fringe ? 0.6 * recipe.bend_m : recipe.bend_m;
  growth.spares_face = !variation.fringe;
  growth.preferred_direction = [&recipe, root, variation](const GrowthPoint& at) {
    return variation.fringe ? fringe_direction(recipe, root, variation, at) : direction_of(recipe, root, variation, at);
  };
  // The first direction is the preferred one along the skin, raised by the normal.
  const Vec3 flat = along_skin(growth.preferred_direction({root.point, 0, root.normal, 1}), root.normal).normalized();
  growth.direction = recipe.rise * root.normal + flat + variation.stray;

  // Strands with higher roots lie farther out, because they must pass over the others.
  const double height = mix(0.15, 1, smootherstep(-0.1, 0.95, root.height));
  const double edge = fringe_edge(recipe.fringe, root);
  // A fringe lies flatter in its middle; at its ends it is like the other hair.
  const double flatter = variation.fringe ? mix(0.6, 1, edge * edge) : 1;
  const double on_head = flatter * recipe.lift_m * height * mix(0.35, 1, variation.layer);
  const double on_body = 0.003 + 0.55 * recipe.lift_m * variation.layer;
  // The clearance cannot grow faster than 0.8 of the arc length. On the body the hair is thinner than on the head, and
  // the border is about the chin.
  growth.clearance = [rise_m = recipe.lift_rise_m, on_head, on_body](const Vec3& p, double s) {
    const double rising = 1 - std::exp(-s / rise_m);
    return std::min(0.8 * s, rising * mix(on_body, on_head, smootherstep(-0.10, -0.01, p.y())));
  };
  if (variation.fringe) {
    // A straight fringe is rounded at its ends, where it is up to 22 mm longer.
    const double longer = recipe.fringe.sweep == 0 ? 0.022 * edge * edge * edge * edge : 0;
    const double tip_m = recipe.fringe.tip_height_m - longer + 0.006 * (variation.layer - 0.5);
    growth.done = [tip_m](const Vec3& p, double) { return p.y() < tip_m; };
  }
  return growth;
}

Vec3 comb_from_parting(const Vec3& p, const Root& root, double x, double front_z, double back_z) {
  // Level on the top of the head, downwards at the sides and the nape.
  Vec3 away(p.x() - x, std::min(0.0, p.y() - 0.09), p.z() - std::clamp(p.z(), back_z, front_z));
  // On the parting itself the root decides the side.
  const double side = root.point.x() < x ? -1 : 1;
  if (p.z() > back_z) {
    away.x() = side * std::max(side * away.x(), 0.012);
  }
  return away.normalized();
}

Vec3 comb_from_whorl(const Vec3& p, double x, double z) {
  return Vec3(p.x() - x, std::min(0.0, p.y() - 0.09), p.z() - z).normalized();
}

}  // namespace hairnet::made
