#include <gmock/gmock.h>
#include <unistd.h>

#include <array>
#include <cstring>
#include <filesystem>
#include <nlohmann/json.hpp>

#include "client/assets/export/strand_writer.hpp"
#include "client/assets/import/alembic.hpp"
#include "client/assets/import/head_files.hpp"
#include "client/assets/made/made.hpp"
#include "client/files/read_file.hpp"
#include "schema/wire/groom_file.hpp"
#include "tests/support/case_name.hpp"
#include "tests/support/real_hair.hpp"

namespace hairnet {
namespace {

namespace fs = std::filesystem;
using testing::ElementsAre;
using testing::EndsWith;
using testing::HasSubstr;
using Json = nlohmann::json;

// A groom file rounds points, so hair that goes through one comes back within a tenth of a millimetre.
constexpr float kSame_m = 1e-4f;

class Export : public testing::Test {
 protected:
  void SetUp() override {
    folder_ = fs::path(testing::TempDir()) / ("export_" + std::to_string(::getpid()));
    fs::create_directories(folder_);
  }
  void TearDown() override { fs::remove_all(folder_); }
  [[nodiscard]] std::string path(const std::string& name) const { return (folder_ / name).string(); }

  // Writes these frames and returns what went wrong.
  std::string write(const std::string& name, const ExportedStrands& strands,
                    const std::vector<std::vector<Vec3f>>& frames, const std::optional<ExportedMotion>& motion = {}) {
    auto writer = open_strand_file(path(name), strands, motion);
    if (!writer) return writer.error();
    for (const std::vector<Vec3f>& frame : frames) {
      if (const Result<void> added = (*writer)->add(frame); !added) return added.error();
    }
    const Result<void> finished = (*writer)->finish();
    return finished ? std::string() : finished.error();
  }
  [[nodiscard]] std::vector<std::byte> bytes(const std::string& name) const { return test::file_bytes(path(name)); }
  [[nodiscard]] bool is_there(const std::string& name) const { return fs::exists(path(name)); }

  fs::path folder_;
};

// Makes strands of 2 to 5 points in three groups, in turn, at pseudo-random places, and a strand of one point, which no
// format can hold.
Groom small_groom() {
  Groom groom;
  groom.name = "small";
  groom.group_names = {"fringe", "back \"of\" head", "2nd"};
  std::uint64_t seed = 1;
  const auto next = [&] {
    // This is the linear congruential generator of Knuth's MMIX. Its upper 24 bits become a number from -0.5 to 0.5.
    seed = seed * 6364136223846793005u + 1442695040888963407u;
    return static_cast<float>(seed >> 40) / 16'777'216 - 0.5f;
  };
  for (std::uint16_t s = 0; s < 12; ++s) {
    std::vector<Vec3f> points;
    for (int i = 0; i < 2 + s % 4; ++i) points.emplace_back(0.3f * next(), 0.3f * next(), 0.3f * next());
    StrandProperties properties;
    properties.group = s % 3;
    properties.radius_m = 4e-5f * (1 + properties.group);
    groom.add_strand(points, properties);
  }
  const Vec3f stray(0, 0.1f, 0);
  groom.add_strand({&stray, 1}, {});
  return groom;
}

std::vector<Vec3f> points_of(const Groom& groom, const ExportedStrands& strands) {
  std::vector<Vec3f> points;
  strands.take_points(groom.points, points);
  return points;
}

float distance(std::span<const Vec3f> a, std::span<const Vec3f> b) {
  EXPECT_EQ(a.size(), b.size());
  float most = 0;
  for (std::size_t i = 0; i < std::min(a.size(), b.size()); ++i) most = std::max(most, (a[i] - b[i]).norm());
  return most;
}

// Returns frames in which the points move and bend a little more each time.
std::vector<std::vector<Vec3f>> moved(const std::vector<Vec3f>& points, std::size_t frames) {
  std::vector<std::vector<Vec3f>> all;
  for (std::size_t f = 0; f < frames; ++f) {
    const float t = 0.01f * static_cast<float>(f);
    std::vector<Vec3f>& frame = all.emplace_back(points);
    for (Vec3f& x : frame) x += Vec3f(t, t * x.x(), -2 * t * x.y());
  }
  return all;
}

// What is in a .glb: its JSON and its numbers.
struct Glb {
  Json json;
  std::vector<std::byte> data;

