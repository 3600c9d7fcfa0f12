#include <stdlib.h>

#include <filesystem>
#include <fstream>
#include <set>

#include "tests/unit/server/transport_fixture.hpp"

namespace hairnet::server {
namespace {

using testing::HasSubstr;
using testing::Not;
using testing::StartsWith;

// A file that is larger than what the sockets of both ends take, so the server has to wait while it sends it.
constexpr std::size_t kLargeBytes = 3'000'000;

// The pages that the server itself makes. It stores the last request, so that a test sees which requests reach it.
class Pages final : public HttpService {
 public:
  HttpResponse handle(const HttpRequest& request) override {
    last = std::string(request.method) + " " + std::string(request.path) + " " + std::string(request.query);
    authorization = request.authorization;
    if (request.path == "/readyz") return refusal(503, "draining");
    return {.content_type = "text/plain; version=0.0.4", .body = "metric 1\n"};
  }
  std::string last, authorization;
};

class HttpTest : public TransportTest {
 protected:
  TransportOptions options() override {
    TransportOptions made = TransportTest::options();
    made.web_root = root_.string();
    // These are far smaller than the defaults, so that tests reach them.
    made.requests_per_connection_max = 5;
    made.request_timeout = std::chrono::milliseconds(300);
    made.opening_timeout = std::chrono::milliseconds(200);
    return made;
  }
  HttpService* service() override { return &pages_; }
  void SetUp() override {
    std::string made = (std::filesystem::temp_directory_path() / "hairnet_http_XXXXXX").string();
    ASSERT_NE(::mkdtemp(made.data()), nullptr);
    root_ = made;
    std::ofstream(root_ / "index.html") << "<html>hair</html>";
    std::filesystem::create_directory(root_ / "demo");
    std::ofstream large(root_ / "large.wasm", std::ios::binary);
    for (std::size_t i = 0; i < kLargeBytes; ++i) large.put(static_cast<char>(i * 7 % 251));
    large.close();
    TransportTest::SetUp();
  }
  void TearDown() override { std::filesystem::remove_all(root_); }
  std::string get(std::string_view path, std::string_view more = "", std::string_view method = "GET") {
    Peer peer(listener_->port());
    return answer_to(peer, std::string(method) + " " + std::string(path) +
                               " HTTP/1.1\r\nHost: here\r\nConnection: close\r\n" + std::string(more) + "\r\n");
  }

