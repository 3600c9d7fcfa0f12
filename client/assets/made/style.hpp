#pragma once

#include <cstdint>

#include "client/assets/made/growth.hpp"
#include "core/groom/groom.hpp"
#include "core/random.hpp"

namespace hairnet::made {

// Validated options, with the style's defaults filled in.
struct StyleOptions {
  double length_m;
  double curl;
  std::size_t strand_count;
  std::uint64_t seed;
};

// Real heads have some 100 000 hairs; strands share them, so any number of strands has the same mass.
inline constexpr double kHairsInAll = 100'000;

// Index of the group of that name, added when it is new.
std::uint16_t group_index(Groom& groom, std::string_view name);

// How add_path() makes a strand of a path.
struct StrandFinish {
  int points = 18;
  // The smallest distance of the strand's points from the skin, except for the root.
  double skin_clearance_m = 0.0025;
  std::uint16_t group = 0;
  // The number of real hairs that the strand stands for.
  double hair_count = 10;
  bool rooted = true;
};
// Resamples the path evenly, moves it out of the skin and adds it. `finish.points` must be at least 2. Points away from
// the root end at least `skin_clearance_m` off the skin.
void add_path(Groom& groom, const Path& path, const StrandFinish& finish);

// A curl for `amount`, 0 straight … 1 tight. Phase, size and direction vary by `random`. `random` is drawn from four
// times, whatever the amount, so that styles of one seed differ in nothing else.
Curl make_curl(double amount, Random& random);
// The number of points that a strand of that length needs to show its curls.
int curl_points(double amount, double length_m, int point_count_min);

}  // namespace hairnet::made
