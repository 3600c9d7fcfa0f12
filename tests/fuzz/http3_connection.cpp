#include <vector>

#include "schema/http3/field_section.hpp"
#include "server/http3/connection.hpp"
#include "tests/fuzz/stream_steps.hpp"
#include "tests/support/http3_owner.hpp"

namespace {

using namespace hairnet;

// So many different streams fit the four bits that name one.
constexpr std::size_t kStreamsMax = 16;

// These are the steps of a client beside the common ones: the end of a stream that is done, and the end of the session.
enum ClientStep : unsigned { kClosed = fuzz::kCommonSteps, kCloseSession };

// Three bits of the head are the kind, and four choose one of the client's streams 0, 2, 4, 6 and so on. The highest
// bit stands for stream 3, the server's own.
fuzz::StreamStep read_head(std::uint8_t head) {
  return {head & 7u, head & 0x80 ? 3 : 2 * (head >> 3 & 0xf), {}};
}

// Feeds the steps to a new connection, `piece_bytes` bytes of a stream at a time.
void run(const std::vector<fuzz::StreamStep>& steps, std::size_t piece_bytes, http3::RecordingOwner& owner) {
  http3::Connection connection(owner);
  connection.start(3);
  fuzz::EndedStreams ended;
  for (const fuzz::StreamStep& step : steps) {
    const std::size_t calls = owner.calls;
    const bool had_failed = owner.failure.has_value();
    if (step.kind < fuzz::kCommonSteps)
      fuzz::take_common_step(connection, step, piece_bytes, ended);
    else if (step.kind == kClosed && ended[step.stream])
      connection.on_stream_closed(step.stream);
    else if (step.kind == kCloseSession)
      connection.close_session(1, "closed");
    fuzz::require(!had_failed || owner.calls == calls, "nothing follows a failure");
    fuzz::require(owner.failures <= 1 && owner.ends <= 1, "one failure, one end");
    fuzz::require(connection.buffered_bytes() <= 2 * kStreamsMax * http3::kFieldSectionBytesMax, "bounded memory");
    fuzz::require(!connection.channel() || connection.has_session(), "a channel belongs to a session");
  }
}

}  // namespace

// However the bytes of a client's streams are cut, the same happens, nothing follows a failure, and memory is bounded.
int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size) {
  const auto steps = fuzz::read_stream_steps({data, size}, read_head);
  http3::RecordingOwner whole, single;
  run(steps, size + 1, whole);
  run(steps, 1, single);
  fuzz::require(whole.failure == single.failure, "the same failure");
  fuzz::require(whole.received == single.received && whole.datagrams == single.datagrams, "the same bytes");
  fuzz::require(whole.sent == single.sent && whole.ended == single.ended, "the same answers");
  fuzz::require(whole.stopped == single.stopped && whole.resets == single.resets, "the same rejections");
  return 0;
}
