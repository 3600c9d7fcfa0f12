#include <signal.h>

#include <array>
#include <chrono>
#include <functional>
#include <thread>

#include "client/link/link.hpp"
#include "tests/whole/whole_test.hpp"

namespace hairnet::whole {
namespace {

using std::chrono::steady_clock;

constexpr std::array kTransports{"tcp", "tls", "ws", "wss", "webtransport"};

// Starts a server that accepts every transport. The tests stop a program by SIGSTOP. A stopped program sends nothing,
// but its operating system continues to acknowledge TCP segments, so the peer's socket reports no error.
class SilenceTest : public WholeTest {
 protected:
  void SetUp() override {
    WholeTest::SetUp();
    Process certificate({HAIRNET_SOURCE_DIR "/deploy/certificate", "--out", path("tls"), "127.0.0.1"},
                        path("certificate"));
    ASSERT_EQ(certificate.wait(), 0) << certificate.err();
    server_ = start_server({"--tls-certificate", path("tls/chain.pem"), "--tls-key", path("tls/key.pem")});
  }
  [[nodiscard]] std::string address_of(const std::string& transport) const {
    const std::string place = "127.0.0.1:" + std::to_string(port());
    return transport == "webtransport" ? place : transport + "://" + place;
  }
  // Returns whether the condition becomes true within 60 s, which is far longer than the limit of a silence, 10 s.
  static bool wait_for(const std::function<bool()>& condition) {
    const auto end = steady_clock::now() + std::chrono::seconds(60);
    while (!condition()) {
      if (steady_clock::now() > end) return false;
      std::this_thread::sleep_for(std::chrono::milliseconds(20));
    }
    return true;
  }
  std::unique_ptr<Process> server_;
};

// Without this a client whose server or network dies silently would show frozen hair: a TCP socket does not report
// such a death.
TEST_F(SilenceTest, of_a_server_is_noticed_over_every_transport_and_its_return_too) {
  std::vector<std::unique_ptr<link::Link>> links;
  for (const std::string transport : kTransports) {
    link::LinkOptions options;
    options.server = *link::parse_address(address_of(transport));
    options.tls.insecure = true;
    options.transport =
        transport == "webtransport" ? link::TransportChoice::webtransport : link::TransportChoice::address;
    links.push_back(std::make_unique<link::Link>(options));
    const auto welcome = links.back()->connect();
    ASSERT_TRUE(welcome) << transport << ": " << welcome.error();
    EXPECT_EQ(links.back()->transport(), transport);
  }
  std::array<int, kTransports.size()> lost{}, back{};
  const auto look = [&] {
    for (std::size_t i = 0; i < links.size(); ++i) {
      for (const link::Event& event : links[i]->poll()) {
        lost[i] += std::holds_alternative<link::Reconnecting>(event);
        const auto* connected = std::get_if<link::Connected>(&event);
        back[i] += connected != nullptr && connected->again;
        EXPECT_FALSE(std::holds_alternative<link::Disconnected>(event)) << kTransports[i];
      }
    }
  };
  const auto all = [](const auto& counts) { return std::ranges::all_of(counts, [](int count) { return count > 0; }); };
  // The limit of a silence is 10 s (kSilence_ms in schema/limits.hpp). For longer than that nothing happens here.
  const auto quiet_end = steady_clock::now() + std::chrono::seconds(12);
  wait_for([&] { return look(), steady_clock::now() > quiet_end; });
  EXPECT_EQ(lost, (std::array<int, kTransports.size()>{})) << "where nothing happens, signs of life are enough";
  server_->send(SIGSTOP);
  EXPECT_TRUE(wait_for([&] { return look(), all(lost); }));
  for (std::size_t i = 0; i < links.size(); ++i) {
    // The system's own timer may end a QUIC connection first.
    if (kTransports[i] != std::string("webtransport")) {
      EXPECT_EQ(links[i]->counters().servers_silent, 1u) << kTransports[i];
    }
  }
  server_->send(SIGCONT);
  EXPECT_TRUE(wait_for([&] { return look(), all(back); }));
  links.clear();
  drain(*server_);
}

// Without this the characters of a client that died silently would stay in the room. A client on another connection
// observes who leaves.
TEST_F(SilenceTest, of_a_client_is_noticed_over_every_transport) {
  link::LinkOptions options;
  options.server = *link::parse_address(address_of("tcp"));
  options.transport = link::TransportChoice::address;
  link::Link observer(options);
  ASSERT_TRUE(observer.connect());
  std::size_t joined = 0, left = 0;
  const auto look = [&] {
    for (const link::Event& event : observer.poll()) {
      joined += std::holds_alternative<wire::MemberJoined>(event);
      left += std::holds_alternative<wire::MemberLeft>(event);
    }
  };
  std::vector<std::unique_ptr<Process>> views;
  for (const std::string transport : kTransports)
    views.push_back(start("hairnet-view",
                          {"--connect", address_of(transport), "--insecure", "--transport",
                           transport == "webtransport" ? "webtransport" : "address", "--no-draw", "--duration",
                           "forever", "--character", "groom=made:bob,strands=50,level=rigid"},
                          "view_" + transport));
  EXPECT_TRUE(wait_for([&] { return look(), joined == kTransports.size(); })) << joined;
  const auto quiet_end = steady_clock::now() + std::chrono::seconds(12);
  wait_for([&] { return look(), steady_clock::now() > quiet_end; });
  // All clients are alive, so nobody may have left after more than the limit of 10 s (kSilence_ms in
  // schema/limits.hpp).
  EXPECT_EQ(left, 0u);
  for (const auto& view : views) view->send(SIGSTOP);
  EXPECT_TRUE(wait_for([&] { return look(), left == kTransports.size(); })) << left;
  for (const auto& view : views) view->send(SIGKILL);
  observer.close();
  drain(*server_);
}

}  // namespace
}  // namespace hairnet::whole
