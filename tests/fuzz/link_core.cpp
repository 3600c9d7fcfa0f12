#include "client/link/link_core.hpp"

#include <algorithm>
#include <cmath>
#include <limits>

#include "tests/fuzz/link_prologue.hpp"
#include "tests/fuzz/target.hpp"

// For any packets of a server, a client's core does not crash, sends only valid packets, reports only valid frames, and
// reports nothing after the end. The first byte sets the length of the pieces of the stream, whether a valid prologue
// comes first, and whether the session resumes after the connection was lost.
namespace hairnet::fuzz {
namespace {

class Client {
 public:
  // The bits of `byte`: 0 to 2 are the length of the pieces, 16 bytes to 2 KiB; bit 3 is the prologue; bit 4 resumes.
  // The client has a groom to upload, a character to add and a groom to fetch (hash 9), so that any answer of the
  // server meets a request.
  explicit Client(std::uint8_t byte)
      : piece_bytes_(std::size_t{16} << (byte & 7)), prologue_((byte & 8) != 0), resumed_((byte & 16) != 0), core_({}) {
    core_.offer_groom(link_groom(), std::make_shared<const std::vector<std::uint8_t>>(200'000));
    core_.send(wire::AddCharacter{kOwnCharacter, link_groom(), LevelIndex::high});
    core_.send(wire::SetAppearance{kOwnCharacter, "Ben", wire::Appearance{}});
    core_.request_groom({9});
    core_.start();
  }

  void hear(std::span<const std::uint8_t> stream) {
    for (std::size_t at = 0; at < stream.size(); at += piece_bytes_) {
      connect();
      core_.on_bytes(stream.subspan(at, std::min(piece_bytes_, stream.size() - at)), now_ns_);
      settle();
    }
    constexpr std::int64_t kLongAfter_ns = 60'000'000'000;
    now_ns_ += kLongAfter_ns;
    settle();
    core_.leave(now_ns_);
    settle();
  }

 private:
  void connect() {
    if (!core_.wants_connection()) return;
    ++sessions_;
    core_.on_opening(now_ns_);
    core_.on_open(now_ns_);
    if (!prologue_) return;
    for (wire::Message& message : link_prologue(7, resumed_ && sessions_ > 1))
      core_.on_bytes(wire::encode_packet({now_ns_, std::move(message)}), now_ns_);
    settle();
  }

  // What a driver does after each event; time advances.
  void settle() {
    now_ns_ += 1'000'000;
    core_.poll(now_ns_);
    for (std::vector<std::uint8_t> packet; !(packet = core_.take_packet(now_ns_)).empty();)
      require(wire::decode_packet(packet).error == wire::DecodeError::none, "says only valid packets");
    for (const link::Event& event : core_.take_events()) {
      require(!announced_end_, "tells nothing after the end");
      announced_end_ = std::holds_alternative<link::Disconnected>(event);
      if (const auto* frames = std::get_if<link::FrameBatch>(&event)) std::ranges::for_each(frames->frames, check);
    }
    require(announced_end_ == core_.ended(), "tells of the end");
    if (!core_.wants_close()) return;
    core_.on_closed("", now_ns_);
    const std::int64_t deadline_ns = core_.next_deadline_ns();
    if (deadline_ns == std::numeric_limits<std::int64_t>::max()) return;
    now_ns_ = std::max(now_ns_, deadline_ns);
    core_.poll(now_ns_);
  }

  static void check(const link::Frame& frame) {
    const std::size_t most = frame.basis ? frame.basis->code.mode_count() : 0;
    require(frame.coefficients.size() <= most, "no more coefficients than modes");
    require(std::ranges::all_of(frame.coefficients, [](float c) { return std::isfinite(c); }), "finite coefficients");
    require(is_valid(frame.pose), "a pose that is valid");
  }

  const std::size_t piece_bytes_;
  const bool prologue_, resumed_;
  link::LinkCore core_;
  std::int64_t now_ns_ = 1'000'000'000;
  int sessions_ = 0;
  bool announced_end_ = false;
};

}  // namespace
}  // namespace hairnet::fuzz

int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size) {
  if (size > 0) hairnet::fuzz::Client(data[0]).hear({data + 1, size - 1});
  return 0;
}
