#include <gmock/gmock.h>
#include <gtest/gtest.h>
#include <sys/stat.h>
#include <unistd.h>

#include <filesystem>
#include <fstream>
#include <string>
#include <utility>

#include "server/transport/admission.hpp"
#include "server/transport/detected_protocol.hpp"
#include "server/transport/origin.hpp"
#include "server/transport/peer_address.hpp"
#include "server/transport/proxy_header.hpp"
#include "server/transport/static_files.hpp"
#include "server/transport/transport_options.hpp"

namespace hairnet::server {
namespace {

using testing::HasSubstr;
using testing::IsEmpty;
using testing::Not;

constexpr std::int64_t kStart_ns = 1'000'000'000'000;

DetectedProtocol opening_of_text(std::string_view bytes) {
  return detect_protocol({reinterpret_cast<const std::uint8_t*>(bytes.data()), bytes.size()});
}

TEST(DetectedProtocol, every_protocol_is_known_by_its_first_bytes_and_not_before) {
  // A TLS record begins with its type 0x16 and a version of 3.1 to 3.4. A packet begins with its size, the low byte
  // first: 0x4c bytes here.
  const std::string_view tls("\x16\x03\x01\x02", 4), packet("\x4c\0\0\0", 4);
  for (const std::string_view whole : {std::string_view("GET "), std::string_view("HEAD"), std::string_view("POST"),
                                       std::string_view("PUT "), std::string_view("OPTI"), std::string_view("PRI ")}) {
    EXPECT_EQ(opening_of_text(whole), DetectedProtocol::http) << whole;
    // The server decides after four bytes (kProtocolBytesMax), since the size of a packet may begin with letters, too.
    for (std::size_t n = 0; n < 4; ++n)
      EXPECT_EQ(opening_of_text(whole.substr(0, n)), DetectedProtocol::unknown) << whole;
  }
  EXPECT_EQ(opening_of_text(tls), DetectedProtocol::tls);
  for (std::size_t n = 0; n < 3; ++n) EXPECT_EQ(opening_of_text(tls.substr(0, n)), DetectedProtocol::unknown);
  EXPECT_EQ(opening_of_text(packet), DetectedProtocol::packets);
  EXPECT_EQ(opening_of_text(packet.substr(0, 2)), DetectedProtocol::packets);
  EXPECT_EQ(opening_of_text(packet.substr(0, 1)), DetectedProtocol::unknown) << "it is also the letter L";
}

TEST(DetectedProtocol, any_prefix_of_a_first_message_is_a_packet) {
  // A first message has at most a few thousand bytes.
  for (std::uint32_t bytes = 0; bytes < 60'000; ++bytes) {
    const std::array<std::uint8_t, 4> prefix{static_cast<std::uint8_t>(bytes), static_cast<std::uint8_t>(bytes >> 8), 0,
                                             0};
    ASSERT_EQ(detect_protocol(prefix), DetectedProtocol::packets) << bytes;
  }
}

TEST(Network, is_an_ipv4_address_or_an_ipv6_network) {
  const auto of = [](const char* address) { return network_of(asio::ip::make_address(address)); };
  EXPECT_EQ(of("192.0.2.1"), "192.0.2.1");
  EXPECT_EQ(of("::ffff:192.0.2.1"), "192.0.2.1");
  EXPECT_EQ(of("2001:db8:1:2:3:4:5:6"), "2001:db8:1:2::/64");
  EXPECT_EQ(of("2001:db8:1:2::ffff"), "2001:db8:1:2::/64");
  EXPECT_EQ(of("2001:db8:1:3::1"), "2001:db8:1:3::/64");
}

TEST(Origin, without_a_list_only_the_servers_own_pages_may) {
  const std::vector<std::string> none;
  // The arguments are the page's origin, the host that the client has asked for, the list of allowed origins, and
  // whether the server listens on the loopback only. Programs other than browsers send no origin.
  EXPECT_TRUE(origin_allowed("", "example.com", none, false));
  EXPECT_TRUE(origin_allowed("http://example.com", "example.com", none, false));
  EXPECT_TRUE(origin_allowed("https://Example.com", "example.COM:443", none, false));
  EXPECT_TRUE(origin_allowed("https://10.0.0.7:7420", "10.0.0.7:7420", none, false));
  EXPECT_FALSE(origin_allowed("https://example.com", "example.com:7420", none, false));
  EXPECT_FALSE(origin_allowed("https://example.com.evil.net", "example.com", none, false));
  EXPECT_FALSE(origin_allowed("https://evil.net", "example.com", none, false));
  EXPECT_FALSE(origin_allowed("null", "example.com", none, false));
  EXPECT_FALSE(origin_allowed("https://", "", none, false));
}

TEST(Origin, a_server_on_the_loopback_takes_pages_of_this_machine_too) {
  const std::vector<std::string> none;
  const auto allowed = [&none](const char* origin, const char* host) {
    return origin_allowed(origin, host, none, true);
  };
  for (const char* host : {"localhost:7420", "127.0.0.1:7420", "[::1]:7420", "LocalHost:7420"}) {
    for (const char* origin : {"http://localhost:5173", "https://localhost", "http://127.0.0.1:8080",
                               "HTTP://LOCALHOST", "http://[::1]:3000", "https://[::1]"}) {
      EXPECT_TRUE(allowed(origin, host)) << origin << " at " << host;
      EXPECT_FALSE(origin_allowed(origin, host, none, false)) << origin << " at " << host << " of another server";
    }
    for (const char* origin :
         {"http://evil.example:7420", "http://localhost.evil.example", "http://localhost:5173.evil.example",
          "http://evil-localhost", "http://localhost:", "http://localhost:80@evil.example", "http://127.0.0.1.evil.net",
          "http://[::1].evil.net", "http://[::2]", "null", "file://localhost", "localhost:5173", "http://",
          "ws://localhost"})
      EXPECT_FALSE(allowed(origin, host)) << origin << " at " << host;
  }
  // The DNS of another site answers with this machine's address: the browser names the site as the host.
  for (const char* host :
       {"evil.example:7420", "localhost.evil.example", "127.0.0.1.evil.example:7420", "", "10.0.0.7"})
    EXPECT_FALSE(allowed("http://localhost:5173", host)) << host;
  EXPECT_TRUE(allowed("http://evil.example:7420", "evil.example:7420")) << "host_allowed() refuses this one";
  EXPECT_FALSE(
      origin_allowed("http://localhost:5173", "localhost:7420", std::vector<std::string>{"https://a.example"}, true))
      << "a list replaces the rule";
}

TEST(Origin, with_a_list_only_those_on_it_may) {
  const std::vector<std::string> list{"https://a.example", "http://b.example:8080"};
  EXPECT_TRUE(origin_allowed("https://a.example:443", "x", list, false));
  EXPECT_TRUE(origin_allowed("http://b.example:8080", "x", list, false));
  EXPECT_TRUE(origin_allowed("", "x", list, false));
  EXPECT_FALSE(origin_allowed("http://a.example", "x", list, false));
  EXPECT_FALSE(origin_allowed("https://x", "x", list, false));
  EXPECT_TRUE(origin_allowed("https://anyone", "x", std::vector<std::string>{"*"}, false));
}

TEST(Origin, what_is_no_origin_is_refused_at_start) {
  for (const char* good : {"https://a.example", "http://[::1]:8080", "*", "null"})
    EXPECT_THAT(validate_origin(good), IsEmpty()) << good;
  for (const char* bad : {"", "a.example", "https://", "https://a.example/", "ftp://a", "https://a b"})
    EXPECT_THAT(validate_origin(bad), Not(IsEmpty())) << bad;
}

TEST(Host, a_name_must_be_listed_and_a_numeric_address_always_passes) {
  const std::vector<std::string> list{"localhost", "Hair.example.com"};
  for (const char* good : {"localhost", "LOCALHOST:7420", "hair.example.com", "hair.EXAMPLE.com:443", "127.0.0.1",
                           "10.0.0.7:7420", "[::1]", "[2001:db8::1]:7420"})
    EXPECT_TRUE(host_allowed(good, list)) << good;
  for (const char* bad : {"", ":7420", "evil.example", "localhost.evil.example", "example.com", "x.hair.example.com",
                          "1.2.3.4.evil.example", "7f000001.example"})
    EXPECT_FALSE(host_allowed(bad, list)) << bad;
  EXPECT_TRUE(host_allowed("anything", std::vector<std::string>{"*"}));
}

TEST(Host, what_is_no_name_is_refused_at_start) {
  for (const char* good : {"a.example", "localhost", "*"}) EXPECT_THAT(validate_host(good), IsEmpty()) << good;
  for (const char* bad : {"", "https://a.example", "a.example:7420", "a b", "*.example"})
    EXPECT_THAT(validate_host(bad), Not(IsEmpty())) << bad;
}

TEST(TransportOptions, lists_must_be_of_numeric_addresses_and_of_names) {
  TransportOptions options;
  options.proxy_protocol = {"192.0.2.1", "2001:db8::1"};
  EXPECT_THAT(validate(options), IsEmpty());
  options.proxy_protocol = {"balancer.example"};
  EXPECT_THAT(validate(options), HasSubstr("balancer.example"));
  options.proxy_protocol = {};
  options.exempt_addresses = {"10.0.0.0/8"};
  EXPECT_THAT(validate(options), HasSubstr("10.0.0.0/8"));
  options.exempt_addresses = {};
  options.hosts = {"http://a"};
  EXPECT_THAT(validate(options), HasSubstr("http://a"));
}

TEST(TransportOptions, half_of_tls_is_refused) {
  TransportOptions options;
  EXPECT_THAT(validate(options), IsEmpty());
  options.tls.certificate = "chain.pem";
  EXPECT_THAT(validate(options), HasSubstr("key"));
  options.tls = {};
  options.tls_required = true;
  EXPECT_THAT(validate(options), HasSubstr("certificate"));
}

TEST(Admission, leaving_makes_room_and_a_refusal_names_the_full_limit) {
  // The limits are those of AdmissionLimits in order: 4 connections in all, 2 of one address, 3 arrivals and 1 that
  // requests pages. The first argument of enter() stands for an address.
  auto admission = std::make_shared<Admission>(AdmissionLimits{4, 2, 3, 1});
  using Verdict = Admission::Verdict;
  std::vector<Admission::Ticket> tickets(6);
  EXPECT_EQ(admission->enter(1, 0, tickets[0]), Verdict::admitted);
  EXPECT_EQ(admission->enter(1, 0, tickets[1]), Verdict::admitted);
  EXPECT_EQ(admission->enter(1, 0, tickets[2]), Verdict::address_full);
  EXPECT_EQ(admission->enter(2, 0, tickets[2]), Verdict::admitted);
  EXPECT_EQ(admission->enter(3, 0, tickets[3]), Verdict::arrivals_full);
  EXPECT_TRUE(tickets[0].move_to(Admission::Place::session));
  EXPECT_TRUE(tickets[1].move_to(Admission::Place::http));
  EXPECT_FALSE(tickets[2].move_to(Admission::Place::http)) << "one at most";
  EXPECT_TRUE(tickets[1].move_to(Admission::Place::session));
  EXPECT_TRUE(tickets[2].move_to(Admission::Place::http));
  EXPECT_EQ(admission->enter(3, 0, tickets[3]), Verdict::admitted);
  EXPECT_EQ(admission->enter(4, 0, tickets[4]), Verdict::full);
  tickets[0] = {};
  EXPECT_EQ(admission->enter(1, 0, tickets[4]), Verdict::admitted);
  tickets.clear();
  EXPECT_EQ(admission->count(), 0u);
}

TEST(Admission, by_default_one_address_takes_neither_all_handshakes_nor_all_pages) {
  const AdmissionLimits limits;
  auto admission = std::make_shared<Admission>(limits);
  std::vector<Admission::Ticket> tickets(1000);
  std::size_t count = 0;
  while (count < tickets.size() && admission->enter(1, kStart_ns, tickets[count]) == Admission::Verdict::admitted)
    ++count;
  // One address that takes all that it may still leaves more than half of the arrivals and of the pages to the others.
  EXPECT_LT(2 * count, limits.arrivals_max);
  EXPECT_LT(2 * count, limits.http_max);
  EXPECT_EQ(admission->enter(2, kStart_ns, tickets[count]), Admission::Verdict::admitted);
}

TEST(Admission, new_connections_of_one_address_are_limited_in_rate_and_regain_it) {
  AdmissionLimits limits;
  limits.connections_per_address_per_s = 2;
  limits.connections_per_address_burst = 3;
  auto admission = std::make_shared<Admission>(limits);
  using Verdict = Admission::Verdict;
  const auto visit = [&](std::optional<std::uint64_t> address, std::int64_t now_ns) {
    Admission::Ticket ticket;
    return admission->enter(address, now_ns, ticket);
  };
  for (int i = 0; i < 3; ++i) EXPECT_EQ(visit(1, kStart_ns), Verdict::admitted);
  EXPECT_EQ(visit(1, kStart_ns), Verdict::address_rate);
  EXPECT_EQ(visit(2, kStart_ns), Verdict::admitted) << "another address has a rate of its own";
  for (int i = 0; i < 10; ++i) EXPECT_EQ(visit(std::nullopt, kStart_ns), Verdict::admitted) << "exempt";
  // At 2 connections in a second, one is regained in half a second.
  EXPECT_EQ(visit(1, kStart_ns + 500'000'000), Verdict::admitted);
  EXPECT_EQ(visit(1, kStart_ns + 500'000'000), Verdict::address_rate);
}

TEST(Admission, addresses_are_forgotten_once_their_rate_is_whole_again) {
  AdmissionLimits limits;
  limits.connections_per_address_per_s = 10;
  limits.connections_per_address_burst = 20;
  auto admission = std::make_shared<Admission>(limits);
  std::vector<Admission::Ticket> tickets(2);
  for (std::uint64_t address = 0; address < 100; ++address) admission->enter(address, kStart_ns, tickets[0]);
  EXPECT_EQ(admission->address_count(), 100u);
  // Each address regains what it has used within 2 s. Of the first 100 only the last is still connected, since each new
  // ticket replaced the one before.
  admission->enter(1000, kStart_ns + 2'000'000'000, tickets[1]);
  EXPECT_EQ(admission->address_count(), 2u) << "the one that is still connected, and the new one";
}

TEST(Admission, the_table_of_addresses_is_bounded) {
  auto admission = std::make_shared<Admission>(AdmissionLimits{});
  for (std::uint64_t address = 0; address < 2 * Admission::kIdleAddressesMax; ++address) {
    Admission::Ticket ticket;
    ASSERT_EQ(admission->enter(address, kStart_ns, ticket), Admission::Verdict::admitted);
    ASSERT_LE(admission->address_count(), Admission::kIdleAddressesMax + 1);
  }
}

TEST(Admission, more_new_connections_than_the_rate_of_all_stop_the_accepting_until_it_has_recovered) {
  AdmissionLimits limits;
  limits.connections_per_s = 2;
  limits.connections_burst = 3;
  auto admission = std::make_shared<Admission>(limits);
  std::vector<Admission::Ticket> tickets(5);
  // The burst of 3 may come at once; the fourth connection is one too many, and is paid for after half a second at 2 in
  // a second.
  for (std::size_t i = 0; i < 3; ++i) {
    admission->enter(i, kStart_ns, tickets[i]);
    EXPECT_TRUE(admission->may_accept(kStart_ns));
  }
  admission->enter(3, kStart_ns, tickets[3]);
  EXPECT_FALSE(admission->may_accept(kStart_ns));
  EXPECT_FALSE(admission->may_accept(kStart_ns + 400'000'000));
  EXPECT_TRUE(admission->may_accept(kStart_ns + 500'000'000));
}

TEST(Admission, refused_connections_use_up_nothing_of_the_rate_of_all) {
  AdmissionLimits limits;
  // Practically nothing is regained during the test: one address may connect once, and all addresses twice.
  limits.connections_per_address_per_s = 1e-6;
  limits.connections_per_address_burst = 1;
  limits.connections_per_s = 1e-6;
  limits.connections_burst = 2;
  auto admission = std::make_shared<Admission>(limits);
  std::vector<Admission::Ticket> tickets(2);
  admission->enter(1, kStart_ns, tickets[0]);
  for (int i = 0; i < 100; ++i) {
    Admission::Ticket refused;
    EXPECT_EQ(admission->enter(1, kStart_ns, refused), Admission::Verdict::address_rate);
  }
  EXPECT_TRUE(admission->may_accept(kStart_ns));
  EXPECT_EQ(admission->enter(2, kStart_ns, tickets[1]), Admission::Verdict::admitted);
  EXPECT_TRUE(admission->may_accept(kStart_ns));
}

TEST(Admission, a_proxied_connection_counts_as_one_of_the_address_that_it_is_given_later) {
  AdmissionLimits limits;
  limits.connections_per_address_max = 1;
  auto admission = std::make_shared<Admission>(limits);
  std::vector<Admission::Ticket> tickets(3);
  for (Admission::Ticket& ticket : tickets) admission->enter(std::nullopt, kStart_ns, ticket);
  EXPECT_EQ(tickets[0].set_address(7, kStart_ns), Admission::Verdict::admitted);
  EXPECT_EQ(tickets[1].set_address(7, kStart_ns), Admission::Verdict::address_full);
  tickets[0] = {};
  EXPECT_EQ(tickets[2].set_address(7, kStart_ns), Admission::Verdict::admitted);
  tickets.clear();
  EXPECT_EQ(admission->count(), 0u);
}

ProxyHeader header_of_text(std::string_view text) {
  return parse_proxy_header({reinterpret_cast<const std::uint8_t*>(text.data()), text.size()});
}

// Makes a header of version 2 of the PROXY protocol: a signature of 12 bytes, version and command, family, and the size
// of what follows.
std::string binary_header(std::uint8_t command, std::uint8_t family, std::string_view rest) {
  std::string header("\r\n\r\n\0\r\nQUIT\n", 12);
  header += {static_cast<char>(command), static_cast<char>(family), static_cast<char>(rest.size() >> 8),
             static_cast<char>(rest.size())};
  return header.append(rest);
}

// The peer 203.0.113.7:51000, and this server's end 192.0.2.1:7420: two addresses, then two ports.
const std::string kV4Addresses("\xcb\0\x71\x07\xc0\0\x02\x01\xc7\x38\x1c\xfc", 12);

using ProxyStatus = ProxyHeader::Status;

TEST(ProxyHeader, names_the_peer_in_text_and_in_binary) {
  // A binary header may have further values behind the addresses, which are skipped.
  const std::string more(40, '\x01');
  std::string v6(36, '\0');
  // The peer is [2001::9]:80: 16 bytes of its address, 16 of this server's, and then the two ports.
  v6[0] = 0x20, v6[1] = 0x01, v6[15] = 0x09, v6[33] = 0x50;
  const std::pair<std::string, std::string> cases[] = {
      {"PROXY TCP4 203.0.113.7 192.0.2.1 51000 7420\r\n", "203.0.113.7:51000"},
      {"PROXY TCP6 2001::9 2001:db8::2 80 7420\r\n", "[2001::9]:80"},
      {binary_header(0x21, 0x11, kV4Addresses), "203.0.113.7:51000"},
      {binary_header(0x21, 0x11, kV4Addresses + more), "203.0.113.7:51000"},
      {binary_header(0x21, 0x21, v6), "[2001::9]:80"},
  };
  for (const auto& [text, peer] : cases) {
    for (std::size_t n = 0; n < text.size(); ++n)
      ASSERT_EQ(header_of_text(std::string_view(text).substr(0, n)).status, ProxyStatus::incomplete) << peer << n;
    const ProxyHeader header = header_of_text(text + "rest");
    ASSERT_EQ(header.status, ProxyStatus::complete) << peer;
    EXPECT_EQ(header.bytes, text.size());
    ASSERT_TRUE(header.peer) << peer;
    EXPECT_EQ(shown(*header.peer), peer);
  }
}

TEST(ProxyHeader, a_proxys_own_connection_keeps_its_address) {
  for (const std::string& text :
       {std::string("PROXY UNKNOWN\r\n"), std::string("PROXY UNKNOWN ffff::1 ffff::2 1 2\r\n"),
        // The first number is the version 2 with the command LOCAL (0x20) or PROXY (0x21). The second one is the
        // family: unknown (0x00), TCP over IPv4 (0x11) or IPv6 (0x21), and Unix sockets (0x31).
        binary_header(0x20, 0x00, ""), binary_header(0x20, 0x11, kV4Addresses), binary_header(0x21, 0x00, ""),
        binary_header(0x21, 0x31, std::string(216, 'x'))}) {
    const ProxyHeader header = header_of_text(text);
    EXPECT_EQ(header.status, ProxyStatus::complete);
    EXPECT_EQ(header.bytes, text.size());
    EXPECT_FALSE(header.peer);
  }
}

TEST(ProxyHeader, everything_else_is_malformed) {
  for (const std::string& text :
       {std::string("GET / HTTP/1.1\r\n"), std::string("\x20\0\0\0", 4), std::string("PROXYTCP4"),
        std::string("PROXY TCP4 203.0.113.7 192.0.2.1 51000\r\n"), std::string("PROXY \r\n"),
        std::string("PROXY TCP4 203.0.113.7 192.0.2.1 51000 7420 1\r\n"),
        std::string("PROXY TCP4 203.0.113.7 192.0.2.1 65536 7420\r\n"),
        std::string("PROXY TCP4 203.0.113.7 192.0.2.1 -1 7420\r\n"),
        std::string("PROXY TCP4 2001::9 192.0.2.1 1 2\r\n"), std::string("PROXY TCP6 203.0.113.7 2001::9 1 2\r\n"),
        std::string("PROXY TCP5 203.0.113.7 192.0.2.1 1 2\r\n"), std::string("PROXY UDP4 1.2.3.4 1.2.3.4 1 2\r\n"),
        std::string("PROXY TCP4  203.0.113.7 192.0.2.1 1 2\r\n"), "PROXY UNKNOWN " + std::string(107, 'x') + "\r\n",
        binary_header(0x31, 0x11, kV4Addresses), binary_header(0x22, 0x11, kV4Addresses),
        binary_header(0x21, 0x11, kV4Addresses.substr(1)), binary_header(0x21, 0x21, kV4Addresses),
        binary_header(0x21, 0x11, std::string(kProxyHeaderBytesMax, 'x'))})
    EXPECT_EQ(header_of_text(text).status, ProxyStatus::malformed) << text;
}

class StaticFilesTest : public testing::Test {
 protected:
  void SetUp() override {
    std::string made = (std::filesystem::temp_directory_path() / "hairnet_web_XXXXXX").string();
    ASSERT_NE(::mkdtemp(made.data()), nullptr);
    outer_ = made;
    std::filesystem::create_directories(outer_ / "root/assets/deep");
    write("secret.txt", "secret");
    write("root/index.html", "<html></html>");
    write("root/assets/index-4f3a9b1c.js", "export {}");
    write("root/assets/deep/index.html", "deep");
    write("root/a b.txt", "space");
    write("root/.hidden", "hidden");
    std::filesystem::create_symlink("../secret.txt", outer_ / "root/link.txt");
    std::filesystem::create_directory_symlink("..", outer_ / "root/up");
    std::filesystem::create_symlink("index.html", outer_ / "root/inside.html");
    ASSERT_EQ(::mkfifo((outer_ / "root/pipe").c_str(), 0600), 0);
    auto opened = StaticFiles::open((outer_ / "root").string());
    ASSERT_TRUE(opened) << opened.error();
    files_ = std::move(*opened);
  }
  void TearDown() override { std::filesystem::remove_all(outer_); }
  void write(const std::string& name, std::string_view text) { std::ofstream(outer_ / name) << text; }
  StaticFind find(std::string_view path) {
    StaticFile file;
    return files_->find(path, file);
  }

  std::filesystem::path outer_;
  std::unique_ptr<StaticFiles> files_;
};

TEST_F(StaticFilesTest, files_are_found_with_their_type_and_how_long_they_keep) {
  StaticFile file;
  ASSERT_EQ(files_->find("/", file), StaticFind::found);
  EXPECT_EQ(file.content_type, "text/html; charset=utf-8");
  EXPECT_EQ(file.cache_control, "no-cache");
  EXPECT_EQ(file.bytes, 13u);
  std::vector<std::uint8_t> bytes(100);
  // The file has 13 bytes, so 7 are left from byte 6 on.
  EXPECT_EQ(file.read(6, bytes), 7u);
  EXPECT_EQ(bytes[0], '<');
  ASSERT_EQ(files_->find("/assets/index-4f3a9b1c.js", file), StaticFind::found);
  EXPECT_EQ(file.content_type, "text/javascript; charset=utf-8");
  EXPECT_THAT(file.cache_control, HasSubstr("immutable"));
  write("root/assets/hairnet-37d79c72.wasm", "module");
  ASSERT_EQ(files_->find("/assets/hairnet-37d79c72.wasm", file), StaticFind::found);
  EXPECT_EQ(file.content_type, "application/wasm");
  EXPECT_THAT(file.cache_control, HasSubstr("immutable"));
  EXPECT_EQ(find("/a%20b.txt"), StaticFind::found);
  EXPECT_EQ(find("/%69ndex.html"), StaticFind::found);
  EXPECT_EQ(find("/assets/deep/"), StaticFind::found);
  EXPECT_EQ(find("/assets/deep"), StaticFind::is_folder);
}

TEST_F(StaticFilesTest, a_tag_changes_with_the_file) {
  StaticFile before, after;
  ASSERT_EQ(files_->find("/index.html", before), StaticFind::found);
  write("root/index.html", "<html>longer</html>");
  ASSERT_EQ(files_->find("/index.html", after), StaticFind::found);
  EXPECT_NE(before.etag, after.etag);
}

TEST_F(StaticFilesTest, a_compressed_copy_is_a_plain_file_beside_its_page) {
  const std::vector<ContentCoding> any{ContentCoding::brotli, ContentCoding::gzip, ContentCoding::identity};
  StaticFile file;
  const auto encoding_of = [&](std::string_view path) {
    return files_->find(path, file, any) == StaticFind::found ? "'" + file.content_encoding + "'" : "none";
  };
  const std::filesystem::path root = outer_ / "root";
  EXPECT_EQ(encoding_of("/index.html"), "''");
  std::ofstream(root / "index.html.gz") << "zip";
  EXPECT_EQ(encoding_of("/index.html"), "'gzip'");
  EXPECT_EQ(encoding_of("/"), "'gzip'");
  EXPECT_EQ(file.bytes, 3u);
  std::filesystem::create_directory(root / "index.html.br");
  EXPECT_EQ(encoding_of("/index.html"), "'gzip'") << "a folder is no copy";
  std::filesystem::remove(root / "index.html.br");
  std::ofstream(outer_ / "outside") << "secret";
  std::filesystem::create_symlink(outer_ / "outside", root / "index.html.br");
  EXPECT_EQ(encoding_of("/index.html"), "'gzip'") << "a link is not followed";
  std::ofstream(root / "lonely.html.br") << "copy";
  EXPECT_EQ(encoding_of("/lonely.html"), "none") << "a copy without its page is none";
  EXPECT_EQ(encoding_of("/lonely.html.br"), "''");
  EXPECT_EQ(file.content_type, "application/octet-stream");
  EXPECT_EQ(encoding_of("/.."), "none");
}

std::string accepted_of(std::string_view field) {
  std::string text;
  for (const ContentCoding coding : accepted_codings(field))
    text += (text.empty() ? "" : " ") + (name_of(coding).token.empty() ? "-" : std::string(name_of(coding).token));
  return text;
}

TEST(ContentCoding, the_field_accept_encoding_orders_what_is_sent) {
  EXPECT_EQ(accepted_of(""), "-");
  EXPECT_EQ(accepted_of("gzip"), "gzip -");
  EXPECT_EQ(accepted_of("gzip, deflate, br, zstd"), "br gzip -");
  EXPECT_EQ(accepted_of(" GZIP ;Q=1.0 ,BR\t; q=0.9 "), "gzip br -");
  EXPECT_EQ(accepted_of("x-gzip"), "gzip -");
  EXPECT_EQ(accepted_of("*"), "br gzip -");
  EXPECT_EQ(accepted_of("*;q=0.5, br;q=0"), "gzip -");
  EXPECT_EQ(accepted_of("br;q=0.2, gzip;q=0.8, identity;q=0.5"), "gzip -");
  EXPECT_EQ(accepted_of("gzip, identity;q=0"), "gzip -") << "the file itself is better than no answer";
  EXPECT_EQ(accepted_of("*;q=0"), "-");
}

TEST(ContentCoding, words_that_make_no_sense_are_ignored) {
  for (const char* field :
       {"br;q=2", "br;q=-1", "br;q=nan", "br;q=", "br;q=1x", "brr", "b r", ",;,=;q", "br=1", ";q=1"})
    EXPECT_EQ(accepted_of(field), "-") << field;
  EXPECT_EQ(accepted_of("br;q=nan,gzip"), "gzip -");
  EXPECT_EQ(accepted_of(std::string(8000, ',') + "br"), "br -");
}

TEST_F(StaticFilesTest, no_path_leads_out_of_the_root_or_to_what_is_no_page) {
  using std::string_view_literals::operator""sv;
  // The root must not be left by dots, plain or encoded in any way, nor by links. Hidden files, pipes and folders
  // without a page are not served, and a path has only so many parts.
  for (const std::string_view path : {"/../secret.txt"sv,
                                      "/assets/../../secret.txt"sv,
                                      "/%2e%2e/secret.txt"sv,
                                      "/..%2fsecret.txt"sv,
                                      "/%2e%2e%2fsecret.txt"sv,
                                      "/.%2e/secret.txt"sv,
                                      "/..\\secret.txt"sv,
                                      "/..%5csecret.txt"sv,
                                      "/%252e%252e/secret.txt"sv,
                                      "/%c0%ae%c0%ae/secret.txt"sv,
                                      "//secret.txt"sv,
                                      "/./index.html"sv,
                                      "/link.txt"sv,
                                      "/up/secret.txt"sv,
                                      "/up/"sv,
                                      "/inside.html"sv,
                                      "/.hidden"sv,
                                      "/pipe"sv,
                                      "/none.txt"sv,
                                      "/index.html/"sv,
                                      "/index.html/x"sv,
                                      "/index.html%00.txt"sv,
                                      "/index.html\0"sv,
                                      "/%"sv,
                                      "/%4"sv,
                                      "/%zz"sv,
                                      "/%0d%0aX: y"sv,
                                      "index.html"sv,
                                      ""sv,
                                      "*"sv,
                                      "http://host/index.html"sv,
                                      "/~root/"sv,
                                      "/proc/self/environ"sv,
                                      "/assets/deep/../../../secret.txt"sv,
                                      "/a/b/c/d/e/f/g/h/i/j/k/l/m/n/o/p/q/r/s/t"sv}) {
    const StaticFind found = find(path);
    EXPECT_TRUE(found == StaticFind::not_found || found == StaticFind::bad_path) << path;
  }
}

TEST_F(StaticFilesTest, a_root_that_is_not_there_is_one_clear_line) {
  const auto opened = StaticFiles::open("/nowhere/at/all");
  ASSERT_FALSE(opened);
  EXPECT_THAT(opened.error(), HasSubstr("/nowhere/at/all"));
}

}  // namespace
}  // namespace hairnet::server
