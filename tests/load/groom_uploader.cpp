#include "tests/load/groom_uploader.hpp"

#include <utility>

namespace hairnet::load {

Preparation::Preparation(Dialler& dialler, std::unique_ptr<Peer> peer, const std::vector<EncodedGroom>& grooms)
    : peer_(std::move(peer)), grooms_(&grooms), dialler_(&dialler) {
  for (const EncodedGroom& groom : grooms) {
    waiting_.insert(groom.hash);
    peer_->offer(groom);
  }
}

void Preparation::poll(std::int64_t now_ns) {
  peer_->poll(now_ns);
  peer_->tell(*this, now_ns);
  if (line_ && peer_->wants_close()) {
    line_.reset();
    peer_->on_closed(now_ns);
  }
  if (!line_ && peer_->wants_connection()) {
    peer_->on_opening(now_ns);
    line_ = dialler_->dial(*this);
  }
  while (line_) {
    const std::vector<std::uint8_t> packet = peer_->take_packet(now_ns);
    if (packet.empty()) return;
    line_->send(packet);
  }
}

void Preparation::on_open(std::int64_t now_ns) {
  peer_->on_open(now_ns);
  poll(now_ns);
}

void Preparation::on_packet(std::span<const std::uint8_t> packet, std::int64_t arrival_ns) {
  peer_->on_packet(packet, arrival_ns, *this);
  poll(arrival_ns);
}

void Preparation::on_closed(std::string_view reason, std::int64_t now_ns) {
  closed_ = reason;
  line_.reset();
  peer_->on_closed(now_ns);
  poll(now_ns);
}

void Preparation::on_welcome(const wire::Welcome& welcome, std::int64_t) {
  welcomed_ = true;
  welcome_ = welcome;
}

void Preparation::on_groom_state(const wire::GroomHash& groom, wire::GroomState state) {
  if (state == wire::GroomState::ready) waiting_.erase(groom);
  if (state != wire::GroomState::refused) return;
  for (const EncodedGroom& known : *grooms_)
    if (known.hash == groom) fault_ = "the server refuses the groom " + known.spec + ": " + last_word_;
}

void Preparation::on_refusal(std::string_view reason, std::int64_t) {
  last_word_ = reason;
}

void Preparation::on_lost(std::string_view reason, std::int64_t) {
  if (!done()) fault_ = "the server let go of us: " + (reason.empty() ? closed_ : std::string(reason));
}

void Preparation::on_end(std::string_view reason, std::int64_t) {
  if (!fault_.empty()) return;
  fault_ = reason.empty() ? "cannot talk to the server: " + (closed_.empty() ? "no welcome" : closed_)
                          : "the server says goodbye: " + std::string(reason);
  if (!last_word_.empty()) fault_ += ", " + last_word_;
}

}  // namespace hairnet::load
