#include <algorithm>
#include <array>
#include <bit>
#include <cmath>
#include <map>
#include <numeric>
#include <string>
#include <utility>

#include "client/assets/import/curve_sets.hpp"
#include "client/assets/import/edge_chains.hpp"
#include "client/assets/import/imported_body.hpp"
#include "client/assets/import/parse_text.hpp"
#include "client/assets/import/strands.hpp"
#include "core/groom/groom.hpp"
#include "core/shown_text.hpp"

// Strands in a .ply, as text or binary of either byte order. The first of these that a file has makes its strands:
// edges between vertices; at each vertex the number of its strand; an element of strands, with the number of points or
// the list of vertices of each. Without any of these, the vertices follow each other strand by strand, and all strands
// have equally many: GaussianHaircut and NeuralHaircut write 100 for each.
namespace hairnet {
namespace {

enum class PlyForm : std::uint8_t { text, little_endian, big_endian };
enum class PlyNumber : std::uint8_t { i8, u8, i16, u16, i32, u32, f32, f64 };

constexpr std::array<std::size_t, 8> kPlyBytes{1, 1, 2, 2, 4, 4, 4, 8};

std::optional<PlyNumber> ply_number(std::string_view word) {
  constexpr std::array<std::array<std::string_view, 2>, 8> kNames{{{"char", "int8"},
                                                                   {"uchar", "uint8"},
                                                                   {"short", "int16"},
                                                                   {"ushort", "uint16"},
                                                                   {"int", "int32"},
                                                                   {"uint", "uint32"},
                                                                   {"float", "float32"},
                                                                   {"double", "float64"}}};
  for (std::size_t i = 0; i < kNames.size(); ++i) {
    if (word == kNames[i][0] || word == kNames[i][1]) return static_cast<PlyNumber>(i);
  }
  return {};
}

struct PlyProperty {
  std::string_view name;
  PlyNumber number{};
  // The type of the count that stands before a list's values; none: the property is no list.
  std::optional<PlyNumber> list;
};

struct PlyElement {
  std::string_view name;
  std::uint64_t count = 0;
  std::vector<PlyProperty> properties;

  [[nodiscard]] std::optional<std::size_t> property(std::span<const std::string_view> names) const {
    for (const std::string_view wanted : names) {
      for (std::size_t i = 0; i < properties.size(); ++i) {
        if (properties[i].name == wanted) return i;
      }
    }
    return {};
  }
  // The fewest bytes of one of its rows: in text a digit and what follows it. A crafted count is compared with this
  // before rows are read.
  [[nodiscard]] std::size_t row_bytes(PlyForm form) const {
    std::size_t bytes = 0;
    for (const PlyProperty& property : properties)
      bytes += form == PlyForm::text ? 2 : kPlyBytes[static_cast<std::size_t>(property.list.value_or(property.number))];
    return std::max<std::size_t>(bytes, 1);
  }
};

struct PlyHeader {
  PlyForm form{};
  std::vector<PlyElement> elements;
  // The names of the groups, by the number at their vertices. `hairnet-groom export` writes them as "comment group 2
  // fringe".
  std::map<double, std::string> group_names;
};

// Reads the header, and leaves `text` at the first byte of the data.
Result<PlyHeader> read_header(std::string_view& text) {
  // All elements together have no more properties. Without the limit, a header of megabytes could declare properties
  // that each row then costs.
  constexpr std::size_t kPropertiesMax = 1000;
  std::string_view line = take_line(text);
  if (take_word(line) != "ply") return Refusal("not a .ply file: it does not begin with ply");
  PlyHeader header;
  bool has_form = false;
  std::size_t property_count = 0;
  // The header is text in both forms, and its lines are counted for messages.
  for (std::size_t number = 2; !text.empty(); ++number) {
    line = take_line(text);
    const std::string_view shown_line = line, keyword = take_word(line);
    bool is_good = true;
    if (keyword == "end_header") {
      if (!has_form) return Refusal("the header has no format");
      return header;
    }
    if (keyword == "format") {
      const std::string_view form = take_word(line);
      if (form == "binary_little_endian") header.form = PlyForm::little_endian;
      if (form == "binary_big_endian") header.form = PlyForm::big_endian;
      // The form's default is text, so only the word ascii confirms it.
      is_good = has_form = header.form != PlyForm::text || form == "ascii";
    } else if (keyword == "element") {
      PlyElement& element = header.elements.emplace_back();
      element.name = take_word(line);
      const std::optional<std::uint64_t> count = parse_number<std::uint64_t>(take_word(line));
      element.count = count.value_or(0);
      // An element counts as a property, so that a header of elements without properties is bounded as well.
      is_good = count.has_value() && ++property_count <= kPropertiesMax;
    } else if (keyword == "property") {
      std::string_view type = take_word(line);
      PlyProperty property;
      if (type == "list") {
        property.list = ply_number(take_word(line));
        // The number of items must be a whole number: of the eight types, those below f32.
        is_good = property.list && *property.list < PlyNumber::f32;
        type = take_word(line);
      }
      const std::optional<PlyNumber> value = ply_number(type);
      property.number = value.value_or(PlyNumber::f32);
      property.name = take_word(line);
      is_good = is_good && value && !header.elements.empty() && ++property_count <= kPropertiesMax;
      if (is_good) header.elements.back().properties.push_back(property);
    } else if (keyword == "comment") {
      // Anything else that a comment says is for people.
      if (take_word(line) != "group" || header.group_names.size() == GroomLimits{}.group_count_max) continue;
      const std::optional<double> group = parse_number<double>(take_word(line));
      while (line.ends_with('\r')) line.remove_suffix(1);
      if (group && line.size() > 1) header.group_names.emplace(*group, shown_group(line.substr(1)));
    } else if (keyword != "obj_info" && !keyword.empty()) {
      is_good = false;
    }
    if (!is_good)
      return Refusal("line " + std::to_string(number) + " of the header is not understood: " + shown(shown_line));
  }
  return Refusal("truncated: the header has no end_header");
}

// Reads number after number. After the end of the file, or a word that is no number, there are none. The same numbers
// come as words or as bytes of either order. All types fit into a double without loss.
class PlyValues {
 public:
  PlyValues(PlyForm form, std::string_view data) : form_(form), data_(data) {}

