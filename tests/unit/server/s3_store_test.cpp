#include "server/objects/s3_store.hpp"

#include <gmock/gmock.h>
#include <gtest/gtest.h>
#include <unistd.h>

#include <chrono>
#include <cstdlib>
#include <ctime>
#include <filesystem>
#include <fstream>
#include <memory>
#include <optional>
#include <thread>

#include "server/app/shared_objects.hpp"
#include "server/transport/blocking_http_client.hpp"
#include "tests/support/s3_server.hpp"

namespace hairnet::server {
namespace {

using support::S3Behaviour;
using support::S3Server;
using testing::HasSubstr;
using Existing = ObjectStore::Existing;
using Outcome = ObjectAnswer::Outcome;

constexpr std::int64_t kSecond_ns = 1'000'000'000;
// Each object of these tests is smaller.
constexpr std::size_t kPlenty = 1 << 20;

std::vector<std::uint8_t> some_bytes(std::size_t count = 100'000) {
  std::vector<std::uint8_t> bytes(count);
  for (std::size_t i = 0; i < count; ++i) bytes[i] = static_cast<std::uint8_t>(i * 7 + i / 251);
  return bytes;
}

// A store with a server of the test. A call fails after 0.3 s without an answer, and then the store rests for 5 s of
// now_ns_, which a test moves.
class S3StoreTest : public testing::Test {
 protected:
  S3StoreTest() { connect({"test-access", "test-secret"}); }
  void connect(const S3Keys& keys, const std::string& region = "us-east-1", std::int64_t clock_error_s = 0) {
    store_.reset();
    client_ = *BlockingHttpClient::create(
        {.host = "127.0.0.1", .port = server_.port(), .exchange_timeout = std::chrono::milliseconds(300)});
    store_.emplace(S3StoreDef{.url = server_.url("/hair"),
                              .host = server_.host(),
                              .path = "/bucket/hair/",
                              .region = region,
                              .keys = keys,
                              .unix_time_s = [clock_error_s] { return std::time(nullptr) + clock_error_s; },
                              .now_ns = [this] { return now_ns_; },
                              .pause_ns = 5 * kSecond_ns},
                   *client_, counters_);
  }
  // Returns the answer to a get while the server behaves in this way. Later, after the store's pause of 5 s and with a
  // server that behaves well, a get must succeed.
  ObjectAnswer get_while(S3Behaviour behaviour) {
    server_.behaviour = behaviour;
    ObjectAnswer answer = store_->get("a.hngroom", kPlenty);
    server_.behaviour = S3Behaviour::right;
    now_ns_ += 6 * kSecond_ns;
    EXPECT_EQ(store_->get("a.hngroom", kPlenty).outcome, Outcome::read);
    return answer;
  }

