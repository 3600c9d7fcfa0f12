#include "client/link/address.hpp"

#include <gtest/gtest.h>

namespace hairnet::link {
namespace {

TEST(Address, every_transport_has_its_form_and_its_port) {
  struct Case {
    const char* text;
    Transport transport;
    const char* host;
    int port;
    const char* path;
  };
  for (const Case& c :
       // Without a port the address means 7420, Hairnet's own, or the usual port of HTTP for WebSockets. A path is
       // for WebSockets alone.
       {Case{"here:7421", Transport::tcp, "here", 7421, "/ws"},
        Case{"10.0.0.1", Transport::tcp, "10.0.0.1", 7420, "/ws"},
        Case{"tcp://here", Transport::tcp, "here", 7420, "/ws"}, Case{"tls://[::1]:9", Transport::tls, "::1", 9, "/ws"},
        Case{"[fe80::2]", Transport::tcp, "fe80::2", 7420, "/ws"}, Case{"ws://here", Transport::ws, "here", 80, "/ws"},
        Case{"wss://here/a/b?c=d", Transport::wss, "here", 443, "/a/b?c=d"},
        Case{"ws://[::1]:8080/x", Transport::ws, "::1", 8080, "/x"}}) {
    const Result<Address> address = parse_address(c.text);
    ASSERT_TRUE(address) << c.text << ": " << address.error();
    EXPECT_EQ(address->transport, c.transport) << c.text;
    EXPECT_EQ(address->host, c.host) << c.text;
    EXPECT_EQ(address->port, c.port) << c.text;
    EXPECT_EQ(address->path, c.path) << c.text;
    const Result<Address> again = parse_address(to_string(*address));
    ASSERT_TRUE(again) << to_string(*address);
    EXPECT_EQ(to_string(*again), to_string(*address));
  }
}

TEST(Address, names_its_host_and_port_as_requests_do) {
  EXPECT_EQ(parse_address("wss://here/a")->authority(), "here:443");
  EXPECT_EQ(parse_address("tls://[::1]:9")->authority(), "[::1]:9");
  EXPECT_EQ(parse_address("[::1]")->authority_at(8), "[::1]:8");
}

TEST(TransportChoice, is_one_of_three_words) {
  EXPECT_EQ(parse_transport_choice("auto").value(), TransportChoice::automatic);
  EXPECT_EQ(parse_transport_choice("webtransport").value(), TransportChoice::webtransport);
  EXPECT_EQ(parse_transport_choice("address").value(), TransportChoice::address);
  for (const char* text : {"", "Auto", "tcp", "websocket"}) EXPECT_FALSE(parse_transport_choice(text)) << text;
}

TEST(Address, refuses_invalid_text_with_a_reason) {
  for (const char* text :
       {"", ":7420", "here:", "here:0", "here:65536", "here:-1", "here:7420x", "http://here", "://here", "::1", "[::1",
        "[::1]7420", "[]:1", "tcp://here/path", "he re:1", "ws://here/a b", "ws:///ws", "here:1:2", "h\xc3\xa4r:1"}) {
    const Result<Address> address = parse_address(text);
    ASSERT_FALSE(address) << text;
    EXPECT_EQ(address.error().find('\n'), std::string::npos);
    // The reason must quote the text and say something about it.
    EXPECT_GT(address.error().size(), std::string(text).size() + 5);
  }
}

}  // namespace
}  // namespace hairnet::link
