#include <atomic>
#include <thread>

#include "schema/limits.hpp"
#include "server/transport/beast.hpp"
#include "tests/unit/server/transport_fixture.hpp"

namespace hairnet::server {
namespace {

namespace asio = boost::asio;
using testing::HasSubstr;
using testing::StartsWith;

// These are the opcodes of RFC 6455, section 5.2.
constexpr std::uint8_t kText = 1, kBinary = 2, kClose = 8, kPing = 9, kPong = 10;

std::string upgrade_request(std::string_view more = "", std::string_view path = "/ws") {
  return "GET " + std::string(path) +
         " HTTP/1.1\r\nHost: here:7420\r\nUpgrade: websocket\r\nConnection: Upgrade\r\n"
         "Sec-WebSocket-Key: dGhlIHNhbXBsZSBub25jZQ==\r\nSec-WebSocket-Version: 13\r\n" +
         std::string(more) + "\r\n";
}

// Makes a frame as a client sends it. RFC 6455 demands that clients mask theirs; the other arguments make fragments and
// wrong frames.
std::string frame(std::uint8_t opcode, std::span<const std::uint8_t> payload, bool is_last = true, bool masked = true) {
  std::string out;
  out += static_cast<char>((is_last ? 0x80 : 0) | opcode);
  const std::uint8_t mask_bit = masked ? 0x80 : 0;
  const std::size_t bytes = payload.size();
  if (bytes < 126) {
    out += static_cast<char>(mask_bit | bytes);
  } else if (bytes < 65536) {
    out += static_cast<char>(mask_bit | 126);
    out += static_cast<char>(bytes >> 8);
    out += static_cast<char>(bytes);
  } else {
    out += static_cast<char>(mask_bit | 127);
    for (int shift = 56; shift >= 0; shift -= 8) out += static_cast<char>(bytes >> shift);
  }
  const std::uint8_t mask[4] = {0x12, 0x34, 0x56, 0x78};
  if (masked) out.append(reinterpret_cast<const char*>(mask), 4);
  for (std::size_t i = 0; i < bytes; ++i) out += static_cast<char>(masked ? payload[i] ^ mask[i % 4] : payload[i]);
  return out;
}

struct Frame {
  std::uint8_t first = 0;
  std::vector<std::uint8_t> payload;
  [[nodiscard]] int close_code() const { return payload.size() < 2 ? 0 : payload[0] << 8 | payload[1]; }
};

// Takes the server's frames, which have no mask, out of the bytes. The last one is left out while it is incomplete.
std::vector<Frame> frames_of(std::span<const std::uint8_t> bytes) {
  std::vector<Frame> frames;
  while (bytes.size() >= 2) {
    std::size_t count = bytes[1] & 0x7f, header = 2;
    if (count == 126) header = 4;
    if (count == 127) header = 10;
    if (bytes.size() < header) break;
    if (header > 2) count = 0;
    for (std::size_t i = 2; i < header; ++i) count = count << 8 | bytes[i];
    if (bytes.size() < header + count) break;
    frames.push_back({bytes[0], {bytes.begin() + header, bytes.begin() + header + count}});
    bytes = bytes.subspan(header + count);
  }
  return frames;
}

class WebSocketTest : public TransportTest {
 protected:
  TransportOptions options() override {
    TransportOptions made = TransportTest::options();
    made.request_timeout = std::chrono::milliseconds(500);
    made.hosts = {"here"};
    return made;
  }
  // Upgrades, and removes the response from the received bytes.
  void upgrade(Peer& peer, std::string_view more = "Sec-WebSocket-Protocol: hairnet\r\n") {
    const std::size_t before = echoes_.size();
    peer.send(upgrade_request(more));
    ASSERT_TRUE(run_until([&] {
      peer.receive();
      return peer.text().find("\r\n\r\n") != std::string::npos && echoes_.size() == before + 1;
    }));
    response_ = peer.text();
    peer.received.clear();
  }
  std::vector<Frame> until_ended(Peer& peer) {
    EXPECT_TRUE(run_until([&] {
      peer.receive();
      return peer.ended;
    }));
    return frames_of(peer.received);
  }
  // Returns the response to a request after which the server ends the connection.
  std::string refused(std::string_view request) {
    Peer peer(listener_->port());
    return answer_to(peer, request);
  }
  std::string response_;
};

TEST_F(WebSocketTest, an_upgrade_is_answered_with_the_key_and_subprotocol) {
  Peer peer(listener_->port());
  upgrade(peer, "Sec-WebSocket-Protocol: other, hairnet\r\nSec-WebSocket-Extensions: permessage-deflate\r\n");
  EXPECT_THAT(response_, StartsWith("HTTP/1.1 101 "));
  EXPECT_THAT(response_, HasSubstr("Sec-WebSocket-Accept: s3pPLMBiTxaQ9kYGzzhZRbK+xOo="));  // RFC 6455, 1.3
  EXPECT_THAT(response_, HasSubstr("Sec-WebSocket-Protocol: hairnet"));
  EXPECT_THAT(response_, testing::Not(HasSubstr("deflate")));
  EXPECT_EQ(counters_.connections_opened_websocket.value(), 1u);
  EXPECT_EQ(echoes_[0]->connection->transport(), "ws");
}

TEST_F(WebSocketTest, one_packet_is_one_message_both_ways_however_the_bytes_are_cut) {
  Peer peer(listener_->port());
  upgrade(peer);
  std::string sent;
  std::vector<std::vector<std::uint8_t>> packets;
  // The sizes reach from 16 bytes to 17 kB, so headers of two and of four bytes occur. The pieces that are sent have up
  // to 997 bytes, and end anywhere in a frame.
  for (std::size_t i = 0; i < 40; ++i) {
    packets.push_back(packet(16 + i * i * 11, static_cast<std::uint8_t>(i)));
    sent += frame(kBinary, packets.back());
  }
  std::size_t at = 0, cut = 1, total = 0;
  for (const auto& one : packets) total += one.size();
  ASSERT_TRUE(run_until([&] {
    if (at < sent.size()) {
      at += peer.send(std::string_view(sent).substr(at, cut));
      cut = cut * 7 % 997 + 1;
    }
    peer.receive();
    return frames_of(peer.received).size() == packets.size();
  }));
  const std::vector<Frame> got = frames_of(peer.received);
  for (std::size_t i = 0; i < packets.size(); ++i) {
    EXPECT_EQ(got[i].first, 0x80 | kBinary);
    ASSERT_EQ(got[i].payload, packets[i]);
  }
  EXPECT_TRUE(echoes_[0]->aligned) << "packets are verified where they lie";
  EXPECT_EQ(counters_.received_bytes_websocket.value(), total);
  EXPECT_EQ(counters_.sent_bytes_websocket.value(), total);
  EXPECT_EQ(counters_.received_packets_websocket.value(), packets.size());
  EXPECT_EQ(counters_.sent_packets_websocket.value(), packets.size());
}

TEST_F(WebSocketTest, a_message_for_which_no_memory_was_left_ends_its_connection_only) {
  Peer unlucky(listener_->port()), other(listener_->port());
  upgrade(unlucky);
  upgrade(other);
  echoes_[0]->finds_no_memory = true;
  unlucky.send(frame(kBinary, packet(32, 1)));
  until_ended(unlucky);
  EXPECT_EQ(echoes_[0]->closed, 1);
  EXPECT_EQ(echoes_[0]->reason, "no memory was left");
  other.send(frame(kBinary, packet(32, 1)));
  EXPECT_TRUE(run_until([&] {
    other.receive();
    return frames_of(other.received).size() == 1;
  }));
}

TEST_F(WebSocketTest, a_message_in_fragments_is_one_packet_also_with_a_ping_between) {
  // Browsers cut large messages.
  Peer peer(listener_->port());
  upgrade(peer);
  const auto whole = packet(1000, 7);
  const std::span<const std::uint8_t> bytes(whole);
  const std::uint8_t ping[] = {1, 2, 3};
  peer.send(frame(kBinary, bytes.first(300), false));
  peer.send(frame(kPing, ping));
  peer.send(frame(0, bytes.subspan(300, 500), false));
  peer.send(frame(0, bytes.subspan(800), true));
  ASSERT_TRUE(run_until([&] {
    peer.receive();
    return frames_of(peer.received).size() == 2;
  }));
  EXPECT_EQ(frames_of(peer.received)[0].first, 0x80 | kPong);
  EXPECT_EQ(frames_of(peer.received)[1].payload, whole);
  EXPECT_EQ(echoes_[0]->packets, 1u);
}

TEST_F(WebSocketTest, frames_sent_with_the_upgrade_are_not_lost) {
  Peer peer(listener_->port());
  peer.send(upgrade_request() + frame(kBinary, packet(64, 3)));
  ASSERT_TRUE(run_until([&] {
    peer.receive();
    return !echoes_.empty() && echoes_[0]->packets == 1;
  }));
}

TEST_F(WebSocketTest, each_wrong_frame_ends_the_connection_with_its_close_code_and_a_counter) {
  const std::uint8_t text[] = {'h', 'i'};
  const std::vector<std::uint8_t> large(wire::kPacketBytesMax + 1);
  const std::vector<std::uint8_t> half(wire::kPacketBytesMax / 2 + 1);
  struct Case {
    std::string name, bytes;
    int code;
    Counter& counter;
  };
  // The close codes are 1002 for a wrong frame, 1003 for text, and 1009 for a message of more than kPacketBytesMax. The
  // 14 bytes of a header alone must be enough, or a client could make the server store a message that it refuses.
  const Case cases[] = {
      {"text", frame(kText, text), 1003, counters_.websockets_closed_text},
      {"oversize", frame(kBinary, large), 1009, counters_.websockets_closed_oversize},
      {"oversize in fragments", frame(kBinary, half, false) + frame(0, half), 1009,
       counters_.websockets_closed_oversize},
      {"oversize by its header alone", frame(kBinary, large).substr(0, 14), 1009, counters_.websockets_closed_oversize},
      {"not masked", frame(kBinary, text, true, false), 1002, counters_.websockets_closed_malformed},
      {"an unknown opcode", frame(5, text), 1002, counters_.websockets_closed_malformed},
      {"a reserved bit", std::string("\xc2\x80\0\0\0\0", 6), 1002, counters_.websockets_closed_malformed},
      {"a continuation of nothing", frame(0, text), 1002, counters_.websockets_closed_malformed},
      {"a message within a message", frame(kBinary, text, false) + frame(kBinary, text), 1002,
       counters_.websockets_closed_malformed},
      {"a ping in fragments", frame(kPing, text, false), 1002, counters_.websockets_closed_malformed},
      {"garbage", std::string(300, '\xff'), 1002, counters_.websockets_closed_malformed},
  };
  for (const Case& one : cases) {
    SCOPED_TRACE(one.name);
    const std::uint64_t before = one.counter.value();
    Peer peer(listener_->port());
    upgrade(peer);
    std::size_t at = 0;
    ASSERT_TRUE(run_until([&] {
      if (at < one.bytes.size()) at += peer.send(std::string_view(one.bytes).substr(at));
      peer.receive();
      const auto frames = frames_of(peer.received);
      if (!frames.empty()) peer.end_writing();
      return peer.ended;
    }));
    const auto frames = frames_of(peer.received);
    ASSERT_EQ(frames.size(), 1u);
    EXPECT_EQ(frames[0].first, 0x80 | kClose);
    EXPECT_EQ(frames[0].close_code(), one.code);
    EXPECT_EQ(one.counter.value(), before + 1);
    EXPECT_EQ(echoes_.back()->closed, 1);
    EXPECT_EQ(echoes_.back()->packets, 0u);
  }
  echoes_.clear();
  EXPECT_TRUE(all_closed());
}

TEST_F(WebSocketTest, a_peers_close_is_answered_and_reported_once) {
  Peer peer(listener_->port());
  upgrade(peer);
  // The two bytes are the close code 1000.
  const std::uint8_t normal[] = {0x03, 0xe8};
  peer.send(frame(kClose, normal));
  const auto frames = until_ended(peer);
  ASSERT_EQ(frames.size(), 1u);
  EXPECT_EQ(frames[0].close_code(), 1000);
  EXPECT_EQ(echoes_[0]->closed, 1);
}

TEST_F(WebSocketTest, a_closing_connection_sends_what_waits_then_its_close_frame) {
  Peer peer(listener_->port());
  upgrade(peer);
  for (std::uint8_t i = 0; i < 5; ++i) echoes_[0]->connection->send(packet(20'000, i));
  echoes_[0]->connection->close("done");
  EXPECT_FALSE(echoes_[0]->connection->writable());
  // The two bytes are the close code 1000.
  const std::uint8_t normal[] = {0x03, 0xe8};
  ASSERT_TRUE(run_until([&] {
    peer.receive();
    const auto frames = frames_of(peer.received);
    if (!frames.empty() && frames.back().first == (0x80 | kClose)) peer.send(frame(kClose, normal));
    return peer.ended;
  }));
  const auto frames = frames_of(peer.received);
  ASSERT_EQ(frames.size(), 6u);
  for (std::uint8_t i = 0; i < 5; ++i) EXPECT_EQ(frames[i].payload, packet(20'000, i));
  EXPECT_EQ(frames[5].close_code(), 1000);
  EXPECT_EQ(echoes_[0]->closed, 0);
}

TEST_F(WebSocketTest, small_packets_that_wait_together_arrive_whole_and_in_order_with_pongs_between) {
  Peer peer(listener_->port());
  upgrade(peer);
  std::size_t packets = 0, pongs = 0;
  const std::uint8_t ping[] = {7};
  const auto made = [](std::size_t n) { return packet(40 + n % 60, static_cast<std::uint8_t>(n)); };
  // The server writes small packets that wait together in one call. The pongs that it owes must come between packets,
  // not within one.
  for (int round = 0; round < 50; ++round) {
    peer.send(frame(kPing, ping));
    for (int i = 0; i < 8; ++i) echoes_[0]->connection->send(made(packets++));
    loop_.poll();
  }
  packets = 0;
  // The frames are 400 packets and 50 pongs.
  ASSERT_TRUE(run_until([&] {
    peer.receive();
    return frames_of(peer.received).size() == 450;
  }));
  for (const Frame& one : frames_of(peer.received)) {
    if (one.first == (0x80 | kPong)) {
      ++pongs;
      continue;
    }
    ASSERT_EQ(one.payload, made(packets));
    ++packets;
  }
  EXPECT_EQ(packets, 400u);
  EXPECT_EQ(pongs, 50u);
}

TEST_F(WebSocketTest, a_refused_session_still_gets_the_last_word) {
  refuse_ = true;
  Peer peer(listener_->port());
  peer.send(upgrade_request());
  ASSERT_TRUE(run_until([&] {
    peer.receive();
    // The body ends with the "d" of "refused".
    return peer.text().find("\r\n\r\n") != std::string::npos && peer.received.back() == 'd';
  }));
  const std::size_t body = peer.text().find("\r\n\r\n") + 4;
  const auto frames = frames_of(std::span(peer.received).subspan(body));
  ASSERT_EQ(frames.size(), 2u);
  EXPECT_EQ(frames[0].payload, packet(32, 9));
  EXPECT_EQ(frames[1].close_code(), 1000);
}

TEST_F(WebSocketTest, a_peer_that_leaves_silently_is_reported_once) {
  {
    Peer peer(listener_->port());
    upgrade(peer);
  }
  ASSERT_TRUE(run_until([&] { return echoes_[0]->closed == 1; }));
  echoes_.clear();
  EXPECT_TRUE(all_closed());
}

TEST_F(WebSocketTest, a_peer_that_never_reads_makes_the_connection_unwritable_within_the_bound) {
  Peer peer(listener_->port(), 4096);
  upgrade(peer);
  std::size_t taken = 0;
  for (int i = 0; i < 2000; ++i) {
    loop_.poll();
    while (echoes_[0]->connection->writable()) {
      echoes_[0]->connection->send(packet(10'000, 1));
      taken += 10'000;
    }
  }
  EXPECT_FALSE(echoes_[0]->connection->writable());
  // The connection's queue and the packets in the current write have 64 KiB (PacketQueue::kBytesMax) and one packet
  // each. The system's socket buffers take the rest.
  EXPECT_LT(taken, 600'000u);
  // Pings of such a peer wait as well, and cost nothing.
  for (int i = 0; i < 1000; ++i) peer.send(frame(kPing, {}));
  run_rounds(50);
  echoes_[0]->connection->close("slow");
  echoes_.clear();
  EXPECT_TRUE(all_closed()) << "within the time that a closing one has";
}

TEST_F(WebSocketTest, pages_of_other_origins_are_refused) {
  EXPECT_THAT(refused(upgrade_request("Origin: https://evil.example\r\n")), StartsWith("HTTP/1.1 403 "));
  EXPECT_THAT(refused(upgrade_request("Origin: null\r\n")), StartsWith("HTTP/1.1 403 "));
  EXPECT_THAT(refused(upgrade_request("Origin: http://here:7420\r\nOrigin: http://evil.example\r\n")),
              StartsWith("HTTP/1.1 403 "));
  EXPECT_EQ(counters_.origins_refused.value(), 3u);
  EXPECT_EQ(counters_.connections_opened_http.value(), 0u);
  EXPECT_TRUE(echoes_.empty());
  Peer own(listener_->port());
  upgrade(own, "Origin: http://here:7420\r\n");
  EXPECT_THAT(response_, StartsWith("HTTP/1.1 101 "));
}

std::string with_host(std::string request, std::string_view host) {
  return request.replace(request.find("here:7420"), 9, host);
}

TEST_F(WebSocketTest, requests_for_other_hosts_than_those_listed_are_refused) {
  EXPECT_THAT(refused(with_host(upgrade_request(), "evil.example:7420")), StartsWith("HTTP/1.1 421 "));
  EXPECT_THAT(refused("GET / HTTP/1.1\r\nHost: evil.example\r\nConnection: close\r\n\r\n"),
              StartsWith("HTTP/1.1 421 "));
  EXPECT_EQ(counters_.hosts_refused.value(), 2u);
  EXPECT_THAT(refused("GET / HTTP/1.0\r\n\r\n"), StartsWith("HTTP/1.1 404 ")) << "no browser leaves the host out";
  EXPECT_TRUE(echoes_.empty());
}

class LocalTest : public WebSocketTest {
 protected:
  TransportOptions options() override {
    TransportOptions made = WebSocketTest::options();
    made.hosts = {};
    return made;
  }
};

TEST_F(LocalTest, on_the_loopback_a_page_that_came_under_another_name_may_open_none) {
  // A site whose DNS answers with 127.0.0.1: for the browser the page and the server are of one origin.
  EXPECT_THAT(refused(with_host(upgrade_request("Origin: http://evil.example:7420\r\n"), "evil.example:7420")),
              StartsWith("HTTP/1.1 421 "));
  EXPECT_EQ(counters_.hosts_refused.value(), 1u);
  EXPECT_TRUE(echoes_.empty());
  std::size_t opened = 0;
  for (const std::string host : {"localhost:7420", "127.0.0.1:7420", "[::1]:7420"}) {
    Peer own(listener_->port());
    own.send(with_host(upgrade_request("Origin: http://" + host + "\r\n"), host));
    ++opened;
    EXPECT_TRUE(run_until([&] { return echoes_.size() == opened; })) << host;
  }
  Peer program(listener_->port());
  upgrade(program, "");
  EXPECT_THAT(response_, StartsWith("HTTP/1.1 101 ")) << "it is no page";
}

TEST_F(LocalTest, on_the_loopback_pages_of_this_machine_may_open_one_and_those_of_other_sites_not) {
  std::size_t opened = 0;
  for (const char* origin : {"http://localhost:5173", "https://127.0.0.1:8443", "http://[::1]"}) {
    Peer page(listener_->port());
    page.send(with_host(upgrade_request("Origin: " + std::string(origin) + "\r\n"), "localhost:7420"));
    ++opened;
    EXPECT_TRUE(run_until([&] { return echoes_.size() == opened; })) << origin;
  }
  EXPECT_THAT(refused(with_host(upgrade_request("Origin: https://evil.example\r\n"), "localhost:7420")),
              StartsWith("HTTP/1.1 403 "));
  EXPECT_THAT(refused(with_host(upgrade_request("Origin: http://localhost:5173\r\n"), "evil.example:7420")),
              StartsWith("HTTP/1.1 421 "));
  EXPECT_EQ(counters_.origins_refused.value(), 1u);
  EXPECT_EQ(counters_.hosts_refused.value(), 1u);
  EXPECT_EQ(echoes_.size(), opened);
}

TEST_F(WebSocketTest, a_message_beyond_a_hello_ends_the_connection_before_the_session_has_joined) {
  joins_ = false;
  Peer peer(listener_->port());
  upgrade(peer);
  peer.send(frame(kBinary, packet(kHelloPacketBytesMax, 1)));
  ASSERT_TRUE(run_until([&] { return echoes_[0]->packets == 1; }));
  // The header of the frame alone says that the message is too large, so its bytes need not come.
  peer.send(frame(kBinary, packet(kHelloPacketBytesMax + 1, 1)).substr(0, 8));
  ASSERT_TRUE(run_until([&] { return echoes_[0]->closed == 1; }));
  EXPECT_EQ(counters_.websockets_closed_oversize.value(), 1u);
}

TEST_F(WebSocketTest, wrong_upgrades_are_refused_with_a_reason) {
  EXPECT_THAT(refused(upgrade_request("Sec-WebSocket-Protocol: chat\r\n")), StartsWith("HTTP/1.1 400 "));
  EXPECT_EQ(counters_.handshakes_failed_websocket.value(), 1u);
  EXPECT_THAT(refused(upgrade_request("Connection: close\r\n", "/other")), StartsWith("HTTP/1.1 404 "));
  std::string old = upgrade_request();
  old.replace(old.find("Version: 13"), 11, "Version: 12");
  EXPECT_THAT(refused(old), HasSubstr("HTTP/1.1 4"));
  std::string keyless = upgrade_request();
  keyless.erase(keyless.find("Sec-WebSocket-Key"), 45);
  EXPECT_THAT(refused(keyless), HasSubstr("HTTP/1.1 4"));
  EXPECT_TRUE(echoes_.empty());
}

class ListedOriginTest : public WebSocketTest {
 protected:
  TransportOptions options() override {
    TransportOptions made = WebSocketTest::options();
    made.origins = {"https://page.example"};
    made.ping_after = std::chrono::milliseconds(150);
    return made;
  }
};

TEST_F(ListedOriginTest, only_listed_pages_may_open_one) {
  EXPECT_THAT(refused(upgrade_request("Origin: http://here:7420\r\n")), StartsWith("HTTP/1.1 403 "));
  Peer listed(listener_->port());
  upgrade(listed, "Origin: https://page.example\r\n");
  EXPECT_THAT(response_, StartsWith("HTTP/1.1 101 "));
}

TEST_F(ListedOriginTest, a_peer_without_pongs_is_closed_and_one_with_pongs_stays) {
  // A silent peer gets a ping after ping_after (150 ms here), and is closed after twice this time. The other peer
  // answers three pings, so it outlives the first.
  Peer dead(listener_->port()), alive(listener_->port());
  upgrade(dead);
  upgrade(alive);
  std::size_t answered = 0;
  ASSERT_TRUE(run_until([&] {
    dead.receive();
    alive.receive();
    const auto frames = frames_of(alive.received);
    for (; answered < frames.size(); ++answered) alive.send(frame(kPong, frames[answered].payload));
    return dead.ended && answered >= 3;
  }));
  EXPECT_EQ(frames_of(dead.received)[0].first, 0x80 | kPing);
  EXPECT_EQ(counters_.websockets_closed_timeout.value(), 1u);
  EXPECT_EQ(echoes_[0]->closed, 1);
  EXPECT_EQ(echoes_[1]->closed, 0);
}

TEST_F(WebSocketTest, another_implementation_as_client_exchanges_packets) {
  std::atomic<bool> done = false;
  std::string failed;
  std::thread client([&, port = listener_->port()] {
    try {
      asio::io_context context;
      websocket::stream<asio::ip::tcp::socket> socket(context);
      socket.next_layer().connect({asio::ip::make_address("127.0.0.1"), port});
      socket.set_option(websocket::stream_base::decorator(
          [](websocket::request_type& request) { request.set(http::field::sec_websocket_protocol, "hairnet"); }));
      websocket::response_type response;
      socket.handshake(response, "here", "/ws");
      if (response[http::field::sec_websocket_protocol] != "hairnet") failed = "no subprotocol";
      socket.binary(true);
      // The sizes reach from 16 bytes to 198 kB, so all three lengths of headers occur.
      for (std::size_t i = 0; i < 200; ++i) {
        const auto sent = packet(16 + i * 997, static_cast<std::uint8_t>(i));
        socket.write(asio::buffer(sent));
        beast::flat_buffer got;
        socket.read(got);
        if (got.size() != sent.size() || std::memcmp(got.data().data(), sent.data(), sent.size()) != 0)
          failed = "packet " + std::to_string(i);
      }
      socket.close(websocket::close_code::normal);
    } catch (const std::exception& error) {
      failed = error.what();
    }
    done = true;
  });
  EXPECT_TRUE(run_until([&] { return done.load(); }));
  client.join();
  EXPECT_EQ(failed, "");
  EXPECT_EQ(echoes_[0]->packets, 200u);
}

TEST_F(WebSocketTest, many_connections_of_every_kind_share_the_port) {
  constexpr std::size_t kEach = 100;
  std::vector<std::unique_ptr<Peer>> packets, sockets, pages;
  for (std::size_t i = 0; i < kEach; ++i) {
    packets.push_back(std::make_unique<Peer>(listener_->port()));
    packets.back()->send(packet(48, static_cast<std::uint8_t>(i)));
    sockets.push_back(std::make_unique<Peer>(listener_->port()));
    sockets.back()->send(upgrade_request() + frame(kBinary, packet(48, static_cast<std::uint8_t>(i))));
    pages.push_back(std::make_unique<Peer>(listener_->port()));
    pages.back()->send("GET / HTTP/1.1\r\nHost: here\r\nConnection: close\r\n\r\n");
    run_rounds(2);
  }
  // The echo comes behind the response to the upgrade. A server masks no frames.
  const auto has_every_echo = [&] {
    for (std::size_t i = 0; i < kEach; ++i) {
      const std::string echo = frame(kBinary, packet(48, static_cast<std::uint8_t>(i)), true, false);
      if (sockets[i]->text().find(echo) == std::string::npos) return false;
    }
    return true;
  };
  ASSERT_TRUE(run_until([&] {
    for (const auto* group : {&packets, &sockets, &pages})
      for (const auto& peer : *group) peer->receive();
    return std::ranges::all_of(packets, [](const auto& p) { return p->received.size() == 48; }) && has_every_echo() &&
           std::ranges::all_of(pages, [](const auto& p) { return p->ended; });
  }));
  EXPECT_EQ(counters_.connections_opened_tcp.value(), kEach);
  EXPECT_EQ(counters_.connections_opened_websocket.value(), kEach);
  EXPECT_EQ(counters_.connections_opened_http.value(), kEach);
  packets.clear();
  sockets.clear();
  ASSERT_TRUE(run_until([&] { return std::ranges::all_of(echoes_, [](const auto& e) { return e->closed == 1; }); }));
  echoes_.clear();
  EXPECT_TRUE(all_closed());
}

}  // namespace
}  // namespace hairnet::server
