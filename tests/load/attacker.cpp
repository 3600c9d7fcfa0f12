#include "tests/load/attacker.hpp"

#include <utility>

namespace hairnet::load {
namespace {

// Every answer to an attacker is shorter; longer packets are not decoded.
constexpr std::size_t kDecodedBytesMax = 2048;

}  // namespace

std::optional<std::int64_t> Rate::take(std::int64_t now_ns) {
  const auto now = static_cast<double>(now_ns);
  if (interval_ns_ == 0) return std::nullopt;
  if (now - next_ns_ > 1e9) next_ns_ = now;
  if (next_ns_ > now) return std::nullopt;
  return static_cast<std::int64_t>(std::exchange(next_ns_, next_ns_ + interval_ns_));
}

Attacker::Attacker(const AttackContext& context, std::uint32_t host, std::int64_t redial_ns)
    : context_(&context), host_(host), redial_ns_(redial_ns) {}

void Attacker::act(std::int64_t now_ns) {
  if (!connection_ && now_ns >= connect_ns_) {
    count("connections");
    connection_ = context_->connector->connect(*this, host_);
  }
  if (open_) proceed(now_ns);
}

void Attacker::on_open(std::int64_t now_ns) {
  open_ = true;
  begin(now_ns);
}

void Attacker::on_packet(std::span<const std::uint8_t> packet, std::int64_t arrival_ns) {
  if (packet.size() > kDecodedBytesMax) return;
  const wire::DecodedPacket decoded = wire::decode_packet(packet);
  if (decoded.error != wire::DecodeError::none) return;
  const wire::Message& message = decoded.envelope.message;
  if (const auto* goodbye = std::get_if<wire::Goodbye>(&message))
    count("goodbye_" + std::string(wire::to_string(goodbye->reason)));
  if (const auto* error = std::get_if<wire::Error>(&message))
    count("error_" + std::string(wire::to_string(error->reason)));
  hear(message, arrival_ns);
}

void Attacker::on_closed(std::string_view reason, std::int64_t now_ns) {
  count("closed_" + std::string(reason));
  close(now_ns);
}

void Attacker::hear(const wire::Message&, std::int64_t) {}

void Attacker::send(wire::Message message, std::int64_t now_ns) {
  connection_->send(wire::encode_packet({now_ns, std::move(message)}));
}

void Attacker::close(std::int64_t now_ns) {
  connection_.reset();
  open_ = false;
  connect_ns_ = now_ns + redial_ns_;
}

void Attacker::count(std::string_view event, std::uint64_t by) {
  const auto known = context_->events->find(event);
  if (known == context_->events->end())
    context_->events->emplace(event, by);
  else
    known->second += by;
}

}  // namespace hairnet::load
