#include "client/assets/import/alembic.hpp"

#include <algorithm>

#include "tests/fuzz/target.hpp"

// An archive is refused with one line, or gives valid strands; whether it moves does not change them.
int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size) {
  using namespace hairnet;
  const std::span<const std::byte> bytes = std::as_bytes(std::span(data, size));
  const Result<ImportedStrands> got = decode_alembic(bytes);
  const Result<StrandMotion> motion = decode_alembic_motion(bytes);
  if (!got) {
    fuzz::require(!got.error().empty() && got.error().find('\n') == std::string::npos, "a refusal has one line");
    fuzz::require(!motion, "what has no strands does not move");
    return 0;
  }
  const std::size_t points = got->points.size(), strands = got->strand_count();
  fuzz::require(got->strand_begin.front() == 0 && got->strand_begin.back() == points, "offsets end at the points");
  fuzz::require(std::ranges::is_sorted(got->strand_begin), "offsets ascend");
  fuzz::require(std::ranges::all_of(got->points, [](const Vec3f& x) { return x.allFinite(); }), "points are finite");
  const auto fits = [](std::size_t count, std::size_t wanted) { return count == 0 || count == wanted; };
  fuzz::require(fits(got->widths.size(), points) && fits(got->colours.size(), points), "a value for each point");
  fuzz::require(
      fits(got->root_uvs.size(), strands) && fits(got->groups.size(), strands) && fits(got->guides.size(), strands),
      "a value for each strand");
  for (const std::uint32_t group : got->groups) fuzz::require(group < got->group_names.size(), "groups have names");
  if (!motion) return 0;
  fuzz::require(motion->points.size() == motion->times_s.size(), "points at each time");
  for (const auto& at_time : motion->points) fuzz::require(at_time.size() == points, "all points at each time");
  return 0;
}
