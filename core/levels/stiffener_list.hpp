#pragma once

#include <cstdint>
#include <limits>
#include <span>
#include <vector>

#include "core/levels/grid.hpp"

namespace hairnet {

// Stiffeners while a level is built: grid indices and double, one for every piece of hair. Stiffener s has the entries
// [begin[s], begin[s + 1]), ascending by node, none of them zero.
struct StiffenerList {
  std::vector<std::uint32_t> begin{0};
  std::vector<NodeWeight> entries;
  // The stiffness k, N/m.
  std::vector<double> stiffness;
  // The damping q, N s/m.
  std::vector<double> damping;
  std::vector<std::uint16_t> group;
  // The two ends of each stiffener in grid coordinates. An attachment has the same point twice.
  std::vector<std::array<Vec3, 2>> ends;

  [[nodiscard]] std::size_t count() const { return stiffness.size(); }
  [[nodiscard]] std::span<const NodeWeight> weights(std::size_t s) const {
    return {entries.data() + begin[s], entries.data() + begin[s + 1]};
  }
  // Asserts that all lists have the counts that belong together.
  void check_invariants() const;
};

// The least stiffness, N/m, that a built level can store as a float. Stiffeners that are weaker do not exist.
inline constexpr double kStoredStiffnessMin = std::numeric_limits<float>::min();  // N/m

// Eq. 3: the weights of `to` minus those of `from`. k = axial_stiffness_n / chord length, with a length of at least a
// tenth of a cell; q = k damping_time_s. Adds nothing when the chord has no length or the stiffness is too small.
void add_spring(const Grid& grid, const Vec3& from, const Vec3& to, double axial_stiffness_n, double damping_time_s,
                std::uint16_t group, StiffenerList& springs);

// A spring of stiffness k (N/m) for any length. There is none when the chord has no length or k is too small.
struct SpringLaw {
  double stiffness_n_per_m = 0, damping_time_s = 0;
  std::uint16_t group = 0;
};
void add_spring(const Grid& grid, const Vec3& from, const Vec3& to, const SpringLaw& law, StiffenerList& springs);

// Appends the stiffeners of `more` to `list`. Asserts that these are two lists.
void append(const StiffenerList& more, StiffenerList& list);

// Adds an attachment (eq. 4): binds one point of the lattice to the skull at its place. Adds nothing when the stiffness
// is too small.
void add_attachment(const Grid& grid, const Vec3& point, double stiffness_n_per_m, double damping_time_s,
                    std::uint16_t group, StiffenerList& attachments);

}  // namespace hairnet
