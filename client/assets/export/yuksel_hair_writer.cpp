#include <algorithm>
#include <limits>

#include "client/assets/export/byte_writer.hpp"
#include "client/assets/export/formats.hpp"

// Cem Yuksel's .hair: a header of 128 bytes, then the arrays that its bits name, in bit order.
namespace hairnet {
namespace {

// The bits of the arrays that follow the header. Arrays of transparency and colour are not written.
constexpr std::uint32_t kSegmentsBit = 1, kPointsBit = 2, kThicknessBit = 4;
// The header's last field is text of a fixed length.
constexpr std::size_t kInformationBytes = 88;

class YukselHairWriter : public StrandWriter {
 public:
  YukselHairWriter(OutputFile file, const ExportedStrands& strands) : StrandWriter(strands), file_(std::move(file)) {}

 private:
  Result<void> put(std::span<const Vec3f> points) override {
    const ExportedStrands& out = strands();
    // Where all strands have equally many points, the header states the number and the array is left out.
    const std::uint32_t each = out.points_of_each();
    const bool has_one_width =
        out.widths_m.empty() || std::ranges::count(out.widths_m, out.widths_m[0]) == std::ssize(out.widths_m);
    const std::uint32_t arrays = kPointsBit | (each == 0 ? kSegmentsBit : 0) | (has_one_width ? 0 : kThicknessBit);
    ByteWriter bytes;
    bytes.text("HAIR").put(static_cast<std::uint32_t>(out.strand_count()));
    bytes.put(static_cast<std::uint32_t>(points.size())).put(arrays).put(each == 0 ? 0U : each - 1);
    // The header ends with defaults for all strands: thickness, transparency, and a colour, here a brown.
    bytes.put(out.widths_m.empty() ? 1.0f : out.widths_m[0]).put(0.0f).put(0.3f).put(0.2f).put(0.1f);
    std::string information = "Hairnet: metres, y up, face +z";
    information.resize(kInformationBytes);
    bytes.text(information);
    if (each == 0) {
      for (std::size_t s = 0; s < out.strand_count(); ++s) bytes.put(static_cast<std::uint16_t>(out.points_of(s) - 1));
    }
    bytes.put(std::as_bytes(points));
    for (std::size_t s = 0; !has_one_width && s < out.strand_count(); ++s) {
      for (std::uint32_t i = 0; i < out.points_of(s); ++i) bytes.put(out.widths_m[s]);
    }
    file_.write(bytes.bytes());
    return {};
  }
  Result<void> close() override { return file_.finish(); }

  OutputFile file_;
};

}  // namespace

OpenedWriter write_yuksel_hair(OutputFile file, const ExportedStrands& strands, const MaybeMotion& /*motion*/) {
  // Segments are counted by 16 bits, and a strand has one point more.
  constexpr std::uint32_t kPointsOfStrandMax = std::numeric_limits<std::uint16_t>::max() + 1U;
  for (std::size_t s = 0; s < strands.strand_count(); ++s) {
    if (strands.points_of(s) > kPointsOfStrandMax)
      return Refusal("strand " + std::to_string(s) + " has " + std::to_string(strands.points_of(s)) +
                     " points, and a .hair holds at most " + std::to_string(kPointsOfStrandMax) + " of each");
  }
  return std::make_unique<YukselHairWriter>(std::move(file), strands);
}

}  // namespace hairnet
