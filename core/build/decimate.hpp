#pragma once

#include <cstddef>
#include <functional>

#include "core/build/stiffener_list.hpp"

namespace hairnet {

enum class StiffenerKind : std::uint8_t { spring, attachment };

// One stiffener merged into another (fig. 7), in weight space, where stiffener s is the matrix k_s w_s w_s^T: what the
// one that stays gains, and the squared Frobenius norm of what changes,
//   e^2 = | k_b w_b w_b^T - gain w_a w_a^T |^2 = k_b^2 |w_b|^4 - 2 k_b gain (w_a.w_b)^2 + gain^2 |w_a|^4
// Springs take the gain that makes e least, k_b (w_a.w_b)^2 / |w_a|^4; attachments take k_b, so that the hold against
// translation is kept.
struct Merge {
  double gain = 0;  // N/m
  double cost = 0;  // e^2
};
Merge merge_of(StiffenerKind kind, double stiffness_merged, double kept_norm2, double merged_norm2, double dot);

// Reduces `list` to exactly `count_max` stiffeners (or leaves it, when it has no more): the cheapest merge between two
// of one group that share a node, again and again. q merges like k. Where no such pair is left, springs lose the one
// with the least k^2 |w|^4; attachments merge into the nearest of their group in space, and the last of a group is
// dropped.
//
// Looking at all pairs of a node would be quadratic on a fixed lattice. Candidates are the few nearest in the space of
// both ends, found in rounds that each halve the number: near-linear. `keep_going` (may be empty) is called now and
// then with the share done; when it returns false, so does decimate, and `list` is then of no use.
[[nodiscard]] bool decimate(StiffenerKind kind, std::size_t count_max, StiffenerList& list,
                            const std::function<bool(double)>& keep_going = {});

}  // namespace hairnet
