#include "server/telemetry/log_text.hpp"

#include "core/shown_text.hpp"

namespace hairnet::server {

std::string log_text(std::string_view text) {
  constexpr std::size_t kTextBytesMax = 200;
  return '"' + shown_text(text, kTextBytesMax, '"') + '"';
}

}  // namespace hairnet::server
