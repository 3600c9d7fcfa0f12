#include <boost/system/system_error.hpp>
#include <chrono>
#include <fstream>
#include <nlohmann/json.hpp>
#include <thread>

#include "client/assets/made/made.hpp"
#include "client/link/link.hpp"
#include "schema/wire/groom_file.hpp"
#include "tests/whole/lossy_relay.hpp"
#include "tests/whole/whole_test.hpp"

namespace hairnet::whole {
namespace {

using Json = nlohmann::json;

struct Addresses {
  const char* name;
  const char *clients, *server;
};
// The lines are in the order of LossyRelay::Direction: to the server, to the client.
struct Case {
  Addresses addresses{"ipv4", "127.0.0.2", "127.0.0.1"};
  std::array<Line, 2> lines{};
};

// Starts a server, and clients that reach it over WebTransport through a relay, which can lose packets.
class Datagrams : public WholeTest {
 protected:
  void begin(const Case& the) {
    server_ = start_server({"--webtransport", "on", "--bind", the.addresses.server});
    // The seed 7 has no meaning; it makes the losses the same in every run.
    relay_ = std::make_unique<LossyRelay>(the.addresses.clients, the.addresses.server, port(), the.lines, 7);
    const std::string host = the.addresses.clients;
    address_ = (host.find(':') == std::string::npos ? host : "[" + host + "]") + ":" + std::to_string(port());
  }
  std::unique_ptr<Process> start_load() {
    return start(
        "hairnet-load",
        // Five clients with two characters each stay for 10 s, of which the last 6 s are measured.
        {"--server", address_, "--transport", "webtransport", "--pose-hz", "30", "--groom", "made:bob", "--stage",
         "steady:10s:clients=5,characters=2,level=low,warm=4s", "--quiet", "--json", path("load.json")},
        "load");
  }
  // Returns the figures of the run. Exit code 3 means that the generator was late: then its times are not valid, but
  // its counts are.
  Json figures_of(Process& load) {
    const int code = load.wait();
    EXPECT_TRUE(code == 0 || code == 3) << load.out() << load.err();
    return Json::parse(std::ifstream(path("load.json")))["run"]["stages"].back()["figures"];
  }

  std::unique_ptr<Process> server_;
  std::unique_ptr<LossyRelay> relay_;
  std::string address_;
};

void expect_whole_session(const Json& figures) {
  EXPECT_EQ(figures["errors"], 0);
  EXPECT_EQ(figures["restarts"], 0);
  EXPECT_EQ(figures["resumes"], 0);
  EXPECT_EQ(figures["frames_undecodable"], 0);
  // The measured 6 s have 1800 frames of 10 characters at 30 Hz. A busy machine may skip most of the ticks.
  EXPECT_GT(figures["frames"], 500);
}

class DatagramsOverBadLines : public Datagrams, public ::testing::WithParamInterface<Addresses> {};

TEST_P(DatagramsOverBadLines, that_are_lost_cost_nothing_but_themselves) {
  // Both directions lose a twentieth of the packets, repeat some, and let some arrive late.
  const Line bad{.lost = 0.05, .repeated = 0.02, .late = 0.04, .delay_ms = 30};
  try {
    begin({GetParam(), {bad, bad}});
  } catch (const boost::system::system_error& error) {
    GTEST_SKIP() << "NOT TESTED: " << GetParam().name << ": " << error.what();
  }
  const auto load = start_load();
  const Json figures = figures_of(*load);
  expect_whole_session(figures);
  // The relay must really have lost packets, or the test would prove nothing.
  EXPECT_GT(relay_->lost(LossyRelay::to_client), 10u);
  EXPECT_GT(relay_->lost(LossyRelay::to_server), 10u);
  // A twentieth is lost, a few are late, and a busy server skips some.
  EXPECT_GT(figures["frames_missed_share"], 0.02);
  EXPECT_LT(figures["frames_missed_share"], 0.2);
  // A gap of 15 ticks is half a second at 30 Hz: a stalled session, which lost datagrams alone do not explain.
  EXPECT_LT(figures["gap_ticks_max"], 15);
  drain(*server_);
}

INSTANTIATE_TEST_SUITE_P(Of, DatagramsOverBadLines,
                         ::testing::Values(Addresses{"ipv4", "127.0.0.2", "127.0.0.1"},
                                           Addresses{"ipv6_to_ipv4", "::1", "127.0.0.1"},
                                           Addresses{"ipv4_to_ipv6", "127.0.0.1", "::1"}),
                         [](const auto& one) { return std::string(one.param.name); });

TEST_F(Datagrams, of_clients_whose_address_changes_belong_to_the_same_session) {
  begin({});
  const auto load = start_load();
  for (int changes = 0; changes < 3; ++changes) {
    const std::uint64_t before = relay_->passed(LossyRelay::to_client);
    // Some hundred packets pass between the changes, so that each change meets a session in full use.
    while (load->running() && relay_->passed(LossyRelay::to_client) < before + 300)
      std::this_thread::sleep_for(std::chrono::milliseconds(10));
    relay_->change_network();
  }
  ASSERT_TRUE(load->running());
  const Json figures = figures_of(*load);
  expect_whole_session(figures);
  EXPECT_LT(figures["gap_ticks_max"], 15);
  drain(*server_);
}

TEST_F(Datagrams, that_never_arrive_are_replaced_by_the_plain_connection) {
  begin({.lines = {Line{.lost = 1}, Line{.lost = 1}}});
  const auto view = start("hairnet-view",
                          {"--connect", address_, "--character", "groom=made:bob,motion=made:nod,level=low,strands=100",
                           "--duration", "1", "--no-draw"},
                          "view");
  finish(*view, 0);
  EXPECT_NE(view->err().find("connected over tcp"), std::string::npos) << view->err();
  EXPECT_GT(relay_->lost(LossyRelay::to_server), 0u);
  // No packet of UDP has come back, so the frames came over TCP.
  EXPECT_EQ(relay_->passed(LossyRelay::to_client), 0u);
  drain(*server_);
}

// A client whose character turns its head and never rests; it notes the frames that it gets of itself.
class Turning {
 public:
  Turning(link::LinkOptions options, const Groom& groom) : link_(std::move(options)) {
    const auto welcome = link_.connect();
    EXPECT_TRUE(welcome) << welcome.error();
    const auto file = std::make_shared<const std::vector<std::uint8_t>>(wire::encode_groom(groom));
    const wire::GroomHash hash = wire::hash_groom(*file);
    link_.offer_groom(hash, file);
    link_.send(wire::AddCharacter{1, hash, LevelIndex::low});
  }
  // Sends one pose, then receives for one thirtieth of a second.
  void pass() {
    const double t_s = ++poses_ / 30.0;
    wire::PoseSample sample;
    sample.character = 1;
    sample.sequence = static_cast<std::uint32_t>(poses_);
    sample.capture_time_ns = link_.now_ns();
    sample.pose = rigid_pose({Quat(Eigen::AngleAxisd(0.6 * std::sin(5 * t_s), Vec3::UnitY())), Vec3::Zero()});
    link_.push_poses({sample});
    const std::int64_t until_ns = link_.now_ns() + 33'333'333;
    while (link_.now_ns() < until_ns) {
      for (const link::Event& event : link_.poll()) note(event);
      std::this_thread::sleep_for(std::chrono::milliseconds(1));
    }
  }
  template <class Condition>
  void pass_until(Condition condition) {
    while (!condition() && !has_ended_) pass();
    EXPECT_FALSE(has_ended_);
  }
  void forget_gaps() { gap_ns_max_ = 0; }
  [[nodiscard]] double gap_ms_max() const { return 1e-6 * static_cast<double>(gap_ns_max_); }
  [[nodiscard]] int frames_with_hair() const { return with_hair_; }
  [[nodiscard]] int frames_that_lost_it() const { return lost_; }
  [[nodiscard]] const link::Link& link() const { return link_; }

