#pragma once

#include <span>
#include <string>
#include <string_view>

namespace hairnet::server {

// Whether a page of `origin` (the Origin header) may open a WebSocket at `host` (the Host header). A request without an
// Origin does not come from a page and is allowed. With a `list` the listed origins are allowed, where "*" allows every
// page. With an empty one the server's own pages are allowed. If the server `is_local` (it listens on the loopback
// only), all pages of this machine are too: the hosts of both headers must be localhost, 127.0.0.1 or [::1], with any
// port. A page of another site fails this test even if its DNS answers with a loopback address.
bool origin_allowed(std::string_view origin, std::string_view host, std::span<const std::string> list, bool is_local);

// Whether a request may name `host` (the Host header, with or without a port). A numeric address may always be named: a
// page of another site reaches this server under the site's own name only, when the site's DNS answers with this
// server's address. "*" in the list allows every name.
bool host_allowed(std::string_view host, std::span<const std::string> list);

// Returns an empty string when `host` is valid in the list ("hair.example.com" or "*"); else one line.
std::string validate_host(std::string_view host);

// Returns an empty string when `origin` is valid in the list ("https://example.com:8443", "null" or "*"); else one
// line.
std::string validate_origin(std::string_view origin);

}  // namespace hairnet::server
