#include "client/link/webtransport/http3_session.hpp"

#include <vector>

#include "tests/fuzz/stream_steps.hpp"
#include "tests/support/http3_client_owner.hpp"

namespace {

using namespace hairnet;

// Three bits of the head choose the kind, and the other five are the stream.
fuzz::StreamStep read_head(std::uint8_t head) {
  return {(head & 7u) % fuzz::kCommonSteps, head >> 3, {}};
}

// Feeds the steps to a new session, `piece_bytes` bytes of a stream at a time.
void run(const std::vector<fuzz::StreamStep>& steps, std::size_t piece_bytes, link::RecordingHttp3Owner& owner) {
  link::Http3Session session(owner, "localhost:7420", "/wt");
  session.start();
  fuzz::EndedStreams ended;
  for (const fuzz::StreamStep& step : steps) {
    const std::size_t calls = owner.calls;
    const bool had_failed = owner.failure.has_value();
    fuzz::take_common_step(session, step, piece_bytes, ended);
    fuzz::require(!had_failed || owner.calls == calls, "nothing follows a failure");
    fuzz::require(owner.failures <= 1 && owner.channels <= 1 && owner.ends <= 1, "one failure, one channel, one end");
    fuzz::require((session.channel() >= 0) == (owner.channels == 1), "a channel is told");
  }
}

}  // namespace

// However the bytes of a server's streams are cut, the same happens, and nothing follows a failure.
int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size) {
  const auto steps = fuzz::read_stream_steps({data, size}, read_head);
  link::RecordingHttp3Owner whole, single;
  run(steps, size + 1, whole);
  run(steps, 1, single);
  fuzz::require(whole.failure == single.failure && whole.error == single.error, "the same failure");
  fuzz::require(whole.received == single.received && whole.datagrams == single.datagrams, "the same bytes");
  fuzz::require(whole.downloads == single.downloads && whole.downloads_ended == single.downloads_ended &&
                    whole.downloads_reset == single.downloads_reset,
                "the same downloads");
  fuzz::require(whole.sent == single.sent && whole.stopped == single.stopped, "the same answers");
  return 0;
}
