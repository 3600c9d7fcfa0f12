#include <algorithm>
#include <array>
#include <cmath>
#include <limits>
#include <map>
#include <set>
#include <string>
#include <utility>

#include "client/assets/import/curve_sets.hpp"
#include "client/assets/import/parse_text.hpp"
#include "client/assets/import/placement.hpp"
#include "client/assets/import/strands.hpp"
#include "client/assets/import/usd_layer.hpp"
#include "client/assets/import/usd_transform.hpp"
#include "client/assets/import/usda.hpp"
#include "core/groom/groom.hpp"
#include "core/shown_text.hpp"

// Curves of a USD file in its text form: BasisCurves prims, each as a group of strands in the coordinates of the scene.
namespace hairnet {
namespace {

using Mat4 = Eigen::Matrix4d;
using usda::Attribute;
using usda::Layer;
using usda::Prim;

// This time is before all samples, so an attribute gives its first sample there.
constexpr double kFirst = -std::numeric_limits<double>::infinity();
// A line names at most this many things.
constexpr std::size_t kListedMax = 12;

// A line of names for the user: the first kListedMax names, and the number of the others.
class NameLine {
 public:
  void add(std::string_view name) {
    if (count_++ < kListedMax) text_ += (text_.empty() ? "" : ", ") + shown(name);
  }
  [[nodiscard]] std::size_t count() const { return count_; }
  [[nodiscard]] std::string text() const {
    return count_ <= kListedMax ? text_ : text_ + " and " + std::to_string(count_ - kListedMax) + " more";
  }

 private:
  std::size_t count_ = 0;
  std::string text_;
};

// What a prim has from the prims above it. It is copied for each prim and then changed.
struct State {
  Mat4 world = Mat4::Identity();
  // Why the prims below are not drawn; empty: they are drawn.
  std::string hidden;
  std::string purpose;
  std::size_t skel_root = usda::kNone;
  bool is_animated = false;
};

// Where the values of a primvar belong: those of curve c are [begin[c], begin[c] + count[c]). So every attribute is
// read in one way, whatever its interpolation.
struct Spread {
  std::vector<std::uint32_t> begin, count;
  // Empty when the values are not indexed.
  std::vector<std::int64_t> indices;

  [[nodiscard]] std::size_t value(std::size_t curve, std::size_t i) const {
    return indices.empty() ? begin[curve] + i : static_cast<std::size_t>(indices[begin[curve] + i]);
  }
};

// Whether a prim is a set of curves.
bool is_curves(const Prim& prim) {
  if (prim.type == "BasisCurves") return true;
  // An `over` changes a prim that may lie in another file, and then has no type of its own.
  return prim.type.empty() && usda::attribute(prim, "curveVertexCounts").exists();
}

// The number of ends of segments of a curve, for values that a file gives there. An open curve of a cubic basis has one
// end more than segments.
std::size_t ends_of(CurveBasis basis, CurveWrap wrap, std::size_t controls) {
  if (basis == CurveBasis::linear) return controls;
  if (basis == CurveBasis::bezier) return wrap == CurveWrap::periodic ? controls / 3 : (controls + 2) / 3;
  if (wrap == CurveWrap::open) return controls > 2 ? controls - 2 : 0;
  return controls;
}

class Reader {
 public:
  explicit Reader(Layer layer) : layer_(std::move(layer)), states_(layer_.prims.size()) {}

  // The walk needs no recursion, because each prim stands behind its parent in the list.
  Result<ImportedStrands> read() {
    read_facts();
    for (std::size_t p = 0; p < layer_.prims.size(); ++p) {
      states_[p] = state_of(p);
      read_prim(p);
    }
    // The check is for control points and not for sets, since all curves of a file may be left out.
    if (control_count_ == 0) return Refusal(nothing_to_read());
    name_sets();
    if (const std::string error = make_strands(sets_, out_); !error.empty()) return Refusal(error);
    tell();
    return std::move(out_);
  }

