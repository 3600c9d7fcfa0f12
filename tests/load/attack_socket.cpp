#include "tests/load/attack_socket.hpp"

#include <algorithm>
#include <span>
#include <utility>

namespace hairnet::load {
namespace {

constexpr std::int64_t kSocketRedial_ns = 1'000'000'000;
constexpr std::size_t kSocketPieceBytes = 64u << 10;

}  // namespace

AttackSocket::AttackSocket(const AttackContext& context, std::uint32_t host, SocketAttack attack)
    : Attacker(context, host, kSocketRedial_ns), attack_(std::move(attack)) {}

void AttackSocket::begin(std::int64_t now_ns) {
  sent_ = 0;
  end_ns_ = now_ns + static_cast<std::int64_t>(attack_.life_s * 1e9);
  if (!attack_.reads) connection().limit_reading(0);
}

void AttackSocket::proceed(std::int64_t now_ns) {
  if (now_ns >= end_ns_) return close(now_ns);
  if (sent_ == attack_.bytes->size() || connection().unsent_bytes() > 0) return;
  const auto piece = std::span(*attack_.bytes).subspan(sent_);
  const std::size_t size = std::min(piece.size(), kSocketPieceBytes);
  connection().send(piece.first(size));
  sent_ += size;
}

}  // namespace hairnet::load
