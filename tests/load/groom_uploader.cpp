#include "tests/load/groom_uploader.hpp"

#include <utility>

namespace hairnet::load {

GroomUploader::GroomUploader(Connector& connector, std::unique_ptr<ProtocolClient> protocol,
                             const std::vector<EncodedGroom>& grooms, std::uint32_t host)
    : protocol_(std::move(protocol)), grooms_(&grooms), connector_(&connector), host_(host) {
  for (const EncodedGroom& groom : grooms) {
    waiting_.insert(groom.hash);
    protocol_->offer(groom);
  }
}

void GroomUploader::poll(std::int64_t now_ns) {
  protocol_->poll(now_ns);
  protocol_->tell(*this, now_ns);
  // The protocol holds no connection of its own: it only says when it wants one and when it wants it closed.
  if (connection_ && protocol_->wants_close()) {
    connection_.reset();
    protocol_->on_closed(now_ns);
  }
  if (!connection_ && protocol_->wants_connection()) {
    protocol_->on_opening(now_ns);
    connection_ = connector_->connect(*this, host_);
  }
  while (connection_) {
    const std::vector<std::uint8_t> packet = protocol_->take_packet(now_ns);
    if (packet.empty()) return;
    connection_->send(packet);
  }
}

void GroomUploader::on_open(std::int64_t now_ns) {
  // An uploader sends no poses, so it needs no datagrams.
  protocol_->on_open(now_ns, false);
  poll(now_ns);
}

void GroomUploader::on_packet(std::span<const std::uint8_t> packet, std::int64_t arrival_ns) {
  protocol_->on_packet(packet, arrival_ns, *this);
  poll(arrival_ns);
}

void GroomUploader::on_closed(std::string_view reason, std::int64_t now_ns) {
  closed_ = reason;
  connection_.reset();
  protocol_->on_closed(now_ns);
  poll(now_ns);
}

void GroomUploader::on_welcome(const wire::Welcome& welcome, std::int64_t) {
  welcomed_ = true;
  welcome_ = welcome;
}

void GroomUploader::on_groom_state(const wire::GroomHash& groom, wire::GroomState state) {
  if (state == wire::GroomState::ready) waiting_.erase(groom);
  if (state != wire::GroomState::refused) return;
  for (const EncodedGroom& known : *grooms_)
    if (known.hash == groom) error_ = "the server refuses the groom " + known.spec + ": " + last_word_;
}

void GroomUploader::on_refusal(std::string_view reason, std::int64_t) {
  // The text of the server's refusal, for the messages of on_groom_state() and on_end(), which get no such text.
  last_word_ = reason;
}

void GroomUploader::on_lost(std::string_view reason, std::int64_t) {
  if (!done()) error_ = "the server closed the connection: " + (reason.empty() ? closed_ : std::string(reason));
}

void GroomUploader::on_end(std::string_view reason, std::int64_t) {
  if (!error_.empty()) return;
  error_ = reason.empty() ? "cannot talk to the server: " + (closed_.empty() ? "no welcome" : closed_)
                          : "the server says goodbye: " + std::string(reason);
  if (!last_word_.empty()) error_ += ", " + last_word_;
}

}  // namespace hairnet::load
