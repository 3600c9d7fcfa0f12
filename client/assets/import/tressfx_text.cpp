#include <string>

#include "client/assets/import/curve_sets.hpp"
#include "client/assets/import/parse_text.hpp"
#include "client/assets/import/strands.hpp"
#include "core/shown_text.hpp"

// The text form of TressFX 2: settings of the simulation, "numStrands 2", "is sorted 1", and for each strand a line
// "strand 0 numVerts 25 texcoord 0.1 0.5" and as many lines of three coordinates.
namespace hairnet {
namespace {

// Lines without the blank ones, and their numbers.
struct Lines {
  std::string_view text;
  std::size_t number = 0;

  bool next(std::string_view& line) {
    while (!text.empty()) {
      line = take_line(text);
      ++number;
      if (line.find_first_not_of(kBlanks) != std::string_view::npos) return true;
    }
    return false;
  }
  [[nodiscard]] Refusal refuse(const std::string& what) const {
    return Refusal("line " + std::to_string(number) + ": " + what);
  }
};

// The whole number that follows a word of a line, or a word and a colon. The word may stand anywhere in the line:
// numVerts follows the number of the strand.
std::optional<std::uint32_t> count_after(std::string_view line, std::string_view word) {
  for (std::string_view next = take_word(line); !next.empty(); next = take_word(line)) {
    if (next != word) continue;
    next = take_word(line);
    return parse_number<std::uint32_t>(next == ":" ? take_word(line) : next);
  }
  return {};
}

std::optional<Vec3f> point_of(std::string_view line) {
  Vec3f point;
  for (int axis = 0; axis < 3; ++axis) {
    const std::optional<double> value = parse_decimal(take_word(line));
    if (!value) return {};
    point[axis] = static_cast<float>(*value);
  }
  return point;
}

}  // namespace

Result<ImportedStrands> decode_tressfx_text(std::string_view text) {
  Lines lines{text};
  std::string_view line;
  std::optional<std::uint32_t> strand_count;
  // Settings before numStrands are skipped, as the import does not simulate with them.
  while (!strand_count && lines.next(line)) strand_count = count_after(line, "numStrands");
  if (!strand_count) return Refusal("not a text of TressFX: no line begins with numStrands and a number");
  CurveSet set;
  // No memory is reserved by counts; every point needs a line of the file.
  for (std::uint32_t s = 0; s < *strand_count; ++s) {
    std::optional<std::uint32_t> point_count;
    // Before the first strand other lines may follow, such as "is sorted 1". Between strands there are none.
    while (!point_count && lines.next(line)) {
      point_count = count_after(line, "numVerts");
      if (!point_count && count_after(line, "strand")) return lines.refuse("a strand without its numVerts");
      if (!point_count && s > 0) return lines.refuse("expected strand " + std::to_string(s) + ", not " + shown(line));
    }
    if (!point_count)
      return Refusal("truncated: it says " + std::to_string(*strand_count) + " strands, and has " + std::to_string(s));
    for (std::uint32_t i = 0; i < *point_count; ++i) {
      if (!lines.next(line))
        return Refusal("truncated in strand " + std::to_string(s) + ": " + std::to_string(i) + " of " +
                       counted(*point_count, "point"));
      const std::optional<Vec3f> point = point_of(line);
      if (!point) return lines.refuse("a point needs 3 numbers, not " + shown(line));
      set.controls.push_back(*point);
    }
    set.begin.push_back(static_cast<std::uint32_t>(set.controls.size()));
  }
  if (lines.next(line)) return lines.refuse("more follows the last of " + counted(*strand_count, "strand"));
  return strands_of({&set, 1});
}

}  // namespace hairnet
