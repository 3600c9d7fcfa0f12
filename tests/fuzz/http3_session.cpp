#include "client/link/webtransport/http3_session.hpp"

#include <algorithm>
#include <vector>

#include "tests/fuzz/target.hpp"
#include "tests/support/http3_client_owner.hpp"

namespace {

using namespace hairnet;

// One thing that a server does: the kind and the stream are in the first byte, the number of bytes in the second.
struct Step {
  enum class Kind : std::uint8_t { bytes, last_bytes, reset, stop, datagram };
  Kind kind = Kind::bytes;
  link::StreamId stream = 0;
  std::span<const std::uint8_t> bytes;
};

std::vector<Step> read_steps(std::span<const std::uint8_t> input) {
  std::vector<Step> steps;
  while (input.size() >= 2) {
    const std::size_t count = std::min<std::size_t>(input[1], input.size() - 2);
    steps.push_back({static_cast<Step::Kind>((input[0] & 7) % 5), input[0] >> 3, input.subspan(2, count)});
    input = input.subspan(2 + count);
  }
  return steps;
}

// `piece_bytes`: how many bytes of a stream come at a time.
void run(const std::vector<Step>& steps, std::size_t piece_bytes, link::RecordingHttp3Owner& owner) {
  link::Http3Session session(owner, "localhost:7420", "/wt");
  session.start();
  std::map<link::StreamId, bool> done;  // a QUIC connection passes nothing on behind the end of a stream
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
          session.on_bytes(step.stream, left.first(piece_bytes), false);
          left = left.subspan(piece_bytes);
        }
        session.on_bytes(step.stream, left, is_last);
        done[step.stream] = is_last;
        break;
      }
      case Step::Kind::reset:
        if (!std::exchange(done[step.stream], true)) session.on_reset(step.stream);
        break;
      case Step::Kind::stop:
        session.on_stopped(step.stream);
        break;
      case Step::Kind::datagram:
        session.on_datagram(step.bytes);
        break;
    }
    fuzz::require(!had_failed || owner.calls == calls, "nothing follows a failure");
    fuzz::require(owner.failures <= 1 && owner.channels <= 1 && owner.ends <= 1, "one failure, one channel, one end");
    fuzz::require((session.channel() >= 0) == (owner.channels == 1), "a channel is told");
  }
}

}  // namespace

// However the bytes of a server's streams are cut, the same happens, and nothing follows a failure.
int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size) {
  const std::vector<Step> steps = read_steps({data, size});
  link::RecordingHttp3Owner whole, single;
  run(steps, size + 1, whole);
  run(steps, 1, single);
  fuzz::require(whole.failure == single.failure && whole.why == single.why, "the same failure");
  fuzz::require(whole.received == single.received && whole.datagrams == single.datagrams, "the same bytes");
  fuzz::require(whole.sent == single.sent && whole.stopped == single.stopped, "the same answers");
  return 0;
}