  [[nodiscard]] std::size_t remaining() const { return data_.size(); }

  std::optional<double> next(PlyNumber number) {
    if (form_ == PlyForm::text) return next_word();
    const std::size_t size = kPlyBytes[static_cast<std::size_t>(number)];
    if (data_.size() < size) return {};
    std::uint64_t bits = 0;
    // The loop begins at the most significant byte.
    for (std::size_t i = 0; i < size; ++i) {
      const std::size_t byte = form_ == PlyForm::little_endian ? size - 1 - i : i;
      bits = bits << 8 | static_cast<unsigned char>(data_[byte]);
    }
    data_.remove_prefix(size);
    switch (number) {
      case PlyNumber::i8:
        return static_cast<std::int8_t>(bits);
      case PlyNumber::i16:
        return static_cast<std::int16_t>(bits);
      case PlyNumber::i32:
        return static_cast<std::int32_t>(bits);
      case PlyNumber::f32:
        return std::bit_cast<float>(static_cast<std::uint32_t>(bits));
      case PlyNumber::f64:
        return std::bit_cast<double>(bits);
      default:
        return static_cast<double>(bits);
    }
  }

 private:
  std::optional<double> next_word() {
    constexpr std::string_view kBetween = " \t\r\n";
    const std::size_t begin = std::min(data_.find_first_not_of(kBetween), data_.size());
    const std::size_t end = std::min(data_.find_first_of(kBetween, begin), data_.size());
    const std::string_view word = data_.substr(begin, end - begin);
    data_.remove_prefix(end);
    // Text has many ways to write what is not finite. Any becomes infinite, and its strand is dropped later.
    if (word == "nan" || word == "-nan" || word == "inf" || word == "-inf") return HUGE_VAL;
    return parse_decimal(word);
  }

