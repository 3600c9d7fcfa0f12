#pragma once

#include <cstdint>
#include <string_view>
#include <vector>

namespace hairnet::server {

// How a file's bytes are stored and sent. A compressed copy lies beside its file, with one more ending.
enum class ContentCoding : std::uint8_t { brotli, gzip, identity };

struct ContentCodingName {
  // The name as in HTTP's header fields; empty: identity.
  std::string_view token;
  // Ends the copy's name.
  std::string_view ending;
};
ContentCodingName name_of(ContentCoding coding);

// What a client takes, best first, by the field Accept-Encoding (RFC 9110, 12.5.3). The last one is always `identity`:
// a client that refuses even this gets the file as it is. Of codings that the client likes equally, the smaller comes
// first. Ignores words that it cannot read.
std::vector<ContentCoding> accepted_codings(std::string_view accept_encoding);

}  // namespace hairnet::server
