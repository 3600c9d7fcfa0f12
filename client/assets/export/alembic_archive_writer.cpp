#include "client/assets/export/alembic_archive_writer.hpp"

#include <algorithm>

namespace hairnet {
namespace {

// The archive claims to be one of Alembic 1.8.5, whose layout it has.
constexpr std::uint32_t kFileVersion = 0, kLibraryVersion = 10805;
// An index of 255 says that the metadata follows in the header itself, instead of standing in the shared table.
constexpr std::uint8_t kOwnMetadata = 0xff;

std::size_t bytes_of(AbcType type) {
  switch (type) {
    case AbcType::u8:
    case AbcType::text:
      return 1;
    case AbcType::i16:
      return 2;
    case AbcType::f64:
      return 8;
    default:
      return 4;
  }
}

// Appends a number of 1, 2 or 4 bytes. A header's numbers all have the width of its largest one.
void put_sized(std::uint32_t number, std::uint32_t size_hint, ByteWriter& out) {
  out.put(std::as_bytes(std::span(&number, 1)).first(std::size_t{1} << size_hint));
}

}  // namespace

// Called for each frame and property, so it does not allocate for a sample that equals the last.
void AbcArchiveWriter::add(AbcOutProperty& property, std::span<const std::byte> values) {
  const MurmurDigest key = murmur_128(values);
  const bool is_first = property.sample_count == 0;
  if (is_first || key != property.last_key) {
    // Between changed samples, equal ones are stored again. The format stores samples only between the first and the
    // last changed one, and there each. So samples that were skipped as equal are written when a later one changes, as
    // references to the same block.
    for (std::uint32_t i = property.last_changed + 1; property.first_changed != 0 && i < property.sample_count; ++i)
      store(property, written_.at(property.last_key));
    // Texts are counted by their zeros, since one sample holds several texts.
    const std::size_t count = property.type == AbcType::text
                                  ? static_cast<std::size_t>(std::ranges::count(values, std::byte{0}))
                                  : values.size() / (bytes_of(property.type) * property.extent);
    property.is_like_scalar = property.is_like_scalar && count == 1;
    property.is_homogeneous = property.is_homogeneous && (is_first || count == property.value_count);
    property.value_count = count;
    property.last_key = key;
    // Equal samples of different properties share a block too. Two samples of the same 128-bit digest are taken as
    // equal, as Alembic itself does.
    const auto [found, is_new] = written_.try_emplace(key, 0);
    if (is_new) found->second = out_.data({std::as_bytes(std::span(key)), values});
    store(property, found->second);
    if (property.first_changed == 0) property.first_changed = property.sample_count;
    property.last_changed = property.sample_count;
  }
  ++property.sample_count;
}

void AbcArchiveWriter::store(AbcOutProperty& property, Word sample) {
  // A scalar has no dimensions; an array has them behind each sample.
  property.stored.push_back(sample);
  if (property.kind != AbcKind::array) return;
  // The dimensions of numbers follow from their bytes.
  const std::uint64_t count = property.value_count;
  const bool is_text = property.type == AbcType::text;
  property.stored.push_back(is_text ? out_.data({std::as_bytes(std::span(&count, 1))}) : out_.data({}));
}

// Index 0 stands for no metadata and 255 for metadata in the header itself. Words that do not fit the table of 254 are
// written out each time.
std::uint8_t AbcArchiveWriter::index_of(const std::string& metadata) {
  constexpr std::size_t kTableMax = 254, kBytesMax = 255;
  if (metadata.empty()) return 0;
  const auto found = std::ranges::find(metadata_, metadata);
  const auto index = static_cast<std::size_t>(found - metadata_.begin()) + 1;
  if (found == metadata_.end()) {
    if (metadata.size() > kBytesMax || metadata_.size() == kTableMax) return kOwnMetadata;
    metadata_.push_back(metadata);
  }
  return static_cast<std::uint8_t>(index);
}

// The bits are those that `read_property` of the importer reads. The lowest ones are the kind (0x3), the width of the
// header's numbers (0xc), the type (0xf0), and the flags: 0x1 one value in every sample, 0x100 an index of times, 0x200
// the changed samples, 0x400 equally many values in each sample, 0x800 no change. Bits 12 to 19 are the extent, bits 20
// to 27 the index of the metadata.
void AbcArchiveWriter::put_header(const AbcOutProperty& property, ByteWriter& headers) {
  const auto timing = static_cast<std::uint32_t>(property.timing);
  const auto name_bytes = static_cast<std::uint32_t>(property.name.size()),
             metadata_bytes = static_cast<std::uint32_t>(property.metadata.size());
  const std::uint32_t largest = std::max({name_bytes, metadata_bytes, property.sample_count});
  const std::uint32_t size_hint = largest > 0xffff ? 2 : largest > 0xff ? 1 : 0;
  const std::uint8_t metadata = index_of(property.metadata);
  std::uint32_t info = std::uint32_t{metadata} << 20 | size_hint << 2;
  // Samples that change from the second to the last are the usual case, and need no numbers.
  const bool is_constant = property.last_changed == 0,
             is_plain = property.first_changed == 1 && property.last_changed + 1 == property.sample_count;
  if (property.kind != AbcKind::compound) {
    info |= static_cast<std::uint32_t>(property.kind) | static_cast<std::uint32_t>(property.type) << 4 |
            std::uint32_t{property.extent} << 12;
    if (property.is_like_scalar) info |= 1;
    if (timing != 0) info |= 0x100;
    if (is_constant) info |= 0x800;
    if (!is_constant && !is_plain) info |= 0x200;
    if (property.is_homogeneous) info |= 0x400;
  }
  headers.put(info);
  if (property.kind != AbcKind::compound) {
    put_sized(property.sample_count, size_hint, headers);
    if ((info & 0x200) != 0) {
      put_sized(property.first_changed, size_hint, headers);
      put_sized(property.last_changed, size_hint, headers);
    }
    if (timing != 0) put_sized(timing, size_hint, headers);
    // Each sampling states the largest number of samples of its properties, which readers use as the length of the
    // motion.
    std::uint32_t& samples_max = samples_max_[timing];
    samples_max = std::max(samples_max, is_constant ? std::min(property.sample_count, 1U) : property.sample_count);
  }
  put_sized(name_bytes, size_hint, headers);
  headers.text(property.name);
  if (metadata != kOwnMetadata) return;
  put_sized(metadata_bytes, size_hint, headers);
  headers.text(property.metadata);
}

// Children are written before their parents, because a group stores the places of its children.
AbcArchiveWriter::Word AbcArchiveWriter::write(const std::vector<AbcOutProperty>& properties) {
  std::vector<Word> words;
  ByteWriter headers;
  for (const AbcOutProperty& property : properties) {
    const bool is_compound = property.kind == AbcKind::compound;
    words.push_back(is_compound ? write(property.children) : out_.group(property.stored));
    put_header(property, headers);
  }
  if (!properties.empty()) words.push_back(out_.data({headers.bytes()}));
  return out_.group(words);
}

AbcArchiveWriter::Word AbcArchiveWriter::write(const AbcOutObject& object) {
  std::vector<Word> words{write(object.properties)};
  ByteWriter headers;
  for (const AbcOutObject& child : object.children) {
    words.push_back(write(child));
    headers.put(static_cast<std::uint32_t>(child.name.size())).text(child.name);
    const std::uint8_t metadata = index_of(child.metadata);
    headers.put(metadata);
    if (metadata == kOwnMetadata) headers.put(static_cast<std::uint32_t>(child.metadata.size())).text(child.metadata);
  }
  // Digests of the properties and of the children end the list. They tell equal objects of one archive from others; the
  // places of all that lies below do that too. Alembic computes them otherwise, but programs compare them only within a
  // file.
  const MurmurDigest own = murmur_128(std::as_bytes(std::span(words).first(1))),
                     below = murmur_128(std::as_bytes(std::span(words).subspan(1)));
  headers.put(std::as_bytes(std::span(own))).put(std::as_bytes(std::span(below)));
  words.push_back(out_.data({headers.bytes()}));
  return out_.group(words);
}

// The root's children have a fixed order: versions, objects, metadata, times, and the table of metadata that all
// headers above have filled.
Result<void> AbcArchiveWriter::finish(const AbcOutObject& top, std::string_view metadata, double rate_hz) {
  const Word objects = write(top);
  ByteWriter times, table;
  const bool has_motion = samples_max_[1] > 0;
  for (std::size_t i = 0; i < (has_motion ? 2 : 1); ++i)
    // A sampling has its largest number of samples, the seconds of a cycle, and the times within the cycle: their
    // number, here 1, and then each time, here 0 s. Sampling 0 is that of constant properties, which Alembic gives a
    // cycle of 1 s.
    times.put(samples_max_[i]).put(i == 0 ? 1.0 : 1 / rate_hz).put(1U).put(0.0);
  for (const std::string& words : metadata_) table.put(static_cast<std::uint8_t>(words.size())).text(words);
  const std::vector<Word> root{out_.data({std::as_bytes(std::span(&kFileVersion, 1))}),
                               out_.data({std::as_bytes(std::span(&kLibraryVersion, 1))}),
                               objects,
                               out_.data({std::as_bytes(std::span(metadata))}),
                               out_.data({times.bytes()}),
                               out_.data({table.bytes()})};
  return out_.finish(out_.group(root));
}

}  // namespace hairnet
