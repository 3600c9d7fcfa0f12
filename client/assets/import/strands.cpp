#include "client/assets/import/strands.hpp"

#include <algorithm>
#include <array>
#include <utility>

#include "client/assets/import/alembic.hpp"
#include "client/assets/import/obj.hpp"
#include "client/assets/import/parse_text.hpp"
#include "client/assets/import/strand_points.hpp"

namespace hairnet {
namespace {

std::string append_points(ByteReader& in, std::size_t strand, std::size_t count, std::size_t gap_bytes,
                          std::vector<Vec3f>& points) {
  // The loop stops at the first bad coordinate: such a file is damaged, and its other numbers are not trusted either.
  for (std::size_t i = 0; i < count; ++i) {
    points.push_back(in.vec3f());
    if (!points.back().allFinite())
      return "strand " + std::to_string(strand) + ", point " + std::to_string(i) + ": a coordinate is not finite";
    in.skip(gap_bytes);
  }
  return {};
}

Result<ImportedStrands> decode_obj_file(std::span<const std::byte> bytes) {
  return decode_obj_strands(as_text(bytes));
}

}  // namespace

std::string read_points(ByteReader& in, std::size_t gap_bytes, ImportedStrands& strands) {
  strands.points.reserve(strands.strand_begin.back());
  for (std::size_t s = 0; s < strands.strand_count(); ++s) {
    const std::size_t count = strands.strand_begin[s + 1] - strands.strand_begin[s];
    std::string error = append_points(in, s, count, gap_bytes, strands.points);
    if (!error.empty()) return error;
  }
  return {};
}

std::string read_strand(ByteReader& in, std::size_t count, std::size_t gap_bytes, ImportedStrands& strands) {
  const std::size_t strand = strands.strand_count();
  strands.strand_begin.push_back(static_cast<std::uint32_t>(strands.points.size() + count));
  return append_points(in, strand, count, gap_bytes, strands.points);
}

// Three functions decode several extensions, since the bytes tell the forms apart.
std::span<const StrandReader> strand_readers() {
  static constexpr std::array<StrandReader, 13> kReaders{{{".hair", decode_yuksel_hair},
                                                          {".tfx", decode_tressfx},
                                                          {".txt", decode_tressfx},
                                                          {".data", decode_usc_data},
                                                          {".abc", decode_alembic},
                                                          {".usd", decode_usd_curves},
                                                          {".usda", decode_usd_curves},
                                                          {".usdc", decode_usd_curves},
                                                          {".usdz", decode_usd_curves},
                                                          {".ply", decode_ply},
                                                          {".npy", decode_npy},
                                                          {".npz", decode_npy},
                                                          {".obj", decode_obj_file}}};
  return kReaders;
}

// The order within each group is that of the file.
std::vector<StrandGroup> divide_groups(ImportedStrands strands) {
  std::vector<StrandGroup> groups(std::max<std::size_t>(strands.group_names.size(), 1));
  for (std::size_t g = 0; g < strands.group_names.size(); ++g) groups[g].name = strands.group_names[g];
  const auto guide_count = static_cast<std::size_t>(std::ranges::count(strands.guides, 1));
  // Where all strands are guides, the file holds nothing else, and they are the hair.
  const bool keeps_guides = guide_count == strands.strand_count();
  for (std::size_t s = 0; s < strands.strand_count(); ++s) {
    if (!keeps_guides && !strands.guides.empty() && strands.guides[s] != 0) continue;
    StrandGroup& group = groups[strands.groups.empty() ? 0 : strands.groups[s]];
    ImportedStrands& out = group.strands;
    const std::uint32_t begin = strands.strand_begin[s], end = strands.strand_begin[s + 1];
    out.points.insert(out.points.end(), strands.points.begin() + begin, strands.points.begin() + end);
    // The middle stands for the strand: many exporters taper roots or tips to nothing.
    if (!strands.widths.empty()) group.widths.push_back(begin == end ? 0 : strands.widths[begin + (end - begin) / 2]);
    out.strand_begin.push_back(static_cast<std::uint32_t>(out.points.size()));
  }
  // A single group without strands stays, so the caller can report an empty file.
  if (groups.size() > 1)
    std::erase_if(groups, [](const StrandGroup& group) { return group.strands.strand_count() == 0; });
  if (!keeps_guides && guide_count > 0)
    strands.notes.push_back(std::to_string(guide_count) + (guide_count == 1 ? " guide beside " : " guides beside ") +
                            std::to_string(strands.strand_count() - guide_count) + " strands are left out");
  // Facts about the file go to the first group alone, so that messages show them once.
  ImportedStrands& first = groups.front().strands;
  first.up = strands.up;
  first.unit_m = strands.unit_m;
  first.notes = std::move(strands.notes);
  first.doubts = std::move(strands.doubts);
  return groups;
}

}  // namespace hairnet
