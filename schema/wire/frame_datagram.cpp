#include "schema/wire/frame_datagram.hpp"

#include <algorithm>
#include <array>

#include "core/assert.hpp"
#include "schema/wire/message_codec.hpp"
#include "schema/wire/packed_frame.hpp"

namespace hairnet::wire {
namespace {

// The layout of frame_datagram.hpp: where each field begins, and how many bytes it has.
constexpr std::array<std::uint8_t, 2> kMark{'F', 'B'};
constexpr std::size_t kSampleTimeAt = kMark.size(), kSampleTimeBytes = 8;
constexpr std::size_t kClockAt = kSampleTimeAt + kSampleTimeBytes, kClockBytes = 5;
constexpr std::size_t kTickAt = kClockAt + kClockBytes;
// The greatest difference that the signed clock field holds.
constexpr std::int64_t kClockMax_ns = (std::int64_t{1} << (8 * kClockBytes - 1)) - 1;

// Writes the low bytes of a signed integer, little endian; read_integer() reverses it.
void write_integer(std::int64_t value, std::span<std::uint8_t> to) {
  for (std::size_t i = 0; i < to.size(); ++i) to[i] = static_cast<std::uint8_t>(value >> (8 * i));
}

std::int64_t read_integer(std::span<const std::uint8_t> from) {
  std::uint64_t bits = 0;
  for (std::size_t i = 0; i < from.size(); ++i) bits |= std::uint64_t{from[i]} << (8 * i);
  const std::size_t above = 64 - 8 * from.size();
  // The shift to the right of a signed number extends the sign.
  return static_cast<std::int64_t>(bits << above) >> above;
}

DecodedPacket refused_datagram(DecodeError error, std::string detail) {
  return {error, std::move(detail), {}};
}

std::string read_frames(Unpacker& packed, FrameBatch& out) {
  std::uint32_t member = 0;
  do {
    if (!packed.take(out.generations.emplace_back())) return "frame batch: no frame";
    if (std::string error = read_frame(packed, member, out.frames.emplace_back()); !error.empty()) return error;
    member = out.frames.back().member;
  } while (!packed.empty());
  return {};
}

}  // namespace

std::size_t frame_datagram_head_bytes(std::uint64_t tick) {
  return kTickAt + varint_bytes(tick);
}

std::vector<std::uint8_t> encode_frame_datagram(std::int64_t clock_ns, const FrameBatch& batch) {
  HAIRNET_ASSERT(!batch.frames.empty());
  HAIRNET_ASSERT(batch.generations.size() == batch.frames.size());
  std::size_t byte_count = frame_datagram_head_bytes(batch.tick);
  std::uint32_t member = 0;
  for (const Frame& frame : batch.frames) {
    byte_count += 1 + packed_bytes(frame, member);
    member = frame.member;
  }
  // The size is exact, so nothing is written for a batch that does not fit.
  if (byte_count > kDatagramBytesMax) return {};
  std::vector<std::uint8_t> bytes(byte_count);
  std::ranges::copy(kMark, bytes.begin());
  write_integer(batch.sample_time_ns, std::span(bytes).subspan(kSampleTimeAt, kSampleTimeBytes));
  set_frame_datagram_clock(bytes, clock_ns);
  std::uint8_t* at = write_varint(batch.tick, bytes.data() + kTickAt);
  member = 0;
  for (std::size_t i = 0; i < batch.frames.size(); ++i) {
    *at++ = batch.generations[i];
    at = write_frame(batch.frames[i], member, at);
    member = batch.frames[i].member;
  }
  HAIRNET_ASSERT(at == bytes.data() + bytes.size());
  return bytes;
}

bool is_frame_datagram(std::span<const std::uint8_t> bytes) {
  // A packet begins with its size. A packet whose size began with the mark would be larger than any datagram, so the
  // first two bytes decide.
  static_assert(kDatagramBytesMax < sizeof(std::uint32_t) + (kMark[0] | kMark[1] << 8));
  return bytes.size() >= kMark.size() && bytes.size() <= kDatagramBytesMax &&
         std::ranges::equal(kMark, bytes.first(kMark.size()));
}

void set_frame_datagram_clock(std::span<std::uint8_t> bytes, std::int64_t clock_ns) {
  HAIRNET_ASSERT(bytes.size() > kTickAt);
  const std::int64_t since_sample_ns = clock_ns - read_integer(bytes.subspan(kSampleTimeAt, kSampleTimeBytes));
  // The clock is relative to the sample time, as five bytes hold nine minutes. A datagram that waited longer has the
  // nearest time, which the receiver's minimum over many passes over.
  write_integer(std::clamp(since_sample_ns, -kClockMax_ns - 1, kClockMax_ns), bytes.subspan(kClockAt, kClockBytes));
}

DecodedPacket decode_frame_datagram(std::span<const std::uint8_t> bytes) {
  HAIRNET_ASSERT(is_frame_datagram(bytes));
  if (bytes.size() <= kTickAt) return refused_datagram(DecodeError::malformed, "frame datagram: ends within its head");
  DecodedPacket decoded;
  FrameBatch& batch = decoded.envelope.message.emplace<FrameBatch>();
  const std::int64_t sample_time_ns = read_integer(bytes.subspan(kSampleTimeAt, kSampleTimeBytes));
  std::string error = read_time(sample_time_ns, "frames' sample time", batch.sample_time_ns);
  if (error.empty()) {
    // The sum cannot overflow: the sample time is within 2^61 by now, and the difference within 2^39.
    const std::int64_t clock_ns = sample_time_ns + read_integer(bytes.subspan(kClockAt, kClockBytes));
    error = read_time(clock_ns, "frame datagram's clock", decoded.envelope.clock_ns);
  }
  if (!error.empty()) return refused_datagram(DecodeError::invalid, std::move(error));
  // One copy holds the contents of all frames. The batch owns it, and the frames' spans point into it.
  auto storage = std::make_shared<const std::vector<std::uint8_t>>(bytes.begin() + kTickAt, bytes.end());
  Unpacker packed(*storage);
  if (!packed.take_varint(batch.tick))
    return refused_datagram(DecodeError::malformed, "frame datagram: ends within its head");
  error = read_frames(packed, batch);
  batch.storage = std::move(storage);
  return error.empty() ? std::move(decoded) : refused_datagram(DecodeError::invalid, std::move(error));
}

}  // namespace hairnet::wire
