#pragma once

#include <string>
#include <string_view>

namespace hairnet::wire {

// Whether a string may travel: at most kTextBytesMax bytes of valid UTF-8, without control characters (it ends up in
// people's logs and terminals).
bool is_text(std::string_view text);

// Makes `text` satisfy is_text: forbidden characters become '?', a text that is too long is cut between two characters.
std::string fit_text(std::string_view text);

}  // namespace hairnet::wire
