#pragma once

#include <algorithm>
#include <bit>
#include <cstdint>
#include <string>
#include <string_view>
#include <utility>
#include <vector>

// Writes binary USD files (crates) of any version, so that tests can make files that no program writes. The numbers of
// types are those of the format: 3 is an int, 11 a token, 46 time samples, 48 a vector of doubles.
namespace hairnet::test {

// Returns the lowest bytes of a number, little endian.
inline std::string in_bytes(std::uint64_t value, int count) {
  std::string text;
  for (int i = 0; i < count; ++i, value >>= 8) text.push_back(static_cast<char>(value));
  return text;
}

// Makes one LZ4 block that has the text as it is: literals without any match.
inline std::string lz4_literals(const std::string& text) {
  std::string block(1, static_cast<char>(std::min<std::size_t>(text.size(), 15) << 4));
  if (text.size() >= 15) {
    std::size_t more = text.size() - 15;
    for (; more >= 255; more -= 255) block.push_back('\xff');
    block.push_back(static_cast<char>(more));
  }
  return block + text;
}

// Returns a text behind its size in 8 bytes.
inline std::string with_size(const std::string& text) {
  return in_bytes(text.size(), 8) + text;
}

// Returns a text as the format packs it: a size, a zero (one LZ4 block), and the block.
inline std::string packed_table(const std::string& text) {
  return with_size(std::string(1, '\0') + lz4_literals(text));
}

// Packs integers as the format does: the differences of neighbours, each in 0 to 4 bytes (or 0 to 8). A difference of 1
// counts as the commonest, which takes no byte.
inline std::string packed_integers(const std::vector<std::int64_t>& values, int bytes_of_each = 4) {
  std::string codes((values.size() + 3) / 4, '\0'), rest;
  std::int64_t last = 0;
  for (std::size_t i = 0; i < values.size(); ++i) {
    const std::int64_t step = values[i] - last;
    last = values[i];
    const int unit = bytes_of_each / 4;
    int code = 3;
    if (step == std::int64_t{static_cast<std::int16_t>(step)}) code = unit == 2 ? 1 : 2;
    if (unit == 1 && step == std::int64_t{static_cast<std::int8_t>(step)}) code = 1;
    if (unit == 2 && code == 3 && step == std::int64_t{static_cast<std::int32_t>(step)}) code = 2;
    if (step == 1) code = 0;
    codes[i / 4] = static_cast<char>(codes[i / 4] | code << (2 * (i % 4)));
    if (code > 0) rest += in_bytes(static_cast<std::uint64_t>(step), unit << (code - 1));
  }
  return packed_table(in_bytes(1, bytes_of_each) + codes + rest);
}

// Collects values, fields and paths, and then writes the file. All functions that make a value return the number that
// stands for it in a field.
class CrateWriter {
 public:
  // `minor` is the version of the file, 0.minor. The header has 88 bytes, which file() fills in.
  explicit CrateWriter(int minor) : minor_(minor), data_(88, '\0') {}

  // Return the index of a text in the file's list of tokens or strings, to which they add it.
  std::uint64_t token(std::string_view text) { return index_in(tokens_, std::string(text)); }
  std::uint64_t string(std::string_view text) { return index_in(strings_, static_cast<std::uint32_t>(token(text))); }

  // A value is one number: bit 63 says that it is an array, bit 62 that it is inlined, bit 61 that it is compressed.
  // The type begins at bit 48; below it is the value itself, or where its bytes are in the file.
  static std::uint64_t inlined(std::uint64_t type, std::uint64_t payload) { return 1ULL << 62 | type << 48 | payload; }
  // token_value() is inlined; stored() and array() write bytes into the file and refer to them. Arrays have their
  // rank before version 0.5, and a count of 8 bytes from 0.7 on.
  std::uint64_t token_value(std::string_view text) { return inlined(11, token(text)); }
  std::uint64_t stored(std::uint64_t type, const std::string& bytes) {
    const std::uint64_t at = data_.size();
    data_ += bytes;
    return type << 48 | at;
  }
  std::uint64_t array(std::uint64_t type, std::uint64_t count, const std::string& bytes, bool is_packed = false) {
    const std::string rank = minor_ < 5 ? in_bytes(1, 4) : "";
    return 1ULL << 63 | (is_packed ? 1ULL << 61 : 0) | stored(type, rank + in_bytes(count, minor_ < 7 ? 4 : 8) + bytes);
  }
  // From version 0.5 on, the format packs arrays of 16 and more integers.
  std::uint64_t integers(const std::vector<std::int64_t>& values) {
    if (minor_ >= 5 && values.size() >= 16) return array(3, values.size(), packed_integers(values), true);
    std::string bytes;
    for (const std::int64_t value : values) bytes += in_bytes(static_cast<std::uint64_t>(value), 4);
    return array(3, values.size(), bytes);
  }
  static std::string floats(const std::vector<float>& values) {
    std::string bytes;
    for (const float value : values) bytes += in_bytes(std::bit_cast<std::uint32_t>(value), 4);
    return bytes;
  }
  std::uint64_t tokens(const std::vector<std::string>& words) {
    std::string bytes;
    for (const std::string& word : words) bytes += in_bytes(token(word), 4);
    return array(11, words.size(), bytes);
  }
  // Makes time samples: a list of times, and a list of values that were made before.
  std::uint64_t samples(const std::vector<std::pair<double, std::uint64_t>>& samples) {
    std::string times = in_bytes(samples.size(), 8), values = in_bytes(samples.size(), 8);
    for (const auto& [time, value] : samples) {
      times += in_bytes(std::bit_cast<std::uint64_t>(time), 8);
      values += in_bytes(value, 8);
    }
    const std::uint64_t at = data_.size();
    data_ += in_bytes(8 + times.size(), 8) + times + in_bytes(48ULL << 48 | (at + 8), 8) + in_bytes(8, 8) + values;
    return 46ULL << 48 | at;
  }

