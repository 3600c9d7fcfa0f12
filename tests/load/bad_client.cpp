#include "tests/load/bad_client.hpp"

#include <algorithm>
#include <limits>
#include <utility>

namespace hairnet::load {
namespace {

// A client that the server has disconnected connects again after this time.
constexpr std::int64_t kRedialWait_ns = 1'000'000'000;
// A flood is 100 messages every 10 ms. A malformed packet comes every 100 ms.
constexpr std::int64_t kFloodInterval_ns = 10'000'000, kMalformedInterval_ns = 100'000'000;
constexpr int kFloodMessages = 100;
// A flood stops while more bytes than this wait: a server that does not read has defended itself.
constexpr std::size_t kFloodUnsentMax = 64u << 10;

std::vector<std::uint8_t> hello(std::int64_t now_ns) {
  wire::Hello message;
  message.client_name = "hairnet-load bad client";
  return wire::encode_packet({now_ns, std::move(message)});
}

}  // namespace

std::vector<std::uint8_t> make_bad_packet(Random& random, std::int64_t now_ns) {
  wire::PoseSample pose;
  pose.character = 1;
  pose.capture_time_ns = now_ns;
  std::vector<std::uint8_t> packet = wire::encode_packet({now_ns, wire::PoseBatch{{pose}}});
  switch (random.next() % 5) {
    // Up to 8 bits are flipped behind the length.
    case 0: {
      for (int i = 0; i < 8; ++i)
        packet[4 + random.next() % (packet.size() - 4)] ^= static_cast<std::uint8_t>(1u << random.next() % 8);
      return packet;
    }
    // Noise follows the right length.
    case 1: {
      for (std::size_t i = 4; i < packet.size(); ++i) packet[i] = static_cast<std::uint8_t>(random.next());
      return packet;
    }
    // The length is larger than any packet.
    case 2:
      return {0xff, 0xff, 0xff, 0x7f, 0, 0, 0, 0};
    case 3: {
      pose.pose.bones[0].position.x() = std::numeric_limits<double>::quiet_NaN();
      return wire::encode_packet({now_ns, wire::PoseBatch{{pose}}});
    }
    // Only servers send this message.
    default:
      return wire::encode_packet({now_ns, wire::Welcome{}});
  }
}

BadClient::BadClient(const ClientContext& context, std::uint32_t number, Misbehaviour kind)
    : context_(&context), number_(number), kind_(kind), random_(context.seed, number) {}

std::int64_t BadClient::act(std::int64_t now_ns) {
  if (gone_) return kNever_ns;
  if (now_ns >= connect_ns_) {
    connect_ns_ = kNever_ns;
    goodbye_.clear();
    connection_ = context_->connector->connect(*this, context_->host_of(number_));
  }
  if (open_ && now_ns >= next_ns_) misbehave(now_ns);
  return std::min(connect_ns_, next_ns_);
}

void BadClient::on_open(std::int64_t now_ns) {
  open_ = true;
  if (kind_ == Misbehaviour::silent) return;
  const std::vector<std::uint8_t> packet = hello(now_ns);
  if (kind_ == Misbehaviour::half_open) {
    connection_->send(std::span(packet).first(packet.size() / 2));
    connection_->close_sending();
    return;
  }
  connection_->send(packet);
  next_ns_ = now_ns + kMalformedInterval_ns;
  context_->wake(number_, next_ns_);
}

void BadClient::misbehave(std::int64_t now_ns) {
  if (kind_ == Misbehaviour::flood) {
    const std::vector<std::uint8_t> packet = wire::encode_packet({now_ns, wire::PoseBatch{}});
    for (int i = 0; i < kFloodMessages && connection_->unsent_bytes() < kFloodUnsentMax; ++i) connection_->send(packet);
    next_ns_ = now_ns + kFloodInterval_ns;
  } else {
    connection_->send(make_bad_packet(random_, now_ns));
    next_ns_ = now_ns + kMalformedInterval_ns;
  }
}

void BadClient::on_packet(std::span<const std::uint8_t> packet, std::int64_t) {
  const wire::DecodedPacket decoded = wire::decode_packet(packet);
  if (decoded.error != wire::DecodeError::none) return;
  if (const auto* goodbye = std::get_if<wire::Goodbye>(&decoded.envelope.message))
    goodbye_ = wire::to_string(goodbye->reason);
}

void BadClient::on_closed(std::string_view reason, std::int64_t now_ns) {
  if (gone_) return;
  context_->tally->count_bad_client_end(now_ns, kMisbehaviourNames[static_cast<std::size_t>(kind_)],
                                        goodbye_.empty() ? "closed_" + std::string(reason) : "goodbye_" + goodbye_);
  connection_.reset();
  open_ = false;
  next_ns_ = kNever_ns;
  connect_ns_ = now_ns + kRedialWait_ns;
  context_->wake(number_, connect_ns_);
}

void BadClient::leave_now() {
  connection_.reset();
  open_ = false;
  gone_ = true;
}

}  // namespace hairnet::load
