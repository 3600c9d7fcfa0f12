#include "core/closest_name.hpp"

#include <gtest/gtest.h>

namespace hairnet {
namespace {

const std::vector<std::string> kFlags{"local", "out", "size", "tick-rate", "connect"};

TEST(ClosestName, counts_the_letters_that_differ) {
  EXPECT_EQ(edit_distance("", ""), 0u);
  EXPECT_EQ(edit_distance("local", "local"), 0u);
  EXPECT_EQ(edit_distance("", "out"), 3u);
  EXPECT_EQ(edit_distance("tickrate", "tick-rate"), 1u);
  EXPECT_EQ(edit_distance("locla", "local"), 1u) << "swapped with its neighbour";
  EXPECT_EQ(edit_distance("lacol", "local"), 2u);
  EXPECT_EQ(edit_distance("size", "out"), edit_distance("out", "size"));
}

TEST(ClosestName, finds_what_was_probably_meant_and_nothing_else) {
  EXPECT_EQ(closest_name("locla", kFlags), "local");
  EXPECT_EQ(closest_name("tickrate", kFlags), "tick-rate");
  EXPECT_EQ(closest_name("conect", kFlags), "connect");
  // A word that resembles no flag gets no guess: a wrong one would mislead.
  EXPECT_EQ(closest_name("colour", kFlags), "");
  EXPECT_EQ(closest_name("", kFlags), "");
  EXPECT_EQ(closest_name("x", {}), "");
  EXPECT_EQ(closest_name(std::string(100'000, 'l'), kFlags), "");
}

TEST(ClosestName, a_line_about_unexpected_words_names_the_first_flag) {
  const std::vector<std::string> words{"make", "import"};
  // The arguments of unexpected_argument() are the words that were not understood, all flags, and all commands.
  const auto said = [&](std::vector<std::string> unknown) { return unexpected_argument(unknown, kFlags, words); };
  EXPECT_EQ(said({"--locla"}), "there is no flag --locla; did you mean --local?");
  EXPECT_EQ(said({"60", "--tickrate", "--nonsense"}), "there is no flag --tickrate; did you mean --tick-rate?");
  EXPECT_EQ(said({"--sise=4x5"}), "there is no flag --sise; did you mean --size?");
  EXPECT_EQ(said({"--nonsense", "5"}), "there is no flag --nonsense; --help lists all flags");
  EXPECT_EQ(said({"mkae", "bob"}), "'mkae' is not expected here; did you mean 'make'?");
  EXPECT_EQ(said({"-"}), "'-' is not expected here; --help lists what is");
  EXPECT_EQ(said({"--"}), "'--' is not expected here; --help lists what is");
  EXPECT_EQ(said({"--", "--locla"}), "there is no flag --locla; did you mean --local?");
}

}  // namespace
}  // namespace hairnet
