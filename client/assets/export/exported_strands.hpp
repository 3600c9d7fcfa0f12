#pragma once

#include <cstddef>
#include <cstdint>
#include <span>
#include <string>
#include <string_view>
#include <vector>

#include "core/groom/groom.hpp"

namespace hairnet {

// The strands of a groom as other programs get them: group by group, each of at least two points. Their points are not
// here, because they move: `take_points` takes them from those of the groom at any moment. It is a copy of the order,
// not of the groom; it may outlive the groom.
struct ExportedStrands {
  struct Group {
    std::string name;
    // The index of the group in the groom.
    std::uint32_t id = 0;
    // Its strands are [begin, end), and their points are [first_point, end_point).
    std::uint32_t begin = 0, end = 0, first_point = 0, end_point = 0;

    [[nodiscard]] std::size_t strand_count() const { return end - begin; }
    [[nodiscard]] std::size_t point_count() const { return end_point - first_point; }
  };

  std::string name;
  std::vector<std::uint32_t> strand_begin{0};
  // The diameter of each strand; empty: no diameter is known.
  std::vector<float> widths_m;
  std::vector<Group> groups;
  // For each strand, its index and its first point in the groom.
  std::vector<std::uint32_t> groom_strands, groom_points;

  [[nodiscard]] std::size_t strand_count() const { return strand_begin.size() - 1; }
  [[nodiscard]] std::size_t point_count() const { return strand_begin.back(); }
  [[nodiscard]] std::uint32_t points_of(std::size_t strand) const {
    return strand_begin[strand + 1] - strand_begin[strand];
  }
  // Returns how many points each strand has, if all have equally many; else 0.
  [[nodiscard]] std::uint32_t points_of_each() const;
  // `groom` has all points of the groom in its order, at rest or deformed. `points` keeps its memory between frames.
  void take_points(std::span<const Vec3f> groom, std::vector<Vec3f>& points) const;
};

// Threads, cards, cloths and knots are no strands of other programs, and are left out.
ExportedStrands exported_strands(const Groom& groom);

// Returns a line about the parts of the groom that are not exported, because they are no strands of two points or more;
// empty: all parts are exported. Programs show it, so that users know what is missing.
std::string left_behind(const Groom& groom, const ExportedStrands& strands);

// A name for each group that is one in Alembic and USD: ASCII letters, digits and underscores, each name once.
std::vector<std::string> object_names(const ExportedStrands& strands);

}  // namespace hairnet
