#pragma once

#include <deque>
#include <map>
#include <memory>
#include <string>

#include "schema/channel/clock_estimate.hpp"
#include "tests/load/peer.hpp"

namespace hairnet::load {

// The protocol by schema/wire and nothing else: no retries, no play-out. One connection.
class WirePeer : public Peer {
 public:
  explicit WirePeer(std::string client_name) : client_name_(std::move(client_name)) {}

  void open(std::int64_t now_ns) override;
  [[nodiscard]] bool on_packet(std::span<const std::uint8_t> packet, std::int64_t now_ns, PeerEvents& events) override;
  void offer(const EncodedGroom& groom, std::int64_t now_ns) override;
  void add_character(std::uint32_t character, const wire::GroomHash& groom, LevelIndex level,
                     std::int64_t now_ns) override;
  void remove_character(std::uint32_t character, std::int64_t now_ns) override;
  void push_poses(std::vector<wire::PoseSample> poses, std::int64_t now_ns) override;
  void say_goodbye(std::int64_t now_ns) override;
  [[nodiscard]] std::vector<std::uint8_t> take_packet() override;

 private:
  void say(wire::Message message, std::int64_t now_ns);
  void send_groom(const wire::GroomNeed& need, std::int64_t now_ns);
  void report(const wire::FrameBatch& batch, std::int64_t clock_ns, std::int64_t now_ns, PeerEvents& events) const;

  std::string client_name_;
  channel::ClockEstimate clock_;
  std::map<wire::GroomHash, std::shared_ptr<const std::vector<std::uint8_t>>> offered_;
  std::deque<std::vector<std::uint8_t>> packets_;
};

}  // namespace hairnet::load