  template <class Number>
  [[nodiscard]] std::vector<Number> values(std::size_t accessor, std::size_t of_each) const {
    const Json &a = json["accessors"][accessor], &view = json["bufferViews"][a["bufferView"].get<std::size_t>()];
    std::vector<Number> out(a["count"].get<std::size_t>() * of_each);
    const std::size_t at = view["byteOffset"].get<std::size_t>() + a["byteOffset"].get<std::size_t>();
    EXPECT_LE(a["byteOffset"].get<std::size_t>() + out.size() * sizeof(Number), view["byteLength"].get<std::size_t>());
    std::memcpy(out.data(), data.data() + at, out.size() * sizeof(Number));
    return out;
  }
};

Glb glb_of(const std::vector<std::byte>& bytes) {
  const auto word = [&](std::size_t at) {
    std::uint32_t value = 0;
    std::memcpy(&value, bytes.data() + at, 4);
    return value;
  };
  // The words are glTF, version 2, the size of the file, the size of the JSON, and before the data the word BIN.
  EXPECT_EQ(word(0), 0x46546C67u);
  EXPECT_EQ(word(4), 2u);
  EXPECT_EQ(word(8), bytes.size());
  const std::size_t text = word(12);
  EXPECT_EQ(text % 4, 0u);
  EXPECT_EQ(word(24 + text), 0x004E4942u);
  EXPECT_EQ(word(20 + text) + 28 + text, bytes.size());
  const char* begin = reinterpret_cast<const char*>(bytes.data()) + 20;
  return {Json::parse(begin, begin + text), {bytes.begin() + static_cast<std::ptrdiff_t>(28 + text), bytes.end()}};
}

// Reads the strands of one frame from a .glb. Its primitives are lines (mode 1), and frames after the first are morph
// targets.
ImportedStrands strands_of_glb(const Glb& glb, std::size_t frame = 0) {
  ImportedStrands out;
  for (const Json& mesh : glb.json["meshes"]) {
    const Json& primitive = mesh["primitives"][0];
    EXPECT_EQ(primitive["mode"], 1);
    auto numbers = glb.values<float>(primitive["attributes"]["POSITION"], 3);
    if (frame > 0) {
      const auto target = glb.values<float>(primitive["targets"][frame - 1]["POSITION"], 3);
      for (std::size_t i = 0; i < numbers.size(); ++i) numbers[i] += target[i];
    }
    const auto ends = glb.values<std::uint32_t>(primitive["indices"], 1);
    const std::size_t first = out.points.size();
    for (std::size_t i = 0; i < numbers.size(); i += 3)
      out.points.emplace_back(numbers[i], numbers[i + 1], numbers[i + 2]);
    for (std::size_t i = 1; i < ends.size(); i += 2) {
      EXPECT_EQ(ends[i], ends[i - 1] + 1);
      if (i + 1 == ends.size() || ends[i + 1] != ends[i])
        out.strand_begin.push_back(static_cast<std::uint32_t>(first + ends[i] + 1));
    }
  }
  return out;
}

const std::array<const char*, 7> kFiles{"hair.abc", "hair.usda", "hair.hair", "hair.ply",
                                        "hair.npz", "hair.glb",  "hair.gltf"};

ImportedStrands read_back(const std::string& path) {
  if (path.ends_with(".glb")) return strands_of_glb(glb_of(test::file_bytes(path)));
  if (path.ends_with(".gltf")) {
    const Json json = Json::parse(test::file_text(path));
    EXPECT_EQ(json["asset"]["version"], "2.0");
    const std::string uri = json["buffers"][0]["uri"];
    constexpr std::string_view kBegin = "data:application/octet-stream;base64,";
    EXPECT_TRUE(uri.starts_with(kBegin));
    const std::size_t bytes = json["buffers"][0]["byteLength"];
    EXPECT_EQ(uri.size() - kBegin.size(), (bytes + 2) / 3 * 4);
    Glb glb{json, {}};
    // Four digits of base64 are 24 bits, thus three bytes. The padding counts as zeros, so up to two bytes too many
    // follow.
    std::uint32_t word = 0;
    int digits = 0;
    for (const char c : std::string_view(uri).substr(kBegin.size())) {
      const int digit = c >= 'A' && c <= 'Z'   ? c - 'A'
                        : c >= 'a' && c <= 'z' ? c - 'a' + 26
                        : c >= '0' && c <= '9' ? c - '0' + 52
                        : c == '+'             ? 62
                        : c == '/'             ? 63
                                               : 0;
      word = word << 6 | static_cast<std::uint32_t>(digit);
      if (++digits % 4 != 0) continue;
      for (int b = 2; b >= 0; --b) glb.data.push_back(static_cast<std::byte>(word >> (8 * b)));
    }
    return strands_of_glb(glb);
  }
  auto strands = strand_decoder_of(path)(*read_file(path));
  EXPECT_TRUE(strands) << strands.error();
  return strands ? std::move(*strands) : ImportedStrands();
}

// Names of objects may have letters, digits and underscores alone, so several groups may come to the same name. A
// program that reads the file would then merge them.
TEST(ExportedStrands, have_groups_of_different_names) {
  ExportedStrands strands;
  for (const char* name : {"a_b_2", "a b", "a.b", "a/b", "1"}) {
    strands.groups.emplace_back().name = name;
    strands.groups.back().id = static_cast<std::uint32_t>(strands.groups.size()) - 1;
  }
  EXPECT_THAT(object_names(strands), ElementsAre("a_b_2", "a_b", "a_b_2_2", "a_b_3", "_1"));
}

// Every format is read back by our own importer, except for glTF, which this file reads by itself. Floats must come
// back to the bit.
TEST_F(Export, strands_of_different_length_come_back_from_each_format) {
  const Groom groom = small_groom();
  const ExportedStrands strands = exported_strands(groom);
  EXPECT_EQ(strands.strand_count(), 12u);
  EXPECT_EQ(left_behind(groom, strands), "not written, since only strands are: 1 strand of less than 2 points");
  const std::vector<Vec3f> points = points_of(groom, strands);
  for (const char* file : kFiles) {
    ASSERT_EQ(write(file, strands, {points}), "") << file;
    const ImportedStrands read = read_back(path(file));
    EXPECT_EQ(read.strand_begin, strands.strand_begin) << file;
    EXPECT_LE(distance(read.points, points), 0) << file;
  }
}

TEST_F(Export, groups_and_widths_come_back_from_alembic_and_usd) {
  Groom groom = small_groom();
  for (const bool is_even : {true, false}) {
    // First every group has one width, and then group 0 has two.
    if (!is_even) groom.strands[0].radius_m = 1e-4f;
    const ExportedStrands strands = exported_strands(groom);
    for (const char* file : {"hair.abc", "hair.usda"}) {
      ASSERT_EQ(write(file, strands, {points_of(groom, strands)}), "");
      const ImportedStrands read = read_back(path(file));
      ASSERT_THAT(read.group_names, ElementsAre("fringe", HasSubstr("head"), "2nd")) << file;
      ASSERT_EQ(read.widths.size(), read.points.size()) << file;
      for (std::size_t s = 0; s < strands.strand_count(); ++s) {
        const std::uint32_t in_groom = strands.groom_strands[s];
        EXPECT_EQ(read.groups[s], groom.strands[in_groom].group) << file;
        for (std::uint32_t i = read.strand_begin[s]; i < read.strand_begin[s + 1]; ++i)
          EXPECT_FLOAT_EQ(read.widths[i], 2 * groom.strands[in_groom].radius_m) << file;
      }
      EXPECT_TRUE(read.doubts.empty()) << read.doubts.front();
    }
  }
}

// Writes a groom into its file, reads it, exports its strands to every format, and expects them to come back as they
// were.
void expect_same_curves(const Groom& groom, const std::string& folder) {
  const auto stored = wire::decode_groom(wire::encode_groom(groom));
  ASSERT_TRUE(stored) << stored.error();
  const ExportedStrands strands = exported_strands(*stored);
  const std::vector<Vec3f> original = points_of(groom, exported_strands(groom)), points = points_of(*stored, strands);
  for (const char* file : kFiles) {
    const std::string path = folder + "/" + file;
    auto writer = open_strand_file(path, strands);
    ASSERT_TRUE(writer) << writer.error();
    ASSERT_TRUE((*writer)->add(points));
    ASSERT_TRUE((*writer)->finish());
    const ImportedStrands read = read_back(path);
    EXPECT_EQ(read.strand_begin, strands.strand_begin) << groom.name << ' ' << file;
    EXPECT_LE(distance(read.points, original), kSame_m) << groom.name << ' ' << file;
  }
}

TEST_F(Export, made_hair_comes_back_within_a_tenth_of_a_millimetre) {
  HairstyleOptions options;
  options.strand_count = 300;
  const Result<Groom> groom = make_hairstyle("bob", options);
  ASSERT_TRUE(groom) << groom.error();
  expect_same_curves(*groom, folder_.string());
}

class ExportRealHair : public Export, public testing::WithParamInterface<test::RealHair> {};

TEST_P(ExportRealHair, comes_back_within_a_tenth_of_a_millimetre) {
  if (!fs::exists(test::shared_data() / GetParam().path)) GTEST_SKIP() << "NOT TESTED: no " << GetParam().path;
  const Result<Groom> groom = test::import_real(GetParam());
  ASSERT_TRUE(groom) << groom.error();
  expect_same_curves(*groom, folder_.string());
}
INSTANTIATE_TEST_SUITE_P(Styles, ExportRealHair, testing::ValuesIn(test::kRealHair), support::CaseName());

TEST_F(Export, motion_comes_back_from_alembic) {
  const Groom groom = small_groom();
  const ExportedStrands strands = exported_strands(groom);
  const auto frames = moved(points_of(groom, strands), 7);
  ASSERT_EQ(write("hair.abc", strands, frames, ExportedMotion{25, {}}), "");
  const auto motion = decode_alembic_motion(bytes("hair.abc"));
  ASSERT_TRUE(motion) << motion.error();
  ASSERT_EQ(motion->times_s.size(), frames.size());
  for (std::size_t f = 0; f < frames.size(); ++f) {
    EXPECT_NEAR(motion->times_s[f], static_cast<double>(f) / 25, 1e-9);
    EXPECT_LE(distance(motion->points[f], frames[f]), 0) << f;
  }
}

TEST_F(Export, hair_that_stands_still_for_a_while_comes_back_from_alembic) {
  const Groom groom = small_groom();
  const ExportedStrands strands = exported_strands(groom);
  const auto three = moved(points_of(groom, strands), 3);
  const std::vector<std::vector<Vec3f>> frames{three[0], three[0], three[1], three[1],
                                               three[1], three[0], three[2], three[2]};
  ASSERT_EQ(write("hair.abc", strands, frames, ExportedMotion{30, frames.size()}), "");
  const auto motion = decode_alembic_motion(bytes("hair.abc"));
  ASSERT_TRUE(motion) << motion.error();
  ASSERT_EQ(motion->times_s.size(), frames.size());
  for (std::size_t f = 0; f < frames.size(); ++f) EXPECT_LE(distance(motion->points[f], frames[f]), 0) << f;
  // Equal frames are stored once. Of these eight frames only three differ, so five arrays of 12 bytes a point are
  // saved, apart from up to 400 bytes of lists.
  ASSERT_EQ(write("moving.abc", strands, moved(three[0], frames.size()), ExportedMotion{30, {}}), "");
  EXPECT_LT(fs::file_size(path("hair.abc")) + 5 * 12 * strands.point_count(), fs::file_size(path("moving.abc")) + 400);
}

TEST_F(Export, motion_comes_back_from_usd_arrays_and_gltf) {
  const Groom groom = small_groom();
  const ExportedStrands strands = exported_strands(groom);
  const auto frames = moved(points_of(groom, strands), 4);
  for (const char* file : {"hair.usda", "hair.npz", "hair.glb"}) {
    ASSERT_EQ(write(file, strands, frames, ExportedMotion{24, frames.size()}), "");
    EXPECT_LE(distance(read_back(path(file)).points, frames[0]), 0) << file;
  }
  const std::string usd = test::file_text(path("hair.usda"));
  for (const char* line : {"endTimeCode = 3\n", "timeCodesPerSecond = 24\n", "upAxis = \"Y\"\n", "metersPerUnit = 1\n",
                           "def BasisCurves \"back__of__head\"", "def BasisCurves \"_2nd\""})
    EXPECT_THAT(usd, HasSubstr(line));
  // Each group has its points and its extent at each time.
  std::size_t samples = 0;
  for (std::size_t at = usd.find("\n            3: "); at != std::string::npos;
       at = usd.find("\n            3: ", at + 1))
    ++samples;
  EXPECT_EQ(samples, 2 * strands.groups.size());

  const Glb glb = glb_of(bytes("hair.glb"));
  for (std::size_t f = 0; f < frames.size(); ++f)
    EXPECT_LE(distance(strands_of_glb(glb, f).points, frames[f]), 1e-7f) << f;
  const Json& animation = glb.json["animations"][0];
  EXPECT_EQ(animation["channels"].size(), strands.groups.size());
  const auto times = glb.values<float>(animation["samplers"][0]["input"], 1),
             weights = glb.values<float>(animation["samplers"][0]["output"], 1);
  EXPECT_THAT(times, ElementsAre(0, 1 / 24.f, 2 / 24.f, 3 / 24.f));
  // There are three morph targets for each of the four times. The mesh itself is the first frame, so all weights are
  // 0 there.
  EXPECT_THAT(weights, ElementsAre(0, 0, 0, 1, 0, 0, 0, 1, 0, 0, 0, 1));

  // The frames are the first array, stored as they are.
  const std::vector<std::byte> npz = bytes("hair.npz");
  const std::string text(reinterpret_cast<const char*>(npz.data()), npz.size());
  EXPECT_THAT(text.substr(0, 200), HasSubstr("frames.npy"));
  EXPECT_THAT(text, HasSubstr("'shape': (4, " + std::to_string(strands.point_count()) + ", 3)"));
  // The header of an .npy array takes 128 bytes here.
  const std::size_t begin = text.find("\x93NUMPY") + 128;
  for (std::size_t f = 0; f < frames.size(); ++f) {
    std::vector<Vec3f> frame(strands.point_count());
    std::memcpy(frame[0].data(), text.data() + begin + f * 12 * frame.size(), 12 * frame.size());
    EXPECT_EQ(distance(frame, frames[f]), 0) << f;
  }
}

TEST_F(Export, motion_of_one_frame_is_still) {
  const Groom groom = small_groom();
  const ExportedStrands strands = exported_strands(groom);
  const std::vector<Vec3f> points = points_of(groom, strands);
  for (const char* file : {"hair.abc", "hair.usda", "hair.npz", "hair.glb"}) {
    ASSERT_EQ(write(file, strands, {points}, ExportedMotion{24, 1}), "") << file;
    EXPECT_EQ(distance(read_back(path(file)).points, points), 0) << file;
  }
}

TEST_F(Export, any_byte_of_an_archive_of_arrays_may_be_missing) {
  const Groom groom = small_groom();
  const ExportedStrands strands = exported_strands(groom);
  ASSERT_EQ(write("hair.npz", strands, {points_of(groom, strands)}), "");
  const std::vector<std::byte> whole = bytes("hair.npz");
  for (std::size_t size = 0; size < whole.size(); ++size)
    EXPECT_FALSE(decode_npy(std::span(whole).first(size))) << size;
}

// A file that lacks a part would be found broken only in the other program, so it must not be written at all.
TEST_F(Export, what_a_format_cannot_hold_is_refused_with_a_reason_and_leaves_no_file) {
  const Groom groom = small_groom();
  const ExportedStrands strands = exported_strands(groom);
  const std::vector<Vec3f> points = points_of(groom, strands);
  for (const char* file : kFiles) {
    EXPECT_EQ(write(file, ExportedStrands(), {{}}), "there are no strands to write") << file;
    ExportedStrands short_one = strands;
    short_one.strand_begin = {0, 2, 3};
    EXPECT_EQ(write(file, short_one, {{}}), "strand 1 has 1 point: a curve needs 2") << file;
    EXPECT_EQ(write(file, strands, {{points[0]}}),
              "frame 0 has 1 points, and the strands have " + std::to_string(points.size()))
        << file;
    std::vector<Vec3f> lost = points;
    lost[3].x() = NAN;
    EXPECT_EQ(write(file, strands, {lost}), "frame 0 has a point that is not finite") << file;
    EXPECT_EQ(write(file, strands, {}), "there is no frame to write") << file;
    EXPECT_FALSE(is_there(file)) << file;
  }
  EXPECT_TRUE(fs::is_empty(folder_));
  EXPECT_EQ(write("hair.xyz", strands, {points}), "strands are written to .abc .usda .hair .ply .npz .gltf .glb files");
  EXPECT_EQ(write("hair.gl", strands, {points}), "strands are written to .abc .usda .hair .ply .npz .gltf .glb files");
  EXPECT_EQ(write("hair.ply", strands, {points}, ExportedMotion{30, 2}),
            "a .ply file holds no motion: these do: .abc .usda .npz .gltf .glb");
  EXPECT_THAT(write("nowhere/hair.abc", strands, {points}), HasSubstr("there is no folder"));
  EXPECT_EQ(write("hair.abc", strands, {points}, ExportedMotion{0, 2}), "a motion needs a rate above 0 Hz");
}

TEST_F(Export, huge_counts_are_refused_before_anything_is_written) {
  ExportedStrands strands;
  // A .hair file holds at most 65 536 points in a strand, glTF at most 1000 frames (gltf_writer.cpp), and no file more
  // points than an int32 counts.
  strands.strand_begin = {0, 65'537};
  strands.groups = {{"hair", 0, 0, 1, 0, 65'537}};
  strands.groom_strands = strands.groom_points = {0};
  EXPECT_EQ(write("hair.hair", strands, {}), "strand 0 has 65537 points, and a .hair holds at most 65536 of each");
  strands.strand_begin = {0, 3'000'000'000};
  for (const char* file : kFiles)
    EXPECT_EQ(write(file, strands, {}), "3000000000 points are more than a file can count: at most 2147483647") << file;

  const Groom groom = small_groom();
  const ExportedStrands small = exported_strands(groom);
  const auto refusal = [&](const char* file, std::size_t frames) {
    return write(file, small, {}, ExportedMotion{30, frames});
  };
  EXPECT_THAT(refusal("hair.glb", 1001), HasSubstr("1001 frames are too many for glTF"));
  EXPECT_THAT(refusal("hair.usda", 100'000'000), HasSubstr("are too many for this format"));
  EXPECT_THAT(refusal("hair.npz", 100'000'000), HasSubstr("more than the 4 GB of an .npz"));
  for (const char* file : {"hair.glb", "hair.usda", "hair.npz"})
    EXPECT_THAT(refusal(file, 100'000'000), EndsWith("write fewer, or an .abc")) << file;
  EXPECT_TRUE(fs::is_empty(folder_));
}

}  // namespace
}  // namespace hairnet
