#include "server/transport/http_response.hpp"

#include <array>
#include <ctime>

#include "core/assert.hpp"

namespace hairnet::server {
namespace {

// Cross-origin isolated, so that a page may share memory with its workers and has precise clocks.
constexpr std::string_view kSecurityHeaders =
    "X-Content-Type-Options: nosniff\r\n"
    "Referrer-Policy: no-referrer\r\n"
    "Cross-Origin-Opener-Policy: same-origin\r\n"
    "Cross-Origin-Embedder-Policy: require-corp\r\n"
    "Cross-Origin-Resource-Policy: same-origin\r\n"
    "Content-Security-Policy: default-src 'self'; script-src 'self' 'wasm-unsafe-eval'; worker-src 'self' blob:; "
    "style-src 'self' 'unsafe-inline'; img-src 'self' data: blob:; connect-src 'self' ws: wss: http: https: blob: "
    "data:; "
    "object-src 'none'; base-uri 'none'; form-action 'none'; frame-ancestors 'self'\r\n";

// The program never sets a locale, so strftime writes English names, as HTTP demands.
std::string http_date(std::int64_t date_s) {
  const auto time = static_cast<std::time_t>(date_s);
  std::tm parts{};
  gmtime_r(&time, &parts);
  std::array<char, 40> text{};
  const std::size_t bytes = std::strftime(text.data(), text.size(), "%a, %d %b %Y %H:%M:%S GMT", &parts);
  return {text.data(), bytes};
}

void add(std::string& header, std::string_view name, std::string_view value) {
  // A line break in the value would begin another field.
  HAIRNET_ASSERT(value.find_first_of("\r\n") == std::string_view::npos);
  if (!value.empty()) header.append(name).append(": ").append(value).append("\r\n");
}

// Clients look at the number only; the words help people who read the bytes.
std::string_view status_name(int status) {
  switch (status) {
    case 200:
      return "OK";
    case 204:
      return "No Content";
    case 301:
      return "Moved Permanently";
    case 304:
      return "Not Modified";
    case 400:
      return "Bad Request";
    case 401:
      return "Unauthorized";
    case 403:
      return "Forbidden";
    case 404:
      return "Not Found";
    case 405:
      return "Method Not Allowed";
    case 408:
      return "Request Timeout";
    case 413:
      return "Content Too Large";
    case 414:
      return "URI Too Long";
    case 421:
      return "Misdirected Request";
    case 426:
      return "Upgrade Required";
    case 431:
      return "Request Header Fields Too Large";
    case 500:
      return "Internal Server Error";
    case 503:
      return "Service Unavailable";
    default:
      return "Status";
  }
}

}  // namespace

HttpResponse refusal(int status, std::string_view error) {
  HAIRNET_ASSERT(status >= 300 && status <= 599);
  HttpResponse response;
  response.status = status;
  response.body = std::string(error) + "\n";
  return response;
}

std::string header_of(const HttpResponse& response, bool keep_alive, std::int64_t date_s) {
  // A body has one source, or its announced length would be wrong.
  HAIRNET_ASSERT(response.body.empty() || response.file_bytes == 0);
  std::string header = "HTTP/1.1 " + std::to_string(response.status) + " ";
  header.append(status_name(response.status)).append("\r\nServer: hairnet\r\n");
  add(header, "Date", http_date(date_s));
  // Neither status has a body, so there is none to describe.
  const bool has_body = response.status != 304 && response.status != 204;
  if (has_body) {
    add(header, "Content-Type", response.content_type);
    add(header, "Content-Encoding", response.content_encoding);
    add(header, "Content-Length", std::to_string(response.body.empty() ? response.file_bytes : response.body.size()));
  }
  add(header, "Cache-Control", response.cache_control);
  add(header, "ETag", response.etag);
  add(header, "Vary", response.vary);
  add(header, "Location", response.location);
  add(header, "Access-Control-Allow-Origin", response.allow_origin);
  // A 204 answers a preflight: pages may send a token with their request.
  if (response.status == 204) add(header, "Access-Control-Allow-Headers", "Authorization");
  if (response.status == 401) add(header, "WWW-Authenticate", "Bearer");
  add(header, "Upgrade", response.upgrade);
  if (response.status == 405) add(header, "Allow", "GET, HEAD");
  add(header, "Connection", !response.upgrade.empty() ? "upgrade, close" : keep_alive ? "keep-alive" : "close");
  return header.append(kSecurityHeaders).append("\r\n");
}

}  // namespace hairnet::server
