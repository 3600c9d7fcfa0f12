#include <array>
#include <cstdio>

#include "client/assets/export/alembic_archive_writer.hpp"
#include "client/assets/export/formats.hpp"
#include "core/version.hpp"

// Curves as Maya's AbcExport and Houdini write them, with the attributes of Epic's "Alembic for Grooms": a transform
// that has the version, and below it an object of curves for each group. No foreign reader of Alembic runs in this
// project's tests; `export_alembic_test` compares the tree of objects and properties with those of AbcExport and of
// Maya's own file, and digests with those in files of Maya, Cinema 4D and Cortex.
namespace hairnet {
namespace {

// The attribute is of 16 bits. A number of 32 bits has them first, in little-endian order.
constexpr std::uint32_t kNoGuide = 0;
// The version of Epic's specification that the attributes follow.
constexpr std::int16_t kGroomVersionMajor = 1, kGroomVersionMinor = 5;
// The four bytes are the type (1 is linear), whether curves are closed (0 is not), the basis (0 is none), and a byte
// that readers ignore.
constexpr std::array<std::uint8_t, 4> kBasisAndType{1, 0, 0, 0};
constexpr const char* kCurves = "schema=AbcGeom_Curve_v2;schemaBaseType=AbcGeom_GeomBase_v1";
constexpr const char* kXform = "schema=AbcGeom_Xform_v3";

using Box = std::array<Vec3, 2>;

// The box must have at least one point, which `open_strand_file` has checked.
Box box_of(std::span<const Vec3f> points) {
  Box box{points.front().cast<double>(), points.front().cast<double>()};
  for (const Vec3f& x : points) {
    box[0] = box[0].cwiseMin(x.cast<double>());
    box[1] = box[1].cwiseMax(x.cast<double>());
  }
  return box;
}

AbcOutProperty compound(const char* name, std::string metadata, std::vector<AbcOutProperty> children) {
  return {name, std::move(metadata), AbcKind::compound, AbcType::u8, 1, AbcTiming::constant, std::move(children)};
}

// An attribute has one value for all curves ("con"), one for each ("uni") or one for each point ("vtx").
AbcOutProperty attribute(const char* name, const char* scope, AbcType type, const char* type_name) {
  const std::string metadata =
      "arrayExtent=1;geoScope=" + std::string(scope) + ";isGeomParam=true;podExtent=1;podName=" + type_name;
  return {name, metadata, AbcKind::array, type, 1, AbcTiming::constant};
}

// The writer keeps no frame: positions go to the archive at once, and only their places in the file remain in memory.
class AlembicWriter : public StrandWriter {
 public:
  AlembicWriter(OutputFile file, const ExportedStrands& strands, const MaybeMotion& motion)
      : StrandWriter(strands), archive_(std::move(file)), motion_(motion), names_(object_names(strands)) {}

 private:
  // Properties of `.geom`, in order. Width may be absent. Each list in `geometries_` is indexed by these.
  enum Geometry : std::size_t { kBounds, kPositions, kCounts, kBasis, kArbitrary, kWidth };

  Result<void> put(std::span<const Vec3f> points) override {
    const bool is_first = frame_count() == 1;
    if (is_first) begin();
    // Bounds are stored for the whole scene and for each group, since viewers frame the hair by them.
    const Box all = box_of(points);
    archive_.add(bounds_, std::as_bytes(std::span(all)));
    for (std::size_t g = 0; g < geometries_.size(); ++g) {
      const ExportedStrands::Group& group = strands().groups[g];
      std::vector<AbcOutProperty>& geometry = geometries_[g];
      const std::span<const Vec3f> own = points.subspan(group.first_point, group.point_count());
      const Box box = box_of(own);
      archive_.add(geometry[kBounds], std::as_bytes(std::span(box)));
      archive_.add(geometry[kPositions], std::as_bytes(own));
      // Properties that do not change still need a sample at each frame, as their number must agree with that of the
      // positions.
      for (AbcOutProperty& property : geometry) {
        if (!is_first && property.sample_count + 1 == frame_count()) AbcArchiveWriter::repeat(property);
      }
    }
    return {};
  }

  // Writes what does not change.
  void begin() {
    const AbcTiming timing = motion_ ? AbcTiming::uniform : AbcTiming::constant;
    bounds_ = {".childBnds", "interpretation=box", AbcKind::scalar, AbcType::f64, 6, timing};
    // Each group has one width, or each point has one: the choice is made over all groups.
    bool has_one_width = true;
    for (const ExportedStrands::Group& group : strands().groups) {
      for (std::uint32_t s = group.begin; s < group.end && !strands().widths_m.empty(); ++s)
        has_one_width = has_one_width && strands().widths_m[s] == strands().widths_m[group.begin];
    }
    for (const ExportedStrands::Group& group : strands().groups) {
      std::vector<AbcOutProperty> geometry{
          {".selfBnds", "interpretation=box", AbcKind::scalar, AbcType::f64, 6, timing},
          {"P", "geoScope=vtx;interpretation=point", AbcKind::array, AbcType::f32, 3, timing},
          {"nVertices", "", AbcKind::array, AbcType::i32, 1, timing},
          {"curveBasisAndType", "", AbcKind::scalar, AbcType::u8, 4, timing}};
      std::vector<std::int32_t> counts;
      for (std::uint32_t s = group.begin; s < group.end; ++s)
        counts.push_back(static_cast<std::int32_t>(strands().points_of(s)));
      archive_.add(geometry[kCounts], std::as_bytes(std::span(counts)));
      archive_.add(geometry[kBasis], std::as_bytes(std::span(kBasisAndType)));
      geometry.push_back(compound(".arbGeomParams", "", attributes(group)));
      if (!strands().widths_m.empty()) geometry.push_back(width(group, has_one_width, timing));
      geometries_.push_back(std::move(geometry));
    }
  }

