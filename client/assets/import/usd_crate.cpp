#include "client/assets/import/usd_crate.hpp"

#include <algorithm>
#include <array>
#include <bit>
#include <cstdint>
#include <cstdio>
#include <limits>
#include <optional>
#include <string_view>
#include <utility>
#include <vector>

#include "client/assets/import/byte_reader.hpp"
#include "client/assets/import/usd_packing.hpp"
#include "client/assets/import/usda.hpp"

// A crate has tables of tokens, strings, fields (a name and a value), sets of fields, paths, and specs: a path and its
// set of fields. A value is 64 bits: flags, a type, and the value itself or where it is in the file. Tables and arrays
// of numbers are packed by LZ4, whole numbers as differences before that.
namespace hairnet::usda {
namespace {

// The most entries of a table: it bounds the memory for a damaged count.
constexpr std::uint64_t kCrateEntriesMax = 4'000'000;
// The most fields that are read of one spec.
constexpr std::size_t kCrateFieldsMax = 256;
constexpr std::uint32_t kNoIndex = std::numeric_limits<std::uint32_t>::max();

// A value in 64 bits. The upper three say whether it is an array, inlined and packed; then come the type, and 48 bits
// of payload: the value itself if it is inlined, else its place in the file.
struct CrateValue {
  std::uint64_t bits = 0;
  [[nodiscard]] bool is_array() const { return (bits >> 63) != 0; }
  [[nodiscard]] bool is_inlined() const { return (bits >> 62 & 1) != 0; }
  [[nodiscard]] bool is_packed() const { return (bits >> 61 & 1) != 0; }
  [[nodiscard]] unsigned type() const { return static_cast<unsigned>(bits >> 48 & 0xff); }
  [[nodiscard]] std::uint64_t payload() const { return bits & ((std::uint64_t{1} << 48) - 1); }
  [[nodiscard]] std::uint32_t low() const { return static_cast<std::uint32_t>(bits); }
};

// The format's numbers of types.
constexpr unsigned kCrateBool = 1, kCrateInt64 = 5, kCrateString = 10, kCrateToken = 11, kCrateAsset = 12,
                   kCrateMatrix4d = 15, kCrateReferences = 35, kCrateTokens = 41, kCrateSpecifier = 42,
                   kCrateSelections = 45, kCrateSamples = 46, kCratePayload = 47, kCrateDoubles = 48,
                   kCrateStrings = 50, kCratePayloads = 55, kCrateTimeCode = 56;

// How the numbers of a type lie in the file: what they are, the bytes of each, and how many make one value.
struct NumberLayout {
  // The kind of the numbers: 'i' for whole numbers, 'u' for whole numbers without a sign, and 'f' for real numbers.
  char kind = 'i';
  std::size_t bytes = 4, count = 1;
};
std::optional<NumberLayout> layout_of(unsigned type) {
  // The index is the number of the type, from bool (1) to a vector of four whole numbers (30).
  constexpr std::array<NumberLayout, 31> kLayouts{
      {{},          {'u', 1, 1}, {'u', 1, 1}, {'i', 4, 1}, {'u', 4, 1}, {'i', 8, 1}, {'u', 8, 1}, {'f', 2, 1},
       {'f', 4, 1}, {'f', 8, 1}, {},          {},          {},          {'f', 8, 4}, {'f', 8, 9}, {'f', 8, 16},
       {'f', 8, 4}, {'f', 4, 4}, {'f', 2, 4}, {'f', 8, 2}, {'f', 4, 2}, {'f', 2, 2}, {'i', 4, 2}, {'f', 8, 3},
       {'f', 4, 3}, {'f', 2, 3}, {'i', 4, 3}, {'f', 8, 4}, {'f', 4, 4}, {'f', 2, 4}, {'i', 4, 4}}};
  if (type == kCrateTimeCode) return NumberLayout{'f', 8, 1};
  if (type < kCrateBool || type >= kLayouts.size() || (type >= kCrateString && type <= kCrateAsset)) return {};
  return kLayouts[type];
}

std::string quoted(std::string_view text) {
  std::string out = "\"";
  for (const char c : text) {
    if (c == '"' || c == '\\') out.push_back('\\');
    out.push_back(c == '\n' || c == '\r' ? ' ' : c);
  }
  return out + '"';
}

struct CrateField {
  std::string_view name;
  CrateValue value;
};

struct CrateNode {
  std::uint32_t parent = kNoIndex;
  std::string_view name;
  bool is_property = false;
  std::vector<std::uint32_t> children;
  // The place in `sets_` where the node's set of fields begins.
  std::optional<std::uint32_t> fields;
};

// Reads a crate and writes the part of it that curves or bodies need as USD text, which the reader of .usda files then
// parses. So there is one reader for both forms.
class Crate {
 public:
  Crate(CrateBytes bytes, Content content)
      : bytes_(bytes), content_(content), text_max_(kTextBytes + kTextOfByte * bytes.size()) {}

