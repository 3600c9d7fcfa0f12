#include <algorithm>
#include <array>
#include <limits>

#include "client/assets/export/byte_writer.hpp"
#include "client/assets/export/formats.hpp"
#include "client/files/npy_writer.hpp"
#include "core/shown_text.hpp"
#include "schema/bytes/crc32.hpp"

// Arrays of NumPy in a zip archive, stored as they are. The frames of a motion come first: their number, their checksum
// and the size are written over the first bytes at the end, so no frame is kept. The header of the frames has the same
// length for every number of frames, which lets it be written twice.
namespace hairnet {
namespace {

using ByteSpan = std::span<const std::byte>;

// Larger archives need zip64, which not every reader knows.
constexpr std::uint64_t kArchiveBytesMax = std::numeric_limits<std::uint32_t>::max();
// Version 2.0 is what a reader needs. The date is the earliest that a zip can state: the same hair gives the same bytes
// on any day.
constexpr std::uint16_t kZipVersion = 20, kJanuary1_1980 = 0x21;

// A file in the archive, whose header begins at byte `at`.
struct Entry {
  std::string name;
  std::uint32_t crc = 0, bytes = 0, at = 0;
};

// The fields that the header of an entry and its line of the directory share. Flags, method and time are 0. The method
// 0 means stored, so both sizes are equal.
void put_entry(const Entry& entry, ByteWriter& out) {
  out.put(kZipVersion).put(std::uint16_t{0}).put(std::uint16_t{0}).put(std::uint16_t{0}).put(kJanuary1_1980);
  out.put(entry.crc).put(entry.bytes).put(entry.bytes);
  out.put(static_cast<std::uint16_t>(entry.name.size())).put(std::uint16_t{0});
}

// The header of an entry: its signature "PK\3\4", the shared fields and the name. The entry's bytes follow it.
ByteWriter header_of(const Entry& entry) {
  ByteWriter out;
  out.put(std::uint32_t{0x04034b50});
  put_entry(entry, out);
  out.text(entry.name);
  return out;
}

// The directory at the end of a zip: a line for each entry, then a record with the number of entries, and the size and
// the place of the directory. The zeros are comments, disk numbers and attributes, which are not used.
ByteWriter directory_of(std::span<const Entry> entries, std::uint32_t at) {
  ByteWriter out;
  for (const Entry& entry : entries) {
    out.put(std::uint32_t{0x02014b50}).put(kZipVersion);
    put_entry(entry, out);
    out.put(std::uint16_t{0}).put(std::uint16_t{0}).put(std::uint16_t{0}).put(std::uint32_t{0}).put(entry.at);
    out.text(entry.name);
  }
  const auto size = static_cast<std::uint32_t>(out.size());
  const auto count = static_cast<std::uint16_t>(entries.size());
  out.put(std::uint32_t{0x06054b50}).put(std::uint16_t{0}).put(std::uint16_t{0}).put(count).put(count);
  out.put(size).put(at).put(std::uint16_t{0});
  return out;
}

// Frames are written as they come; other arrays follow when the last frame is known.
class NpzWriter : public StrandWriter {
 public:
  NpzWriter(OutputFile file, const ExportedStrands& strands, const MaybeMotion& motion)
      : StrandWriter(strands), file_(std::move(file)), motion_(motion) {
    // These first bytes are placeholders. Their number of frames and checksum are 0 until `close`.
    if (motion_) write(begin_of_frames().bytes());
  }

  // Whether an archive of that many frames fits.
  [[nodiscard]] Result<void> check(std::size_t frames) const {
    // The sum has room for two frames more: the first frame, which is stored again, and the other arrays.
    const std::uint64_t frame_bytes = std::uint64_t{sizeof(Vec3f)} * strands().point_count();
    // Other arrays take less than a frame, beside names.
    constexpr std::uint64_t kOthersBytes = 1 << 20;
    if (frame_bytes * (frames + 2) + kOthersBytes <= kArchiveBytesMax) return {};
    return Refusal(std::to_string(frames) + " frames of " + std::to_string(strands().point_count()) +
                   " points are more than the 4 GB of an .npz: write fewer, or an .abc");
  }

 private:
  Result<void> put(std::span<const Vec3f> points) override {
    if (const Result<void> fits = check(frame_count()); !fits) return fits;
    // The first frame alone is kept, for the still array behind the frames.
    if (frame_count() == 1) first_.assign(points.begin(), points.end());
    if (!motion_) return {};
    write(std::as_bytes(points));
    frames_crc_ = bytes::crc32(std::as_bytes(points), frames_crc_);
    return {};
  }

