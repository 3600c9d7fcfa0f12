#pragma once

#include <array>
#include <bit>
#include <cstddef>
#include <cstdint>
#include <limits>
#include <span>
#include <string>
#include <type_traits>
#include <utility>
#include <vector>

// Writes small Alembic archives of any shape, also of shapes that no program writes.
namespace hairnet::test {

// Writes Ogawa, the container of an Alembic archive: groups, which list their children, and data. Children are
// written before their group. A reference is an offset in the file, and its highest bit marks data.
class OgawaWriter {
 public:
  static constexpr std::uint64_t kEmptyData = std::uint64_t{1} << 63;

  // The header: "Ogawa", a byte that says that the file is complete, the version 1 in two bytes, and the offset of
  // the root, which finish() sets.
  OgawaWriter() {
    for (const unsigned char c : {'O', 'g', 'a', 'w', 'a'}) u8(c);
    u8(0xff);
    u8(0);
    u8(1);
    u64(0);
  }
  // Both append to the file, and return the reference to what they wrote.
  std::uint64_t data(std::span<const std::byte> bytes) {
    if (bytes.empty()) return kEmptyData;
    const std::uint64_t at = bytes_.size();
    u64(bytes.size());
    bytes_.insert(bytes_.end(), bytes.begin(), bytes.end());
    return at | kEmptyData;
  }
  std::uint64_t group(const std::vector<std::uint64_t>& children) {
    if (children.empty()) return 0;
    const std::uint64_t at = bytes_.size();
    u64(children.size());
    for (const std::uint64_t child : children) u64(child);
    return at;
  }
  // Overwrites the 8 bytes at an offset, so that a test can damage a count or a reference.
  void set(std::uint64_t at, std::uint64_t value) {
    for (std::size_t i = 0; i < 8; ++i) bytes_[at + i] = static_cast<std::byte>(value >> (8 * i));
  }
  [[nodiscard]] std::uint64_t size() const { return bytes_.size(); }
  // Returns the whole file with this root. The writer is empty afterwards.
  std::vector<std::byte> finish(std::uint64_t root) {
    set(8, root);
    return std::move(bytes_);
  }

