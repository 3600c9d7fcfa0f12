#include <algorithm>
#include <array>
#include <bit>
#include <cmath>
#include <cstring>
#include <string>
#include <utility>

#include "client/assets/import/byte_reader.hpp"
#include "client/assets/import/curve_sets.hpp"
#include "client/assets/import/parse_text.hpp"
#include "client/assets/import/strands.hpp"
#include "core/groom/groom.hpp"
#include "core/shown_text.hpp"
#include "schema/bytes/deflate.hpp"

// Strands as NumPy writes them: an array of strands, points and 3 coordinates in a .npy, or in a .npz, which is a zip
// archive of such files. DiffLocks calls it "positions"; others "strands", "points" or "hair". Strands of different
// numbers of points are "positions" in one list, and "strand_begin".
namespace hairnet {
namespace {

using ByteSpan = std::span<const std::byte>;

// No array of strands needs more axes.
constexpr std::size_t kAxesMax = 8;
// The most arrays of an archive, and the most bytes of an unpacked array. Both bound the work that a small archive can
// cause.
constexpr std::size_t kArraysMax = 1000;
constexpr std::size_t kUnpackedMax = 1'000'000'000;

// Codes that are no character become U+FFFD.
void append_utf8(std::uint32_t code, std::string& text) {
  if (code > 0x10ffff || (code >= 0xd800 && code < 0xe000)) code = 0xfffd;
  const auto rest = [&](int shift) { text += static_cast<char>(0x80 | (code >> shift & 0x3f)); };
  if (code < 0x80) {
    text += static_cast<char>(code);
  } else if (code < 0x800) {
    text += static_cast<char>(0xc0 | code >> 6);
    rest(0);
  } else if (code < 0x10000) {
    text += static_cast<char>(0xe0 | code >> 12);
    rest(6);
    rest(0);
  } else {
    text += static_cast<char>(0xf0 | code >> 18);
    rest(12);
    rest(6);
    rest(0);
  }
}

struct NpyArray {
  // NumPy's name of the type, such as "<f4": byte order, kind, and bytes of a number.
  std::string type;
  bool is_fortran = false;
  // The lengths of the axes, without axes of length 1 before the last three.
  std::vector<std::uint64_t> shape;
  ByteSpan values;

