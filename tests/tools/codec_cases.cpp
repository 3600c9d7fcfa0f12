#include "tests/tools/codec_cases.hpp"

#include <algorithm>
#include <optional>
#include <string>
#include <vector>

#include "tests/tools/hex.hpp"

namespace hairnet::codec {
namespace {

using Json = nlohmann::ordered_json;

Json case_of(const std::string& name, const LevelGeometry* geometry, const FrameIntegers& frame, History history) {
  std::optional<Neighbours> neighbours;
  if (geometry) neighbours.emplace(*geometry);
  std::vector<std::uint8_t> bytes;
  encode_frame(frame, history, neighbours ? &*neighbours : nullptr, bytes);
  Json out{{"name", name}};
  out["dims"] = geometry ? Json(geometry->lattice.dims) : Json(std::array{0, 0, 0});
  out["active_nodes"] = geometry ? Json(geometry->active_nodes) : Json::array();
  out["history"] = Json::array();
  for (const FrameIntegers* earlier : history)
    out["history"].push_back({{"bones", earlier->bones}, {"nodes", earlier->nodes}});
  out["has_velocities"] = !frame.velocities.empty();
  out["content"] = hex(bytes);
  out["bones"] = frame.bones;
  out["nodes"] = frame.nodes;
  out["velocities"] = frame.velocities;
  return out;
}

std::vector<const FrameIntegers*> pointers(const std::vector<FrameIntegers>& frames) {
  std::vector<const FrameIntegers*> out;
  for (const FrameIntegers& frame : frames) out.push_back(&frame);
  return out;
}

// Integers of every size, also such as no solver makes.
void add_random(Json& cases) {
  RandomFrames random(1);
  for (int round = 0; round < 96; ++round) {
    const LevelGeometry geometry = random.geometry();
    const bool rigid = round % 8 == 7;
    const std::size_t count = rigid ? 0 : geometry.active_nodes.size();
    const int bits = 1 + round % 16;
    const FrameIntegers frame = random.frame(count, bits, round % 3 == 0);
    std::vector<FrameIntegers> past;
    for (int n = 0; n < round / 2 % 4; ++n) past.push_back(random.frame(count, bits, false));
    cases.push_back(case_of("random " + std::to_string(round), rigid ? nullptr : &geometry, frame, pointers(past)));
  }
}

void add_moving(Json& cases) {
  const MovingLattice moving = step_made_lattice(LevelIndex::low, 30, 24);
  for (std::size_t c = 0; c < kErrorClassCount; ++c) {
    const std::vector<FrameIntegers> frames = quantised(moving, static_cast<ErrorClass>(c), c == 1);
    for (const std::size_t stride : {1, 2, 4}) {
      for (std::size_t order = 0; order <= kHistoryMax; ++order) {
        std::vector<const FrameIntegers*> history;
        for (std::size_t n = 1; n <= order; ++n) history.push_back(&frames[frames.size() - 1 - n * stride]);
        const std::string name = "lattice, class " + std::to_string(c) + ", stride " + std::to_string(stride);
        cases.push_back(case_of(name, &moving.geometry, frames.back(), history));
      }
    }
  }
}

}  // namespace

nlohmann::ordered_json frame_sequence(const MovingLattice& moving) {
  const std::vector<FrameIntegers> frames = quantised(moving, ErrorClass::quarter_mm, true);
  const Neighbours neighbours(moving.geometry);
  Json out{{"contents", Json::array()}, {"orders", Json::array()}, {"nodes", Json::array()}};
  for (std::size_t tick = 0; tick < frames.size(); ++tick) {
    std::vector<const FrameIntegers*> history;
    for (std::size_t n = 1; n <= std::min(tick, kHistoryMax); ++n) history.push_back(&frames[tick - n]);
    std::vector<std::uint8_t> content;
    encode_frame(frames[tick], history, &neighbours, content);
    out["contents"].push_back(hex(content));
    out["orders"].push_back(history.size());
    out["nodes"].push_back(frames[tick].nodes);
  }
  return out;
}

nlohmann::ordered_json codec_cases() {
  Json cases = Json::array();
  add_random(cases);
  add_moving(cases);
  return cases;
}

}  // namespace hairnet::codec
