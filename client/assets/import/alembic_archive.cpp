#include "client/assets/import/alembic_archive.hpp"

#include <algorithm>
#include <array>
#include <cmath>
#include <limits>

#include "client/assets/import/byte_reader.hpp"
#include "core/shown_text.hpp"

namespace hairnet {
namespace {

// Children of the root group.
enum Root : std::size_t { kFileVersion, kLibraryVersion, kTop, kMetadata, kTimes, kMetadataTable, kRootChildren };

// A hash of this many bytes stands before the values of each sample.
constexpr std::size_t kKeyBytes = 16;
// Two hashes stand behind the headers of child objects.
constexpr std::size_t kHashesBytes = 32;
// This index means that metadata is not in the table, but stands behind the header.
constexpr unsigned kOwnMetadata = 0xff;
// The budget for reading, in bytes, is 4 times the size of the file, plus the smaller of 60 times its size and 256 MB.
// Honest archives store equal samples once, so reading counts the same bytes several times: a smaller budget would
// refuse them. A larger one would let a crafted file cost more time.
constexpr std::uint64_t kReadsOfFile = 4, kReadsOfSmallFile = 60, kSharedBytesMax = 256 << 20;
// A number outside of these is no version of the library, and so a sign of damage.
constexpr std::uint32_t kLibraryMin = 9999, kLibraryMax = 99'999;

// The numbers are those of Alembic's PlainOldDataType, which files store: their order is part of the format.
enum Type : unsigned {
  kBool,
  kU8,
  kI8,
  kU16,
  kI16,
  kU32,
  kI32,
  kU64,
  kI64,
  kF16,
  kF32,
  kF64,
  kText,
  kWideText,
  kTypes
};
constexpr std::array<std::size_t, kTypes> kTypeBytes{1, 1, 1, 2, 2, 4, 4, 8, 8, 2, 4, 8, 1, 4};

std::string_view text_of(std::span<const std::byte> bytes) {
  return {reinterpret_cast<const char*>(bytes.data()), bytes.size()};
}

double half(std::uint16_t bits) {
  const int exponent = bits >> 10 & 31, fraction = bits & 1023;
  const double sign = (bits & 0x8000) != 0 ? -1 : 1;
  if (exponent == 31) return fraction == 0 ? sign * HUGE_VAL : std::numeric_limits<double>::quiet_NaN();
  return sign * (exponent == 0 ? std::ldexp(fraction, -24) : std::ldexp(1024 + fraction, exponent - 25));
}

// Reads the packed headers of objects and properties. After the end, everything is empty and `failed` is true, so that
// callers check once for each header and not after each field.
class HeaderReader {
 public:
  explicit HeaderReader(std::span<const std::byte> bytes) : bytes_(bytes), in_(bytes) {}
  [[nodiscard]] bool at_end() const { return failed_ || in_.remaining() == 0; }
  [[nodiscard]] bool failed() const { return failed_; }
  // A number of 1, 2 or 4 bytes. The size hint of a header gives the width of all its numbers: 0 for 1 byte, 1 for 2, 2
  // for 4. The hint 3 does not exist.
  std::uint32_t number(unsigned size_hint) {
    if (size_hint > 2) failed_ = true;
    if (!take(std::size_t{1} << size_hint)) return 0;
    if (size_hint == 2) return in_.u32();
    return size_hint == 1 ? in_.u16() : in_.u8();
  }
  std::string_view text(std::size_t size) {
    if (!take(size)) return {};
    const std::string_view text = text_of(bytes_.subspan(in_.at(), size));
    in_.skip(size);
    return text;
  }
  std::string_view metadata(unsigned index, unsigned size_hint, const std::vector<std::string_view>& table) {
    if (index == kOwnMetadata) return text(number(size_hint));
    failed_ = failed_ || index >= table.size();
    return failed_ ? std::string_view() : table[index];
  }

