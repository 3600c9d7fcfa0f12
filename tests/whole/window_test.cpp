#include <gmock/gmock.h>
#include <signal.h>

#include <algorithm>
#include <chrono>
#include <cmath>
#include <cstdlib>
#include <filesystem>
#include <fstream>
#include <stdexcept>
#include <thread>

#include "tests/whole/whole_test.hpp"

namespace hairnet::whole {
namespace {

using ::testing::HasSubstr;

const std::string kCharacter = "groom=made:bob,motion=made:nod,level=low,strands=60";

// Strands in rings about a head's upper half, that lie on it and then hang down; metres, y up.
void write_hair(const std::string& file) {
  // The head is a ball 1.6 m above the floor, of radius 0.1 m to the sides and 0.11 m upwards. A point's angle from the
  // top of the head is `further`. Up to a quarter turn (1.5708) the strand lies on the head, and from there it hangs
  // down.
  constexpr int kRings = 8, kAround = 40, kPoints = 9;
  std::ofstream out(file);
  for (int ring = 0; ring < kRings; ++ring) {
    for (int i = 0; i < kAround; ++i) {
      const double down = 0.15 + 1.3 * ring / kRings, about = 2 * 3.14159265 * i / kAround;
      for (int n = 0; n < kPoints; ++n) {
        const double further = down + 0.25 * n, hangs = std::max(0.0, further - 1.5708), on = std::min(further, 1.5708);
        out << "v " << 0.1 * std::sin(on) * std::sin(about) << ' ' << 1.6 + 0.11 * (std::cos(on) - hangs) << ' '
            << 0.1 * std::sin(on) * std::cos(about) << '\n';
      }
      out << 'l';
      for (int n = kPoints; n > 0; --n) out << ' ' << -n;
      out << '\n';
    }
  }
}

class WindowTest : public WholeTest {
 protected:
  ~WindowTest() override {
    if (!display_) return;
    // Xvfb removes its lock file when it is ended like this.
    display_->send(SIGTERM);
    display_->wait();
  }
  // Starts hairnet-view on a virtual display of this test's own, whose number Xvfb picks and prints.
  std::unique_ptr<Process> start_on_display(const Arguments& more) {
    const Arguments command{"/usr/bin/Xvfb", "-displayfd", "1", "-screen", "0", "640x480x24", "-nolisten", "tcp"};
    display_ = std::make_unique<Process>(command, path("display"));
    if (!wait_for_file(path("display.out"), std::string("0\n").size(), *display_))
      throw std::runtime_error("Xvfb does not start: " + display_->err());
    std::string number;
    std::ifstream(path("display.out")) >> number;
    setenv("DISPLAY", (":" + number).c_str(), 1);
    unsetenv("WAYLAND_DISPLAY");
    Arguments arguments{"--size", "320x240"};
    arguments.insert(arguments.end(), more.begin(), more.end());
    return start("hairnet-view", arguments, "view");
  }
  // A window that draws in software takes the processor from the server's builder, whose priority is low. Without one
  // the levels of the character are there soon.
  void await_levels() {
    auto view = start_view({"--no-draw", "--character", kCharacter, "--duration", "0.1"}, "first");
    finish(*view, 0);
  }
  static bool has_display() { return HAIRNET_HAS_VIEW && std::filesystem::exists("/usr/bin/Xvfb"); }
  [[nodiscard]] std::string server_address() const {
    std::string port;
    std::ifstream(path("server.port")) >> port;
    return "127.0.0.1:" + port;
  }

