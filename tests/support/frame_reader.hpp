#pragma once

#include <cstdint>
#include <functional>
#include <map>
#include <memory>
#include <optional>
#include <set>
#include <string>
#include <utility>
#include <vector>

#include "core/modes/make_modes.hpp"
#include "schema/codec/frame.hpp"
#include "schema/wire/messages.hpp"

namespace hairnet {

// A frame as a client understands it.
struct ReadFrame {
  std::uint64_t tick = 0;
  std::int64_t sample_time_ns = 0;
  // The frame without its content, whose bytes do not outlive the batch.
  wire::Frame frame;
  Pose pose;
  // In metres; empty means that the hair is at rest, or that the reader does not know the modes.
  std::vector<float> coefficients;
  // The displacements of the finest level's active nodes, m.
  std::vector<Vec3f> displacements;
};

// Reads the frames of one session as schema/PROTOCOL.md describes them. It shares only the codec with the real clients,
// so tests can compare them with it.
class FrameReader {
 public:
  // Returns the modes of a groom, in place of the file of its basis that a client downloads; null when there are none.
  using ModesOf = std::function<std::shared_ptr<const Modes>(const wire::GroomHash&)>;
  explicit FrameReader(ModesOf modes_of = {}) : modes_of_(std::move(modes_of)) {}

  void take(const wire::CharacterAdded& added) { grooms_[added.member] = added.groom; }
  void take(const wire::MemberJoined& joined) { grooms_[joined.member] = joined.groom; }
  void take(const wire::GroomBasis& announced) { announced_.insert(announced.groom); }
  // Returns the frames of a batch. Adds one line to `errors` for each frame that cannot be read.
  std::vector<ReadFrame> take(const wire::FrameBatch& batch, std::vector<std::string>& errors) {
    std::vector<ReadFrame> read;
    for (const wire::Frame& frame : batch.frames) {
      ReadFrame out{batch.tick, batch.sample_time_ns, frame, {}, {}, {}};
      out.frame.content = {};
      const std::string error = read_frame(frame, out);
      if (error.empty())
        read.push_back(std::move(out));
      else
        errors.push_back(error + " at tick " + std::to_string(batch.tick));
    }
    return read;
  }

 private:
  // Returns why the frame cannot be read, or an empty string.
  std::string read_frame(const wire::Frame& frame, ReadFrame& out) {
    const auto groom = grooms_.find(frame.member);
    if (groom == grooms_.end()) return "a frame of an unknown member";
    const bool is_announced = announced_.contains(groom->second);
    if (frame.level != LevelIndex::rigid && !is_announced) return "a frame before its basis";
    const std::shared_ptr<const Modes> modes = is_announced && modes_of_ ? modes_of_(groom->second) : nullptr;
    std::optional<codec::CoefficientCode> code;
    if (modes) code.emplace(modes->basis.deviation_m);
    codec::DecodedFrame decoded;
    if (!codec::decode_frame(frame.content, code ? &*code : nullptr, decoded)) return "a content that is not valid";
    out.pose = decoded.pose;
    if (!modes || frame.level == LevelIndex::rigid) return {};
    out.coefficients = std::move(decoded.coefficients);
    out.displacements.resize(modes->basis.node_count);
    displacements_of(modes->basis, out.coefficients, out.displacements);
    return {};
  }

  ModesOf modes_of_;
  // The groom of each member.
  std::map<std::uint32_t, wire::GroomHash> grooms_;
  // The grooms whose basis the server has announced.
  std::set<wire::GroomHash> announced_;
};

}  // namespace hairnet
