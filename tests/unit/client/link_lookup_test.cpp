#include <dlfcn.h>
#include <gmock/gmock.h>
#include <gtest/gtest.h>
#include <netdb.h>

#include <boost/asio.hpp>
#include <chrono>
#include <condition_variable>
#include <mutex>
#include <string_view>

#include "client/link/server_stream.hpp"
#include "tests/support/case_name.hpp"

namespace {

constexpr const char* kSlowHost = "slow.invalid";

// The answer of the system for kSlowHost, which waits until the test lets it come.
struct SlowAnswer {
  std::mutex mutex;
  std::condition_variable changed;
  bool is_asked = false, may_answer = false, has_answered = false;

  void wait_for(bool& what) {
    std::unique_lock lock(mutex);
    changed.wait(lock, [&] { return what; });
  }
  void set(bool& what) {
    const std::lock_guard lock(mutex);
    what = true;
    changed.notify_all();
  }
};
SlowAnswer* slow_answer = nullptr;

}  // namespace

// Replaces getaddrinfo() of the system, so that looking up kSlowHost takes as long as a test wants. All other names are
// passed on.
extern "C" int getaddrinfo(const char* host, const char* service, const addrinfo* hints, addrinfo** found) {
  static const auto system = reinterpret_cast<decltype(&::getaddrinfo)>(dlsym(RTLD_NEXT, "getaddrinfo"));
  if (!host || std::string_view(host) != kSlowHost || !slow_answer) return system(host, service, hints, found);
  SlowAnswer& answer = *slow_answer;
  answer.set(answer.is_asked);
  answer.wait_for(answer.may_answer);
  const int error = system("127.0.0.1", service, hints, found);
  answer.set(answer.has_answered);
  return error;
}

namespace hairnet::link {
namespace {

// Every kind of stream looks up the name of its server first, by the system's blocking call on a thread.
using MakeStream = std::shared_ptr<ServerStream> (*)(asio::io_context& io, StreamOptions options);

template <Transport kTransport>
std::shared_ptr<ServerStream> make_of(asio::io_context& io, StreamOptions options) {
  options.server.transport = kTransport;
  return make_server_stream(io, std::move(options));
}

// A lookup may take many seconds, and the system cannot cancel it. A program that closes its link must not wait for
// the answer, and the late answer must not open a connection.
class LinkLookup : public ::testing::TestWithParam<support::Named<MakeStream>> {
 protected:
  LinkLookup() { slow_answer = &answer_; }
  ~LinkLookup() override { slow_answer = nullptr; }
  template <class Done>
  void run_until(Done done) {
    while (!done()) io_.run_one_for(std::chrono::milliseconds(10));
  }
  SlowAnswer answer_;
  asio::io_context io_;
  const asio::executor_work_guard<asio::io_context::executor_type> work_ = asio::make_work_guard(io_);
};

TEST_P(LinkLookup, that_is_cancelled_ends_at_once_and_its_answer_connects_nothing) {
  asio::ip::tcp::acceptor port(io_, {asio::ip::address_v4::loopback(), 0});
  port.non_blocking(true);
  StreamOptions options;
  options.server.host = kSlowHost;
  options.server.port = port.local_endpoint().port();
  std::shared_ptr<ServerStream> stream = GetParam().value(io_, options);
  std::optional<std::string> error;
  asio::co_spawn(
      io_, [&]() -> asio::awaitable<void> { error = co_await stream->open(); }, asio::detached);
  run_until([&] {
    const std::lock_guard lock(answer_.mutex);
    return answer_.is_asked;
  });
  EXPECT_FALSE(error);
  stream->close();
  run_until([&] { return error.has_value(); });
  EXPECT_FALSE(answer_.has_answered);
  EXPECT_THAT(*error, ::testing::HasSubstr("cannot find slow.invalid"));
  stream.reset();
  answer_.set(answer_.may_answer);
  answer_.wait_for(answer_.has_answered);
  // A connection to the port would be there after this time.
  io_.run_for(std::chrono::milliseconds(50));
  boost::system::error_code accepted;
  const asio::ip::tcp::socket connected = port.accept(accepted);
  EXPECT_EQ(accepted, asio::error::would_block);
}

TEST_P(LinkLookup, of_a_stream_that_is_closed_before_asks_nobody) {
  StreamOptions options;
  options.server.host = kSlowHost;
  const std::shared_ptr<ServerStream> stream = GetParam().value(io_, options);
  stream->close();
  std::optional<std::string> error;
  asio::co_spawn(
      io_, [&]() -> asio::awaitable<void> { error = co_await stream->open(); }, asio::detached);
  run_until([&] { return error.has_value(); });
  EXPECT_FALSE(answer_.is_asked);
}

INSTANTIATE_TEST_SUITE_P(Of, LinkLookup,
                         ::testing::Values(support::Named<MakeStream>{"tcp", &make_of<Transport::tcp>},
                                           support::Named<MakeStream>{"tls", &make_of<Transport::tls>},
                                           support::Named<MakeStream>{"ws", &make_of<Transport::ws>},
                                           support::Named<MakeStream>{"wss", &make_of<Transport::wss>},
                                           support::Named<MakeStream>{
                                               "webtransport",
                                               [](asio::io_context& io,
                                                  StreamOptions options) -> std::shared_ptr<ServerStream> {
                                                 return make_web_transport_stream(io, std::move(options));
                                               }}),
                         support::CaseName());

}  // namespace
}  // namespace hairnet::link
