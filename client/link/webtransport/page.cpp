#include "client/link/webtransport/page.hpp"

#include <sodium.h>

#include <algorithm>
#include <nlohmann/json.hpp>

namespace hairnet::link {
namespace {

// The page comes over a connection that may be open to anyone, so each part of it is bounded.
constexpr std::size_t kHashesMax = 16, kPathBytesMax = 256;

bool read_hash(const nlohmann::json& value, quic::CertificateHash& hash) {
  if (!value.is_string()) return false;
  const auto& text = value.get_ref<const std::string&>();
  std::size_t bytes = 0;
  return sodium_base642bin(hash.data(), hash.size(), text.data(), text.size(), nullptr, &bytes, nullptr,
                           sodium_base64_VARIANT_ORIGINAL) == 0 &&
         bytes == hash.size();
}

bool is_path(const nlohmann::json& value) {
  if (!value.is_string()) return false;
  const auto& text = value.get_ref<const std::string&>();
  return text.starts_with('/') && text.size() <= kPathBytesMax &&
         std::ranges::all_of(text, [](char c) { return c > ' ' && c < '\x7f'; });
}

}  // namespace

Result<WebTransportPage> read_web_transport_page(std::string_view text) {
  const Refusal damaged("the server's page about WebTransport is damaged");
  const nlohmann::json page = nlohmann::json::parse(text, nullptr, false);
  if (!page.is_object()) return damaged;
  const auto port = page.find("port"), path = page.find("path"), hashes = page.find("hashes");
  if (port == page.end() || !port->is_number_unsigned() || *port > 65'535u) return damaged;
  WebTransportPage read;
  read.port = port->get<std::uint16_t>();
  if (read.port == 0) return read;
  if (path == page.end() || !is_path(*path)) return damaged;
  read.path = path->get<std::string>();
  if (hashes == page.end() || !hashes->is_array() || hashes->size() > kHashesMax) return damaged;
  for (const nlohmann::json& hash : *hashes)
    if (!read_hash(hash, read.hashes.emplace_back())) return damaged;
  return read;
}

}  // namespace hairnet::link