 private:
  void note(const link::Event& event) {
    has_ended_ |= std::holds_alternative<link::Disconnected>(event);
    const auto* batch = std::get_if<link::FrameBatch>(&event);
    if (!batch) return;
    if (frame_ns_) gap_ns_max_ = std::max(gap_ns_max_, link_.now_ns() - *frame_ns_);
    frame_ns_ = link_.now_ns();
    for (const link::Frame& frame : batch->frames) {
      const bool has_hair = frame.basis && frame.level != LevelIndex::rigid;
      with_hair_ += has_hair;
      lost_ += with_hair_ > 0 && !has_hair;
    }
  }

  link::Link link_;
  // The numbers of sent poses, of frames with hair, and of later frames without hair.
  int poses_ = 0, with_hair_ = 0, lost_ = 0;
  bool has_ended_ = false;
  // The arrival of the last frames, and the longest time between two arrivals.
  std::optional<std::int64_t> frame_ns_;
  std::int64_t gap_ns_max_ = 0;
};

TEST_F(Datagrams, that_arrive_at_last_are_used_by_a_session_that_had_to_do_without) {
  begin({.lines = {Line{.lost = 1}, Line{.lost = 1}}});
  link::LinkOptions options;
  options.server = *link::parse_address(address_);
  // WebTransport is tried again after this time; the default is 60 s, too long for a test.
  options.blocked_for = std::chrono::milliseconds(500);
  const auto groom = make_hairstyle("bob", {.strand_count = 100});
  ASSERT_TRUE(groom) << groom.error();
  Turning client(options, *groom);
  // The frames of three seconds arrive over TCP, while attempts to use WebTransport fail.
  client.pass_until([&] { return client.frames_with_hair() > 90; });
  EXPECT_EQ(client.link().transport(), "tcp");
  EXPECT_EQ(client.link().counters().reconnects, 0u);
  client.forget_gaps();
  relay_->repair();
  client.pass_until([&] { return client.link().transport() == "webtransport"; });
  const int frames = client.frames_with_hair();
  client.pass_until([&] { return client.frames_with_hair() > frames + 30; });
  // The session itself moves to the new connection, and no frame is without hair meanwhile.
  EXPECT_EQ(client.link().counters().resumes, 1u);
  EXPECT_EQ(client.frames_that_lost_it(), 0);
  RecordProperty("gap_ms_max", std::to_string(client.gap_ms_max()));
  std::cout << "longest gap between frames: " << client.gap_ms_max() << " ms\n";
}

}  // namespace
}  // namespace hairnet::whole
