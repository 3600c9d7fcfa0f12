#pragma once

#include <optional>
#include <string>
#include <string_view>
#include <vector>

#include "client/assets/import/ogawa.hpp"

namespace hairnet {

// How an Alembic archive lies in Ogawa: objects in a tree, and their properties with samples in time. Everything here
// views the file's bytes, which must outlive it.

// The times of samples: those stored, and then the same again after each cycle. An example is a cycle of 1/24 s with
// one stored time.
struct AbcTimes {
  double cycle_s = 1;
  bool is_cyclic = true;
  std::vector<double> stored_s{0};
  [[nodiscard]] double time_s(std::size_t sample) const;
};

// The numbers of one sample, whatever their type. The type is one of the archive's numbers, never text. Each access
// converts a number; nothing is copied.
class AbcNumbers {
 public:
  AbcNumbers() = default;
  AbcNumbers(std::span<const std::byte> bytes, unsigned type);
  [[nodiscard]] std::size_t size() const { return size_; }
  [[nodiscard]] double operator[](std::size_t i) const;
  // Returns a number of 0 to 255, or 256 for what is none of these.
  [[nodiscard]] unsigned small(std::size_t i) const;
  // The same as the operator, at once for 32-bit floats, which points are.
  [[nodiscard]] float single(std::size_t i) const;

 private:
  std::span<const std::byte> bytes_;
  unsigned type_ = 0;
  std::size_t size_ = 0;
};

// A property of an object: a compound of further properties, or the samples of a scalar or an array. Its counts have
// been compared with the file, so all samples can be read without an error.
struct AbcProperty {
  enum class Kind : std::uint8_t { compound, scalar, array };
  std::string_view name, metadata;
  Kind kind = Kind::compound;
  // The type of the numbers (Type in alembic_archive.cpp), and how many of them make a value.
  unsigned type = 0, extent = 1;
  std::uint32_t sample_count = 0;
  // The file stores sample 0, and then each sample from first_changed to last_changed. Samples between 0 and
  // first_changed equal sample 0, and those after last_changed equal that one.
  std::uint32_t first_changed = 0, last_changed = 0;
  // The index of the property's times in the archive.
  std::uint32_t times = 0;
  OgawaGroup group;

  [[nodiscard]] bool is_text() const;
  [[nodiscard]] bool is_constant() const { return sample_count <= 1 || last_changed == 0; }
  // A sample that the property does not have is its last one. Empty without samples, and for text.
  [[nodiscard]] AbcNumbers numbers(std::size_t sample) const;
  [[nodiscard]] std::size_t stored_samples() const { return sample_count == 0 ? 0 : stored_at(last_changed) + 1; }

 private:
  friend class AbcArchive;
  [[nodiscard]] std::size_t stored_at(std::size_t sample) const;
  [[nodiscard]] std::span<const std::byte> bytes(std::size_t sample) const;
};

// An object in the tree. Its metadata has the schema: a transform, curves, or something else. Children and properties
// are read when they are asked for.
struct AbcObject {
  std::string_view name, metadata;
  OgawaGroup group;
};

// An open archive. Everything is decoded when it is asked for, and nothing is cached. Reading is not const, because
// each read spends from a budget.
class AbcArchive {
 public:
  // Refuses what is no Ogawa, HDF5, another version, and damaged times or metadata. Damage in the tree of objects shows
  // later, in the functions below.
  static Result<AbcArchive> open(std::span<const std::byte> bytes);

  [[nodiscard]] OgawaGroup top() const { return top_; }
  [[nodiscard]] std::string_view metadata() const { return metadata_; }
  [[nodiscard]] std::uint32_t library_version() const { return library_version_; }  // 10805 is Alembic 1.8.5
  [[nodiscard]] const AbcTimes& times(const AbcProperty& property) const { return times_[property.times]; }

  // Parts of a file may share their bytes, so that a small damaged file could cause any amount of work. Everything that
  // is read is therefore counted, and what exceeds the file many times is refused.
  [[nodiscard]] bool spend(std::uint64_t bytes);
  [[nodiscard]] static Refusal overspent();

  // The children of an object, the properties of an object or a compound property, and the words of a sample. An error
  // here means a damaged archive, not a missing thing.
  Result<std::vector<AbcObject>> children(const OgawaGroup& object);
  Result<std::vector<AbcProperty>> properties_of_object(const OgawaGroup& object);
  Result<std::vector<AbcProperty>> properties(const OgawaGroup& compound);
  Result<std::vector<std::string_view>> texts(const AbcProperty& property, std::size_t sample);

 private:
  std::string read_times(std::span<const std::byte> bytes);
  std::string read_metadata_table(std::span<const std::byte> bytes);
  Result<std::span<const std::byte>> headers_of(const OgawaGroup& group);

  OgawaGroup top_;
  std::string_view metadata_;
  std::uint32_t library_version_ = 0;
  std::vector<AbcTimes> times_;
  std::vector<std::string_view> metadata_table_;
  // The rest of the budget that spend() takes from.
  std::uint64_t bytes_left_ = 0;
};

// The value of a key in metadata, which are KEY=VALUE;KEY=VALUE. Empty without it.
std::string_view metadata_value(std::string_view metadata, std::string_view key);

// Returns null when there is no property of that name. A valid archive has each name once; of several the first counts.
const AbcProperty* find(const std::vector<AbcProperty>& properties, std::string_view name);

}  // namespace hairnet
