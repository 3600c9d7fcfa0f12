#include "schema/channel/packet_splitter.hpp"

#include <algorithm>
#include <cstring>

#include "core/assert.hpp"

namespace hairnet::channel {
namespace {

constexpr std::size_t kPrefixBytes = 4;

std::size_t words_for(std::size_t bytes) {
  return (bytes + sizeof(std::uint64_t) - 1) / sizeof(std::uint64_t);
}

std::size_t packet_bytes(const std::uint8_t* prefix) {
  const std::uint32_t counted =
      prefix[0] | prefix[1] << 8 | prefix[2] << 16 | static_cast<std::uint32_t>(prefix[3]) << 24;
  return kPrefixBytes + std::size_t{counted};
}

}  // namespace

PacketSplitter::PacketSplitter(std::size_t packet_bytes_max) : packet_bytes_max_(packet_bytes_max) {
  HAIRNET_ASSERT(packet_bytes_max >= wire::kPacketBytesMin);
}

void PacketSplitter::allow(std::size_t packet_bytes_max) {
  HAIRNET_ASSERT(packet_bytes_max >= packet_bytes_max_);
  packet_bytes_max_ = packet_bytes_max;
}

bool PacketSplitter::feed(std::span<const std::uint8_t> bytes,
                          const std::function<void(std::span<const std::uint8_t>)>& on_packet) {
  HAIRNET_ASSERT(on_packet);
  HAIRNET_ASSERT(!is_feeding_);
  is_feeding_ = true;
  while (!dead_ && !bytes.empty()) {
    if (filled_ < kPrefixBytes) {
      bytes = take(bytes, kPrefixBytes);
      if (filled_ < kPrefixBytes) break;
    }
    const std::size_t whole = packet_bytes(data());
    // The size is judged as soon as its four bytes are here, before any memory is taken for the rest. A wrong size
    // cannot be passed over, since nothing marks where the next packet begins.
    if (whole < wire::kPacketBytesMin || whole > packet_bytes_max_) {
      kill();
      break;
    }
    bytes = take(bytes, whole);
    if (filled_ < whole) break;
    filled_ = 0;
    on_packet({data(), whole});
    // An assignment of {} would keep the memory.
    if (whole > kRetainedBytesMax) buffer_ = std::vector<std::uint64_t>();
  }
  is_feeding_ = false;
  check_invariants();
  return !dead_;
}

std::span<const std::uint8_t> PacketSplitter::take(std::span<const std::uint8_t> bytes, std::size_t until) {
  HAIRNET_ASSERT(filled_ <= until);
  HAIRNET_ASSERT(until <= packet_bytes_max_);
  const std::size_t taken = std::min(bytes.size(), until - filled_);
  const std::size_t words = words_for(filled_ + taken);
  if (words > buffer_.size()) {
    // Doubles, so that a packet that arrives slowly is not copied again and again. It grows by received bytes, not by
    // the announced size, and never past the limit.
    buffer_.reserve(std::min(std::max(words, 2 * buffer_.size()), words_for(packet_bytes_max_)));
    buffer_.resize(words);
  }
  if (taken != 0) std::memcpy(reinterpret_cast<std::uint8_t*>(buffer_.data()) + filled_, bytes.data(), taken);
  filled_ += taken;
  HAIRNET_ASSERT(filled_ <= buffer_.size() * sizeof(std::uint64_t));
  return bytes.subspan(taken);
}

const std::uint8_t* PacketSplitter::data() const {
  return reinterpret_cast<const std::uint8_t*>(buffer_.data());
}

void PacketSplitter::check_invariants() const {
  // A whole packet is passed on at once, so the buffer never holds one between calls.
  HAIRNET_ASSERT(filled_ < packet_bytes_max_);
  HAIRNET_ASSERT(capacity_bytes() <= packet_bytes_max_ + sizeof(std::uint64_t));
  if (dead_) HAIRNET_ASSERT(buffer_.empty() && filled_ == 0);
}

void PacketSplitter::kill() {
  dead_ = true;
  filled_ = 0;
  buffer_ = std::vector<std::uint64_t>();
}

}  // namespace hairnet::channel
