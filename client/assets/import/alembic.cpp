#include "client/assets/import/alembic.hpp"

#include <algorithm>
#include <array>
#include <cstdio>
#include <iterator>
#include <utility>

#include "client/assets/import/alembic_strands.hpp"
#include "client/assets/import/alembic_xform.hpp"
#include "client/assets/import/parse_text.hpp"
#include "core/shown_text.hpp"

namespace hairnet {
namespace {

// A line of notes names at most this many attributes.
constexpr std::size_t kNamesMax = 16;
// A small archive can describe many points, since each segment of a curve becomes up to 64 pieces. The limit bounds the
// memory of decoding; a groom's own, smaller limit is checked when it is assembled.
constexpr std::size_t kPointsMax = 50'000'000;
// A motion may have this many points, over all its times together.
constexpr std::size_t kMovedPointsMax = 100'000'000;
// Positions and transforms have time samplings of their own. Times that differ by less than this belong to one frame.
constexpr double kSameTime_s = 1e-6;

struct OtherSchema {
  std::string_view schema;
  const char* name;
};
constexpr std::array<OtherSchema, 6> kOtherSchemas{{{"AbcGeom_PolyMesh", "mesh"},
                                                    {"AbcGeom_SubD", "subdivision mesh"},
                                                    {"AbcGeom_Camera", "camera"},
                                                    {"AbcGeom_Light", "light"},
                                                    {"AbcGeom_Points", "point cloud"},
                                                    {"AbcGeom_NuPatch", "NURBS patch"}}};

// A line of notes with names, each once. It stores one name more than it shows, so a file with a million attributes
// costs no memory.
class Names {
 public:
  void add(const std::vector<std::string_view>& names) {
    for (const std::string_view name : names) {
      if (names_.size() <= kNamesMax && std::ranges::find(names_, shown(name)) == names_.end())
        names_.push_back(shown(name));
    }
  }
  void tell(const std::string& what, std::vector<std::string>& lines) const {
    std::string text;
    for (std::size_t i = 0; i < std::min(names_.size(), kNamesMax); ++i) text += (i == 0 ? "" : ", ") + names_[i];
    if (!names_.empty()) lines.push_back(what + text + (names_.size() > kNamesMax ? ", ..." : ""));
  }

 private:
  std::vector<std::string> names_;
};

// What `move` needs of one object. The control points of every sample are read again from the file, so only the weights
// of the points are in memory.
struct MovingCurves {
  std::string path;
  AbcCurves curves;
  // The points on each curve; a bad curve has none.
  std::vector<std::vector<CurvePoint>> points;
  AbcProperty positions;
  const AbcTimes* times = nullptr;
  std::size_t xform = 0;
  bool changes_topology = false;
};

// Whether the curves of an object differ in number or in points between samples. Such an object cannot move: its
// strands are fixed by the first sample.
bool changes_topology(const std::vector<AbcProperty>& geometry) {
  const AbcProperty &positions = *find(geometry, "P"), &counts = *find(geometry, "nVertices");
  if (!counts.is_constant()) return true;
  if (positions.is_constant()) return false;
  const std::size_t size = positions.numbers(0).size();
  for (std::size_t i = positions.first_changed; i <= positions.last_changed; ++i) {
    if (positions.numbers(i).size() != size) return true;
  }
  return false;
}

std::string with_digits(double x) {
  char text[32];
  std::snprintf(text, sizeof text, "%.4g", x);
  return text;
}

// Walks an archive and collects its curves. Without `wants_motion` it keeps only the first sample of everything, which
// is all that a groom needs.
class Decoder {
 public:
  Decoder(AbcArchive archive, bool wants_motion) : archive_(std::move(archive)), wants_motion_(wants_motion) {}

  // Returns an empty string when there are curves.
  std::string decode() {
    std::string error = visit_children({{}, {}, archive_.top()}, {});
    if (error.empty() && strands_.strand_count() == 0) error = nothing_read();
    return error;
  }

  // Call each of these once, after `decode`.
  ImportedStrands take_strands();
  Result<StrandMotion> take_motion();

