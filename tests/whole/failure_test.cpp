#include <gmock/gmock.h>
#include <signal.h>

#include <chrono>
#include <fstream>
#include <thread>

#include "tests/whole/whole_test.hpp"

namespace hairnet::whole {
namespace {

using ::testing::HasSubstr;
using ::testing::Not;
using ::testing::StartsWith;

const std::string kCharacter = "groom=made:bob,motion=made:nod,level=low,strands=100";

class Failure : public WholeTest {
 protected:
  // A client that streams for as long as the test needs it, once it has received frames.
  std::unique_ptr<Process> start_streaming(const std::string& name) {
    auto view = start_view({"--character", kCharacter, "--duration", "600", "--no-draw"}, name);
    // The program prints "streaming" once the lattices have arrived.
    while (view->running() && view->err().find("streaming") == std::string::npos)
      std::this_thread::sleep_for(std::chrono::milliseconds(10));
    EXPECT_TRUE(view->running()) << view->err();
    return view;
  }
};

TEST_F(Failure, a_killed_server_ends_the_client_with_a_plain_reason) {
  auto server = start_server();
  auto view = start_streaming("view");
  server->send(SIGKILL);
  finish(*view, 1);
  // What the client hears first depends on the transport: a reset, silence, or that nothing listens any more.
  EXPECT_THAT(view->err(), testing::ContainsRegex("\nhairnet-view: the (server|connection|peer)[^\n]*\n"));
  EXPECT_THAT(view->out(), HasSubstr("frames received"));
}

TEST_F(Failure, a_draining_server_sends_goodbye_to_its_client) {
  auto server = start_server();
  auto view = start_streaming("view");
  server->send(SIGTERM);
  finish(*view, 1);
  finish(*server, 0);
  EXPECT_THAT(view->err(), HasSubstr("hairnet-view: the server says goodbye"));
}

TEST_F(Failure, the_server_continues_when_a_client_is_killed) {
  auto server = start_server();
  auto first = start_streaming("first");
  first->send(SIGKILL);
  // Process reports a death by a signal as 128 + its number, as a shell does.
  finish(*first, 128 + SIGKILL);
  auto second = start_view({"--character", kCharacter, "--duration", "0.5", "--no-draw"}, "second");
  finish(*second, 0);
  drain(*server);
}

TEST_F(Failure, a_client_without_a_server_has_a_plain_reason) {
  auto view = start(
      "hairnet-view",
      // Nothing listens on port 1.
      {"--connect", "127.0.0.1:1", "--character", "groom=made:bob,motion=made:nod,strands=50", "--no-draw"}, "view");
  finish(*view, 1);
  EXPECT_THAT(view->err(), HasSubstr("cannot connect to 127.0.0.1:1"));
}

struct BadCommand {
  const char* program;
  std::vector<std::string> arguments;
};

// Each command has exactly one mistake. A program that starts anyway would do something else than its user asked for.
TEST_F(Failure, wrong_flags_exit_with_2_and_one_line) {
  const std::vector<BadCommand> commands{
      {"hairnet-view", {}},
      {"hairnet-view", {"--local", "--room", "hall"}},
      {"hairnet-view", {"--no-such-flag"}},
      {"hairnet-view", {"--no-draw", "--character", "groom=made:bob,motion=made:nod,level=best"}},
      {"hairnet-view", {"--no-draw", "--character", "groom=made:bob,motion=made:nod,colour=plaid"}},
      {"hairnet-view", {"--no-draw", "--character", "groom=made:bob,motion=made:nod,material=wood"}},
      {"hairnet-view", {"--no-draw", "--character", kCharacter, "--wind", "1", "2", "inf"}},
      {"hairnet-view", {"--no-draw", "--character", kCharacter, "--connect", "here:"}},
      {"hairnet-view", {"--no-draw", "--character", kCharacter, "--connect", "here:70000"}},
      {"hairnet-view", {"--no-draw", "--character", kCharacter, "--duration", "nan"}},
      {"hairnet-view", {"--character", kCharacter, "--sheet", "a.png"}},
      {"hairnet-view", {"--character", kCharacter, "--sheet", "a.png", "--times", "0.5,,1"}},
      {"hairnet-view", {"--character", kCharacter, "--sheet", "a.png", "--times", "99"}},
      {"hairnet-view", {"--character", kCharacter, "--out", "a.png", "--size", "0x5"}},
      {"hairnet-view", {"--character", kCharacter, "--out", "a.png", "--views", "top"}},
      {"hairnet-sim", {}},
      {"hairnet-sim", {"--groom", "made:bob", "--motion", "made:nod", "--level", "rigid"}},
      {"hairnet-sim", {"--groom", "made:bob", "--motion", "made:nod", "--rate", "0"}},
      {"hairnet-sim", {"--groom", "made:bob", "--motion", "made:nod", "--wind", "1", "nan", "0"}},
      {"hairnet-sim", {"--groom", "made:bob", "--motion", "made:nod", "--wind", "100", "0", "0"}},
      {"hairnet-sim", {"--groom", "made:bob", "--motion", "made:nod", "--gust", "2"}},
      {"hairnet-sim", {"--groom", "made:bob", "--motion", "made:nod", "--turbulence-scale", "nan"}},
      {"hairnet-sim", {"--groom", "made:bob", "--dump-model", "a.json", "--turbulence", "1"}},
      {"hairnet-sim", {"--groom", "made:bob", "--motion", "made:nod", "--material", "wood"}},
      {"hairnet-groom", {"make", "bob", "--out", "a.groom", "--material", "wood"}},
      {"hairnet-groom", {"make", "bob", "--out", "a.groom", "--group-material", "wet"}},
      {"hairnet-sim", {"--groom", "made:bob", "--motion", "made:nod", "--solver", "fast"}},
      {"hairnet-sim", {"--groom", "made:bob", "--motion", "made:nod", "--up", "+w"}},
      {"hairnet-sim", {"--replay", "a", "--groom", "made:bob"}},
      {"hairnet-sim", {"--replay", "a", "--out", "b.npy"}},
      {"hairnet-sim", {"--groom", "made:bob", "--motion", "made:nod", "--trace", "a"}},
      {"hairnet-server", {"--tick-rate", "0"}},
      {"hairnet-server", {"--wind", "0", "0"}},
      {"hairnet-server", {"--wind-from-clients", "perhaps"}},
  };
  for (std::size_t i = 0; i < commands.size(); ++i) {
    auto process = start(commands[i].program, commands[i].arguments, "bad_" + std::to_string(i));
    EXPECT_EQ(process->wait(), 2) << i << ": " << process->err();
    EXPECT_TRUE(is_one_line(process->err())) << i << ": " << process->err();
    EXPECT_THAT(process->err(), StartsWith(std::string(commands[i].program) + ": ")) << i;
  }
}

TEST_F(Failure, unusable_files_exit_with_1_and_name_the_file) {
  std::ofstream(path("empty")).flush();
  std::ofstream(path("text")) << "this is no groom, no motion and no recording, but long enough to be looked at";
  const std::vector<BadCommand> commands{
      {"hairnet-sim", {"--groom", path("absent"), "--motion", "made:nod"}},
      {"hairnet-sim", {"--groom", path("empty"), "--motion", "made:nod"}},
      {"hairnet-sim", {"--groom", path("text"), "--motion", "made:nod"}},
      {"hairnet-sim", {"--groom", "made:bob", "--strands", "50", "--motion", path("text")}},
      {"hairnet-sim", {"--replay", path("text")}},
      {"hairnet-sim",
       {"--groom", "made:bob", "--strands", "50", "--motion", "made:nod", "--out", path("no/such/a.npy")}},
      {"hairnet-view", {"--no-draw", "--character", "groom=" + path("text") + ",motion=made:nod"}},
  };
  for (std::size_t i = 0; i < commands.size(); ++i) {
    auto process = start(commands[i].program, commands[i].arguments, "bad_" + std::to_string(i));
    EXPECT_EQ(process->wait(), 1) << i << ": " << process->err();
    EXPECT_THAT(process->err(), HasSubstr(path(""))) << i;
  }
}

}  // namespace
}  // namespace hairnet::whole
