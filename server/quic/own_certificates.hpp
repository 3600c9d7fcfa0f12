#pragma once

#include <cstdint>
#include <memory>
#include <vector>

#include "core/result.hpp"
#include "server/quic/credentials.hpp"

namespace hairnet::quic {

// Self-signed certificates that replace each other in time. Browsers take one that a page names by its hash, if it uses
// ECDSA P-256 and is valid for at most 14 days. The next one is made, and its hash told, a day before it is shown: a
// page that has asked for the hashes can still connect after the change.
class OwnCertificates {
 public:
  static constexpr std::int64_t kDay_s = 86'400;
  // A certificate is valid for this long before it is made, since clocks of clients differ.
  static constexpr std::int64_t kBefore_s = kDay_s / 2;
  // A certificate is valid for one day less than the 14 that browsers allow. It is shown only for the first 10 days
  // after it is made, so that a client whose clock is slow or fast still finds it valid.
  static constexpr std::int64_t kValid_s = 13 * kDay_s, kShown_s = 10 * kDay_s, kAnnounced_s = kDay_s;

  // Times are seconds since 1970.
  static Result<OwnCertificates> make(std::int64_t now_s);
  // Makes the next certificate and changes to it when it is time. An error leaves everything as it is.
  Result<void> poll(std::int64_t now_s);
  [[nodiscard]] const std::shared_ptr<const Credentials>& current() const { return current_; }
  [[nodiscard]] std::vector<CertificateHash> hashes() const;

 private:
  OwnCertificates(std::shared_ptr<const Credentials> current, std::int64_t now_s)
      : current_(std::move(current)), shown_until_s_(now_s + kShown_s) {}

  // next_ is null until pages get its hash, a day before it is shown.
  std::shared_ptr<const Credentials> current_, next_;
  // current_ is replaced at this time.
  std::int64_t shown_until_s_;
};

}  // namespace hairnet::quic
