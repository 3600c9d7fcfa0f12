#include "server/transport/s3_endpoint.hpp"

#include <algorithm>

#include "server/transport/http_url.hpp"

namespace hairnet::server {
namespace {

// The longest path of a bucket with its prefix, and the longest name of a region.
constexpr std::size_t kPathBytesMax = 512, kRegionBytesMax = 64;

// A signature covers the path as it is encoded. These characters are the same encoded and plain, so no encoder is
// needed.
bool is_plain(char c) {
  return (c >= '0' && c <= '9') || (c >= 'a' && c <= 'z') || (c >= 'A' && c <= 'Z') || c == '-' || c == '.' || c == '_';
}

// Between slashes: what a signature needs no encoding for, and no step up or to itself.
bool is_segment(std::string_view segment) {
  return !segment.empty() && segment != "." && segment != ".." && std::ranges::all_of(segment, is_plain);
}

// `path` begins and ends with a slash.
bool is_path(std::string_view path) {
  if (path.size() > kPathBytesMax) return false;
  for (path.remove_prefix(1); !path.empty();) {
    const std::size_t slash = path.find('/');
    if (!is_segment(path.substr(0, slash))) return false;
    path.remove_prefix(slash + 1);
  }
  return true;
}

// Numbers and names without a domain have no bucket in front.
bool may_name_bucket(std::string_view host) {
  const bool is_number = host.find(':') != host.npos || host.find_first_not_of("0123456789.") == host.npos;
  return !is_number && host.find('.') != host.npos;
}

}  // namespace

Result<S3Endpoint> parse_s3_endpoint(std::string_view url) {
  const Refusal wrong("\"" + std::string(url) +
                      "\" is not the URL of an object store: https://host:9000/bucket/prefix or "
                      "https://bucket.host/prefix, of letters, digits, '.', '_' and '-'");
  std::optional<HttpUrl> parsed = parse_http_url(url);
  if (!parsed) return wrong;
  if (!parsed->path.ends_with('/')) parsed->path += '/';
  if (!is_path(parsed->path)) return wrong;
  if (parsed->path == "/" && !may_name_bucket(parsed->host))
    return Refusal("the URL of the object store, " + std::string(url) + ", names no bucket: " + std::string(url) +
                   (url.ends_with('/') ? "" : "/") + "bucket");
  S3Endpoint endpoint;
  endpoint.is_tls = parsed->is_tls;
  // The signature covers Host, and HTTP leaves the scheme's own port out of it: a proxy that did so would break the
  // signature.
  const std::uint16_t usual = parsed->is_tls ? 443 : 80;
  endpoint.port = parsed->port == 0 ? usual : parsed->port;
  endpoint.host_field = parsed->host.find(':') == std::string::npos ? parsed->host : "[" + parsed->host + "]";
  if (endpoint.port != usual) endpoint.host_field += ":" + std::to_string(endpoint.port);
  endpoint.host = std::move(parsed->host);
  endpoint.path = std::move(parsed->path);
  return endpoint;
}

std::string validate(const S3Options& options) {
  if (options.url.empty())
    return options.key_file.empty() && options.ca.empty() ? "" : "the settings of an object store need its URL";
  if (const auto endpoint = parse_s3_endpoint(options.url); !endpoint) return endpoint.error();
  const bool is_region = !options.region.empty() && options.region.size() <= kRegionBytesMax &&
                         std::ranges::all_of(options.region, is_plain);
  return is_region ? "" : "the region of an object store is a word, as us-east-1";
}

}  // namespace hairnet::server
