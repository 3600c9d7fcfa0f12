#pragma once

#include <memory>

#include "fake_connection.hpp"
#include "server/app/server.hpp"

namespace hairnet::server {

// A client without a socket: what it says reaches its session at once.
class FakeClient {
 public:
  FakeClient(Server& server, std::int64_t now_ns, std::int64_t clock_offset_ns = 0)
      : connection(std::make_shared<FakeConnection>()),
        clock_offset_ns_(clock_offset_ns),
        sink_(server.open(connection, now_ns)) {}

  void say(const wire::Message& message, std::int64_t now_ns) {
    if (sink_ && !connection->closed)
      sink_->on_packet(wire::encode_packet({now_ns + clock_offset_ns_, message}), now_ns);
  }
  void hello(std::int64_t now_ns) { say(wire::Hello{wire::kProtocolVersion, "fake"}, now_ns); }
  void upload(const std::vector<std::uint8_t>& bytes, const wire::GroomHash& hash, std::int64_t now_ns) {
    say(wire::GroomOffer{hash, bytes.size()}, now_ns);
    const auto needs = connection->all<wire::GroomNeed>();
    for (std::size_t at = needs.empty() ? bytes.size() : needs.back().offset; at < bytes.size();) {
      const std::size_t count = std::min<std::size_t>(wire::kGroomChunkBytesMax, bytes.size() - at);
      say(wire::GroomChunk{hash, at, {bytes.data() + at, bytes.data() + at + count}}, now_ns);
      at += count;
    }
  }
  void pose(std::uint32_t character, const Pose& pose, std::int64_t now_ns, bool teleport = false) {
    say(wire::PoseBatch{{{character, ++sequence_, now_ns + clock_offset_ns_, teleport, pose}}}, now_ns);
  }
  [[nodiscard]] std::vector<wire::Frame> frames(std::uint32_t character) const {
    std::vector<wire::Frame> found;
    for (const wire::FrameBatch& batch : connection->all<wire::FrameBatch>()) {
      for (const wire::Frame& frame : batch.frames) {
        if (frame.character == character) found.push_back(frame);
      }
    }
    return found;
  }
  [[nodiscard]] std::vector<wire::ErrorReason> errors() const {
    std::vector<wire::ErrorReason> reasons;
    for (const wire::Error& error : connection->all<wire::Error>()) reasons.push_back(error.reason);
    return reasons;
  }

  std::shared_ptr<FakeConnection> connection;

 private:
  std::int64_t clock_offset_ns_;
  PacketSink* sink_;
  std::uint32_t sequence_ = 0;
};

}  // namespace hairnet::server
