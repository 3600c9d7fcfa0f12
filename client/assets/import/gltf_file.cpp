#include "client/assets/import/gltf_file.hpp"

#include <meshoptimizer.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <utility>

#include "client/assets/import/byte_reader.hpp"
#include "client/assets/import/parse_text.hpp"
#include "core/shown_text.hpp"

namespace hairnet::gltf {
namespace {

// Both bound the memory that JSON needs, because a value of the parsed document takes many times its text. Avatars have
// some 50 000 values.
constexpr std::size_t kValuesMax = 500'000;
constexpr int kDepthMax = 64;
// Unpacked buffers and buffers of other files have together no more bytes: a small file can name large files, and pack
// large buffers.
constexpr std::size_t kTakenBytesMax = std::size_t{512} << 20;
// meshoptimizer takes strides up to this one; glTF itself allows 252 bytes.
constexpr std::size_t kByteStrideMax = 256;

// Stops the parser where JSON has too many values or is nested too deep. The second parse, which takes memory, happens
// only within the limits.
class ValueCounter final : public nlohmann::json_sax<Json> {
 public:
  [[nodiscard]] bool is_too_large() const { return values_ > kValuesMax || depth_ > kDepthMax; }

  bool null() override { return take(); }
  bool boolean(bool) override { return take(); }
  bool number_integer(std::int64_t) override { return take(); }
  bool number_unsigned(std::uint64_t) override { return take(); }
  bool number_float(double, const std::string&) override { return take(); }
  bool string(std::string&) override { return take(); }
  bool binary(Json::binary_t&) override { return false; }
  bool key(std::string&) override { return true; }
  bool start_object(std::size_t) override { return take(1); }
  bool end_object() override { return --depth_ >= 0; }
  bool start_array(std::size_t) override { return take(1); }
  bool end_array() override { return --depth_ >= 0; }
  bool parse_error(std::size_t, const std::string&, const nlohmann::detail::exception&) override { return false; }

 private:
  bool take(int deeper = 0) {
    ++values_;
    depth_ += deeper;
    return !is_too_large();
  }