 private:
  void read_facts() {
    const std::string_view metadata = layer_.prims[0].metadata;
    const std::string up = usda::unquoted(usda::field(metadata, "upAxis"));
    if (up == "X") out_.up = Axis::plus_x;
    if (up == "Y") out_.up = Axis::plus_y;
    if (up == "Z") out_.up = Axis::plus_z;
    const std::string_view unit = usda::field(metadata, "metersPerUnit");
    const std::optional<double> unit_m = parse_number<double>(unit);
    if (unit_m && *unit_m > 0) out_.unit_m = unit_m;
    if (!unit.empty() && !out_.unit_m) out_.doubts.push_back("metersPerUnit is no positive number: " + shown(unit));
    for (const std::string& file : usda::strings(usda::field(metadata, "subLayers"))) others_.add(file);
  }

  // Hidden prims are visited too: their types are named in the message when nothing is left.
  State state_of(std::size_t p) {
    const Prim& prim = layer_.prims[p];
    if (p == 0) return {};
    State state = states_[prim.parent];
    const usda::LocalTransform local = usda::local_transform(prim);
    state.world = local.resets ? local.matrix : Mat4(state.world * local.matrix);
    state.is_animated = (state.is_animated && !local.resets) || local.is_animated;
    for (const std::string& name : local.unread) unread_operations_.add(name);
    if (const Attribute purpose = usda::attribute(prim, "purpose"); purpose.exists())
      state.purpose = usda::unquoted(purpose.at(kFirst));
    if (prim.type == "SkelRoot") state.skel_root = p;
    // The first reason for being hidden stays, as it is the one that stands highest.
    if (!state.hidden.empty()) return state;
    if (usda::unquoted(usda::attribute(prim, "visibility").at(kFirst)) == "invisible") state.hidden = "invisible";
    if (usda::field(prim.metadata, "active") == "false" || usda::field(prim.metadata, "active") == "0")
      state.hidden = "not active";
    if (prim.specifier == "class") state.hidden = "in a class";
    if (prim.type == "PointInstancer") state.hidden = "prototypes of a PointInstancer";
    return state;
  }

  void read_prim(std::size_t p) {
    const Prim& prim = layer_.prims[p];
    if (!prim.type.empty()) ++types_[prim.type];
    for (const std::string_view key : {"references", "payload", "inherits", "specializes"}) {
      for (const std::string& other : usda::strings(usda::field(prim.metadata, key))) others_.add(other);
    }
    // The first prim is the file itself: it has no parent and holds no curves, whatever attributes it has.
    if (p == 0 || !is_curves(prim)) return;
    const State& state = states_[p];
    std::string hidden = state.hidden;
    if (hidden.empty() && (state.purpose == "guide" || state.purpose == "proxy"))
      hidden = "of purpose " + state.purpose;
    // Hidden curves are named with their reason, so that users can find out why hair is missing.
    if (!hidden.empty()) return hidden_[hidden].add(prim.name);
    if (const std::string error = read_curves(p); !error.empty())
      out_.doubts.push_back(shown(prim.name) + ": " + error + ", and is left out");
  }

  std::string read_curves(std::size_t p) {
    const Prim& prim = layer_.prims[p];
    const Attribute counts = usda::attribute(prim, "curveVertexCounts"), points = usda::attribute(prim, "points");
    if (!counts.exists() || !points.exists()) return "it has no " + std::string(counts.exists() ? "points" : "counts");
    // All attributes are read at one time, at which the curves exist.
    const double time = first_time(counts, points);
    const auto sizes = usda::integers(counts.at(time));
    if (!sizes) return "its curveVertexCounts are no whole numbers";
    auto controls = usda::triples(points.at(time));
    if (!controls) return "its points are no triples of numbers";
    if (counts.samples.size() > 1 || points.samples.size() > 1) moving_.add(prim.name);

    CurveSet set;
    set.name = usda::unquoted(prim.name);
    read_basis(prim, set);
    std::string error = read_counts(*sizes, controls->size(), set);
    if (set.curve_count() == 0) return error.empty() ? "it has no curves" : error;
    if (!error.empty()) out_.doubts.push_back(shown(prim.name) + ": " + error);
    // Points beyond the counts belong to no curve.
    controls->resize(set.begin.back());
    set.controls = std::move(*controls);
    const Mat4 world = world_of(p);
    // World coordinates are those of the scene, in its unit. Curves become points only after this, so that tolerance is
    // measured where the hair is seen.
    for (Vec3f& x : set.controls)
      x = (world.topLeftCorner<3, 3>() * x.cast<double>() + world.topRightCorner<3, 1>()).cast<float>();
    read_primvars(prim, time, world, set);
    if (states_[p].is_animated) animated_.add(prim.name);
    control_count_ += set.controls.size();
    sets_.push_back(std::move(set));
    prims_of_sets_.push_back(p);
    return {};
  }