  Result<std::string> text() {
    // The header has a magic of 8 bytes, the version from byte 8 on, and at byte 16 the place of the table of contents.
    constexpr std::size_t kHeaderBytes = 24;
    if (bytes_.size() < kHeaderBytes) return Refusal("truncated: shorter than the header of binary USD");
    minor_ = std::to_integer<unsigned>(bytes_[9]);
    if (bytes_[8] != std::byte{0} || minor_ < 4 || minor_ > 10)
      return Refusal("binary USD of version " + std::to_string(std::to_integer<unsigned>(bytes_[8])) + '.' +
                     std::to_string(minor_) + ", of which 0.4 to 0.10 are read: usdcat FILE -o hair.usda writes text");
    for (const char* error : {read_sections(ByteReader(bytes_, 16).u64()), read_tokens(), read_strings(), read_fields(),
                              read_paths(), read_specs()}) {
      if (*error != '\0') return Refusal(std::string("the binary USD is truncated or damaged: ") + error);
    }
    if (!write_all())
      return Refusal(
          "the binary USD is truncated or damaged: a value, prims nested too deep, or too much of what is shared");
    return std::move(text_);
  }

 private:
  // The read_ functions return what is damaged, or an empty text. A row of the table of contents has a name of 16
  // bytes, a place and a size.
  const char* read_sections(std::uint64_t at) {
    constexpr std::array<std::string_view, 6> kNames{"TOKENS", "STRINGS", "FIELDS", "FIELDSETS", "PATHS", "SPECS"};
    if (at > bytes_.size()) return "its table of contents is beyond its end";
    ByteReader in(bytes_, at);
    if (!in.has(8)) return "its table of contents";
    const std::uint64_t count = in.u64();
    if (!in.has(count, 32)) return "its table of contents";
    for (std::uint64_t i = 0; i < count; ++i) {
      const char* name = reinterpret_cast<const char*>(bytes_.data()) + in.at();
      const std::string_view word(name, std::min<std::size_t>(std::string_view(name, 16).find('\0'), 16));
      in.skip(16);
      const std::uint64_t begin = in.u64(), size = in.u64();
      if (begin > bytes_.size() || size > bytes_.size() - begin) return "a section is beyond its end";
      const auto known = std::ranges::find(kNames, word);
      if (known != kNames.end())
        sections_[static_cast<std::size_t>(known - kNames.begin())] = bytes_.subspan(begin, size);
    }
    return "";
  }

  const char* read_tokens() {
    ByteReader in(sections_[0]);
    if (!in.has(24)) return "its tokens";
    const std::uint64_t count = in.u64(), size = in.u64(), packed_bytes = in.u64();
    // LZ4 makes at most 255 bytes of one, so a larger size is false.
    if (!in.has(packed_bytes, 1) || size / 255 > packed_bytes || count > size) return "its tokens";
    auto unpacked = unpack(sections_[0].subspan(in.at(), packed_bytes), size);
    if (!unpacked || unpacked->size() != size || (size > 0 && unpacked->back() != std::byte{0})) return "its tokens";
    token_bytes_ = std::move(*unpacked);
    // Each token ends with a zero.
    const std::string_view all(reinterpret_cast<const char*>(token_bytes_.data()), token_bytes_.size());
    for (std::size_t at = 0; at < all.size(); at += tokens_.back().size() + 1)
      tokens_.push_back(all.substr(at, all.find('\0', at) - at));
    return tokens_.size() == count ? "" : "its tokens";
  }

  const char* read_strings() {
    ByteReader in(sections_[1]);
    if (!in.has(8)) return "its strings";
    const std::uint64_t count = in.u64();
    if (!in.has(count, 4)) return "its strings";
    for (std::uint64_t i = 0; i < count; ++i) strings_.push_back(in.u32());
    return "";
  }

