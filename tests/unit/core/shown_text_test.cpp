#include "core/shown_text.hpp"

#include <gtest/gtest.h>

namespace hairnet {
namespace {

// Takes at most 200 bytes of the text, and escapes single quotes.
std::string written(std::string_view text) {
  return shown_text(text, 200, '\'');
}

TEST(ShownText, of_all_scripts_stays_as_it_is) {
  EXPECT_EQ(written("h\u00e4r \u65e5\u672c \U0001f600 \u0634\u200c\u0639"),
            "h\u00e4r \u65e5\u672c \U0001f600 \u0634\u200c\u0639");
}

TEST(ShownText, what_hides_or_turns_text_or_ends_its_line_is_written_as_its_number) {
  EXPECT_EQ(written("a\nb\x1b[31m\x7f"), "a\\u000ab\\u001b[31m\\u007f");
  EXPECT_EQ(written("a\u2028b\u2029c"), "a\\u2028b\\u2029c");
  EXPECT_EQ(written("\u202a\u202e\u2066\u2069\u200e\u200f\u061c\ufeff"),
            "\\u202a\\u202e\\u2066\\u2069\\u200e\\u200f\\u061c\\ufeff");
  EXPECT_EQ(written("\xc2\x85\xc2\x9b"), "\\u0085\\u009b") << "controls beyond ASCII";
  EXPECT_EQ(written("a\\u2028 'b'"), "a\\\\u2028 \\'b\\'") << "what a file writes is not taken for it";
}

TEST(ShownText, bytes_that_are_not_utf8_are_written_as_their_numbers) {
  EXPECT_EQ(written("\xff"), "\\xff");
  EXPECT_EQ(written("\xe2\x80"), "\\xe2\\x80") << "cut short";
  EXPECT_EQ(written("\xc0\xaf"), "\\xc0\\xaf") << "too long a form";
  EXPECT_EQ(written("\xed\xa0\x80"), "\\xed\\xa0\\x80") << "half of a pair of UTF-16";
  EXPECT_EQ(written("\xf4\x90\x80\x80"), "\\xf4\\x90\\x80\\x80") << "beyond the last character";
}

TEST(ShownText, is_cut_between_two_characters) {
  EXPECT_EQ(written(std::string(199, 'a') + "\u00e4"), std::string(199, 'a'));
  EXPECT_EQ(written(std::string(300, '\xff')).size(), 4 * 200u);
  // shown() takes 40 bytes, and each of these two characters has three: the first one already does not fit.
  EXPECT_EQ(shown(std::string(38, 'a') + "\u65e5\u672c"), std::string(38, 'a') + "...");
  EXPECT_EQ(shown("\u65e5\u672c"), "\u65e5\u672c");
}

}  // namespace
}  // namespace hairnet