  PlyForm form_;
  std::string_view data_;
};

// The parts of a file that make strands, in the order of its elements. Vertices must precede what refers to them.
struct PlyParts {
  std::vector<Vec3f> points;
  // Each point has one, or none has.
  std::vector<Vec3f> colours;
  std::vector<float> widths;
  std::vector<double> groups;
  std::vector<double> strand_of;
  std::vector<std::array<std::uint32_t, 2>> edges;
  // The number of points of each strand, in their order.
  std::vector<std::uint32_t> counts;
  // Strands by lists have these, and end at `list_end`.
  std::vector<std::uint32_t> vertices;
  std::vector<std::size_t> list_end;
  std::size_t face_count = 0;
  // Faces are read only where they are asked for.
  bool wants_faces = false;
  std::vector<std::array<std::uint32_t, 3>> triangles;
};

constexpr std::array<std::string_view, 6> kStrandNames{"strand_id", "strand_idx", "strand_index",
                                                       "strand",    "hair_id",    "curve_id"};
constexpr std::array<std::string_view, 2> kWidthNames{"width", "thickness"};
constexpr std::array<std::string_view, 2> kGroupNames{"group_id", "group"};
constexpr std::array<std::string_view, 7> kCountNames{"num_points", "point_count", "vertex_count", "num_vertices",
                                                      "count",      "length",      "n_points"};
constexpr std::array<std::string_view, 5> kListNames{"vertex_indices", "vertex_index", "indices", "points", "vertices"};

// The comparison refuses NaN and fractions as well.
std::optional<std::uint32_t> vertex_of(double number, std::size_t vertex_count) {
  if (!(number >= 0 && number < static_cast<double>(vertex_count) && number == std::floor(number))) return {};
  return static_cast<std::uint32_t>(number);
}

// Reads the rows of one element. Returns what is wrong with them.
class PlyRows {
 public:
  PlyRows(const PlyElement& element, PlyValues& in, PlyParts& parts) : element_(element), in_(in), parts_(parts) {}

  std::string read() {
    // Programs use these names; the format itself fixes only vertex and face.
    const bool is_points = element_.name == "vertex" || element_.name == "point";
    const bool is_edges = element_.name == "edge";
    const bool is_strands = element_.name == "strand" || element_.name == "strands" || element_.name == "curve" ||
                            element_.name == "polyline" || element_.name == "line" || element_.name == "fiber";
    // Faces without strands are worth a hint in the error: the file is a mesh.
    if (element_.name == "face") parts_.face_count += element_.count;
    if (is_points && !has({"x", "y", "z"})) return "its vertices have no x, y and z";
    if (is_edges && !has({"vertex1", "vertex2"})) return "its edges have no vertex1 and vertex2";
    for (std::uint64_t row = 0; row < element_.count; ++row) {
      if (!read_row()) return "truncated, or no number, in " + shown(element_.name) + ' ' + std::to_string(row);
      std::string error;
      if (is_points) take_point();
      if (is_edges) error = take_edge();
      if (is_strands) error = take_strand();
      if (element_.name == "face" && parts_.wants_faces) error = take_face();
      if (!error.empty()) return shown(element_.name) + ' ' + std::to_string(row) + ": " + error;
    }
    return {};
  }

 private:
  // The columns of the names, none of which may be a list.
  template <std::size_t N>
  bool has(const std::string_view (&names)[N]) {
    for (std::size_t i = 0; i < N; ++i) {
      const auto at = element_.property({&names[i], 1});
      if (!at || element_.properties[*at].list) return false;
      columns_[i] = *at;
    }
    return true;
  }

  bool read_row() {
    values_.clear();
    list_.clear();
    for (const PlyProperty& property : element_.properties) {
      const std::optional<double> value = in_.next(property.list.value_or(property.number));
      if (!value) return false;
      values_.push_back(*value);
      if (!property.list) continue;
      // Lists of other names are skipped item by item, as nothing else tells where they end.
      const bool is_taken = std::ranges::find(kListNames, property.name) != kListNames.end() &&
                            (element_.name != "face" || parts_.wants_faces);
      // Each item takes a byte or a character at least, so a larger count is false.
      if (!(*value >= 0 && *value <= static_cast<double>(in_.remaining()))) return false;
      for (auto left = static_cast<std::size_t>(*value); left > 0; --left) {
        const std::optional<double> item = in_.next(property.number);
        if (!item) return false;
        if (is_taken) list_.push_back(*item);
      }
    }
    return true;
  }

  void take_point() {
    Vec3f& point = parts_.points.emplace_back();
    for (int axis = 0; axis < 3; ++axis)
      point[axis] = static_cast<float>(values_[columns_[static_cast<std::size_t>(axis)]]);
    if (const auto strand = element_.property(kStrandNames)) parts_.strand_of.push_back(values_[*strand]);
    if (const auto width = element_.property(kWidthNames)) parts_.widths.push_back(static_cast<float>(values_[*width]));
    if (const auto group = element_.property(kGroupNames)) parts_.groups.push_back(values_[*group]);
    constexpr std::array<std::array<std::string_view, 2>, 3> kColours{{{"red", "r"}, {"green", "g"}, {"blue", "b"}}};
    Vec3f colour;
    for (int i = 0; i < 3; ++i) {
      const auto at = element_.property(kColours[static_cast<std::size_t>(i)]);
      if (!at) return;
      // Whole numbers of colours are 0 to 255; reals are 0 to 1.
      const double scale = element_.properties[*at].number < PlyNumber::f32 ? 255 : 1;
      colour[i] = static_cast<float>(values_[*at] / scale);
    }
    parts_.colours.push_back(colour);
  }

