#pragma once

#include "client/assets/export/strand_writer.hpp"
#include "schema/files/output_file.hpp"

// The formats of files that strands are written to. open_strand_file() calls these with strands that it has checked.
// Each takes the open file over. Nothing is visible under the file's name before `finish` of the writer.
namespace hairnet {

using OpenedWriter = Result<std::unique_ptr<StrandWriter>>;
using MaybeMotion = std::optional<ExportedMotion>;

OpenedWriter write_alembic(OutputFile file, const ExportedStrands& strands, const MaybeMotion& motion);
OpenedWriter write_usda(OutputFile file, const ExportedStrands& strands, const MaybeMotion& motion);
OpenedWriter write_npz(OutputFile file, const ExportedStrands& strands, const MaybeMotion& motion);
OpenedWriter write_gltf(OutputFile file, const ExportedStrands& strands, const MaybeMotion& motion);
OpenedWriter write_glb(OutputFile file, const ExportedStrands& strands, const MaybeMotion& motion);
// These hold no motion, so there is none.
OpenedWriter write_yuksel_hair(OutputFile file, const ExportedStrands& strands, const MaybeMotion& motion);
OpenedWriter write_ply(OutputFile file, const ExportedStrands& strands, const MaybeMotion& motion);

// Some formats need all frames before the first byte can be written. These frames are kept, as long as they take no
// more than `bytes_max`. USD writes all samples of an attribute together, and glTF its counts before its data; Alembic
// and .npz need no memory.
class KeptFrames {
 public:
  KeptFrames(std::size_t point_count, std::size_t bytes_max) : point_count_(point_count), bytes_max_(bytes_max) {}
  // Whether that many frames fit. The refusal names .abc, which needs no such memory.
  [[nodiscard]] Result<void> check(std::size_t frame_count) const;
  Result<void> add(std::span<const Vec3f> points);
  [[nodiscard]] std::size_t count() const { return frames_.size(); }
  [[nodiscard]] std::span<const Vec3f> frame(std::size_t i) const { return frames_[i]; }

 private:
  std::size_t point_count_, bytes_max_;
  std::vector<std::vector<Vec3f>> frames_;
};

}  // namespace hairnet
