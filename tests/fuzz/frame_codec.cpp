#include "tests/fuzz/frame_codec.hpp"

#include <array>

#include "tests/fuzz/target.hpp"

// A frame decoded from any bytes is valid, and encodes to the same frame again.
namespace hairnet::fuzz {
namespace {

struct Lattice {
  explicit Lattice(bool large) : neighbours(codec_geometry(large)), frames(codec_frames(neighbours.node_count())) {}
  codec::Neighbours neighbours;
  std::vector<codec::FrameIntegers> frames;
};

void decode(std::span<const std::uint8_t> input) {
  static const std::array<Lattice, 2> lattices{Lattice(false), Lattice(true)};
  const CodecSetting setting = codec_setting(input[0]);
  const Lattice& lattice = lattices[setting.large];
  std::array<const codec::FrameIntegers*, codec::kHistoryMax> past;
  for (std::size_t n = 0; n < past.size(); ++n) past[n] = &lattice.frames[n + 1];
  const codec::History history = std::span(past).first(setting.order);

  const std::vector<std::uint8_t> bytes(input.begin() + 1, input.end());
  codec::FrameIntegers got;
  if (setting.ranged) {
    got.nodes.resize(3 * lattice.neighbours.node_count());
    const codec::NodeRange range = codec_range(setting, lattice.neighbours.node_count());
    if (!codec::decode_range(bytes, range, false, history, &lattice.neighbours, setting.velocities, got)) return;
  } else if (!codec::decode_frame(bytes, history, &lattice.neighbours, setting.velocities, got)) {
    return;
  }
  require(got.nodes.size() == 3 * lattice.neighbours.node_count(), "as many nodes as the level has");
  require(got.velocities.size() == (setting.velocities ? got.nodes.size() : 0), "velocities when they were asked for");
  require(is_valid(codec::dequantise_pose(got)) || setting.ranged, "a pose that is valid");
  std::vector<std::uint8_t> encoded;
  codec::encode_frame(got, history, &lattice.neighbours, encoded);
  codec::FrameIntegers again;
  require(codec::decode_frame(encoded, history, &lattice.neighbours, setting.velocities, again), "decodes again");
  require(again.bones == got.bones && again.nodes == got.nodes && again.velocities == got.velocities, "the same again");
}

}  // namespace
}  // namespace hairnet::fuzz

int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size) {
  if (size > 0) hairnet::fuzz::decode({data, size});
  return 0;
}
