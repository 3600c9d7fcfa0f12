#include <gmock/gmock.h>

#include <fstream>
#include <set>

#include "tests/support/learnt.hpp"
#include "tests/whole/frame_comparison.hpp"
#include "tests/whole/whole_test.hpp"

namespace hairnet::whole {
namespace {

using ::testing::ContainsRegex;
using ::testing::HasSubstr;

class Replay : public WholeTest {
 protected:
  static Arguments with(Arguments arguments, const Arguments& more) {
    arguments.insert(arguments.end(), more.begin(), more.end());
    return arguments;
  }
};

TEST_F(Replay, every_received_frame_is_what_the_recording_computes_again) {
  auto server = start_server({"--record", path("recording")});
  auto view = start_view({"--character", "groom=made:long_curly,motion=made:dance,level=high,strands=300",  //
                          "--character", "groom=made:bob,motion=made:teleport,level=low,strands=200",       //
                          "--character", "groom=made:bob,motion=made:shake,level=medium,strands=200",       //
                          "--duration", "2.5", "--trace", path("received")});
  finish(*view, 0);
  drain(*server);
  auto sim = start("hairnet-sim", {"--replay", path("recording"), "--trace", path("computed")}, "sim");
  finish(*sim, 0);
  EXPECT_THAT(sim->out(), HasSubstr("every state hash equal"));
  expect_same_frames("received", "computed");
}

TEST_F(Replay, hair_of_other_materials_in_a_storm_is_computed_again_as_well) {
  auto server = start_server({"--record", path("recording"), "--wind", "1", "0", "1"});
  auto view = start_view({"--character", "groom=made:long_curly,motion=made:nod,level=medium,strands=300,material=soft",
                          "--character", "groom=made:bob,motion=made:shake,level=low,strands=200,material=gelled",
                          "--duration", "2", "--wind", "-3", "0", "2", "--gust", "0.5", "--turbulence", "1.5",
                          "--wind-seed", "5", "--trace", path("received")});
  finish(*view, 0);
  drain(*server);
  auto sim = start("hairnet-sim", {"--replay", path("recording"), "--trace", path("computed")}, "sim");
  finish(*sim, 0);
  EXPECT_THAT(sim->out(), HasSubstr("every state hash equal"));
  expect_same_frames("received", "computed");
}

TEST_F(Replay, two_clients_at_once_each_get_their_own_characters) {
  auto server = start_server({"--record", path("recording")});
  const Arguments shared{"--duration", "1.5", "--pose-rate", "72", "--jitter", "4"};
  Arguments a{"--character", "groom=made:bob,motion=made:nod,level=low,strands=200", "--trace", path("received_a")};
  Arguments b{"--character", "groom=made:bob,motion=made:shake,level=low,strands=200", "--trace", path("received_b")};
  a.insert(a.end(), shared.begin(), shared.end());
  b.insert(b.end(), shared.begin(), shared.end());
  auto view_a = start_view(a, "view_a"), view_b = start_view(b, "view_b");
  finish(*view_a, 0);
  finish(*view_b, 0);
  drain(*server);
  auto sim = start("hairnet-sim", {"--replay", path("recording"), "--trace", path("computed")}, "sim");
  finish(*sim, 0);
  expect_same_frames("received_a", "computed");
  expect_same_frames("received_b", "computed");
  // One room shows everyone, so either trace may begin with the other's character.
  std::set<std::int64_t> characters;
  for (const char* const received : {"received_a", "received_b"})
    for (const auto& [character_and_tick, frame] : Trace(path(received)).by_character_and_tick)
      characters.insert(character_and_tick.first);
  EXPECT_EQ(characters.size(), 2u);
}

TEST_F(Replay, learnt_hair_that_the_client_evaluates_is_computed_again_too) {
  const Arguments character{"--character", "groom=made:bob,motion=made:nod,level=learnt,strands=200"};
  auto builder = start_server({}, "builder");
  finish(*start_view(with(character, {"--duration", "0.2", "--no-draw"}), "upload"), 0);
  drain(*builder);
  // Random weights move hair by 300 mm, and the rounding of poses alone then makes a difference of 10 mm. A tenth of
  // these weights moves hair as much as real hair moves.
  LearntHair hair = support::random_learnt_hair(5);
  for (float& weight : hair.output_weights) weight *= 0.1f;
  put_learnt_hair(hair);

  auto server = start_server({"--record", path("recording")});
  finish(*start_view(with(character, {"--duration", "6", "--trace", path("received")})), 0);
  drain(*server);
  EXPECT_THAT(server->out(), ContainsRegex("frames_evaluated_by_clients [1-9][0-9]"));
  auto sim = start("hairnet-sim", {"--replay", path("recording"), "--trace", path("computed")}, "sim");
  finish(*sim, 0);
  EXPECT_THAT(sim->out(), HasSubstr("every state hash equal"));
  // Of the 180 ticks of 6 s some pass before the levels are ready, and a busy machine skips others.
  EXPECT_GT(expect_same_frames("received", "computed").learnt_frames, 60u);
}

TEST_F(Replay, a_damaged_recording_has_a_plain_reason) {
  auto server = start_server({"--record", path("recording")});
  auto view = start_view(
      {"--character", "groom=made:bob,motion=made:nod,level=low,strands=100", "--duration", "0.5", "--no-draw"});
  finish(*view, 0);
  drain(*server);
  std::ifstream file(path("recording"), std::ios::binary);
  const std::string whole((std::istreambuf_iterator<char>(file)), {});

  std::ofstream(path("cut"), std::ios::binary) << whole.substr(0, whole.size() - 7);
  auto cut = start("hairnet-sim", {"--replay", path("cut")}, "sim_cut");
  finish(*cut, 1);
  EXPECT_THAT(cut->err(), HasSubstr("hairnet-sim: "));

  // The state hash of the last tick is somewhere in the last 64 bytes. With one of its bits changed the recording is
  // valid except for that hash, and the replay must notice. Other changed bytes there may be accepted or refused.
  std::string changed = whole;
  std::size_t differs_at_hash = 0;
  for (std::size_t back = 1; back <= 64 && differs_at_hash == 0; ++back) {
    changed = whole;
    changed[changed.size() - back] = static_cast<char>(changed[changed.size() - back] ^ 1);
    std::ofstream(path("changed"), std::ios::binary | std::ios::trunc) << changed;
    auto sim = start("hairnet-sim", {"--replay", path("changed")}, "sim_changed");
    const int code = sim->wait();
    ASSERT_TRUE(code == 0 || code == 1) << code;
    if (sim->err().find("the state differs") != std::string::npos) differs_at_hash = back;
  }
  EXPECT_GT(differs_at_hash, 0u);
}

}  // namespace
}  // namespace hairnet::whole
