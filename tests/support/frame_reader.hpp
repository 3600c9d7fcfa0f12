#pragma once

#include <cstdint>
#include <map>
#include <optional>
#include <string>
#include <utility>
#include <vector>

#include "schema/codec/frame_codec.hpp"
#include "schema/wire/messages.hpp"

namespace hairnet {

// A frame as a client understands it.
struct ReadFrame {
  std::uint64_t tick = 0;
  std::int64_t sample_time_ns = 0;
  wire::Frame frame;  // its content is gone
  Pose pose;
  codec::FrameIntegers integers;
};

// Reads the frames of one session, in order, straight from PROTOCOL.md: the plain counterpart of what clients do.
// Remembers every frame it was sent.
class FrameReader {
 public:
  void take(const wire::CharacterAdded& added) { grooms_[added.member] = added.groom; }
  void take(const wire::MemberJoined& joined) {
    grooms_[joined.member] = joined.groom;
    sent_.erase(joined.member);
  }
  void take(const wire::LevelRecord& record) {
    neighbours_.insert_or_assign({record.groom, record.level}, codec::Neighbours(record.geometry));
  }
  // The faults of frames that cannot be read go to `faults`.
  std::vector<ReadFrame> take(const wire::FrameBatch& batch, std::vector<std::string>& faults) {
    std::vector<ReadFrame> read;
    for (const wire::Frame& frame : batch.frames) {
      const auto groom = grooms_.find(frame.member);
      if (groom == grooms_.end()) {
        faults.push_back("a frame of an unknown member");
        continue;
      }
      const codec::Neighbours* neighbours = nullptr;
      if (frame.level != LevelIndex::rigid) {
        const auto record = neighbours_.find({groom->second, frame.level});
        if (record == neighbours_.end()) {
          faults.push_back("a frame before its level record");
          continue;
        }
        neighbours = &record->second;
      }
      std::vector<const codec::FrameIntegers*> history;
      for (unsigned k = 1; k <= frame.order; ++k) {
        const auto& sent = sent_[frame.member];
        const auto found = sent.find(batch.tick - k * frame.stride);
        if (found != sent.end()) history.push_back(&found->second);
      }
      ReadFrame& out = read.emplace_back();
      if (history.size() != frame.order ||
          !codec::decode_frame(frame.content, history, neighbours, frame.velocities, out.integers)) {
        faults.push_back(
            "frame of order " + std::to_string(frame.order) + " at tick " + std::to_string(batch.tick) +
            (history.size() != frame.order ? ": what it refers to was not sent" : ": its content is not sound"));
        read.pop_back();
        continue;
      }
      out.tick = batch.tick;
      out.sample_time_ns = batch.sample_time_ns;
      out.frame = frame;
      out.frame.content = {};
      out.pose = codec::dequantise_pose(out.integers);
      sent_[frame.member].insert_or_assign(batch.tick, out.integers);
    }
    return read;
  }

 private:
  std::map<std::uint32_t, wire::GroomHash> grooms_;
  std::map<std::pair<wire::GroomHash, LevelIndex>, codec::Neighbours> neighbours_;
  std::map<std::uint32_t, std::map<std::uint64_t, codec::FrameIntegers>> sent_;
};

}  // namespace hairnet
