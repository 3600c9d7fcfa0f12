#include "server/telemetry/log_text.hpp"

#include "core/shown_text.hpp"

namespace hairnet::server {

std::string log_text(std::string_view text) {
  // A stranger may send as much text as a packet holds; a log line takes only this much of it.
  constexpr std::size_t kTextBytesMax = 200;
  return '"' + shown_text(text, kTextBytesMax, '"') + '"';
}

}  // namespace hairnet::server