 private:
  void u8(unsigned value) { bytes_.push_back(static_cast<std::byte>(value)); }
  void u64(std::uint64_t value) {
    for (int i = 0; i < 8; ++i) u8(static_cast<unsigned>(value >> (8 * i)) & 255);
  }
  std::vector<std::byte> bytes_;
};

using AbcBytes = std::vector<std::byte>;

template <class Number>
void append_number(AbcBytes& bytes, Number value) {
  const auto raw = std::bit_cast<std::array<std::byte, sizeof(Number)>>(value);
  bytes.insert(bytes.end(), raw.begin(), raw.end());
}

inline void append_text(AbcBytes& bytes, const std::string& text) {
  for (const char c : text) bytes.push_back(static_cast<std::byte>(c));
}

// Returns the key before a sample's values, by which archives tell samples apart. The reader does not look at it.
inline AbcBytes sample_key() {
  return AbcBytes(16, std::byte{0x5a});
}

template <class Number>
// Returns a sample as an archive stores it: its key and then its values.
AbcBytes sample_of(const std::vector<Number>& values) {
  AbcBytes bytes = sample_key();
  for (const Number value : values) append_number(bytes, value);
  return bytes;
}

// Returns the number of a type in the format: 11 is a double, 10 a float, and 1 to 8 are integers by size and sign.
template <class Number>
constexpr unsigned type_of() {
  if constexpr (std::is_same_v<Number, double>) return 11;
  if constexpr (std::is_same_v<Number, float>) return 10;
  // The smallest integers have the types 1 (unsigned) and 2 (signed); each doubling of the size adds 2.
  constexpr unsigned kOf8 = std::is_signed_v<Number> ? 2 : 1;
  return kOf8 + 2 * static_cast<unsigned>(std::bit_width(sizeof(Number)) - 1);
}

// A property of an object: numbers or texts that may change with time, or a compound of other properties.
struct AbcProp {
  std::string name, metadata;
  // 0 is a compound of other properties, 1 a scalar, 2 an array.
  unsigned kind = 2;
  // `type` is as of type_of(), `extent` counts the numbers of a value (3 for a point). `times` is the index of the
  // sample times: 0 for a property that does not change, 1 for AbcFile::stored_times_s.
  unsigned type = 10, extent = 1, times = 0;
  // The samples that are stored. Those before `first_changed` equal the first sample, and those after `last_changed`
  // equal that one, so they are stored once. `sample_count` counts all samples.
  std::vector<AbcBytes> samples;
  std::uint32_t sample_count = 0, first_changed = 0, last_changed = 0;
  std::vector<AbcProp> children;
};

// Makes a property whose samples all differ.
template <class Number>
AbcProp numbers(const std::string& name, const std::vector<std::vector<Number>>& samples, unsigned extent = 1,
                unsigned kind = 2) {
  AbcProp prop{name, {}, kind, type_of<Number>(), extent, samples.size() > 1 ? 1u : 0u, {}, 0, 0, 0, {}};
  for (const std::vector<Number>& sample : samples) prop.samples.push_back(sample_of(sample));
  prop.sample_count = static_cast<std::uint32_t>(samples.size());
  if (samples.size() > 1) {
    prop.first_changed = 1;
    prop.last_changed = prop.sample_count - 1;
  }
  return prop;
}

// Makes an attribute of curves. `scope` says what has a value: con is all curves together, uni each curve, var and vtx
// each point.
template <class Number>
AbcProp attribute(const std::string& name, const std::string& scope, const std::vector<Number>& values,
                  unsigned extent = 1) {
  AbcProp prop = numbers<Number>(name, {values}, extent);
  prop.metadata = "geoScope=" + scope + ";isGeomParam=true";
  return prop;
}

// Makes a property that holds other properties.
inline AbcProp compound(const std::string& name, std::vector<AbcProp> children) {
  return {name, {}, 0, 0, 0, 0, {}, 0, 0, 0, std::move(children)};
}

// Makes an attribute whose values are stored once, and indices that refer to them.
template <class Number>
AbcProp indexed(const std::string& name, const std::string& scope, const std::vector<Number>& values,
                const std::vector<std::uint32_t>& indices, unsigned extent = 1) {
  AbcProp prop =
      compound(name, {numbers<Number>(".vals", {values}, extent), numbers<std::uint32_t>(".indices", {indices})});
  prop.metadata = "geoScope=" + scope;
  return prop;
}

// Makes an attribute of texts, each with a zero behind it. Type 12 is text.
inline AbcProp texts(const std::string& name, const std::string& scope, const std::vector<std::string>& values) {
  AbcProp prop{name, "geoScope=" + scope, 2, 12, 1, 0, {sample_key()}, 1, 0, 0, {}};
  for (const std::string& value : values) {
    append_text(prop.samples[0], value);
    prop.samples[0].push_back(std::byte{0});
  }
  return prop;
}

// An object of the archive's tree. Its metadata names its schema, such as curves or a transform.
struct AbcObj {
  std::string name, metadata;
  std::vector<AbcProp> properties;
  std::vector<AbcObj> children;
};

// An archive as a tree of objects, with the numbers of its header.
struct AbcFile {
  // The library is Alembic 1.8.5.
  std::uint32_t file_version = 0, library_version = 10805;
  std::string metadata = "_ai_Application=hairnet test";
  // The metadata that properties refer to by the index 1, 2, and so on.
  std::vector<std::string> metadata_table;
  // The samples of properties that change have these times, which repeat after `cycle_s`.
  std::vector<double> stored_times_s{0};
  double cycle_s = 0.5;
  AbcObj top;
};

// Writes an AbcFile into an archive. `file` must outlive the writer.
class AbcWriter {
 public:
  explicit AbcWriter(const AbcFile& file) : file_(file) {}

