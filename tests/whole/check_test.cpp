#include <gmock/gmock.h>
#include <sys/stat.h>

#include <filesystem>
#include <fstream>

#include "tests/whole/loopback.hpp"
#include "tests/whole/whole_test.hpp"

namespace hairnet::whole {
namespace {

using ::testing::HasSubstr;

class Check : public WholeTest {
 protected:
  std::string file(const std::string& name, const std::string& text) {
    std::ofstream(path(name), std::ios::binary) << text;
    return path(name);
  }
  // Runs to the end, which a server that starts does not reach.
  std::string refusal(Arguments arguments, const std::string& name) {
    auto server = start("hairnet-server", arguments, name);
    EXPECT_EQ(server->wait(20), 2) << name << ": " << server->out() << server->err();
    EXPECT_TRUE(is_one_line(server->err())) << name << ": " << server->err();
    return server->err();
  }
};

// Tests each setting that names a file, a folder, an address or a port. A check that passes what a start refuses would
// let a broken configuration be rolled out.
TEST_F(Check, refuses_what_a_start_refuses_with_the_same_line) {
  ASSERT_EQ(::mkfifo(path("pipe").c_str(), 0600), 0);
  const std::string pipe = path("pipe"), absent = path("no/such"), junk = file("junk", "junk\n"), folder = path("");
  const std::string key = file("key", std::string(43, 'A') + "\n");
  const std::vector<Arguments> faults{
      {"--bind", "hair.example"},
      {"--bind", "203.0.113.1"},
      {"--service-port", "1", "--service-bind", "hair.example"},
      {"--service-port", std::to_string(free_port()), "--service-bind", "203.0.113.1"},
      {"--port", "7420", "--service-port", "7420"},
      {"--udp-port", "70000"},
      {"--port-file", absent},
      {"--port-file", pipe},
      {"--port-file", folder},
      {"--record", absent},
      {"--record", pipe},
      {"--record", "/dev/null"},
      {"--record", folder},
      {"--groom-cache", "/proc"},
      {"--groom-cache", junk},
      {"--level-cache", "/proc/inside"},
      {"--level-cache", junk + "/inside"},
      {"--web-root", absent},
      {"--web-root", junk},
      {"--token-key-file", absent},
      {"--token-key-file", junk},
      {"--token-key-file", pipe},
      {"--token-key-file", key, "--token-revoked-file", absent},
      {"--token-key-file", key, "--token-revoked-file", pipe},
      {"--token-key-file", key, "--token-revoked-file", folder},
      {"--tls-certificate", absent, "--tls-key", junk},
      {"--tls-certificate", pipe, "--tls-key", junk},
      {"--tls-certificate", junk, "--tls-key", junk},
      {"--tls-certificate", file("mark", "\xef\xbb\xbf-----BEGIN CERTIFICATE-----\n"), "--tls-key", junk},
      {"--exempt-addresses", "10.0.0.0/8"},
      {"--proxy-protocol", "proxy.example"},
      {"--etcd", "http://127.0.0.1:1", "--fleet-address", "a:0"},
      {"--etcd", "https://127.0.0.1:1", "--fleet-address", "a", "--etcd-ca", absent},
      {"--etcd", "https://127.0.0.1:1", "--fleet-address", "a", "--etcd-ca", pipe},
      {"--etcd", "https://127.0.0.1:1", "--fleet-address", "a", "--etcd-certificate", pipe, "--etcd-key", junk},
      {"--etcd", "http://127.0.0.1:1", "--fleet-address", "a", "--etcd-user", "u", "--etcd-password-file", pipe},
      {"--etcd", "http://127.0.0.1:1", "--fleet-address", "a", "--etcd-user", "u", "--etcd-password-file", absent},
      {"--object-store", "http://127.0.0.1:1/b/", "--groom-cache", path("c"), "--object-store-key-file", pipe},
      {"--object-store", "http://127.0.0.1:1/b/", "--groom-cache", path("c"), "--object-store-key-file", junk},
      {"--object-store", "ftp://127.0.0.1/b/", "--groom-cache", path("c")},
      {"--config", pipe},
      {"--config", absent},
      {"--config", junk},
  };
  for (std::size_t i = 0; i < faults.size(); ++i) {
    SCOPED_TRACE(faults[i][0] + " " + faults[i][1]);
    Arguments arguments = faults[i];
    if (std::ranges::find(arguments, "--port") == arguments.end()) arguments.insert(arguments.end(), {"--port", "0"});
    const std::string at_start = refusal(arguments, "start_" + std::to_string(i));
    arguments.emplace_back("--check");
    EXPECT_EQ(refusal(arguments, "check_" + std::to_string(i)), at_start);
    EXPECT_FALSE(std::filesystem::exists(path("c"))) << "a refused start leaves nothing";
  }
}

TEST_F(Check, leaves_nothing_and_passes_beside_the_server_itself) {
  const std::string record = file("record", "an older recording");
  auto server = start_server({"--groom-cache", path("grooms")});
  const Arguments settings{"--check",  "--port", std::to_string(port()), "--level-cache", path("a/b"),
                           "--record", record,   "--port-file",          path("port")};
  auto check = start("hairnet-server", settings, "check");
  finish(*check, 0);
  EXPECT_THAT(check->out(), HasSubstr("# configuration is valid: 127.0.0.1:" + std::to_string(port())));
  EXPECT_FALSE(std::filesystem::exists(path("a")));
  EXPECT_FALSE(std::filesystem::exists(path("port")));
  // The older recording still has its text of 18 bytes: a check must not open the file for writing.
  EXPECT_EQ(std::filesystem::file_size(record), 18u);
  drain(*server);
}

}  // namespace
}  // namespace hairnet::whole
