#pragma once

#include <string>
#include <string_view>

namespace hairnet::wire {

// Whether a string may travel: at most kTextBytesMax bytes of valid UTF-8, without control characters (it ends up in
// people's logs and terminals).
bool is_text(std::string_view text);

// `text` made to satisfy is_text: what it forbids becomes '?', what is too long is cut between two characters.
std::string fit_text(std::string_view text);

}  // namespace hairnet::wire