  AbcBytes write() {
    AbcBytes versions[2];
    append_number(versions[0], file_.file_version);
    append_number(versions[1], file_.library_version);
    const std::uint64_t top = object(file_.top);
    AbcBytes metadata, table, times;
    append_text(metadata, file_.metadata);
    for (const std::string& words : file_.metadata_table) {
      table.push_back(static_cast<std::byte>(words.size()));
      append_text(table, words);
    }
    for (const bool own : {false, true}) {
      append_number(times, std::uint32_t{1});
      append_number(times, own ? file_.cycle_s : 1.0);
      const std::vector<double> stored = own ? file_.stored_times_s : std::vector<double>{0};
      append_number(times, static_cast<std::uint32_t>(stored.size()));
      for (const double time : stored) append_number(times, time);
    }
    std::vector<std::uint64_t> root{out_.data(versions[0]), out_.data(versions[1]), top, out_.data(metadata)};
    root.push_back(out_.data(times));
    root.push_back(out_.data(table));
    return out_.finish(out_.group(root));
  }

 private:
  // Writes a property's samples; those of an array are followed by its dimensions, which are empty. Returns the
  // reference.
  std::uint64_t property(const AbcProp& prop) {
    if (prop.kind == 0) return properties(prop.children);
    std::vector<std::uint64_t> words;
    for (const AbcBytes& sample : prop.samples) {
      words.push_back(out_.data(sample));
      if (prop.kind == 2) words.push_back(OgawaWriter::kEmptyData);
    }
    return out_.group(words);
  }

  // Appends a property's header. Its numbers always have 4 bytes; its metadata is an index into the table where the
  // table has them.
  void append_header(const AbcProp& prop, AbcBytes& headers) const {
    std::uint32_t info = prop.kind | 2u << 2 | prop.type << 4 | prop.extent << 12;
    const bool is_constant = prop.last_changed == 0,
               is_plain = prop.first_changed == 1 && prop.last_changed + 1 == prop.sample_count;
    // The flags say what follows: 0x100 the number of a time sampling, 0x200 the first and the last sample that change.
    // 0x800 says that all samples are equal.
    if (prop.times > 0) info |= 0x100;
    if (is_constant) info |= 0x800;
    if (!is_constant && !is_plain) info |= 0x200;
    std::size_t in_table = 0;
    while (in_table < file_.metadata_table.size() && file_.metadata_table[in_table] != prop.metadata) ++in_table;
    const bool is_own = in_table == file_.metadata_table.size() && !prop.metadata.empty();
    info |= static_cast<std::uint32_t>(is_own ? 0xff : prop.metadata.empty() ? 0 : in_table + 1) << 20;
    if (prop.kind == 0) info &= 0xff0000c;
    append_number(headers, info);
    if (prop.kind != 0) {
      append_number(headers, prop.sample_count);
      if ((info & 0x200) != 0) {
        append_number(headers, prop.first_changed);
        append_number(headers, prop.last_changed);
      }
      if (prop.times > 0) append_number(headers, std::uint32_t{prop.times});
    }
    append_words(prop.name, headers);
    if (is_own) append_words(prop.metadata, headers);
  }

  static void append_words(const std::string& words, AbcBytes& headers) {
    append_number(headers, static_cast<std::uint32_t>(words.size()));
    append_text(headers, words);
  }

  // Writes properties, and behind them their headers, as an archive does. Returns the reference of the group.
  std::uint64_t properties(const std::vector<AbcProp>& list) {
    std::vector<std::uint64_t> words;
    AbcBytes headers;
    for (const AbcProp& prop : list) {
      words.push_back(property(prop));
      append_header(prop, headers);
    }
    words.push_back(out_.data(headers));
    return out_.group(words);
  }

