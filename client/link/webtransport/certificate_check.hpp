#pragma once

#include <gnutls/gnutls.h>

#include <string>
#include <vector>

#include "core/result.hpp"
#include "schema/quic/certificate_hash.hpp"

namespace hairnet::link {

// How a server's certificate is checked.
struct CertificateCheck {
  std::string host;                           // the name or address that it must be for
  std::vector<quic::CertificateHash> hashes;  // not empty: it must be one of these, and nothing else counts
  std::string ca_file;                        // PEM of those who may sign it; empty: the system's store
  bool insecure = false;                      // accepts any certificate
};

// The client's side of TLS for one connection: checks by a CertificateCheck.
class CertificateVerifier {
 public:
  // One line when those who may sign cannot be read.
  static Result<CertificateVerifier> make(CertificateCheck check);
  CertificateVerifier(CertificateVerifier&& other) noexcept;
  CertificateVerifier(const CertificateVerifier&) = delete;
  CertificateVerifier& operator=(const CertificateVerifier&) = delete;
  ~CertificateVerifier();

  // Names the host to the server. False when there is no memory.
  [[nodiscard]] bool set_up(gnutls_session_t tls) const;
  // Called once the server has shown its certificate. Empty when it is good, else one line.
  [[nodiscard]] std::string verify(gnutls_session_t tls) const;

 private:
  explicit CertificateVerifier(CertificateCheck check);
  CertificateCheck check_;
  gnutls_certificate_credentials_t credentials_ = nullptr;
};

}  // namespace hairnet::link
