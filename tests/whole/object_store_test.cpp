#include <gmock/gmock.h>
#include <gtest/gtest.h>
#include <signal.h>

#include <chrono>
#include <fstream>
#include <functional>
#include <regex>
#include <thread>

#include "tests/support/s3_server.hpp"
#include "tests/whole/process.hpp"
#include "tests/whole/whole_test.hpp"

namespace hairnet::whole {
namespace {

using support::S3Behaviour;
using support::S3Server;
using support::S3ServerDef;
using testing::HasSubstr;

// A counter as the server prints it at its end; 0 when it does not.
double counter(Process& server, const std::string& name) {
  const std::string out = server.out();
  std::smatch found;
  return std::regex_search(out, found, std::regex("\n" + name + " ([0-9.e+]+)")) ? std::stod(found[1]) : 0;
}

bool wait(const std::function<bool()>& done) {
  const auto deadline = std::chrono::steady_clock::now() + std::chrono::minutes(3);
  while (!done() && std::chrono::steady_clock::now() < deadline)
    std::this_thread::sleep_for(std::chrono::milliseconds(10));
  return done();
}

// Servers with folders of their own, and a store that they share. It is a small HTTP server of the tests, which checks
// signatures: MinIO is not in Debian.
class ObjectStoreTest : public WholeTest {
 protected:
  void SetUp() override {
    WholeTest::SetUp();
    std::ofstream(path("keys")) << "test-access\ntest-secret\n";
  }
  std::unique_ptr<Process> start_one(const std::string& name, const std::string& url) {
    const std::string port_file = path(name + ".port");
    auto server = start("hairnet-server",
                        {"--port", "0", "--port-file", port_file, "--groom-cache", path(name + "_grooms"),
                         "--level-cache", path(name + "_levels"), "--object-store", url, "--object-store-key-file",
                         path("keys"), "--workers", "1", "--learn-hair", "never"},
                        name);
    EXPECT_TRUE(wait_for_file(port_file, 1, *server)) << server->err();
    std::ifstream(port_file) >> port_;
    return server;
  }
  std::unique_ptr<Process> start_on_server(const Arguments& more, const std::string& name) {
    Arguments arguments{"--connect", "127.0.0.1:" + port_};
    arguments.insert(arguments.end(), more.begin(), more.end());
    return start("hairnet-view", arguments, name);
  }
  // Runs a client until it has received frames of its hair. It uploads the groom when the server asks for it.
  void use_groom(const std::string& name) {
    const auto view =
        start_on_server({"--room", "hall", "--character", "groom=made:bob,motion=made:nod,level=low,strands=200",
                         "--duration", "0.5", "--no-draw"},
                        name + "_view");
    finish(*view, 0);
  }
  // The port of the server that was started last.
  std::string port_;

