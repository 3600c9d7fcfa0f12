#include "server/objects/s3_signature.hpp"

#include <fmt/chrono.h>
#include <fmt/format.h>
#include <sodium.h>

#include <array>

namespace hairnet::server {
namespace {

using Digest = std::array<std::uint8_t, crypto_hash_sha256_BYTES>;
static_assert(crypto_auth_hmacsha256_BYTES == crypto_hash_sha256_BYTES);

std::span<const std::uint8_t> bytes_of(std::string_view text) {
  return {reinterpret_cast<const std::uint8_t*>(text.data()), text.size()};
}

std::string hex(const Digest& digest) {
  return fmt::format("{:02x}", fmt::join(digest, ""));
}

Digest hmac(std::span<const std::uint8_t> key, std::string_view text) {
  Digest digest{};
  crypto_auth_hmacsha256_state state;
  crypto_auth_hmacsha256_init(&state, key.data(), key.size());
  crypto_auth_hmacsha256_update(&state, bytes_of(text).data(), text.size());
  crypto_auth_hmacsha256_final(&state, digest.data());
  // The state holds the key.
  sodium_memzero(&state, sizeof(state));
  return digest;
}

}  // namespace

std::string sha256_hex(std::span<const std::uint8_t> bytes) {
  Digest digest{};
  crypto_hash_sha256(digest.data(), bytes.data(), bytes.size());
  return hex(digest);
}

std::string s3_date(std::int64_t unix_time_s) {
  return fmt::format("{:%Y%m%dT%H%M%SZ}", fmt::gmtime(static_cast<std::time_t>(unix_time_s)));
}

std::string s3_authorization(const S3Request& request, const S3Keys& keys, std::string_view region,
                             std::string_view date) {
  std::string fields, names;
  for (const auto& [name, value] : request.fields) {
    fields += fmt::format("{}:{}\n", name, value);
    names += fmt::format("{}{}", names.empty() ? "" : ";", name);
  }
  // The empty part between path and fields is the query, which these requests do not have.
  const std::string canonical =
      fmt::format("{}\n{}\n\n{}\n{}\n{}", request.method, request.path, fields, names, request.payload_hash);
  const std::string_view day = date.substr(0, 8);
  const std::string scope = fmt::format("{}/{}/s3/aws4_request", day, region);
  const std::string text = fmt::format("AWS4-HMAC-SHA256\n{}\n{}\n{}", date, scope, sha256_hex(bytes_of(canonical)));
  // The key of a signature is good for one day, one region and one service; the secret itself signs nothing.
  const Digest key = hmac(hmac(hmac(hmac(bytes_of("AWS4" + keys.secret), day), region), "s3"), "aws4_request");
  return fmt::format("AWS4-HMAC-SHA256 Credential={}/{},SignedHeaders={},Signature={}", keys.access, scope, names,
                     hex(hmac(key, text)));
}

}  // namespace hairnet::server