  const char* read_fields() {
    ByteReader in(sections_[2]);
    if (!in.has(8)) return "its fields";
    const std::uint64_t count = in.u64();
    if (count > kCrateEntriesMax) return "its fields";
    const auto names = unpack_integers(in, count, 4, sections_[2]);
    if (!names || !in.has(8)) return "its fields";
    const std::uint64_t packed_bytes = in.u64();
    if (!in.has(packed_bytes, 1)) return "its fields";
    const auto values = unpack(sections_[2].subspan(in.at(), packed_bytes), 8 * count);
    if (!values || values->size() != 8 * count) return "its fields";
    ByteReader value(*values);
    for (const std::int64_t name : *names) fields_.push_back({token(static_cast<std::uint64_t>(name)), {value.u64()}});
    ByteReader sets(sections_[3]);
    if (!sets.has(8)) return "its sets of fields";
    const std::uint64_t set_count = sets.u64();
    const auto indices = unpack_integers(sets, set_count, 4, sections_[3]);
    if (!indices) return "its sets of fields";
    for (const std::int64_t index : *indices) sets_.push_back(static_cast<std::uint32_t>(index));
    return "";
  }

  // Paths as a tree in depth-first order. A jump above 0 means that a child follows, and that the next sibling is so
  // many entries later. A jump of 0 means that a sibling follows, -1 that only a child follows, and -2 that neither
  // does. A negative name is that of a property.
  const char* read_paths() {
    ByteReader in(sections_[4]);
    if (!in.has(16)) return "its paths";
    const std::uint64_t path_count = in.u64(), count = in.u64();
    if (count > kCrateEntriesMax) return "its paths";
    const auto indices = unpack_integers(in, count, 4, sections_[4]);
    const auto names = indices ? unpack_integers(in, count, 4, sections_[4]) : std::nullopt;
    const auto jumps = names ? unpack_integers(in, count, 4, sections_[4]) : std::nullopt;
    if (!jumps || path_count > 2 * count + 1) return "its paths";
    nodes_.resize(path_count);
    std::vector<bool> is_read(count, false), is_placed(path_count, false);
    // The entries of siblings that are still to be read, each with its parent.
    std::vector<std::pair<std::uint64_t, std::uint32_t>> later;
    if (count > 0) later.emplace_back(0, kNoIndex);
    while (!later.empty()) {
      auto [at, parent] = later.back();
      later.pop_back();
      for (bool goes_on = true; goes_on; ++at) {
        if (at >= count || is_read[at]) return "its paths";
        is_read[at] = true;
        const auto index = static_cast<std::uint64_t>((*indices)[at]);
        if (index >= path_count || is_placed[index] || (parent == kNoIndex) != (at == 0)) return "its paths";
        is_placed[index] = true;
        const auto self = static_cast<std::uint32_t>(index);
        CrateNode& node = nodes_[self];
        node.parent = parent;
        const std::int64_t name = (*names)[at], jump = (*jumps)[at];
        node.is_property = name < 0;
        node.name =
            parent == kNoIndex ? std::string_view() : token(static_cast<std::uint64_t>(name < 0 ? -name : name));
        if (parent == kNoIndex) root_ = self;
        if (parent != kNoIndex) nodes_[parent].children.push_back(self);
        if (jump > 0) later.emplace_back(at + static_cast<std::uint64_t>(jump), parent);
        if (jump > 0 || jump == -1) parent = self;
        goes_on = jump >= -1 && !(jump == 0 && parent == kNoIndex);
      }
    }
    return root_ == kNoIndex ? "its paths" : "";
  }

  const char* read_specs() {
    ByteReader in(sections_[5]);
    if (!in.has(8)) return "its specs";
    const std::uint64_t count = in.u64();
    const auto paths = unpack_integers(in, count, 4, sections_[5]);
    const auto sets = paths ? unpack_integers(in, count, 4, sections_[5]) : std::nullopt;
    if (!sets) return "its specs";
    for (std::size_t i = 0; i < paths->size(); ++i) {
      const auto path = static_cast<std::uint64_t>((*paths)[i]), set = static_cast<std::uint64_t>((*sets)[i]);
      if (path >= nodes_.size() || set >= sets_.size()) return "its specs";
      nodes_[path].fields = static_cast<std::uint32_t>(set);
    }
    return "";
  }

  [[nodiscard]] std::string_view token(std::uint64_t index) const {
    return index < tokens_.size() ? tokens_[index] : std::string_view{};
  }
  [[nodiscard]] std::string_view string(std::uint64_t index) const {
    return index < strings_.size() ? token(strings_[index]) : std::string_view{};
  }

