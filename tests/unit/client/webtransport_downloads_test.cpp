#include <random>

#include "server/transport/webtransport_connection.hpp"
#include "tests/unit/client/webtransport_client_end.hpp"
#include "tests/unit/server/session_fixture.hpp"

namespace hairnet::link {
namespace {

using ::testing::ElementsAre;

// The server hands downloads over in pieces of this size.
constexpr std::size_t kPacketBytes = 16'000;

// Returns bytes in which a piece at a wrong place shows. Another seed gives other bytes.
Bytes numbered(std::size_t count, std::uint8_t seed) {
  Bytes bytes(count);
  for (std::size_t i = 0; i < count; ++i) bytes[i] = static_cast<std::uint8_t>((i >> 6) * 7 + i + seed);
  return bytes;
}

// Gives each test a server and a session of the client library, over which the server sends downloads.
class WebTransportDownloads : public testing::Test {
 protected:
  void open(const QuicOptions& options = {}) {
    client_ = std::make_unique<ClientEnd>(network_, pinned(network_), 20'000, options);
    ASSERT_TRUE(network_.run(5, [&] { return client_->session->is_open(); })) << client_->session->reason();
    client_->session->send({0});
    ASSERT_TRUE(network_.run(5, [&] { return !network_.sinks.empty(); }));
    connection_ = network_.connections[0];
    sink_ = network_.sinks[0].get();
  }
  // Sends as much of a file as the download has room for, from `sent` on. Returns whether all of it was handed over.
  bool feed(std::int64_t download, const Bytes& file, std::size_t& sent) {
    while (sent < file.size() && connection_->is_writable(download)) {
      const std::size_t count = std::min(kPacketBytes, file.size() - sent);
      const auto begin = file.begin() + static_cast<std::ptrdiff_t>(sent);
      sent += count;
      connection_->send_download(download, {begin, begin + static_cast<std::ptrdiff_t>(count)}, sent == file.size());
    }
    return sent == file.size();
  }

  quic::QuicNetwork network_;
  std::unique_ptr<ClientEnd> client_;
  quic::Connection* connection_ = nullptr;
  quic::RecordingSink* sink_ = nullptr;
};

// One packet of twenty is lost. Three files and the messages of the channel share the line.
TEST_F(WebTransportDownloads, arrive_whole_and_in_order_over_a_lossy_line_beside_the_channel) {
  std::mt19937 random(5);
  network_.loses = [&] { return random() % 20 == 0; };
  open();
  std::map<std::int64_t, Bytes> files;
  std::map<std::int64_t, std::size_t> sent;
  for (std::uint8_t n = 0; n < 3; ++n) files[connection_->open_download().value()] = numbered(300'000, n);
  const Bytes messages = numbered(200'000, 9);
  connection_->send(messages);
  EXPECT_TRUE(network_.run(60, [&] {
    for (const auto& [download, file] : files) feed(download, file, sent[download]);
    client_->session->take(std::exchange(client_->untaken, 0));
    return client_->received.size() == messages.size() && client_->downloads.size() == 3 &&
           std::ranges::all_of(client_->downloads, [](const auto& entry) { return entry.second.is_ended; });
  }));
  EXPECT_EQ(client_->received, messages);
  for (const auto& [download, file] : files) EXPECT_EQ(client_->downloads[download].received, file);
  EXPECT_EQ(network_.counters.downloads_opened.value(), 3u);
  EXPECT_TRUE(sink_->stopped.empty());
}

TEST_F(WebTransportDownloads, that_are_not_read_hold_up_neither_the_channel_nor_each_other) {
  open();
  client_->takes_downloads = false;
  const Bytes file = numbered(4 << 20, 1);
  std::size_t sent = 0, other_sent = 0;
  const auto stalled = connection_->open_download().value();
  network_.run(2, [&] { return feed(stalled, file, sent); });
  EXPECT_LE(client_->downloads[stalled].received.size(), QuicOptions::kOneWayWindowBytes);
  // The client takes nothing, so the server may send the window of one stream and store kDownloadUnsentBytesMax, and
  // one more piece.
  EXPECT_LE(sent, QuicOptions::kOneWayWindowBytes + quic::Connection::kDownloadUnsentBytesMax + kPacketBytes);
  EXPECT_FALSE(connection_->is_writable(stalled));
  EXPECT_TRUE(connection_->is_writable());
  client_->takes_downloads = true;
  const auto other = connection_->open_download().value();
  connection_->send(Bytes(50'000, 3));
  connection_->send_datagram({4});
  EXPECT_TRUE(network_.run(5, [&] { return feed(other, file, other_sent) && client_->downloads[other].is_ended; }));
  EXPECT_EQ(client_->downloads[other].received, file);
  EXPECT_EQ(client_->received, Bytes(50'000, 3));
  EXPECT_THAT(client_->datagrams, ElementsAre(Bytes{4}));
  EXPECT_FALSE(client_->downloads[stalled].is_ended);
  const int announced = sink_->downloads_writable;
  client_->session->take_download(stalled, std::exchange(client_->downloads[stalled].untaken, 0));
  EXPECT_TRUE(network_.run(5, [&] { return feed(stalled, file, sent) && client_->downloads[stalled].is_ended; }));
  EXPECT_GT(sink_->downloads_writable, announced);
  EXPECT_EQ(client_->downloads[stalled].received, file);
}

TEST_F(WebTransportDownloads, get_a_quarter_while_messages_wait) {
  open();
  const Bytes file(60'000);
  std::size_t sent = 0, beside = 0;
  const auto download = connection_->open_download().value();
  feed(download, file, sent);
  connection_->send(Bytes(100'000));
  client_->on_received = [&] {
    if (client_->received.size() == 100'000) beside = client_->downloads[download].received.size();
  };
  EXPECT_TRUE(network_.run(5, [&] { return feed(download, file, sent) && client_->downloads[download].is_ended; }));
  // While messages wait, a download gets a quarter of the bytes: about 33 000 beside 100 000 of messages.
  EXPECT_GT(beside, 20'000u);
  EXPECT_LT(beside, 40'000u);
}

TEST_F(WebTransportDownloads, wait_for_the_streams_that_the_client_allows) {
  QuicOptions options;
  // One of the two streams is the control stream of HTTP/3, so one download fits at a time.
  options.one_way_streams_max = 2;
  open(options);
  const auto first = connection_->open_download();
  ASSERT_TRUE(first);
  EXPECT_FALSE(connection_->open_download());
  network_.run(1);
  EXPECT_EQ(sink_->downloads_writable, 0);
  connection_->send_download(*first, Bytes(100, 1), true);
  EXPECT_TRUE(network_.run(1, [&] { return sink_->downloads_writable > 0; }));
  const auto second = connection_->open_download();
  ASSERT_TRUE(second);
  connection_->send_download(*second, Bytes(200, 2), true);
  EXPECT_TRUE(network_.run(1, [&] { return client_->downloads[*second].is_ended; }));
  EXPECT_EQ(client_->downloads[*second].received, Bytes(200, 2));

  // Here no download fits beside the control stream.
  options.one_way_streams_max = 1;
  ClientEnd narrow(network_, pinned(network_), 20'001, options);
  ASSERT_TRUE(network_.run(1, [&] { return narrow.session->is_open(); }));
  narrow.session->send({0});
  network_.run(0.1);
  EXPECT_FALSE(network_.connections[1]->open_download());
  network_.connections[1]->send({5});
  network_.run(0.1);
  EXPECT_EQ(narrow.received, Bytes{5}) << "it goes on without";
}

TEST_F(WebTransportDownloads, that_the_server_gives_up_free_what_they_held) {
  open();
  client_->takes_downloads = false;
  const Bytes file(300'000);
  // If a reset did not free what a download holds, 40 downloads of 300 kB would use up the streams or windows.
  for (int n = 0; n < 40; ++n) {
    std::size_t sent = 0;
    const auto download = connection_->open_download();
    ASSERT_TRUE(download) << n;
    network_.run(0.2, [&] { return feed(*download, file, sent) || client_->downloads[*download].untaken > 200'000; });
    ASSERT_GT(client_->downloads[*download].untaken, 0u) << n;
    connection_->reset_download(*download);
    EXPECT_FALSE(connection_->is_writable(*download));
    ASSERT_TRUE(network_.run(1, [&] { return client_->downloads[*download].was_reset; })) << n;
    EXPECT_FALSE(client_->downloads[*download].is_ended);
  }
  EXPECT_EQ(network_.counters.downloads_reset.value(), 40u);
  EXPECT_TRUE(sink_->stopped.empty()) << "it knows";
  connection_->send({7});
  network_.run(0.1);
  EXPECT_EQ(client_->received, Bytes{7});
}

TEST_F(WebTransportDownloads, that_the_client_stops_are_told_and_dropped) {
  const auto [client, channel] = network_.join();
  quic::Connection& connection = *network_.connections[0];
  quic::RecordingSink& sink = *network_.sinks[0];
  const auto idle = connection.open_download().value(), busy = connection.open_download().value();
  connection.send_download(idle, Bytes(100), false);
  network_.run(0.1);
  // The client stops a download that has nothing waiting at the server.
  client.stop(idle);
  EXPECT_TRUE(network_.run(1, [&] { return !sink.stopped.empty(); }));
  connection.send_download(busy, Bytes(30'000), false);
  client.stop(busy);
  EXPECT_TRUE(network_.run(1, [&] { return sink.stopped.size() == 2; }));
  EXPECT_THAT(sink.stopped, ElementsAre(idle, busy));
  EXPECT_FALSE(connection.is_writable(busy));
  // This is too late, and does nothing.
  connection.send_download(busy, Bytes(100), true);
  connection.send({1, 2});
  const auto next = connection.open_download().value();
  connection.send_download(next, Bytes(50, 6), true);
  EXPECT_TRUE(network_.run(1, [&] { return client.ended[next]; }));
  EXPECT_EQ(client.received[channel], (Bytes{1, 2}));
  EXPECT_TRUE(sink.closed.empty());
}

// A file that nobody takes must not keep the client from hearing why the server leaves.
TEST_F(WebTransportDownloads, do_not_delay_the_end_of_their_session) {
  open();
  client_->takes_downloads = false;
  const Bytes file(1 << 20);
  std::size_t sent = 0;
  const auto stalled = connection_->open_download().value();
  network_.run(1, [&] { return feed(stalled, file, sent); });
  connection_->send({1, 2, 3});
  connection_->close("the server stops", network_.now_ns);
  EXPECT_TRUE(network_.run(1, [&] { return client_->session->is_over(); }));
  EXPECT_EQ(client_->received, (Bytes{1, 2, 3}));
  EXPECT_EQ(client_->session->reason(), "the server stops");
}

// Puts a real session of the server in the place of the recording sink.
class ServingNetwork final : public quic::QuicNetwork {
 public:
  ~ServingNetwork() override {
    if (connection) connection->start(nullptr);
  }
  std::shared_ptr<quic::SessionSink> on_session(quic::Connection& quic, std::int64_t now) override {
    auto made = std::make_shared<server::WebTransportConnection>(quic, "peer", "", nullptr, transport_counters, [] {});
    session = std::make_unique<server::Session>(7, made, context, now);
    made->start(session.get());
    connection = made;
    return made;
  }
  server::TransportCounters transport_counters;
  server::SessionCounters session_counters;
  server::CommandQueue commands{1000};
  server::FakeGroomService grooms;
  std::atomic<std::uint64_t> tick{1};
  server::SessionContext context{{}, session_counters, commands, grooms, 30, 1 << 20, tick};
  std::shared_ptr<server::WebTransportConnection> connection;
  std::unique_ptr<server::Session> session;
};

TEST(WebTransportDownload, of_twenty_megabytes_that_stalls_delays_neither_welcome_nor_answers_nor_other_downloads) {
  ServingNetwork network;
  const Bytes large = numbered(20'000'000, 1), small = numbered(100'000, 2);
  network.grooms.file = std::make_shared<const Bytes>(large);
  ClientEnd client(network, pinned(network));
  ASSERT_TRUE(network.run(1, [&] { return client.session->is_open(); }));
  client.takes_downloads = false;
  const auto send = [&](const wire::Message& message) {
    client.session->send(wire::encode_packet({network.now_ns, message}));
  };
  // Returns the messages of a stream.
  const auto messages = [](const Bytes& bytes) {
    std::vector<wire::Message> found;
    channel::PacketSplitter splitter(wire::kPacketBytesMax);
    EXPECT_TRUE(splitter.feed(bytes, [&](std::span<const std::uint8_t> packet) {
      found.push_back(std::move(wire::decode_packet(packet).envelope.message));
    }));
    return found;
  };
  send(wire::Hello{wire::kProtocolVersion, "test", "", "", wire::Role::participant, 0, {}});
  send(wire::GroomRequest{network.grooms.known, 0});
  network.run(2);
  ASSERT_EQ(client.downloads.size(), 1u);
  const StreamId stalled = client.downloads.begin()->first;
  EXPECT_GT(client.downloads[stalled].received.size(), 100'000u);
  EXPECT_LT(client.downloads[stalled].received.size(), 1u << 20);
  ASSERT_TRUE(std::holds_alternative<wire::Welcome>(messages(client.received).at(0)));

  send(wire::GroomRequest{wire::GroomHash{9}, 0});
  EXPECT_TRUE(network.run(1, [&] { return messages(client.received).size() == 2; }));
  EXPECT_EQ(std::get<wire::Error>(messages(client.received).at(1)).reason, wire::ErrorReason::groom_unavailable);

  client.takes_downloads = true;
  send(wire::GroomRequest{network.grooms.kept, 0});
  network.run(0.1);
  network.session->on_groom_read(network.grooms.kept, std::make_shared<const Bytes>(small), network.now_ns);
  EXPECT_TRUE(
      network.run(1, [&] { return client.downloads.size() == 2 && client.downloads.rbegin()->second.is_ended; }));
  EXPECT_FALSE(client.downloads[stalled].is_ended);

  client.session->take_download(stalled, std::exchange(client.downloads[stalled].untaken, 0));
  EXPECT_TRUE(network.run(10, [&] { return client.downloads[stalled].is_ended; }));
  for (const auto& [stream, file] : {std::pair(stalled, large), std::pair(client.downloads.rbegin()->first, small)}) {
    Bytes whole;
    for (const wire::Message& message : messages(client.downloads[stream].received)) {
      const auto& data = std::get<wire::GroomData>(message);
      EXPECT_EQ(data.offset, whole.size());
      whole.insert(whole.end(), data.bytes.begin(), data.bytes.end());
    }
    EXPECT_EQ(whole, file);
  }
  EXPECT_EQ(network.session_counters.download_bytes_sent.value(), 20'100'000u);
}

}  // namespace
}  // namespace hairnet::link
