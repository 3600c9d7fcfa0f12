#include "server/app/config_file.hpp"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <filesystem>
#include <fstream>
#include <set>

#include "server/app/settings.hpp"

namespace hairnet::server {
namespace {

using testing::StartsWith;

ParsedConfig parse(std::vector<std::string> words) {
  words.insert(words.begin(), "hairnet-server");
  std::vector<const char*> pointers;
  for (const std::string& word : words) pointers.push_back(word.c_str());
  return parse_config(static_cast<int>(pointers.size()), pointers.data());
}

class ConfigFile : public testing::Test {
 protected:
  void SetUp() override {
    path_ = testing::TempDir() + "hairnet_" + testing::UnitTest::GetInstance()->current_test_info()->name() + ".toml";
  }
  void TearDown() override { std::filesystem::remove(path_); }
  const std::string& file(const std::string& text) {
    std::ofstream(path_, std::ios::binary) << text;
    return path_;
  }
  Result<std::set<std::string>> read(const std::string& text) {
    return read_config_file(file(text), settings_of(config_));
  }
  // Returns the error without the file's path in front, or "taken" when there is no error.
  std::string refusal(const std::string& text) {
    const auto result = read(text);
    return result ? "taken" : result.error().substr(path_.size());
  }

  Config config_;
  std::string path_;
};

TEST_F(ConfigFile, sets_what_it_names_and_nothing_else) {
  const auto named = read(
      "[server]\nbind = \"::1\"\nport = 0\npose_delay_ms = 30\n[limits]\nidle_timeout_s = 2.5\n"
      "[wind]\nmean_m_per_s = [1, -2.5, 0]\nfrom_clients = \"off\"\n"
      "[props]\nfrom_clients = \"participants\"\n");
  ASSERT_TRUE(named) << named.error();
  EXPECT_THAT(*named, testing::UnorderedElementsAre("server.bind", "server.port", "server.pose_delay_ms",
                                                    "limits.idle_timeout_s", "wind.mean_m_per_s", "wind.from_clients",
                                                    "props.from_clients"));
  EXPECT_EQ(config_.bind, "::1");
  EXPECT_EQ(config_.port, 0);
  EXPECT_EQ(config_.pose_delay_ms, 30);
  EXPECT_EQ(config_.sessions.idle_timeout_ns, 2'500'000'000);
  EXPECT_EQ(config_.wind.mean_m_per_s, Vec3(1, -2.5, 0));
  EXPECT_EQ(config_.sessions.wind_from_clients, AllowedClients::off);
  EXPECT_EQ(config_.sessions.props_from_clients, AllowedClients::participants);
  EXPECT_EQ(config_.tick_rate_hz, Config().tick_rate_hz);
}

TEST_F(ConfigFile, an_empty_file_sets_nothing) {
  const auto named = read("");
  ASSERT_TRUE(named) << named.error();
  EXPECT_TRUE(named->empty());
}

TEST_F(ConfigFile, says_file_line_and_key_of_what_is_wrong) {
  EXPECT_EQ(refusal("[server]\nprot = 1\n"), ":2: there is no key 'server.prot'; did you mean 'server.port'?");
  EXPECT_EQ(refusal("\n[sever]\nport = 1\n"), ":2: there is no section 'sever'");
  EXPECT_EQ(refusal("port = 1\n"), ":1: there is no key 'port'");
  EXPECT_EQ(refusal("server = 1\n"), ":1: 'server' is a section, not a key");
  EXPECT_EQ(refusal("[server]\nport = \"1\"\n"), ":2: server.port: is text, not an integer");
  EXPECT_EQ(refusal("[server]\nport = 1.0\n"), ":2: server.port: is a number, not an integer");
  EXPECT_EQ(refusal("[server]\nbind = 7\n"), ":2: server.bind: is an integer, not text");
  EXPECT_EQ(refusal("[server]\nport = 65536\n"), ":2: server.port: 65536 is not in 0 to 65535");
  EXPECT_EQ(refusal("[server]\n[server.port]\n"), ":2: server.port: is of a type that no setting takes");
  EXPECT_EQ(refusal("[server]\nport = 1979-05-27\n"), ":2: server.port: is of a type that no setting takes");
  EXPECT_EQ(refusal("[server]\nbind = \"\"\n"), ":2: server.bind: must not be empty");
  EXPECT_EQ(refusal("[server]\nbind = \"a\\nb\"\n"), ":2: server.bind: holds a control character");
  EXPECT_EQ(refusal("[server]\npose_delay_ms = nan\n"), ":2: server.pose_delay_ms: nan is not in 0 to 200");
  EXPECT_EQ(refusal("[limits]\nidle_timeout_s = inf\n"), ":2: limits.idle_timeout_s: inf is not in 1 to 86400");
  EXPECT_EQ(refusal("[wind]\nmean_m_per_s = [0, nan, 0]\n"), ":2: wind.mean_m_per_s: [0, nan, 0] is not in -60 to 60");
  EXPECT_EQ(refusal("[wind]\nmean_m_per_s = [0, 0]\n"), ":2: wind.mean_m_per_s: is of a type that no setting takes");
  EXPECT_EQ(refusal("[wind]\nfrom_clients = true\n"), ":2: wind.from_clients: is a boolean, not text");
  EXPECT_THAT(refusal("[props]\nfrom_clients = \"all\"\n"),
              StartsWith(":2: props.from_clients: 'all' is none of off, "));
  EXPECT_EQ(refusal("[transport]\ntls_required = \"on\"\n"), ":2: transport.tls_required: is text, not a boolean");
  EXPECT_THAT(refusal("[log]\nlog_level = \"loud\"\n"), StartsWith(":2: log.log_level: 'loud' is none of trace, "));
  EXPECT_THAT(refusal("[server]\nport = 1\nport = 2\n"), StartsWith(":3: "));
  EXPECT_THAT(refusal("[server\n"), StartsWith(":1: "));
  EXPECT_THAT(refusal("[server]\nbind = \"\xff\"\n"), StartsWith(":2: "));
}

TEST_F(ConfigFile, a_file_that_cannot_be_read_is_named) {
  const std::vector<Setting> settings = settings_of(config_);
  const auto absent = read_config_file("/nonexistent/server.toml", settings);
  ASSERT_FALSE(absent);
  EXPECT_EQ(absent.error(), "/nonexistent/server.toml: No such file or directory");
  const auto folder = read_config_file("/", settings);
  ASSERT_FALSE(folder);
  EXPECT_EQ(folder.error(), "/: is a folder, not a file");
}

// Editors of Windows may begin a file with a byte order mark, and end lines with a carriage return.
TEST_F(ConfigFile, may_come_from_windows) {
  const ParsedConfig parsed = parse({"--config", file("\xef\xbb\xbf[server]\r\nport = 1000\r\n")});
  ASSERT_EQ(parsed.exit_code, -1);
  EXPECT_EQ(parsed.config.port, 1000);
}

TEST_F(ConfigFile, flags_go_before_it) {
  const std::string& path = file("[server]\nport = 1000\ntick_rate_hz = 60\n[limits]\ncharacters_max = 5\n");
  const ParsedConfig parsed = parse({"--port", "2000", "--config", path});
  ASSERT_EQ(parsed.exit_code, -1);
  EXPECT_EQ(parsed.config.port, 2000);
  EXPECT_EQ(parsed.config.tick_rate_hz, 60u);
  EXPECT_EQ(parsed.config.sessions.characters_per_session_max, 5u);
}

TEST_F(ConfigFile, a_wrong_one_ends_with_status_2_and_one_line) {
  const std::string& path = file("[server]\nport = 65536\n");
  testing::internal::CaptureStderr();
  EXPECT_EQ(parse({"--config", path}).exit_code, 2);
  EXPECT_EQ(testing::internal::GetCapturedStderr(),
            "hairnet-server: " + path + ":2: server.port: 65536 is not in 0 to 65535\n");
  EXPECT_EQ(parse({"--config", ""}).exit_code, 2);
}

// One groom must fit in the memory of all uploads, and in the burst of a session. Where only groom_bytes_max is set,
// the other two become at least four times as large.
TEST_F(ConfigFile, values_that_disagree_are_refused_and_what_was_left_open_is_completed) {
  EXPECT_EQ(parse({"--config", file("[grooms]\ngroom_bytes_max = 8192\nupload_bytes_max = 4096\n")}).exit_code, 2);
  EXPECT_EQ(parse({"--config", file("[grooms]\ngroom_bytes_max = 8192\nupload_burst_bytes = 4096\n")}).exit_code, 2);
  const ParsedConfig parsed = parse({"--groom-bytes-max", "134217728"});
  EXPECT_EQ(parsed.exit_code, -1);
  EXPECT_EQ(parsed.config.grooms.upload_bytes_max, 4u * 134217728u);
  EXPECT_EQ(parsed.config.grooms.upload_burst_bytes, 4.0 * 134217728);
}

TEST_F(ConfigFile, what_check_prints_is_a_file_of_the_same_settings) {
  const ParsedConfig first =
      // The values need care in a text file: a list, a quote with a backslash, and a number in another spelling.
      parse({"--wind", "1", "2", "-3.25", "--port-file", "a \"b\\", "--idle-timeout-s", "0.1e2"});
  ASSERT_EQ(first.exit_code, -1);
  const ParsedConfig second = parse({"--config", file(to_text(first.config))});
  ASSERT_EQ(second.exit_code, -1);
  EXPECT_EQ(to_text(second.config), to_text(first.config));
  EXPECT_EQ(second.config.wind.mean_m_per_s, Vec3(1, 2, -3.25));
  EXPECT_EQ(second.config.port_file, "a \"b\\");
  EXPECT_EQ(second.config.sessions.idle_timeout_ns, 10'000'000'000);
}

TEST_F(ConfigFile, the_example_names_every_key_at_its_default) {
  Config config;
  const std::vector<Setting> settings = settings_of(config);
  // The example in deploy/ documents the defaults. A key that is missing there or has another value would mislead
  // operators.
  const std::string defaults = config_file_text(settings);
  const auto named = read_config_file(HAIRNET_DEPLOY_DIR "/server.toml", settings);
  ASSERT_TRUE(named) << named.error();
  for (const Setting& setting : settings) EXPECT_TRUE(named->count(setting.name()) == 1) << setting.name();
  EXPECT_EQ(config_file_text(settings), defaults);
}

TEST_F(ConfigFile, the_settings_for_hosting_are_valid) {
  Config config;
  const auto named = read_config_file(HAIRNET_DEPLOY_DIR "/hosting/server.toml", settings_of(config));
  ASSERT_TRUE(named) << named.error();
  EXPECT_EQ(validate(config), "");
}

TEST(Settings, every_default_is_in_its_range) {
  Config config;
  for (const Setting& setting : settings_of(config)) {
    Setting::Value value = setting.get();
    EXPECT_EQ(check(setting, value), "") << setting.name();
  }
}

TEST(Settings, flags_and_names_are_unique_and_described) {
  Config config;
  std::set<std::string> flags, names;
  for (const Setting& setting : settings_of(config)) {
    EXPECT_TRUE(flags.insert(setting.flag).second) << setting.flag;
    EXPECT_TRUE(names.insert(setting.name()).second) << setting.name();
    EXPECT_THAT(setting.flag, StartsWith("--"));
    EXPECT_FALSE(setting.about.empty()) << setting.name();
  }
}

TEST(Settings, each_can_be_set_to_its_bounds_by_its_flag_and_no_further) {
  Config config;
  for (const Setting& setting : settings_of(config)) {
    Setting::Value value;
    std::string error;
    if (setting.kind() == Setting::Kind::integer) {
      for (const std::int64_t n : {setting.integer_min, setting.integer_max}) {
        ASSERT_TRUE(parse_words(setting, {std::to_string(n)}, value, error)) << setting.name() << ": " << error;
        setting.set(value);
        EXPECT_EQ(setting.get(), Setting::Value(n)) << setting.name();
      }
      EXPECT_FALSE(parse_words(setting, {std::to_string(setting.integer_min - 1)}, value, error)) << setting.name();
      EXPECT_FALSE(parse_words(setting, {"1x"}, value, error)) << setting.name();
    } else if (setting.kind() == Setting::Kind::number) {
      for (const double n : {setting.number_min, setting.number_max}) {
        value = n;
        ASSERT_EQ(check(setting, value), "") << setting.name();
        setting.set(value);
        // Some settings are stored as a float, or as whole nanoseconds or milliseconds, so the number comes back with a
        // float's precision.
        EXPECT_FLOAT_EQ(static_cast<float>(std::get<double>(setting.get())), static_cast<float>(n)) << setting.name();
      }
      EXPECT_FALSE(parse_words(setting, {"nan"}, value, error)) << setting.name();
      EXPECT_FALSE(parse_words(setting, {"1e300"}, value, error)) << setting.name();
    }
  }
}

}  // namespace
}  // namespace hairnet::server
