#pragma once

#include <array>
#include <cstdint>
#include <memory>
#include <span>
#include <utility>
#include <vector>

#include "core/geometry/vec.hpp"

namespace hairnet {

// The two ends of a stiffener in grid coordinates; for an attachment both are the same point.
using Chord = std::array<Vec3, 2>;

// The distance of two chords in node spacings: that of their midpoints plus, with a larger weight, that of their
// vectors. The sign of a vector does not count: springs along one line are near each other whichever way their strands
// run.
inline constexpr double kVectorWeight = 2.5;
double squared_distance(const Chord& a, const Chord& b);

// Finds neighbouring chords with a k-d tree. Takes quadratic time when many chords are identical: merge those first.
class NearestChords {
 public:
  // `members`: indices into `chords`. Asserts that there is one.
  NearestChords(std::span<const Chord> chords, std::span<const std::uint32_t> members);
  ~NearestChords();
  NearestChords(NearestChords&&) noexcept;
  NearestChords& operator=(NearestChords&&) noexcept;

  // For each member in [begin, end), appends the pairs (first < second) with its `neighbour_count` nearest chords. The
  // order of the pairs is unspecified but deterministic. Over all members a pair appears once or twice. Asserts that
  // these members exist, and that `neighbour_count` is not 0.
  using Pairs = std::vector<std::pair<std::uint32_t, std::uint32_t>>;
  void append_pairs(std::size_t begin, std::size_t end, std::size_t neighbour_count, Pairs& pairs) const;

 private:
  struct Impl;
  std::unique_ptr<Impl> impl_;
};

}  // namespace hairnet
