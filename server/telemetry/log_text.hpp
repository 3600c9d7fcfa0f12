#pragma once

#include <string>
#include <string_view>

namespace hairnet::server {

// Text from outside as the value of a log field: in quotes, on one line, at most 200 bytes of it. ASCII controls become
// '?'. Everything else that could end the line, turn its direction in a terminal or break its encoding is written as
// \uXXXX, or \xXX for a byte that is not UTF-8.
std::string log_text(std::string_view text);

}  // namespace hairnet::server
