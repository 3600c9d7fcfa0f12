#pragma once

#include <cstddef>
#include <span>
#include <string>
#include <vector>

#include "client/assets/import/placement.hpp"

namespace hairnet {

// One strand of which something is cut, as a line `FILE: strand N: what and why`. Sizes are in units of the files.
struct Outlier {
  enum class Kind : std::uint8_t { no_length, stray_point, far_away, too_long };
  Kind kind = Kind::no_length;
  // The index of the file in the list of files, and of the strand in its file, both from 0.
  std::size_t file = 0, strand = 0;
  // The first of the stray points in the strand, and their number.
  std::size_t point = 0, point_count = 0;
  // `size` is the distance or length that is too large; few strands of this hair exceed `usual`.
  double size = 0, usual = 0;
};

// Cuts what would ruin the lattice, and what is no hair: strands without length; points that lie far from all hair and
// their own strand, as exporters put at the origin; single strands that are far longer, or lie far away. Three strands
// that are alike are a style, such as a long ponytail beside short hair, unless they exceed the rest twelve times. All
// measures are quantiles over the strands of all files. Returns what it cut, by file and strand. Call it before
// anything is guessed. The order of the strands that remain does not change.
std::vector<Outlier> cut_outliers(std::span<StrandFile> files);

}  // namespace hairnet
