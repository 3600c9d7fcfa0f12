#pragma once

#include <array>
#include <cstdint>
#include <memory>
#include <span>
#include <utility>
#include <vector>

#include "core/geometry/vec.hpp"

namespace hairnet {

// Where a stiffener lies, grid coordinates: its two ends. Those of an attachment are one point.
using Chord = std::array<Vec3, 2>;

// How far apart two chords are, in node spacings: the distance of their middles, and, weighing more, of their vectors.
// Springs along one line compare alike, whichever way their strands run.
inline constexpr double kVectorWeight = 2.5;
double squared_distance(const Chord& a, const Chord& b);

// Finds chords that are near each other, by a k-d tree. Takes quadratic time where many are the very same: merge those
// first.
class NearestChords {
 public:
  // `members`: indices into `chords`.
  NearestChords(std::span<const Chord> chords, std::span<const std::uint32_t> members);
  ~NearestChords();
  NearestChords(NearestChords&&) noexcept;
  NearestChords& operator=(NearestChords&&) noexcept;

  // Appends (first < second) for each of the `neighbour_count` nearest of each member in [begin, end) of the members,
  // in an order of this class's own. Over all members a pair comes once or twice.
  using Pairs = std::vector<std::pair<std::uint32_t, std::uint32_t>>;
  void append_pairs(std::size_t begin, std::size_t end, std::size_t neighbour_count, Pairs& pairs) const;

 private:
  struct Impl;
  std::unique_ptr<Impl> impl_;
};

}  // namespace hairnet
