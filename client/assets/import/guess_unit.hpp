#pragma once

#include <array>
#include <cmath>
#include <span>

#include "client/assets/import/skull_fit.hpp"
#include "core/geometry/vec.hpp"

namespace hairnet {

struct UsualUnit {
  // The length of the unit, m.
  double m;
  // A penalty for an unusual unit, which is added to the logarithm of the misfit in size.
  double rarity;
};
// Metre, centimetre, millimetre, inch, decimetre, foot, a tenth of an inch, 3 mm.
inline constexpr std::array<UsualUnit, 8> kUsualUnits{
    {{1, 0}, {0.01, 0}, {0.001, 0}, {0.0254, 0.5}, {0.1, 0.8}, {0.3048, 0.8}, {0.00254, 0.8}, {0.003, 0.8}}};

// The skull under roots in an unknown unit, and the distance from it within which half of them lie, in its radii.
// Centre and axes are in the file's unit.
struct ScalpFit {
  SkullFit skull;
  double misfit = 0;
};
ScalpFit fit_scalp(std::span<const Vec3> roots);

// The extent of points in their longest direction, without a few that may lie anywhere. At least one point is
// necessary.
double longest_extent(std::span<const Vec3> points);

struct UnitGuess {
  // The length of a unit of the file, m.
  double m = 1;
  // The unit is one of kUsualUnits.
  bool is_usual = false;
  // The unit in which the roots have exactly the usual extent, m.
  double exact_m = 1;
  // The roots cover enough of a head to determine its size; else a usual unit is the best guess.
  bool is_sure = false;

  // Whether a unit of that many metres also gives the size of a head. The limits are logarithms, factors of 1.5 for a
  // sure size and 2.5 otherwise. The one for a sure size is wider than that of the guess: a unit that the user gives is
  // believed unless it is absurd.
  [[nodiscard]] bool allows(double unit_m) const {
    return std::abs(std::log(unit_m / exact_m)) < (is_sure ? 0.4 : 0.9);
  }
};

// Guesses the length unit from the size of the area that the roots cover; a common unit (m, cm, inch ...) where one
// fits. All programs use this function. The roots are those of all files of one head, in one unit.
UnitGuess guess_unit(std::span<const Vec3> roots);

}  // namespace hairnet