  [[nodiscard]] std::optional<CrateValue> field(const CrateNode& node, std::string_view name) const {
    if (!node.fields) return {};
    const std::size_t end = std::min(sets_.size(), *node.fields + kCrateFieldsMax);
    for (std::size_t i = *node.fields; i < end && sets_[i] < fields_.size(); ++i) {
      if (fields_[sets_[i]].name == name) return fields_[sets_[i]].value;
    }
    return {};
  }
  [[nodiscard]] std::string_view token_field(const CrateNode& node, std::string_view name) const {
    const auto value = field(node, name);
    return value && value->type() == kCrateToken && !value->is_array() ? token(value->payload()) : std::string_view{};
  }

  // Returns a reader at a place of the file; none: fewer than `bytes` are there.
  std::optional<ByteReader> at(std::uint64_t place, std::size_t bytes) const {
    if (place > bytes_.size() || bytes > bytes_.size() - place) return {};
    return ByteReader(bytes_, place);
  }

  // 17 digits read back to the same double, and 9 digits to the same float.
  void put_number(double value, bool is_double) {
    char word[40];
    const int length = std::snprintf(word, sizeof word, is_double ? "%.17g" : "%.9g", value);
    text_.append(word, static_cast<std::size_t>(length));
  }

  // Writes one number as it lies in the file.
  void put_raw(ByteReader& in, const NumberLayout& layout) {
    if (layout.kind == 'f') {
      const double value = layout.bytes == 8   ? std::bit_cast<double>(in.u64())
                           : layout.bytes == 4 ? double{in.f32()}
                                               : double{half_float(in.u16())};
      return put_number(value, layout.bytes == 8);
    }
    if (layout.bytes == 1) {
      text_ += std::to_string(std::to_integer<unsigned>(bytes_[in.at()]));
      in.skip(1);
    } else if (layout.bytes == 4) {
      const std::uint32_t bits = in.u32();
      text_ += layout.kind == 'u' ? std::to_string(bits) : std::to_string(static_cast<std::int32_t>(bits));
    } else {
      text_ += std::to_string(static_cast<std::int64_t>(in.u64()));
    }
  }

  // One value of several numbers, in brackets; a matrix as one list of its numbers.
  void put_raw_value(ByteReader& in, const NumberLayout& layout, bool is_quaternion) {
    if (layout.count == 1) return put_raw(in, layout);
    const std::size_t begin = text_.size();
    std::size_t last = 0;
    text_.push_back('(');
    for (std::size_t i = 0; i < layout.count; ++i) {
      if (i > 0) text_.push_back(',');
      last = text_.size();
      put_raw(in, layout);
    }
    // The real part is written first, and stored last.
    if (is_quaternion) {
      const std::string real = text_.substr(last);
      text_.resize(last - 1);
      text_.insert(begin + 1, real + ',');
    }
    text_.push_back(')');
  }

  // The payload has one number of up to 32 bits, or a signed byte for each number of a vector. An inlined matrix is
  // diagonal, and has a byte for each number on the diagonal.
  bool put_inlined(CrateValue value, const NumberLayout& layout) {
    const std::uint32_t low = value.low();
    const auto small = [&](std::size_t i) { return static_cast<double>(static_cast<std::int8_t>(low >> (8 * i))); };
    if (value.type() == kCrateMatrix4d) {
      text_.push_back('(');
      for (std::size_t i = 0; i < 16; ++i) {
        if (i > 0) text_.push_back(',');
        put_number(i % 5 == 0 ? small(i / 5) : 0, false);
      }
      text_.push_back(')');
    } else if (layout.count > 4) {
      return false;
    } else if (layout.count > 1) {
      text_.push_back('(');
      for (std::size_t i = 0; i < layout.count; ++i) {
        if (i > 0) text_.push_back(',');
        put_number(small(i), false);
      }
      text_.push_back(')');
    } else if (layout.kind == 'f') {
      const bool is_half = layout.bytes == 2;
      put_number(is_half ? double{half_float(static_cast<std::uint16_t>(low))} : double{std::bit_cast<float>(low)},
                 false);
    } else {
      text_ += layout.kind == 'u' ? std::to_string(low) : std::to_string(static_cast<std::int32_t>(low));
    }
    return true;
  }

