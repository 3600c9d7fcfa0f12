#include "server/quic/own_certificates.hpp"

#include <utility>

namespace hairnet::quic {
namespace {

Result<std::shared_ptr<const Credentials>> make_at(std::int64_t now_s) {
  const std::int64_t begin_s = now_s - OwnCertificates::kBefore_s;
  return Credentials::make(begin_s, begin_s + OwnCertificates::kValid_s);
}

}  // namespace

Result<OwnCertificates> OwnCertificates::make(std::int64_t now_s) {
  auto made = make_at(now_s);
  if (!made) return Refusal(std::move(made.error()));
  return OwnCertificates(std::move(*made), now_s);
}

Result<void> OwnCertificates::poll(std::int64_t now_s) {
  // A clock that was set back, or far forward, makes the certificate's dates wrong.
  const bool is_astray = now_s < shown_until_s_ - kShown_s - kBefore_s || now_s > shown_until_s_ + kAnnounced_s;
  if (!next_ && (is_astray || now_s >= shown_until_s_ - kAnnounced_s)) {
    auto made = make_at(now_s);
    if (!made) return Refusal(std::move(made.error()));
    next_ = std::move(*made);
  }
  // A certificate whose dates are wrong is replaced at once, though pages with the old hash then have to ask again.
  if (next_ && (is_astray || now_s >= shown_until_s_)) {
    current_ = std::exchange(next_, nullptr);
    shown_until_s_ = now_s + kShown_s - (is_astray ? 0 : kAnnounced_s);
  }
  return {};
}

std::vector<CertificateHash> OwnCertificates::hashes() const {
  std::vector<CertificateHash> hashes{current_->hash()};
  if (next_) hashes.push_back(next_->hash());
  return hashes;
}

}  // namespace hairnet::quic
