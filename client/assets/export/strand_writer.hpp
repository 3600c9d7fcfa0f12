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

// The frames of a motion, the first at 0 s. The rate must be positive and finite.
struct ExportedMotion {
  double rate_hz = 30;
  // Empty where the number is not known before the end.
  std::optional<std::size_t> frame_count;
};

// Writes one file of strands: of one frame, or of a motion, whose frames come one at a time. The file appears under its
// name in finish(), whole; without it there is none. Refusals do not name the file. One thread. Destroying a writer
// without finish() leaves no file.
class StrandWriter {
 public:
  virtual ~StrandWriter() = default;

  // Adds a frame: the points of all strands, in m, in their order. A failure to write shows in finish(). Returns an
  // error for a wrong number of points, a point that is not finite, and a frame beyond what the format holds.
  Result<void> add(std::span<const Vec3f> points);
  // Returns an error without any frame, and when the disc is full or the file cannot be moved to its name.
  Result<void> finish();

 protected:
  explicit StrandWriter(const ExportedStrands& strands) : strands_(strands) {}
  [[nodiscard]] const ExportedStrands& strands() const { return strands_; }
  [[nodiscard]] std::size_t frame_count() const { return frame_count_; }

 private:
  // Writes or keeps a frame. `points` are as many as the strands have, and finite. `frame_count` counts this frame
  // already, so it is 1 in the first call.
  virtual Result<void> put(std::span<const Vec3f> points) = 0;
  // Writes the rest and gives the file its name. It is called once, after one frame at least.
  virtual Result<void> close() = 0;

  const ExportedStrands& strands_;
  std::size_t frame_count_ = 0;
};

// Opens the file of the format that its extension names. Without `motion` it gets one frame. The strands must outlive
// the writer. Refuses what the format cannot hold. A motion whose number of frames is given is refused here if it
// cannot fit, before anything is simulated.
Result<std::unique_ptr<StrandWriter>> open_strand_file(const std::string& path, const ExportedStrands& strands,
                                                       const std::optional<ExportedMotion>& motion = {});

}  // namespace hairnet
