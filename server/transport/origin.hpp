#pragma once

#include <span>
#include <string>
#include <string_view>

namespace hairnet::server {

// Whether a page of `origin` (the request's Origin header) may open a WebSocket at `host` (its Host header). Without an
// Origin there is no page, and nothing to protect. With no list, only the server's own pages may; with one, those
// listed and no other, and "*" is every page.
bool origin_allowed(std::string_view origin, std::string_view host, std::span<const std::string> list);

// Empty when `origin` can stand in the list ("https://example.com:8443", "null" or "*"); else one line.
std::string validate_origin(std::string_view origin);

}  // namespace hairnet::server