  // Packed real numbers begin with a letter: 'i' for numbers that are all whole, or 't' for a table of numbers and the
  // index of each value in it.
  bool put_packed_numbers(ByteReader& in, const NumberLayout& layout, std::uint64_t count) {
    if (layout.kind != 'f') {
      if (layout.bytes < 4) return false;
      const auto values = unpack_integers(in, count, layout.bytes, bytes_);
      if (!values) return false;
      for (const std::int64_t value : *values) text_.append(std::to_string(value)).push_back(',');
      return text_.size() <= text_max_;
    }
    if (!in.has(1)) return false;
    const char code = static_cast<char>(bytes_[in.at()]);
    in.skip(1);
    if (code == 'i') {
      const auto values = unpack_integers(in, count, 4, bytes_);
      if (!values) return false;
      for (const std::int64_t value : *values) text_.append(std::to_string(value)).push_back(',');
      return text_.size() <= text_max_;
    }
    if (code != 't' || !in.has(4)) return false;
    const std::uint32_t table_size = in.u32();
    if (!in.has(table_size, layout.bytes)) return false;
    const std::size_t table_at = in.at();
    in.skip(table_size * layout.bytes);
    const auto indices = unpack_integers(in, count, 4, bytes_);
    if (!indices) return false;
    for (const std::int64_t index : *indices) {
      if (index < 0 || index >= table_size || text_.size() > text_max_) return false;
      ByteReader entry(bytes_, table_at + static_cast<std::size_t>(index) * layout.bytes);
      put_raw(entry, layout);
      text_.push_back(',');
    }
    return true;
  }

  bool put_array(CrateValue value) {
    // Arrays of fewer values are never packed.
    constexpr std::uint64_t kPackedMin = 16;
    const bool is_words = value.type() >= kCrateString && value.type() <= kCrateAsset;
    const auto layout = is_words ? NumberLayout{'u', 4, 1} : layout_of(value.type());
    if (!layout) {
      text_ += "None";
      return true;
    }
    text_.push_back('[');
    if (value.payload() != 0) {
      auto in = at(value.payload(), 12);
      if (!in) in = at(value.payload(), 4);
      if (!in) return false;
      // Versions before 0.5 have a number of axes before the count, and those before 0.7 a count of 32 bits.
      if (minor_ < 5) in->skip(4);
      if (!in->has(minor_ < 7 ? 4 : 8)) return false;
      const std::uint64_t count = minor_ < 7 ? in->u32() : in->u64();
      if (value.is_packed() && count >= kPackedMin) {
        if (is_words || layout->count > 1 || !put_packed_numbers(*in, *layout, count)) return false;
      } else {
        if (!in->has(count, layout->bytes * layout->count)) return false;
        // Types 16 to 18 are quaternions of doubles, floats and halves.
        const bool is_quaternion = value.type() >= 16 && value.type() <= 18;
        for (std::uint64_t i = 0; i < count; ++i) {
          if (text_.size() > text_max_) return false;
          if (is_words) {
            const std::uint32_t index = in->u32();
            text_ += quoted(value.type() == kCrateString ? string(index) : token(index));
          } else {
            put_raw_value(*in, *layout, is_quaternion);
          }
          text_.push_back(',');
        }
      }
    }
    text_.push_back(']');
    return true;
  }

  // Writes a value, or None for a type that neither curves nor bodies have. Returns whether the value is valid.
  bool put_value(CrateValue value) {
    if (value.is_array()) return put_array(value);
    const unsigned type = value.type();
    if (type == kCrateToken || type == kCrateString || type == kCrateAsset) {
      text_ += quoted(type == kCrateString ? string(value.payload()) : token(value.payload()));
      return true;
    }
    if (type == kCrateTokens || type == kCrateStrings) {
      auto in = at(value.payload(), 8);
      if (!in) return false;
      const std::uint64_t count = in->u64();
      if (!in->has(count, 4)) return false;
      text_.push_back('[');
      for (std::uint64_t i = 0; i < count && text_.size() <= text_max_; ++i) {
        const std::uint32_t index = in->u32();
        text_.append(quoted(type == kCrateTokens ? token(index) : string(index))).push_back(',');
      }
      text_.push_back(']');
      return true;
    }
    const auto layout = layout_of(type);
    if (!layout) {
      text_ += "None";
      return true;
    }
    if (value.is_inlined()) return put_inlined(value, *layout);
    auto in = at(value.payload(), layout->bytes * layout->count);
    if (!in) return false;
    put_raw_value(*in, *layout, type >= 16 && type <= 18);
    return true;
  }

