#include "server/quic/credentials.hpp"

#include <gnutls/crypto.h>
#include <gnutls/x509.h>

#include <new>
#include <utility>

#include "core/assert.hpp"

namespace hairnet::quic {
namespace {

// The self-signed certificate has this name; its hash counts, not its name.
constexpr std::string_view kName = "hairnet";

struct Delete {
  void operator()(gnutls_x509_crt_t certificate) const { gnutls_x509_crt_deinit(certificate); }
  void operator()(gnutls_x509_privkey_t key) const { gnutls_x509_privkey_deinit(key); }
};

// Signs a certificate of `key` with `key`. Returns GnuTLS' code.
int sign(gnutls_x509_crt_t certificate, gnutls_x509_privkey_t key, std::int64_t begin_s, std::int64_t end_s) {
  std::array<std::uint8_t, 16> serial{};
  gnutls_rnd(GNUTLS_RND_NONCE, serial.data(), serial.size());
  // A serial number must be positive (RFC 5280, section 4.1.2.2).
  serial[0] = static_cast<std::uint8_t>(serial[0] & 0x7f);
  // Each step runs only after the ones before it; the first code that is not 0 is the result.
  int code = gnutls_x509_crt_set_version(certificate, 3);
  if (code == 0) code = gnutls_x509_crt_set_serial(certificate, serial.data(), serial.size());
  if (code == 0) code = gnutls_x509_crt_set_activation_time(certificate, begin_s);
  if (code == 0) code = gnutls_x509_crt_set_expiration_time(certificate, end_s);
  if (code == 0)
    code = gnutls_x509_crt_set_dn_by_oid(certificate, GNUTLS_OID_X520_COMMON_NAME, 0, kName.data(),
                                         static_cast<unsigned>(kName.size()));
  if (code == 0)
    code = gnutls_x509_crt_set_subject_alt_name(certificate, GNUTLS_SAN_DNSNAME, kName.data(),
                                                static_cast<unsigned>(kName.size()), GNUTLS_FSAN_SET);
  if (code == 0) code = gnutls_x509_crt_set_key(certificate, key);
  if (code == 0) code = gnutls_x509_crt_sign2(certificate, certificate, key, GNUTLS_DIG_SHA256, 0);
  return code;
}

}  // namespace

Credentials::Credentials() {
  if (gnutls_certificate_allocate_credentials(&native_) != 0) throw std::bad_alloc();
}

Credentials::~Credentials() {
  gnutls_certificate_free_credentials(native_);
}

Result<std::shared_ptr<const Credentials>> Credentials::load(const std::string& certificate, const std::string& key) {
  std::shared_ptr<Credentials> made(new Credentials);
  const int code =
      gnutls_certificate_set_x509_key_file(made->native_, certificate.c_str(), key.c_str(), GNUTLS_X509_FMT_PEM);
  if (code < 0)
    return Refusal("the certificate " + certificate + " and the key " + key +
                   " cannot be used: " + gnutls_strerror(code));
  return made;
}

Result<std::shared_ptr<const Credentials>> Credentials::make(std::int64_t begin_s, std::int64_t end_s) {
  HAIRNET_ASSERT(begin_s < end_s);
  gnutls_x509_privkey_t made_key = nullptr;
  gnutls_x509_crt_t made_certificate = nullptr;
  if (gnutls_x509_privkey_init(&made_key) != 0) throw std::bad_alloc();
  const std::unique_ptr<std::remove_pointer_t<gnutls_x509_privkey_t>, Delete> key(made_key);
  if (gnutls_x509_crt_init(&made_certificate) != 0) throw std::bad_alloc();
  const std::unique_ptr<std::remove_pointer_t<gnutls_x509_crt_t>, Delete> certificate(made_certificate);
  std::shared_ptr<Credentials> made(new Credentials);
  int code =
      gnutls_x509_privkey_generate(key.get(), GNUTLS_PK_ECDSA, GNUTLS_CURVE_TO_BITS(GNUTLS_ECC_CURVE_SECP256R1), 0);
  if (code == 0) code = sign(certificate.get(), key.get(), begin_s, end_s);
  if (code == 0) code = gnutls_certificate_set_x509_key(made->native_, &made_certificate, 1, key.get());
  std::size_t bytes = made->hash_.size();
  if (code >= 0)
    // Pages name this hash of the whole certificate to the browser (serverCertificateHashes).
    code = gnutls_x509_crt_get_fingerprint(certificate.get(), GNUTLS_DIG_SHA256, made->hash_.data(), &bytes);
  if (code < 0) return Refusal(std::string("no certificate can be made: ") + gnutls_strerror(code));
  return made;
}

}  // namespace hairnet::quic