  S3Server server_;
  ObjectCounters counters_;
  std::int64_t now_ns_ = 0;
  std::unique_ptr<BlockingHttpClient> client_;
  std::optional<S3Store> store_;
};

TEST_F(S3StoreTest, gives_back_what_was_put_over_one_connection) {
  const std::vector<std::uint8_t> bytes = some_bytes();
  EXPECT_EQ(store_->get("a.hngroom", kPlenty).outcome, Outcome::absent);
  EXPECT_EQ(store_->put("a.hngroom", bytes, Existing::keep).outcome, Outcome::stored);
  EXPECT_EQ(server_.objects().at("hair/a.hngroom"), bytes);
  const ObjectAnswer found = store_->get("a.hngroom", kPlenty);
  EXPECT_EQ(found.outcome, Outcome::read);
  EXPECT_EQ(found.bytes, bytes);
  EXPECT_EQ(server_.wrong_signatures, 0u);
  EXPECT_EQ(server_.connections, 1u);
  EXPECT_EQ(counters_.gauges.object_store_up.value(), 1);
}

TEST_F(S3StoreTest, keeps_an_object_that_is_there_unless_it_is_to_be_replaced) {
  server_.set_object("hair/a", {1, 2, 3});
  EXPECT_EQ(store_->put("a", some_bytes(10), Existing::keep).outcome, Outcome::kept);
  EXPECT_EQ(server_.puts, 0u);
  EXPECT_EQ(server_.objects().at("hair/a").size(), 3u);
  EXPECT_EQ(store_->put("a", some_bytes(10), Existing::replace).outcome, Outcome::stored);
  EXPECT_EQ(server_.objects().at("hair/a").size(), 10u);
  EXPECT_EQ(store_->put("empty", {}, Existing::keep).outcome, Outcome::stored);
  EXPECT_EQ(store_->get("empty", kPlenty).outcome, Outcome::read);
}

TEST_F(S3StoreTest, goes_on_over_a_new_connection_when_the_kept_one_has_ended) {
  // The server ends each connection after one response, as real ones do after a while.
  server_.behaviour = S3Behaviour::closes_idle;
  for (int i = 0; i < 3; ++i) EXPECT_EQ(store_->get("a", kPlenty).outcome, Outcome::absent);
  EXPECT_EQ(server_.connections, 3u);
  EXPECT_EQ(counters_.requests_failed_broken.value(), 0u);
}

TEST_F(S3StoreTest, refuses_answers_that_are_not_the_object_and_counts_each_reason) {
  server_.set_object("hair/a.hngroom", {1, 2, 3});
  EXPECT_EQ(get_while(S3Behaviour::denied).outcome, Outcome::refused);
  EXPECT_EQ(counters_.requests_failed_denied.value(), 1u);
  EXPECT_EQ(get_while(S3Behaviour::redirect).outcome, Outcome::refused);
  EXPECT_EQ(counters_.requests_failed_redirected.value(), 1u);
  const ObjectAnswer no_bucket = get_while(S3Behaviour::no_bucket);
  EXPECT_EQ(no_bucket.outcome, Outcome::refused);
  EXPECT_THAT(no_bucket.reason, HasSubstr("404 NoSuchBucket"));
  EXPECT_EQ(counters_.requests_failed_refused.value(), 1u);
  EXPECT_EQ(get_while(S3Behaviour::error).outcome, Outcome::unreachable);
  EXPECT_EQ(counters_.requests_failed_error.value(), 1u);
  EXPECT_EQ(get_while(S3Behaviour::silent).outcome, Outcome::unreachable);
  EXPECT_EQ(counters_.requests_failed_timeout.value(), 1u);
  EXPECT_EQ(get_while(S3Behaviour::truncated).outcome, Outcome::unreachable);
  EXPECT_EQ(counters_.requests_failed_broken.value(), 1u);
  EXPECT_EQ(get_while(S3Behaviour::no_http).outcome, Outcome::unreachable);
  EXPECT_EQ(get_while(S3Behaviour::endless_error).outcome, Outcome::unreachable);
  EXPECT_EQ(counters_.requests_failed_malformed.value(), 2u);
  EXPECT_EQ(get_while(S3Behaviour::too_large).outcome, Outcome::too_large);
  EXPECT_EQ(counters_.requests_skipped.value(), 0u);
}

TEST_F(S3StoreTest, reads_an_object_of_as_many_bytes_as_are_taken_and_no_larger_one) {
  server_.set_object("hair/a", some_bytes(1000));
  EXPECT_EQ(store_->get("a", 1000).bytes, some_bytes(1000));
  const ObjectAnswer larger = store_->get("a", 999);
  EXPECT_EQ(larger.outcome, Outcome::too_large);
  EXPECT_TRUE(larger.bytes.empty());
  EXPECT_EQ(store_->get("a", 1000).outcome, Outcome::read) << "the store itself is well";
}

TEST_F(S3StoreTest, is_denied_with_another_secret_key_region_or_time) {
  // The last server's clock is an hour behind the client's, and S3 allows a quarter of an hour.
  for (const auto& [keys, region, clock_error_s, code] : std::vector<std::tuple<S3Keys, std::string, int, std::string>>{
           {{"test-access", "other"}, "us-east-1", 0, "SignatureDoesNotMatch"},
           {{"other", "test-secret"}, "us-east-1", 0, "InvalidAccessKeyId"},
           {{"test-access", "test-secret"}, "eu-west-1", 0, "AuthorizationHeaderMalformed"},
           {{"test-access", "test-secret"}, "us-east-1", 3600, "RequestTimeTooSkewed"}}) {
    connect(keys, region, clock_error_s);
    for (const ObjectAnswer& answer : {store_->get("a", kPlenty), store_->put("a", some_bytes(), Existing::replace)}) {
      EXPECT_EQ(answer.outcome, Outcome::refused);
      EXPECT_THAT(answer.reason, HasSubstr(code));
      EXPECT_THAT(answer.reason, testing::Not(HasSubstr(keys.secret)));
    }
  }
  // Each of four cases has a get and a put.
  EXPECT_EQ(server_.wrong_signatures, 8u);
  EXPECT_TRUE(server_.objects().empty());
}

TEST_F(S3StoreTest, a_put_that_is_refused_before_its_end_is_denied_and_gets_go_on) {
  server_.behaviour = S3Behaviour::refuses_at_once;
  const ObjectAnswer answer = store_->put("a", some_bytes(64 << 10), Existing::replace);
  EXPECT_EQ(answer.outcome, Outcome::refused) << answer.reason;
  server_.behaviour = S3Behaviour::right;
  EXPECT_FALSE(store_->takes_puts());
  EXPECT_TRUE(store_->takes_gets()) << "a key that may only read";
  EXPECT_EQ(store_->get("a", kPlenty).outcome, Outcome::absent);
  EXPECT_EQ(store_->put("a", some_bytes(), Existing::replace).outcome, Outcome::unreachable);
  EXPECT_EQ(counters_.requests_skipped.value(), 1u);
}

TEST_F(S3StoreTest, a_failure_costs_one_time_out_and_then_the_store_is_left_alone_for_a_while) {
  server_.behaviour = S3Behaviour::silent;
  EXPECT_EQ(store_->get("a", kPlenty).outcome, Outcome::unreachable);
  EXPECT_FALSE(store_->takes_gets());
  EXPECT_FALSE(store_->takes_puts());
  EXPECT_EQ(counters_.gauges.object_store_up.value(), 0);
  for (int i = 0; i < 1000; ++i) EXPECT_EQ(store_->get("a", kPlenty).outcome, Outcome::unreachable);
  EXPECT_EQ(store_->put("a", {}, Existing::keep).outcome, Outcome::unreachable);
  EXPECT_EQ(server_.gets, 1u);
  EXPECT_EQ(counters_.requests.value(), 1u);
  EXPECT_EQ(counters_.requests_skipped.value(), 1001u);
  server_.behaviour = S3Behaviour::right;
  // The pause of 5 s is over.
  now_ns_ += 6 * kSecond_ns;
  EXPECT_TRUE(store_->takes_gets());
  EXPECT_EQ(store_->get("a", kPlenty).outcome, Outcome::absent);
  EXPECT_EQ(counters_.gauges.object_store_up.value(), 1);
}

TEST_F(S3StoreTest, nobody_at_the_port_is_unreachable) {
  std::uint16_t port = 0;
  {
    const S3Server gone;
    port = gone.port();
  }
  const auto client = *BlockingHttpClient::create({.host = "127.0.0.1", .port = port});
  const ExchangeAnswer answer = client->call({.target = "/"}, 10);
  EXPECT_EQ(answer.error, ExchangeError::unreachable);
  EXPECT_NE(answer.detail, "");
}

TEST_F(S3StoreTest, a_call_under_way_ends_when_it_is_cancelled_and_later_ones_at_once) {
  client_ = *BlockingHttpClient::create(
      {.host = "127.0.0.1", .port = server_.port(), .exchange_timeout = std::chrono::hours(1)});
  server_.behaviour = S3Behaviour::silent;
  std::thread canceller([this] {
    while (server_.gets == 0) std::this_thread::sleep_for(std::chrono::milliseconds(1));
    client_->cancel();
  });
  EXPECT_EQ(client_->call({.target = "/bucket/a"}, 10).error, ExchangeError::cancelled);
  canceller.join();
  EXPECT_EQ(client_->call({.target = "/bucket/a"}, 10).error, ExchangeError::cancelled);
  EXPECT_EQ(server_.gets, 1u);
}

class S3TlsTest : public testing::Test {
 protected:
  void SetUp() override {
    folder_ = testing::TempDir() + "s3_tls_" + std::to_string(::getpid());
    const std::string command =
        std::string(HAIRNET_DEPLOY_DIR) + "/certificate --out " + folder_ + " 127.0.0.1 > /dev/null";
    ASSERT_EQ(std::system(command.c_str()), 0);
    server_ = std::make_unique<S3Server>(
        support::S3ServerDef{.certificate = folder_ + "/chain.pem", .key = folder_ + "/key.pem"});
    std::ofstream(folder_ + "/keys") << "test-access\ntest-secret\n";
  }
  void TearDown() override { std::filesystem::remove_all(folder_); }
  ObjectAnswer get(const std::string& ca) {
    auto shared = SharedObjects::create({.url = server_->url(), .key_file = folder_ + "/keys", .ca = ca}, counters_,
                                        [] { return std::int64_t{0}; });
    EXPECT_TRUE(shared) << shared.error();
    return (*shared)->store().get("a", kPlenty);
  }

