#include <gmock/gmock.h>
#include <gtest/gtest.h>
#include <stdlib.h>

#include <chrono>
#include <filesystem>
#include <memory>
#include <thread>

#include "client/link/link.hpp"
#include "server/transport/io_loop.hpp"
#include "server/transport/listener.hpp"
#include "tests/support/case_name.hpp"

// A Link against the server's own port, by every transport.
namespace hairnet::link {
namespace {

using ::testing::HasSubstr;

constexpr std::size_t kChunkBytes = 200'000;

// Welcomes every client, breaks the first connection when asked to, and records all other messages.
class Welcoming : public server::PacketSink {
 public:
  Welcoming(std::shared_ptr<server::Connection> connection, bool breaks_off, std::size_t& poses)
      : connection_(std::move(connection)), breaks_off_(breaks_off), poses_(poses) {}
  void on_packet(std::span<const std::uint8_t> packet, std::int64_t) override {
    const wire::DecodedPacket decoded = wire::decode_packet(packet);
    ASSERT_EQ(decoded.error, wire::DecodeError::none);
    if (const auto* hello = std::get_if<wire::Hello>(&decoded.envelope.message)) {
      connection_->mark_joined();
      wire::Welcome welcome;
      welcome.session = 42;
      welcome.resumed = hello->session == 42;
      send(welcome);
      send(wire::GroomData{{}, 2 * kChunkBytes, 0, std::vector<std::uint8_t>(kChunkBytes)});
      send(wire::MemberJoined{9, 1, 1, {}});
      if (breaks_off_) connection_->close("as the test wants it");
    } else if (std::holds_alternative<wire::PoseBatch>(decoded.envelope.message)) {
      ++poses_;
    } else if (std::holds_alternative<wire::Goodbye>(decoded.envelope.message)) {
      connection_->close("goodbye");
    }
  }
  void on_broken_stream(std::int64_t) override { ADD_FAILURE() << "broken stream"; }
  void on_writable(std::int64_t) override {}
  void on_closed(std::string_view, std::int64_t) override { connection_->close("closed"); }

 private:
  void send(wire::Message message) { connection_->send(wire::encode_packet({1, std::move(message)})); }
  std::shared_ptr<server::Connection> connection_;
  bool breaks_off_;
  std::size_t& poses_;
};

struct Certificate {
  Certificate() {
    std::string made = (std::filesystem::temp_directory_path() / "hairnet_link_XXXXXX").string();
    if (!::mkdtemp(made.data())) return;
    folder = made;
    const std::string command = std::string(HAIRNET_DEPLOY_DIR) + "/certificate --out " + made + " > /dev/null";
    sound = std::system((command + " 127.0.0.1").c_str()) == 0;
  }
  ~Certificate() { std::filesystem::remove_all(folder); }
  std::filesystem::path folder;
  bool sound = false;
};

class LinkByTransport : public ::testing::TestWithParam<support::Named<Transport>> {
 protected:
  void SetUp() override {
    ASSERT_TRUE(certificate_.sound) << "deploy/certificate failed";
    server::TransportOptions options;
    options.port = 0;
    options.tls = {(certificate_.folder / "chain.pem").string(), (certificate_.folder / "key.pem").string()};
    auto listener = server::Listener::create(
        loop_, options, counters_, [this](std::shared_ptr<server::Connection> c, std::int64_t) {
          const bool breaks_off = breaks_off_ && sinks_.empty();
          sinks_.push_back(std::make_unique<Welcoming>(std::move(c), breaks_off, poses_));
          return sinks_.back().get();
        });
    ASSERT_TRUE(listener) << listener.error();
    listener_ = std::move(*listener);
    options_.server.transport = GetParam().value;
    options_.server.port = listener_->port();
    options_.tls.ca_file = (certificate_.folder / "chain.pem").string();
    thread_ = std::thread([this] { loop_.run(); });
  }
  void TearDown() override {
    if (!thread_.joinable()) return;
    loop_.post([this] { listener_->close(); });
    loop_.stop();
    thread_.join();
  }
  // Polls until an event of that kind arrives; drops the others.
  template <class T>
  static T wait_for(Link& link) {
    while (true) {
      for (Event& event : link.poll()) {
        if (auto* e = std::get_if<T>(&event)) return std::move(*e);
        if (auto* end = std::get_if<Disconnected>(&event)) {
          ADD_FAILURE() << end->detail;
          return {};
        }
      }
      std::this_thread::sleep_for(std::chrono::milliseconds(1));
    }
  }

  Certificate certificate_;
  server::TransportCounters counters_;
  server::IoLoop loop_;
  std::unique_ptr<server::Listener> listener_;
  std::vector<std::unique_ptr<Welcoming>> sinks_;
  std::size_t poses_ = 0;  // the loop's thread, until it has ended
  bool breaks_off_ = false;
  LinkOptions options_;
  std::thread thread_;
};

TEST_P(LinkByTransport, packets_go_both_ways) {
  {
    Link link(options_);
    const Result<wire::Welcome> welcome = link.connect();
    ASSERT_TRUE(welcome) << welcome.error();
    EXPECT_EQ(welcome->session, 42u);
    EXPECT_EQ(wait_for<wire::MemberJoined>(link).member, 9u);
    link.push_poses(std::vector<wire::PoseSample>(4096));  // 700 kB
    link.push_poses(std::vector<wire::PoseSample>(1));
    link.close();
    while (true) {
      const std::vector<Event> events = link.poll();
      if (!events.empty() && std::holds_alternative<Disconnected>(events.back())) break;
      std::this_thread::sleep_for(std::chrono::milliseconds(1));
    }
  }
  TearDown();
  EXPECT_EQ(poses_, 2u);
}

TEST_P(LinkByTransport, a_broken_connection_is_replaced_and_resumed) {
  breaks_off_ = true;
  Link link(options_);
  ASSERT_TRUE(link.connect());
  wait_for<Reconnecting>(link);
  const auto connected = wait_for<Connected>(link);
  EXPECT_TRUE(connected.again);
  EXPECT_TRUE(connected.welcome.resumed);
  EXPECT_EQ(link.counters().resumes, 1u);
}

TEST_P(LinkByTransport, an_untrusted_certificate_is_refused_unless_insecure_is_set) {
  if (!options_.server.encrypted()) return;
  options_.tls.ca_file.clear();
  const Result<wire::Welcome> refused = Link(options_).connect();
  ASSERT_FALSE(refused);
  EXPECT_THAT(refused.error(), HasSubstr("certificate"));
  options_.tls.insecure = true;
  Link link(options_);
  EXPECT_TRUE(link.connect());
}

TEST_P(LinkByTransport, a_certificate_of_another_host_is_refused) {
  if (!options_.server.encrypted()) return;
  options_.server.host = "127.0.0.2";
  const Result<wire::Welcome> refused = Link(options_).connect();
  ASSERT_FALSE(refused);
}

INSTANTIATE_TEST_SUITE_P(Transports, LinkByTransport,
                         ::testing::Values(support::Named{"tcp", Transport::tcp}, support::Named{"tls", Transport::tls},
                                           support::Named{"ws", Transport::ws}, support::Named{"wss", Transport::wss}),
                         support::CaseName());

}  // namespace
}  // namespace hairnet::link