  // The first time at which there are curves. Simulated hair often has an empty sample before it begins.
  static double first_time(const Attribute& counts, const Attribute& points) {
    const Attribute& timed = counts.samples.empty() ? points : counts;
    const auto is_filled = [](const usda::Sample& sample) {
      return sample.value.find_first_of("0123456789") != std::string_view::npos;
    };
    const auto filled = std::ranges::find_if(timed.samples, is_filled);
    return filled == timed.samples.end() ? kFirst : filled->time;
  }

  void read_basis(const Prim& prim, CurveSet& set) {
    // USD's defaults are cubic Bezier curves that do not wrap.
    const auto token = [&](std::string_view name, std::string otherwise) {
      std::string word = usda::unquoted(usda::attribute(prim, name).at(kFirst));
      return word.empty() ? otherwise : word;
    };
    const std::string type = token("type", "cubic"), basis = token("basis", "bezier"),
                      wrap = token("wrap", "nonperiodic");
    const auto doubt = [&](const std::string& what) {
      out_.doubts.push_back(shown(prim.name) + ": " + what + ": read as straight lines between its points");
    };
    if (type == "cubic" && basis == "bezier") set.basis = CurveBasis::bezier;
    if (type == "cubic" && basis == "bspline") set.basis = CurveBasis::bspline;
    if (type == "cubic" && (basis == "catmullRom" || basis == "catmull-rom")) set.basis = CurveBasis::catmull_rom;
    if (type != "linear" && type != "cubic") doubt("its curves are " + shown(type) + ", not linear or cubic");
    if (type == "cubic" && set.basis == CurveBasis::linear) doubt("a basis " + shown(basis) + " is not known");
    if (wrap == "periodic") set.wrap = CurveWrap::periodic;
    if (wrap == "pinned") set.wrap = CurveWrap::pinned;
    if (set.wrap == CurveWrap::periodic) closed_.add(prim.name);
  }

  // Divides the points among the curves, as far as the points reach: everything behind a wrong count would be shifted.
  // Returns what does not add up.
  static std::string read_counts(const std::vector<std::int64_t>& sizes, std::size_t point_count, CurveSet& set) {
    std::size_t end = 0;
    for (const std::int64_t size : sizes) {
      if (size < 0 || static_cast<std::uint64_t>(size) > point_count - end) break;
      end += static_cast<std::size_t>(size);
      set.begin.push_back(static_cast<std::uint32_t>(end));
    }
    if (const std::size_t left_out = sizes.size() - set.curve_count(); left_out > 0)
      return "curveVertexCounts do not fit its " + counted(point_count, "point") + " from curve " +
             std::to_string(set.curve_count()) + " on: " + std::to_string(left_out) + " of " +
             counted(sizes.size(), "curve") + " left out";
    if (end < point_count)
      return std::to_string(point_count - end) + " of its " + counted(point_count, "point") +
             " belong to no curve by curveVertexCounts, and are left out";
    return {};
  }