  std::size_t values_ = 0;
  int depth_ = 0;
};

// The JSON is counted before memory is taken for its values. Exceptions are off in both parses, so damage is a value
// here.
Result<Json> parse_json(std::string_view text) {
  ValueCounter counter;
  const bool is_valid = Json::sax_parse(text, &counter);
  if (counter.is_too_large())
    return Refusal("its JSON has more than " + std::to_string(kValuesMax) + " values, or is nested more than " +
                   std::to_string(kDepthMax) + " deep");
  Json json = is_valid ? Json::parse(text, nullptr, false) : Json();
  if (!json.is_object()) return Refusal("its JSON is damaged, or no glTF");
  const std::string version = text_of(member(member(json, "asset"), "version"));
  if (!version.starts_with("2"))
    return Refusal("glTF of version " + shown(version) + ": export it as glTF 2, as all programs do now");
  return json;
}

// The bytes of text in base64, which ends at the first character that is none of it. Padding and line ends end the text
// as well, without an error: a shortened buffer is noticed where a view needs its bytes.
std::vector<std::byte> decode_base64(std::string_view text) {
  constexpr std::string_view kDigits = "ABCDEFGHIJKLMNOPQRSTUVWXYZabcdefghijklmnopqrstuvwxyz0123456789+/";
  std::array<std::uint8_t, 256> digit_of{};
  for (std::size_t i = 0; i < kDigits.size(); ++i)
    digit_of[static_cast<unsigned char>(kDigits[i])] = static_cast<std::uint8_t>(i + 1);
  std::vector<std::byte> bytes;
  bytes.reserve(text.size() / 4 * 3);
  std::uint32_t bits = 0;
  unsigned count = 0;
  for (const char c : text) {
    const std::uint32_t digit = digit_of[static_cast<unsigned char>(c)];
    if (digit == 0) break;
    bits = bits << 6 | (digit - 1);
    count += 6;
    if (count < 8) continue;
    count -= 8;
    bytes.push_back(static_cast<std::byte>(bits >> count));
  }
  return bytes;
}

// A file's name in a URI: %20 is a blank. Empty where it leads out of the folder. A file may be somebody else's: it
// must not make this program read any other file than those beside it. So an absolute path, a drive, a backslash, a
// zero and "..", also when written as %2e, are refused.
std::string name_of_uri(std::string_view uri) {
  std::string name;
  for (std::size_t i = 0; i < uri.size(); ++i) {
    unsigned code = 0;
    const char* const digits = uri.data() + i + 1;
    const bool is_code =
        uri[i] == '%' && i + 2 < uri.size() && std::from_chars(digits, digits + 2, code, 16).ptr == digits + 2;
    name.push_back(is_code ? static_cast<char>(code) : uri[i]);
    if (is_code) i += 2;
  }
  const bool leads_out = name.starts_with('/') || name.find("..") != std::string::npos ||
                         name.find_first_of(std::string_view(":\\\0", 3)) != std::string::npos;
  return leads_out ? std::string() : name;
}

std::string numbered(const char* what, std::size_t index) {
  return std::string(what) + ' ' + std::to_string(index);
}

}  // namespace

const Json* member(const Json& value, const char* name) {
  if (!value.is_object()) return nullptr;
  const auto found = value.find(name);
  return found == value.end() ? nullptr : &*found;
}

const Json* member(const Json* value, const char* name) {
  return value ? member(*value, name) : nullptr;
}

const Json* element(const Json& value, const char* name, std::size_t index) {
  const std::vector<Json>& all = elements(member(value, name));
  return index < all.size() ? &all[index] : nullptr;
}

// Negative and broken numbers give none, so that callers treat them like missing ones.
std::optional<std::size_t> whole(const Json* value) {
  if (!value || !value->is_number_unsigned()) return {};
  return value->get<std::size_t>();
}

// The count in the file must be exact, since matrices and vectors have a fixed length.
std::optional<std::vector<double>> numbers(const Json* value, std::size_t count) {
  std::vector<double> out;
  for (const Json& number : elements(value)) {
    if (!number.is_number() || out.size() == count) return {};
    out.push_back(number.get<double>());
  }
  if (out.size() != count || !std::ranges::all_of(out, [](double x) { return std::isfinite(x); })) return {};
  return out;
}

const std::vector<Json>& elements(const Json* value) {
  static const std::vector<Json> kNone;
  return value && value->is_array() ? value->get_ref<const Json::array_t&>() : kNone;
}

std::string text_of(const Json* value) {
  return value && value->is_string() ? value->get<std::string>() : std::string();
}

double Numbers::at(std::size_t row, std::size_t column) const {
  // The reader needs no check: `File::numbers` has compared all rows with the bytes.
  ByteReader in(bytes, row * stride_bytes + column * number_bytes);
  // glTF maps signed numbers to [-1, 1] with both -128 and -127 at -1.
  const auto share = [&](double number, double most) { return is_normalized ? std::max(number / most, -1.0) : number; };
  switch (component) {
    // The numbers are glTF's names of the types: bytes and numbers of 16 bits, each with and without a sign, then 32
    // bits without a sign, and floats (5126).
    case 5120:
      return share(static_cast<std::int8_t>(in.u8()), 127);
    case 5121:
      return share(in.u8(), 255);
    case 5122:
      return share(static_cast<std::int16_t>(in.u16()), 32767);
    case 5123:
      return share(in.u16(), 65535);
    case 5125:
      return in.u32();
    default:
      return static_cast<double>(in.f32());
  }
}

Result<File> File::open(std::span<const std::byte> bytes, const ReadBeside& read_beside) {
  // The words are "glTF", "JSON" and "BIN" with a zero, in little-endian order.
  constexpr std::uint32_t kMagic = 0x46546c67, kJsonChunk = 0x4e4f534a, kBinaryChunk = 0x004e4942;
  File file;
  file.read_beside_ = read_beside;
  ByteReader in(bytes);
  std::string_view text(reinterpret_cast<const char*>(bytes.data()), bytes.size());
  // A .glb has a header of 12 bytes and chunks of a length, a type and their bytes. The first is the JSON, the second
  // its buffer.
  if (in.has(20) && in.u32() == kMagic) {
    if (const std::uint32_t version = in.u32(); version != 2)
      return Refusal("binary glTF of version " + std::to_string(version) + ": export it as glTF 2");
    // A file that is longer than its header says is accepted.
    if (in.u32() > bytes.size()) return Refusal("truncated: it is shorter than its header says");
    const std::size_t json_bytes = in.u32();
    if (in.u32() != kJsonChunk || !in.has(json_bytes)) return Refusal("truncated: its JSON is not there");
    text = text.substr(in.at(), json_bytes);
    in.skip(json_bytes);
    if (in.has(8)) {
      const std::size_t binary_bytes = in.u32();
      if (in.u32() == kBinaryChunk) {
        if (!in.has(binary_bytes)) return Refusal("truncated: its buffer ends early");
        file.binary_ = bytes.subspan(in.at(), binary_bytes);
      }
    }
  } else if (text.find_first_not_of(" \t\r\n\xef\xbb\xbf") != text.find('{')) {
    return Refusal("not a glTF file: it begins neither with glTF nor with {");
  }
  Result<Json> json = parse_json(text);
  if (!json) return Refusal(json.error());
  file.json_ = std::move(*json);
  return file;
}

// The bytes of a buffer stay in `buffers_`, whose map does not move them, so spans into it remain valid.
Result<std::span<const std::byte>> File::buffer(std::size_t index) {
  const Json* const described = element(json_, "buffers", index);
  if (!described) return Refusal("there is no " + numbered("buffer", index));
  const Json* const uri = member(*described, "uri");
  if (!uri) {
    // Only buffer 0 may lie in the .glb itself.
    if (index != 0 || binary_.empty()) return Refusal(numbered("buffer", index) + " has no bytes in the file");
    return binary_;
  }
  if (const auto found = buffers_.find(index); found != buffers_.end())
    return std::span<const std::byte>(found->second);
  const std::string text = text_of(uri);
  // Text of a data URI is already in the file, so its bytes are not counted against the limit.
  if (text.starts_with("data:")) {
    const std::size_t comma = text.find(";base64,");
    if (comma == std::string::npos) return Refusal(numbered("buffer", index) + " is not written in base64");
    return buffers_[index] = decode_base64(std::string_view(text).substr(comma + 8));
  }
  const std::string name = name_of_uri(text);
  if (name.empty() || !read_beside_)
    return Refusal("its buffer " + shown(text) + " is no file in the same folder: export it as .glb");
  Result<std::vector<std::byte>> bytes = read_beside_(name);
  if (!bytes) return Refusal("its buffer " + shown(name) + ": " + bytes.error());
  if (bytes->size() > kTakenBytesMax - taken_bytes_) return Refusal("its buffers have too many bytes");
  taken_bytes_ += bytes->size();
  return buffers_[index] = std::move(*bytes);
}

// `view` may also be the extension of a packed view, which names buffer, offset and length in the same way.
Result<std::span<const std::byte>> File::part_of_buffer(const Json& view) {
  const std::size_t offset = whole(member(view, "byteOffset")).value_or(0);
  const auto index = whole(member(view, "buffer")), length = whole(member(view, "byteLength"));
  if (!index || !length) return Refusal("a buffer view has no buffer or no length");
  const Result<std::span<const std::byte>> bytes = buffer(*index);
  if (!bytes) return bytes;
  if (offset > bytes->size() || *length > bytes->size() - offset)
    return Refusal("truncated: a buffer view reaches behind " + numbered("buffer", *index));
  return bytes->subspan(offset, *length);
}

Result<std::span<const std::byte>> File::view(std::size_t index) {
  const Json* const view = element(json_, "bufferViews", index);
  if (!view) return Refusal("there is no " + numbered("buffer view", index));
  for (const char* name : {"EXT_meshopt_compression", "KHR_meshopt_compression"}) {
    if (const Json* const packed = member(member(*view, "extensions"), name)) return unpacked(index, *packed);
  }
  return part_of_buffer(*view);
}

// The result is kept: several accessors use one view.
Result<std::span<const std::byte>> File::unpacked(std::size_t index, const Json& packed) {
  if (const auto found = unpacked_.find(index); found != unpacked_.end())
    return std::span<const std::byte>(found->second);
  const Result<std::span<const std::byte>> part = part_of_buffer(packed);
  if (!part) return part;
  const std::string mode = text_of(member(packed, "mode")), filter = text_of(member(packed, "filter"));
  const std::size_t count = whole(member(packed, "count")).value_or(0);
  const std::size_t stride = whole(member(packed, "byteStride")).value_or(0);
  const std::string name = numbered("buffer view", index);
  const bool is_attributes = mode == "ATTRIBUTES", is_triangles = mode == "TRIANGLES", is_indices = mode == "INDICES";
  // meshoptimizer asserts these strides; a file must not reach an assertion.
  const bool has_stride =
      is_attributes ? stride > 0 && stride <= kByteStrideMax && stride % 4 == 0 : stride == 2 || stride == 4;
  // The other filters are of normals and rotations.
  const bool is_filtered = filter == "EXPONENTIAL",
             fits_filter = filter.empty() || filter == "NONE" || (is_filtered && is_attributes);
  if (!(is_attributes || is_triangles || is_indices) || !has_stride || !fits_filter || (is_triangles && count % 3 != 0))
    return Refusal(name + " is packed in a way that is not known: export the file without compression");
  // A packed byte holds at most 64 bytes of attributes, the corners of a triangle, or an index. Without the bound, a
  // count of billions in a file of 1 kB would reserve gigabytes before the decoder notices.
  const std::size_t most = is_attributes ? 64 * part->size() / stride : is_triangles ? 3 * part->size() : part->size();
  if (count == 0 || count > most || count * stride > kTakenBytesMax - taken_bytes_)
    return Refusal(name + " says that it holds more than its bytes can");
  taken_bytes_ += count * stride;
  std::vector<std::byte> bytes(count * stride);
  const auto* const data = reinterpret_cast<const unsigned char*>(part->data());
  const int error = is_attributes  ? meshopt_decodeVertexBuffer(bytes.data(), count, stride, data, part->size())
                    : is_triangles ? meshopt_decodeIndexBuffer(bytes.data(), count, stride, data, part->size())
                                   : meshopt_decodeIndexSequence(bytes.data(), count, stride, data, part->size());
  if (error != 0) return Refusal(name + " is damaged: its packed bytes cannot be read");
  if (is_filtered) meshopt_decodeFilterExp(bytes.data(), count, stride);
  return unpacked_[index] = std::move(bytes);
}

Result<Numbers> File::numbers(std::size_t index, std::size_t width) {
  // The bytes of a number of the types 5120 to 5126. glTF has no type 5124.
  constexpr std::array<std::size_t, 7> kBytes{1, 1, 2, 2, 0, 4, 4};
  const std::string name = numbered("accessor", index);
  const Json* const accessor = element(json_, "accessors", index);
  if (!accessor) return Refusal("there is no " + name);
  const std::string type = text_of(member(*accessor, "type"));
  const std::size_t found = type == "SCALAR" ? 1 : type == "VEC3" ? 3 : type == "VEC4" ? 4 : type == "MAT4" ? 16 : 0;
  Numbers out;
  out.width = width;
  out.component = whole(member(*accessor, "componentType")).value_or(0);
  // A type below 5120 wraps around to a huge number and is refused by the comparison with the list.
  const std::size_t kind = out.component - 5120;
  if (found != width || kind >= kBytes.size() || kBytes[kind] == 0)
    return Refusal(name + " does not have " + counted(width, "number") + " in a row");
  out.number_bytes = kBytes[kind];
  const Json* const normalized = member(*accessor, "normalized");
  out.is_normalized = normalized && normalized->is_boolean() && normalized->get<bool>();
  out.count = whole(member(*accessor, "count")).value_or(0);
  const auto view_index = whole(member(*accessor, "bufferView"));
  if (!view_index || member(*accessor, "sparse"))
    return Refusal(name + " is sparse or has no bytes: export the file without sparse accessors");
  const Result<std::span<const std::byte>> bytes = view(*view_index);
  if (!bytes) return Refusal(name + ": " + bytes.error());
  const std::size_t row_bytes = width * out.number_bytes, offset = whole(member(*accessor, "byteOffset")).value_or(0);
  out.stride_bytes = whole(member(element(json_, "bufferViews", *view_index), "byteStride")).value_or(row_bytes);
  // Rows that overlap would let a small buffer hold any number of rows.
  if (out.stride_bytes < row_bytes || out.stride_bytes > kByteStrideMax)
    return Refusal(name + " has rows that overlap");
  if (offset > bytes->size()) return Refusal("truncated: " + name + " begins behind its buffer view");
  out.bytes = bytes->subspan(offset);
  // The last row may end before its stride does.
  if (out.count == 0 || out.bytes.size() < row_bytes ||
      out.count - 1 > (out.bytes.size() - row_bytes) / out.stride_bytes)
    return Refusal("truncated: " + name + " has " + std::to_string(out.count) + " rows, and no bytes for all of them");
  return out;
}

}  // namespace hairnet::gltf