  [[nodiscard]] std::string header_of_frames() const {
    return npy_header("<f4", std::array{frame_count(), strands().point_count(), std::size_t{3}});
  }
  // The checksum covers the header and the frames, but the header is only known at the end. Two checksums can be joined
  // without the bytes.
  [[nodiscard]] Entry entry_of_frames() const {
    const std::string header = header_of_frames();
    const std::uint64_t size = sizeof(Vec3f) * strands().point_count() * std::uint64_t{frame_count()};
    // The header's checksum and that of the frames give the checksum of both, without the bytes.
    const std::uint32_t crc = bytes::crc32_joined(bytes::crc32(std::as_bytes(std::span(header))), frames_crc_, size);
    return {"frames.npy", crc, static_cast<std::uint32_t>(header.size() + size), 0};
  }
  [[nodiscard]] ByteWriter begin_of_frames() const {
    ByteWriter out = header_of(entry_of_frames());
    out.text(header_of_frames());
    return out;
  }

  void add(const std::string& name, std::string_view type, std::vector<std::size_t> shape, ByteSpan values) {
    const std::string header = npy_header(type, shape);
    Entry entry{name + ".npy", bytes::crc32(std::as_bytes(std::span(header))), 0, static_cast<std::uint32_t>(at_)};
    entry.crc = bytes::crc32(values, entry.crc);
    entry.bytes = static_cast<std::uint32_t>(header.size() + values.size());
    write(header_of(entry).bytes());
    write(std::as_bytes(std::span(header)));
    write(values);
    entries_.push_back(std::move(entry));
  }

  // Texts of NumPy have as many characters of 32 bits each as the longest. Bytes that are no UTF-8 become question
  // marks.
  void add_group_names() {
    std::vector<std::u32string> names;
    // NumPy has no text of length 0.
    std::size_t longest = 1;
    for (const ExportedStrands::Group& group : strands().groups) {
      std::u32string& name = names.emplace_back();
      for (std::string_view rest = group.name; !rest.empty();) {
        const Utf8Character character = first_character(rest);
        name += character.bytes == 0 ? U'?' : static_cast<char32_t>(character.code);
        rest.remove_prefix(std::max<std::size_t>(character.bytes, 1));
      }
      longest = std::max(longest, name.size());
    }
    ByteWriter values;
    for (std::u32string& name : names) {
      name.resize(longest);
      values.put(std::as_bytes(std::span(name)));
    }
    add("group_names", "<U" + std::to_string(longest), {names.size()}, values.bytes());
  }

  Result<void> close() override {
    const std::size_t count = strands().strand_count();
    if (motion_) entries_.push_back(entry_of_frames());
    // Equal counts make one array of three axes, which most programs expect.
    const std::uint32_t each = strands().points_of_each();
    if (each > 0) {
      add("strands", "<f4", {count, each, 3}, std::as_bytes(std::span(first_)));
    } else {
      add("positions", "<f4", {first_.size(), 3}, std::as_bytes(std::span(first_)));
      add("strand_begin", "<u4", {count + 1}, std::as_bytes(std::span(strands().strand_begin)));
    }
    if (!strands().widths_m.empty()) add("widths", "<f4", {count}, std::as_bytes(std::span(strands().widths_m)));
    std::vector<std::uint32_t> group_of_strand;
    for (std::uint32_t g = 0; g < strands().groups.size(); ++g)
      group_of_strand.insert(group_of_strand.end(), strands().groups[g].strand_count(), g);
    add("groups", "<u4", {count}, std::as_bytes(std::span(group_of_strand)));
    add_group_names();
    add("groom_strands", "<u4", {count}, std::as_bytes(std::span(strands().groom_strands)));
    if (motion_) add("rate_hz", "<f8", {}, std::as_bytes(std::span(&motion_->rate_hz, 1)));

    write(directory_of(entries_, static_cast<std::uint32_t>(at_)).bytes());
    if (motion_) {
      // Only the bytes that hold the number of frames, sizes and checksum change.
      file_.go_to_begin();
      file_.write(begin_of_frames().bytes());
    }
    return file_.finish();
  }

  void write(ByteSpan bytes) {
    file_.write(bytes);
    at_ += bytes.size();
  }

  OutputFile file_;
  MaybeMotion motion_;
  std::uint64_t at_ = 0;
  std::uint32_t frames_crc_ = 0;
  std::vector<Vec3f> first_;
  std::vector<Entry> entries_;
};

}  // namespace

OpenedWriter write_npz(OutputFile file, const ExportedStrands& strands, const MaybeMotion& motion) {
  auto writer = std::make_unique<NpzWriter>(std::move(file), strands, motion);
  const std::size_t frames = motion ? motion->frame_count.value_or(1) : 1;
  if (const Result<void> fits = writer->check(frames); !fits) return Refusal(fits.error());
  return writer;
}

}  // namespace hairnet
