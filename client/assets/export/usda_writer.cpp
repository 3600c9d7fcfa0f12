#include <algorithm>
#include <array>
#include <charconv>
#include <string>
#include <type_traits>

#include "client/assets/export/formats.hpp"
#include "core/version.hpp"

// USD as text: an Xform with BasisCurves for each group. The samples of an attribute stand together, so all frames are
// kept until the end.
namespace hairnet {
namespace {

// The most bytes of a motion's frames, which are in memory until the file is finished.
constexpr std::size_t kKeptBytesMax = std::size_t{2} << 30;
// The text goes to the file in pieces of about 1 MB.
constexpr std::size_t kPieceBytes = std::size_t{1} << 20;

// Text that goes to the file piece by piece. A flush at every megabyte keeps the text of long motions out of memory.
class TextOut {
 public:
  explicit TextOut(OutputFile file) : file_(std::move(file)) {}

  TextOut& operator<<(std::string_view text) {
    text_ += text;
    if (text_.size() > kPieceBytes) flush();
    return *this;
  }
  // The shortest digits that read back to the same number. It does not depend on the locale, as printf does.
  template <class Number>
  requires std::is_arithmetic_v<Number> TextOut& operator<<(Number number) {
    std::array<char, 32> digits;
    const auto end = std::to_chars(digits.data(), digits.data() + digits.size(), number).ptr;
    return *this << std::string_view(digits.data(), end);
  }
  TextOut& operator<<(const Vec3f& x) { return *this << "(" << x[0] << ", " << x[1] << ", " << x[2] << ")"; }
  // Writes the items of a list in brackets, each as `put` makes it.
  template <class Range, class Put>
  TextOut& list(const Range& range, Put put) {
    *this << "[";
    bool is_first = true;
    for (const auto& item : range) {
      if (!std::exchange(is_first, false)) *this << ", ";
      *this << put(item);
    }
    return *this << "]";
  }
  Result<void> finish() {
    flush();
    return file_.finish();
  }

 private:
  void flush() {
    file_.write(std::as_bytes(std::span(text_)));
    text_.clear();
  }
  OutputFile file_;
  std::string text_;
};

// Quotes, backslashes and control characters would end the text or its line.
std::string usd_text(std::string_view text) {
  std::string out = "\"";
  for (const char c : text) {
    if (c == '"' || c == '\\') out += '\\';
    out += c >= 0 && c < ' ' ? ' ' : c;
  }
  return out + '"';
}

class UsdaWriter : public StrandWriter {
 public:
  UsdaWriter(OutputFile file, const ExportedStrands& strands, const MaybeMotion& motion)
      : StrandWriter(strands), out_(std::move(file)), motion_(motion), frames_(strands.point_count(), kKeptBytesMax) {}
  [[nodiscard]] const KeptFrames& frames() const { return frames_; }

 private:
  Result<void> put(std::span<const Vec3f> points) override { return frames_.add(points); }

  Result<void> close() override {
    // Time codes are numbers of frames, so timeCodesPerSecond is the motion's rate.
    out_ << "#usda 1.0\n(\n    defaultPrim = \"hairnet\"\n    doc = \"Hairnet " << kVersion << "\"\n";
    if (motion_) out_ << "    endTimeCode = " << frames_.count() - 1 << "\n    framesPerSecond = " << motion_->rate_hz;
    out_ << (motion_ ? "\n" : "") << "    metersPerUnit = 1\n";
    if (motion_) out_ << "    startTimeCode = 0\n    timeCodesPerSecond = " << motion_->rate_hz << "\n";
    out_ << "    upAxis = \"Y\"\n)\n\ndef Xform \"hairnet\" (\n    kind = \"component\"\n)\n{\n";
    const std::vector<std::string> names = object_names(strands());
    for (std::size_t g = 0; g < names.size(); ++g) write_group(strands().groups[g], names[g]);
    out_ << "}\n";
    return out_.finish();
  }

  void write_group(const ExportedStrands::Group& group, const std::string& name) {
    out_ << "    def BasisCurves \"" << name << "\"\n    {\n        uniform token type = \"linear\"\n";
    out_ << "        uniform token wrap = \"nonperiodic\"\n        int[] curveVertexCounts = ";
    std::vector<std::uint32_t> counts;
    for (std::uint32_t s = group.begin; s < group.end; ++s) counts.push_back(strands().points_of(s));
    const auto as_it_is = [](const auto& item) -> const auto& {
      return item;
    };
    out_.list(counts, as_it_is) << "\n";
    // USD viewers cull by `extent`; without it they compute it from all points.
    write_frames("float3[] extent", group, [&](std::span<const Vec3f> points) {
      std::array<Vec3f, 2> extent{points.front(), points.front()};
      for (const Vec3f& x : points) extent = {extent[0].cwiseMin(x), extent[1].cwiseMax(x)};
      out_.list(extent, as_it_is);
    });
    write_frames("point3f[] points", group, [&](std::span<const Vec3f> points) { out_.list(points, as_it_is); });
    if (!strands().widths_m.empty()) {
      const std::span<const float> widths = std::span(strands().widths_m).subspan(group.begin, group.strand_count());
      // One width for all is written once, as most grooms have it.
      const bool is_one = std::ranges::count(widths, widths[0]) == std::ssize(widths);
      out_ << "        float[] widths = ";
      out_.list(widths.first(is_one ? 1 : widths.size()), as_it_is)
          << " (\n            interpolation = \"" << (is_one ? "constant" : "uniform") << "\"\n        )\n";
    }
    // The name stands before the number, for readers that take the first attribute of groups that they find.
    constexpr std::string_view kConstant = " (\n            interpolation = \"constant\"\n        )\n";
    out_ << "        string primvars:groom_group_name = " << usd_text(group.name) << kConstant;
    out_ << "        int primvars:groom_group_id = " << group.id << kConstant << "    }\n";
  }

  // An attribute with its samples, or with its only value. `put` writes that of one frame.
  template <class Put>
  void write_frames(std::string_view attribute, const ExportedStrands::Group& group, Put put) {
    out_ << "        " << attribute << (motion_ ? ".timeSamples = {\n" : " = ");
    for (std::size_t f = 0; f < frames_.count(); ++f) {
      if (motion_) out_ << "            " << f << ": ";
      put(frames_.frame(f).subspan(group.first_point, group.point_count()));
      out_ << (motion_ ? ",\n" : "\n");
    }
    if (motion_) out_ << "        }\n";
  }

  TextOut out_;
  MaybeMotion motion_;
  KeptFrames frames_;
};

}  // namespace

OpenedWriter write_usda(OutputFile file, const ExportedStrands& strands, const MaybeMotion& motion) {
  auto writer = std::make_unique<UsdaWriter>(std::move(file), strands, motion);
  const std::size_t frames = motion ? motion->frame_count.value_or(1) : 1;
  if (const Result<void> fits = writer->frames().check(frames); !fits) return Refusal(fits.error());
  return writer;
}

}  // namespace hairnet
