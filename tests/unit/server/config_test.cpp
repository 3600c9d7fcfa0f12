#include "server/app/config.hpp"

#include <gtest/gtest.h>

#include <fstream>
#include <map>
#include <vector>

namespace hairnet::server {
namespace {

ParsedConfig parse(std::vector<const char*> words) {
  words.insert(words.begin(), "hairnet-server");
  return parse_config(static_cast<int>(words.size()), words.data());
}

TEST(Config, the_defaults_are_valid) {
  const ParsedConfig parsed = parse({});
  // The exit code -1 means that the program goes on.
  EXPECT_EQ(parsed.exit_code, -1);
  EXPECT_EQ(parsed.config.port, 7420);
  EXPECT_EQ(parsed.config.tick_rate_hz, 30u);
  EXPECT_GE(parsed.config.workers, 1u);
  EXPECT_GE(parsed.config.build_threads, 1u);
  EXPECT_EQ(parsed.config.level_cache, "");
  EXPECT_EQ(validate(parsed.config), "");
}

TEST(Config, a_fleet_needs_an_address_that_clients_can_use) {
  EXPECT_EQ(parse({"--etcd", "http://127.0.0.1:2379", "--fleet-address", "hair1.example"}).exit_code, -1);
  EXPECT_EQ(parse({"--etcd", "http://127.0.0.1:2379"}).exit_code, 2);
  EXPECT_EQ(parse({"--etcd", "127.0.0.1:2379", "--fleet-address", "hair1.example"}).exit_code, 2);
  EXPECT_EQ(parse({"--fleet-address", "hair1.example"}).exit_code, 2);
  // A lease has at least 2 s, and with go_on 5 s (kGoOnLeaseMin_s in config.cpp).
  EXPECT_EQ(parse({"--etcd", "http://a", "--fleet-address", "b", "--fleet-lease", "1"}).exit_code, 2);
  EXPECT_EQ(parse({"--etcd", "http://a", "--fleet-address", "b", "--fleet-lease", "2"}).exit_code, -1);
  EXPECT_EQ(
      parse({"--etcd", "http://a", "--fleet-address", "b", "--fleet-lease", "4", "--without-etcd", "go_on"}).exit_code,
      2);
  EXPECT_EQ(parse({"--etcd", "http://a", "--fleet-address", "hair1.example:0"}).exit_code, 2);
  EXPECT_EQ(parse({"--etcd", "http://a", "--fleet-address", "b", "--fleet-name", "a/b"}).exit_code, 2);
  EXPECT_EQ(parse({"--etcd", "http://a", "--fleet-address", "b", "--big-rooms", "hall arena.1"}).exit_code, -1);
  EXPECT_EQ(parse({"--etcd", "http://a", "--fleet-address", "b", "--big-rooms", "hall a/b"}).exit_code, 2);
  EXPECT_EQ(parse({"--etcd", "http://a", "--fleet-address", "agones"}).exit_code, -1);
  EXPECT_EQ(parse({"--etcd", "http://a", "--fleet-address", "agones", "--agones", "off"}).exit_code, 2);
  EXPECT_EQ(parse({"--fleet-address", "agones"}).exit_code, 2);
  EXPECT_EQ(parse({"--agones", "perhaps"}).exit_code, 2);
  FleetConfig fleet;
  fleet.address = "agones";
  // The address "agones" is not known before the sidecar tells it, so there is no host yet. The number 7 is the port of
  // a server whose address names none.
  EXPECT_EQ(fleet_address(fleet, 7).host, "");
  for (const auto& [text, host, port] :
       std::vector<std::tuple<const char*, const char*, int>>{{"a.example", "a.example", 7},
                                                              {"a.example:9", "a.example", 9},
                                                              {"::1", "::1", 7},
                                                              {"[::1]", "::1", 7},
                                                              {"[::1]:9", "::1", 9}}) {
    fleet.address = text;
    EXPECT_EQ(fleet_address(fleet, 7).host, host) << text;
    EXPECT_EQ(fleet_address(fleet, 7).port, port) << text;
  }
}

// Reads the table of time-outs of schema/PROTOCOL.md: names, and the seconds as text.
std::map<std::string, std::string> documented_time_outs() {
  std::ifstream page(HAIRNET_PROTOCOL_FILE);
  std::map<std::string, std::string> seconds;
  bool in_table = false;
  for (std::string line; std::getline(page, line) && (!in_table || !line.empty());) {
    if (in_table && line.rfind("|---", 0) != 0) {
      const std::size_t bar = line.find(" | "), end = line.find(" | ", bar + 1);
      seconds[line.substr(2, bar - 2)] = line.substr(bar + 3, end - bar - 3);
    }
    in_table |= line.rfind("| time-out |", 0) == 0;
  }
  return seconds;
}

TEST(Config, its_time_outs_are_the_documented_ones) {
  const Config config;
  const auto seconds = [](std::int64_t ns) { return std::to_string(ns / 1'000'000'000) + " s"; };
  const std::map<std::string, std::string> expected{
      {"handshake", seconds(config.sessions.handshake_timeout_ns)},
      {"idle, no message from a client that has not promised `signs_of_life`",
       seconds(config.sessions.idle_timeout_ns)},
      {"upload, less than " + std::to_string(static_cast<int>(config.grooms.upload_bytes_per_s_min) / 1024) +
           " KiB a second",
       seconds(config.grooms.upload_timeout_ns)},
      {"download, nothing read of its stream (WebTransport)", seconds(config.sessions.download_stalled_ns)},
      {"slow consumer, nothing read", seconds(config.sessions.slow_consumer_ns)},
      {"draining", seconds(config.sessions.drain_timeout_ns)},
      {"silence (`kSilence_ms`), nothing arrived from a peer that has promised `signs_of_life`",
       std::to_string(wire::kSilence_ms / 1000) + " s"}};
  EXPECT_EQ(documented_time_outs(), expected);
}

TEST(Config, takes_every_flag_in_its_range) {
  const ParsedConfig parsed = parse({"--bind",
                                     "::1",
                                     "--port",
                                     "0",
                                     "--tick-rate",
                                     "90",
                                     "--pose-delay-ms",
                                     "12.5",
                                     "--substeps",
                                     "2",
                                     "--iterations",
                                     "8",
                                     "--characters-max",
                                     "10",
                                     "--clients-max",
                                     "3",
                                     "--groom-bytes-max",
                                     "4096",
                                     "--workers",
                                     "2",
                                     "--record",
                                     "a",
                                     "--port-file",
                                     "b",
                                     "--log-level",
                                     "debug",
                                     "--check",
                                     "--build-threads",
                                     "3",
                                     "--level-cache",
                                     "c",
                                     "--level-cache-mib",
                                     "7",
                                     "--groom-cache",
                                     "d",
                                     "--groom-cache-mib",
                                     "8",
                                     "--strands-per-client-max",
                                     "5000",
                                     "--build-seconds-max",
                                     "2.5",
                                     "--upload-bytes-per-s",
                                     "1000",
                                     "--upload-burst-bytes",
                                     "8192"});
  EXPECT_EQ(parsed.exit_code, -1);
  EXPECT_TRUE(parsed.check_only);
  EXPECT_EQ(parsed.config.tick_rate_hz, 90u);
  EXPECT_EQ(parsed.config.pose_delay_ms, 12.5);
  EXPECT_EQ(parsed.config.sessions.character_count_max, 10u);
  EXPECT_EQ(parsed.config.sessions.characters_per_session_max, 10u);
  EXPECT_EQ(parsed.config.grooms.groom_bytes_max, 4096u);
  EXPECT_EQ(parsed.config.build_threads, 3u);
  EXPECT_EQ(parsed.config.level_cache, "c");
  EXPECT_EQ(parsed.config.level_cache_mib, 7u);
  EXPECT_EQ(parsed.config.groom_cache, "d");
  EXPECT_EQ(parsed.config.groom_cache_mib, 8u);
  EXPECT_EQ(parsed.config.grooms.strands_per_session_max, 5000u);
  EXPECT_EQ(parsed.config.grooms.build_ns_max, 2'500'000'000);
  EXPECT_EQ(parsed.config.grooms.upload_bytes_per_s, 1000);
  EXPECT_EQ(parsed.config.grooms.upload_burst_bytes, 8192);
}

TEST(Config, takes_a_wind_and_who_may_set_it) {
  const ParsedConfig parsed =
      parse({"--wind", "-3", "0.5", "2", "--gust", "0.4", "--gust-period", "6", "--turbulence", "1.5",
             "--turbulence-scale", "0.7", "--wind-seed", "12", "--wind-from-clients", "off"});
  ASSERT_EQ(parsed.exit_code, -1);
  EXPECT_EQ(parsed.config.wind.mean_m_per_s, Vec3(-3, 0.5, 2));
  EXPECT_EQ(parsed.config.wind.gust_ratio, 0.4);
  EXPECT_EQ(parsed.config.wind.gust_period_s, 6);
  EXPECT_EQ(parsed.config.wind.turbulence_rms_m_per_s, 1.5);
  EXPECT_EQ(parsed.config.wind.turbulence_scale_m, 0.7);
  EXPECT_EQ(parsed.config.wind.seed, 12u);
  EXPECT_EQ(parsed.config.sessions.wind_from_clients, AllowedClients::off);
  EXPECT_EQ(parse({}).config.sessions.wind_from_clients, AllowedClients::participants);
  EXPECT_EQ(parse({"--wind-from-clients", "everyone"}).config.sessions.wind_from_clients, AllowedClients::everyone);
}

TEST(Config, takes_who_may_set_props) {
  EXPECT_EQ(parse({}).config.sessions.props_from_clients, AllowedClients::moderators);
  EXPECT_EQ(parse({"--props-from-clients", "off"}).config.sessions.props_from_clients, AllowedClients::off);
  const ParsedConfig both = parse({"--props-from-clients", "everyone", "--wind-from-clients", "off"});
  EXPECT_EQ(both.config.sessions.props_from_clients, AllowedClients::everyone);
  EXPECT_EQ(both.config.sessions.wind_from_clients, AllowedClients::off);
}

// The ranges of settings stand in settings.cpp; many values here are the next ones outside.
TEST(Config, refuses_what_is_out_of_range_with_status_2) {
  for (const std::vector<const char*>& words :
       std::vector<std::vector<const char*>>{{"--port", "65536"},
                                             {"--port", "-1"},
                                             {"--tick-rate", "9"},
                                             {"--tick-rate", "121"},
                                             {"--tick-rate", "x"},
                                             {"--pose-delay-ms", "nan"},
                                             {"--pose-delay-ms", "-1"},
                                             {"--substeps", "-1"},
                                             {"--iterations", "257"},
                                             {"--characters-max", "0"},
                                             {"--clients-max", "0"},
                                             {"--groom-bytes-max", "1"},
                                             {"--build-threads", "65"},
                                             {"--level-cache-mib", "0"},
                                             {"--level-cache-mib", "1048577"},
                                             {"--log-level", "loud"},
                                             {"--bind", ""},
                                             {"--nonsense"},
                                             {"--port", "1", "--port", "2"},
                                             {"--idle-timeout-s", "0"},
                                             {"--config", "/nonexistent/server.toml"},
                                             {"--wind", "1", "2"},
                                             {"--wind", "1", "nan", "0"},
                                             {"--wind", "61", "0", "0"},
                                             {"--gust", "1.1"},
                                             {"--turbulence", "-1"},
                                             {"--turbulence-scale", "0.1"},
                                             {"--wind-from-clients", "maybe"},
                                             {"--props-from-clients", "maybe"},
                                             {"--record", "a", "--port-file", "a"}}) {
    EXPECT_EQ(parse(words).exit_code, 2) << words[0];
  }
}

TEST(Config, help_ends_with_status_0) {
  EXPECT_EQ(parse({"--help"}).exit_code, 0);
}

}  // namespace
}  // namespace hairnet::server
