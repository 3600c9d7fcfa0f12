#include "server/transport/sidecar_client.hpp"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <memory>
#include <string>
#include <utility>
#include <vector>

#include "tests/unit/server/answering_port.hpp"

namespace hairnet::server {
namespace {

using testing::ElementsAre;
using testing::EndsWith;
using testing::HasSubstr;
using testing::StartsWith;

// Notes what the client tells its sink, a line each. Errors are numbers of SidecarError: 0 is unreachable, 2 broken, 4
// malformed, 5 oversize.
class HeardOfSidecar final : public agones::SidecarSink {
 public:
  void on_answer(std::uint64_t call, int status, std::string_view body, std::int64_t) override {
    all.push_back(std::to_string(call) + " answer " + std::to_string(status) + " " + std::string(body));
  }
  void on_error(std::uint64_t call, agones::SidecarError error, std::int64_t) override {
    all.push_back(std::to_string(call) + " error " + std::to_string(static_cast<int>(error)));
  }
  std::vector<std::string> all;
};

class SidecarClientTest : public AnsweringPort {
 protected:
  void SetUp() override {
    AnsweringPort::SetUp();
    client_ = std::make_unique<SidecarClient>(loop_, port_);
    client_->set_sink(&heard_);
  }
  void TearDown() override {
    client_.reset();
    AnsweringPort::TearDown();
  }
  // Each call has a connection of its own.
  std::string request(const std::string& end = "\r\n\r\n{}") {
    hang_up();
    return AnsweringPort::request(end);
  }
  std::vector<std::string> heard(std::size_t count = 1) {
    wait([&] { return heard_.all.size() >= count; });
    return std::exchange(heard_.all, {});
  }

  HeardOfSidecar heard_;
  std::unique_ptr<SidecarClient> client_;
};

TEST_F(SidecarClientTest, sends_each_method_with_its_path_and_body) {
  client_->send(1, agones::ready());
  EXPECT_THAT(request(), AllOf(StartsWith("POST /ready HTTP/1.1\r\n"), HasSubstr("Host: localhost:"),
                               HasSubstr("Content-Type: application/json"), EndsWith("{}")));
  answer(kOk);
  EXPECT_THAT(heard(), ElementsAre("1 answer 200 {}"));
  // The server has 3 rooms and takes 16 at most. Agones has 64-bit numbers as text in JSON.
  client_->send(2, agones::set_rooms(3, 16));
  EXPECT_THAT(request("}"),
              AllOf(StartsWith("PATCH /v1beta1/counters/rooms HTTP/1.1\r\n"), HasSubstr("\"count\":\"3\"")));
  answer("HTTP/1.1 404 Not Found\r\nContent-Length: 2\r\n\r\nno");
  EXPECT_THAT(heard(), ElementsAre("2 answer 404 no"));
  client_->send(3, agones::game_server());
  EXPECT_THAT(request("\r\n\r\n"), StartsWith("GET /gameserver HTTP/1.1\r\n"));
  answer("HTTP/1.1 200 OK\r\nTransfer-Encoding: chunked\r\n\r\n2\r\n{}\r\n0\r\n\r\n");
  EXPECT_THAT(heard(), ElementsAre("3 answer 200 {}"));
}

TEST_F(SidecarClientTest, tells_garbage_too_much_and_nothing_from_each_other) {
  client_->send(1, agones::ready());
  request();
  answer("what?\r\n\r\n");
  EXPECT_THAT(heard(), ElementsAre("1 error 4"));
  client_->send(2, agones::ready());
  request();
  answer("HTTP/1.1 200 OK\r\nContent-Length: " + std::to_string(agones::kAnswerBytesMax + 1) + "\r\n\r\n");
  EXPECT_THAT(heard(), ElementsAre("2 error 5"));
  client_->send(3, agones::ready());
  request();
  // Two bytes are announced, and the connection ends after one.
  answer("HTTP/1.1 200 OK\r\nContent-Length: 2\r\n\r\n{");
  hang_up();
  EXPECT_THAT(heard(), ElementsAre("3 error 2"));
}

// The first call is cancelled at once, and the second when its request has arrived. The sink hears of neither, so it
// cannot take an old answer for that to a newer call.
TEST_F(SidecarClientTest, says_nothing_of_a_cancelled_call) {
  client_->send(1, agones::ready());
  client_->cancel(1);
  client_->send(2, agones::ready());
  request();
  client_->cancel(2);
  answer(kOk);
  client_->send(3, agones::ready());
  request();
  answer(kOk);
  EXPECT_THAT(heard(), ElementsAre("3 answer 200 {}"));
}

TEST_F(SidecarClientTest, tells_that_nobody_listens_and_may_end_with_a_call_under_way) {
  ::close(listener_);
  listener_ = -1;
  client_->send(1, agones::ready());
  EXPECT_THAT(heard(), ElementsAre("1 error 0"));
  client_->send(2, agones::ready());
  client_.reset();
  for (int i = 0; i < 10; ++i) loop_.poll();
  EXPECT_THAT(heard_.all, testing::IsEmpty());
}

}  // namespace
}  // namespace hairnet::server
