#include "server/transport/tls_context.hpp"

#include <fmt/format.h>
#include <openssl/err.h>
#include <openssl/ssl.h>
#include <openssl/x509.h>
#include <spdlog/spdlog.h>

#include <fstream>
#include <string>
#include <utility>

#include "server/files/files.hpp"
#include "server/telemetry/log_text.hpp"

namespace hairnet::server {
namespace {

int no_passphrase(char*, int, int, void*) {
  // Without this function OpenSSL would ask for a passphrase at the terminal.
  return -1;
}

// Answers ALPN with HTTP/1.1, the only version of HTTP here. A client that offers only others gets no answer to it, and
// the handshake goes on.
int choose_http11(SSL*, const unsigned char** out, unsigned char* out_length, const unsigned char* in,
                  unsigned int in_length, void*) {
  // A list of protocols as ALPN has it: each name follows its length, here 8.
  static constexpr unsigned char kOurs[] = {8, 'h', 't', 't', 'p', '/', '1', '.', '1'};
  unsigned char* chosen = nullptr;
  const int found = SSL_select_next_proto(&chosen, out_length, kOurs, sizeof(kOurs), in, in_length);
  *out = chosen;
  return found == OPENSSL_NPN_NEGOTIATED ? SSL_TLSEXT_ERR_OK : SSL_TLSEXT_ERR_NOACK;
}

// Warns of a certificate whose time is over or has not begun. The server starts all the same, since its clock may be
// wrong.
void warn_of_dates(SSL_CTX* context, const std::string& path) {
  const X509* certificate = SSL_CTX_get0_certificate(context);
  if (X509_cmp_current_time(X509_get0_notAfter(certificate)) < 0)
    spdlog::warn("event=certificate_expired file={}", log_text(path));
  else if (X509_cmp_current_time(X509_get0_notBefore(certificate)) > 0)
    spdlog::warn("event=certificate_not_yet_valid file={}", log_text(path));
}

}  // namespace

std::string unreadable_pem(const std::string& path) {
  // A larger file is no PEM file.
  constexpr std::size_t kPemBytesMax = std::size_t{16} << 20;
  const Result<std::string> text = read_text_file(path, kPemBytesMax);
  if (!text) return text.error();
  if (text->empty()) return "it is empty";
  // read_text_file() has removed the mark from its copy, but OpenSSL reads the file itself.
  std::ifstream file(path, std::ios::binary);
  return file.peek() == 0xef ? "it begins with a byte order mark; save it without" : "";
}

std::string openssl_reason() {
  const unsigned long code = ERR_peek_last_error();
  const char* text = code == 0 ? nullptr : ERR_reason_error_string(code);
  ERR_clear_error();
  return text ? text : "unknown reason";
}

Result<std::shared_ptr<asio::ssl::context>> make_tls_context(const TlsFiles& files) {
  for (const auto& [what, file] : {std::pair("certificate", files.certificate), std::pair("key", files.key)}) {
    if (std::string error = unreadable_pem(file); !error.empty())
      return Refusal(fmt::format("cannot read the {} {}: {}", what, file, error));
  }
  ERR_clear_error();
  auto made = std::make_shared<asio::ssl::context>(asio::ssl::context::tls_server);
  SSL_CTX* context = made->native_handle();
  SSL_CTX_set_min_proto_version(context, TLS1_2_VERSION);
  // Renegotiation lets a client make the server compute handshake after handshake, and compression leaks secrets by
  // length (CRIME). A peer that leaves without TLS' end is common and no error.
  SSL_CTX_set_options(context, SSL_OP_NO_RENEGOTIATION | SSL_OP_NO_COMPRESSION | SSL_OP_CIPHER_SERVER_PREFERENCE |
                                   SSL_OP_IGNORE_UNEXPECTED_EOF);
  // An idle connection costs 34 KB less.
  SSL_CTX_set_mode(context, SSL_MODE_RELEASE_BUFFERS);
  SSL_CTX_set_default_passwd_cb(context, no_passphrase);
  SSL_CTX_set_alpn_select_cb(context, choose_http11, nullptr);
  if (SSL_CTX_use_certificate_chain_file(context, files.certificate.c_str()) != 1)
    return Refusal("the certificate " + files.certificate + " is not a PEM certificate chain: " + openssl_reason());
  if (SSL_CTX_use_PrivateKey_file(context, files.key.c_str(), SSL_FILETYPE_PEM) != 1) {
    // OpenSSL compares the key with the certificate while it reads the key; a mismatch is not an error of the file.
    const bool other = ERR_GET_REASON(ERR_peek_last_error()) == X509_R_KEY_VALUES_MISMATCH ||
                       ERR_GET_REASON(ERR_peek_last_error()) == X509_R_KEY_TYPE_MISMATCH;
    const std::string reason = openssl_reason();
    if (other) return Refusal("the key " + files.key + " does not fit the certificate " + files.certificate);
    return Refusal("the key " + files.key + " is not a PEM key without a passphrase: " + reason);
  }
  if (SSL_CTX_check_private_key(context) != 1) {
    ERR_clear_error();
    return Refusal("the key " + files.key + " does not fit the certificate " + files.certificate);
  }
  warn_of_dates(context, files.certificate);
  return made;
}

Result<std::shared_ptr<asio::ssl::context>> make_client_tls_context(const std::string& ca, std::string_view whose) {
  ERR_clear_error();
  auto made = std::make_shared<asio::ssl::context>(asio::ssl::context::tls_client);
  SSL_CTX* context = made->native_handle();
  SSL_CTX_set_min_proto_version(context, TLS1_2_VERSION);
  boost::system::error_code ignored;
  if (ca.empty())
    made->set_default_verify_paths(ignored);
  else if (std::string error = unreadable_pem(ca);
           !error.empty() || SSL_CTX_load_verify_locations(context, ca.c_str(), nullptr) != 1)
    return Refusal("the certificates of the authority of " + std::string(whose) + ", " + ca +
                   ", cannot be read: " + (error.empty() ? openssl_reason() : error));
  return made;
}

}  // namespace hairnet::server
