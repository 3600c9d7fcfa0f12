#include "server/transport/etcd_client.hpp"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <memory>
#include <string>
#include <utility>
#include <vector>

#include "server/fleet/etcd_api.hpp"
#include "tests/unit/server/answering_port.hpp"

namespace hairnet::server {
namespace {

using testing::ElementsAre;
using testing::HasSubstr;

TEST(EtcdEndpoint, is_a_url_with_a_host_and_a_port) {
  const auto plain = parse_etcd_endpoint("http://etcd1.example"), tls = parse_etcd_endpoint("https://[::1]:2380/");
  EXPECT_EQ(plain->host, "etcd1.example");
  EXPECT_EQ(plain->port, 2379);
  EXPECT_FALSE(plain->is_tls);
  EXPECT_EQ(tls->host, "::1");
  EXPECT_EQ(tls->port, 2380);
  EXPECT_TRUE(tls->is_tls);
  for (const char* wrong : {"", "etcd1:2379", "ftp://a", "http://", "http://a:0", "http://a:65536", "http://a:b",
                            "http://a:", "http://a:1:2", "http://a/path", "http://[::1", "http://[::1]x", "http://a b"})
    EXPECT_FALSE(parse_etcd_endpoint(wrong)) << wrong;
}

TEST(EtcdOptions, must_agree_with_each_other) {
  EtcdOptions options;
  EXPECT_EQ(validate(options), "");
  options.certificate = "a.pem";
  EXPECT_THAT(validate(options), HasSubstr("needs its key"));
  options = {};
  options.user = "a";
  EXPECT_THAT(validate(options), HasSubstr("password file"));
  options = {};
  options.endpoints.assign(9, "http://a");
  EXPECT_THAT(validate(options), HasSubstr("at most 8"));
}

// Notes what a client tells its sink, a line each. Errors are numbers of EtcdError: 0 is unreachable, 2 broken, 4
// malformed, 5 oversize.
class Heard final : public EtcdSink {
 public:
  void on_answer(std::uint64_t call, int status, std::string_view body, std::int64_t) override {
    all.push_back(std::to_string(call) + " answer " + std::to_string(status) + " " + std::string(body));
  }
  void on_line(std::uint64_t call, std::string_view line, std::int64_t) override {
    all.push_back(std::to_string(call) + " line " + std::string(line));
  }
  void on_error(std::uint64_t call, EtcdError error, std::int64_t) override {
    all.push_back(std::to_string(call) + " error " + std::to_string(static_cast<int>(error)));
  }
  std::vector<std::string> all;
};

class Client : public AnsweringPort {
 protected:
  void SetUp() override {
    AnsweringPort::SetUp();
    EtcdOptions options;
    options.endpoints = {"http://127.0.0.1:" + std::to_string(port_)};
    client_ = *EtcdClient::create(loop_, options);
    client_->set_sink(&heard_);
  }
  void TearDown() override {
    client_.reset();
    AnsweringPort::TearDown();
  }
  void send(std::uint64_t id, bool is_stream = false) {
    client_->send({.id = id, .endpoint = 0, .path = "/v3/x", .body = "{}", .is_stream = is_stream});
  }
  std::vector<std::string> heard(std::size_t count = 1) {
    wait([&] { return heard_.all.size() >= count; });
    return std::exchange(heard_.all, {});
  }

  Heard heard_;
  std::unique_ptr<EtcdClient> client_;
};

TEST_F(Client, posts_calls_and_keeps_the_connection) {
  send(1);
  EXPECT_THAT(request(), testing::StartsWith("POST /v3/x HTTP/1.1\r\n"));
  answer(kOk);
  EXPECT_THAT(heard(), ElementsAre("1 answer 200 {}"));
  send(2);
  EXPECT_NE(request(), "") << "on the same connection";
  answer("HTTP/1.1 503 No\r\nContent-Length: 2\r\n\r\nno");
  EXPECT_THAT(heard(), ElementsAre("2 answer 503 no"));
}

// etcd may close an idle connection just when a request is sent on it. The request is not lost: it goes out on a new
// connection.
TEST_F(Client, tries_again_when_a_kept_connection_has_ended) {
  send(1);
  request();
  answer(kOk);
  heard();
  hang_up();
  send(2);
  EXPECT_NE(request(), "");
  answer(kOk);
  EXPECT_THAT(heard(), ElementsAre("2 answer 200 {}"));
}

TEST_F(Client, gives_the_lines_of_a_stream_and_its_end) {
  send(1, true);
  request();
  // The first line of the stream is cut into two chunks, and the second chunk contains another line.
  answer("HTTP/1.1 200 OK\r\nTransfer-Encoding: chunked\r\n\r\n6\r\n{\"a\":1\r\n");
  answer("5\r\n}\n{}\n\r\n");
  EXPECT_THAT(heard(2), ElementsAre("1 line {\"a\":1}", "1 line {}"));
  hang_up();
  EXPECT_THAT(heard(), ElementsAre("1 error 2"));
}

TEST_F(Client, says_nothing_of_a_cancelled_call) {
  send(1);
  request();
  client_->cancel(1);
  answer(kOk);
  hang_up();
  send(2);
  request();
  answer(kOk);
  EXPECT_THAT(heard(), ElementsAre("2 answer 200 {}"));
}

TEST_F(Client, refuses_answers_that_are_too_long_or_not_http) {
  send(1);
  request();
  // The announced length is enough to refuse the answer: no byte of it has come.
  answer("HTTP/1.1 200 OK\r\nContent-Length: " + std::to_string(etcd::kAnswerBytesMax + 1) + "\r\n\r\n");
  EXPECT_THAT(heard(), ElementsAre("1 error 5"));
  hang_up();
  send(2);
  request();
  answer("what?\r\n\r\n");
  EXPECT_THAT(heard(), ElementsAre("2 error 4"));
  hang_up();
  send(3);
  request();
  hang_up();
  EXPECT_THAT(heard(), ElementsAre("3 error 2"));
}

TEST_F(Client, tells_that_nobody_listens) {
  ::close(listener_);
  listener_ = -1;
  send(1);
  EXPECT_THAT(heard(), ElementsAre("1 error 0"));
}

TEST(EtcdClientFiles, that_cannot_be_read_are_refused_in_one_line) {
  IoLoop loop;
  EtcdOptions options;
  options.endpoints = {"https://127.0.0.1:1"};
  options.ca = "/nowhere/ca.pem";
  EXPECT_THAT(EtcdClient::create(loop, options).error(), HasSubstr("/nowhere/ca.pem"));
  options.ca = "";
  options.certificate = options.key = "/nowhere/chain.pem";
  EXPECT_THAT(EtcdClient::create(loop, options).error(), HasSubstr("/nowhere/chain.pem"));
  options.certificate = options.key = "";
  options.user = "root";
  options.password_file = "/nowhere/password";
  EXPECT_THAT(EtcdClient::create(loop, options).error(), HasSubstr("/nowhere/password"));
}

}  // namespace
}  // namespace hairnet::server
