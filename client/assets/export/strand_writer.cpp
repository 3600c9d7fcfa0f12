#include "client/assets/export/strand_writer.hpp"

#include <algorithm>
#include <array>
#include <cmath>
#include <limits>

#include "client/assets/export/formats.hpp"
#include "core/file_name.hpp"

namespace hairnet {
namespace {

// Most formats count points with whole numbers of 32 bits with a sign.
constexpr std::size_t kPointsMax = std::numeric_limits<std::int32_t>::max();

// A further format needs a line here and a function in formats.hpp.
struct Format {
  std::string_view extension;
  bool holds_motion;
  OpenedWriter (*open)(OutputFile file, const ExportedStrands& strands, const MaybeMotion& motion);
};
// Every format, in the order of messages.
constexpr std::array<Format, 7> kFormats{{{".abc", true, write_alembic},
                                          {".usda", true, write_usda},
                                          {".hair", false, write_yuksel_hair},
                                          {".ply", false, write_ply},
                                          {".npz", true, write_npz},
                                          {".gltf", true, write_gltf},
                                          {".glb", true, write_glb}}};

const Format* format_of(std::string_view path) {
  const auto found = std::ranges::find(kFormats, extension_of(path), &Format::extension);
  return found == kFormats.end() ? nullptr : found;
}

std::string extensions_of(bool only_motion) {
  std::string text;
  for (const Format& format : kFormats) {
    if (format.holds_motion || !only_motion) text.append(text.empty() ? "" : " ").append(format.extension);
  }
  return text;
}

// What is checked once here need not be checked by any format.
Result<void> check(const ExportedStrands& strands, const MaybeMotion& motion) {
  if (strands.strand_count() == 0) return Refusal("there are no strands to write");
  std::size_t points = 0;
  for (std::size_t s = 0; s < strands.strand_count(); ++s) {
    const std::uint32_t begin = strands.strand_begin[s], end = strands.strand_begin[s + 1];
    // The comparison is in 64 bits: an end before its begin gives an error and not a huge count.
    if (end < begin + std::uint64_t{2})
      return Refusal("strand " + std::to_string(s) + " has " + (end == begin + 1 ? "1 point" : "no points") +
                     ": a curve needs 2");
    points += end - begin;
  }
  if (points > kPointsMax)
    return Refusal(std::to_string(points) + " points are more than a file can count: at most " +
                   std::to_string(kPointsMax));
  if (motion && !(motion->rate_hz > 0 && std::isfinite(motion->rate_hz)))
    return Refusal("a motion needs a rate above 0 Hz");
  return {};
}

}  // namespace

std::string exported_extensions() {
  return extensions_of(false);
}

std::string exported_motion_extensions() {
  return extensions_of(true);
}

bool is_exported_file(std::string_view path) {
  return format_of(path) != nullptr;
}

bool is_exported_motion(std::string_view path) {
  const Format* format = format_of(path);
  return format != nullptr && format->holds_motion;
}

Result<void> StrandWriter::add(std::span<const Vec3f> points) {
  const std::string of_frame = "frame " + std::to_string(frame_count_);
  if (points.size() != strands_.point_count())
    return Refusal(of_frame + " has " + std::to_string(points.size()) + " points, and the strands have " +
                   std::to_string(strands_.point_count()));
  // NaN must not reach the files of other programs, which need not check for it.
  if (!std::ranges::all_of(points, [](const Vec3f& x) { return x.allFinite(); }))
    return Refusal(of_frame + " has a point that is not finite");
  ++frame_count_;
  return put(points);
}

Result<void> StrandWriter::finish() {
  if (frame_count_ == 0) return Refusal("there is no frame to write");
  return close();
}

Result<void> KeptFrames::check(std::size_t frame_count) const {
  // The strands were checked before, so there is a point to divide by.
  const std::size_t frames_max = bytes_max_ / (sizeof(Vec3f) * point_count_);
  if (frame_count <= frames_max) return {};
  return Refusal(std::to_string(frame_count) + " frames of " + std::to_string(point_count_) +
                 " points are too many for this format, which takes " + std::to_string(frames_max) +
                 ": write fewer, or an .abc");
}

Result<void> KeptFrames::add(std::span<const Vec3f> points) {
  if (const Result<void> fits = check(frames_.size() + 1); !fits) return fits;
  frames_.emplace_back(points.begin(), points.end());
  return {};
}

OpenedWriter open_strand_file(const std::string& path, const ExportedStrands& strands, const MaybeMotion& motion) {
  const Format* format = format_of(path);
  if (format == nullptr) return Refusal("strands are written to " + exported_extensions() + " files");
  if (motion && !format->holds_motion)
    return Refusal("a " + std::string(format->extension) +
                   " file holds no motion: these do: " + exported_motion_extensions());
  if (const Result<void> can = check(strands, motion); !can) return Refusal(can.error());
  // The file is created after these checks. Where the format itself then refuses, its temporary file is removed.
  Result<OutputFile> file = OutputFile::create(path);
  if (!file) return Refusal(file.error());
  return format->open(std::move(*file), strands, motion);
}

}  // namespace hairnet
