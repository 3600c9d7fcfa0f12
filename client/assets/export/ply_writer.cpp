#include <algorithm>

#include "client/assets/export/byte_writer.hpp"
#include "client/assets/export/formats.hpp"

// Strands as the vertices of a binary .ply, each with the number of its strand and of its group. The format holds one
// frame, so all bytes are put together in memory.
namespace hairnet {
namespace {

class PlyWriter : public StrandWriter {
 public:
  PlyWriter(OutputFile file, const ExportedStrands& strands) : StrandWriter(strands), file_(std::move(file)) {}

 private:
  Result<void> put(std::span<const Vec3f> points) override {
    const ExportedStrands& out = strands();
    const bool has_widths = !out.widths_m.empty();
    ByteWriter bytes;
    bytes.text("ply\nformat binary_little_endian 1.0\ncomment Hairnet: strands in metres, y up, face +z\n");
    for (const ExportedStrands::Group& group : out.groups) {
      // A line end within a name would end the comment and make the rest a line of the header.
      std::string name = group.name;
      std::ranges::replace_if(
          name, [](char c) { return c >= 0 && c < ' '; }, ' ');
      bytes.text("comment group " + std::to_string(group.id) + ' ' + name + '\n');
    }
    bytes.text("element vertex " + std::to_string(points.size()) + "\nproperty float x\nproperty float y\n");
    bytes.text("property float z\nproperty uint strand_id\nproperty uint group_id\n");
    bytes.text(has_widths ? "property float width\nend_header\n" : "end_header\n");
    for (const ExportedStrands::Group& group : out.groups) {
      for (std::uint32_t s = group.begin; s < group.end; ++s) {
        for (std::uint32_t i = out.strand_begin[s]; i < out.strand_begin[s + 1]; ++i) {
          bytes.put(std::as_bytes(points.subspan(i, 1))).put(s).put(group.id);
          if (has_widths) bytes.put(out.widths_m[s]);
        }
      }
    }
    file_.write(bytes.bytes());
    return {};
  }
  Result<void> close() override { return file_.finish(); }

  OutputFile file_;
};

}  // namespace

OpenedWriter write_ply(OutputFile file, const ExportedStrands& strands, const MaybeMotion& /*motion*/) {
  return std::make_unique<PlyWriter>(std::move(file), strands);
}

}  // namespace hairnet