  // Curves that follow a skeleton are placed by it: at rest, where they were bound to it. The bind transform leads to
  // the SkelRoot's space, not through the prim's own transforms.
  Mat4 world_of(std::size_t p) {
    const Prim& prim = layer_.prims[p];
    if (!usda::attribute(prim, "primvars:skel:jointIndices").exists()) return states_[p].world;
    at_rest_.add(prim.name);
    const Attribute bound = usda::attribute(prim, "primvars:skel:geomBindTransform");
    const std::optional<Mat4> matrix = usda::matrix_of(bound.at(kFirst));
    if (!matrix || states_[p].skel_root == usda::kNone) return states_[p].world;
    return states_[states_[p].skel_root].world * *matrix;
  }

  void read_primvars(const Prim& prim, double time, const Mat4& world, CurveSet& set) {
    // The primvar counts before the plain attribute of the same name, as USD demands.
    for (const char* name : {"primvars:widths", "widths"}) {
      if (!set.widths.empty()) break;
      const Attribute widths = usda::attribute(prim, name);
      if (!widths.exists()) continue;
      const auto values = usda::numbers(widths.at(time));
      if (values && values->empty()) continue;
      const auto spread = values ? spread_of(prim, name, time, values->size(), set) : std::nullopt;
      if (!spread) {
        unspread_.add(set.name + " " + name);
        continue;
      }
      // Widths scale with the mean scale of all directions.
      const auto scale = static_cast<float>(std::cbrt(std::abs(world.topLeftCorner<3, 3>().determinant())));
      set.widths = of_controls<float>(*spread, set, 0, [&](std::size_t i) {
        const double width = (*values)[i];
        return std::isfinite(width) && width > 0 ? scale * static_cast<float>(width) : 0;
      });
    }
    if (const Attribute colour = usda::attribute(prim, "primvars:displayColor"); colour.exists()) {
      const auto values = usda::triples(colour.at(time));
      const auto spread = values ? spread_of(prim, "primvars:displayColor", time, values->size(), set) : std::nullopt;
      if (spread)
        set.colours = of_controls<Vec3f>(*spread, set, Vec3f::Zero(), [&](std::size_t i) { return (*values)[i]; });
      if (!spread) unspread_.add(set.name + " displayColor");
    }
    read_groups(prim, time, set);
  }

  // The values at control points. Those at the ends of segments are spread evenly along a curve.
  template <class Value, class ValueOf>
  static std::vector<Value> of_controls(const Spread& spread, const CurveSet& set, const Value& zero,
                                        ValueOf value_of) {
    std::vector<Value> values;
    for (std::size_t c = 0; c < set.curve_count(); ++c) {
      const std::size_t controls = set.begin[c + 1] - set.begin[c], count = spread.count[c];
      for (std::size_t i = 0; i < controls; ++i) {
        if (count == 0) {
          values.push_back(zero);
          continue;
        }
        // The values at segments' ends lie at even steps of the control points, which is exact for linear curves and
        // close for others.
        const float at = controls < 2 ? 0 : static_cast<float>(i * (count - 1)) / static_cast<float>(controls - 1);
        const auto before = static_cast<std::size_t>(at), after = std::min(before + 1, count - 1);
        const float share = at - static_cast<float>(before);
        values.push_back(Value((1 - share) * Value(value_of(spread.value(c, before))) +
                               share * Value(value_of(spread.value(c, after)))));
      }
    }
    return values;
  }