 private:
  // An object with what it inherits from the objects above it.
  struct Place {
    std::string path;
    std::size_t xform = 0;
    bool is_hidden = false;
  };
  std::string visit_children(const AbcObject& object, const Place& place);
  std::string visit(const AbcObject& object, Place place);
  std::string add_xform(const std::vector<AbcProperty>& of_object, Place& place);
  std::string add_curves(const AbcObject& object, const Place& place, const std::vector<AbcProperty>& of_object);
  [[nodiscard]] std::string others() const;
  [[nodiscard]] std::string nothing_read() const;
  [[nodiscard]] std::string headline(const ImportedStrands& strands) const;
  void tell(ImportedStrands& strands) const;
  [[nodiscard]] std::string move(const MovingCurves& moving, double time_s, std::vector<Vec3f>& points) const;

  AbcArchive archive_;
  bool wants_motion_;
  AbcXforms xforms_;
  // Attributes of the objects above the visited one, the nearest first.
  std::vector<AbcAttribute> above_;
  AbcStrands strands_;
  std::vector<MovingCurves> moving_;
  std::array<std::size_t, kOtherSchemas.size()> others_{};
  std::size_t object_count_ = 0;
  // Positions and transforms are stored at these times.
  std::vector<double> times_s_;
  AbcExamples bad_objects_, odd_, hidden_, instances_, changing_, moving_objects_;
  Names unused_, unknown_;
};

std::string Decoder::visit_children(const AbcObject& object, const Place& place) {
  const auto children = archive_.children(object.group);
  if (!children) return children.error();
  const auto above_count = static_cast<std::ptrdiff_t>(above_.size());
  for (const AbcObject& child : *children) {
    std::string error = visit(child, {place.path + "/" + shown(child.name), place.xform, place.is_hidden});
    // `add_xform` puts attributes in front, so the last `above_count` entries are those that this object's parents
    // have.
    above_.erase(above_.begin(), above_.end() - above_count);
    if (!error.empty()) return error;
  }
  return {};
}

std::string Decoder::visit(const AbcObject& object, Place place) {
  const std::string_view schema = metadata_value(object.metadata, "schema");
  // Schemas carry a version at their end, as in AbcGeom_PolyMesh_v1, so only the beginning is compared.
  for (std::size_t i = 0; i < kOtherSchemas.size(); ++i)
    others_[i] += schema.starts_with(kOtherSchemas[i].schema) ? 1 : 0;
  if (metadata_value(object.metadata, "isInstance") == "1") instances_.add(place.path);
  // Hidden objects and other schemas are visited too: curves may lie below them, and notes count them.
  const auto properties = archive_.properties_of_object(object.group);
  if (!properties) return properties.error();
  // The value is 1 for shown, 0 for hidden and -1 for like the object above. A hidden object hides all objects below.
  if (const AbcProperty* visible = find(*properties, "visible")) {
    const AbcNumbers value = visible->numbers(0);
    place.is_hidden = place.is_hidden || (value.size() > 0 && value[0] == 0);
  }
  std::string error;
  if (schema.starts_with("AbcGeom_Xform")) error = add_xform(*properties, place);
  if (schema.starts_with("AbcGeom_Curve")) {
    if (place.is_hidden) {
      hidden_.add(place.path);
    } else {
      error = add_curves(object, place, *properties);
    }
  }
  return error.empty() ? visit_children(object, place) : error;
}

std::string Decoder::add_xform(const std::vector<AbcProperty>& of_object, Place& place) {
  const auto properties = properties_in(archive_, of_object, ".xform");
  if (!properties) return properties.error();
  auto xform = AbcXform::read(archive_, *properties);
  if (!xform) return "damaged: the transform " + place.path + ": " + xform.error();
  // Times of transforms count as well as those of positions, because hair often moves only with the transform of a
  // head.
  if (wants_motion_) xform->add_times(times_s_);
  place.xform = xforms_.add(std::move(*xform), place.xform);
  AbcCurves attributes;
  for (const std::string_view name : {".arbGeomParams", ".userProperties"}) {
    const auto part = properties_in(archive_, *properties, name);
    if (!part) return part.error();
    if (const auto read = read_attributes(archive_, *part, {1, 1, 1}, attributes); !read) return read.error();
  }
  // One value holds for all curves below.
  for (AbcAttribute& attribute : attributes.attributes) attribute.scope = AbcScope::object;
  std::ranges::move(attributes.attributes, std::inserter(above_, above_.begin()));
  return {};
}

std::string Decoder::add_curves(const AbcObject& object, const Place& place,
                                const std::vector<AbcProperty>& of_object) {
  const auto properties = AbcCurvesProperties::read(archive_, of_object);
  if (!properties) return properties.error();
  auto curves = read_curves(archive_, *properties);
  if (!curves) return curves.error();
  ++object_count_;
  // A bad object is left out and named, because one broken object should not cost the whole hairstyle.
  if (!curves->error.empty()) {
    bad_objects_.add(place.path + " " + curves->error);
    return {};
  }
  for (const std::string& remark : curves->remarks) odd_.add(place.path + " " + remark);
  unused_.add(curves->unused);
  unknown_.add(curves->unknown);

  MovingCurves moving;
  moving.path = place.path;
  moving.positions = *find(properties->geometry, "P");
  moving.times = &archive_.times(moving.positions);
  moving.xform = place.xform;
  moving.changes_topology = changes_topology(properties->geometry);
  if (moving.changes_topology) {
    changing_.add(place.path);
  } else if (!moving.positions.is_constant() || xforms_.changes(place.xform)) {
    moving_objects_.add(place.path);
    if (wants_motion_) add_sample_times(moving.positions, *moving.times, times_s_);
  }
  // The transform is taken at the time of the first positions, which need not be the time of its own first sample.
  const Eigen::Affine3d world = xforms_.world(place.xform, moving.times->time_s(0));
  moving.points = strands_.add(*curves, {place.path, object.name, world, above_});
  // The check after each object lets the points exceed the limit by no more than those of one object.
  if (strands_.point_count() > kPointsMax)
    return "has more than " + std::to_string(kPointsMax) + " points: export fewer curves";
  if (!wants_motion_) return {};
  moving.curves = std::move(*curves);
  moving_.push_back(std::move(moving));
  return {};
}

std::string Decoder::others() const {
  std::string text;
  for (std::size_t i = 0; i < kOtherSchemas.size(); ++i) {
    if (others_[i] > 0) text += (text.empty() ? "" : ", ") + counted(others_[i], kOtherSchemas[i].name);
  }
  return text;
}

std::string Decoder::nothing_read() const {
  if (strands_.bad().count() > 0)
    return "none of its " + counted(strands_.listed_count(), "curve") + " can be read: " + strands_.bad().text();
  if (bad_objects_.count() > 0) return "none of its curves can be read: " + bad_objects_.text();
  if (hidden_.count() > 0) return "no curves: all are hidden: " + hidden_.text();
  if (object_count_ > 0) return "no curves: " + counted(object_count_, "object") + " for curves, without any";
  const std::string text = others();
  return text.empty() ? "no curves: it is empty" : "no curves: it has " + text;
}

// "Alembic 1.7.5 of Maya 2022 AbcExport: 6 curves of 155 points in 6 objects".
std::string Decoder::headline(const ImportedStrands& strands) const {
  const std::uint32_t version = archive_.library_version();
  const std::string_view program = metadata_value(archive_.metadata(), "_ai_Application");
  return "Alembic " + std::to_string(version / 10'000) + "." + std::to_string(version / 100 % 100) + "." +
         std::to_string(version % 100) + (program.empty() ? "" : " of " + shown(program)) + ": " +
         counted(strands.strand_count(), "curve") + " of " + counted(strands_.control_count(), "point") + " in " +
         counted(object_count_, "object");
}

void Decoder::tell(ImportedStrands& strands) const {
  std::vector<std::string>&notes = strands.notes, &doubts = strands.doubts;
  notes.push_back(headline(strands));
  if (!strands.guides.empty() && std::ranges::count(strands.guides, 0) == 0)
    notes.emplace_back("all curves are guides, which lead other hair where they were made; they are taken as strands");
  if (moving_objects_.count() > 0)
    notes.push_back("curves that move are taken as they begin: " + moving_objects_.text());
  if (changing_.count() > 0)
    notes.push_back("curves come, go or change their points with time; those of the first sample are taken: " +
                    changing_.text());
  if (hidden_.count() > 0) notes.push_back("hidden curves are left out: " + hidden_.text());
  unused_.tell("attributes that are not used: ", notes);
  unknown_.tell("unknown attributes: ", notes);
  if (const std::string text = others(); !text.empty()) notes.push_back("not read: " + text);
  if (instances_.count() > 0) doubts.push_back("instances of other objects are left out: " + instances_.text());
  if (odd_.count() > 0) doubts.push_back(odd_.text());
  if (bad_objects_.count() > 0) doubts.push_back("objects of curves are left out: " + bad_objects_.text());
  if (strands_.bad().count() > 0)
    doubts.push_back(std::to_string(strands_.bad().count()) + " of " + counted(strands_.listed_count(), "curve") +
                     " are left out: " + strands_.bad().text());
}

ImportedStrands Decoder::take_strands() {
  ImportedStrands strands = strands_.take();
  tell(strands);
  return strands;
}

// Appends the points of one object at `time_s` to `points`, in the order of its strands. Returns what is wrong, or an
// empty string.
std::string Decoder::move(const MovingCurves& moving, double time_s, std::vector<Vec3f>& points) const {
  if (moving.changes_topology) time_s = moving.times->time_s(0);
  const Eigen::Affine3d world = xforms_.world(moving.xform, time_s);
  // The two samples around the time. Where the number of points changes, only sample 0 fits the curves.
  const AbcMoment moment =
      moving.changes_topology ? AbcMoment() : moment_of(*moving.times, moving.positions.sample_count, time_s);
  // Control points are interpolated, not points on the curves. A curve is linear in its control points, so both give
  // the same.
  const AbcNumbers before = moving.positions.numbers(moment.before), behind = moving.positions.numbers(moment.behind);
  std::vector<Vec3f> controls, next;
  for (std::size_t c = 0; c < moving.points.size(); ++c) {
    if (moving.points[c].empty()) continue;
    read_controls(before, moving.curves.curves[c], world, controls);
    if (moment.share > 0) {
      read_controls(behind, moving.curves.curves[c], world, next);
      for (std::size_t i = 0; i < controls.size(); ++i)
        controls[i] += static_cast<float>(moment.share) * (next[i] - controls[i]);
    }
    for (const CurvePoint& point : moving.points[c]) {
      points.push_back(value_at(point, std::span<const Vec3f>(controls)));
      if (!points.back().allFinite())
        return "curve " + std::to_string(c) + " of " + moving.path + " at " + with_digits(time_s) +
               " s has a coordinate that is not finite";
    }
  }
  return {};
}

Result<StrandMotion> Decoder::take_motion() {
  StrandMotion motion;
  std::ranges::sort(times_s_);
  for (const double time_s : times_s_) {
    if (motion.times_s.empty() || time_s - motion.times_s.back() > kSameTime_s) motion.times_s.push_back(time_s);
  }
  // Without moving objects, or with a single time, there is no motion: callers then show the strands at rest.
  if (moving_objects_.count() == 0 || motion.times_s.size() < 2) return StrandMotion();
  // The division cannot overflow, as the product of both numbers could.
  if (strands_.point_count() > kMovedPointsMax / motion.times_s.size())
    return Refusal(counted(motion.times_s.size(), "time") + " of " + counted(strands_.point_count(), "point") +
                   " are too many: export fewer frames");
  for (const double time_s : motion.times_s) {
    std::vector<Vec3f>& points = motion.points.emplace_back();
    points.reserve(strands_.point_count());
    for (const MovingCurves& moving : moving_) {
      if (std::string error = move(moving, time_s, points); !error.empty()) return Refusal(std::move(error));
    }
  }
  return motion;
}

}  // namespace

Result<ImportedStrands> decode_alembic(std::span<const std::byte> bytes) {
  auto archive = AbcArchive::open(bytes);
  if (!archive) return Refusal(archive.error());
  Decoder decoder(std::move(*archive), false);
  if (std::string error = decoder.decode(); !error.empty()) return Refusal(std::move(error));
  return decoder.take_strands();
}

Result<StrandMotion> decode_alembic_motion(std::span<const std::byte> bytes) {
  auto archive = AbcArchive::open(bytes);
  if (!archive) return Refusal(archive.error());
  Decoder decoder(std::move(*archive), true);
  if (std::string error = decoder.decode(); !error.empty()) return Refusal(std::move(error));
  return decoder.take_motion();
}

}  // namespace hairnet