  // Unreal wants the widths of all groups alike: one for each group, or one for each point.
  AbcOutProperty width(const ExportedStrands::Group& group, bool is_one, AbcTiming timing) {
    AbcOutProperty width = attribute("width", is_one ? "con" : "vtx", AbcType::f32, "float32_t");
    width.timing = timing;
    std::vector<float> widths;
    for (std::uint32_t s = group.begin; s < (is_one ? group.begin + 1 : group.end); ++s)
      widths.insert(widths.end(), is_one ? 1 : strands().points_of(s), strands().widths_m[s]);
    archive_.add(width, std::as_bytes(std::span(widths)));
    return width;
  }

  std::vector<AbcOutProperty> attributes(const ExportedStrands::Group& group) {
    std::vector<AbcOutProperty> out{attribute("groom_group_name", "con", AbcType::text, "string"),
                                    attribute("groom_group_id", "con", AbcType::i32, "int32_t"),
                                    attribute("groom_guide", "con", AbcType::i16, "int16_t"),
                                    attribute("groom_id", "uni", AbcType::i32, "int32_t")};
    // The C string ends at a zero within the name, which would otherwise begin a second text.
    archive_.add_text(out[0], group.name.c_str());
    archive_.add(out[1], std::as_bytes(std::span(&group.id, 1)));
    archive_.add(out[2], std::as_bytes(std::span(&kNoGuide, 1)).first(2));
    archive_.add(out[3], std::as_bytes(std::span(strands().groom_strands).subspan(group.begin, group.strand_count())));
    return out;
  }

  // Where Unreal looks for the version: in the first transform.
  AbcOutProperty version() {
    std::vector<AbcOutProperty> out{{"groom_version_major", "", AbcKind::scalar, AbcType::i16},
                                    {"groom_version_minor", "", AbcKind::scalar, AbcType::i16},
                                    {"groom_tool", "", AbcKind::scalar, AbcType::text}};
    archive_.add(out[0], std::as_bytes(std::span(&kGroomVersionMajor, 1)));
    archive_.add(out[1], std::as_bytes(std::span(&kGroomVersionMinor, 1)));
    archive_.add_text(out[2], std::string("Hairnet ") + kVersion);
    return compound(".userProperties", "", std::move(out));
  }

  // The tree is built only now, when all samples have been counted.
  Result<void> close() override {
    AbcOutObject hair{"hairnet", std::string(kXform) + ";schemaObjTitle=AbcGeom_Xform_v3:.xform"};
    hair.properties.push_back(compound(".xform", kXform, {version()}));
    for (std::size_t g = 0; g < geometries_.size(); ++g) {
      AbcOutObject& curves = hair.children.emplace_back();
      curves.name = names_[g];
      curves.metadata = std::string(kCurves) + ";schemaObjTitle=AbcGeom_Curve_v2:.geom";
      curves.properties.push_back(compound(".geom", kCurves, std::move(geometries_[g])));
    }
    AbcOutObject top;
    top.properties.push_back(std::move(bounds_));
    std::string metadata = std::string("_ai_AlembicVersion=Alembic 1.8.5 (as written by Hairnet ") + kVersion +
                           ");_ai_Application=Hairnet " + kVersion;
    if (motion_) {
      char rate[32];
      // "%g" writes 30 and 29.97 as other programs do.
      std::snprintf(rate, sizeof rate, "%g", motion_->rate_hz);
      metadata += std::string(";_ai_DCC_FPS=") + rate;
      // AbcExport writes the number of samples under this name.
      AbcOutProperty& samples =
          top.properties.emplace_back(AbcOutProperty{"1.samples", "", AbcKind::scalar, AbcType::u32});
      const auto count = static_cast<std::uint32_t>(frame_count());
      archive_.add(samples, std::as_bytes(std::span(&count, 1)));
    }
    metadata += ";_ai_Description=metres, y up, face +z";
    top.children.push_back(std::move(hair));
    return archive_.finish(top, metadata, motion_ ? motion_->rate_hz : 1);
  }

  AbcArchiveWriter archive_;
  MaybeMotion motion_;
  // The name of each group's object.
  std::vector<std::string> names_;
  // The properties of each group's `.geom`, in the order of `Geometry`.
  std::vector<std::vector<AbcOutProperty>> geometries_;
  // The box around all hair at each frame.
  AbcOutProperty bounds_;
};

}  // namespace

OpenedWriter write_alembic(OutputFile file, const ExportedStrands& strands, const MaybeMotion& motion) {
  return std::make_unique<AlembicWriter>(std::move(file), strands, motion);
}

}  // namespace hairnet
