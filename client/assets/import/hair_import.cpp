#include "client/assets/import/hair_import.hpp"

#include <algorithm>
#include <cmath>
#include <cstdio>
#include <iterator>
#include <utility>

#include "client/assets/import/fill_strands.hpp"
#include "client/assets/import/guess_placement.hpp"
#include "client/assets/import/guess_roots.hpp"
#include "client/assets/import/outliers.hpp"
#include "core/shown_text.hpp"

namespace hairnet {
namespace {

// At most this many outliers of a file have a line of their own. A broken exporter can make thousands, for which a
// count is enough.
constexpr std::size_t kListedMax = 5;
// A groom file rounds to this. A file that rounds more coarsely has lost something that a groom would keep.
constexpr double kRounded_m = 0.00005;

std::string with_digits(double x) {
  char text[32];
  std::snprintf(text, sizeof text, "%.3g", x);
  return text;
}

// What was decided, and what speaks against taking the files as they are. With `strict`, any doubt refuses the import;
// notes never do.
struct Remarks {
  std::vector<std::string> notes, doubts;
};

std::string describe(const Outlier& outlier, double unit_m) {
  const std::string size = with_digits(outlier.size * unit_m) + " m",
                    usual = with_digits(outlier.usual * unit_m) + " m";
  switch (outlier.kind) {
    case Outlier::Kind::no_length:
      return "has no length, and is dropped";
    case Outlier::Kind::stray_point:
      return (outlier.point_count == 1 ? "point " + std::to_string(outlier.point) + " is stray"
                                       : std::to_string(outlier.point_count) + " points are stray") +
             ", " + size + " from the middle of the hair, which reaches " + usual + ", and is cut off";
    case Outlier::Kind::far_away:
      return "lies " + size + " from the middle of the hair, which reaches " + usual + ", and is dropped";
    case Outlier::Kind::too_long:
      return "is " + size + " long, where nearly all others are within " + usual + ", and is dropped";
  }
  return {};
}

// `strand_counts` are those before the cuts, because users know the numbers of their files.
void tell_outliers(const std::vector<Outlier>& outliers, const HairParts& parts,
                   const std::vector<std::size_t>& strand_counts, double unit_m, Remarks& remarks) {
  for (std::size_t f = 0; f < parts.strands.size(); ++f) {
    const std::string file = parts.strands[f].file + ": ", of = " of " + std::to_string(strand_counts[f]) + " strands ";
    std::size_t count = 0, without_length = 0, listed = 0;
    for (const Outlier& outlier : outliers) {
      if (outlier.file != f) continue;
      ++count;
      // Strands without length are named once and then counted, since they are all alike.
      if (outlier.kind == Outlier::Kind::no_length && ++without_length > 1) continue;
      if (outlier.kind != Outlier::Kind::no_length && ++listed > kListedMax) continue;
      remarks.doubts.push_back(file + "strand " + std::to_string(outlier.strand) + " " + describe(outlier, unit_m));
    }
    if (without_length > 1)
      remarks.doubts.push_back(file + std::to_string(without_length).append(of) + "have no length, and are dropped");
    if (count > 1)
      remarks.doubts.push_back(file + "something is wrong with " + std::to_string(count).append(of) + "in all");
  }
}

// What the decoders say of their files.
void tell_decoded(const HairParts& parts, Remarks& remarks) {
  for (const StrandFile& file : parts.strands) {
    for (const std::string& note : file.strands.notes) remarks.notes.push_back(file.file + ": " + note);
    for (const std::string& doubt : file.strands.doubts) remarks.doubts.push_back(file.file + ": " + doubt);
  }
}

// The distance between neighbouring 32-bit numbers at the median distance of the points from the origin, in units of
// the file. A single stray point does not change it.
double rounding_of(std::span<const StrandFile> files) {
  std::vector<float> far;
  for (const StrandFile& file : files) {
    for (const Vec3f& x : file.strands.points) far.push_back(x.cwiseAbs().maxCoeff());
  }
  if (far.empty()) return 0;
  const auto middle = far.begin() + static_cast<std::ptrdiff_t>(far.size() / 2);
  std::ranges::nth_element(far, middle);
  return static_cast<double>(std::nextafter(*middle, HUGE_VALF)) - static_cast<double>(*middle);
}

void tell_rounding(const HairParts& parts, double unit_m, Remarks& remarks) {
  const double step_m = rounding_of(parts.strands) * unit_m;
  if (step_m <= kRounded_m) return;
  remarks.doubts.push_back(parts.strands.front().file +
                           ": the hair is so far from the origin that 32-bit numbers round its points to " +
                           with_digits(1e3 * step_m) + " mm: move it to the origin before it is written");
}

bool is_any_known(const KnownPlacement& known) {
  return known.up || known.face || known.unit_m;
}

// Adds to `known` the axis upwards and the unit that the files state, so that these need not be guessed. Files that
// disagree state nothing, and values that the user has given are not replaced.
KnownPlacement with_stated(KnownPlacement known, std::span<const StrandFile> files, Remarks& remarks) {
  const auto add = [&](auto& value, auto stated, const char* what) {
    if (value) return;
    for (const StrandFile& file : files) {
      if (!stated(file.strands)) continue;
      // The second disagreement needs no line of its own, so the search ends.
      if (value && value != stated(file.strands)) {
        remarks.doubts.push_back(file.file + ": its " + what + " is not that of the files before it, and is guessed");
        value.reset();
        return;
      }
      value = stated(file.strands);
    }
  };
  add(
      known.up, [](const ImportedStrands& strands) { return strands.up; }, "axis upwards");
  add(
      known.unit_m, [](const ImportedStrands& strands) { return strands.unit_m; }, "unit");
  return known;
}

// The head joint of the body is also that of the strands, unless the strands have one of their own.
void share_head_joint(PlacedTogether& together, const KnownPlacement& of_body) {
  Placement &strands = together.strands, &body = together.body;
  if (strands.origin || !body.origin) {
    body.origin = of_body.origin;
    return;
  }
  // The joint goes from the body's file to head axes in metres, and from there to the strands' file.
  const Vec3 joint_m = body.unit_m * (rotation_to_head(body.up, body.face) * *body.origin);
  strands.origin = rotation_to_head(strands.up, strands.face).transpose() * joint_m / strands.unit_m;
}

// Places strands and body, together if the body fits.
Result<Placement> place_parts(const HairParts& parts, const KnownPlacement& known, const HairImport& import,
                              GroomDef& def, Remarks& remarks) {
  // Doubts about axes concern all files, so they begin with the name of the first.
  const std::string file = parts.strands.front().file + ": ";
  if (parts.body) {
    // The body's remarks are kept apart until it is certain that the body is used.
    Remarks of_file;
    const KnownPlacement of_body = known_of_body(parts, import.body, of_file.notes, of_file.doubts);
    // A body that fits determines axes better than hair does, so it is tried first.
    if (auto together = guess_together(parts.strands, parts.body->mesh, known, of_body)) {
      share_head_joint(*together, import.body);
      std::ranges::move(of_file.notes, std::back_inserter(remarks.notes));
      std::ranges::move(of_file.doubts, std::back_inserter(remarks.doubts));
      def.body = parts.body->mesh;
      def.body_placement = together->body;
      for (std::size_t b = 0; b < kBoneCount; ++b) {
        if (const auto& joint = parts.body->joints[b]) def.body_joints[b] = joint->position;
      }
      remarks.notes.push_back(parts.body_file + ": taken as " + to_string(together->body));
      return together->strands;
    }
  }
  // A body that does not fit must not refuse the hair: the strands are placed alone.
  std::vector<std::string> doubts;
  Result<Placement> alone = guess_placement(parts.strands, known, &doubts);
  if (!alone) return Refusal(file + alone.error());
  if (std::string error = validate(*alone); !error.empty()) return Refusal(file + error);
  for (const std::string& doubt : doubts) remarks.doubts.push_back(file + doubt);
  if (!parts.body) return alone;
  // Flags for the body are an order: it is then used even where it does not seem to fit.
  if (is_any_known(import.body)) {
    def.body = parts.body->mesh;
    def.body_placement = Placement{import.body.up.value_or(alone->up), import.body.face.value_or(alone->face),
                                   import.body.unit_m.value_or(alone->unit_m), import.body.origin};
  } else {
    remarks.doubts.push_back(parts.body_file +
                             ": does not fit under the hair in any usual axes and unit, and a skull is made instead; "
                             "--body-up, --body-face and --body-unit set them");
  }
  return alone;
}

// A message with the flags of the program that shows it. Guesses write the general names, since they do not know the
// program. The search goes on behind each replacement, which may contain the flag itself.
std::string with_flags(std::string text, const std::string& prefix) {
  for (const std::string flag : {"up", "face", "unit", "roots"}) {
    const std::string general = "--" + flag;
    for (std::size_t at = text.find(general); at != std::string::npos; at = text.find(general, at + prefix.size()))
      text.replace(at, general.size(), prefix + flag);
  }
  return text;
}

// Turns the strands root first. Returns what was found. Outliers must be cut before, as a stray point at one end would
// decide the comparison.
std::string settle_roots(HairParts& parts, const HairImport& import, Remarks& remarks) {
  const bool is_guess = import.roots == RootEnd::guess;
  if (import.roots == RootEnd::first || (is_guess && !are_tips_first(parts.strands))) return "roots first";
  turn_round(parts.strands);
  if (is_guess)
    remarks.doubts.push_back(parts.strands.front().file +
                             ": the strands are stored tip first and are turned round; --roots last says so, --roots "
                             "first keeps them");
  return "roots last";
}

Result<ImportedGroom> imported_parts(HairParts parts, const HairImport& import) {
  if (parts.strands.empty()) return Refusal("there are no strands");
  const std::string first = parts.strands.front().file + ": ";
  std::vector<std::size_t> strand_counts;
  std::size_t strand_count = 0;
  for (const StrandFile& file : parts.strands) strand_counts.push_back(file.strands.strand_count());
  Remarks remarks, of_placement;
  tell_decoded(parts, remarks);
  // What files state counts as known, before anything is guessed.
  const KnownPlacement known = with_stated(import.strands, parts.strands, remarks);
  // Cutting comes first: one point at 1e20 would make every later measure useless.
  const std::vector<Outlier> outliers = cut_outliers(parts.strands);
  for (const StrandFile& file : parts.strands) strand_count += file.strands.strand_count();
  if (strand_count == 0) return Refusal(first + "no strand has a length: all points of each lie in one place");

  const std::string roots = settle_roots(parts, import, of_placement);
  GroomDef def;
  def.name = parts.name;
  def.hairs_in_all = import.hairs_in_all;
  const Result<Placement> placement = place_parts(parts, known, import, def, of_placement);
  if (!placement) return Refusal(placement.error());
  def.placement = *placement;
  // The placement is the first line of all, because it explains the rest.
  remarks.notes.insert(remarks.notes.begin(), first + "taken as " + to_string(*placement) + ", " + roots);
  // Sizes of outliers are told in metres, which are known only after the placement.
  tell_outliers(outliers, parts, strand_counts, placement->unit_m, remarks);
  tell_rounding(parts, placement->unit_m, remarks);
  std::ranges::move(of_placement.notes, std::back_inserter(remarks.notes));
  std::ranges::move(of_placement.doubts, std::back_inserter(remarks.doubts));
  // All doubts of decoding, cutting and placing are known here. What the assembly warns of, such as hair without a root
  // on the skin, does not refuse.
  if (import.strict && !remarks.doubts.empty()) {
    const std::size_t more = remarks.doubts.size() - 1;
    return Refusal(remarks.doubts.front() + " (refused: strict" +
                   (more > 0 ? ", " + std::to_string(more) + " more" : "") + ")");
  }

  def.files = std::move(parts.strands);
  Result<ImportedGroom> imported = assemble_groom(def);
  if (!imported) return Refusal(first + imported.error());
  if (import.fill) {
    // Guides are filled in after the assembly, since the skin is needed.
    const std::size_t guide_count = imported->groom.strand_count();
    const Result<void> filled = fill_strands(*import.fill, imported->groom);
    if (!filled) return Refusal(first + filled.error());
    remarks.notes.push_back(first + "its " + std::to_string(guide_count) + " strands are guides, between which " +
                            std::to_string(*import.fill - guide_count) + " are filled in");
  }
  for (std::string& warning : imported->warnings) remarks.doubts.push_back(first + warning);
  imported->warnings = std::move(remarks.notes);
  std::ranges::move(remarks.doubts, std::back_inserter(imported->warnings));
  return imported;
}

}  // namespace

Result<RootEnd> parse_root_end(std::string_view text) {
  if (text == "guess") return RootEnd::guess;
  if (text == "first") return RootEnd::first;
  if (text == "last") return RootEnd::last;
  return Refusal("is not one of first, last, guess");
}

// The flags for axes count as a pair: with one of them given, a stated other could be parallel to it.
KnownPlacement known_of_body(const HairParts& parts, const KnownPlacement& given, std::vector<std::string>& notes,
                             std::vector<std::string>& doubts) {
  const KnownPlacement& stated = parts.body->states;
  const std::string file = parts.body_file + ": ";
  KnownPlacement known = given;
  if (!given.up && !given.face) {
    known.up = stated.up;
    known.face = stated.face;
  }
  if (!given.unit_m) known.unit_m = stated.unit_m;
  if (!given.origin) known.origin = stated.origin;
  for (const std::string& note : parts.body->notes) notes.push_back(file + note);
  if (known.origin && !given.origin) {
    const auto at = [&](int axis) {
      const double x = (*known.origin)[axis];
      return with_digits(std::abs(x) < 1e-6 * known.origin->norm() ? 0 : x);
    };
    notes.push_back(file + "the head joint is " + shown(parts.body->joints[0]->name) + " of its skeleton, at " + at(0) +
                    ',' + at(1) + ',' + at(2) + " in file units");
  }
  // A stated unit in which a head is seen is right. Many exporters state metres for files in centimetres, so one
  // without a head is doubted.
  if (given.unit_m || !stated.unit_m || guess_mesh_placement(parts.body->mesh, known)) return known;
  KnownPlacement guessed = known;
  guessed.unit_m.reset();
  const Result<Placement> placement = guess_mesh_placement(parts.body->mesh, guessed);
  if (!placement) return known;
  doubts.push_back(file + "its file says " + with_digits(*stated.unit_m) +
                   " m a unit, in which it has no head: taken as " + with_digits(placement->unit_m) +
                   " m a unit; hairnet-groom's --body-unit sets it");
  guessed.unit_m = placement->unit_m;
  return guessed;
}

Result<ImportedGroom> import_hair_parts(HairParts parts, const HairImport& import) {
  Result<ImportedGroom> imported = imported_parts(std::move(parts), import);
  if (!imported) return Refusal(with_flags(imported.error(), import.flag_prefix));
  for (std::string& warning : imported->warnings) warning = with_flags(std::move(warning), import.flag_prefix);
  return imported;
}

}  // namespace hairnet
