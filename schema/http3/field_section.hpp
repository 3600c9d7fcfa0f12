#pragma once

#include <cstddef>
#include <optional>
#include <span>
#include <string>
#include <string_view>
#include <utility>
#include <vector>

#include "schema/http3/varint.hpp"

namespace hairnet::http3 {

struct Field {
  std::string name, value;
};

// The most bytes of a message's fields as they came, the most fields, and the most bytes of their names and values
// together.
inline constexpr std::size_t kFieldSectionBytesMax = std::size_t{8} << 10;
inline constexpr std::size_t kFieldsMax = 64;
inline constexpr std::size_t kFieldBytesMax = std::size_t{16} << 10;

struct DecodedFields {
  enum class Outcome : std::uint8_t { decoded, damaged, too_many };
  Outcome outcome = Outcome::damaged;
  std::vector<Field> fields;
};

// Decodes a whole field section in QPACK (RFC 9204). It must not refer to the dynamic table, of which ours has no
// entries. Asserts that it has at most kFieldSectionBytesMax bytes.
DecodedFields decode_fields(std::span<const std::uint8_t> section);

// The field section of a response. `draft`: it names the draft of WebTransport, which Chromium asks for.
Bytes encode_response(int status, bool draft);

// A field is a name and a value.
using FieldView = std::pair<std::string_view, std::string_view>;
// Fields as literals with literal names, without Huffman coding.
Bytes encode_fields(const std::vector<FieldView>& fields);

// Whether these bytes may be the next ones of the peer's encoder stream. Without a dynamic table it can only set the
// table's capacity to 0, which is one byte.
bool is_valid_encoder_stream(std::span<const std::uint8_t> bytes);

}  // namespace hairnet::http3
