#pragma once

#include <algorithm>
#include <span>

#include "client/assets/import/strands.hpp"
#include "core/groom/groom.hpp"
#include "tests/fuzz/target.hpp"

namespace hairnet::fuzz {

// Strands of a file from anywhere are refused with one line, or consistent, finite and no more than a groom holds.
inline int require_strands(const Result<ImportedStrands>& strands, std::size_t file_bytes) {
  if (!strands) {
    require(!strands.error().empty(), "a refusal has a line");
    require(strands.error().find('\n') == std::string::npos, "a refusal is one line: " + strands.error());
    return 0;
  }
  const std::vector<std::uint32_t>& begin = strands->strand_begin;
  require(!begin.empty() && begin.front() == 0 && begin.back() == strands->points.size(), "the strands are the points");
  require(std::ranges::is_sorted(begin), "strands follow each other");
  require(std::ranges::all_of(strands->points, [](const Vec3f& x) { return x.allFinite(); }), "points are finite");
  // A segment of a curve has several pieces, and numbers may be packed.
  require(strands->points.size() <= std::max(file_bytes, GroomLimits{}.point_count_max), "points are bounded");
  for (const std::size_t size : {strands->widths.size(), strands->colours.size()})
    require(size == 0 || size == strands->points.size(), "a value for each point, or none");
  require(strands->groups.empty() || strands->groups.size() == strands->strand_count(), "a group for each strand");
  for (const std::uint32_t group : strands->groups) require(group < strands->group_names.size(), "groups have names");
  return 0;
}

}  // namespace hairnet::fuzz