  std::filesystem::path root_;
  Pages pages_;
};

std::string header_value(const std::string& response, std::string_view name) {
  const std::string key = "\r\n" + std::string(name) + ": ";
  const std::size_t at = response.find(key);
  if (at == std::string::npos) return {};
  return response.substr(at + key.size(), response.find("\r\n", at + 2) - at - key.size());
}

std::string body_of(const std::string& response) {
  const std::size_t at = response.find("\r\n\r\n");
  return at == std::string::npos ? std::string() : response.substr(at + 4);
}

TEST_F(HttpTest, the_servers_own_pages_come_from_the_service) {
  const std::string metrics = get("/metrics?x=1");
  EXPECT_THAT(metrics, StartsWith("HTTP/1.1 200 OK\r\n"));
  EXPECT_EQ(body_of(metrics), "metric 1\n");
  EXPECT_EQ(header_value(metrics, "Content-Type"), "text/plain; version=0.0.4");
  EXPECT_EQ(header_value(metrics, "Cache-Control"), "no-store");
  EXPECT_EQ(pages_.last, "GET /metrics x=1");
  EXPECT_THAT(get("/readyz"), StartsWith("HTTP/1.1 503 "));
  EXPECT_EQ(counters_.http_responses_5xx.value(), 1u);
  EXPECT_EQ(counters_.connections_opened_http.value(), 2u);
}

TEST_F(HttpTest, pages_of_allowed_origins_may_ask_where_a_room_is) {
  const std::string own = get("/room?name=hall", "Origin: http://here\r\nAuthorization: Bearer x.y.z\r\n");
  EXPECT_THAT(own, StartsWith("HTTP/1.1 200 "));
  EXPECT_EQ(header_value(own, "Access-Control-Allow-Origin"), "http://here");
  EXPECT_EQ(pages_.last, "GET /room name=hall");
  EXPECT_EQ(pages_.authorization, "Bearer x.y.z");
  // A browser asks by OPTIONS whether it may send the token of a page from another origin (a CORS preflight).
  const std::string leave = get("/room?name=hall", "Origin: http://here\r\n", "OPTIONS");
  EXPECT_THAT(leave, StartsWith("HTTP/1.1 204 "));
  EXPECT_EQ(header_value(leave, "Access-Control-Allow-Headers"), "Authorization");
  // Another origin, or two of them, is refused before the service hears of the request.
  pages_.last.clear();
  for (const char* method : {"GET", "OPTIONS"}) {
    EXPECT_THAT(get("/room?name=hall", "Origin: http://elsewhere\r\n", method), StartsWith("HTTP/1.1 403 "));
    EXPECT_THAT(get("/room?name=hall", "Origin: http://here\r\nOrigin: http://here\r\n", method),
                StartsWith("HTTP/1.1 403 "));
  }
  EXPECT_THAT(get("/metrics", "", "OPTIONS"), StartsWith("HTTP/1.1 405 "));
  EXPECT_EQ(pages_.last, "");
  EXPECT_EQ(header_value(get("/room?name=hall"), "Access-Control-Allow-Origin"), "") << "no page has asked";
}

TEST_F(HttpTest, a_page_comes_with_its_type_and_headers_that_seal_it_off) {
  const std::string page = get("/");
  EXPECT_THAT(page, StartsWith("HTTP/1.1 200 OK\r\n"));
  EXPECT_EQ(body_of(page), "<html>hair</html>");
  EXPECT_EQ(header_value(page, "Content-Type"), "text/html; charset=utf-8");
  EXPECT_EQ(header_value(page, "X-Content-Type-Options"), "nosniff");
  EXPECT_THAT(header_value(page, "Content-Security-Policy"), HasSubstr("script-src 'self' 'wasm-unsafe-eval';"));
  EXPECT_THAT(header_value(page, "Content-Security-Policy"), HasSubstr("connect-src 'self' ws: wss:"));
  EXPECT_FALSE(header_value(page, "Date").empty());
}

TEST_F(HttpTest, head_is_answered_as_get_is_without_the_body) {
  const std::string got = get("/"), head = get("/", "", "HEAD");
  EXPECT_EQ(body_of(head), "");
  EXPECT_EQ(header_value(head, "Content-Length"), header_value(got, "Content-Length"));
  EXPECT_EQ(header_value(head, "ETag"), header_value(got, "ETag"));
}

TEST_F(HttpTest, a_client_that_takes_a_compressed_copy_gets_it_under_the_pages_own_name) {
  std::ofstream(root_ / "index.html.br") << "small";
  std::ofstream(root_ / "index.html.gz") << "smaller";
  const std::string plain = get("/"), small = get("/", "Accept-Encoding: gzip, deflate, br\r\n");
  EXPECT_EQ(body_of(plain), "<html>hair</html>");
  EXPECT_EQ(header_value(plain, "Content-Encoding"), "");
  EXPECT_EQ(body_of(small), "small");
  EXPECT_EQ(header_value(small, "Content-Encoding"), "br");
  EXPECT_EQ(header_value(small, "Content-Length"), "5");
  for (const std::string& response : {plain, small}) {
    EXPECT_EQ(header_value(response, "Content-Type"), "text/html; charset=utf-8");
    EXPECT_EQ(header_value(response, "Cache-Control"), "no-cache");
    EXPECT_EQ(header_value(response, "Vary"), "Accept-Encoding");
  }
  EXPECT_NE(header_value(plain, "ETag"), header_value(small, "ETag"));
  EXPECT_EQ(body_of(get("/", "Accept-Encoding: gzip\r\n")), "smaller");
  EXPECT_EQ(body_of(get("/", "Accept-Encoding: deflate\r\nAccept-Encoding: gzip\r\n")), "smaller");
  EXPECT_EQ(body_of(get("/", "Accept-Encoding: br;q=0, gzip;q=0\r\n")), "<html>hair</html>");

  const std::string head = get("/", "Accept-Encoding: br\r\n", "HEAD");
  EXPECT_EQ(body_of(head), "");
  EXPECT_EQ(header_value(head, "Content-Length"), "5");
  const std::string tag = "If-None-Match: " + header_value(small, "ETag") + "\r\n";
  const std::string again = get("/", tag + "Accept-Encoding: br\r\n");
  EXPECT_THAT(again, StartsWith("HTTP/1.1 304 "));
  EXPECT_EQ(header_value(again, "Vary"), "Accept-Encoding");
  EXPECT_THAT(get("/", tag), StartsWith("HTTP/1.1 200 ")) << "it is the tag of another representation";
}

TEST_F(HttpTest, a_part_of_a_page_is_never_sent) {
  const std::string whole = get("/", "Range: bytes=0-3\r\n");
  EXPECT_THAT(whole, StartsWith("HTTP/1.1 200 "));
  EXPECT_EQ(body_of(whole), "<html>hair</html>");
}

TEST_F(HttpTest, a_page_that_has_not_changed_is_not_sent_again) {
  const std::string etag = header_value(get("/"), "ETag");
  ASSERT_FALSE(etag.empty());
  const std::string again = get("/", "If-None-Match: \"x\", W/" + etag + "\r\n");
  EXPECT_THAT(again, StartsWith("HTTP/1.1 304 "));
  EXPECT_EQ(body_of(again), "");
  EXPECT_THAT(get("/", "If-None-Match: \"x\"\r\n"), StartsWith("HTTP/1.1 200 "));
}

TEST_F(HttpTest, a_slow_reader_gets_a_large_file_completely) {
  // The small receive buffer and the rounds without a read fill the connection, so the server has to wait in the middle
  // of the file.
  Peer peer(listener_->port(), 4096);
  peer.send("GET /large.wasm HTTP/1.1\r\nHost: here\r\nConnection: close\r\n\r\n");
  run_rounds(300);
  ASSERT_TRUE(run_until([&] {
    peer.receive();
    return peer.ended;
  }));
  const std::string body = body_of(peer.text());
  ASSERT_EQ(body.size(), kLargeBytes);
  for (std::size_t i = 0; i < kLargeBytes; ++i) ASSERT_EQ(body[i], static_cast<char>(i * 7 % 251));
}

TEST_F(HttpTest, a_folder_leads_to_its_own_name_with_a_slash) {
  const std::string moved = get("/demo");
  EXPECT_THAT(moved, StartsWith("HTTP/1.1 301 "));
  EXPECT_EQ(header_value(moved, "Location"), "/demo/");
  EXPECT_THAT(get("//evil.example"), StartsWith("HTTP/1.1 404 "));
}

TEST_F(HttpTest, every_kind_of_wrong_request_has_its_status) {
  EXPECT_THAT(get("/none"), StartsWith("HTTP/1.1 404 "));
  EXPECT_THAT(get("/../x"), StartsWith("HTTP/1.1 404 "));
  EXPECT_THAT(get("/%00"), StartsWith("HTTP/1.1 400 "));
  EXPECT_THAT(get("/", "", "DELETE"), StartsWith("HTTP/1.1 405 "));
  EXPECT_EQ(header_value(get("/", "", "OPTIONS"), "Allow"), "GET, HEAD");
  EXPECT_THAT(get("/", "Content-Length: 100000000\r\n", "POST"), StartsWith("HTTP/1.1 405 "));
  // http_connection.cpp has these limits: 4096 bytes of body (413), 2048 of address (414) and 8 KiB of header (431).
  EXPECT_THAT(get("/", "Content-Length: 100000\r\n"), StartsWith("HTTP/1.1 413 "));
  EXPECT_THAT(get("/", "Transfer-Encoding: chunked\r\n"), StartsWith("HTTP/1.1 413 "));
  EXPECT_THAT(get("/" + std::string(3000, 'a')), StartsWith("HTTP/1.1 414 "));
  EXPECT_THAT(get("/" + std::string(100'000, 'a')), StartsWith("HTTP/1.1 414 "));
  EXPECT_THAT(get("/", "X: " + std::string(100'000, 'a') + "\r\n"), StartsWith("HTTP/1.1 431 "));
  EXPECT_THAT(get("/", "Host: again\r\n"), StartsWith("HTTP/1.1 400 "));
  EXPECT_THAT(get("/", "Content-Length: -1\r\n"), StartsWith("HTTP/1.1 400 "));
  EXPECT_THAT(get("/", "no colon\r\n"), StartsWith("HTTP/1.1 400 "));
  EXPECT_THAT(get("/ws"), StartsWith("HTTP/1.1 426 "));
  // HTTP/2 begins with this preface.
  Peer peer(listener_->port());
  EXPECT_THAT(answer_to(peer, "PRI * HTTP/2.0\r\n\r\nSM\r\n\r\n"), StartsWith("HTTP/1.1 400 "));
  EXPECT_EQ(counters_.connections_opened_http.value(), 3u) << "the requests for none, /../x and %00 are valid";
  EXPECT_TRUE(all_closed());
  EXPECT_TRUE(echoes_.empty());
}

TEST_F(HttpTest, a_connection_is_kept_for_a_bounded_number_of_requests) {
  Peer peer(listener_->port());
  std::string all;
  // Eight requests are sent without waiting for responses; requests_per_connection_max is 5 here.
  for (int i = 0; i < 8; ++i) all += "GET /healthz HTTP/1.1\r\nHost: here\r\n\r\n";
  const std::string got = answer_to(peer, all);
  std::size_t responses = 0;
  for (std::size_t at = got.find("HTTP/1.1 200"); at != std::string::npos; at = got.find("HTTP/1.1 200", at + 1))
    ++responses;
  EXPECT_EQ(responses, 5u);
  EXPECT_EQ(counters_.connections_opened_http.value(), 1u);
}

TEST_F(HttpTest, a_request_may_come_byte_by_byte) {
  Peer peer(listener_->port());
  const std::string_view request = "GET /healthz HTTP/1.1\r\nHost: here\r\nConnection: close\r\n\r\n";
  std::size_t at = 0;
  ASSERT_TRUE(run_until([&] {
    if (at < request.size()) at += peer.send(request.substr(at, 1));
    peer.receive();
    return peer.ended;
  }));
  EXPECT_THAT(peer.text(), StartsWith("HTTP/1.1 200 "));
}

TEST_F(HttpTest, a_request_that_never_ends_is_ended) {
  Peer peer(listener_->port());
  peer.send("GET /healthz HTTP/1.1\r\nHost: here\r\n");
  // The peer is never silent: it sends another header line again and again. Only the time-out of the whole request (300
  // ms here) can end this.
  int round = 0;
  ASSERT_TRUE(run_until([&] {
    if (++round % 10 == 0) peer.send("X: y\r\n");
    peer.receive();
    return peer.ended;
  }));
  EXPECT_EQ(counters_.handshakes_failed_timeout.value(), 1u);
  EXPECT_TRUE(all_closed());
}

TEST_F(HttpTest, a_kept_connection_that_asks_nothing_more_is_ended_without_being_a_failure) {
  Peer peer(listener_->port());
  EXPECT_THAT(answer_to(peer, "GET /healthz HTTP/1.1\r\nHost: here\r\n\r\n"), HasSubstr("Connection: keep-alive"));
  EXPECT_EQ(counters_.handshakes_failed_timeout.value(), 0u);
}

TEST_F(HttpTest, a_silent_peer_is_closed) {
  Peer peer(listener_->port());
  EXPECT_EQ(answer_to(peer, ""), "");
  EXPECT_EQ(counters_.handshakes_failed_timeout.value(), 1u);
  Peer part(listener_->port());
  // Two letters do not tell the protocol yet (kProtocolBytesMax is 4), so the same time-out ends the wait.
  EXPECT_EQ(answer_to(part, "GE"), "");
  EXPECT_EQ(counters_.handshakes_failed_timeout.value(), 2u);
  { Peer gone(listener_->port()); }
  ASSERT_TRUE(run_until([&] { return counters_.handshakes_failed_silent.value() == 1; }));
}

class LimitedPagesTest : public HttpTest {
 protected:
  TransportOptions options() override {
    TransportOptions made = HttpTest::options();
    made.page_bytes_per_s = 100'000;
    return made;
  }
};

TEST_F(LimitedPagesTest, a_page_is_sent_no_faster_than_its_limit) {
  Peer peer(listener_->port());
  peer.send("GET /large.wasm HTTP/1.1\r\nHost: here\r\nConnection: close\r\n\r\n");
  // The file has 3 MB and would take half a minute at 100 kB/s. The server has waited four times while at most half of
  // it has gone.
  ASSERT_TRUE(run_until([&] {
    peer.receive();
    return counters_.pages_delayed.value() > 3;
  }));
  EXPECT_FALSE(peer.ended);
  EXPECT_LT(counters_.sent_bytes_http.value(), kLargeBytes / 2);
}

TEST_F(HttpTest, a_port_of_its_own_has_the_servers_pages_and_nothing_else) {
  TransportOptions alone = TransportTest::options();
  // A listener without a function for sessions has the service's pages alone, as for a port of metrics.
  const auto created = Listener::create(loop_, alone, counters_, nullptr, &pages_);
  ASSERT_TRUE(created) << created.error();
  const std::uint16_t port = (*created)->port();
  const auto ask = [&](std::string_view path, std::string_view more = "") {
    Peer peer(port);
    return answer_to(peer, "GET " + std::string(path) + " HTTP/1.1\r\nHost: here\r\n" + std::string(more) + "\r\n");
  };
  EXPECT_THAT(ask("/metrics", "Connection: close\r\n"), StartsWith("HTTP/1.1 200 "));
  EXPECT_THAT(ask("/index.html", "Connection: close\r\n"), StartsWith("HTTP/1.1 404 "));
  EXPECT_THAT(ask("/ws",
                  "Upgrade: websocket\r\nConnection: Upgrade, close\r\nSec-WebSocket-Key: dGhlIHNhbXBsZSBub25jZQ==\r\n"
                  "Sec-WebSocket-Version: 13\r\n"),
              StartsWith("HTTP/1.1 404 "));
  // The four bytes are the size prefix of a packet of 32 bytes, as a client of the packet protocol begins.
  Peer speaks_packets(port);
  EXPECT_EQ(answer_to(speaks_packets, std::string_view("\x20\0\0\0", 4)), "");
  EXPECT_EQ(counters_.handshakes_failed_http.value(), 1u);
  EXPECT_TRUE(echoes_.empty());
}

TEST_F(TransportTest, the_servers_own_pages_are_not_on_a_port_without_them) {
  for (const char* path : {"/healthz", "/readyz", "/metrics"}) {
    Peer peer(listener_->port());
    EXPECT_THAT(answer_to(peer, "GET " + std::string(path) + " HTTP/1.1\r\nHost: here\r\nConnection: close\r\n\r\n"),
                StartsWith("HTTP/1.1 404 "));
  }
}

class LimitedTest : public TransportTest {
 protected:
  TransportOptions options() override {
    TransportOptions made = TransportTest::options();
    // The numbers are the first members of `AdmissionLimits`: at most 40 connections in all, 30 from one address, 10
    // whose protocol is not known yet, and 5 that request pages. Loopback is usually exempt from the bound of one
    // address; here it is not.
    made.admission = {40, 30, 10, 5};
    made.exempt_addresses = {};
    return made;
  }
};

TEST_F(LimitedTest, arrivals_are_bounded_and_make_room_when_they_speak) {
  std::vector<std::unique_ptr<Peer>> peers;
  // Nobody has sent a byte yet, so 10 of the 15 connections fill `arrivals_max` and the other 5 are refused.
  for (int i = 0; i < 15; ++i) peers.push_back(std::make_unique<Peer>(listener_->port()));
  ASSERT_TRUE(run_until([&] { return counters_.connections_refused_arrivals.value() == 5; }));
  for (const auto& peer : peers) peer->send(packet(32, 1));
  ASSERT_TRUE(run_until([&] { return echoes_.size() == 10; }));
  peers.push_back(std::make_unique<Peer>(listener_->port()));
  peers.back()->send(packet(32, 2));
  ASSERT_TRUE(run_until([&] { return echoes_.size() == 11; }));
}

TEST_F(LimitedTest, one_address_is_bounded_and_gets_its_places_back) {
  std::vector<std::unique_ptr<Peer>> peers;
  // Each client sends before the next connects, so only the bound of 30 connections from one address is reached.
  for (std::size_t i = 0; i < 30; ++i) {
    peers.push_back(std::make_unique<Peer>(listener_->port()));
    peers.back()->send(packet(32, 1));
    ASSERT_TRUE(run_until([&] { return echoes_.size() == i + 1; }));
  }
  Peer one_more(listener_->port());
  ASSERT_TRUE(run_until([&] { return counters_.connections_refused_address.value() == 1; }));
  peers.clear();
  ASSERT_TRUE(run_until([&] { return std::ranges::all_of(echoes_, [](const auto& e) { return e->closed == 1; }); }));
  echoes_.clear();
  ASSERT_TRUE(all_closed());
  Peer again(listener_->port());
  again.send(packet(32, 1));
  ASSERT_TRUE(run_until([&] { return echoes_.size() == 1; }));
}

TEST_F(LimitedTest, the_listener_closes_with_connections_in_every_state) {
  Peer silent(listener_->port()), half(listener_->port()), asking(listener_->port()), session(listener_->port());
  half.send("G");
  asking.send("GET / HTTP/1.1\r\nHost: x\r\n");
  session.send(packet(32, 1));
  ASSERT_TRUE(run_until([&] { return echoes_.size() == 1 && counters_.connections_accepted.value() == 4; }));
  run_rounds(20);
  listener_->close();
  ASSERT_TRUE(run_until([&] {
    for (Peer* peer : {&silent, &half, &asking}) peer->receive();
    return silent.ended && half.ended && asking.ended;
  }));
  EXPECT_EQ(counters_.connections_closed.value(), 3u) << "sessions are others' to end";
  session.send(packet(32, 2));
  ASSERT_TRUE(run_until([&] {
    session.receive();
    return session.received.size() == 64;
  }));
  Peer late(listener_->port());
  run_rounds(20);
  EXPECT_EQ(counters_.connections_accepted.value(), 4u);
}

TEST_F(LimitedTest, a_loop_that_ends_leaves_nothing_behind) {
  // For the sanitizers: sockets are still open when loop, listener and sessions go.
  Peer silent(listener_->port()), asking(listener_->port()), session(listener_->port());
  asking.send("GET / HTTP/1.1\r\nHost: x\r\n");
  session.send(packet(32, 1));
  ASSERT_TRUE(run_until([&] { return echoes_.size() == 1 && counters_.connections_accepted.value() == 3; }));
}

class RateOfAddressTest : public TransportTest {
 protected:
  TransportOptions options() override {
    TransportOptions made = TransportTest::options();
    // Three connections may come at once, and practically none is regained during the test.
    made.admission.connections_per_address_per_s = 1e-6;
    made.admission.connections_per_address_burst = 3;
    made.exempt_addresses = {"127.0.0.2"};
    return made;
  }
};

TEST_F(RateOfAddressTest, new_connections_of_one_address_are_limited_also_after_the_old_ones_went) {
  for (std::size_t i = 0; i < 3; ++i) {
    Peer peer(listener_->port());
    peer.send(packet(32, 1));
    ASSERT_TRUE(run_until([&] { return echoes_.size() == i + 1; }));
  }
  Peer fourth(listener_->port());
  EXPECT_EQ(answer_to(fourth, ""), "") << "closed at once";
  EXPECT_EQ(counters_.connections_refused_address_rate.value(), 1u);
  EXPECT_EQ(counters_.connections_accepted.value(), 3u);
  for (std::size_t i = 0; i < 6; ++i) {
    Peer exempt(listener_->port(), 0, "127.0.0.2");
    exempt.send(packet(32, 1));
    ASSERT_TRUE(run_until([&] { return echoes_.size() == i + 4; }));
  }
}

class RateOfAllTest : public TransportTest {
 protected:
  TransportOptions options() override {
    TransportOptions made = TransportTest::options();
    // Three connections may come at once, and practically none is regained during the test.
    made.admission.connections_per_s = 1e-6;
    made.admission.connections_burst = 3;
    return made;
  }
};

TEST_F(RateOfAllTest, new_connections_of_all_addresses_wait_in_the_systems_queue) {
  std::vector<std::unique_ptr<Peer>> peers;
  for (int i = 0; i < 8; ++i) peers.push_back(std::make_unique<Peer>(listener_->port()));
  ASSERT_TRUE(run_until([&] { return counters_.accepts_paused.value() == 1; }));
  run_rounds(200);
  // The listener accepts until one connection exceeds the three, and only then stops: the system holds the other four.
  EXPECT_EQ(counters_.connections_accepted.value(), 4u) << "one beyond the rate";
  peers.back()->receive();
  EXPECT_FALSE(peers.back()->ended);
  peers[0]->send(packet(32, 1));
  ASSERT_TRUE(run_until([&] { return echoes_.size() == 1; })) << "accepted ones are served meanwhile";
}

class ProxiedTest : public TransportTest {
 protected:
  TransportOptions options() override {
    TransportOptions made = TransportTest::options();
    made.proxy_protocol = {"127.0.0.1"};
    made.admission.connections_per_address_max = 2;
    return made;
  }
  void send_with(Peer& peer, std::string_view header) {
    const auto first = packet(32, 1);
    peer.send(std::string(header) + std::string(first.begin(), first.end()));
  }
};

TEST_F(ProxiedTest, the_peer_is_the_one_that_the_header_names) {
  Peer first(listener_->port()), second(listener_->port()), third(listener_->port());
  send_with(first, "PROXY TCP4 203.0.113.7 192.0.2.1 51000 7420\r\n");
  send_with(second, "PROXY TCP6 2001:db8::1 2001:db8::2 51001 7420\r\n");
  send_with(third, "PROXY UNKNOWN\r\n");
  ASSERT_TRUE(run_until([&] { return echoes_.size() == 3; }));
  std::vector<std::string> named;
  for (const auto& echo : echoes_) named.emplace_back(echo->connection->peer());
  EXPECT_THAT(named,
              testing::UnorderedElementsAre("203.0.113.7:51000", "[2001:db8::1]:51001", StartsWith("127.0.0.1:")));
}

TEST_F(ProxiedTest, the_header_may_come_byte_by_byte) {
  Peer peer(listener_->port());
  const std::string header = "PROXY TCP4 203.0.113.7 192.0.2.1 51000 7420\r\n";
  std::size_t at = 0;
  ASSERT_TRUE(run_until([&] {
    if (at < header.size()) at += peer.send(std::string_view(header).substr(at, 1));
    return at == header.size();
  }));
  peer.send(packet(32, 1));
  ASSERT_TRUE(run_until([&] { return echoes_.size() == 1; }));
  EXPECT_EQ(echoes_[0]->connection->peer(), "203.0.113.7:51000");
}

TEST_F(ProxiedTest, the_limits_of_one_address_are_those_of_the_named_one) {
  std::vector<std::unique_ptr<Peer>> peers;
  // One address may have two connections here. All come from the proxy's address, but the header's address counts.
  for (int i = 0; i < 3; ++i) {
    peers.push_back(std::make_unique<Peer>(listener_->port()));
    send_with(*peers.back(), "PROXY TCP4 203.0.113.7 192.0.2.1 51000 7420\r\n");
  }
  ASSERT_TRUE(run_until([&] { return counters_.connections_refused_address.value() == 1; }));
  Peer other(listener_->port());
  send_with(other, "PROXY TCP4 203.0.113.8 192.0.2.1 51000 7420\r\n");
  ASSERT_TRUE(run_until([&] { return echoes_.size() == 3; }));
}

TEST_F(ProxiedTest, nobody_is_exempt_by_the_word_of_the_header) {
  // Connections of the loopback itself are exempt from limits, but anyone can write its address into a header. Three
  // headers name 127.0.0.1, one of them in IPv6 notation, and three name ::1; two of each are admitted.
  std::vector<std::unique_ptr<Peer>> peers;
  for (const char* family :
       {"TCP4 127.0.0.1", "TCP6 ::ffff:127.0.0.1", "TCP4 127.0.0.1", "TCP6 ::1", "TCP6 ::1", "TCP6 ::1"}) {
    peers.push_back(std::make_unique<Peer>(listener_->port()));
    const std::string to = std::string(family).starts_with("TCP4") ? "192.0.2.1" : "2001:db8::2";
    send_with(*peers.back(), std::string("PROXY ") + family + " " + to + " 51000 7420\r\n");
  }
  ASSERT_TRUE(run_until([&] { return counters_.connections_refused_address.value() == 2 && echoes_.size() == 4; }));
  std::set<std::string_view> networks;
  for (const auto& echo : echoes_) networks.insert(echo->connection->network());
  EXPECT_THAT(networks, testing::ElementsAre("127.0.0.1", "::/64"));
}

TEST_F(ProxiedTest, a_connection_of_a_proxy_without_a_header_is_closed) {
  Peer packets(listener_->port()), request(listener_->port());
  packets.send(packet(32, 1));
  EXPECT_EQ(answer_to(packets, ""), "");
  EXPECT_EQ(answer_to(request, "GET / HTTP/1.1\r\nHost: here\r\n\r\n"), "");
  EXPECT_EQ(counters_.handshakes_failed_proxy.value(), 2u);
  EXPECT_TRUE(echoes_.empty());
}

TEST_F(TransportTest, a_proxys_header_from_another_peer_is_an_error) {
  // No address is listed in proxy_protocol, so a header would let anyone choose an address.
  Peer text(listener_->port()), binary(listener_->port());
  EXPECT_THAT(answer_to(text, "PROXY TCP4 203.0.113.7 192.0.2.1 51000 7420\r\n"), StartsWith("HTTP/1.1 400 "));
  binary.send(std::string_view("\r\n\r\n\0\r\nQUIT\n\x20\0\0", 16));
  ASSERT_TRUE(run_until([&] { return echoes_.size() == 1 && echoes_[0]->broken; }));
}

class DualStackTest : public TransportTest {
 protected:
  TransportOptions options() override {
    TransportOptions made = TransportTest::options();
    made.addresses = {"::"};
    return made;
  }
};

TEST_F(DualStackTest, every_address_of_both_kinds_reaches_one_listener) {
  Peer over_v4(listener_->port());
  over_v4.send(packet(32, 1));
  ASSERT_TRUE(run_until([&] { return echoes_.size() == 1; }));
  EXPECT_THAT(echoes_[0]->connection->peer(), StartsWith("127.0.0.1:"));
  EXPECT_EQ(echoes_[0]->connection->network(), "") << "the loopback is exempt";
  EXPECT_EQ(echoes_[0]->connection->transport(), "tcp");
  const std::unique_ptr<Peer> over_v6 = Peer::over_ipv6(listener_->port());
  if (!over_v6) GTEST_SKIP() << "this machine has no IPv6";
  over_v6->send(packet(32, 2));
  ASSERT_TRUE(run_until([&] { return echoes_.size() == 2; }));
  EXPECT_THAT(echoes_[1]->connection->peer(), StartsWith("[::1]:"));
  EXPECT_EQ(echoes_[1]->connection->network(), "") << "the loopback is exempt";
  EXPECT_EQ(echoes_[1]->connection->transport(), "tcp");
}

class TwoAddressesTest : public TransportTest {
 protected:
  TransportOptions options() override {
    TransportOptions made = TransportTest::options();
    made.addresses = {"127.0.0.1", "127.0.0.2"};
    return made;
  }
};

TEST_F(TwoAddressesTest, one_listener_takes_several_addresses_on_one_port) {
  TransportOptions taken = TransportTest::options();
  taken.addresses = {"127.0.0.2"};
  taken.port = listener_->port();
  EXPECT_FALSE(Listener::create(loop_, taken, counters_, {}));
}

}  // namespace
}  // namespace hairnet::server
