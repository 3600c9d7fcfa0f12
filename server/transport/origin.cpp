#include "server/transport/origin.hpp"

#include <algorithm>

namespace hairnet::server {
namespace {

constexpr std::string_view kHttp = "http://", kHttps = "https://";

// The text with the capital letters of ASCII made small: names of hosts have no others.
std::string lowered(std::string_view text) {
  std::string out(text);
  std::ranges::transform(out, out.begin(), [](char c) { return c >= 'A' && c <= 'Z' ? static_cast<char>(c + 32) : c; });
  return out;
}

// Removes the suffix if the text has it.
void drop_suffix(std::string& text, std::string_view suffix) {
  if (text.ends_with(suffix)) text.resize(text.size() - suffix.size());
}

// Scheme and authority in lower case, without the scheme's own port.
std::string normal_origin(std::string_view origin) {
  std::string out = lowered(origin);
  if (out.starts_with(kHttps))
    drop_suffix(out, ":443");
  else if (out.starts_with(kHttp))
    drop_suffix(out, ":80");
  return out;
}

bool is_digit(char c) {
  return c >= '0' && c <= '9';
}

// "localhost", "127.0.0.1:5173", "[::1]:7420"; in lower case.
// The name must end there or go on with a port: "localhost.example.com" is not of this machine.
bool is_loopback(std::string_view authority) {
  for (const std::string_view name : {"localhost", "127.0.0.1", "[::1]"}) {
    if (!authority.starts_with(name)) continue;
    const std::string_view port = authority.substr(name.size());
    return port.empty() || (port.size() > 1 && port[0] == ':' && std::ranges::all_of(port.substr(1), is_digit));
  }
  return false;
}

// A page of this machine: its origin begins with http:// or https://.
bool is_local_page(std::string_view origin) {
  const std::size_t scheme = origin.starts_with(kHttps)  ? kHttps.size()
                             : origin.starts_with(kHttp) ? kHttp.size()
                                                         : origin.size();
  return is_loopback(origin.substr(scheme));
}

}  // namespace

bool origin_allowed(std::string_view origin, std::string_view host, std::span<const std::string> list, bool is_local) {
  if (origin.empty()) return true;
  // Browsers leave out the scheme's own port and write names in lower case; operators may not.
  const std::string asked = normal_origin(origin);
  if (list.empty()) {
    if (is_local && is_local_page(asked) && is_loopback(lowered(host))) return true;
    // A proxy in front of the server may end TLS, so the page's scheme may differ from ours. Page and WebSocket come
    // from one host: the server's own pages need no setting.
    return !host.empty() && (asked == normal_origin(std::string(kHttp).append(host)) ||
                             asked == normal_origin(std::string(kHttps).append(host)));
  }
  return std::ranges::any_of(
      list, [&](const std::string& listed) { return listed == "*" || asked == normal_origin(listed); });
}

bool host_allowed(std::string_view host, std::span<const std::string> list) {
  // An address of IPv6.
  if (host.starts_with('[')) return true;
  const std::string name = lowered(host.substr(0, host.find(':')));
  // No name under a top-level domain has digits only.
  if (std::ranges::all_of(name, [](char c) { return is_digit(c) || c == '.'; })) return !name.empty();
  return std::ranges::any_of(list, [&](const std::string& listed) { return listed == "*" || name == lowered(listed); });
}

std::string validate_host(std::string_view host) {
  const bool valid = host == "*" || (!host.empty() && std::ranges::all_of(lowered(host), [](char c) {
                       return is_digit(c) || (c >= 'a' && c <= 'z') || c == '.' || c == '-' || c == '_';
                     }));
  return valid ? std::string() : "the host \"" + std::string(host) + "\" is not a name without scheme and port";
}

std::string validate_origin(std::string_view origin) {
  if (origin == "*" || origin == "null") return {};
  const std::string text = lowered(origin);
  const std::size_t scheme = text.starts_with(kHttps) ? kHttps.size() : text.starts_with(kHttp) ? kHttp.size() : 0;
  const std::string_view rest = std::string_view(text).substr(scheme);
  const bool valid = scheme != 0 && !rest.empty() &&
                     std::ranges::all_of(rest, [](char c) { return c > 0x20 && c < 0x7f && c != '/' && c != '?'; });
  return valid ? std::string()
               : "the origin \"" + std::string(origin) + "\" is not of the form https://host or http://host:port";
}

}  // namespace hairnet::server
