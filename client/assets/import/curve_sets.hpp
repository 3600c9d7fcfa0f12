#pragma once

#include <cstddef>
#include <cstdint>
#include <span>
#include <string>
#include <string_view>
#include <vector>

#include "client/assets/import/curve_bases.hpp"
#include "client/assets/import/strands.hpp"

namespace hairnet {

// Curves of one kind, as an object of a scene has them. Positions are in the scene's coordinates, with all transforms
// applied.
struct CurveSet {
  std::string name;
  CurveBasis basis = CurveBasis::linear;
  CurveWrap wrap = CurveWrap::open;
  std::vector<Vec3f> controls;
  // The control points of curve c are [begin[c], begin[c + 1]).
  std::vector<std::uint32_t> begin{0};

  // Each control point has a width, or none has; the same holds for colours.
  std::vector<float> widths;
  std::vector<Vec3f> colours;
  // Each curve has the name of its group, or none has.
  std::vector<std::string> groups;

  [[nodiscard]] std::size_t curve_count() const { return begin.size() - 1; }
  [[nodiscard]] std::span<const Vec3f> curve(std::size_t c) const {
    return {controls.data() + begin[c], controls.data() + begin[c + 1]};
  }
};

// Returns the name that a file gives a group, cut and escaped for messages. `numbered_group` makes a name, "group 2",
// for a group that has only a number in its file.
std::string shown_group(std::string_view name);
std::string numbered_group(double number);

// Makes strands of all curves, and returns an error, or an empty string.
// A groom holds limited numbers of points and strands (GroomLimits), whatever the file says. With too many points,
// curves are followed less closely, or by some of their points; with too many curves, some are left out, evenly. A
// curve whose number of control points its basis does not allow becomes straight lines between them. A curve of fewer
// than 2 points, or with a point that is not finite, is left out. Lines about all this go to `notes` and `doubts`.
// The groups are those of the curves, else the sets; there are none where that is only one. It is an error when no
// strand is left. `strands` must be empty, except for `up`, `unit_m`, `notes` and `doubts`.
std::string make_strands(std::span<const CurveSet> sets, ImportedStrands& strands);
// The same for strands that have nothing yet.
Result<ImportedStrands> strands_of(std::span<const CurveSet> sets);

}  // namespace hairnet
