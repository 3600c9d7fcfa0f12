#include "schema/http3/frame_reader.hpp"

#include <algorithm>

#include "core/assert.hpp"

namespace hairnet::http3 {

bool FrameReader::take_header(std::uint8_t byte) {
  HAIRNET_ASSERT(header_bytes_ < header_.size());
  header_[header_bytes_++] = byte;
  const std::span<const std::uint8_t> header(header_.data(), header_bytes_);
  const Varint type = read_varint(header);
  if (type.bytes == 0) return false;
  const Varint length = read_varint(header.subspan(type.bytes));
  if (length.bytes == 0) return false;
  type_ = type.value;
  length_ = left_ = length.value;
  header_bytes_ = 0;
  return true;
}

void FrameReader::feed(std::span<const std::uint8_t> bytes, const std::function<bool(const Piece&)>& on_piece) {
  while (!bytes.empty()) {
    bool is_first = false;
    if (!in_payload_) {
      is_first = in_payload_ = take_header(bytes[0]);
      bytes = bytes.subspan(1);
      if (!in_payload_) continue;
    }
    const std::size_t count = static_cast<std::size_t>(std::min<std::uint64_t>(left_, bytes.size()));
    // The payload begins in the next piece of the stream. The header is passed on all the same, so that the caller can
    // refuse a type or a length before its bytes come.
    if (is_first && count == 0 && left_ > 0) {
      if (!on_piece({type_, length_, {}, true, false})) return;
      continue;
    }
    left_ -= count;
    in_payload_ = left_ > 0;
    if (!on_piece({type_, length_, bytes.first(count), is_first, left_ == 0})) return;
    bytes = bytes.subspan(count);
  }
}

}  // namespace hairnet::http3
