#include "schema/http3/field_section.hpp"

#include <nghttp3/nghttp3.h>

#include <algorithm>
#include <memory>
#include <new>

#include "core/assert.hpp"

namespace hairnet::http3 {
namespace {

// The instruction Set Dynamic Table Capacity with the capacity 0 (RFC 9204, section 4.3.1).
constexpr std::uint8_t kNoCapacity = 0x20;

struct Delete {
  void operator()(nghttp3_qpack_decoder* decoder) const { nghttp3_qpack_decoder_del(decoder); }
  void operator()(nghttp3_qpack_stream_context* context) const { nghttp3_qpack_stream_context_del(context); }
};

// The text of a buffer of nghttp3, which this releases.
std::string take(nghttp3_rcbuf* text) {
  const nghttp3_vec bytes = nghttp3_rcbuf_get_buf(text);
  std::string taken(reinterpret_cast<const char*>(bytes.base), bytes.len);
  // The text is counted by its references, and this was ours.
  nghttp3_rcbuf_decref(text);
  return taken;
}

// Appends the bytes one at a time, since g++ 12 sees an overflow in std::vector's insert() that is not there.
void put(Bytes& out, std::string_view bytes) {
  for (const char byte : bytes) out.push_back(static_cast<std::uint8_t>(byte));
}

// Appends an integer whose first `bits` bits share a byte with `flags` (RFC 7541, section 5.1).
void put_prefixed(Bytes& out, std::uint8_t flags, unsigned bits, std::size_t value) {
  const std::size_t most = (std::size_t{1} << bits) - 1;
  out.push_back(static_cast<std::uint8_t>(flags | std::min(value, most)));
  if (value < most) return;
  for (value -= most; value >= 0x80; value >>= 7) out.push_back(static_cast<std::uint8_t>(0x80 | (value & 0x7f)));
  out.push_back(static_cast<std::uint8_t>(value));
}

}  // namespace

DecodedFields decode_fields(std::span<const std::uint8_t> section) {
  HAIRNET_ASSERT(section.size() <= kFieldSectionBytesMax);
  nghttp3_qpack_decoder* made_decoder = nullptr;
  nghttp3_qpack_stream_context* made_context = nullptr;
  const nghttp3_mem* memory = nghttp3_mem_default();
  // The zeros are the capacity of the dynamic table and the number of blocked streams.
  if (nghttp3_qpack_decoder_new(&made_decoder, 0, 0, memory) != 0) throw std::bad_alloc();
  const std::unique_ptr<nghttp3_qpack_decoder, Delete> decoder(made_decoder);
  if (nghttp3_qpack_stream_context_new(&made_context, 0, memory) != 0) throw std::bad_alloc();
  const std::unique_ptr<nghttp3_qpack_stream_context, Delete> context(made_context);
  DecodedFields decoded;
  std::size_t bytes = 0;
  while (true) {
    nghttp3_qpack_nv field{};
    std::uint8_t flags = NGHTTP3_QPACK_DECODE_FLAG_NONE;
    const nghttp3_ssize count = nghttp3_qpack_decoder_read_request(decoder.get(), context.get(), &field, &flags,
                                                                   section.data(), section.size(), 1);
    if (count < 0) return decoded;
    section = section.subspan(static_cast<std::size_t>(count));
    // The section refers to the dynamic table, whose entries would come later. There is no such table here.
    if ((flags & NGHTTP3_QPACK_DECODE_FLAG_BLOCKED) != 0) return decoded;
    if ((flags & NGHTTP3_QPACK_DECODE_FLAG_EMIT) != 0) {
      Field& last = decoded.fields.emplace_back();
      last.name = take(field.name);
      last.value = take(field.value);
      bytes += last.name.size() + last.value.size();
      // A few bytes can name long entries of the static table, so the decoded size has a limit of its own.
      if (decoded.fields.size() > kFieldsMax || bytes > kFieldBytesMax) {
        decoded.outcome = DecodedFields::Outcome::too_many;
        return decoded;
      }
    }
    if ((flags & NGHTTP3_QPACK_DECODE_FLAG_FINAL) != 0) break;
    // A damaged section may leave the decoder without progress and without an end; the loop would not end either.
    if (count == 0 && (flags & NGHTTP3_QPACK_DECODE_FLAG_EMIT) == 0) return decoded;
  }
  decoded.outcome = DecodedFields::Outcome::decoded;
  return decoded;
}

Bytes encode_response(int status, bool draft) {
  HAIRNET_ASSERT(status >= 200 && status <= 599);
  using namespace std::string_view_literals;
  Bytes section;
  // The section uses no dynamic table.
  put(section, "\x00\x00"sv);
  if (status == 200) {
    // This is entry 25 of the static table.
    section.push_back(0xd9);
  } else {
    // This is the name of entry 24, and the length of a value of three letters.
    put(section, "\x5f\x09\x03");
    put(section, std::to_string(status));
  }
  if (!draft) return section;
  // This begins a literal name of 7 + 21 letters.
  put(section, "\x27\x15");
  put(section, "sec-webtransport-http3-draft");
  section.push_back(0x07);
  put(section, "draft02");
  return section;
}

Bytes encode_fields(const std::vector<FieldView>& fields) {
  // The section uses no dynamic table.
  Bytes section{0, 0};
  for (const auto& [name, value] : fields) {
    put_prefixed(section, 0x20, 3, name.size());
    put(section, name);
    put_prefixed(section, 0x00, 7, value.size());
    put(section, value);
  }
  return section;
}

bool is_valid_encoder_stream(std::span<const std::uint8_t> bytes) {
  return std::ranges::all_of(bytes, [](std::uint8_t byte) { return byte == kNoCapacity; });
}

}  // namespace hairnet::http3
