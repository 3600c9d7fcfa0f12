#include <stdlib.h>

#include <atomic>
#include <boost/asio.hpp>
#include <boost/asio/ssl.hpp>
#include <boost/beast/websocket/ssl.hpp>
#include <filesystem>
#include <fstream>
#include <functional>
#include <thread>

#include "server/transport/beast.hpp"
#include "tests/unit/server/transport_fixture.hpp"

namespace hairnet::server {
namespace {

namespace asio = boost::asio;
namespace ssl = boost::asio::ssl;
using asio::ip::tcp;
using testing::HasSubstr;
using testing::StartsWith;

// Two certificates of deploy/certificate, which a test program makes once: the server's, and one that it does not use.
class Certificates {
 public:
  Certificates() {
    std::string made = (std::filesystem::temp_directory_path() / "hairnet_tls_XXXXXX").string();
    if (!::mkdtemp(made.data())) return;
    folder = made;
    for (const char* name : {"ours", "other"}) {
      const std::string command =
          std::string(HAIRNET_DEPLOY_DIR) + "/certificate --out " + (folder / name).string() + " 127.0.0.1 > /dev/null";
      valid &= std::system(command.c_str()) == 0;
    }
  }
  ~Certificates() { std::filesystem::remove_all(folder); }
  [[nodiscard]] std::string path(const std::string& name) const { return (folder / name).string(); }
  std::filesystem::path folder;
  bool valid = true;
};

const Certificates& certificates() {
  static const Certificates made;
  return made;
}

TlsFiles our_files() {
  return {certificates().path("ours/chain.pem"), certificates().path("ours/key.pem")};
}

using TlsSocket = ssl::stream<tcp::socket>;

class TlsTest : public TransportTest {
 protected:
  TransportOptions options() override {
    TransportOptions made = TransportTest::options();
    made.tls = our_files();
    // A handshake must end within this time. It is short, since one case waits until it is over.
    made.opening_timeout = std::chrono::milliseconds(400);
    return made;
  }
  void SetUp() override {
    ASSERT_TRUE(certificates().valid) << "deploy/certificate failed";
    TransportTest::SetUp();
  }
  // Runs a client that may block on its own thread, and the loop here; returns the text of a thrown error.
  std::string with_client(const std::function<void(TlsSocket&)>& talk, const std::string& trusted = "ours/chain.pem",
                          bool handshake = true) {
    std::atomic<bool> done = false;
    std::string failed;
    std::thread client([&, port = listener_->port()] {
      try {
        asio::io_context context;
        ssl::context tls(ssl::context::tls_client);
        tls.load_verify_file(certificates().path(trusted));
        tls.set_verify_mode(ssl::verify_peer);
        TlsSocket socket(context, tls);
        socket.set_verify_callback(ssl::host_name_verification("127.0.0.1"));
        socket.next_layer().connect({asio::ip::make_address("127.0.0.1"), port});
        if (handshake) socket.handshake(ssl::stream_base::client);
        talk(socket);
      } catch (const std::exception& error) {
        failed = error.what();
      }
      done = true;
    });
    EXPECT_TRUE(run_until([&] { return done.load(); }));
    client.join();
    return failed;
  }
};

TEST_F(TlsTest, packets_travel_inside_tls) {
  const std::string failed = with_client([](TlsSocket& socket) {
    for (std::size_t i = 0; i < 60; ++i) {
      // The sizes grow to 104 KiB, and a record of TLS has at most 16 KiB. So packets share records, and records share
      // packets.
      const auto sent = packet(16 + i * 1801, static_cast<std::uint8_t>(i));
      asio::write(socket, asio::buffer(sent));
      std::vector<std::uint8_t> got(sent.size());
      asio::read(socket, asio::buffer(got));
      if (got != sent) throw std::runtime_error("packet " + std::to_string(i));
    }
  });
  EXPECT_EQ(failed, "");
  EXPECT_EQ(counters_.connections_tls.value(), 1u);
  EXPECT_EQ(counters_.connections_opened_tcp.value(), 1u);
  EXPECT_EQ(echoes_[0]->connection->transport(), "tls");
}

TEST_F(TlsTest, a_websocket_travels_inside_tls) {
  const std::string failed = with_client([](TlsSocket& tls) {
    websocket::stream<TlsSocket&> socket(tls);
    socket.handshake("127.0.0.1", "/ws");
    socket.binary(true);
    for (std::size_t i = 0; i < 40; ++i) {
      const auto sent = packet(16 + i * 2503, static_cast<std::uint8_t>(i));
      socket.write(asio::buffer(sent));
      beast::flat_buffer got;
      socket.read(got);
      if (got.size() != sent.size()) throw std::runtime_error("packet " + std::to_string(i));
    }
    socket.close(websocket::close_code::normal);
  });
  EXPECT_THAT(failed, testing::AnyOf("", HasSubstr("truncated")));
  EXPECT_EQ(counters_.connections_opened_websocket.value(), 1u);
  EXPECT_EQ(echoes_[0]->packets, 40u);
  EXPECT_EQ(echoes_[0]->connection->transport(), "wss");
}

TEST_F(TlsTest, pages_travel_inside_tls_and_plain_beside_it) {
  std::string page;
  const std::string failed = with_client([&](TlsSocket& socket) {
    asio::write(socket, asio::buffer(std::string_view("GET /none HTTP/1.1\r\nHost: x\r\nConnection: close\r\n\r\n")));
    boost::system::error_code error;
    asio::read(socket, asio::dynamic_buffer(page), error);
    // TLS must announce its end, or a client could not tell a complete page from one that was cut.
    if (error != asio::error::eof) throw boost::system::system_error(error);
  });
  EXPECT_EQ(failed, "");
  EXPECT_THAT(page, StartsWith("HTTP/1.1 404 "));
  Peer peer(listener_->port());
  EXPECT_THAT(answer_to(peer, "GET /none HTTP/1.1\r\nHost: x\r\nConnection: close\r\n\r\n"),
              StartsWith("HTTP/1.1 404 "));
}

TEST_F(TlsTest, a_closing_session_sends_waiting_packets_and_ends_tls) {
  refuse_ = true;
  std::string got;
  const std::string failed = with_client([&](TlsSocket& socket) {
    asio::write(socket, asio::buffer(packet(32, 1)));
    boost::system::error_code error;
    asio::read(socket, asio::dynamic_buffer(got), error);
    if (error != asio::error::eof) throw boost::system::system_error(error);
  });
  EXPECT_EQ(failed, "");
  const auto last_word = packet(32, 9);
  EXPECT_EQ(got, std::string(last_word.begin(), last_word.end()));
  EXPECT_TRUE(all_closed());
}

TEST_F(TlsTest, a_client_that_does_not_trust_us_is_no_session) {
  EXPECT_THAT(with_client([](TlsSocket&) {}, "other/chain.pem"), HasSubstr("certificate verify failed"));
  // The client ends the handshake with an alert or without one.
  ASSERT_TRUE(run_until(
      [&] { return counters_.handshakes_failed_tls.value() + counters_.handshakes_failed_silent.value() == 1; }));
  EXPECT_TRUE(echoes_.empty());
  EXPECT_TRUE(all_closed());
}

TEST_F(TlsTest, old_versions_are_refused) {
  const std::string failed = with_client(
      [](TlsSocket& socket) {
        SSL_set_min_proto_version(socket.native_handle(), TLS1_VERSION);
        SSL_set_max_proto_version(socket.native_handle(), TLS1_1_VERSION);
        // At its usual security level OpenSSL itself would refuse to offer these versions, and the server would never
        // be asked.
        SSL_set_cipher_list(socket.native_handle(), "ALL:@SECLEVEL=0");
        socket.handshake(ssl::stream_base::client);
      },
      "ours/chain.pem", false);
  EXPECT_THAT(failed, HasSubstr("alert protocol version"));
  ASSERT_TRUE(run_until([&] { return counters_.handshakes_failed_tls.value() == 1; }));
}

TEST_F(TlsTest, a_handshake_may_come_byte_by_byte_but_must_end) {
  // A client's first flight, as OpenSSL makes it, without a socket.
  ssl::context tls(ssl::context::tls_client);
  SSL* const client = SSL_new(tls.native_handle());
  BIO* const from_server = BIO_new(BIO_s_mem());
  BIO* const to_server = BIO_new(BIO_s_mem());
  SSL_set_bio(client, from_server, to_server);
  SSL_set_connect_state(client);
  SSL_do_handshake(client);
  std::vector<std::uint8_t> hello(static_cast<std::size_t>(BIO_ctrl_pending(to_server)));
  ASSERT_GT(BIO_read(to_server, hello.data(), static_cast<int>(hello.size())), 100);
  SSL_free(client);

  Peer peer(listener_->port());
  std::size_t at = 0;
  ASSERT_TRUE(run_until([&] {
    if (at < hello.size()) at += peer.send(std::span(hello).subspan(at, 1));
    peer.receive();
    return !peer.received.empty();
  }));
  EXPECT_EQ(peer.received[0], 0x16) << "the server's own handshake";
  ASSERT_TRUE(run_until([&] {
    peer.receive();
    return peer.ended;
  })) << "nothing more came";
  EXPECT_EQ(counters_.handshakes_failed_timeout.value(), 1u);
}

TEST_F(TlsTest, garbage_that_begins_as_tls_is_ended) {
  Peer peer(listener_->port());
  answer_to(peer, "\x16\x03\x01" + std::string(2000, 'x'));
  EXPECT_EQ(counters_.handshakes_failed_tls.value(), 1u);
  EXPECT_TRUE(all_closed());
}

TEST_F(TlsTest, tls_inside_tls_is_an_impossible_size_prefix) {
  // The server looks for TLS only at the beginning of a connection. Inside, the same four bytes are the size of a
  // packet of 34 MB, which is far above kPacketBytesMax.
  EXPECT_EQ(with_client([](TlsSocket& socket) {
              asio::write(socket, asio::buffer(std::string("\x16\x03\x01\x02\x00\x01\x00\x01", 8)));
            }),
            "");
  ASSERT_TRUE(run_until([&] { return echoes_.size() == 1 && echoes_[0]->broken; }));
}

TEST_F(TlsTest, the_listener_goes_with_handshakes_under_way) {
  Peer half(listener_->port());
  half.send(std::string_view("\x16\x03\x01\x02", 4));
  ASSERT_TRUE(run_until([&] { return counters_.connections_accepted.value() == 1; }));
  run_rounds(20);
  listener_->close();
  EXPECT_TRUE(all_closed());
}

class TlsRequiredTest : public TlsTest {
 protected:
  TransportOptions options() override {
    TransportOptions made = TlsTest::options();
    made.tls_required = true;
    return made;
  }
};

TEST_F(TlsRequiredTest, what_is_plain_is_turned_away) {
  Peer page(listener_->port()), packets(listener_->port());
  EXPECT_THAT(answer_to(page, "GET / HTTP/1.1\r\nHost: x\r\n\r\n"), HasSubstr("this port takes TLS only"));
  const auto sent = packet(64, 1);
  EXPECT_EQ(answer_to(packets, {reinterpret_cast<const char*>(sent.data()), sent.size()}), "");
  EXPECT_EQ(counters_.handshakes_failed_tls_required.value(), 2u);
  EXPECT_TRUE(echoes_.empty());
  EXPECT_EQ(with_client([](TlsSocket& socket) {
              asio::write(socket, asio::buffer(packet(32, 1)));
              std::vector<std::uint8_t> got(32);
              asio::read(socket, asio::buffer(got));
            }),
            "");
}

TEST_F(TransportTest, tls_without_a_certificate_is_answered_with_an_alert) {
  Peer peer(listener_->port());
  const std::string alert = answer_to(peer, std::string_view("\x16\x03\x01\x02\x00\x01", 6));
  // The bytes are a TLS alert: fatal (2), handshake_failure (40).
  EXPECT_EQ(alert, std::string("\x15\x03\x01\x00\x02\x02\x28", 7));
  EXPECT_EQ(counters_.handshakes_failed_tls_absent.value(), 1u);
}

TEST_F(TransportTest, wrong_certificates_stop_the_start_with_one_line) {
  ASSERT_TRUE(certificates().valid);
  std::ofstream(certificates().path("garbage.pem")) << "no certificate\n";
  std::ofstream(certificates().path("empty.pem"));
  const TlsFiles ours = our_files();
  struct Case {
    TlsFiles files;
    const char* says;
  };
  const Case cases[] = {
      {{certificates().path("none.pem"), ours.key}, "none.pem: No such file"},
      {{ours.certificate, certificates().path("none.pem")}, "cannot read the key"},
      {{certificates().path("empty.pem"), ours.key}, "it is empty"},
      {{certificates().path("garbage.pem"), ours.key}, "is not a PEM certificate chain"},
      {{ours.certificate, certificates().path("garbage.pem")}, "is not a PEM key"},
      {{ours.certificate, ours.certificate}, "is not a PEM key"},
      {{ours.certificate, certificates().path("other/key.pem")}, "does not fit"},
      {{certificates().folder.string(), ours.key}, "cannot read the certificate"},
      {{ours.certificate, ""}, "needs both"},
  };
  for (const Case& one : cases) {
    TransportOptions wrong = options();
    wrong.tls = one.files;
    const auto created = Listener::create(loop_, wrong, counters_, {});
    ASSERT_FALSE(created) << one.says;
    EXPECT_THAT(created.error(), HasSubstr(one.says));
    EXPECT_EQ(created.error().find('\n'), std::string::npos);
  }
}

}  // namespace
}  // namespace hairnet::server