  static void expect_no_secret(Process& server) {
    EXPECT_EQ(server.err().find("test-secret"), std::string::npos);
    EXPECT_EQ(server.out().find("test-secret"), std::string::npos);
  }
};

TEST_F(ObjectStoreTest, a_groom_that_one_server_got_and_built_is_neither_uploaded_to_the_next_nor_built_there) {
  S3Server store;
  const auto first = start_one("first", store.url("/fleet"));
  use_groom("first");
  EXPECT_TRUE(wait([&] { return store.objects().size() == 2; })) << "the groom and its levels";
  drain(*first);
  EXPECT_EQ(counter(*first, "grooms_uploaded"), 1);
  EXPECT_EQ(counter(*first, "objects_stored_groom"), 1);
  EXPECT_EQ(counter(*first, "objects_stored_levels"), 1);
  EXPECT_EQ(counter(*first, "objects_read_groom"), 0);

  const auto second = start_one("second", store.url("/fleet"));
  use_groom("second");
  drain(*second);
  EXPECT_EQ(counter(*second, "grooms_uploaded"), 0);
  EXPECT_EQ(counter(*second, "groom_bytes_received"), 0);
  EXPECT_EQ(counter(*second, "grooms_ready"), 1);
  EXPECT_EQ(counter(*second, "objects_read_groom"), 1);
  EXPECT_EQ(counter(*second, "objects_read_levels"), 1) << "so none were built";
  EXPECT_EQ(counter(*second, "objects_stored_levels"), 0);
  EXPECT_EQ(store.wrong_signatures, 0u);
  EXPECT_EQ(store.objects().size(), 2u);
  for (Process* server : {first.get(), second.get()}) expect_no_secret(*server);
}

TEST_F(ObjectStoreTest, wrong_bytes_in_the_store_are_refused_and_the_groom_is_uploaded_built_and_put_right) {
  S3Server store;
  const auto first = start_one("first", store.url());
  use_groom("first");
  EXPECT_TRUE(wait([&] { return store.objects().size() == 2; }));
  drain(*first);
  const auto good = store.objects();
  for (auto [name, bytes] : good) {
    // One bit in the middle of each object changes, which only a hash can notice.
    bytes[bytes.size() / 2] ^= 1;
    store.set_object(name, std::move(bytes));
  }
  const auto second = start_one("second", store.url());
  use_groom("second");
  EXPECT_TRUE(wait([&] { return store.objects() == good; }));
  drain(*second);
  EXPECT_EQ(counter(*second, "objects_rejected_hash"), 1);
  EXPECT_EQ(counter(*second, "objects_rejected_levels"), 1);
  EXPECT_EQ(counter(*second, "grooms_uploaded"), 1);
  EXPECT_EQ(counter(*second, "grooms_ready"), 1);
  EXPECT_EQ(counter(*second, "objects_read_groom"), 0);
}

TEST_F(ObjectStoreTest, a_server_goes_on_without_its_store_and_warns_once) {
  std::uint16_t port = 0;
  std::string url;
  {
    // The store ends here, so that nothing listens on its port until the second store below.
    const S3Server gone;
    port = gone.port();
    url = gone.url();
  }
  const auto server = start_one("server", url);
  use_groom("server");
  EXPECT_THAT(server->err(), HasSubstr("event=object_store_failed"));
  // The store comes back on the same port, and gets the objects that it has missed.
  S3Server store(S3ServerDef{.port = port});
  EXPECT_TRUE(wait([&] { return store.objects().size() == 2; }));
  EXPECT_TRUE(wait([&] { return server->err().find("event=object_store_reached") != std::string::npos; }));
  store.behaviour = S3Behaviour::silent;
  drain(*server);
  const std::string log = server->err();
  const std::size_t first = log.find("event=object_store_failed");
  EXPECT_EQ(log.find("event=object_store_failed", first + 1), std::string::npos) << log;
  EXPECT_EQ(counter(*server, "grooms_uploaded"), 1);
  EXPECT_GE(counter(*server, "object_requests_failed_unreachable"), 1);
}

TEST_F(ObjectStoreTest, a_server_ends_while_its_store_says_nothing) {
  S3Server store;
  store.behaviour = S3Behaviour::silent;
  const auto server = start_one("server", store.url());
  const auto view =
      start_on_server({"--room", "hall", "--character", "groom=made:bob,motion=made:nod,level=low,strands=200",
                       "--duration", "forever", "--no-draw"},
                      "view");
  // The server now waits for an answer of the store, which never comes.
  EXPECT_TRUE(wait([&] { return store.gets == 1; })) << server->err();
  drain(*server);
  view->send(SIGINT);
  view->wait();
  EXPECT_EQ(counter(*server, "object_requests_failed_timeout"), 0) << "it does not wait for the time-out";
}

TEST_F(ObjectStoreTest, a_malformed_store_is_refused_at_the_start_in_one_line) {
  const auto refuses = [&](const Arguments& more, const std::string& error) {
    Arguments arguments{"--port", "0", "--groom-cache", path("grooms")};
    arguments.insert(arguments.end(), more.begin(), more.end());
    const auto server = start("hairnet-server", arguments, "server");
    finish(*server, 2);
    EXPECT_TRUE(is_one_line(server->err())) << server->err();
    EXPECT_THAT(server->err(), HasSubstr(error));
  };
  refuses({"--object-store", "minio:9000/bucket"}, "minio:9000/bucket");
  refuses({"--object-store", "http://127.0.0.1:9000"}, "names no bucket");
  refuses({"--object-store", "http://a/b", "--object-store-key-file", path("nothing")}, path("nothing"));
  refuses({"--object-store", "https://a/b", "--object-store-key-file", path("keys"), "--object-store-ca",
           path("nothing.pem")},
          path("nothing.pem"));
}

}  // namespace
}  // namespace hairnet::whole
