#include <algorithm>
#include <map>
#include <vector>

#include "schema/http3/field_section.hpp"
#include "server/http3/connection.hpp"
#include "tests/fuzz/target.hpp"
#include "tests/support/http3_owner.hpp"

namespace {

using namespace hairnet;

constexpr std::size_t kStreamsMax = 16;

// One thing that a client does: the kind and the stream are in the first byte, the number of bytes in the second.
struct Step {
  enum class Kind : std::uint8_t { bytes, last_bytes, reset, stop, datagram, closed, close_session, other };
  Kind kind = Kind::bytes;
  http3::StreamId stream = 0;
  std::span<const std::uint8_t> bytes;
};

std::vector<Step> read_steps(std::span<const std::uint8_t> input) {
  std::vector<Step> steps;
  while (input.size() >= 2) {
    const std::size_t count = std::min<std::size_t>(input[1], input.size() - 2);
    // Streams of both directions: 0, 2, 4, 6, ... and the server's own 3.
    const int number = input[0] >> 3 & 0xf;
    steps.push_back({static_cast<Step::Kind>(input[0] & 7), input[0] & 0x80 ? 3 : 2 * number, input.subspan(2, count)});
    input = input.subspan(2 + count);
  }
  return steps;
}

// `piece_bytes`: how many bytes of a stream come at a time.
void run(const std::vector<Step>& steps, std::size_t piece_bytes, http3::RecordingOwner& owner) {
  http3::Connection connection(owner);
  connection.start(3);
  std::map<http3::StreamId, bool> done;  // a QUIC connection passes nothing on behind the end of a stream
  for (const Step& step : steps) {
    const std::size_t calls = owner.calls;
    const bool had_failed = owner.failure.has_value();
    switch (step.kind) {
      case Step::Kind::bytes:
      case Step::Kind::last_bytes: {
        if (done[step.stream]) break;
        const bool is_last = step.kind == Step::Kind::last_bytes;
        std::span<const std::uint8_t> left = step.bytes;
        while (left.size() > piece_bytes) {
          connection.on_bytes(step.stream, left.first(piece_bytes), false);
          left = left.subspan(piece_bytes);
        }
        connection.on_bytes(step.stream, left, is_last);
        done[step.stream] = is_last;
        break;
      }
      case Step::Kind::reset:
        if (!std::exchange(done[step.stream], true)) connection.on_reset(step.stream);
        break;
      case Step::Kind::stop:
        connection.on_stop(step.stream);
        break;
      case Step::Kind::datagram:
        connection.on_datagram(step.bytes);
        break;
      case Step::Kind::closed:
        if (done[step.stream]) connection.on_stream_closed(step.stream);
        break;
      case Step::Kind::close_session:
        connection.close_session(1, "closed");
        break;
      case Step::Kind::other:
        break;
    }
    fuzz::require(!had_failed || owner.calls == calls, "nothing follows a failure");
    fuzz::require(owner.failures <= 1 && owner.ends <= 1, "one failure, one end");
    fuzz::require(connection.buffered_bytes() <= 2 * kStreamsMax * http3::kFieldSectionBytesMax, "bounded memory");
    fuzz::require(!connection.channel() || connection.has_session(), "a channel belongs to a session");
  }
}

}  // namespace

// However the bytes of a client's streams are cut, the same happens, nothing follows a failure, and memory is bounded.
int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size) {
  const std::vector<Step> steps = read_steps({data, size});
  http3::RecordingOwner whole, single;
  run(steps, size + 1, whole);
  run(steps, 1, single);
  fuzz::require(whole.failure == single.failure, "the same failure");
  fuzz::require(whole.received == single.received && whole.datagrams == single.datagrams, "the same bytes");
  fuzz::require(whole.sent == single.sent && whole.ended == single.ended, "the same answers");
  fuzz::require(whole.stopped == single.stopped && whole.resets == single.resets, "the same rejections");
  return 0;
}
