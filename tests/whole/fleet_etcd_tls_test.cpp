#include <gmock/gmock.h>
#include <gtest/gtest.h>
#include <unistd.h>

#include <chrono>
#include <fstream>
#include <functional>
#include <nlohmann/json.hpp>
#include <regex>
#include <thread>

#include "server/transport/etcd_client.hpp"
#include "tests/whole/loopback.hpp"
#include "tests/whole/process.hpp"
#include "tests/whole/whole_test.hpp"

namespace hairnet::whole {
namespace {

using testing::ContainsRegex;
using testing::HasSubstr;
using testing::Not;

constexpr const char* kEtcd = "/usr/bin/etcd";
constexpr const char* kPassword = "correct-horse-battery";
constexpr const char* kWrongPassword = "wrong-horse-battery";

// The events that these tests wait for come within seconds; a minute leaves time on a busy machine.
bool wait(const std::function<bool()>& done, double seconds_max = 60) {
  const auto deadline = std::chrono::steady_clock::now() + std::chrono::duration<double>(seconds_max);
  while (!done()) {
    if (std::chrono::steady_clock::now() > deadline) return false;
    std::this_thread::sleep_for(std::chrono::milliseconds(20));
  }
  return true;
}

// Calls to etcd, one after the other, by the certificate of its clients.
class Caller final : public server::EtcdSink {
 public:
  explicit Caller(const server::EtcdOptions& options) : client_(*server::EtcdClient::create(loop_, options)) {
    client_->set_sink(this);
  }
  ~Caller() { client_->set_sink(nullptr); }
  // The status of the answer; 0: none.
  int call(const std::string& path, const nlohmann::json& body) {
    status_ = -1;
    client_->send({.id = ++last_, .endpoint = 0, .path = path, .body = body.dump()});
    wait([this] {
      loop_.poll();
      return status_ >= 0;
    });
    return status_;
  }
  void on_answer(std::uint64_t, int status, std::string_view, std::int64_t) override { status_ = status; }
  void on_line(std::uint64_t, std::string_view, std::int64_t) override {}
  void on_error(std::uint64_t, server::EtcdError, std::int64_t) override { status_ = 0; }