  [[nodiscard]] bool is_real() const {
    return type == "<f4" || type == "<f8" || type == "<f2" || type == ">f4" || type == ">f8";
  }
  [[nodiscard]] bool is_strands() const { return is_real() && shape.size() == 3 && shape[2] == 3; }
  [[nodiscard]] bool is_points() const { return is_real() && shape.size() == 2 && shape[1] == 3; }
  [[nodiscard]] bool is_list_of_reals() const { return is_real() && shape.size() == 1; }
  [[nodiscard]] bool is_list_of_numbers() const {
    const bool is_whole = type == "<i4" || type == "<u4" || type == "<i8" || type == "<u8";
    return is_whole && shape.size() == 1;
  }
  [[nodiscard]] std::string describe() const {
    std::string text = shown(type) + " (";
    for (std::size_t i = 0; i < shape.size(); ++i) text += (i > 0 ? ", " : "") + std::to_string(shape[i]);
    return text + ')';
  }
};

// The text that follows `'key':` in the dictionary of a header. The header is a Python dictionary as text. Only the
// three keys that NumPy writes are looked for, so no Python is interpreted.
std::string_view entry(std::string_view header, std::string_view key) {
  for (const char quote : {'\'', '"'}) {
    const std::size_t at = header.find(std::string(1, quote).append(key) + quote);
    if (at == std::string_view::npos) continue;
    header.remove_prefix(at + key.size() + 2);
    header.remove_prefix(std::min(header.find_first_not_of(" :"), header.size()));
    return header;
  }
  return {};
}

Result<NpyArray> read_npy(ByteSpan bytes) {
  constexpr std::string_view kMagic = "\x93NUMPY";
  const std::string_view text(reinterpret_cast<const char*>(bytes.data()), bytes.size());
  if (!text.starts_with(kMagic)) return Refusal("not a .npy file: it does not begin with \\x93NUMPY");
  ByteReader in(bytes, kMagic.size());
  if (!in.has(4)) return Refusal("truncated: shorter than its header");
  // The version's major number is the low byte; from version 2 on, the header's length has 4 bytes.
  const bool is_long = (in.u16() & 0xff) >= 2;
  if (is_long && !in.has(4)) return Refusal("truncated: shorter than its header");
  const std::size_t length = is_long ? in.u32() : in.u16();
  if (!in.has(length)) return Refusal("truncated: shorter than its header");
  const std::string_view header = text.substr(in.at(), length);
  in.skip(length);

  NpyArray array;
  const std::string_view type = entry(header, "descr");
  if (type.size() > 1 && (type[0] == '\'' || type[0] == '"')) array.type = type.substr(1, type.find(type[0], 1) - 1);
  array.is_fortran = entry(header, "fortran_order").starts_with("True");
  std::string_view shape = entry(header, "shape");
  if (array.type.empty() || !shape.starts_with('(')) return Refusal("its header tells no descr and shape");
  shape = shape.substr(1, shape.find(')') - 1);
  while (!shape.empty()) {
    const std::size_t comma = std::min(shape.find(','), shape.size());
    std::string_view words = shape.substr(0, comma);
    const std::string_view word = take_word(words);
    shape.remove_prefix(std::min(comma + 1, shape.size()));
    if (word.empty()) continue;
    const std::optional<std::uint64_t> axis = parse_number<std::uint64_t>(word);
    if (!axis || array.shape.size() >= kAxesMax) return Refusal("its shape is not one of whole numbers");
    array.shape.push_back(*axis);
  }
  // Networks write a batch of one, whose axis has no meaning here.
  while (array.shape.size() > 3 && array.shape.front() == 1) array.shape.erase(array.shape.begin());
  array.values = bytes.subspan(in.at());
  return array;
}

// The digit of the type's name, such as 4 in "<f4".
std::size_t bytes_of_number(const NpyArray& array) {
  return static_cast<std::size_t>(array.type[2] - '0');
}

// The bytes may have any order and alignment, so they are put together one by one.
std::uint64_t bits_at(const NpyArray& array, std::size_t index) {
  const std::size_t size = bytes_of_number(array);
  std::uint64_t bits = 0;
  for (std::size_t i = 0; i < size; ++i) {
    const std::size_t byte = array.type[0] == '<' ? size - 1 - i : i;
    bits = bits << 8 | std::to_integer<std::uint64_t>(array.values[index * size + byte]);
  }
  return bits;
}

float number_at(const NpyArray& array, std::size_t index) {
  const std::size_t size = bytes_of_number(array);
  const std::uint64_t bits = bits_at(array, index);
  if (size == 8) return static_cast<float>(std::bit_cast<double>(bits));
  if (size == 2) return half_float(static_cast<std::uint16_t>(bits));
  return std::bit_cast<float>(static_cast<std::uint32_t>(bits));
}

// What an archive may say of its strands beside their points. A list that does not fit the strands is not used.
struct NpyLists {
  std::optional<NpyArray> widths, groups, group_names;
};

bool is_whole(const NpyArray& list, std::size_t count, std::size_t value_bytes) {
  return list.shape[0] == count && count <= list.values.size() / value_bytes;
}

// Text number i of an array of NumPy's texts ("<U12"): characters of 32 bits, with zeros behind the last.
std::string text_at(const NpyArray& array, std::size_t i, std::size_t longest) {
  std::string text;
  ByteReader in(array.values, 4 * longest * i);
  for (std::size_t c = 0; c < longest; ++c) {
    const std::uint32_t code = in.u32();
    if (code == 0) break;
    append_utf8(code, text);
  }
  return shown_group(text);
}

std::vector<std::string> texts_of(const NpyArray& array) {
  std::vector<std::string> texts;
  const auto longest =
      parse_number<std::uint32_t>(std::string_view(array.type).substr(std::min<std::size_t>(2, array.type.size())));
  const bool is_text = array.type.starts_with("<U") && longest && *longest > 0 && array.shape.size() == 1;
  if (!is_text || array.shape[0] > GroomLimits{}.group_count_max) return texts;
  if (!is_whole(array, array.shape[0], std::size_t{4} * *longest)) return texts;
  for (std::size_t i = 0; i < array.shape[0]; ++i) texts.push_back(text_at(array, i, *longest));
  return texts;
}

Result<ImportedStrands> strands_of_set(CurveSet set, const NpyLists& lists) {
  const std::size_t count = set.curve_count();
  if (lists.widths && lists.widths->is_list_of_reals() &&
      is_whole(*lists.widths, count, bytes_of_number(*lists.widths))) {
    for (std::size_t c = 0; c < count; ++c)
      set.widths.insert(set.widths.end(), set.begin[c + 1] - set.begin[c], number_at(*lists.widths, c));
  }
  if (lists.groups && lists.groups->is_list_of_numbers() &&
      is_whole(*lists.groups, count, bytes_of_number(*lists.groups))) {
    const std::vector<std::string> names =
        lists.group_names ? texts_of(*lists.group_names) : std::vector<std::string>();
    for (std::size_t c = 0; c < count; ++c) {
      const std::uint64_t group = bits_at(*lists.groups, c);
      set.groups.push_back(group < names.size() ? names[group] : numbered_group(static_cast<double>(group)));
    }
  }
  return strands_of({&set, 1});
}

// Strands that end in nan are shorter than the array; nan before the end is a damaged point, which make_strands drops
// with its strand.
Result<ImportedStrands> strands_of_array(const NpyArray& array, const NpyLists& lists) {
  // Reading objects would mean to run pickled code.
  if (array.type.find('O') != std::string::npos)
    return Refusal("it holds Python objects, which are not read: save an array of strands, points and 3 coordinates");
  if (!array.is_strands())
    return Refusal("an array " + array.describe() +
                   " is no array of strands, points and 3 coordinates of type f4 or f8");
  const std::uint64_t strand_count = array.shape[0], point_count = array.shape[1];
  const std::size_t point_bytes = 3 * bytes_of_number(array);
  if (strand_count == 0 || point_count == 0) return Refusal("the array " + array.describe() + " holds no strands");
  // Division instead of multiplication: the product of two counts in a file can exceed 64 bits.
  if (strand_count > array.values.size() / point_bytes ||
      point_count > array.values.size() / point_bytes / strand_count)
    return Refusal("truncated: an array " + array.describe() + " does not fit in " +
                   std::to_string(array.values.size()) + " bytes");
  const std::size_t strands = strand_count, points = point_count;
  CurveSet set;
  set.controls.reserve(strands * points);
  std::size_t shortened = 0;
  for (std::size_t s = 0; s < strands; ++s) {
    for (std::size_t p = 0; p < points; ++p) {
      Vec3f& point = set.controls.emplace_back();
      for (std::size_t axis = 0; axis < 3; ++axis)
        // Arrays of Fortran have the strand as the fastest index.
        point[static_cast<int>(axis)] =
            number_at(array, array.is_fortran ? (axis * points + p) * strands + s : (s * points + p) * 3 + axis);
    }
    // Strands of fewer points are filled up with nan.
    const std::size_t begin = set.begin.back(), full = set.controls.size();
    while (set.controls.size() > begin && set.controls.back().array().isNaN().all()) set.controls.pop_back();
    shortened += set.controls.size() < full;
    set.begin.push_back(static_cast<std::uint32_t>(set.controls.size()));
  }
  Result<ImportedStrands> made = strands_of_set(std::move(set), lists);
  if (made && shortened > 0) made->notes.push_back(counted(shortened, "strand") + " filled up with nan end before it");
  return made;
}

// Strands of any number of points: the points one strand behind the other, and the index of the first point of each
// strand, with the number of points behind the last. The exporter (`npz_writer`) writes this layout for strands that
// differ in their number of points.
Result<ImportedStrands> strands_of_list(const NpyArray& points, const NpyArray& begins, const NpyLists& lists) {
  if (!points.is_points() || !begins.is_list_of_numbers())
    return Refusal("positions " + points.describe() + " and strand_begin " + begins.describe() +
                   " are no points of 3 coordinates and whole numbers");
  const std::uint64_t point_count = points.shape[0], begin_count = begins.shape[0];
  if (point_count > points.values.size() / (3 * bytes_of_number(points)) ||
      begin_count > begins.values.size() / bytes_of_number(begins))
    return Refusal("truncated: positions " + points.describe() + " or strand_begin " + begins.describe() +
                   " are longer than the file");
  CurveSet set;
  for (std::size_t i = 0; i < begin_count; ++i) {
    const std::uint64_t begin = bits_at(begins, i);
    // Each begin must not be less than the one before, or a strand would have a negative number of points.
    if (begin > point_count || begin < set.begin.back() || (i == 0 && begin != 0))
      return Refusal("strand_begin " + std::to_string(i) + " is " + std::to_string(begin) + ", which is not between " +
                     std::to_string(set.begin.back()) + " and the " + std::to_string(point_count) + " points");
    if (i > 0) set.begin.push_back(static_cast<std::uint32_t>(begin));
  }
  if (set.begin.back() != point_count) return Refusal("strand_begin does not end at the number of points");
  set.controls.reserve(point_count);
  for (std::size_t p = 0; p < point_count; ++p) {
    Vec3f& point = set.controls.emplace_back();
    for (std::size_t axis = 0; axis < 3; ++axis)
      point[static_cast<int>(axis)] = number_at(points, points.is_fortran ? axis * point_count + p : 3 * p + axis);
  }
  return strands_of_set(std::move(set), lists);
}

struct ZipEntry {
  std::string name;
  std::uint16_t method = 0;
  std::uint64_t packed_bytes = 0, bytes = 0, header_at = 0;
};

// Sizes of 32 bits that are all ones are in an extra field, of 64 bits each. The order of the 64-bit values is fixed by
// the format: the size, the packed size, the place. Only those whose 32-bit field is full are there.
void read_zip64(ByteReader in, std::size_t extra_bytes, ZipEntry& entry) {
  const std::size_t end = in.at() + extra_bytes;
  while (in.at() + 4 <= end) {
    const std::uint16_t kind = in.u16(), size = in.u16();
    if (in.at() + size > end) return;
    if (kind != 1) {
      in.skip(size);
      continue;
    }
    const std::size_t stop = in.at() + size;
    for (std::uint64_t* value : {&entry.bytes, &entry.packed_bytes, &entry.header_at}) {
      if (*value != UINT32_MAX || in.at() + 8 > stop) continue;
      *value = in.u64();
    }
    return;
  }
}

// The files of an archive by its directory, which stands at its end. The local headers are no use for this: writers
// that stream leave their sizes at 0.
Result<std::vector<ZipEntry>> read_directory(ByteSpan bytes) {
  // The sizes of the format's records: the end of the directory, and the fixed part of an entry's header.
  constexpr std::size_t kEndBytes = 22, kHeaderBytes = 46, kCommentMax = 65'535;
  constexpr std::uint32_t kEndMagic = 0x06054b50, kHeaderMagic = 0x02014b50;
  std::optional<std::size_t> end;
  // A comment of up to 65 535 bytes may follow the directory's end, so the search for its magic goes backwards.
  for (std::size_t back = kEndBytes; !end && back <= std::min(bytes.size(), kEndBytes + kCommentMax); ++back) {
    if (ByteReader(bytes, bytes.size() - back).u32() == kEndMagic) end = bytes.size() - back;
  }
  if (!end) return Refusal("truncated, or not a .npz file: no directory of an archive at its end");
  // The ten bytes before are the magic and what concerns archives in several parts.
  ByteReader in(bytes, *end + 10);
  const std::uint16_t count = in.u16();
  in.skip(4);
  const std::size_t at = in.u32();
  if (count > kArraysMax || at > bytes.size()) return Refusal("the directory of the archive is damaged");
  in = ByteReader(bytes, at);
  std::vector<ZipEntry> entries;
  std::uint64_t packed_bytes = 0;
  for (std::uint16_t i = 0; i < count; ++i) {
    if (!in.has(kHeaderBytes) || in.u32() != kHeaderMagic) return Refusal("the directory of the archive is damaged");
    ZipEntry entry;
    // These are versions and flags; below are the time and the checksum, then numbers of disks and attributes.
    in.skip(6);
    entry.method = in.u16();
    in.skip(8);
    entry.packed_bytes = in.u32();
    entry.bytes = in.u32();
    const std::size_t name_bytes = in.u16(), extra_bytes = in.u16(), comment_bytes = in.u16();
    in.skip(8);
    entry.header_at = in.u32();
    if (!in.has(name_bytes + extra_bytes + comment_bytes)) return Refusal("the directory of the archive is damaged");
    entry.name.assign(reinterpret_cast<const char*>(bytes.data()) + in.at(), name_bytes);
    if (entry.name.ends_with(".npy")) entry.name.resize(entry.name.size() - 4);
    in.skip(name_bytes);
    read_zip64(in, extra_bytes, entry);
    in.skip(extra_bytes + comment_bytes);
    // Entries that share bytes could unpack the same ones over and over.
    packed_bytes += std::min<std::uint64_t>(entry.packed_bytes, bytes.size() + 1);
    if (packed_bytes > bytes.size()) return Refusal("the directory of the archive is damaged");
    entries.push_back(std::move(entry));
  }
  return entries;
}

// The bytes of a file in the archive. `room` holds them where they are packed. Only the directory's sizes are used, not
// those of the local header. The local name and extra field only say how much to skip.
Result<ByteSpan> unpacked(ByteSpan bytes, const ZipEntry& entry, std::vector<std::uint8_t>& room) {
  // The fixed part of a local header has 30 bytes. A packed file is at most kPackedAtMost times smaller than what it
  // holds.
  constexpr std::size_t kHeaderBytes = 30, kPackedAtMost = 1100;
  constexpr std::uint16_t kStored = 0, kDeflated = 8;
  if (entry.header_at > bytes.size()) return Refusal("damaged");
  ByteReader in(bytes, entry.header_at);
  if (!in.has(kHeaderBytes) || in.u32() != 0x04034b50) return Refusal("damaged");
  in.skip(22);
  const std::size_t skipped = std::size_t{in.u16()} + in.u16();
  if (!in.has(skipped)) return Refusal("damaged");
  in.skip(skipped);
  if (!in.has(entry.packed_bytes, 1)) return Refusal("truncated");
  const ByteSpan packed = bytes.subspan(in.at(), entry.packed_bytes);
  if (entry.method == kStored) return packed;
  if (entry.method != kDeflated) return Refusal("packed by a method other than deflate");
  // DEFLATE packs at most about 1032 to 1. A claim beyond that is false, and is refused before memory is taken.
  if (entry.bytes / kPackedAtMost > packed.size()) return Refusal("damaged");
  if (entry.bytes > kUnpackedMax) return Refusal("unpacks to more than 1 GB");
  room.resize(entry.bytes);
  const std::span<const std::uint8_t> stream(reinterpret_cast<const std::uint8_t*>(packed.data()), packed.size());
  if (bytes::inflate_into(stream, room) != bytes::InflateError::none) return Refusal("damaged");
  return std::as_bytes(std::span(room));
}

// An array of the archive. `room` holds its file where it is packed.
Result<NpyArray> read_array(ByteSpan bytes, const ZipEntry& entry, std::vector<std::uint8_t>& room) {
  const Result<ByteSpan> file = unpacked(bytes, entry, room);
  return file ? read_npy(*file) : Result<NpyArray>(Refusal(file.error()));
}

Result<ImportedStrands> decode_npz(ByteSpan bytes) {
  const Result<std::vector<ZipEntry>> entries = read_directory(bytes);
  if (!entries) return Refusal(entries.error());
  std::array<std::vector<std::uint8_t>, 3> rooms;
  const auto find_list = [&](std::string_view name, std::vector<std::uint8_t>& room) -> std::optional<NpyArray> {
    const auto found = std::ranges::find(*entries, name, &ZipEntry::name);
    if (found == entries->end()) return {};
    Result<NpyArray> array = read_array(bytes, *found, room);
    return array ? std::optional(std::move(*array)) : std::nullopt;
  };
  const NpyLists lists{find_list("widths", rooms[0]), find_list("groups", rooms[1]),
                       find_list("group_names", rooms[2])};
  const auto listed = std::ranges::find(*entries, "positions", &ZipEntry::name),
             begins = std::ranges::find(*entries, "strand_begin", &ZipEntry::name);
  // The list of different lengths has two arrays, so it is looked for before single arrays. A `positions` of three axes
  // is an ordinary array of strands.
  if (listed != entries->end() && begins != entries->end()) {
    std::vector<std::uint8_t> points_room, begins_room;
    const Result<NpyArray> points = read_array(bytes, *listed, points_room),
                           numbers = read_array(bytes, *begins, begins_room);
    if (!points) return Refusal("positions: " + points.error());
    if (!numbers) return Refusal("strand_begin: " + numbers.error());
    if (!points->is_strands()) return strands_of_list(*points, *numbers, lists);
  }
  constexpr std::array<std::string_view, 8> kNames{"strands",        "positions",    "points", "hair",
                                                   "strands_points", "hair_strands", "arr_0",  "vertices"};
  // Those with a usual name first, and then any other.
  std::vector<const ZipEntry*> order;
  for (const std::string_view name : kNames) {
    for (const ZipEntry& entry : *entries) {
      if (entry.name == name) order.push_back(&entry);
    }
  }
  for (const ZipEntry& entry : *entries) {
    if (std::ranges::find(kNames, entry.name) == kNames.end()) order.push_back(&entry);
  }
  // Arrays without strands are listed in the error, which shows users what the file has.
  std::string others;
  for (const ZipEntry* entry : order) {
    std::vector<std::uint8_t> room;
    const Result<NpyArray> array = read_array(bytes, *entry, room);
    if (array && array->is_strands()) {
      Result<ImportedStrands> strands = strands_of_array(*array, lists);
      if (!strands) return Refusal(shown(entry->name) + ": " + strands.error());
      if (order.size() > 1) strands->notes.push_back("the array of strands is " + shown(entry->name));
      return strands;
    }
    others += (others.empty() ? "" : ", ") + shown(entry->name) + ' ' + (array ? array->describe() : array.error());
  }
  return Refusal("no array of strands, points and 3 coordinates; it has " + (others.empty() ? "no arrays" : others));
}

}  // namespace

Result<ImportedStrands> decode_npy(std::span<const std::byte> bytes) {
  const std::string_view text(reinterpret_cast<const char*>(bytes.data()), bytes.size());
  // A .npz that was renamed to .npy is read all the same: the first bytes decide.
  if (text.starts_with("PK")) return decode_npz(bytes);
  const Result<NpyArray> array = read_npy(bytes);
  if (!array) return Refusal(array.error());
  return strands_of_array(*array, {});
}

}  // namespace hairnet
