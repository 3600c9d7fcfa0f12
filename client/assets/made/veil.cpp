#include "client/assets/made/veil.hpp"

#include <cmath>
#include <numbers>

#include "client/assets/made/bust_shape.hpp"
#include "client/assets/made/easing.hpp"
#include "client/assets/made/ribbon.hpp"

namespace hairnet::made {
namespace {

// The grid must be fine enough for the folds, of which there are some nine across.
constexpr int kColumns = 33, kRows = 30;
// The distance of the veil from the skin, m: the thickness of the hair under it.
constexpr double kHairThickness = 0.030;
// The distance of the comb from the skin, m.
constexpr double kCombHeight = 0.021;
// Half the angle of the comb's arc over the head, rad.
constexpr double kCombHalf_rad = 0.80;

// One warp thread of the veil: from the comb back over the hair, then down, in folds that open towards the hem.
// `across` is its place on the comb, -1 to 1. Numbers without a name were chosen by eye.
Path column_path(double across, double length_m) {
  const double angle = kCombHalf_rad * across;
  // The slant puts the comb a little behind the top of the head.
  const Vec3 skin = skin_along(Vec3(std::sin(angle), std::cos(angle), -0.22).normalized());
  // This is 1 on the outside of a fold and -1 on its inside, for 9.5 folds across.
  const double fold = std::cos(9.5 * std::numbers::pi * across);
  Growth growth;
  growth.start = skin + kCombHeight * bust_normal(skin);
  growth.direction = Vec3(0.55 * std::sin(angle), 0.15, -1);
  growth.length_m = length_m;
  growth.bend_m = 0.03;
  growth.step_m = 0.004;
  growth.spares_face = false;
  // The preferred direction is down, and back as long as the cloth lies on the head. It leans outwards a little, more
  // so near the comb.
  growth.preferred_direction = [=](const GrowthPoint& at) {
    const double back = 1.1 * std::exp(-at.s / 0.09);
    return Vec3(0.10 * across + 0.12 * std::sin(angle) * std::exp(-at.s / 0.2), -1, -back - 0.06);
  };
  // The folds open with the distance from the comb: cloth on the outside of a fold is farther from the head.
  growth.clearance = [=](const Vec3&, double s) {
    return mix(kCombHeight, kHairThickness, smootherstep(0, 0.08, s)) +
           0.007 * (1 + fold) * smootherstep(0.03, 0.25, s);
  };
  return grow(growth);
}

}  // namespace

void add_veil(double length_m, Groom& groom) {
  std::vector<Path> paths;
  for (int c = 0; c < kColumns; ++c) paths.push_back(column_path(2 * c / (kColumns - 1.0) - 1, length_m));
  // The samplers refer to the paths, whose list does not change any more.
  std::vector<ArcSampler> columns;
  columns.reserve(paths.size());
  for (const Path& path : paths) columns.emplace_back(path);
  const auto along = [](const ArcSampler& column, int row) { return column.length() * row / (kRows - 1.0); };
  Cloth veil;
  veil.group = group_index(groom, "veil");
  veil.colour = Vec3f(0.88f, 0.88f, 0.90f);
  veil.opacity = 0.38f;
  veil.root_length_m = 0.05f;
  veil.area_density_kg_per_m2 = 0.02f;
  for (int row = 0; row < kRows; ++row) {
    // Their distance from the comb makes points near it follow the skull (paper eq. 7).
    for (const ArcSampler& column : columns) veil.root_distance_m.push_back(static_cast<float>(along(column, row)));
  }
  const auto at = [&](int column, int row) { return columns[column].at(along(columns[column], row)); };
  add_cloth_grid(groom, {kColumns, kRows, false, at}, 0.006, std::move(veil));
}

}  // namespace hairnet::made
