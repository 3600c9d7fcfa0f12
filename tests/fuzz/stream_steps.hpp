#pragma once

#include <algorithm>
#include <cstdint>
#include <map>
#include <span>
#include <utility>
#include <vector>

#include "tests/fuzz/target.hpp"

// Reads random bytes as steps of the other end of an HTTP/3 connection.
namespace hairnet::fuzz {

struct StreamStep {
  // One of the target's kinds, which begin with the common ones.
  unsigned kind = 0;
  std::int64_t stream = 0;  // QUIC's number
  std::span<const std::uint8_t> bytes;
};
// The common kinds are bytes of a stream, its last bytes, its reset, the request to stop sending there, and a datagram.
enum CommonStep : unsigned { kBytes, kLastBytes, kReset, kStop, kDatagram, kCommonSteps };

// Each step has a head byte, from which `read_head` takes the kind and the stream, and then the number of bytes that
// follow.
inline std::vector<StreamStep> read_stream_steps(std::span<const std::uint8_t> input,
                                                 StreamStep (*read_head)(std::uint8_t)) {
  std::vector<StreamStep> steps;
  while (input.size() >= 2) {
    const std::size_t count = std::min<std::size_t>(input[1], input.size() - 2);
    StreamStep step = read_head(input[0]);
    step.bytes = input.subspan(2, count);
    steps.push_back(step);
    input = input.subspan(2 + count);
  }
  return steps;
}

// The streams that have ended. QUIC passes nothing on behind the end of a stream, so the fuzzer must not either.
using EndedStreams = std::map<std::int64_t, bool>;

// Does a common step. `piece_bytes`: how many bytes of a stream come at a time.
template <class End>
void take_common_step(End& end, const StreamStep& step, std::size_t piece_bytes, EndedStreams& ended) {
  bool& is_ended = ended[step.stream];
  if (step.kind == kStop) return end.on_stop(step.stream);
  if (step.kind == kDatagram) return static_cast<void>(end.on_datagram(step.bytes));
  if (is_ended) return;
  is_ended = step.kind != kBytes;
  if (step.kind == kReset) return end.on_reset(step.stream);
  std::span<const std::uint8_t> left = step.bytes;
  for (; left.size() > piece_bytes; left = left.subspan(piece_bytes))
    end.on_bytes(step.stream, left.first(piece_bytes), false);
  end.on_bytes(step.stream, left, is_ended);
}

}  // namespace hairnet::fuzz
