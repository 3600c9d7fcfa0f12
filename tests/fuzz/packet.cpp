#include "schema/wire/frame_datagram.hpp"
#include "tests/fuzz/target.hpp"

// A packet or a frame datagram is refused with one line, or its decoded message can be encoded and decoded again.
int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size) {
  using namespace hairnet;
  const std::vector<std::uint8_t> packet(data, data + size);
  const bool is_datagram = wire::is_frame_datagram(packet);
  const wire::DecodedPacket got = is_datagram ? wire::decode_frame_datagram(packet) : wire::decode_packet(packet);
  fuzz::require((got.error == wire::DecodeError::none) == got.detail.empty(), "a refusal has a line");
  if (got.error != wire::DecodeError::none) return 0;
  if (is_datagram) {
    const auto bytes =
        wire::encode_frame_datagram(got.envelope.clock_ns, std::get<wire::FrameBatch>(got.envelope.message));
    fuzz::require(wire::decode_frame_datagram(bytes).error == wire::DecodeError::none, "encoded again it is refused");
    return 0;
  }
  const wire::DecodedPacket again = wire::decode_packet(wire::encode_packet(got.envelope));
  fuzz::require(again.error == wire::DecodeError::none, "encoded again it is refused: " + again.detail);
  return 0;
}
