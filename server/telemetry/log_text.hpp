#pragma once

#include <string>
#include <string_view>

namespace hairnet::server {

// Text from outside as the value of a log field: in quotes, at most 200 bytes of it, as shown_text writes it.
std::string log_text(std::string_view text);

}  // namespace hairnet::server
