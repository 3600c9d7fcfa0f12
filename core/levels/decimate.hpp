#pragma once

#include <cstddef>
#include <functional>

#include "core/levels/stiffener_list.hpp"
#include "core/parallel_for.hpp"

namespace hairnet {

enum class StiffenerKind : std::uint8_t { spring, attachment };

// The most nodes of a merged stiffener: those with the largest weights are kept. A spring has so many at each of its
// two ends.
inline constexpr std::size_t kNodesPerEndMax = 4;
inline constexpr std::size_t kNodesPerAttachmentMax = 16;

// Reduces `list` to exactly `count_max` stiffeners (or leaves it unchanged when it has no more), by merging pairs of
// one group, the cheapest first (fig. 7). Springs merge into their mean, and not one into the other, so that no
// stiffness is lost:
//
//   w = sum k L w / sum k L     k = sum k L^2 / L_w^2     (signs so that the directions agree, L_w the length of w)
//
// Parallel springs keep their resistance to a stretch along them exactly: for the strain g, sum k w (w.u) = g sum k L
// w. Attachments: w = sum k w / sum k, k = sum k, which keeps their resistance to translation. q merges like k. The
// cost is that of Ward's clustering, m_a m_b / (m_a + m_b) |a - b|^2 with m = k L^2 (attachments: k), and the
// distance of nearest_chords.hpp. If each group has one stiffener left and there are still too many, those with the
// least m are dropped.
//
// Comparing all pairs would be quadratic. Candidates are each stiffener's few nearest neighbours, searched again in
// rounds that halve the number, which is nearly linear. `keep_going` may be empty. Any thread of `parallel_for` may
// call it with the finished fraction; when it returns false, decimate returns false and the contents of `list` are
// undefined. Asserts that the counts of `list` agree.
[[nodiscard]] bool decimate(const Grid& grid, StiffenerKind kind, std::size_t count_max, StiffenerList& list,
                            const std::function<bool(double)>& keep_going = {}, const ParallelFor& parallel_for = {});

}  // namespace hairnet