  std::string take_edge() {
    const auto a = vertex_of(values_[columns_[0]], parts_.points.size()),
               b = vertex_of(values_[columns_[1]], parts_.points.size());
    if (!a || !b) return "no such vertex among the " + std::to_string(parts_.points.size()) + " before it";
    parts_.edges.push_back({*a, *b});
    return {};
  }

  // A polygon becomes a fan. `triangle` keeps the first corner and the last two.
  std::string take_face() {
    std::array<std::uint32_t, 3> triangle{};
    for (std::size_t i = 0; i < list_.size(); ++i) {
      const auto vertex = vertex_of(list_[i], parts_.points.size());
      if (!vertex) return "no such vertex among the " + std::to_string(parts_.points.size()) + " before it";
      if (i > 2) triangle[1] = triangle[2];
      triangle[std::min<std::size_t>(i, 2)] = *vertex;
      if (i >= 2) parts_.triangles.push_back(triangle);
    }
    return {};
  }

  std::string take_strand() {
    if (!list_.empty()) {
      for (const double index : list_) {
        const auto vertex = vertex_of(index, parts_.points.size());
        if (!vertex) return "no such vertex among the " + std::to_string(parts_.points.size()) + " before it";
        parts_.vertices.push_back(*vertex);
      }
      parts_.list_end.push_back(parts_.vertices.size());
    } else if (const auto at = element_.property(kCountNames); at && !element_.properties[*at].list) {
      // UINT32_MAX bounds the count of one strand; the sum is compared with the vertices later.
      const auto count = vertex_of(values_[*at], std::size_t{UINT32_MAX});
      if (!count) return "its number of points is no whole number";
      parts_.counts.push_back(*count);
    }
    return {};
  }