  using Fields = std::vector<std::pair<std::string, std::uint64_t>>;
  // Adds a prim or a property with its fields. Add the paths in depth-first order: first the root, whose depth is 0.
  void add(int depth, std::string_view name, bool is_property, const Fields& fields) {
    nodes_.push_back({depth, static_cast<std::int64_t>(token(name)) * (is_property ? -1 : 1), sets_.size()});
    for (const auto& [field, value] : fields) {
      sets_.push_back(static_cast<std::int64_t>(fields_.size()));
      fields_.emplace_back(static_cast<std::int64_t>(token(field)), value);
    }
    sets_.push_back(-1);
  }

  // Returns the whole file: the header, the values, and the six sections by which a reader finds everything.
  [[nodiscard]] std::string file() {
    std::string all_tokens, values, strings = in_bytes(strings_.size(), 8);
    for (const std::string& word : tokens_) all_tokens += word + '\0';
    for (const std::uint32_t index : strings_) strings += in_bytes(index, 4);
    std::vector<std::int64_t> names, indices, elements, jumps, sets, kinds;
    for (const auto& [name, value] : fields_) {
      names.push_back(name);
      values += in_bytes(value, 8);
    }
    for (std::size_t i = 0; i < nodes_.size(); ++i) {
      indices.push_back(static_cast<std::int64_t>(i));
      elements.push_back(nodes_[i].name);
      sets.push_back(static_cast<std::int64_t>(nodes_[i].set));
      // Every path is of kind 6, a prim.
      kinds.push_back(6);
      std::size_t next = i + 1;
      while (next < nodes_.size() && nodes_[next].depth > nodes_[i].depth) ++next;
      const bool has_child = next > i + 1, has_sibling = next < nodes_.size() && nodes_[next].depth == nodes_[i].depth;
      // A jump says how the tree goes on after a path: -2 ends it, -1 has a child, 0 has a sibling, and a positive
      // number has both and is the distance to the sibling.
      jumps.push_back(has_child ? (has_sibling ? static_cast<std::int64_t>(next - i) : -1) : (has_sibling ? 0 : -2));
    }
    const std::string count = in_bytes(nodes_.size(), 8);
    std::string out = data_, contents = in_bytes(6, 8);
    const auto add_section = [&](const std::string& name, const std::string& bytes) {
      contents += name + std::string(16 - name.size(), '\0') + in_bytes(out.size(), 8) + in_bytes(bytes.size(), 8);
      out += bytes;
    };
    add_section("TOKENS", in_bytes(tokens_.size(), 8) + in_bytes(all_tokens.size(), 8) + packed_table(all_tokens));
    add_section("STRINGS", strings);
    add_section("FIELDS", in_bytes(fields_.size(), 8) + packed_integers(names) + packed_table(values));
    add_section("FIELDSETS", in_bytes(sets_.size(), 8) + packed_integers(sets_));
    add_section("PATHS", count + count + packed_integers(indices) + packed_integers(elements) + packed_integers(jumps));
    add_section("SPECS", count + packed_integers(indices) + packed_integers(sets) + packed_integers(kinds));
    const std::string header = "PXR-USDC" + std::string{'\0', static_cast<char>(minor_)} + std::string(6, '\0');
    out.replace(0, 24, header + in_bytes(out.size(), 8));
    return out + contents;
  }

 private:
  // A path. `name` is the number of its last part, negative for a property; `set` is the begin of its fields in sets_.
  struct Node {
    int depth;
    std::int64_t name;
    std::size_t set;
  };

  template <class Value>
  // Returns the index of a value in a list, to which it is added where it is new.
  static std::uint64_t index_in(std::vector<Value>& values, Value value) {
    const auto known = std::ranges::find(values, value);
    if (known != values.end()) return static_cast<std::uint64_t>(known - values.begin());
    values.push_back(std::move(value));
    return values.size() - 1;
  }

  int minor_;
  std::string data_;
  // The sign of a name's number says that it is a property, and 0 has no sign, so a name that is never a property comes
  // first.
  std::vector<std::string> tokens_{"root"};
  std::vector<std::uint32_t> strings_;
  std::vector<std::pair<std::int64_t, std::uint64_t>> fields_;
  std::vector<std::int64_t> sets_;
  std::vector<Node> nodes_;
};

}  // namespace hairnet::test