 private:
  bool take(std::size_t size) {
    failed_ = failed_ || !in_.has(size);
    return !failed_;
  }
  std::span<const std::byte> bytes_;
  ByteReader in_;
  bool failed_ = false;
};

std::uint32_t version_in(std::span<const std::byte> bytes) {
  return bytes.size() == 4 ? ByteReader(bytes).u32() : std::numeric_limits<std::uint32_t>::max();
}

Refusal damaged(std::string_view what) {
  return Refusal("damaged: " + std::string(what));
}

// Reads a sample count, the first and last changed sample, and the index of the times. Bit 0x200 announces both changed
// samples, 0x800 that no sample changes; without either every sample changes. Bit 0x100 announces an index of times,
// which is otherwise 0.
void read_sampling(std::uint32_t info, unsigned size_hint, HeaderReader& in, AbcProperty& property) {
  property.sample_count = in.number(size_hint);
  if ((info & 0x200) != 0) {
    property.first_changed = in.number(size_hint);
    property.last_changed = in.number(size_hint);
  } else if ((info & 0x800) == 0 && property.sample_count > 1) {
    property.first_changed = 1;
    property.last_changed = property.sample_count - 1;
  }
  if ((info & 0x100) != 0) property.times = in.number(size_hint);
}

// The lowest two bits of `info` give the kind: 0 a compound, 1 a scalar, 2 an array, and 3 an array that always has one
// value. Type, extent and the index of metadata follow in bits 4, 12 and 20.
AbcProperty read_property(HeaderReader& in, const std::vector<std::string_view>& table) {
  const std::uint32_t info = in.number(2);
  const unsigned size_hint = info >> 2 & 3;
  AbcProperty property;
  if ((info & 3) != 0) {
    property.kind = (info & 3) == 1 ? AbcProperty::Kind::scalar : AbcProperty::Kind::array;
    property.type = info >> 4 & 15;
    property.extent = info >> 12 & 255;
    read_sampling(info, size_hint, in, property);
  }
  property.name = in.text(in.number(size_hint));
  property.metadata = in.metadata(info >> 20 & 255, size_hint, table);
  return property;
}

}  // namespace

// Samples beyond the end of times without a cycle have the last time.
double AbcTimes::time_s(std::size_t sample) const {
  if (!is_cyclic) return stored_s[std::min(sample, stored_s.size() - 1)];
  const std::size_t cycle = sample / stored_s.size();
  return stored_s[sample % stored_s.size()] + cycle_s * static_cast<double>(cycle);
}

AbcNumbers::AbcNumbers(std::span<const std::byte> bytes, unsigned type)
    : bytes_(bytes), type_(type), size_(bytes.size() / kTypeBytes[type]) {}

// The caller keeps `i` below `size()`, since the reader checks nothing.
double AbcNumbers::operator[](std::size_t i) const {
  ByteReader in(bytes_, i * kTypeBytes[type_]);
  switch (type_) {
    case kBool:
    case kU8:
      return in.u8();
    case kI8:
      return static_cast<std::int8_t>(in.u8());
    case kU16:
      return in.u16();
    case kI16:
      return static_cast<std::int16_t>(in.u16());
    case kU32:
      return in.u32();
    case kI32:
      return static_cast<std::int32_t>(in.u32());
    case kU64:
      return static_cast<double>(in.u64());
    case kI64:
      return static_cast<double>(static_cast<std::int64_t>(in.u64()));
    case kF16:
      return half(in.u16());
    case kF32:
      return double{in.f32()};
    default:
      return in.f64();
  }
}

unsigned AbcNumbers::small(std::size_t i) const {
  // NaN fails both comparisons and so gives 256 too.
  const double number = (*this)[i];
  return number >= 0 && number <= 255 ? static_cast<unsigned>(number) : 256;
}

float AbcNumbers::single(std::size_t i) const {
  return type_ == kF32 ? ByteReader(bytes_, 4 * i).f32() : static_cast<float>((*this)[i]);
}

bool AbcProperty::is_text() const {
  return type == kText || type == kWideText;
}

// The file stores sample 0, and then those from the first to the last changed one. Samples between 0 and the first
// changed equal sample 0, and those behind the last changed equal that.
std::size_t AbcProperty::stored_at(std::size_t sample) const {
  sample = std::min<std::size_t>(sample, last_changed);
  return sample < first_changed || last_changed == 0 ? 0 : sample - first_changed + 1;
}

std::span<const std::byte> AbcProperty::bytes(std::size_t sample) const {
  if (kind == Kind::compound || sample_count == 0) return {};
  const std::size_t stored = stored_at(sample);
  // The values of an array alternate with its dimensions. A key of 16 bytes, by which Alembic finds equal samples,
  // precedes the values. It is not checked.
  const std::span<const std::byte> all = group.data(kind == Kind::array ? 2 * stored : stored);
  return all.size() > kKeyBytes ? all.subspan(kKeyBytes) : std::span<const std::byte>();
}

AbcNumbers AbcProperty::numbers(std::size_t sample) const {
  return is_text() ? AbcNumbers() : AbcNumbers(bytes(sample), type);
}

Result<AbcArchive> AbcArchive::open(std::span<const std::byte> bytes) {
  const Result<OgawaGroup> root = open_ogawa(bytes);
  if (!root) return Refusal(root.error());
  bool is_archive = root->child_count() >= kRootChildren && root->is_group(kTop);
  for (const std::size_t child : {kFileVersion, kLibraryVersion, kMetadata, kTimes, kMetadataTable})
    is_archive = is_archive && root->is_data(child);
  if (!is_archive) return Refusal("an Ogawa file, but not an Alembic archive");
  if (const std::uint32_t version = version_in(root->data(kFileVersion)); version != 0)
    return Refusal("the archive's version " + std::to_string(version) + " is not read, only version 0");
  AbcArchive archive;
  archive.library_version_ = version_in(root->data(kLibraryVersion));
  if (archive.library_version_ < kLibraryMin || archive.library_version_ > kLibraryMax)
    return damaged("there is no Alembic of version " + std::to_string(archive.library_version_));
  archive.top_ = root->group(kTop);
  archive.metadata_ = text_of(root->data(kMetadata));
  archive.bytes_left_ = kReadsOfFile * std::uint64_t{bytes.size()} +
                        std::min(kReadsOfSmallFile * std::uint64_t{bytes.size()}, kSharedBytesMax);
  if (std::string error = archive.read_times(root->data(kTimes)); !error.empty()) return damaged(error);
  if (std::string error = archive.read_metadata_table(root->data(kMetadataTable)); !error.empty())
    return damaged(error);
  return archive;
}

// Each sampling is the largest sample count, the length of a cycle, and the times in one cycle.
std::string AbcArchive::read_times(std::span<const std::byte> bytes) {
  ByteReader in(bytes);
  while (in.remaining() > 0) {
    if (!in.has(std::size_t{16})) return "the list of times ends early";
    // The largest sample count of its properties is not needed.
    in.skip(4);
    AbcTimes times;
    times.cycle_s = in.f64();
    // Alembic marks times that do not repeat by a cycle of the largest double over 32.
    times.is_cyclic = times.cycle_s < std::numeric_limits<double>::max() / 64;
    const std::uint32_t count = in.u32();
    // At least one time is necessary, because `time_s` divides by their number.
    if (count == 0 || !in.has(count, 8)) return "the list of times ends early";
    times.stored_s.resize(count);
    for (double& time : times.stored_s) time = in.f64();
    const bool is_finite = std::isfinite(times.cycle_s) &&
                           std::ranges::all_of(times.stored_s, [](double time) { return std::isfinite(time); });
    if (!is_finite) return "a time is not finite";
    times_.push_back(std::move(times));
  }
  // An archive without samplings means samples of 1 s, as Alembic's default is.
  if (times_.empty()) times_.emplace_back();
  return {};
}

std::string AbcArchive::read_metadata_table(std::span<const std::byte> bytes) {
  // Index 0 means no metadata; the table in the file begins at 1.
  metadata_table_.emplace_back();
  HeaderReader in(bytes);
  while (!in.at_end()) metadata_table_.push_back(in.text(in.number(0)));
  return in.failed() ? "the table of metadata ends early" : "";
}

// The headers of a group's children are its last child. They count towards the budget, because any number of groups may
// share one block.
Result<std::span<const std::byte>> AbcArchive::headers_of(const OgawaGroup& group) {
  if (group.child_count() == 0 || !group.is_data(group.child_count() - 1)) return std::span<const std::byte>();
  const std::span<const std::byte> headers = group.data(group.child_count() - 1);
  if (!spend(headers.size())) return overspent();
  return headers;
}

Result<std::vector<AbcObject>> AbcArchive::children(const OgawaGroup& object) {
  const auto headers = headers_of(object);
  if (!headers) return Refusal(headers.error());
  std::vector<AbcObject> children;
  // Two digests stand behind the headers of child objects, also when there is no child.
  if (headers->size() <= kHashesBytes) return children;
  HeaderReader in(headers->first(headers->size() - kHashesBytes));
  while (!in.at_end()) {
    AbcObject child;
    child.name = in.text(in.number(2));
    child.metadata = in.metadata(in.number(0), 2, metadata_table_);
    // Child 0 is the group of the object's properties; the child objects follow.
    const std::size_t at = children.size() + 1;
    if (in.failed()) return damaged("the list of an object's children ends early");
    if (!object.is_group(at)) return damaged("an object has fewer children than it lists");
    child.group = object.group(at);
    children.push_back(child);
  }
  return children;
}

Result<std::vector<std::string_view>> AbcArchive::texts(const AbcProperty& property, std::size_t sample) {
  std::vector<std::string_view> texts;
  if (property.type != kText) return texts;
  const std::span<const std::byte> bytes = property.bytes(sample);
  if (!spend(bytes.size())) return overspent();
  for (std::string_view rest = text_of(bytes); !rest.empty();) {
    const std::size_t end = std::min(rest.find('\0'), rest.size());
    texts.push_back(rest.substr(0, end));
    rest.remove_prefix(std::min(end + 1, rest.size()));
  }
  return texts;
}

bool AbcArchive::spend(std::uint64_t bytes) {
  if (bytes > bytes_left_) return false;
  bytes_left_ -= bytes;
  return true;
}

Refusal AbcArchive::overspent() {
  return damaged("its parts share more bytes than an honest file does");
}

Result<std::vector<AbcProperty>> AbcArchive::properties_of_object(const OgawaGroup& object) {
  return properties(object.group(0));
}

Result<std::vector<AbcProperty>> AbcArchive::properties(const OgawaGroup& compound) {
  const auto headers = headers_of(compound);
  if (!headers) return Refusal(headers.error());
  std::vector<AbcProperty> properties;
  HeaderReader in(*headers);
  while (!in.at_end()) {
    AbcProperty property = read_property(in, metadata_table_);
    if (in.failed()) return damaged("a list of properties ends early");
    // All checks are made here once, so that `numbers` and `bytes` can read without any.
    const std::string of_property = " of property " + shown(property.name);
    if (property.type >= kTypes) return damaged("there is no type " + std::to_string(property.type) + of_property);
    if (property.times >= times_.size()) return damaged("there are no times" + of_property);
    if (property.first_changed > property.last_changed || property.last_changed > property.sample_count)
      return damaged("the samples" + of_property + " do not add up");
    if (!compound.is_group(properties.size())) return damaged("there are no values" + of_property);
    property.group = compound.group(properties.size());
    // An array has two blocks for each stored sample, its values and its dimensions; a scalar has one.
    const std::size_t slots = property.stored_samples() * (property.kind == AbcProperty::Kind::array ? 2 : 1);
    if (property.kind != AbcProperty::Kind::compound && slots > property.group.child_count())
      return damaged("there are " + std::to_string(property.group.child_count()) + " blocks of data" + of_property +
                     ", which must be " + std::to_string(slots));
    properties.push_back(property);
  }
  return properties;
}

std::string_view metadata_value(std::string_view metadata, std::string_view key) {
  while (!metadata.empty()) {
    const std::string_view pair = metadata.substr(0, metadata.find(';'));
    if (pair.size() > key.size() && pair.starts_with(key) && pair[key.size()] == '=')
      return pair.substr(key.size() + 1);
    metadata.remove_prefix(std::min(pair.size() + 1, metadata.size()));
  }
  return {};
}

const AbcProperty* find(const std::vector<AbcProperty>& properties, std::string_view name) {
  const auto found = std::ranges::find(properties, name, &AbcProperty::name);
  return found == properties.end() ? nullptr : &*found;
}

}  // namespace hairnet
