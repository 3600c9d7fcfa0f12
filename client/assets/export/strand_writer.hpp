#pragma once

#include <cstddef>
#include <memory>
#include <optional>
#include <span>
#include <string>
#include <string_view>

#include "client/assets/export/exported_strands.hpp"
#include "core/result.hpp"

namespace hairnet {

// The extensions of files that strands are written to, and of those that also hold motion, for messages: ".abc .usda
// …".
std::string exported_extensions();
std::string exported_motion_extensions();
[[nodiscard]] bool is_exported_file(std::string_view path);
[[nodiscard]] bool is_exported_motion(std::string_view path);

// The frames of a motion, the first at 0 s.
struct ExportedMotion {
  double rate_hz = 30;
  // None: it is not known before the end.
  std::optional<std::size_t> frame_count;
};

// Writes one file of strands: of one frame, or of a motion, whose frames come one at a time. The file appears under its
// name in finish(), whole; without it there is none. Refusals do not name the file. One thread.
class StrandWriter {
 public:
  virtual ~StrandWriter() = default;

  // Adds a frame: the points of all strands, in m, in their order. A failure to write shows in finish().
  Result<void> add(std::span<const Vec3f> points);
  Result<void> finish();

 protected:
  explicit StrandWriter(const ExportedStrands& strands) : strands_(strands) {}
  [[nodiscard]] const ExportedStrands& strands() const { return strands_; }
  [[nodiscard]] std::size_t frame_count() const { return frame_count_; }

 private:
  // `points` are as many as the strands have, and finite.
  virtual Result<void> put(std::span<const Vec3f> points) = 0;
  virtual Result<void> close() = 0;

  const ExportedStrands& strands_;
  std::size_t frame_count_ = 0;
};

// Opens the file of the format that its extension names. Without `motion` it gets one frame. The strands must outlive
// the writer. Refuses what the format cannot hold.
Result<std::unique_ptr<StrandWriter>> open_strand_file(const std::string& path, const ExportedStrands& strands,
                                                       const std::optional<ExportedMotion>& motion = {});

}  // namespace hairnet
