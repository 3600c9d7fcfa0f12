#include <fcntl.h>
#include <gmock/gmock.h>
#include <signal.h>
#include <unistd.h>

#include <array>

#include "server/files/descriptor.hpp"
#include "tests/whole/loopback.hpp"
#include "tests/whole/whole_test.hpp"

// Tests what happens to a program whose output nobody reads.
namespace hairnet::whole {
namespace {

using server::Descriptor;
using ::testing::HasSubstr;

// The pipe holds one page, so that it is full at once.
struct Pipe {
  Pipe() {
    std::array<int, 2> ends{-1, -1};
    EXPECT_EQ(::pipe2(ends.data(), O_CLOEXEC), 0);
    EXPECT_GT(::fcntl(ends[1], F_SETPIPE_SZ, 4096), 0);
    read = std::make_unique<Descriptor>(ends[0]);
    write = std::make_unique<Descriptor>(ends[1]);
  }
  std::unique_ptr<Descriptor> read, write;
};

class UnreadOutput : public WholeTest {
 protected:
  std::unique_ptr<Process> start_talkative(int descriptor) {
    return start_server({"--log-level", "debug", "--counters-interval-s", "0.1"}, "server", descriptor);
  }
  // Reads /metrics; -1 when that does not answer.
  [[nodiscard]] double value_of(const std::string& metric) const {
    const std::string page = get(port(), "/metrics"), name = "\n" + metric + " ";
    const std::size_t at = page.find(name);
    return at == std::string::npos ? -1 : std::stod(page.substr(at + name.size()));
  }
  // In this time the counters alone fill the pipe.
  void wait_for_ticks() const {
    constexpr double kTicks = 100;
    double ticks = 0;
    while (ticks >= 0 && ticks < kTicks) ticks = value_of("hairnet_ticks_run_total");
    ASSERT_GE(ticks, kTicks) << "the server does not answer";
  }
  // A client gets frames, pages are answered, and SIGTERM ends the server as always.
  void expect_serves(Process& server) {
    wait_for_ticks();
    auto view = start_view(
        {"--character", "groom=made:bob,motion=made:nod,level=low,strands=100", "--duration", "0.5", "--no-draw"});
    finish(*view, 0);
    EXPECT_THAT(view->out(), HasSubstr("frames received"));
    EXPECT_EQ(get(port(), "/healthz"), "alive\n");
    server.send(SIGTERM);
    EXPECT_EQ(server.wait(60), 0);
  }
};

TEST_F(UnreadOutput, a_server_goes_on_and_ends_though_its_log_is_not_read) {
  Pipe pipe;
  auto server = start_talkative(pipe.write->get());
  pipe.write->close();
  expect_serves(*server);
}

TEST_F(UnreadOutput, a_server_goes_on_and_ends_though_the_reader_of_its_log_is_gone) {
  Pipe pipe;
  auto server = start_talkative(pipe.write->get());
  pipe.write->close();
  pipe.read->close();
  wait_for_ticks();
  EXPECT_GT(value_of("hairnet_log_lines_dropped_total"), 0);
  expect_serves(*server);
}

TEST_F(UnreadOutput, a_server_goes_on_and_ends_on_a_full_disk) {
  const Descriptor full(::open("/dev/full", O_WRONLY | O_CLOEXEC));
  auto server = start_talkative(full.get());
  expect_serves(*server);
}

TEST_F(UnreadOutput, a_reader_who_comes_late_gets_everything) {
  Pipe pipe;
  auto server = start_talkative(pipe.write->get());
  pipe.write->close();
  wait_for_ticks();
  server->send(SIGTERM);
  std::string text;
  std::array<char, 4096> piece;
  while (const ssize_t got = ::read(pipe.read->get(), piece.data(), piece.size()))
    text.append(piece.data(), static_cast<std::size_t>(std::max<ssize_t>(got, 0)));
  EXPECT_EQ(server->wait(60), 0);
  EXPECT_THAT(text, HasSubstr("hairnet-server listening on "));
  EXPECT_THAT(text, HasSubstr("\nhairnet-server stopped\n"));
  EXPECT_THAT(text, HasSubstr(" event=counters "));
}

TEST_F(UnreadOutput, a_tool_ends_and_says_so_when_its_results_cannot_be_written) {
  const std::vector<std::pair<const char*, Arguments>> commands{
      {"hairnet-groom", {"list"}},  {"hairnet-groom", {"--help"}}, {"hairnet-sim", {"--help"}},
      {"hairnet-view", {"--help"}}, {"hairnet-load", {"--list"}},  {"hairnet-server", {"--check", "--port", "0"}},
  };
  for (const auto& [program, arguments] : commands) {
    const Descriptor full(::open("/dev/full", O_WRONLY | O_CLOEXEC));
    EXPECT_EQ(start(program, arguments, "full", full.get())->wait(60), 1) << program;
    Pipe pipe;
    pipe.read->close();
    const int status = start(program, arguments, "gone", pipe.write->get())->wait(60);
    EXPECT_TRUE(status == 1 || status == 128 + SIGPIPE) << program << ": " << status;
  }
}

}  // namespace
}  // namespace hairnet::whole
