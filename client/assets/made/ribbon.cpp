#include "client/assets/made/ribbon.hpp"

#include <cmath>
#include <numbers>

#include "client/assets/made/bust_shape.hpp"
#include "client/assets/made/easing.hpp"

namespace hairnet::made {
namespace {

// The width of the ribbon, the length of a loop and the length of an end, m.
constexpr double kRibbonWidth = 0.020, kLoopLength = 0.052, kEndLength = 0.14;
// The ends stay this far from the skin, m, since they lie on hair.
constexpr double kEndClearance = 0.013;

Cloth satin(Groom& groom, const Vec3f& colour) {
  Cloth cloth;
  cloth.group = group_index(groom, "ribbon");
  cloth.colour = colour;
  cloth.stretch_stiffness_n_per_m = 60;
  cloth.shear_stiffness_n_per_m = 12;
  cloth.area_density_kg_per_m2 = 0.09f;
  return cloth;
}

}  // namespace

// Two triangles join each four points, always along the same diagonal. A ring wraps its last column to the first.
std::uint32_t add_cloth_grid(Groom& groom, const ClothGrid& grid, double clearance_m, Cloth cloth) {
  std::vector<Vec3f> vertices;
  for (int row = 0; row < grid.rows; ++row) {
    // Pushing each point out keeps the cloth off the skin, but a large cell may still touch between its points.
    for (int column = 0; column < grid.columns; ++column)
      vertices.push_back(push_out(grid.at(column, row), clearance_m).cast<float>());
  }
  const auto index = [&](int column, int row) {
    return static_cast<std::uint32_t>(row * grid.columns + column % grid.columns);
  };
  for (int row = 0; row + 1 < grid.rows; ++row) {
    for (int column = 0; column + (grid.ring ? 0 : 1) < grid.columns; ++column) {
      const std::uint32_t a = index(column, row), b = index(column + 1, row);
      const std::uint32_t c = index(column, row + 1), d = index(column + 1, row + 1);
      cloth.triangles.push_back({a, c, b});
      cloth.triangles.push_back({b, c, d});
    }
  }
  groom.add_cloth(vertices, std::move(cloth));
  return groom.cloths.back().points.begin;
}

// `out` must not point straight up or down, because the bow's upper side is found from +Y.
std::vector<std::uint32_t> add_bow(Groom& groom, const Vec3& centre, const Vec3& out, const Vec3f& colour) {
  const Vec3 up = (Vec3::UnitY() - out.y() * out).normalized(), right = up.cross(out);
  std::vector<std::uint32_t> tied;
  // Both halves are mirrored, except for the lengths of the ends.
  for (const double side : {-1.0, 1.0}) {
    // A petal in the plane across `out`, with the ribbon's width along `out`; its far end stands off a little.
    constexpr int kAlong = 15;
    const auto loop = [&](int column, int row) {
      // `open` is 0 at the knot, where the loop begins and ends, and 1 at its far end.
      const double t = row / (kAlong - 1.0), open = std::sin(std::numbers::pi * t);
      const double angle = 0.62 * (t - 0.5) * 2 * open + 0.14;
      const double width = kRibbonWidth * mix(0.45, 1, open) * (column - 1) * 0.5;
      const Vec3 petal = std::cos(angle) * side * right + std::sin(angle) * up;
      return Vec3(centre + kLoopLength * open * petal + (0.006 * open + width) * out);
    };
    const std::uint32_t first = add_cloth_grid(groom, {3, kAlong, false, loop}, 0.003, satin(groom, colour));
    for (const int row : {0, kAlong - 1}) tied.push_back(first + static_cast<std::uint32_t>(3 * row + 1));

    constexpr int kDown = 13;
    const auto end = [&](int column, int row) {
      // One end is shorter, as in a bow that is tied by hand.
      const double s = kEndLength * row / (kDown - 1.0) * (side > 0 ? 1 : 0.86);
      const double width = kRibbonWidth * mix(0.5, 1, smootherstep(0, 0.03, s)) * (column - 1) * 0.5;
      const Vec3 line = centre + side * (0.036 * (1 - std::exp(-s / 0.025)) + 0.06 * s) * right +
                        (0.012 * (1 - std::exp(-s / 0.02)) + 0.003 * std::sin(s / 0.018)) * out;
      return Vec3(line - Vec3(0, s, 0) + width * right);
    };
    const std::uint32_t top = add_cloth_grid(groom, {3, kDown, false, end}, kEndClearance, satin(groom, colour));
    tied.push_back(top + 1);
  }
  // The wound piece in the middle, which hides the joints of the others.
  constexpr int kRound = 12;
  const auto middle = [&](int column, int row) {
    const double angle = 2 * std::numbers::pi * column / kRound;
    return Vec3(centre + (row - 1) * 0.007 * up + 0.006 * std::cos(angle) * right +
                (0.002 + 0.011 * std::sin(angle)) * out);
  };
  const std::uint32_t first = add_cloth_grid(groom, {kRound, 3, true, middle}, 0.002, satin(groom, colour));
  // Every fourth point ties the piece.
  for (std::uint32_t i = 0; i < 3 * kRound; i += 4) tied.push_back(first + i);
  return tied;
}

}  // namespace hairnet::made