 private:
  std::unique_ptr<Process> display_;
};

#define SKIP_WITHOUT_DISPLAY() \
  if (!has_display()) GTEST_SKIP() << "NOT TESTED: no Xvfb (Debian: xvfb), or a build without the renderer"

TEST_F(WindowTest, a_window_shows_a_local_world_until_its_duration_is_over) {
  SKIP_WITHOUT_DISPLAY();
  auto view = start_on_display({"--local", "--character", kCharacter, "--duration", "0.3"});
  finish(*view, 0);
  EXPECT_EQ(view->err(), "");
}

TEST_F(WindowTest, a_window_shows_a_room_until_its_duration_is_over) {
  SKIP_WITHOUT_DISPLAY();
  auto server = start_server();
  await_levels();
  auto view = start_on_display({"--connect", server_address(), "--character", kCharacter, "--duration", "0.3"});
  finish(*view, 0);
  EXPECT_EQ(view->err(), "hairnet-view: connected over webtransport\n");
  drain(*server);
}

TEST_F(WindowTest, tells_why_it_is_not_connected_over_webtransport) {
  SKIP_WITHOUT_DISPLAY();
  auto server = start_server({"--webtransport", "off"});
  await_levels();
  auto view = start_on_display({"--connect", server_address(), "--character", kCharacter, "--duration", "0.3"});
  finish(*view, 0);
  EXPECT_EQ(view->err(), "hairnet-view: connected over tcp (the server at 127.0.0.1:" + std::to_string(port()) +
                             " has no WebTransport)\n");
  drain(*server);
}

TEST_F(WindowTest, a_room_that_refuses_all_hair_is_shown_until_the_duration_is_over) {
  SKIP_WITHOUT_DISPLAY();
  // Every groom is larger than 1024 bytes, so the server refuses all of them.
  std::ofstream(path("small.toml")) << "[grooms]\ngroom_bytes_max = 1024\n";
  auto server = start_server({"--config", path("small.toml")});
  auto view = start_on_display({"--connect", server_address(), "--character", kCharacter, "--duration", "0.3"});
  finish(*view, 0);
  drain(*server);
  EXPECT_THAT(server->out(), testing::ContainsRegex("grooms_refused_size [1-9]"));
}

TEST_F(WindowTest, a_window_shows_a_file_as_it_is) {
  SKIP_WITHOUT_DISPLAY();
  write_hair(path("lines.obj"));
  auto view = start_on_display({path("lines.obj"), "--duration", "0.3"});
  finish(*view, 0);
  EXPECT_THAT(view->err(), HasSubstr("lines.obj: taken as"));
}

TEST_F(WindowTest, refuses_a_file_that_is_no_hair) {
  SKIP_WITHOUT_DISPLAY();
  std::ofstream(path("not.hair")) << "not hair at all";
  auto view = start_on_display({path("not.hair")});
  finish(*view, 1);
  EXPECT_TRUE(is_one_line(view->err())) << view->err();
  EXPECT_THAT(view->err(), HasSubstr("not.hair"));
}

TEST_F(WindowTest, without_a_display_one_line_explains_what_to_do) {
  unsetenv("DISPLAY");
  unsetenv("WAYLAND_DISPLAY");
  auto view = start("hairnet-view", {"--local"}, "view");
  finish(*view, 1);
  EXPECT_TRUE(is_one_line(view->err())) << view->err();
  EXPECT_THAT(view->err(), HasSubstr("--no-draw"));
}

TEST_F(WindowTest, a_room_is_kept_alive_until_a_signal_and_left_with_a_goodbye) {
  auto server = start_server();
  auto view = start_view({"--no-draw", "--room", "lobby", "--character", kCharacter + ",at=0.6:0:20", "--duration",
                          "forever", "--reconnect", "forever"});
  // It prints its state on stderr.
  // The wait lasts 200 s at most, since the server has to build the levels first.
  for (int i = 0; i < 10'000 && view->running() && view->err().find("streaming") == std::string::npos; ++i)
    std::this_thread::sleep_for(std::chrono::milliseconds(20));
  ASSERT_THAT(view->err(), HasSubstr("streaming"));
  view->send(SIGTERM);
  finish(*view, 0);
  EXPECT_THAT(view->out(), HasSubstr("frames received"));
  drain(*server);
  EXPECT_THAT(server->out(), HasSubstr("characters_removed 1")) << "it did not say goodbye";
}

TEST_F(WindowTest, the_same_local_world_gives_the_same_trace) {
  for (const char* name : {"first", "second"}) {
    auto view = start("hairnet-view",
                      {"--local", "--character", kCharacter, "--wind", "2", "0", "1", "--turbulence", "0.5",
                       "--duration", "0.5", "--trace", path(name)},
                      name);
    finish(*view, 0);
  }
  const auto bytes = [&](const std::string& name) {
    std::ifstream in(path(name), std::ios::binary);
    return std::string(std::istreambuf_iterator<char>(in), {});
  };
  for (const char* file : {"/frames.npy", "/poses.npy", "/displacements.npy"}) {
    // Two empty files would be equal, too.
    EXPECT_GT(bytes(std::string("first") + file).size(), 500u);
    EXPECT_EQ(bytes(std::string("first") + file), bytes(std::string("second") + file)) << file;
  }
}

}  // namespace
}  // namespace hairnet::whole