  const PlyElement& element_;
  PlyValues& in_;
  PlyParts& parts_;
  std::array<std::size_t, 3> columns_{};
  std::vector<double> values_, list_;
};

Result<PlyParts> read_parts(const PlyHeader& header, PlyValues in, bool wants_faces) {
  PlyParts parts;
  parts.wants_faces = wants_faces;
  for (const PlyElement& element : header.elements) {
    // The last row of a text may end without a blank.
    if (element.count > (in.remaining() + 1) / element.row_bytes(header.form))
      return Refusal("truncated: " + std::to_string(element.count) + " of " + shown(element.name) + " do not fit in " +
                     std::to_string(in.remaining()) + " bytes");
    if (std::string error = PlyRows(element, in, parts).read(); !error.empty()) return Refusal(std::move(error));
  }
  return parts;
}

// Guesses how many points each strand has, where all strands follow each other and have equally many. Neighbouring
// strands lie far apart compared with the points within one, so the guess makes the steps between strands longest
// beside the other steps. Returns 0 where no number stands out.
std::size_t points_of_each(std::span<const Vec3f> points) {
  // The numbers that are tried.
  constexpr std::size_t kMin = 3, kMax = 1024;
  // Below 5 times, curls or noise could look like the step to another strand.
  constexpr double kStandsOut = 5;
  std::vector<double> steps;
  double all = 0;
  for (std::size_t i = 1; i < points.size(); ++i) {
    const double step = (points[i] - points[i - 1]).cast<double>().norm();
    steps.push_back(std::isfinite(step) ? step : 0);
    all += steps.back();
  }
  std::size_t best = 0;
  double best_ratio = kStandsOut;
  for (std::size_t count = kMin; count <= std::min(kMax, points.size() / 2); ++count) {
    if (points.size() % count != 0) continue;
    double between = 0;
    std::size_t jumps = 0;
    // Only divisors of the number of points are tried. Each trial looks only at every count-th step, so all trials
    // together cost a few passes.
    for (std::size_t i = count - 1; i < steps.size(); i += count, ++jumps) between += steps[i];
    const double within = (all - between) / static_cast<double>(steps.size() - jumps);
    const double ratio = between / static_cast<double>(jumps) / std::max(within, 1e-30);
    if (ratio <= best_ratio) continue;
    best = count;
    best_ratio = ratio;
  }
  return best;
}

// The strands as lists of vertices, one behind the other.
struct PlyStrands {
  std::vector<std::uint32_t> vertices;
  std::vector<std::size_t> end;
  std::string note;
};

// Tries the ways in which a file may say its strands, the clearest first. The last way is a guess, which leaves a
// doubt.
Result<PlyStrands> find_strands(const PlyParts& parts) {
  const std::size_t count = parts.points.size();
  PlyStrands strands;
  const auto all_in_order = [&] {
    strands.vertices.resize(count);
    std::iota(strands.vertices.begin(), strands.vertices.end(), 0U);
  };
  if (!parts.edges.empty()) {
    Chains chains = chain_edges(parts.edges, count);
    strands.vertices = std::move(chains.vertices);
    strands.end.assign(chains.begin.begin() + 1, chains.begin.end());
  } else if (!parts.strand_of.empty() && parts.strand_of.size() == count) {
    all_in_order();
    // The sort is stable: points of one strand keep the order of the file, which is from root to tip.
    std::ranges::stable_sort(strands.vertices, {}, [&](std::uint32_t v) { return parts.strand_of[v]; });
    for (std::size_t i = 1; i <= count; ++i) {
      if (i == count || parts.strand_of[strands.vertices[i]] != parts.strand_of[strands.vertices[i - 1]])
        strands.end.push_back(i);
    }
  } else if (!parts.list_end.empty()) {
    strands.vertices = parts.vertices;
    strands.end = parts.list_end;
  } else if (!parts.counts.empty()) {
    all_in_order();
    std::size_t end = 0;
    for (const std::uint32_t points : parts.counts) strands.end.push_back(end += points);
    if (end != count)
      return Refusal("its strands have " + std::to_string(end) + " points, and there are " + std::to_string(count));
  } else if (parts.face_count > 0) {
    return Refusal("no strands: it has a mesh of " + counted(parts.face_count, "face"));
  } else {
    const std::size_t each = points_of_each(parts.points);
    if (each == 0)
      return Refusal("no strands: it has " + counted(count, "point") +
                     ", without edges, strand_id, or a number of points after which each strand ends");
    all_in_order();
    for (std::size_t end = each; end <= count; end += each) strands.end.push_back(end);
    strands.note = "nothing says where strands end: they are taken as of " + std::to_string(each) + " points each";
  }
  return strands;
}

}  // namespace

Result<ImportedStrands> decode_ply(std::span<const std::byte> bytes) {
  std::string_view text(reinterpret_cast<const char*>(bytes.data()), bytes.size());
  const Result<PlyHeader> header = read_header(text);
  if (!header) return Refusal(header.error());
  const Result<PlyParts> parts = read_parts(*header, PlyValues(header->form, text), false);
  if (!parts) return Refusal(parts.error());
  const Result<PlyStrands> strands = find_strands(*parts);
  if (!strands) return Refusal(strands.error());
  CurveSet set;
  // Colours, widths and groups are used only where each vertex has one.
  const bool has_colours = parts->colours.size() == parts->points.size();
  const bool has_widths = parts->widths.size() == parts->points.size();
  const bool has_groups = parts->groups.size() == parts->points.size();
  for (const std::size_t end : strands->end) {
    const std::size_t begin = set.begin.back();
    for (std::size_t i = begin; i < end; ++i) {
      set.controls.push_back(parts->points[strands->vertices[i]]);
      if (has_colours) set.colours.push_back(parts->colours[strands->vertices[i]]);
      if (has_widths) set.widths.push_back(parts->widths[strands->vertices[i]]);
    }
    set.begin.push_back(static_cast<std::uint32_t>(end));
    if (has_groups) {
      // A strand is in the group of its root.
      const double group = begin == end ? 0 : parts->groups[strands->vertices[begin]];
      const auto named = header->group_names.find(group);
      set.groups.push_back(named == header->group_names.end() ? numbered_group(group) : named->second);
    }
  }
  Result<ImportedStrands> made = strands_of({&set, 1});
  if (made && !strands->note.empty()) made->doubts.push_back(strands->note);
  return made;
}

Result<TriangleMesh> decode_ply_mesh(std::span<const std::byte> bytes) {
  std::string_view text(reinterpret_cast<const char*>(bytes.data()), bytes.size());
  const Result<PlyHeader> header = read_header(text);
  if (!header) return Refusal(header.error());
  Result<PlyParts> parts = read_parts(*header, PlyValues(header->form, text), true);
  if (!parts) return Refusal(parts.error());
  if (parts->triangles.empty()) return Refusal("not a mesh: it has no faces with vertex_indices");
  if (!std::ranges::all_of(parts->points, [](const Vec3f& x) { return x.allFinite(); }))
    return Refusal("a vertex is not finite");
  return TriangleMesh{std::move(parts->points), std::move(parts->triangles)};
}

}  // namespace hairnet