  // Groups as programs name them: by names, or by numbers. The list is in the order of preference: names of groups say
  // more to a user than numbers. Case is ignored.
  void read_groups(const Prim& prim, double time, CurveSet& set) {
    constexpr std::array<std::string_view, 8> kGroups{"groom_group_name", "groom_group_id", "group_name", "groupname",
                                                      "group_id",         "groupid",        "group",      "hairgroup"};
    constexpr std::string_view kPrimvars = "primvars:", kIndices = ":indices";
    constexpr std::array<std::string_view, 6> kKnown{"displayColor", "displayOpacity", "widths", "normals", "st", "uv"};
    const auto lower = [](std::string_view name) {
      std::string small(name);
      for (char& c : small) c = c >= 'A' && c <= 'Z' ? static_cast<char>(c - 'A' + 'a') : c;
      return small;
    };
    std::vector<std::string_view> names;
    for (const usda::Statement& statement : prim.statements) {
      const std::string_view name = statement.name;
      if (name.starts_with(kPrimvars) && !name.ends_with(kIndices)) names.push_back(name.substr(kPrimvars.size()));
    }
    std::string_view used;
    for (const std::string_view group : kGroups) {
      const auto found = std::ranges::find(names, group, lower);
      if (found == names.end()) continue;
      used = *found;
      if (read_group_names(prim, std::string(kPrimvars) + std::string(used), time, set)) break;
      used = {};
    }
    for (const std::string_view name : names) {
      const bool is_known = std::ranges::find(kKnown, name) != kKnown.end() || name.starts_with("skel:");
      // Each unused name is told once, however many prims have it.
      if (!is_known && name != used && unused_primvars_.insert(name).second) unused_.add(name);
    }
  }

  static bool read_group_names(const Prim& prim, std::string_view name, double time, CurveSet& set) {
    const std::string_view text = usda::attribute(prim, name).at(time);
    std::vector<std::string> values;
    if (const auto ids = usda::integers(text)) {
      for (const std::int64_t id : *ids) values.push_back("group " + std::to_string(id));
    } else {
      // A single name without an array is one value for all curves.
      values = usda::strings(text);
    }
    const auto spread = spread_of(prim, name, time, values.size(), set);
    if (!spread || std::ranges::any_of(spread->count, [](std::uint32_t count) { return count == 0; })) return false;
    for (std::size_t c = 0; c < set.curve_count(); ++c) set.groups.push_back(values[spread->value(c, 0)]);
    return true;
  }

  // Finds where `value_count` values belong: by the interpolation that the file states, else by their number. None if
  // they fit nothing.
  static std::optional<Spread> spread_of(const Prim& prim, std::string_view name, double time, std::size_t value_count,
                                         const CurveSet& set) {
    Spread spread;
    const Attribute indices = usda::attribute(prim, std::string(name) + ":indices");
    if (indices.exists()) {
      const auto read = usda::integers(indices.at(time));
      const auto is_bad = [&](std::int64_t i) { return i < 0 || static_cast<std::uint64_t>(i) >= value_count; };
      if (!read || read->empty() || std::ranges::any_of(*read, is_bad)) return {};
      spread.indices = *read;
      value_count = read->size();
    }
    // With an interpolation in the file the first fit for that kind counts; without one, kinds are tried from the
    // coarsest to the finest.
    const std::string said = usda::unquoted(usda::field(usda::attribute(prim, name).metadata, "interpolation"));
    for (const std::string_view kind : {"constant", "uniform", "vertex", "varying", "faceVarying"}) {
      if (!said.empty() && said != kind) continue;
      spread.begin.clear();
      spread.count.clear();
      std::size_t end = kind == "constant" ? 1 : 0;
      for (std::size_t c = 0; c < set.curve_count(); ++c) {
        const std::size_t controls = set.begin[c + 1] - set.begin[c];
        const std::size_t count = kind == "constant" || kind == "uniform" ? 1
                                  : kind == "vertex"                      ? controls
                                                                          : ends_of(set.basis, set.wrap, controls);
        spread.begin.push_back(static_cast<std::uint32_t>(kind == "constant" ? 0 : end));
        spread.count.push_back(static_cast<std::uint32_t>(count));
        if (kind != "constant") end += count;
      }
      // A file that says its interpolation may have more values than it needs; one that does not must have exactly as
      // many.
      if (end == value_count || (!said.empty() && end < value_count)) return spread;
    }
    return {};
  }

