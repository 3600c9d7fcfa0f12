#pragma once

#include <gnutls/gnutls.h>

#include <cstdint>
#include <memory>
#include <string>

#include "core/result.hpp"
#include "schema/quic/certificate_hash.hpp"

namespace hairnet::quic {

// The certificate and key that the server's side of TLS shows. Connections share it; it lives until the last one that
// began with it has ended.
class Credentials {
 public:
  // Reads a certificate and its key from PEM files. The error is one line.
  static Result<std::shared_ptr<const Credentials>> load(const std::string& certificate, const std::string& key);
  // A self-signed certificate of a new ECDSA P-256 key, valid between these seconds since 1970.
  static Result<std::shared_ptr<const Credentials>> make(std::int64_t begin_s, std::int64_t end_s);

  Credentials(const Credentials&) = delete;
  Credentials& operator=(const Credentials&) = delete;
  ~Credentials();

  [[nodiscard]] gnutls_certificate_credentials_t native() const { return native_; }
  // The SHA-256 of a made certificate, which pages name. Zero for a loaded one, which an authority has signed.
  [[nodiscard]] const CertificateHash& hash() const { return hash_; }

 private:
  Credentials();
  gnutls_certificate_credentials_t native_ = nullptr;
  CertificateHash hash_{};
};

}  // namespace hairnet::quic
