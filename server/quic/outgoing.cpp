#include "server/quic/outgoing.hpp"

#include <utility>

#include "core/assert.hpp"

namespace hairnet::quic {

Outgoing::Outgoing(Writer writer)
    : writer_(std::move(writer)), memory_(std::make_unique_for_overwrite<std::uint8_t[]>(kBytes)) {
  HAIRNET_ASSERT(writer_);
}

std::span<std::uint8_t> Outgoing::room() {
  if (kBytes - filled_ < kPacketBytesMax) flush();
  return {memory_.get() + filled_, kPacketBytesMax};
}

void Outgoing::add(const Path& path, std::size_t bytes, std::uint8_t ecn) {
  HAIRNET_ASSERT(bytes > 0 && bytes <= kPacketBytesMax && filled_ + bytes <= kBytes);
  const std::uint8_t* at = memory_.get() + filled_;
  filled_ += bytes;
  if (!bursts_.empty()) {
    Burst& last = bursts_.back();
    // A shorter packet ends a burst.
    const bool is_whole = last.bytes.size() % last.segment_bytes == 0;
    // The system cuts a burst at equal lengths, so only the last packet may be shorter, and a longer one begins a new
    // burst.
    if (is_whole && bytes <= last.segment_bytes && last.ecn == ecn && last.bytes.size() + bytes <= kBurstBytesMax &&
        last.bytes.size() / last.segment_bytes < kBurstPacketsMax && last.path == path) {
      last.bytes = {last.bytes.data(), last.bytes.size() + bytes};
      return;
    }
  }
  bursts_.push_back({path, {at, bytes}, bytes, ecn});
}

void Outgoing::flush() {
  if (!bursts_.empty()) writer_(bursts_);
  bursts_.clear();
  filled_ = 0;
}

}  // namespace hairnet::quic