  // Writes the samples of an attribute. A distance leads from its own place to the times, and another one from behind
  // the times to the values.
  bool put_samples(CrateValue value) {
    const auto jump = [&](std::uint64_t from) -> std::optional<ByteReader> {
      auto in = at(from, 8);
      return in ? at(from + in->u64(), 8) : std::nullopt;
    };
    auto times_at = jump(value.payload());
    if (!times_at) return false;
    const CrateValue times{times_at->u64()};
    auto values = jump(times_at->at());
    if (!values || times.type() != kCrateDoubles) return false;
    auto in = at(times.payload(), 8);
    if (!in) return false;
    const std::uint64_t count = in->u64();
    if (!in->has(count, 8) || values->u64() != count || !values->has(count, 8)) return false;
    text_.push_back('{');
    for (std::uint64_t i = 0; i < count; ++i) {
      put_number(std::bit_cast<double>(in->u64()), true);
      text_ += ": ";
      if (!put_value({values->u64()}) || text_.size() > text_max_) return false;
      text_ += ",\n";
    }
    text_.push_back('}');
    return true;
  }

  // Writes the file of the first reference. In a list, a byte of flags and a count of 8 bytes stand before the
  // references.
  void put_references(const CrateNode& node) {
    for (const std::string_view name : {"references", "payload"}) {
      const auto value = field(node, name);
      if (!value) continue;
      const bool is_list = value->type() == kCrateReferences || value->type() == kCratePayloads;
      if (!is_list && value->type() != kCratePayload) continue;
      // A list has a byte of flags and a count of 8 bytes, then the index of the first reference's file, 4 bytes. A
      // single payload begins with the index.
      auto in = at(value->payload(), is_list ? 13 : 4);
      if (!in) continue;
      if (is_list) in->skip(9);
      const std::string_view file = string(in->u32());
      text_.append(name).append(" = ").append(quoted(file.empty() ? "another prim" : file)).append("\n");
    }
  }

  bool put_selections(const CrateNode& node) {
    const auto value = field(node, "variantSelection");
    if (!value || value->type() != kCrateSelections) return true;
    auto in = at(value->payload(), 8);
    if (!in) return false;
    const std::uint64_t count = in->u64();
    if (!in->has(count, 8)) return false;
    text_ += "variants = {";
    for (std::uint64_t i = 0; i < count; ++i) {
      const std::uint32_t set = in->u32(), variant = in->u32();
      text_.append("string ").append(quoted(string(set))).append(" = ").append(quoted(string(variant))).append("\n");
    }
    text_ += "}\n";
    return true;
  }

  bool put_attribute(const CrateNode& node) {
    const bool is_of_curves = node.name == "points" || node.name == "curveVertexCounts" || node.name == "type" ||
                              node.name == "basis" || node.name == "wrap" || node.name == "widths" ||
                              node.name.starts_with("primvars:");
    const bool is_of_all = node.name == "visibility" || node.name == "purpose" || node.name.starts_with("xformOp");
    const CrateNode& prim = nodes_[node.parent];
    const std::string_view prim_type = token_field(prim, "typeName");
    const bool is_of_mesh =
        prim_type == "Mesh" && (node.name == "points" || node.name.starts_with("faceVertex") ||
                                node.name == "orientation" || node.name.starts_with("primvars:skel:"));
    const bool is_of_skeleton = prim_type == "Skeleton" && (node.name == "joints" || node.name == "bindTransforms");
    const bool is_asked_for = content_ == Content::bodies
                                  ? is_of_mesh || is_of_skeleton
                                  : is_of_curves && (prim_type.empty() || prim_type == "BasisCurves");
    if (!is_of_all && !is_asked_for) return true;
    // A name that is no word of the text is none that is asked for, and is left out.
    if (node.name.find_first_not_of("abcdefghijklmnopqrstuvwxyzABCDEFGHIJKLMNOPQRSTUVWXYZ0123456789_:") !=
        std::string_view::npos)
      return true;
    // A skeleton's weights matter only in that there are some.
    if (node.name.starts_with("primvars:skel:") && node.name != "primvars:skel:geomBindTransform") {
      text_.append("any ").append(node.name).append(" = []\n");
      return true;
    }
    for (const std::string_view kind : {"default", "timeSamples"}) {
      const auto value = field(node, kind);
      if (!value || (kind == "timeSamples") != (value->type() == kCrateSamples)) continue;
      text_.append("any ").append(node.name).append(kind == "default" ? " = " : ".timeSamples = ");
      if (!(kind == "default" ? put_value(*value) : put_samples(*value))) return false;
      if (const std::string_view how = token_field(node, "interpolation"); !how.empty())
        text_.append(" (interpolation = ").append(quoted(how)).append(")");
      text_.push_back('\n');
    }
    return true;
  }