  std::string folder_;
  std::unique_ptr<S3Server> server_;
  ObjectCounters counters_;
};

TEST_F(S3TlsTest, takes_an_object_inside_tls_from_a_store_whose_authority_it_knows_and_from_no_other) {
  server_->set_object("a", {1, 2, 3});
  EXPECT_EQ(get(folder_ + "/chain.pem").bytes, (std::vector<std::uint8_t>{1, 2, 3}));
  const ObjectAnswer stranger = get("");
  EXPECT_EQ(stranger.outcome, Outcome::unreachable);
  EXPECT_THAT(stranger.reason, HasSubstr("certificate"));
  EXPECT_EQ(server_->gets, 1u);
}

TEST(SharedObjects, files_and_keys_that_cannot_be_read_are_refused_in_one_line) {
  ObjectCounters counters;
  const auto now_ns = [] { return std::int64_t{0}; };
  EXPECT_EQ(*SharedObjects::create({}, counters, now_ns), nullptr);
  EXPECT_THAT(SharedObjects::create({.url = "http://h/b", .key_file = "/nowhere/keys"}, counters, now_ns).error(),
              HasSubstr("/nowhere/keys"));
  const std::string file = testing::TempDir() + "s3_keys_" + std::to_string(::getpid());
  const auto none = [](const char*) -> const char* { return nullptr; };
  for (const char* wrong : {"", "one\n", "one\n\n", "one \ntwo\n", "one\ntwo\tthree\n"}) {
    std::ofstream(file) << wrong;
    const Result<S3Keys> keys = read_s3_keys(file, none);
    EXPECT_FALSE(keys) << wrong;
    EXPECT_THAT(keys.error(), HasSubstr("two lines"));
    EXPECT_EQ(keys.error().find("two\t"), std::string::npos) << "no secret in an error";
  }
  std::ofstream(file) << "one\r\ntwo/+=\r\n";
  EXPECT_EQ(read_s3_keys(file, none)->access, "one");
  EXPECT_EQ(read_s3_keys(file, none)->secret, "two/+=");
  std::ofstream(file) << "one\ntwo\n";
  EXPECT_THAT(SharedObjects::create({.url = "https://h/b", .key_file = file, .ca = "/nowhere/ca.pem"}, counters, now_ns)
                  .error(),
              HasSubstr("/nowhere/ca.pem"));
  std::filesystem::remove(file);
  EXPECT_THAT(read_s3_keys("", none).error(), HasSubstr("AWS_SECRET_ACCESS_KEY"));
  const auto both = [](const char* name) { return std::string(name) == "AWS_ACCESS_KEY_ID" ? "one" : "two"; };
  EXPECT_EQ(read_s3_keys("", both)->access, "one");
  EXPECT_EQ(read_s3_keys("", both)->secret, "two");
}

TEST(S3Endpoint, has_its_bucket_in_the_path_or_in_the_name) {
  const auto path = parse_s3_endpoint("https://minio.example.org:9000/bucket/some/prefix");
  EXPECT_EQ(path->host, "minio.example.org");
  EXPECT_EQ(path->port, 9000);
  EXPECT_TRUE(path->is_tls);
  EXPECT_EQ(path->host_field, "minio.example.org:9000");
  EXPECT_EQ(path->path, "/bucket/some/prefix/");
  const auto name = parse_s3_endpoint("https://bucket.s3.eu-central-1.amazonaws.com");
  EXPECT_EQ(name->port, 443);
  EXPECT_EQ(name->host_field, "bucket.s3.eu-central-1.amazonaws.com") << "without the scheme's own port";
  EXPECT_EQ(name->path, "/");
  const auto number = parse_s3_endpoint("http://[::1]:80/b/");
  EXPECT_EQ(number->host, "::1");
  EXPECT_EQ(number->host_field, "[::1]");
  EXPECT_EQ(number->path, "/b/");
  for (const char* wrong :
       {"", "minio:9000/b", "s3://bucket/prefix", "http://", "http:///b", "http://a:0/b", "http://a/b//c",
        "http://a/b/../c", "http://a/./b", "http://a/b?x=1", "http://a/b c", "http://a/b%20c", "http://a/b#c",
        "http://user:secret@a/b", "http://minio:9000", "http://minio/", "http://192.0.2.1:9000", "http://[::1]:9000/"})
    EXPECT_FALSE(parse_s3_endpoint(wrong)) << wrong;
  // A path has 512 bytes at most (kPathBytesMax in s3_endpoint.cpp).
  EXPECT_FALSE(parse_s3_endpoint("http://a/" + std::string(600, 'b')));
  EXPECT_THAT(parse_s3_endpoint("http://minio:9000").error(), HasSubstr("names no bucket"));
}

TEST(S3Options, must_agree_with_each_other) {
  EXPECT_EQ(validate(S3Options{}), "");
  EXPECT_EQ(validate(S3Options{.url = "http://a/b"}), "");
  EXPECT_THAT(validate(S3Options{.key_file = "keys"}), HasSubstr("need its URL"));
  EXPECT_THAT(validate(S3Options{.url = "nowhere"}), HasSubstr("nowhere"));
  EXPECT_THAT(validate(S3Options{.url = "http://a/b", .region = "a/b"}), HasSubstr("region"));
}

}  // namespace
}  // namespace hairnet::server
