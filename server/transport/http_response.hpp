#pragma once

#include <cstdint>
#include <string>
#include <string_view>

namespace hairnet::server {

// A response's status, headers and the part of its body that is in memory.
struct HttpResponse {
  int status = 200;
  std::string content_type = "text/plain; charset=utf-8";
  std::string cache_control = "no-store";
  std::string body;
  // The size of a body that is sent from a file, instead of `body`.
  std::uint64_t file_bytes = 0;
  // The values of the header fields with these names; an empty one leaves its field out.
  std::string etag = {}, location = {}, upgrade = {}, content_encoding = {}, vary = {}, allow_origin = {};
};

// A response with one line of text. Asserts that `status` is from 300 to 599.
HttpResponse refusal(int status, std::string_view error);

// The header with its last empty line. `date_s`: seconds since 1970. Every page may run its own scripts and
// WebAssembly, draw with WebGL, and connect to any WebSocket or WebTransport; the policy forbids everything else.
std::string header_of(const HttpResponse& response, bool keep_alive, std::int64_t date_s);

}  // namespace hairnet::server
