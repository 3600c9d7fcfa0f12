#include <gmock/gmock.h>
#include <unistd.h>

#include <filesystem>
#include <iostream>

#include "client/assets/export/murmur.hpp"
#include "client/assets/export/strand_writer.hpp"
#include "client/assets/import/alembic_archive.hpp"
#include "tests/support/abc_writer.hpp"
#include "tests/support/import_files.hpp"

// There is no other reader of Alembic here. The tests compare our archives with those of other programs, by what our
// own reader finds in both.
namespace hairnet {
namespace {

namespace fs = std::filesystem;
using testing::Contains;
using testing::ElementsAreArray;
using testing::HasSubstr;
using testing::StartsWith;

using Lines = std::vector<std::string>;

constexpr std::array<const char*, 3> kKinds{"compound", "scalar", "array"};

void add_properties(AbcArchive& archive, const OgawaGroup& group, const std::string& path, Lines& lines) {
  const auto properties = archive.properties(group);
  ASSERT_TRUE(properties) << properties.error();
  for (const AbcProperty& property : *properties) {
    const std::string name = path + " " + std::string(property.name);
    std::string line = name + ": " + kKinds[static_cast<std::size_t>(property.kind)];
    if (property.kind != AbcProperty::Kind::compound)
      line += " of type " + std::to_string(property.type) + " [" + std::to_string(property.extent) + "]";
    lines.push_back(line + " {" + std::string(property.metadata) + "}");
    if (property.kind == AbcProperty::Kind::compound) add_properties(archive, property.group, name, lines);
  }
}

void add_objects(AbcArchive& archive, const OgawaGroup& object, const std::string& path, Lines& lines) {
  add_properties(archive, object.group(0), path, lines);
  const auto children = archive.children(object);
  ASSERT_TRUE(children) << children.error();
  for (const AbcObject& child : *children) {
    const std::string below = path + "/" + std::string(child.name);
    lines.push_back(below + " {" + std::string(child.metadata) + "}");
    add_objects(archive, child.group, below, lines);
  }
}

// Returns a line for each object and property, with its name, kind, type, extent and metadata.
Lines tree_of(std::span<const std::byte> bytes) {
  auto archive = AbcArchive::open(bytes);
  EXPECT_TRUE(archive) << archive.error();
  Lines lines;
  if (archive) add_objects(*archive, archive->top(), "", lines);
  return lines;
}

struct ExportAlembic : testing::Test {
  std::vector<std::byte> write(const ExportedStrands& strands, const std::vector<std::vector<Vec3f>>& frames,
                               const std::optional<ExportedMotion>& motion = {}) {
    const fs::path path = fs::path(testing::TempDir()) / ("hairnet_" + std::to_string(::getpid()) + "_tree.abc");
    auto writer = open_strand_file(path.string(), strands, motion);
    EXPECT_TRUE(writer) << writer.error();
    for (const auto& frame : frames) EXPECT_TRUE((*writer)->add(frame));
    EXPECT_TRUE((*writer)->finish());
    std::vector<std::byte> bytes = test::file_bytes(path);
    fs::remove(path);
    return bytes;
  }
};

// Returns two strands of three points in one group, and one of two points in another.
ExportedStrands three_strands() {
  ExportedStrands strands;
  strands.strand_begin = {0, 3, 6, 8};
  strands.widths_m = {1e-4f, 1e-4f, 8e-5f};
  strands.groups = {{"fringe", 0, 0, 2, 0, 6}, {"back", 4, 2, 3, 6, 8}};
  strands.groom_strands = {0, 2, 1};
  strands.groom_points = {0, 5, 3};
  return strands;
}

std::vector<Vec3f> eight_points(float shift = 0) {
  std::vector<Vec3f> points;
  for (int i = 0; i < 8; ++i) points.emplace_back(static_cast<float>(i), shift, 1);
  return points;
}

test::AbcProp with(test::AbcProp property, const std::string& metadata) {
  property.metadata = metadata;
  return property;
}

// Makes the same hair as Maya's AbcExport writes it: a transform, and below it objects of curves with the attributes of
// a groom.
test::AbcBytes file_of_abcexport(const std::vector<std::vector<float>>& bounds) {
  using test::numbers;
  const auto attribute = [](test::AbcProp property, const std::string& scope, const std::string& type) {
    return with(std::move(property),
                "arrayExtent=1;geoScope=" + scope + ";isGeomParam=true;podExtent=1;podName=" + type);
  };
  const auto curves = [&](const std::string& name, std::vector<std::int32_t> counts, std::vector<float> points,
                          const std::vector<std::int32_t>& ids) {
    const std::string schema = "schema=AbcGeom_Curve_v2;schemaBaseType=AbcGeom_GeomBase_v1";
    test::AbcProp attributes =
        test::compound(".arbGeomParams", {attribute(test::texts("groom_group_name", "con", {name}), "con", "string"),
                                          attribute(numbers<std::int32_t>("groom_group_id", {{0}}), "con", "int32_t"),
                                          attribute(numbers<std::int16_t>("groom_guide", {{0}}), "con", "int16_t"),
                                          attribute(numbers<std::int32_t>("groom_id", {ids}), "uni", "int32_t")});
    test::AbcProp geometry =
        test::compound(".geom", {with(numbers<double>(".selfBnds", {{0, 0, 0, 1, 1, 1}}, 6, 1), "interpretation=box"),
                                 with(numbers<float>("P", {points}, 3), "geoScope=vtx;interpretation=point"),
                                 numbers<std::int32_t>("nVertices", {counts}),
                                 numbers<std::uint8_t>("curveBasisAndType", {{1, 0, 0, 0}}, 4, 1), attributes,
                                 attribute(numbers<float>("width", {{1e-4f}}), "con", "float32_t")});
    return test::AbcObj{name, schema + ";schemaObjTitle=AbcGeom_Curve_v2:.geom", {with(geometry, schema)}, {}};
  };
  test::AbcProp tool{"groom_tool", {}, 1, 12, 1, 0, {test::sample_key()}, 1, 0, 0, {}};
  test::AbcProp version =
      test::compound(".userProperties", {numbers<std::int16_t>("groom_version_major", {{1}}, 1, 1),
                                         numbers<std::int16_t>("groom_version_minor", {{5}}, 1, 1), tool});
  test::AbcFile file;
  std::vector<double> box;
  for (const float x : bounds.front()) box.push_back(double{x});
  file.top.properties = {with(numbers<double>(".childBnds", {box}, 6, 1), "interpretation=box")};
  file.top.children = {
      {"hairnet",
       "schema=AbcGeom_Xform_v3;schemaObjTitle=AbcGeom_Xform_v3:.xform",
       {with(test::compound(".xform", {version}), "schema=AbcGeom_Xform_v3")},
       {curves("fringe", {3, 3}, std::vector<float>(18), {0, 2}), curves("back", {2}, std::vector<float>(6), {1})}}};
  return test::AbcWriter(file).write();
}

TEST_F(ExportAlembic, the_tree_is_that_of_an_archive_of_abcexport) {
  const Lines ours = tree_of(write(three_strands(), {eight_points()})),
              theirs = tree_of(file_of_abcexport({{0, 0, 0, 1, 1, 1}}));
  for (std::size_t i = 0; i < std::max(ours.size(), theirs.size()); ++i)
    std::cout << (i < ours.size() ? ours[i] : "-") << "\n    " << (i < theirs.size() ? theirs[i] : "-") << '\n';
  EXPECT_THAT(ours, ElementsAreArray(theirs));
}

TEST_F(ExportAlembic, curves_have_the_properties_of_a_file_of_maya) {
  const fs::path file = test::shared_data() / "import/abc/maya_curves_pivots.abc";
  if (!fs::exists(file)) GTEST_SKIP() << "NOT TESTED: no " << file;
  const std::string their_path = "/CurvesAsset/Geom/Curve1/CurveShape1", our_path = "/hairnet/fringe";
  const Lines theirs = tree_of(test::file_bytes(file)), ours = tree_of(write(three_strands(), {eight_points()}));
  std::size_t compared = 0;
  for (const std::string& line : theirs) {
    // Our curves are linear and need no knots.
    if (!line.starts_with(their_path) || line.find(".knots") != std::string::npos) continue;
    EXPECT_THAT(ours, Contains(our_path + line.substr(their_path.size())));
    ++compared;
  }
  EXPECT_EQ(compared, 7u);
  EXPECT_THAT(ours, Contains(StartsWith(" .childBnds: scalar of type 11 [6]")));
  EXPECT_THAT(theirs, Contains(StartsWith(" .childBnds: scalar of type 11 [6]")));
}

// Checks that the key of each sample, its first 16 bytes, is the hash of its values. Returns how many samples there
// are.
std::size_t check_keys(AbcArchive& archive, const OgawaGroup& compound) {
  std::size_t count = 0;
  const auto properties = archive.properties(compound);
  EXPECT_TRUE(properties);
  for (const AbcProperty& property : *properties) {
    if (property.kind == AbcProperty::Kind::compound) {
      count += check_keys(archive, property.group);
      continue;
    }
    for (std::size_t i = 0; i < property.group.child_count(); ++i) {
      const std::span<const std::byte> sample = property.group.data(i);
      // These are dimensions, or a sample without values.
      if (sample.size() <= 16) continue;
      const MurmurDigest key = murmur_128(sample.subspan(16));
      EXPECT_TRUE(std::ranges::equal(std::as_bytes(std::span(key)), sample.first(16))) << property.name << ' ' << i;
      ++count;
    }
  }
  return count;
}

std::size_t check_keys_below(AbcArchive& archive, const OgawaGroup& object) {
  std::size_t count = check_keys(archive, object.group(0));
  const auto children = archive.children(object);
  EXPECT_TRUE(children);
  for (const AbcObject& child : *children) count += check_keys_below(archive, child.group);
  return count;
}

// Other programs compare samples by their keys alone. With a wrong key they would take one frame for another.
TEST_F(ExportAlembic, samples_have_the_keys_that_alembic_gives_them) {
  const std::vector<std::byte> ours = write(three_strands(), {eight_points(), eight_points(1)}, ExportedMotion{30, 2});
  auto archive = AbcArchive::open(ours);
  ASSERT_TRUE(archive) << archive.error();
  EXPECT_GT(check_keys_below(*archive, archive->top()), 20u);
  for (const char* name : {"maya_curves_pivots.abc", "c4d_tracer_growing.abc", "cortex_curves.abc"}) {
    const fs::path file = test::shared_data() / "import/abc" / name;
    if (!fs::exists(file)) GTEST_SKIP() << "NOT TESTED: no " << file;
    const std::vector<std::byte> bytes = test::file_bytes(file);
    auto theirs = AbcArchive::open(bytes);
    ASSERT_TRUE(theirs) << theirs.error();
    EXPECT_GT(check_keys_below(*theirs, theirs->top()), 20u) << name;
  }
}

// Data that do not move must be stored once, or a long motion would take many times its size.
TEST_F(ExportAlembic, only_positions_and_bounds_change_with_time) {
  std::vector<std::vector<Vec3f>> frames;
  for (int f = 0; f < 5; ++f) frames.push_back(eight_points(static_cast<float>(f)));
  const std::vector<std::byte> bytes = write(three_strands(), frames, ExportedMotion{24, 5});
  auto archive = AbcArchive::open(bytes);
  ASSERT_TRUE(archive) << archive.error();
  EXPECT_THAT(std::string(archive->metadata()), StartsWith("_ai_AlembicVersion=Alembic 1.8.5 ("));
  EXPECT_EQ(metadata_value(archive->metadata(), "_ai_DCC_FPS"), "24");
  const auto top = archive->properties_of_object(archive->top());
  ASSERT_TRUE(top);
  EXPECT_EQ(find(*top, "1.samples")->numbers(0)[0], 5);
  EXPECT_EQ(find(*top, ".childBnds")->numbers(3)[1], 3);
  const auto hair = archive->children(archive->top());
  ASSERT_TRUE(hair);
  const auto groups = archive->children(hair->front().group);
  ASSERT_TRUE(groups);
  ASSERT_EQ(groups->size(), 2u);
  const auto of_object = archive->properties_of_object(groups->front().group);
  ASSERT_TRUE(of_object);
  const auto geometry = archive->properties(of_object->front().group);
  ASSERT_TRUE(geometry);
  for (const AbcProperty& property : *geometry) {
    if (property.kind == AbcProperty::Kind::compound) continue;
    const bool moves = property.name == "P" || property.name == ".selfBnds";
    EXPECT_EQ(property.sample_count, 5u) << property.name;
    EXPECT_EQ(property.is_constant(), !moves) << property.name;
    EXPECT_EQ(property.stored_samples(), moves ? 5u : 1u) << property.name;
    EXPECT_NEAR(archive->times(property).time_s(4), 4 / 24.0, 1e-12) << property.name;
  }
}

TEST(Murmur, texts_of_all_lengths_have_different_digests_and_the_known_one) {
  const std::string text = "The quick brown fox jumps over the lazy dog";
  // The digest of this sentence is widely published for MurmurHash3, 128 bits, x64.
  EXPECT_EQ(murmur_128(std::as_bytes(std::span(text))), (MurmurDigest{0xe34bbc7bbc071b6c, 0x7a433ca9c49a9347}));
  EXPECT_EQ(murmur_128({}), (MurmurDigest{0, 0}));
}

}  // namespace
}  // namespace hairnet
