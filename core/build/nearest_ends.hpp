#pragma once

#include <array>
#include <cstdint>
#include <memory>
#include <span>
#include <utility>
#include <vector>

#include "core/build/stiffener_list.hpp"

namespace hairnet {

// Both ends in a row, in grid coordinates, the axis of greatest extent ascending: springs along one line compare alike,
// whichever way their strands run.
using EndPoints = std::array<double, 6>;
EndPoints ordered_ends(const std::array<Vec3, 2>& ends);

// Finds stiffeners whose ends lie near each other, by a k-d tree over both ends; distances in node spacings. Takes
// quadratic time where many have the very same ends: merge those first.
class NearestEnds {
 public:
  // `members`: indices into the list.
  NearestEnds(const StiffenerList& list, std::span<const std::uint32_t> members);
  ~NearestEnds();
  NearestEnds(NearestEnds&&) noexcept;
  NearestEnds& operator=(NearestEnds&&) noexcept;

  // Appends (first < second) for each of the `neighbour_count` nearest of each member in [begin, end) of the members,
  // in an order of this class's own. Over all members a pair comes once or twice.
  using Pairs = std::vector<std::pair<std::uint32_t, std::uint32_t>>;
  void append_pairs(std::size_t begin, std::size_t end, std::size_t neighbour_count, Pairs& pairs) const;

 private:
  struct Impl;
  std::unique_ptr<Impl> impl_;
};

}  // namespace hairnet
