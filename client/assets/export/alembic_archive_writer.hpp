#pragma once

#include <cstddef>
#include <cstdint>
#include <map>
#include <span>
#include <string>
#include <string_view>
#include <utility>
#include <vector>

#include "client/assets/export/byte_writer.hpp"
#include "client/assets/export/murmur.hpp"
#include "client/assets/export/ogawa_writer.hpp"

namespace hairnet {

// Kinds and types have the numbers of the format. Only what is written here is listed.
enum class AbcKind : std::uint8_t { compound, scalar, array };
enum class AbcType : std::uint8_t { u8 = 1, i16 = 4, u32 = 5, i32 = 6, f32 = 10, f64 = 11, text = 12 };
// Sampling 0 is for what does not change, 1 for the frames of a motion.
enum class AbcTiming : std::uint8_t { constant, uniform };

// A property of an Alembic object, with the places of its samples in the file. The caller sets the first part; the
// writer fills the second while samples come.
struct AbcOutProperty {
  std::string name, metadata;
  AbcKind kind = AbcKind::compound;
  AbcType type = AbcType::u8;
  // How many numbers one value has: 3 for a vector.
  std::uint8_t extent = 1;
  AbcTiming timing = AbcTiming::constant;
  // Only a compound has them.
  std::vector<AbcOutProperty> children = {};

  // Samples before the first and behind the last changed one are stored once.
  std::uint32_t sample_count = 0, first_changed = 0, last_changed = 0;
  // The words of the stored samples in the file, in order. An array has two words for each sample: its values, then
  // their dimensions.
  std::vector<OgawaWriter::Word> stored = {};
  // The digest of the sample that `add` got last; an equal next sample is only counted.
  MurmurDigest last_key = {};
  // The number of values in the last sample that changed, each of `extent` numbers.
  std::size_t value_count = 0;
  // Whether every sample has exactly one value, and whether all have equally many. The header of the property states
  // both.
  bool is_like_scalar = true, is_homogeneous = true;
};

// An object of the tree, owned by the caller until `finish`.
struct AbcOutObject {
  std::string name, metadata;
  std::vector<AbcOutProperty> properties = {};
  std::vector<AbcOutObject> children = {};
};

// Writes an Alembic archive as the library's AbcCoreOgawa does. Samples go to the file as they come, equal ones once;
// the tree of objects follows in finish(). Memory grows with the number of different samples and not with their size.
// One thread.
class AbcArchiveWriter {
 public:
  explicit AbcArchiveWriter(OutputFile file) : out_(std::move(file)) {}

  // Adds the next sample: numbers as they lie in memory, or texts with a zero behind each. The first sample of a
  // property sets what later ones are compared with.
  void add(AbcOutProperty& property, std::span<const std::byte> values);
  void add_text(AbcOutProperty& property, const std::string& text) {
    add(property, std::as_bytes(std::span(text.c_str(), text.size() + 1)));
  }
  // Adds the sample before once more. It stores nothing now; only a later change makes the archive remember that the
  // value was there.
  static void repeat(AbcOutProperty& property) { ++property.sample_count; }

  // `metadata` is KEY=VALUE;KEY=VALUE in the order of the keys. Without motion, `rate_hz` is not used. The writer is of
  // no use afterwards.
  Result<void> finish(const AbcOutObject& top, std::string_view metadata, double rate_hz);

 private:
  using Word = OgawaWriter::Word;
  void store(AbcOutProperty& property, Word sample);
  Word write(const AbcOutObject& object);
  Word write(const std::vector<AbcOutProperty>& properties);
  void put_header(const AbcOutProperty& property, ByteWriter& headers);
  std::uint8_t index_of(const std::string& metadata);

  OgawaWriter out_;
  // The block of each different sample in the file, by its digest.
  std::map<MurmurDigest, Word> written_;
  // The table that headers refer to.
  std::vector<std::string> metadata_;
  // The largest number of samples of any property, for each AbcTiming.
  std::uint32_t samples_max_[2] = {0, 0};
};

}  // namespace hairnet
