#include "tests/load/preparation.hpp"

#include <utility>

namespace hairnet::load {
namespace {

constexpr std::int64_t kKeepAlive_ns = 10'000'000'000;

}  // namespace

Preparation::Preparation(Dialler& dialler, std::unique_ptr<Peer> peer, const std::vector<EncodedGroom>& grooms)
    : peer_(std::move(peer)), grooms_(&grooms) {
  for (const EncodedGroom& groom : grooms) waiting_.insert(groom.hash);
  line_ = dialler.dial(*this);
}

void Preparation::on_open(std::int64_t now_ns) {
  open_ = true;
  peer_->open(now_ns);
  flush();
}

void Preparation::on_packet(std::span<const std::uint8_t> packet, std::int64_t arrival_ns) {
  if (!peer_->on_packet(packet, arrival_ns, *this)) fault_ = "the server sent a packet that is none";
  flush();
}

void Preparation::on_welcome(const wire::Welcome& welcome, std::int64_t now_ns) {
  welcomed_ = true;
  welcome_ = welcome;
  for (const EncodedGroom& groom : *grooms_) peer_->offer(groom, now_ns);
  said_ns_ = now_ns;
}

void Preparation::on_groom_state(const wire::GroomHash& groom, wire::GroomState state) {
  if (state == wire::GroomState::ready) waiting_.erase(groom);
  if (state != wire::GroomState::refused) return;
  fault_ = "the server refuses a groom: " + last_word_;
  for (const EncodedGroom& known : *grooms_)
    if (known.hash == groom) fault_ = "the server refuses the groom " + known.spec + ": " + last_word_;
}

void Preparation::on_refusal(std::string_view reason, std::uint32_t) {
  last_word_ = reason;
  if (!welcomed_) fault_ = "the server refuses: " + last_word_;
}

void Preparation::on_goodbye(std::string_view reason) {
  fault_ = "the server says goodbye: " + std::string(reason);
}

void Preparation::on_closed(std::string_view reason, std::int64_t) {
  if (fault_.empty())
    fault_ = open_ ? "the connection was closed: " + std::string(reason) : "cannot connect: " + std::string(reason);
}

void Preparation::keep_alive(std::int64_t now_ns) {
  if (!welcomed_ || now_ns - said_ns_ < kKeepAlive_ns) return;
  said_ns_ = now_ns;
  peer_->push_poses({}, now_ns);
  flush();
}

void Preparation::flush() {
  for (;;) {
    const std::vector<std::uint8_t> packet = peer_->take_packet();
    if (packet.empty()) return;
    line_->send(packet);
  }
}

}  // namespace hairnet::load
