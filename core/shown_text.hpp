#pragma once

#include <cstddef>
#include <cstdint>
#include <string>
#include <string_view>

namespace hairnet {

struct Utf8Character {
  std::uint32_t code = 0;
  // The length of the character. Zero means that the text does not begin with a character of UTF-8.
  std::size_t bytes = 0;
};

// The character that `text` begins with; text must not be empty. Forms that are too long, halves of pairs of UTF-16 and
// codes beyond the last character are none.
Utf8Character first_character(std::string_view text);

// Text of a file or a peer, to be shown in a message or in the log: on one line and valid UTF-8. What could end
// the line, hide, turn the direction of a terminal's text or break its encoding is written as \uXXXX, or \xXX for
// a byte that is no UTF-8; so is a backslash as two, and `quote` with one before it. No more than `bytes_max`
// bytes of `text` are taken; what is cut never leaves half of a character.
std::string shown_text(std::string_view text, std::size_t bytes_max, char quote);

// A word of a file in a message: at most 40 bytes of it, and "..." after a longer one.
std::string shown(std::string_view word);

}  // namespace hairnet
