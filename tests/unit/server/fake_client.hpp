#pragma once

#include <gtest/gtest.h>

#include <cmath>
#include <memory>

#include "server/app/server.hpp"
#include "tests/support/frame_reader.hpp"
#include "tests/unit/server/build_quickly.hpp"
#include "tests/unit/server/fake_connection.hpp"

namespace hairnet::server {

// A client without a socket: its messages reach its session at once.
class FakeClient {
 public:
  FakeClient(Server& server, std::int64_t now_ns, std::int64_t clock_offset_ns = 0)
      : connection(std::make_shared<FakeConnection>()),
        clock_offset_ns_(clock_offset_ns),
        sink_(server.open(connection, now_ns)) {}

  void send(const wire::Message& message, std::int64_t now_ns) {
    if (sink_ && !connection->closed)
      sink_->on_packet(wire::encode_packet({now_ns + clock_offset_ns_, message}), now_ns);
  }
  void hello(std::int64_t now_ns, const std::string& room = "") {
    wire::Hello hello;
    hello.client_name = "fake";
    hello.room = room;
    send(hello, now_ns);
  }
  // Resumes the session of a connection that broke.
  void resume(const wire::Welcome& welcome, std::int64_t now_ns) {
    wire::Hello hello;
    hello.session = welcome.session;
    hello.secret = welcome.secret;
    send(hello, now_ns);
  }
  void break_connection(std::int64_t now_ns) {
    connection->closed = true;
    sink_->on_closed("broken", now_ns);
  }
  void upload(const std::vector<std::uint8_t>& bytes, const wire::GroomHash& hash, std::int64_t now_ns) {
    send(wire::GroomOffer{hash, bytes.size()}, now_ns);
    const auto needs = connection->all<wire::GroomNeed>();
    for (std::size_t at = needs.empty() ? bytes.size() : needs.back().offset; at < bytes.size();) {
      const std::size_t count = std::min<std::size_t>(wire::kGroomChunkBytesMax, bytes.size() - at);
      send(wire::GroomChunk{hash, at, {bytes.data() + at, bytes.data() + at + count}}, now_ns);
      at += count;
    }
  }
  void pose(std::uint32_t character, const Pose& pose, std::int64_t now_ns, bool teleport = false) {
    send(wire::PoseBatch{{{character, ++sequence_, now_ns + clock_offset_ns_, teleport, pose}}}, now_ns);
  }
  // A frame as a client decodes it; every frame must be readable.
  struct SeenFrame {
    std::uint64_t tick = 0;
    std::uint32_t member = 0;
    LevelIndex level = LevelIndex::rigid;
    bool discontinuous = false, asleep = false;
    Pose pose;
    // The displacements of the finest level's nodes, in kStep_m; empty when the hair is at rest.
    std::vector<std::int16_t> displacements;
    // The coefficients of the groom's modes, m.
    std::vector<float> coefficients;
    // The hair's RMS distance to that of another frame, m.
    [[nodiscard]] float distance_m(const SeenFrame& other) const {
      float squares = 0;
      for (std::size_t k = 0; k < std::min(coefficients.size(), other.coefficients.size()); ++k)
        squares += std::pow(coefficients[k] - other.coefficients[k], 2.0f);
      return std::sqrt(squares);
    }
  };
  // The unit of `displacements`.
  static constexpr float kStep_m = 0.5e-3f;
  [[nodiscard]] std::vector<SeenFrame> all_frames() const {
    FrameReader reader([](const wire::GroomHash& groom) { return BuiltModes::instance().of(groom); });
    std::vector<SeenFrame> seen;
    std::vector<std::string> errors;
    for (const wire::Envelope& envelope : connection->received) {
      if (const auto* added = std::get_if<wire::CharacterAdded>(&envelope.message)) reader.take(*added);
      if (const auto* joined = std::get_if<wire::MemberJoined>(&envelope.message)) reader.take(*joined);
      if (const auto* basis = std::get_if<wire::GroomBasis>(&envelope.message)) reader.take(*basis);
      const auto* batch = std::get_if<wire::FrameBatch>(&envelope.message);
      if (!batch) continue;
      for (const ReadFrame& read : reader.take(*batch, errors)) {
        const wire::Frame& f = read.frame;
        SeenFrame& one = seen.emplace_back(
            SeenFrame{read.tick, f.member, f.level, f.discontinuous, f.asleep, read.pose, {}, read.coefficients});
        for (const Vec3f& d : read.displacements) {
          for (const float x : d) one.displacements.push_back(static_cast<std::int16_t>(std::lround(x / kStep_m)));
        }
      }
    }
    EXPECT_TRUE(errors.empty()) << errors.size() << " errors, the first: " << errors.front();
    return seen;
  }
  [[nodiscard]] std::vector<SeenFrame> member_frames(std::uint32_t member) const {
    std::vector<SeenFrame> seen = all_frames();
    std::erase_if(seen, [&](const SeenFrame& frame) { return frame.member != member; });
    return seen;
  }
  // The frames of its own character.
  [[nodiscard]] std::vector<SeenFrame> frames(std::uint32_t character) const {
    for (const wire::CharacterAdded& added : connection->all<wire::CharacterAdded>()) {
      if (added.character == character) return member_frames(added.member);
    }
    return {};
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
