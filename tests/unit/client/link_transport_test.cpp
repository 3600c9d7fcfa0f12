#include <gmock/gmock.h>
#include <gtest/gtest.h>
#include <stdlib.h>

#include <algorithm>
#include <array>
#include <atomic>
#include <boost/asio.hpp>
#include <chrono>
#include <deque>
#include <filesystem>
#include <iterator>
#include <memory>
#include <thread>

#include "client/link/link.hpp"
#include "client/link/server_stream.hpp"
#include "server/transport/io_loop.hpp"
#include "server/transport/listener.hpp"
#include "tests/support/case_name.hpp"
#include "tests/unit/client/page_in_front.hpp"

// Tests Link against the port of the real server, over every transport.
namespace hairnet::link {
namespace {

using ::testing::HasSubstr;

// The server sends a groom piece of this size after each welcome.
constexpr std::size_t kChunkBytes = 200'000;
// The server listens there too, but its certificate does not name it.
constexpr const char* kOtherHost = "127.0.0.2";

// Welcomes every client, breaks the first connection when asked to, and records all other messages.
class Welcoming : public server::PacketSink {
 public:
  Welcoming(std::shared_ptr<server::Connection> connection, bool breaks_off, std::atomic<std::size_t>& poses)
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
    } else if (const auto* batch = std::get_if<wire::PoseBatch>(&decoded.envelope.message)) {
      // An empty batch is a sign of life.
      if (!batch->poses.empty()) ++poses_;
    } else if (std::holds_alternative<wire::Goodbye>(decoded.envelope.message)) {
      connection_->close("goodbye");
    }
  }
  void on_datagram(std::span<const std::uint8_t> bytes, std::int64_t now_ns) override { on_packet(bytes, now_ns); }
  void on_broken_stream(std::int64_t) override { ADD_FAILURE() << "broken stream"; }
  void on_writable(std::int64_t) override {}
  void on_closed(std::string_view, std::int64_t) override { connection_->close("closed"); }

 private:
  void send(wire::Message message) { connection_->send(wire::encode_packet({1, std::move(message)})); }
  std::shared_ptr<server::Connection> connection_;
  bool breaks_off_;
  std::atomic<std::size_t>& poses_;
};

// Makes a certificate for 127.0.0.1 with deploy/certificate, in a folder of its own that is removed at the end.
struct Certificate {
  Certificate() {
    std::string made = (std::filesystem::temp_directory_path() / "hairnet_link_XXXXXX").string();
    if (!::mkdtemp(made.data())) return;
    folder = made;
    const std::string command = std::string(HAIRNET_DEPLOY_DIR) + "/certificate --out " + made + " > /dev/null";
    valid = std::system((command + " 127.0.0.1").c_str()) == 0;
  }
  ~Certificate() { std::filesystem::remove_all(folder); }
  std::filesystem::path folder;
  bool valid = false;
};