 private:
  server::IoLoop loop_;
  std::unique_ptr<server::EtcdClient> client_;
  std::uint64_t last_ = 0;
  int status_ = -1;
};

// An etcd that asks for a certificate, and for a user and a password. The certificates are those that
// deploy/kubernetes/certificates makes.
class SecureEtcd : public WholeTest {
 protected:
  void SetUp() override {
    WholeTest::SetUp();
    if (::access(kEtcd, X_OK) != 0) GTEST_SKIP() << "NOT TESTED: there is no " << kEtcd << "; deploy/setup installs it";
    Process certificates({HAIRNET_SOURCE_DIR "/deploy/kubernetes/certificates", path("tls")}, path("certificates"));
    ASSERT_EQ(certificates.wait(), 0) << certificates.err();
    port_ = free_port();
    peer_port_ = free_port();
    start_etcd();
    Caller caller(options());
    ASSERT_TRUE(wait([&] { return caller.call("/v3/maintenance/status", nlohmann::json::object()) == 200; }, 120))
        << etcd_->err();
    const auto make = [&](const std::string& what, const nlohmann::json& body) {
      EXPECT_EQ(caller.call("/v3/auth/" + what, body), 200) << what;
    };
    make("user/add", {{"name", "root"}, {"password", "another-secret"}});
    make("role/add", {{"name", "root"}});
    make("user/grant", {{"user", "root"}, {"role", "root"}});
    make("role/add", {{"name", "fleet"}});
    // etcd takes keys in base64. The range is all keys from "/hairnet/" up to "/hairnet0", which is the first key after
    // those that begin with "/hairnet/".
    const nlohmann::json keys = {{"permType", "READWRITE"}, {"key", "L2hhaXJuZXQv"}, {"range_end", "L2hhaXJuZXQw"}};
    make("role/grant", {{"name", "fleet"}, {"perm", keys}});
    make("user/add", {{"name", "hairnet"}, {"password", kPassword}});
    make("user/grant", {{"user", "hairnet"}, {"role", "fleet"}});
    make("enable", nlohmann::json::object());
  }
  void start_etcd() {
    const std::string peer = "http://127.0.0.1:" + std::to_string(peer_port_), member = path("tls") + "/etcd";
    etcd_ = std::make_unique<Process>(std::vector<std::string>{kEtcd,
                                                               "--data-dir",
                                                               path("etcd_data"),
                                                               "--listen-client-urls",
                                                               url(),
                                                               "--advertise-client-urls",
                                                               url(),
                                                               "--listen-peer-urls",
                                                               peer,
                                                               "--initial-advertise-peer-urls",
                                                               peer,
                                                               "--initial-cluster",
                                                               "default=" + peer,
                                                               "--cert-file",
                                                               member + "/tls.crt",
                                                               "--key-file",
                                                               member + "/tls.key",
                                                               "--client-cert-auth",
                                                               "--trusted-ca-file",
                                                               member + "/ca.crt"},
                                      path("etcd"));
  }
  [[nodiscard]] std::string url() const { return "https://127.0.0.1:" + std::to_string(port_); }
  [[nodiscard]] server::EtcdOptions options() const {
    const std::string own = path("tls") + "/client";
    return {.endpoints = {url()},
            .ca = own + "/ca.crt",
            .certificate = own + "/tls.crt",
            .key = own + "/tls.key",
            .user = "",
            .password_file = ""};
  }
  // A server of the fleet that logs all it can.
  std::unique_ptr<Process> start_member(const std::string& name, const std::string& password,
                                        const Arguments& more = {}) {
    std::ofstream(path(name + ".password")) << password << '\n';
    Arguments arguments{"--port",
                        "0",
                        "--etcd",
                        url(),
                        "--etcd-ca",
                        options().ca,
                        "--etcd-user",
                        "hairnet",
                        "--etcd-password-file",
                        path(name + ".password"),
                        "--fleet-address",
                        "127.0.0.1",
                        "--fleet-lease",
                        "5",
                        "--workers",
                        "1",
                        "--log-level",
                        "trace",
                        "--counters-interval-s",
                        "0.2"};
    arguments.insert(arguments.end(), more.begin(), more.end());
    return start("hairnet-server", arguments, name);
  }
  [[nodiscard]] Arguments with_certificate() const {
    return {"--etcd-certificate", options().certificate, "--etcd-key", options().key};
  }
  // Ends the server. Its log and its output have no password, no token as etcd makes them, and no key.
  void expect_no_secret(Process& server) {
    EXPECT_TRUE(wait_for_event(server, "counters")) << "it logs as much as it can";
    drain(server);
    const std::string all = server.out() + server.err();
    EXPECT_THAT(all, Not(HasSubstr(kPassword)));
    EXPECT_THAT(all, Not(HasSubstr(kWrongPassword)));
    EXPECT_THAT(all, Not(HasSubstr("PRIVATE KEY")));
    EXPECT_THAT(all, Not(ContainsRegex("[A-Za-z]{16}\\.[0-9]+")));
  }
  static bool wait_for_event(const Process& server, const std::string& event) {
    return wait([&] { return server.err().find("event=" + event) != std::string::npos; });
  }

  std::uint16_t port_ = 0, peer_port_ = 0;
  std::unique_ptr<Process> etcd_;
};

TEST_F(SecureEtcd, takes_a_server_with_certificate_and_password_which_logs_no_secret) {
  const auto server = start_member("server", kPassword, with_certificate());
  ASSERT_TRUE(wait_for_event(*server, "lease_granted")) << server->err();
  // etcd forgets its tokens with its process: the server asks for a new one.
  etcd_.reset();
  ASSERT_TRUE(wait_for_event(*server, "lease_paused")) << server->err();
  start_etcd();
  ASSERT_TRUE(wait_for_event(*server, "lease_resumed")) << server->err();
  EXPECT_THAT(server->err(), Not(HasSubstr("event=etcd_user_refused")));
  expect_no_secret(*server);
}

TEST_F(SecureEtcd, refuses_a_wrong_password_which_is_not_logged_either) {
  const auto server = start_member("server", kWrongPassword, with_certificate());
  ASSERT_TRUE(wait_for_event(*server, "etcd_user_refused user=\"hairnet\" status=400")) << server->err();
  ASSERT_TRUE(wait_for_event(*server, "etcd_unreachable")) << server->err();
  EXPECT_THAT(server->err(), Not(HasSubstr("event=lease_granted")));
  expect_no_secret(*server);
}

TEST_F(SecureEtcd, is_out_of_reach_without_a_certificate) {
  const auto server = start_member("server", kPassword);
  ASSERT_TRUE(wait_for_event(*server, "etcd_unreachable")) << server->err();
  EXPECT_THAT(server->err(), Not(HasSubstr("event=lease_granted")));
  expect_no_secret(*server);
}

}  // namespace
}  // namespace hairnet::whole