  // The name of a prim of curves is that of its group, with that of the prim above it where others have the same. Two
  // prims called "hair" below "left" and "right" become groups "left/hair" and "right/hair".
  void name_sets() {
    std::map<std::string, std::size_t> uses;
    for (const CurveSet& set : sets_) ++uses[set.name];
    for (std::size_t s = 0; s < sets_.size(); ++s) {
      const Prim& above = layer_.prims[layer_.prims[prims_of_sets_[s]].parent];
      if (uses[sets_[s].name] > 1 && !above.name.empty()) sets_[s].name = std::string(above.name) + '/' + sets_[s].name;
    }
  }

  // Notes say what was chosen where the file leaves a choice. Doubts say what is missing from the groom.
  void tell() {
    const auto note = [&](const NameLine& names, const std::string& what) {
      if (names.count() > 0) out_.notes.push_back(what + ": " + names.text());
    };
    note(moving_, "curves that change are taken at the first time they are there");
    note(animated_, "a transform that changes is taken at its first time, above");
    note(at_rest_, "curves that follow a skeleton are taken at rest");
    note(unused_, "primvars that are not used");
    for (const auto& [error, names] : hidden_)
      out_.doubts.push_back("curves " + error + " are skipped: " + names.text());
    const auto doubt = [&](const NameLine& names, const std::string& what) {
      if (names.count() > 0) out_.doubts.push_back(what + ": " + names.text());
    };
    doubt(closed_, "closed curves are cut open where they begin");
    doubt(unspread_, "values that do not fit the number of curves and points are not read");
    doubt(unread_operations_, "operations of transforms that cannot be read are skipped");
    for (const std::string& line : elsewhere()) out_.doubts.push_back(line);
  }

  // Where more hair may be than was read.
  [[nodiscard]] std::vector<std::string> elsewhere() const {
    std::vector<std::string> lines;
    if (others_.count() > 0)
      lines.push_back("what it refers to is not read (usdcat --flatten joins it): " + others_.text());
    if (!layer_.skipped_variants.empty())
      lines.push_back("variants with curves are not selected: " + shown(layer_.skipped_variants.front()) +
                      (layer_.skipped_variants.size() > 1 ? ", ..." : ""));
    return lines;
  }

  // Says what the file has instead of curves, so that users see which export to choose.
  [[nodiscard]] std::string nothing_to_read() const {
    std::string line = "no curves: ";
    if (!out_.doubts.empty()) return line + out_.doubts.front();
    if (!hidden_.empty()) {
      const auto& [error, names] = *hidden_.begin();
      line.append("those that there are, are ").append(error).append(": ").append(names.text());
      return line;
    }
    std::string has;
    for (const auto& [type, what] : {std::pair<std::string_view, const char*>{"Mesh", "mesh"},
                                     {"NurbsCurves", "NurbsCurves prim"},
                                     {"HermiteCurves", "HermiteCurves prim"},
                                     {"Points", "prim of Points"},
                                     {"PointInstancer", "PointInstancer"}}) {
      const auto found = types_.find(type);
      if (found != types_.end()) has += (has.empty() ? "it has " : ", ") + counted(found->second, what);
    }
    line += has.empty() ? "it has no BasisCurves" : has;
    for (const std::string& more : elsewhere()) line += "; " + more;
    return line;
  }

  Layer layer_;
  std::vector<State> states_;
  std::vector<CurveSet> sets_;
  std::vector<std::size_t> prims_of_sets_;
  std::size_t control_count_ = 0;
  ImportedStrands out_;
  std::map<std::string_view, std::size_t> types_;
  // The names of hidden curves, by the reason.
  std::map<std::string, NameLine> hidden_;
  std::set<std::string_view> unused_primvars_;
  NameLine others_, moving_, animated_, at_rest_, closed_, unused_, unspread_, unread_operations_;
};

}  // namespace

Result<ImportedStrands> decode_usd_curves(std::span<const std::byte> bytes) {
  std::string unpacked;
  Result<Layer> layer = usda::open_layer(bytes, usda::Content::curves, unpacked);
  if (!layer) return Refusal(layer.error());
  return Reader(std::move(*layer)).read();
}

}  // namespace hairnet