// Gives each test a server at a free port, which takes every transport. Tests set `options_` and `breaks_off_` before
// they connect a Link.
class LinkAndPort : public ::testing::Test {
 protected:
  // Starts the server on a thread of its own. Without a certificate, it makes one for WebTransport itself, and names
  // its hash in its page.
  void listen(bool has_certificate, bool has_webtransport = true) {
    ASSERT_TRUE(certificate_.valid) << "deploy/certificate failed";
    server::TransportOptions options;
    options.port = 0;
    options.addresses.emplace_back(kOtherHost);
    options.webtransport = has_webtransport;
    options.ping_after = ping_after_;
    if (has_certificate)
      options.tls = {(certificate_.folder / "chain.pem").string(), (certificate_.folder / "key.pem").string()};
    auto listener = server::Listener::create(
        loop_, options, counters_, [this](std::shared_ptr<server::Connection> c, std::int64_t) {
          const bool breaks_off = breaks_off_ && sinks_.empty();
          sinks_.push_back(std::make_unique<Welcoming>(std::move(c), breaks_off, poses_));
          return sinks_.back().get();
        });
    ASSERT_TRUE(listener) << listener.error();
    listener_ = std::move(*listener);
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
  // The link's next event. A test has one link.
  Event next_event(Link& link) {
    while (events_.empty()) {
      std::ranges::move(link.poll(), std::back_inserter(events_));
      if (events_.empty()) std::this_thread::sleep_for(std::chrono::milliseconds(1));
    }
    Event event = std::move(events_.front());
    events_.pop_front();
    return event;
  }
  // Waits until an event of that kind arrives; drops those before it.
  template <class T>
  T wait_for(Link& link) {
    while (true) {
      Event event = next_event(link);
      if (auto* e = std::get_if<T>(&event)) return std::move(*e);
      if (auto* end = std::get_if<Disconnected>(&event)) {
        ADD_FAILURE() << end->detail;
        return {};
      }
    }
  }

  void wait_for_end(Link& link) {
    while (!std::holds_alternative<Disconnected>(next_event(link))) continue;
  }

  Certificate certificate_;
  server::TransportCounters counters_;
  server::IoLoop loop_;
  std::unique_ptr<server::Listener> listener_;
  std::vector<std::unique_ptr<Welcoming>> sinks_;
  std::atomic<std::size_t> poses_ = 0;
  bool breaks_off_ = false;
  std::deque<Event> events_;
  std::chrono::milliseconds ping_after_ = server::TransportOptions().ping_after;
  LinkOptions options_;
  std::thread thread_;
};

struct Way {
  Transport transport;
  TransportChoice choice;
};

class LinkByTransport : public LinkAndPort, public ::testing::WithParamInterface<support::Named<Way>> {
 protected:
  void SetUp() override {
    listen(true);
    options_.server.transport = GetParam().value.transport;
    options_.transport = GetParam().value.choice;
  }
};

TEST_P(LinkByTransport, packets_go_both_ways) {
  {
    Link link(options_);
    const Result<wire::Welcome> welcome = link.connect();
    ASSERT_TRUE(welcome) << welcome.error();
    EXPECT_EQ(welcome->session, 42u);
    EXPECT_EQ(link.transport(), options_.transport == TransportChoice::address ? to_string(options_.server.transport)
                                                                               : std::string_view("webtransport"));
    EXPECT_EQ(wait_for<wire::MemberJoined>(link).member, 9u);
    // These poses take 700 kB, so that no transport sends them at once.
    link.push_poses(std::vector<wire::PoseSample>(4096));
    wire::PoseSample jump;
    // A teleport never travels in a datagram, so it cannot get lost.
    jump.teleport = true;
    link.push_poses({jump});
    while (poses_ < 2) std::this_thread::sleep_for(std::chrono::milliseconds(1));
    link.close();
    wait_for_end(link);
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

class LinkByEncryptedTransport : public LinkByTransport {};

TEST_P(LinkByEncryptedTransport, an_untrusted_certificate_is_refused_unless_insecure_is_set) {
  options_.tls.ca_file.clear();
  const Result<wire::Welcome> refused = Link(options_).connect();
  ASSERT_FALSE(refused);
  EXPECT_THAT(refused.error(), HasSubstr("certificate"));
  options_.tls.insecure = true;
  Link link(options_);
  EXPECT_TRUE(link.connect());
}

TEST_P(LinkByEncryptedTransport, a_certificate_of_another_host_is_refused) {
  options_.server.host = kOtherHost;
  const Result<wire::Welcome> refused = Link(options_).connect();
  ASSERT_FALSE(refused);
  EXPECT_THAT(refused.error(), HasSubstr("certificate"));
  EXPECT_TRUE(sinks_.empty());
}

constexpr TransportChoice kAddress = TransportChoice::address, kWebTransport = TransportChoice::webtransport,
                          kAutomatic = TransportChoice::automatic;
const auto kEncryptedWays = ::testing::Values(support::Named{"tls", Way{Transport::tls, kAddress}},
                                              support::Named{"wss", Way{Transport::wss, kAddress}},
                                              support::Named{"webtransport", Way{Transport::tcp, kWebTransport}},
                                              support::Named{"webtransport_by_tls", Way{Transport::wss, kWebTransport}},
                                              support::Named{"automatic", Way{Transport::tls, kAutomatic}});
INSTANTIATE_TEST_SUITE_P(PlainTransports, LinkByTransport,
                         ::testing::Values(support::Named{"tcp", Way{Transport::tcp, kAddress}},
                                           support::Named{"ws", Way{Transport::ws, kAddress}}),
                         support::CaseName());
INSTANTIATE_TEST_SUITE_P(Transports, LinkByTransport, kEncryptedWays, support::CaseName());
INSTANTIATE_TEST_SUITE_P(Transports, LinkByEncryptedTransport, kEncryptedWays, support::CaseName());

// Tests which transport a Link chooses (TransportChoice::automatic is the default), and what makes it fall back to the
// transport of the address.
class LinkChooses : public LinkAndPort {
 protected:
  std::string transport_after_connect() {
    Link link(options_);
    const Result<wire::Welcome> welcome = link.connect();
    EXPECT_TRUE(welcome) << welcome.error();
    fallback_reason_ = link.fallback_reason();
    return link.transport();
  }
  std::string fallback_reason_;
};

TEST_F(LinkChooses, webtransport_by_itself_with_the_certificate_that_the_page_names) {
  listen(false);
  EXPECT_EQ(transport_after_connect(), "webtransport");
  EXPECT_EQ(fallback_reason_, "");
}

// A client must work with a server that has no WebTransport, and say why it does not use it.
TEST_F(LinkChooses, the_address_where_the_server_has_no_webtransport) {
  listen(false, false);
  EXPECT_EQ(transport_after_connect(), "tcp");
  EXPECT_THAT(fallback_reason_, HasSubstr("has no WebTransport"));
  options_.transport = TransportChoice::address;
  EXPECT_EQ(transport_after_connect(), "tcp");
  EXPECT_EQ(fallback_reason_, "") << "it was not asked for";
  options_.transport = TransportChoice::automatic;
  options_.server.transport = Transport::ws;
  EXPECT_EQ(transport_after_connect(), "ws");
  options_.transport = TransportChoice::webtransport;
  const Result<wire::Welcome> refused = Link(options_).connect();
  ASSERT_FALSE(refused);
  EXPECT_THAT(refused.error(), HasSubstr("no WebTransport"));
}

TEST_F(LinkChooses, the_address_where_the_certificate_is_not_to_be_trusted) {
  listen(true);
  options_.tls.ca_file.clear();
  EXPECT_EQ(transport_after_connect(), "tcp");
  EXPECT_THAT(fallback_reason_, HasSubstr("its certificate is refused"));
}

std::string page_of(std::uint16_t port, const std::string& hashes) {
  return "{\"port\":" + std::to_string(port) + R"(,"path":"/wt","hashes":[)" + hashes + "]}";
}
// Returns a port at which nothing listens any more.
std::uint16_t closed_udp_port() {
  boost::asio::io_context io;
  return boost::asio::ip::udp::socket(io, {boost::asio::ip::address_v4::loopback(), 0}).local_endpoint().port();
}
// The form of a SHA-256 hash in base64: 32 bytes, all zero, which no certificate has.
const std::string kWrongHash = '"' + std::string(43, 'A') + "=\"";

TEST_F(LinkChooses, the_address_where_udp_is_not_answered_and_does_not_ask_again_soon) {
  listen(false);
  breaks_off_ = true;
  boost::asio::io_context io;
  // The socket takes packets and never answers, as behind a firewall that drops UDP.
  const boost::asio::ip::udp::socket silent(io, {boost::asio::ip::address_v4::loopback(), 0});
  const PageInFront front(page_of(silent.local_endpoint().port(), ""), listener_->port());
  options_.server.port = front.port();
  Link link(options_);
  const Result<wire::Welcome> welcome = link.connect();
  ASSERT_TRUE(welcome) << welcome.error();
  wait_for<Reconnecting>(link);
  wait_for<Connected>(link);
  EXPECT_EQ(link.transport(), "tcp");
  // The wait is kWebTransportWait. The second connection does not wait again: its page is not even read before
  // `blocked_for`, 60 s by default, has passed.
  EXPECT_THAT(link.fallback_reason(), HasSubstr(" within 3 s"));
  EXPECT_EQ(front.pages_asked(), 1);
  link.close();
  wait_for_end(link);
}

TEST_F(LinkChooses, webtransport_after_all_once_udp_is_answered_and_resumes_its_session_there) {
  listen(false);
  PageInFront front(page_of(closed_udp_port(), ""), listener_->port());
  options_.server.port = front.port();
  // The default of 60 s would be too long for a test.
  options_.blocked_for = std::chrono::milliseconds(20);
  Link link(options_);
  ASSERT_TRUE(link.connect());
  // The first request is that of the connection. Three more come from tries that fail, since nothing listens at the UDP
  // port.
  while (front.pages_asked() < 4) std::this_thread::sleep_for(std::chrono::milliseconds(1));
  EXPECT_EQ(link.transport(), "tcp");
  EXPECT_EQ(link.counters().reconnects, 0u) << "tries that fail do not disturb it";
  front.step_aside();
  EXPECT_THAT(wait_for<Reconnecting>(link).detail, HasSubstr("WebTransport"));
  const auto connected = wait_for<Connected>(link);
  EXPECT_TRUE(connected.again && connected.welcome.resumed);
  EXPECT_EQ(link.transport(), "webtransport");
  EXPECT_EQ(link.fallback_reason(), "");
  const int asked = front.pages_asked();
  std::this_thread::sleep_for(3 * options_.blocked_for);
  EXPECT_EQ(front.pages_asked(), asked) << "it has what it wanted";
  EXPECT_EQ(link.counters().resumes, 1u);
  link.close();
  wait_for_end(link);
}

// WebTransport would replace the connection, which a link that may not reconnect must not risk.
TEST_F(LinkChooses, to_stay_where_it_is_when_it_may_not_reconnect) {
  listen(false);
  PageInFront front(page_of(closed_udp_port(), ""), listener_->port());
  options_.server.port = front.port();
  options_.blocked_for = std::chrono::milliseconds(20);
  options_.core.reconnect = false;
  Link link(options_);
  ASSERT_TRUE(link.connect());
  std::this_thread::sleep_for(5 * options_.blocked_for);
  EXPECT_EQ(front.pages_asked(), 1);
  EXPECT_EQ(link.transport(), "tcp");
  link.close();
  wait_for_end(link);
}

TEST_F(LinkChooses, to_end_at_once_while_it_tries_webtransport_again) {
  listen(false);
  boost::asio::io_context io;
  boost::asio::ip::udp::socket silent(io, {boost::asio::ip::address_v4::loopback(), 0});
  const PageInFront front(page_of(silent.local_endpoint().port(), ""), listener_->port());
  options_.server.port = front.port();
  options_.blocked_for = std::chrono::milliseconds(20);
  Link link(options_);
  ASSERT_TRUE(link.connect());
  while (front.pages_asked() < 2) std::this_thread::sleep_for(std::chrono::milliseconds(1));
  // Another try is under way, and waits for an answer that never comes. The end of the link must not wait for it.
  std::this_thread::sleep_for(std::chrono::milliseconds(100));
  link.close();
  wait_for_end(link);
}

TEST_F(LinkChooses, the_address_where_the_page_takes_too_long_to_shake_hands) {
  listen(true);
  // The first connection, which asks for the page, never gets past its TLS handshake.
  const SilentAtFirst front(listener_->port());
  options_.server.port = front.port();
  options_.server.transport = Transport::tls;
  // This is less than the 3 s of kWebTransportWait, and the address must still be tried in time.
  options_.core.connect_timeout_s = 2.5;
  EXPECT_EQ(transport_after_connect(), "tls");
}

TEST_F(LinkChooses, the_address_where_the_udp_port_is_closed) {
  listen(false);
  const PageInFront front(page_of(closed_udp_port(), ""), listener_->port());
  options_.server.port = front.port();
  EXPECT_EQ(transport_after_connect(), "tcp");
  EXPECT_THAT(fallback_reason_, HasSubstr("nothing listens on its UDP port"));
  options_.transport = TransportChoice::webtransport;
  const Result<wire::Welcome> refused = Link(options_).connect();
  ASSERT_FALSE(refused);
  EXPECT_THAT(refused.error(), HasSubstr("nothing listens on its UDP port"));
}

TEST_F(LinkChooses, no_server_whose_certificate_the_page_does_not_name) {
  listen(false);
  const PageInFront front(page_of(listener_->port(), kWrongHash), listener_->port());
  options_.server.port = front.port();
  options_.transport = TransportChoice::webtransport;
  const Result<wire::Welcome> refused = Link(options_).connect();
  ASSERT_FALSE(refused);
  EXPECT_THAT(refused.error(), HasSubstr("its certificate is refused (it is none of those that its page"));
  EXPECT_EQ(counters_.connections_opened_webtransport.value(), 0u);
}

TEST_F(LinkChooses, the_address_where_the_page_is_damaged) {
  listen(false);
  const PageInFront front("{\"port\":", listener_->port());
  options_.server.port = front.port();
  EXPECT_EQ(transport_after_connect(), "tcp");
}

// Answers a packet with `count` datagrams, each of which holds its number.
class Flooding : public server::PacketSink {
 public:
  Flooding(std::shared_ptr<server::Connection> connection, std::uint32_t count)
      : connection_(std::move(connection)), count_(count) {}
  void on_packet(std::span<const std::uint8_t>, std::int64_t) override {
    for (std::uint32_t n = 0; n < count_; ++n) {
      ASSERT_TRUE(connection_->takes_datagrams());
      std::vector<std::uint8_t> bytes(sizeof n);
      std::memcpy(bytes.data(), &n, sizeof n);
      connection_->send_datagram(std::move(bytes));
    }
  }
  void on_broken_stream(std::int64_t) override {}
  void on_writable(std::int64_t) override {}
  void on_closed(std::string_view, std::int64_t) override {}

 private:
  std::shared_ptr<server::Connection> connection_;
  std::uint32_t count_;
};

// Drives a WebTransport stream on the thread of the test, without a Link.
class LinkStream : public LinkAndPort {
 protected:
  void TearDown() override {
    LinkAndPort::TearDown();
    // The listener tells `sink_` that its connection ends, so it must go first.
    listener_.reset();
  }
  template <class T>
  T result_of(asio::awaitable<T> task) {
    std::optional<T> result;
    asio::co_spawn(
        io_, [&]() -> asio::awaitable<void> { result = co_await std::move(task); }, asio::detached);
    while (!result) io_.run_one();
    return std::move(*result);
  }
  std::unique_ptr<Flooding> sink_;
  asio::io_context io_;
  const asio::executor_work_guard<asio::io_context::executor_type> work_ = asio::make_work_guard(io_);
};

TEST_F(LinkStream, ends_when_the_system_refuses_to_send_to_a_closed_udp_port) {
  listen(false);
  const auto stream = make_web_transport_stream(io_, {options_.server, options_.tls});
  ASSERT_EQ(result_of(stream->open()), "");
  TearDown();
  // The server is gone, so the system answers packets with an ICMP error, which a later write gets.
  const std::vector<std::uint8_t> packet = wire::encode_packet({1, wire::PoseBatch{}});
  bool is_open = true;
  for (int n = 0; n < 100 && is_open; ++n) is_open = result_of(stream->write(packet, true));
  EXPECT_FALSE(is_open) << "nobody reads, so only sending can tell";
  EXPECT_THAT(result_of(stream->read()).error, HasSubstr("nothing listens on its UDP port"));
}

TEST_F(LinkStream, that_rests_is_not_given_up_and_loses_nothing) {
  ping_after_ = std::chrono::seconds(1);
  listen(false);
  const auto stream = make_web_transport_stream(io_, {options_.server, options_.tls});
  ASSERT_EQ(result_of(stream->open()), "");
  ASSERT_TRUE(result_of(stream->write(wire::encode_packet({1, wire::Hello{}}), false)));
  // The server pings after 1 s. If rest() did not answer, it would give the connection up within these 3 s.
  const auto end = std::chrono::steady_clock::now() + std::chrono::seconds(3);
  while (std::chrono::steady_clock::now() < end) ASSERT_TRUE(result_of(stream->rest()));
  std::size_t bytes = 0;
  while (bytes < kChunkBytes) {
    const ServerStream::Read read = result_of(stream->read());
    ASSERT_EQ(read.error, "");
    bytes += read.bytes.size();
  }
  EXPECT_TRUE(result_of(stream->write(wire::encode_packet({1, wire::PoseBatch{}}), false)));
}

TEST_F(LinkStream, drops_the_oldest_datagrams_where_too_many_came_at_once) {
  // The stream buffers kIncomingDatagramsMax, 1024, datagrams (web_transport_stream.cpp). So small ones fill a few
  // packets, which arrive at once.
  constexpr std::uint32_t kCount = 1100, kKept = 1024;
  server::TransportOptions options;
  options.port = 0;
  options.webtransport = true;
  auto listener = server::Listener::create(loop_, options, counters_,
                                           [&](std::shared_ptr<server::Connection> connection, std::int64_t) {
                                             sink_ = std::make_unique<Flooding>(std::move(connection), kCount);
                                             return sink_.get();
                                           });
  ASSERT_TRUE(listener) << listener.error();
  listener_ = std::move(*listener);
  options_.server.port = listener_->port();
  thread_ = std::thread([this] { loop_.run(); });
  const auto stream = make_web_transport_stream(io_, {options_.server, options_.tls});
  ASSERT_EQ(result_of(stream->open()), "");
  ASSERT_TRUE(result_of(stream->write(wire::encode_packet({1, wire::PoseBatch{}}), false)));
  while (counters_.quic.datagrams_sent.value() < kCount) std::this_thread::sleep_for(std::chrono::milliseconds(1));
  // The last packets need a moment to arrive at the socket.
  std::this_thread::sleep_for(std::chrono::milliseconds(20));
  std::vector<std::uint32_t> numbers;
  for (std::size_t n = 0; n < kKept; ++n) {
    const ServerStream::Read read = result_of(stream->read());
    ASSERT_EQ(read.error, "");
    ASSERT_TRUE(read.is_packet && read.bytes.size() == sizeof(std::uint32_t));
    std::memcpy(&numbers.emplace_back(), read.bytes.data(), sizeof(std::uint32_t));
  }
  EXPECT_EQ(numbers.front(), kCount - kKept);
  EXPECT_EQ(numbers.back(), kCount - 1);
}

}  // namespace
}  // namespace hairnet::link