  // Writes the beginning of a prim up to its brace. A node with a name such as {set=variant} is a variant.
  bool begin_prim(const CrateNode& node) {
    if (node.name.starts_with('{')) {
      const std::size_t equal = std::min(node.name.find('='), node.name.size());
      const std::string_view set = node.name.substr(1, std::max<std::size_t>(equal, 1) - 1);
      std::string_view variant = node.name.substr(std::min(equal + 1, node.name.size()));
      if (variant.ends_with('}')) variant.remove_suffix(1);
      text_.append("variantSet ").append(quoted(set)).append(" = {\n").append(quoted(variant)).append(" {\n");
      return true;
    }
    constexpr std::array<std::string_view, 3> kSpecifiers{"def", "over", "class"};
    const auto specifier = field(node, "specifier");
    const bool is_known = specifier && specifier->type() == kCrateSpecifier && specifier->low() < kSpecifiers.size();
    std::string_view type = token_field(node, "typeName");
    if (type.find_first_of(" \t\r\n\"'(){}[]=#") != std::string_view::npos) type = {};
    text_.append(kSpecifiers[is_known ? specifier->low() : 1])
        .append(" ")
        .append(type)
        .append(" ")
        .append(quoted(node.name));
    text_ += " (\n";
    if (const auto active = field(node, "active"); active && active->type() == kCrateBool && active->low() == 0)
      text_ += "active = false\n";
    put_references(node);
    if (!put_selections(node)) return false;
    text_ += ") {\n";
    return true;
  }

  bool write_all() {
    const CrateNode& root = nodes_[root_];
    text_ = "#usda 1.0\n(\n";
    for (const std::string_view name : {"upAxis", "metersPerUnit", "subLayers"}) {
      const auto value = field(root, name);
      if (!value) continue;
      text_.append(name).append(" = ");
      if (!put_value(*value)) return false;
      text_.push_back('\n');
    }
    text_ += ")\n";
    struct Open {
      std::uint32_t node;
      std::size_t next = 0;
    };
    std::vector<Open> open{{root_}};
    while (!open.empty()) {
      const CrateNode& node = nodes_[open.back().node];
      if (open.size() > kDepthMax || text_.size() > text_max_) return false;
      if (open.back().next == node.children.size()) {
        if (open.back().node != root_) text_ += node.name.starts_with('{') ? "}\n}\n" : "}\n";
        open.pop_back();
        continue;
      }
      const std::uint32_t next = node.children[open.back().next++];
      const CrateNode& child = nodes_[next];
      if (!child.fields) continue;
      if (child.is_property) {
        if (!put_attribute(child)) return false;
      } else {
        if (!begin_prim(child)) return false;
        open.push_back({next});
      }
    }
    return true;
  }

  // The text may have 64 MB, plus 16 bytes for each byte of the file. Prims may share values, and packed numbers may be
  // many, so a small file could otherwise make any amount of text.
  static constexpr std::size_t kTextBytes = 64'000'000, kTextOfByte = 16;
  CrateBytes bytes_;
  Content content_;
  std::size_t text_max_;
  // The file has version 0.minor_.
  unsigned minor_ = 0;
  // The sections of the file, in the order of the names in read_sections().
  std::array<CrateBytes, 6> sections_;
  // The text of all tokens, which tokens_ refers to.
  std::vector<std::byte> token_bytes_;
  std::vector<std::string_view> tokens_;
  // strings_ are indices of tokens. sets_ holds the sets of fields one after the other: indices into fields_, and an
  // index of no field at the end of each set.
  std::vector<std::uint32_t> strings_, sets_;
  std::vector<CrateField> fields_;
  std::vector<CrateNode> nodes_;
  std::uint32_t root_ = kNoIndex;
  std::string text_;
};

}  // namespace

Result<std::string> text_of_crate(std::span<const std::byte> bytes, Content content) {
  return Crate(bytes, content).text();
}

}  // namespace hairnet::usda
