#include "schema/wire/text.hpp"

#include <gtest/gtest.h>

#include <random>

#include "schema/wire/messages.hpp"

namespace hairnet::wire {
namespace {

TEST(Text, takes_every_length_of_utf8) {
  EXPECT_TRUE(is_text(""));
  EXPECT_TRUE(is_text("A groom of 12 strands"));
  EXPECT_TRUE(is_text("\u00e9\u6bdb\U0001F487"));
  EXPECT_TRUE(is_text("\U0010FFFF"));
}

TEST(Text, refuses_what_is_not_utf8) {
  EXPECT_FALSE(is_text("\x80")) << "a continuation without a lead";
  EXPECT_FALSE(is_text("\xc3")) << "a lead without a continuation";
  EXPECT_FALSE(is_text("\xc3(")) << "a lead before something else";
  EXPECT_FALSE(is_text("\xc0\xaf")) << "a longer form than needed";
  EXPECT_FALSE(is_text("\xe0\x80\xaf")) << "a longer form than needed";
  EXPECT_FALSE(is_text("\xf0\x80\x80\xaf")) << "a longer form than needed";
  EXPECT_FALSE(is_text("\xed\xa0\x80")) << "half of a surrogate pair";
  EXPECT_FALSE(is_text("\xf4\x90\x80\x80")) << "beyond the last code point";
  EXPECT_FALSE(is_text("\xf8\x88\x80\x80\x80")) << "five bytes";
}

TEST(Text, refuses_control_characters) {
  EXPECT_FALSE(is_text("two\nlines"));
  EXPECT_FALSE(is_text("\x1b[2J"));
  EXPECT_FALSE(is_text(std::string_view("\0", 1)));
  EXPECT_FALSE(is_text("\x7f"));
  // This is a line break of the control characters from 0x80 to 0x9F.
  EXPECT_FALSE(is_text("\u0085"));
}

TEST(Text, is_limited_in_bytes) {
  EXPECT_TRUE(is_text(std::string(kTextBytesMax, 'x')));
  EXPECT_FALSE(is_text(std::string(kTextBytesMax + 1, 'x')));
}

// The last letter has two bytes, of which only one fits. The cut must leave it out as a whole.
TEST(Text, is_cut_between_characters) {
  const std::string before(kTextBytesMax - 1, 'x');
  std::string text = before;
  text += "\u00e9";
  EXPECT_EQ(fit_text(text), before);
}

TEST(Text, has_one_question_mark_for_each_forbidden_character) {
  EXPECT_EQ(fit_text("a\nb"), "a?b");
  // The control character U+0085 has two bytes.
  EXPECT_EQ(fit_text("a\u0085b"), "a?b");
  // The first byte begins a character of two bytes, and the next one does not go on with it.
  EXPECT_EQ(fit_text(std::string("a\xc3") + 'b'), "a?b");
}

TEST(Text, any_text_is_made_to_fit_and_fitting_text_is_unchanged) {
  std::mt19937 random(1);
  for (int round = 0; round < 2000; ++round) {
    std::string any(random() % 40, '\0');
    for (char& c : any) c = static_cast<char>(random() % 256);
    const std::string fitted = fit_text(any);
    EXPECT_TRUE(is_text(fitted));
    EXPECT_EQ(fit_text(fitted), fitted);
    EXPECT_EQ(is_text(any), fitted == any);
  }
}

}  // namespace
}  // namespace hairnet::wire
