#include "server/http3/request.hpp"

#include <algorithm>
#include <array>
#include <utility>

namespace hairnet::http3 {
namespace {

// Capital letters make a field malformed in HTTP/3 (RFC 9114, section 4.2).
bool is_valid_name(std::string_view name) {
  const std::string_view plain = name.starts_with(':') ? name.substr(1) : name;
  return !plain.empty() &&
         std::ranges::all_of(plain, [](char c) { return c > 0x20 && c < 0x7f && c != ':' && !(c >= 'A' && c <= 'Z'); });
}

// These characters would begin another field where somebody passes the value on as HTTP/1.1.
bool is_valid_value(std::string_view value) {
  return std::ranges::none_of(value, [](char c) { return c == '\0' || c == '\r' || c == '\n'; });
}

}  // namespace

bool Request::asks_for_session() const {
  return method == "CONNECT" && protocol == "webtransport" && scheme == "https" && !authority.empty() && !path.empty();
}

Result<Request> read_request(std::span<const Field> fields) {
  Request request;
  const std::array<std::pair<std::string_view, std::string*>, 5> pseudo{{{":method", &request.method},
                                                                         {":protocol", &request.protocol},
                                                                         {":scheme", &request.scheme},
                                                                         {":authority", &request.authority},
                                                                         {":path", &request.path}}};
  std::array<bool, pseudo.size()> seen{};
  bool has_ordinary = false, has_origin = false;
  for (const Field& field : fields) {
    if (!is_valid_name(field.name) || !is_valid_value(field.value)) return Refusal("a field is not valid");
    if (field.name[0] != ':') {
      has_ordinary = true;
      if (field.name != "origin") continue;
      if (std::exchange(has_origin, true)) return Refusal("there are two origins");
      request.origin = field.value;
      continue;
    }
    // Order and number of pseudo-fields are checked strictly: two readers of one request must not see two different
    // requests.
    if (has_ordinary) return Refusal("a pseudo-field follows others");
    const auto* const found = std::ranges::find(pseudo, field.name, [](const auto& entry) { return entry.first; });
    if (found == pseudo.end()) return Refusal("a pseudo-field is unknown");
    if (std::exchange(seen[static_cast<std::size_t>(found - pseudo.begin())], true))
      return Refusal("a pseudo-field comes twice");
    *found->second = field.value;
  }
  if (request.method.empty()) return Refusal("the method is missing");
  const bool is_connect = request.method == "CONNECT";
  if (!request.protocol.empty() && !is_connect) return Refusal("only CONNECT has a protocol");
  // A plain CONNECT names only an authority; an extended one has scheme and path, like other requests (RFC 9220).
  const bool is_plain_connect = is_connect && request.protocol.empty();
  if (is_plain_connect != (request.scheme.empty() && request.path.empty()))
    return Refusal("scheme or path is missing, or not expected");
  return request;
}

}  // namespace hairnet::http3
