#include "tests/load/attack_upload.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <utility>

#include "schema/wire/groom_file.hpp"
#include "tests/load/attack_grooms.hpp"
#include "tests/load/virtual_client.hpp"

namespace hairnet::load {
namespace {

// An uploader that the server has sent away comes back after this time.
constexpr std::int64_t kUploadRedial_ns = 250'000'000;
constexpr std::int64_t kUploadAgain_ns = 1'000'000'000;  // after an error that leaves the groom's state open
// The uploader waits while this many bytes are not sent. A chunk is far below the largest packet, 4 MiB.
constexpr std::size_t kUploadUnsentBytesMax = 512u << 10;
constexpr std::size_t kUploadChunkBytes = 128u << 10;

wire::Hello uploader_hello() {
  wire::Hello message;
  message.client_name = "hairnet-load attacker";
  message.room = "attack";
  return message;
}

}  // namespace

AttackUpload::AttackUpload(const AttackContext& context, std::uint32_t host, std::vector<std::uint8_t> bytes,
                           std::uint32_t first)
    : Attacker(context, host, kUploadRedial_ns),
      bytes_(std::move(bytes)),
      name_at_(static_cast<std::size_t>(std::ranges::search(bytes_, kAttackGroomName).begin() - bytes_.begin())),
      number_(first),
      offer_ns_(kNever_ns) {}

void AttackUpload::begin(std::int64_t now_ns) {
  // The server has not asked for any bytes yet.
  sent_ = bytes_.size();
  offer_ns_ = kNever_ns;
  send(uploader_hello(), now_ns);
}

// Writes another name into the groom's bytes, so that the hash is new and the server must build it again.
void AttackUpload::offer(std::int64_t now_ns) {
  const std::string name = fmt::format("attack-{:08x}", number_++);
  std::ranges::copy(name, bytes_.begin() + static_cast<std::ptrdiff_t>(name_at_));
  hash_ = wire::hash_groom(bytes_);
  sent_ = bytes_.size();
  offer_ns_ = kNever_ns;
  count("offers");
  send(wire::GroomOffer{hash_, bytes_.size()}, now_ns);
}

void AttackUpload::hear(const wire::Message& message, std::int64_t now_ns) {
  const auto* status = std::get_if<wire::GroomStatus>(&message);
  if (std::holds_alternative<wire::Welcome>(message)) {
    offer(now_ns);
  } else if (const auto* need = std::get_if<wire::GroomNeed>(&message)) {
    if (need->hash == hash_) sent_ = need->offset;
  } else if (status && status->hash == hash_ && status->state >= wire::GroomState::ready) {
    count(status->state == wire::GroomState::ready ? "grooms_ready" : "grooms_refused");
    offer_ns_ = now_ns;
  } else if (const auto* error = std::get_if<wire::Error>(&message); error && error->groom == hash_) {
    offer_ns_ = now_ns + kUploadAgain_ns;
  }
}

void AttackUpload::proceed(std::int64_t now_ns) {
  if (now_ns >= offer_ns_) offer(now_ns);
  while (sent_ < bytes_.size() && connection().unsent_bytes() < kUploadUnsentBytesMax) {
    const std::size_t size = std::min(kUploadChunkBytes, bytes_.size() - sent_);
    const auto from = bytes_.begin() + static_cast<std::ptrdiff_t>(sent_);
    send(wire::GroomChunk{hash_, sent_, {from, from + static_cast<std::ptrdiff_t>(size)}}, now_ns);
    sent_ += size;
  }
}

AttackOffers::AttackOffers(const AttackContext& context, std::uint32_t host, SlowOffers attack)
    : Attacker(context, host, kUploadRedial_ns),
      attack_(attack),
      random_(host),
      offers_(attack.offers_hz),
      bytes_(attack.byte_hz) {}

void AttackOffers::begin(std::int64_t now_ns) {
  welcomed_ = false;
  offered_.clear();
  send(uploader_hello(), now_ns);
}

void AttackOffers::hear(const wire::Message& message, std::int64_t) {
  if (std::holds_alternative<wire::Welcome>(message)) welcomed_ = true;
}

void AttackOffers::proceed(std::int64_t now_ns) {
  if (!welcomed_) return;
  while (offered_.size() < attack_.offers_max && offers_.take(now_ns)) {
    Offered next;
    std::ranges::generate(next.hash, [&] { return static_cast<std::uint8_t>(random_.next()); });
    if (attack_.is_late_joiners_groom) next.hash = context_->late_joiner_groom;
    offered_.push_back(next);
    count("offers");
    send(wire::GroomOffer{next.hash,
                          attack_.is_late_joiners_groom ? context_->late_joiner_groom_bytes : attack_.byte_count},
         now_ns);
  }
  while (bytes_.take(now_ns))
    for (Offered& groom : offered_) send(wire::GroomChunk{groom.hash, groom.offset++, {0}}, now_ns);
}

}  // namespace hairnet::load
