#include "client/link/webtransport/certificate_check.hpp"

#include <arpa/inet.h>
#include <gnutls/crypto.h>

#include <algorithm>
#include <new>
#include <utility>

namespace hairnet::link {
namespace {

bool is_ip_address(const std::string& host) {
  // The parsed address is not used; this one has room for both kinds.
  in6_addr address{};
  return inet_pton(AF_INET, host.c_str(), &address) == 1 || inet_pton(AF_INET6, host.c_str(), &address) == 1;
}

std::string describe(unsigned status) {
  gnutls_datum_t text{};
  if (gnutls_certificate_verification_status_print(status, GNUTLS_CRT_X509, &text, 0) != 0) return "it is not trusted";
  std::string described(reinterpret_cast<const char*>(text.data), text.size);
  gnutls_free(text.data);
  // GnuTLS ends its sentences by a full stop and a blank, which would stand within our line.
  while (!described.empty() && (described.back() == ' ' || described.back() == '.')) described.pop_back();
  return described;
}

}  // namespace

CertificateVerifier::CertificateVerifier(CertificateCheck check) : check_(std::move(check)) {
  if (gnutls_certificate_allocate_credentials(&credentials_) != 0) throw std::bad_alloc();
}

CertificateVerifier::CertificateVerifier(CertificateVerifier&& other) noexcept
    : check_(std::move(other.check_)), credentials_(std::exchange(other.credentials_, nullptr)) {}

CertificateVerifier::~CertificateVerifier() {
  if (credentials_) gnutls_certificate_free_credentials(credentials_);
}

Result<CertificateVerifier> CertificateVerifier::make(CertificateCheck check) {
  CertificateVerifier made(std::move(check));
  if (made.check_.insecure || !made.check_.hashes.empty()) return made;
  const std::string& file = made.check_.ca_file;
  const int count = file.empty()
                        ? gnutls_certificate_set_x509_system_trust(made.credentials_)
                        : gnutls_certificate_set_x509_trust_file(made.credentials_, file.c_str(), GNUTLS_X509_FMT_PEM);
  // A file without a certificate is refused now. Otherwise each connection would fail with a reason that points at the
  // server.
  if (count <= 0 && !file.empty()) return Refusal("'" + file + "' cannot be read as certificates");
  if (count < 0) return Refusal(std::string("the system's certificates cannot be read: ") + gnutls_strerror(count));
  return made;
}

bool CertificateVerifier::set_up(gnutls_session_t tls) const {
  if (gnutls_credentials_set(tls, GNUTLS_CRD_CERTIFICATE, credentials_) != 0) return false;
  // TLS names no IP addresses (RFC 6066, 3).
  if (is_ip_address(check_.host)) return true;
  return gnutls_server_name_set(tls, GNUTLS_NAME_DNS, check_.host.data(), check_.host.size()) == 0;
}

std::string CertificateVerifier::verify(gnutls_session_t tls) const {
  if (check_.insecure) return {};
  if (check_.hashes.empty()) {
    // This checks the chain, the dates, and that the certificate is for this host.
    unsigned status = 0;
    if (gnutls_certificate_verify_peers3(tls, check_.host.c_str(), &status) != 0)
      return "its certificate cannot be checked";
    return status == 0 ? std::string() : "its certificate is refused (" + describe(status) + ")";
  }
  unsigned count = 0;
  const gnutls_datum_t* chain = gnutls_certificate_get_peers(tls, &count);
  quic::CertificateHash hash{};
  if (!chain || count == 0 || gnutls_hash_fast(GNUTLS_DIG_SHA256, chain->data, chain->size, hash.data()) != 0)
    return "it shows no certificate";
  // The first certificate of the chain is the server's own. Its page names it by its hash, so its names, dates and
  // signature need no check.
  if (std::ranges::count(check_.hashes, hash) > 0) return {};
  return "its certificate is refused (it is none of those that its page /wt.json names)";
}

}  // namespace hairnet::link
