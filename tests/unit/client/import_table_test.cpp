#include <gmock/gmock.h>
#include <unistd.h>

#include <array>
#include <filesystem>
#include <map>
#include <set>

#include "client/assets/export/strand_writer.hpp"
#include "client/assets/import/alembic.hpp"
#include "client/assets/import/head_files.hpp"
#include "client/assets/made/made.hpp"
#include "client/files/read_file.hpp"
#include "tests/support/import_files.hpp"

// Makes the table of what files of each program hold, and compares it with that of the page.
namespace hairnet {
namespace {

namespace fs = std::filesystem;

enum Column : std::size_t { kWidths, kColours, kRootUvs, kGroups, kGuides, kUp, kUnit, kMotion, kColumns };

// What all files of one program have in common.
struct Row {
  std::set<std::string> extensions;
  std::size_t files = 0, strands = 0, points = 0;
  std::array<bool, kColumns> has{};
  std::set<std::string> unused;
};

// Returns the program that a real file comes from, by its name.
std::string program_of(const fs::path& file) {
  const std::string name = file.filename().string();
  if (file.extension() == ".tfx") return "TressFX 3";
  using Program = std::pair<std::string_view, std::string_view>;
  for (const auto& [begin, program] : {Program{"blender", "Blender"},
                                       {"houdini", "Houdini"},
                                       {"openusd", "OpenUSD's examples"},
                                       {"maya", "Maya"},
                                       {"c4d", "Cinema 4D"},
                                       {"cortex", "Cortex"},
                                       {"harolongo", "USC-HairSalon"},
                                       {"straight", "Cem Yuksel"}}) {
    if (name.starts_with(begin)) return std::string(program);
  }
  return name;
}

void add(const ImportedStrands& strands, bool moves, Row& row) {
  ++row.files;
  row.strands += strands.strand_count();
  row.points += strands.points.size();
  const std::array<bool, kColumns> has{std::ranges::any_of(strands.widths, [](float width) { return width > 0; }),
                                       !strands.colours.empty(),
                                       !strands.root_uvs.empty(),
                                       !strands.group_names.empty(),
                                       std::ranges::count(strands.guides, 1) > 0,
                                       strands.up.has_value(),
                                       strands.unit_m.has_value(),
                                       moves};
  for (std::size_t c = 0; c < kColumns; ++c) row.has[c] = row.has[c] || has[c];
  for (const std::string& note : strands.notes) {
    // A note with this text lists the names of attributes that the import leaves out.
    constexpr std::string_view kUnused = "that are not used: ";
    if (const std::size_t at = note.find(kUnused); at != std::string::npos) {
      for (std::string_view rest = std::string_view(note).substr(at + kUnused.size()); !rest.empty();) {
        const std::size_t end = std::min(rest.find(", "), rest.size());
        row.unused.emplace(rest.substr(0, end));
        rest.remove_prefix(std::min(end + 2, rest.size()));
      }
    }
  }
}

void add_file(const fs::path& file, Row& row) {
  StrandDecoder* decode = strand_decoder_of(file.string());
  if (decode == nullptr) return;
  const std::vector<std::byte> bytes = test::file_bytes(file);
  const Result<ImportedStrands> strands = decode(bytes);
  // Files without curves, of HDF5, and damaged ones hold nothing to keep.
  if (!strands) return;
  row.extensions.insert(file.extension().string());
  const bool is_alembic = file.extension() == ".abc";
  const Result<StrandMotion> motion = is_alembic ? decode_alembic_motion(bytes) : StrandMotion{};
  add(*strands, motion && motion->times_s.size() > 1, row);
}

// Adds files that we export, of hair with three groups and strands of two widths.
void add_own(const fs::path& folder, std::map<std::string, Row>& rows) {
  HairstyleOptions options;
  options.strand_count = 30;
  Result<Groom> groom = make_hairstyle("bob", options);
  ASSERT_TRUE(groom) << groom.error();
  for (std::size_t s = 0; s < groom->strand_count(); s += 2) groom->strands[s].radius_m = 3e-5f;
  const ExportedStrands strands = exported_strands(*groom);
  std::vector<Vec3f> points, moved;
  strands.take_points(groom->points, points);
  moved = points;
  for (Vec3f& x : moved) x.y() += 0.01f;
  for (const std::string extension : {".abc", ".usda", ".npz", ".ply", ".hair"}) {
    const fs::path file = folder / ("own" + extension);
    const bool moves = is_exported_motion(file.string());
    auto writer = open_strand_file(file.string(), strands, moves ? std::optional(ExportedMotion{}) : std::nullopt);
    ASSERT_TRUE(writer) << writer.error();
    ASSERT_TRUE((*writer)->add(points));
    if (moves) {
      ASSERT_TRUE((*writer)->add(moved));
    }
    ASSERT_TRUE((*writer)->finish());
    add_file(file, rows["`hairnet-groom export`, " + extension]);
  }
}

std::string table_of(const std::map<std::string, Row>& rows) {
  std::string text =
      "| program | files | strands | points | widths | colours | root uv | groups | guides | up | unit | motion | not "
      "used |\n|---|--:|--:|--:|---|---|---|---|---|---|---|---|---|\n";
  for (const auto& [program, row] : rows) {
    if (row.files == 0) continue;
    text += "| " + program + " | " + std::to_string(row.files) + " | " + std::to_string(row.strands) + " | " +
            std::to_string(row.points);
    for (const bool has : row.has) text += has ? " | yes" : " |";
    text += " |";
    for (const std::string& name : row.unused) text += (name == *row.unused.begin() ? " " : ", ") + name;
    text += " |\n";
  }
  return text;
}

TEST(ImportTable, of_the_page_is_what_the_files_hold) {
  if (!fs::exists(test::shared_data() / "import")) GTEST_SKIP() << "no files of programs at " << test::shared_data();
  std::map<std::string, Row> rows;
  for (const char* folder : {"import/abc", "import/usd", "hair"}) {
    for (const fs::directory_entry& entry : fs::recursive_directory_iterator(test::shared_data() / folder)) {
      if (entry.is_regular_file()) add_file(entry.path(), rows[program_of(entry.path())]);
    }
  }
  const fs::path made = fs::path(testing::TempDir()) / ("import_table_" + std::to_string(::getpid()));
  fs::create_directories(made);
  add_own(made, rows);
  fs::remove_all(made);
  const std::string page = test::file_text(fs::path(HAIRNET_SOURCE_DIR) / "client/assets/import/README.md");
  // The table on the page ends at the first empty line.
  const std::size_t begin = std::min(page.find("| program | files |"), page.size());
  EXPECT_EQ(page.substr(begin, page.find("\n\n", begin) + 1 - begin), table_of(rows));
}

}  // namespace
}  // namespace hairnet
