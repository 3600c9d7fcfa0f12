#include <gtest/gtest.h>

#include <cmath>
#include <initializer_list>

#include "client/viewer/characters/options.hpp"

namespace hairnet::viewer {
namespace {

// Parses a command line of hairnet-view. For one that is refused it expects the exit code 2 and one line on stderr.
std::variant<ViewOptions, int> parsed(std::initializer_list<const char*> arguments) {
  std::vector<std::string> texts{"hairnet-view"};
  texts.insert(texts.end(), arguments.begin(), arguments.end());
  std::vector<char*> argv;
  for (std::string& text : texts) argv.push_back(text.data());
  ::testing::internal::CaptureStderr();
  auto options = parse_options(static_cast<int>(argv.size()), argv.data());
  const std::string said = ::testing::internal::GetCapturedStderr();
  if (std::holds_alternative<int>(options)) {
    EXPECT_EQ(std::get<int>(options), 2);
    EXPECT_EQ(std::count(said.begin(), said.end(), '\n'), 1) << said;
  }
  return options;
}

ViewOptions valid(std::initializer_list<const char*> arguments) {
  auto options = parsed(arguments);
  EXPECT_TRUE(std::holds_alternative<ViewOptions>(options));
  return std::holds_alternative<ViewOptions>(options) ? std::get<ViewOptions>(options) : ViewOptions{};
}

bool refused(std::initializer_list<const char*> arguments) {
  return std::holds_alternative<int>(parsed(arguments));
}

// A whole description of one character.
constexpr const char* kOne = "groom=made:bob,motion=made:nod";

TEST(ViewOptions, a_window_opens_unless_something_else_is_asked_for) {
  // Without --local, and without files, a server simulates the hair.
  EXPECT_EQ(valid({"--local"}).output, Output::window);
  EXPECT_EQ(valid({"--character", kOne}).output, Output::window);
  EXPECT_EQ(valid({"--character", kOne, "--no-draw"}).output, Output::none);
  EXPECT_EQ(valid({"--character", kOne, "--trace", "t"}).output, Output::none);
  EXPECT_EQ(valid({"--character", kOne, "--out", "a.png"}).output, Output::pictures);
  EXPECT_EQ(valid({"--character", kOne, "--sheet", "a.png", "--times", "1"}).output, Output::pictures);
  for (const char* video : {"a.mp4", "a.gif", "a.webm", "a.MP4"})
    EXPECT_EQ(valid({"--local", "--character", kOne, "--out", video}).output, Output::video);
}

TEST(ViewOptions, a_simulation_without_characters_shows_one_of_ours_where_there_is_no_window) {
  EXPECT_TRUE(valid({"--local"}).characters.empty()) << "the window lets a person choose";
  for (const char* out : {"a.png", "a.mp4"}) {
    const ViewOptions options = valid({"--local", "--out", out});
    ASSERT_EQ(options.characters.size(), 1u);
    EXPECT_TRUE(options.characters[0].groom.starts_with("made:"));
    EXPECT_TRUE(options.characters[0].motion.starts_with("made:"));
  }
  EXPECT_TRUE(valid({"a.hair", "--out", "a.png"}).characters.empty()) << "the file is shown";
}

TEST(ViewOptions, a_picture_has_an_ending_that_can_be_written) {
  for (const char* name : {"a.jpg", "a.jpeg", "a.bmp", "a", "png", "a.png.txt"}) {
    EXPECT_TRUE(refused({"--local", "--out", name})) << name;
    EXPECT_TRUE(refused({"--local", "--sheet", name, "--times", "1"})) << name;
  }
  EXPECT_TRUE(refused({"--local", "--sheet", "a.mp4", "--times", "1"}));
  EXPECT_EQ(valid({"--local", "--out", "A.PNG"}).output, Output::pictures);
}

TEST(ViewOptions, a_script_touches_hair_that_is_simulated_here_for_pictures_and_videos) {
  EXPECT_FALSE(valid({"--local", "--out", "a.mp4"}).touch);
  EXPECT_EQ(valid({"--local", "--out", "a.mp4", "--touch", "hold"}).touch, TouchScript::hold);
  EXPECT_EQ(valid({"--local", "--out", "a.png", "--touch", "prop"}).touch, TouchScript::prop);
  EXPECT_EQ(valid({"--local", "--trace", "t", "--touch", "stroke"}).touch, TouchScript::stroke);
  EXPECT_TRUE(refused({"--local", "--out", "a.mp4", "--touch", "kick"}));
  EXPECT_TRUE(refused({"--local", "--touch", "pin"})) << "a window has the mouse";
  EXPECT_TRUE(refused({"--character", kOne, "--out", "a.mp4", "--touch", "pin"})) << "a server's hair";
}

TEST(ViewOptions, a_characters_motion_has_a_rest_pose_axes_and_a_unit_or_they_are_found) {
  const BvhImport found = valid({"--character", kOne}).characters[0].bvh;
  EXPECT_EQ(found.rest, RestPose::automatic);
  EXPECT_FALSE(found.up || found.face || found.unit_m);
  const BvhImport given =
      valid({"--character", "groom=made:bob,motion=a.bvh,rest=first,up=+z,face=-y,unit=0.01"}).characters[0].bvh;
  EXPECT_EQ(given.rest, RestPose::first);
  EXPECT_EQ(given.up, Axis::plus_z);
  EXPECT_EQ(given.face, Axis::minus_y);
  EXPECT_EQ(given.unit_m, 0.01);
  EXPECT_TRUE(refused({"--character", "groom=made:bob,motion=a.bvh,rest=last"}));
}

TEST(ViewOptions, files_and_local_are_simulated_here_and_all_else_by_a_server) {
  EXPECT_EQ(valid({"--local"}).source, Source::local);
  EXPECT_EQ(valid({"a.hair", "b.obj"}).source, Source::local);
  EXPECT_EQ(valid({"a.hair", "b.obj"}).files.size(), 2u);
  EXPECT_EQ(valid({"--connect", "here:1", "--observe", "all"}).source, Source::server);
  // These flags say how to reach a server, so they contradict --local.
  for (const char* flag :
       {"--connect", "--transport", "--room", "--token", "--observe", "--reconnect", "--pose-rate", "--jitter"})
    EXPECT_TRUE(refused({"--local", flag,
                         flag == std::string_view("--connect")     ? "a:1"
                         : flag == std::string_view("--transport") ? "auto"
                                                                   : "1"}))
        << flag;
}

TEST(ViewOptions, the_transport_is_one_of_three_words) {
  EXPECT_EQ(valid({"--connect", "here:1"}).transport, link::TransportChoice::automatic);
  EXPECT_EQ(valid({"--connect", "here:1", "--transport", "webtransport"}).transport,
            link::TransportChoice::webtransport);
  EXPECT_EQ(valid({"--connect", "wss://here", "--transport", "address"}).transport, link::TransportChoice::address);
  EXPECT_TRUE(refused({"--connect", "here:1", "--transport", "udp"}));
}

TEST(ViewOptions, a_window_shows_other_characters_by_default) {
  EXPECT_TRUE(valid({"--character", kOne}).observe);
  EXPECT_FALSE(valid({"--character", kOne, "--observe", "nobody"}).observe);
  EXPECT_FALSE(valid({"--character", kOne, "--no-draw"}).observe);
  EXPECT_TRUE(valid({"--connect", "here:1"}).observe);
  EXPECT_TRUE(refused({})) << "nothing is asked for";
  EXPECT_TRUE(refused({"--no-draw"})) << "nobody to show and nobody to see";
}

TEST(ViewOptions, forever_is_a_word_where_no_end_is_needed) {
  EXPECT_TRUE(std::isinf(valid({"--local"}).duration_s));
  EXPECT_EQ(valid({"--local", "--duration", "3"}).duration_s, 3);
  EXPECT_EQ(valid({"--character", kOne, "--out", "a.png"}).duration_s, 6);
  const ViewOptions kept = valid({"--character", kOne, "--no-draw", "--duration", "forever", "--reconnect", "forever"});
  EXPECT_TRUE(std::isinf(kept.duration_s));
  EXPECT_TRUE(std::isinf(kept.reconnect_s));
  // Images, videos and traces end with a file that is complete, so they need an end.
  EXPECT_TRUE(refused({"--character", kOne, "--out", "a.png", "--duration", "forever"}));
  EXPECT_TRUE(refused({"--character", kOne, "--out", "a.mp4", "--duration", "forever"}));
  EXPECT_TRUE(refused({"--character", kOne, "--trace", "t", "--duration", "forever"}));
  EXPECT_TRUE(refused({"--local", "--character", kOne, "--no-draw", "--duration", "forever"}));
}

TEST(ViewOptions, what_cannot_be_is_refused_in_one_line) {
  // The word "forever" alone means no end. A duration has an upper limit, too.
  for (const char* duration : {"0", "-1", "nan", "inf", "ever", "1e9"})
    EXPECT_TRUE(refused({"--character", kOne, "--no-draw", "--duration", duration})) << duration;
  EXPECT_TRUE(refused({"--character", kOne, "--no-draw", "--out", "a.png"}));
  EXPECT_TRUE(refused({"--character", kOne, "--sheet", "a.png", "--times", "1", "--out", "a.mp4"}));
  EXPECT_TRUE(refused({"--character", kOne, "--sheet", "a.png"}));
  EXPECT_TRUE(refused({"--local", "--character", kOne, "--out", "a.mp4", "--trace", "t"}));
  EXPECT_FALSE(refused({"--character", kOne, "--out", "a.mp4", "--trace", "t"})) << "a server's is received anyway";
  EXPECT_TRUE(refused({"--local", "--character", kOne, "--out", "a.mp4", "--times", "1"}));
  EXPECT_TRUE(refused({"--character", kOne, "--out", "a.png", "--times", "1"}));
  // A local world has 10 to 240 ticks a second, and an image 16 to 8192 pixels a side (options.cpp).
  EXPECT_TRUE(refused({"--local", "--tick-rate", "1"}));
  EXPECT_TRUE(refused({"--local", "--frame-rate", "nan"}));
  EXPECT_TRUE(refused({"--local", "--size", "10x10"}));
  EXPECT_TRUE(refused({"--local", "--character", "groom=made:bob,motion=made:nod,at=1"}));
}

TEST(ViewOptions, a_character_may_have_a_place) {
  const ViewOptions options = valid({"--local", "--character", "groom=made:bob,motion=made:nod,at=0.6:-1:20"});
  ASSERT_TRUE(options.characters.at(0).place);
  EXPECT_EQ(*options.characters[0].place, (Place{0.6, -1, 20}));
}

}  // namespace
}  // namespace hairnet::viewer
