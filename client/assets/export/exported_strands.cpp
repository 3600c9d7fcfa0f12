#include "client/assets/export/exported_strands.hpp"

#include <algorithm>
#include <numeric>
#include <set>

namespace hairnet {

std::uint32_t ExportedStrands::points_of_each() const {
  const std::uint32_t first = strand_count() == 0 ? 0 : points_of(0);
  for (std::size_t s = 1; s < strand_count(); ++s) {
    if (points_of(s) != first) return 0;
  }
  return first;
}

void ExportedStrands::take_points(std::span<const Vec3f> groom, std::vector<Vec3f>& points) const {
  points.clear();
  points.reserve(point_count());
  for (std::size_t s = 0; s < strand_count(); ++s) {
    const std::span<const Vec3f> strand = groom.subspan(groom_points[s], points_of(s));
    points.insert(points.end(), strand.begin(), strand.end());
  }
}

// The stable sort keeps the groom's order within a group, and puts strands of one group side by side as formats want
// them.
ExportedStrands exported_strands(const Groom& groom) {
  std::vector<std::uint32_t> order(groom.strand_count());
  std::iota(order.begin(), order.end(), 0U);
  std::erase_if(order, [&](std::uint32_t s) { return groom.strand_points(s).size() < 2; });
  std::ranges::stable_sort(order, {}, [&](std::uint32_t s) { return groom.strands[s].group; });

  ExportedStrands out;
  out.name = groom.name;
  for (const std::uint32_t s : order) {
    const StrandProperties& properties = groom.strands[s];
    const auto strand = static_cast<std::uint32_t>(out.strand_count());
    if (out.groups.empty() || out.groups.back().id != properties.group) {
      // A groom without names of groups gets its own name for the only group.
      const bool has_name = properties.group < groom.group_names.size();
      out.groups.push_back({has_name ? groom.group_names[properties.group] : groom.name, properties.group, strand,
                            strand, out.strand_begin.back(), 0});
    }
    out.strand_begin.push_back(out.strand_begin.back() + static_cast<std::uint32_t>(groom.strand_points(s).size()));
    // Formats want diameters; a groom has radii.
    out.widths_m.push_back(2 * properties.radius_m);
    out.groom_strands.push_back(s);
    out.groom_points.push_back(groom.strand_begin[s]);
    out.groups.back().end = strand + 1;
    out.groups.back().end_point = out.strand_begin.back();
  }
  return out;
}

std::string left_behind(const Groom& groom, const ExportedStrands& strands) {
  std::string line;
  const auto add = [&](std::size_t count, const char* what) {
    if (count > 0) line += (line.empty() ? "" : ", ") + std::to_string(count) + ' ' + what + (count > 1 ? "s" : "");
  };
  add(groom.strand_count() - strands.strand_count(), "strand of less than 2 points");
  add(groom.threads.size(), "thread");
  add(groom.cards.size(), "card");
  add(groom.cloths.size(), "cloth");
  add(groom.knots.size(), "knot");
  return line.empty() ? line : "not written, since only strands are: " + line;
}

std::vector<std::string> object_names(const ExportedStrands& strands) {
  std::vector<std::string> names;
  std::set<std::string> used;
  for (const ExportedStrands::Group& group : strands.groups) {
    std::string name;
    // A letter beyond ASCII becomes an underscore for each of its bytes.
    for (const char c : group.name) {
      const bool is_letter = (c >= 'a' && c <= 'z') || (c >= 'A' && c <= 'Z'), is_digit = c >= '0' && c <= '9';
      if (is_digit && name.empty()) name += '_';
      name += is_letter || is_digit ? c : '_';
    }
    if (name.empty()) name = "hair";
    // Two names may become equal by the replacement; the number of the group is then appended, as often as it takes.
    while (!used.insert(name).second) name += "_" + std::to_string(group.id);
    names.push_back(name);
  }
  return names;
}

}  // namespace hairnet
