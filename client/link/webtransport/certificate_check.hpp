#pragma once

#include <gnutls/gnutls.h>

#include <string>
#include <vector>

#include "core/result.hpp"
#include "schema/quic/certificate_hash.hpp"

namespace hairnet::link {

// How a server's certificate is checked.
struct CertificateCheck {
  // The name or address for which the certificate must be made out.
  std::string host;
  // If there are any, the certificate must have one of these hashes, and nothing else counts.
  std::vector<quic::CertificateHash> hashes;
  // A PEM file of the authorities that may sign the certificate; empty: the system's store.
  std::string ca_file;
  // Accepts any certificate.
  bool insecure = false;
};

// The client's side of TLS for one connection: checks by a CertificateCheck.
class CertificateVerifier {
 public:
  // The error is one line: the authorities cannot be read.
  static Result<CertificateVerifier> make(CertificateCheck check);
  CertificateVerifier(CertificateVerifier&& other) noexcept;
  CertificateVerifier(const CertificateVerifier&) = delete;
  CertificateVerifier& operator=(const CertificateVerifier&) = delete;
  ~CertificateVerifier();

  // Names the host to the server. Returns false when memory is short.
  [[nodiscard]] bool set_up(gnutls_session_t tls) const;
  // Call it once the server has shown its certificate. Returns an empty string for a good one, else one line.
  [[nodiscard]] std::string verify(gnutls_session_t tls) const;

 private:
  explicit CertificateVerifier(CertificateCheck check);
  CertificateCheck check_;
  gnutls_certificate_credentials_t credentials_ = nullptr;
};

}  // namespace hairnet::link
