#include <cstdio>
#include <filesystem>

#include "client/assets/export/strand_writer.hpp"
#include "client/assets/load_groom.hpp"
#include "client/assets/print_warnings.hpp"
#include "client/files/write_file.hpp"
#include "client/tools/groom/commands.hpp"

namespace hairnet::groom {

Result<void> export_groom(const ExportOptions& options) {
  // Checked before the groom is loaded, which may take a while.
  if (const Result<void> possible = check_can_write({options.out}); !possible) return possible;
  if (!is_exported_file(options.out))
    return Refusal(options.out + ": strands are written to " + exported_extensions() + " files");
  const Result<Groom> groom = load_groom(options.groom, options.hairstyle, options.import);
  if (!groom) return Refusal(groom.error());
  const ExportedStrands strands = exported_strands(*groom);
  // Nothing may disappear without a word.
  if (std::string line = left_behind(*groom, strands); !line.empty())
    print_warnings(options.groom, std::vector{std::move(line)});
  Result<std::unique_ptr<StrandWriter>> writer = open_strand_file(options.out, strands);
  if (!writer) return Refusal(options.out + ": " + writer.error());
  std::vector<Vec3f> points;
  strands.take_points(groom->points, points);
  Result<void> written = (*writer)->add(points);
  if (written) written = (*writer)->finish();
  if (!written) return Refusal(options.out + ": " + written.error());
  // The size on the disk, since formats compress.
  std::error_code unknown;
  const auto bytes = std::filesystem::file_size(options.out, unknown);
  std::printf("%s: %zu strands, %zu points, %zu %s", options.out.c_str(), strands.strand_count(), points.size(),
              strands.groups.size(), strands.groups.size() == 1 ? "group" : "groups");
  // A pipe or device has no size.
  if (unknown) {
    std::printf("\n");
  } else {
    std::printf(", %.1f MB\n", static_cast<double>(bytes) / 1e6);
  }
  return {};
}

}  // namespace hairnet::groom