  std::uint64_t object(const AbcObj& object_) {
    std::vector<std::uint64_t> words{properties(object_.properties)};
    AbcBytes headers;
    for (const AbcObj& child : object_.children) {
      words.push_back(object(child));
      append_words(child.name, headers);
      headers.push_back(std::byte{0xff});
      append_words(child.metadata, headers);
    }
    // Behind the headers stand two hashes of 16 bytes, which the reader does not look at.
    headers.insert(headers.end(), 32, std::byte{0x33});
    words.push_back(out_.data(headers));
    return out_.group(words);
  }

  const AbcFile& file_;
  OgawaWriter out_;
};

// Kind, closedness and basis of curves, as curveBasisAndType has them.
struct AbcBasis {
  std::uint8_t type = 1, wrap = 0, basis = 0;
};

// Makes an object of curves. `counts` has the points of each curve, and each entry of `points` is a sample: x, y, z
// of all points. `more` and `arbitrary` are further properties of the geometry and attributes of the artist.
inline AbcObj curves(const std::string& name, const std::vector<std::int32_t>& counts,
                     const std::vector<std::vector<float>>& points, AbcBasis basis = {}, std::vector<AbcProp> more = {},
                     std::vector<AbcProp> arbitrary = {}) {
  std::vector<AbcProp> geometry{
      numbers<float>("P", points, 3), numbers<std::int32_t>("nVertices", {counts}),
      numbers<std::uint8_t>("curveBasisAndType", {{basis.type, basis.wrap, basis.basis, basis.basis}}, 4, 1)};
  geometry.insert(geometry.end(), more.begin(), more.end());
  if (!arbitrary.empty()) geometry.push_back(compound(".arbGeomParams", std::move(arbitrary)));
  return {name,
          "schema=AbcGeom_Curve_v2;schemaObjTitle=AbcGeom_Curve_v2:.geom",
          {compound(".geom", std::move(geometry))},
          {}};
}

// Makes a transform from operations, each with its hint in the lower four bits, and the values of all of them for each
// sample.
inline AbcObj xform(const std::string& name, const std::vector<std::uint8_t>& operations,
                    const std::vector<std::vector<double>>& values, std::vector<AbcObj> children, bool inherits = true,
                    std::vector<AbcProp> more = {}) {
  std::vector<AbcProp> props{numbers<std::uint8_t>(".inherits", {{static_cast<std::uint8_t>(inherits ? 1 : 0)}}, 1, 1)};
  if (!operations.empty()) {
    const auto count = static_cast<unsigned>(operations.size());
    props.push_back(numbers<std::uint8_t>(".ops", {operations}, count, 1));
    props.push_back(numbers<double>(".vals", values, static_cast<unsigned>(values[0].size()), 1));
  }
  props.insert(props.end(), more.begin(), more.end());
  return {name,
          "schema=AbcGeom_Xform_v3;schemaObjTitle=AbcGeom_Xform_v3:.xform",
          {compound(".xform", std::move(props))},
          std::move(children)};
}

// Makes an object of another schema, such as a mesh or a camera, without content.
inline AbcObj object_of(const std::string& name, const std::string& schema) {
  return {name, "schema=" + schema, {}, {}};
}

inline AbcBytes abc_file(std::vector<AbcObj> objects) {
  AbcFile file;
  file.top.children = std::move(objects);
  return AbcWriter(file).write();
}

// Returns strands of three points each, in a row along x, which start at y = 0 and go up.
inline std::vector<float> row_of_strands(std::size_t count) {
  std::vector<float> points;
  for (std::size_t s = 0; s < count; ++s) {
    for (int i = 0; i < 3; ++i)
      points.insert(points.end(), {static_cast<float>(s), static_cast<float>(i), 0.25f * static_cast<float>(s)});
  }
  return points;
}

}  // namespace hairnet::test
