#include "server/app/config.hpp"

#include <fmt/format.h>

#include <CLI/CLI.hpp>
#include <algorithm>
#include <charconv>
#include <cstdio>
#include <limits>
#include <set>
#include <thread>
#include <utility>
#include <vector>

#include "core/closest_name.hpp"
#include "core/solver/step.hpp"
#include "core/version.hpp"
#include "schema/wire/messages.hpp"
#include "server/app/config_file.hpp"
#include "server/app/process_memory.hpp"
#include "server/app/settings.hpp"
#include "server/fleet/fleet_values.hpp"

namespace hairnet::server {
namespace {

constexpr const char* kExamples = R"(Examples:
  hairnet-server                                   127.0.0.1:7420, 30 Hz
  hairnet-server --bind 0.0.0.0 --tick-rate 60     all IPv4 interfaces, 60 Hz
  hairnet-server --port 0 --port-file port.txt     any free port, written to port.txt
  hairnet-server --record run.hnrec                record the solver's inputs, for hairnet-sim --replay
  hairnet-server --groom-cache kept --level-cache kept
                                                   no groom is uploaded or built twice, even after a restart
  hairnet-server --config server.toml --port 7421  settings of a file, but for the port
  hairnet-server --bind :: --tls-certificate chain.pem --tls-key key.pem --web-root web
                                                   browsers and headsets as well, over TLS
  hairnet-server --check --tick-rate 90            show what would run, and exit

Exit status: 0 after SIGTERM or SIGINT, 2 when the configuration is wrong or the port is taken.)";

// The values of flags, stored until the file has been read: flags win.
using Given = std::vector<std::pair<const Setting*, Setting::Value>>;

// --help shows the default and the range, so no text has to repeat them.
std::string words_about(const Setting& s) {
  std::string text = s.about + " (" + to_toml(s.get());
  if (s.kind() == Setting::Kind::integer && s.integer_max < std::numeric_limits<std::int64_t>::max())
    text += fmt::format("; {} to {}", s.integer_min, s.integer_max);
  if (s.kind() == Setting::Kind::number) text += fmt::format("; {} to {}", s.number_min, s.number_max);
  return text + ")";
}

// The words that a flag takes, as CLI11 shows those of its own checks, where they can be listed.
std::string choices_of(const Setting& s) {
  if (s.kind() == Setting::Kind::boolean) return "{true,false}";
  return s.choices.empty() ? "" : fmt::format("{{{}}}", fmt::join(s.choices, ","));
}

void add_flag(CLI::App& app, const Setting& setting, Given& given) {
  app.add_option_function<std::vector<std::string>>(
         setting.flag,
         [&setting, &given](const std::vector<std::string>& words) {
           Setting::Value value;
           std::string error;
           if (!parse_words(setting, words, value, error)) throw CLI::ValidationError(setting.flag, error);
           given.emplace_back(&setting, std::move(value));
         },
         words_about(setting))
      ->expected(setting.kind() == Setting::Kind::triple ? 3 : 1)
      // A flag that is given twice is most likely a slip, and neither value is the obvious one.
      ->multi_option_policy(CLI::MultiOptionPolicy::Throw)
      ->type_name(choices_of(setting))
      ->group("[" + setting.section + "]");
}

// Computes the settings that were not given.
void complete(Config& config, const std::set<std::string>& named) {
  // The network needs little time compared with ticks: on two cores, reserving one for it would waste most of it.
  const unsigned threads = std::max(1u, std::thread::hardware_concurrency());
  if (config.workers == 0) config.workers = threads > 2 ? threads - 1 : threads;
  if (config.build_threads == 0) config.build_threads = std::clamp(std::thread::hardware_concurrency(), 1u, 4u);
  const std::size_t memory = memory_limit_bytes();
  // The other half is for the kernel's buffers of sockets, the processes that build levels, and other programs.
  if (config.memory_max_mib == 0) config.memory_max_mib = memory / 2 >> 20;
  // A limit that an operator has set stays as it is.
  if (named.count("grooms.build_memory_bytes_max") == 0 && memory > 0)
    config.grooms.build_memory_bytes_max = std::min(config.grooms.build_memory_bytes_max, memory / 2);
  config.sessions.characters_per_session_max =
      std::min(config.sessions.characters_per_session_max, config.sessions.character_count_max);
  // A client may upload a few of the largest grooms. An operator who sets only the size of a groom gets limits that fit
  // it.
  if (named.count("grooms.upload_bytes_max") == 0)
    config.grooms.upload_bytes_max = std::max(config.grooms.upload_bytes_max, 4 * config.grooms.groom_bytes_max);
  if (named.count("grooms.upload_burst_bytes") == 0)
    config.grooms.upload_burst_bytes =
        std::max(config.grooms.upload_burst_bytes, 4 * static_cast<double>(config.grooms.groom_bytes_max));
}

// The shortest lease with go_on. There, one round of keep-alives without an answer, which takes a third of the lease,
// counts as a dead etcd. With a shorter lease, an etcd that is only slow could miss a round, and then give the rooms
// away.
constexpr std::int64_t kGoOnLeaseMin_s = 5;

std::string validate(const FleetConfig& fleet) {
  if (std::string error = validate(fleet.etcd); !error.empty()) return error;
  // The name becomes a part of etcd's keys, where a slash would end it. It has at most 64 characters, those of room
  // names.
  const bool is_name = !fleet.name.empty() && fleet.name.size() <= 64 && std::ranges::all_of(fleet.name, [](char c) {
    return wire::is_room_name(std::string_view(&c, 1));
  });
  if (!is_name) return "fleet.name is 1 to 64 letters, digits, '.', '_' and '-'";
  if (!std::ranges::all_of(fleet.big_rooms, wire::is_room_name))
    return std::string("in fleet.big_rooms, ") + wire::kRoomNameRule;
  // Settings that would do nothing are refused: an operator who sets them believes that the server is in a fleet.
  if (fleet.etcd.endpoints.empty()) {
    const bool is_for_fleet = !fleet.address.empty() || !fleet.etcd.certificate.empty() || !fleet.etcd.user.empty();
    return is_for_fleet ? "the settings of a fleet need fleet.etcd, its endpoints" : "";
  }
  if (fleet.without_etcd == WithoutEtcd::go_on && fleet.lease_s < kGoOnLeaseMin_s)
    return "fleet.without_etcd = \"go_on\" needs a fleet.lease_s of 5 or more";
  if (fleet.address == FleetConfig::kAddressOfAgones)
    return fleet.agones == UseAgones::off ? "fleet.address is agones, but fleet.agones is off" : "";
  if (fleet.address.empty()) return "fleet.etcd needs fleet.address, by which clients reach this server";
  // The port 1 stands for any valid one: fleet_address() returns the port 0 for an address that is not valid.
  const ServerAddress address = fleet_address(fleet, 1);
  if (address.port == 0) return "fleet.address is a host, or a host and a port: hair1.example:7420";
  return validate(address);
}

ParsedConfig refused(const std::string& error) {
  std::fputs(fmt::format("hairnet-server: {}\n", error).c_str(), stderr);
  ParsedConfig parsed;
  parsed.exit_code = 2;
  return parsed;
}

}  // namespace

ParsedConfig parse_config(int argc, const char* const* argv) {
  ParsedConfig parsed;
  const std::vector<Setting> settings = settings_of(parsed.config);
  CLI::App app("Simulates the hair of many characters for clients that stream head poses.", "hairnet-server");
  app.footer(kExamples);
  app.get_formatter()->column_width(28);
  app.set_version_flag("--version", app.get_name() + " " + kVersionAndCommit, "show the version, and exit");
  std::string file;
  app.add_option("--config", file, "TOML file of settings; flags override it")->type_name("FILE");
  app.add_flag("--check", parsed.check_only, "check the configuration as a start does, show it, and exit");
  Given given;
  for (const Setting& setting : settings) add_flag(app, setting, given);
  try {
    app.parse(argc, argv);
  } catch (const CLI::Success& asked) {
    // CLI11 reports --help and --version as exceptions.
    parsed.exit_code = app.exit(asked);
    return parsed;
  } catch (const CLI::ExtrasError&) {
    // A misspelt flag gets the nearest one as a hint.
    std::vector<std::string> flags{"config", "check", "help", "version"};
    for (const Setting& setting : settings) flags.push_back(setting.flag.substr(2));
    return refused(unexpected_argument(app.remaining(), flags, {}));
  } catch (const CLI::ParseError& error) {
    return refused(error.what());
  }
  std::set<std::string> named;
  if (!file.empty()) {
    auto read = read_config_file(file, settings);
    if (!read) return refused(read.error());
    named = std::move(*read);
  } else if (app.count("--config") > 0) {
    return refused("--config: must not be empty");
  }
  // Flags are applied behind the file, so they win wherever --config stands on the line.
  for (const auto& [setting, value] : given) {
    setting->set(value);
    named.insert(setting->name());
  }
  complete(parsed.config, named);
  if (const std::string wrong = validate(parsed.config); !wrong.empty()) return refused(wrong);
  return parsed;
}

ServerAddress fleet_address(const FleetConfig& fleet, std::uint16_t port) {
  if (fleet.address == FleetConfig::kAddressOfAgones) return {.host = {}, .port = 0, .page = fleet.page};
  ServerAddress address{.host = fleet.address, .port = port, .page = fleet.page};
  // A numeric IPv6 address with a port is in brackets; without them its colons are its own.
  const bool is_bracketed = address.host.starts_with('[');
  const std::size_t colon = address.host.rfind(':'), bracket = address.host.rfind(']');
  const bool has_port = is_bracketed ? bracket != std::string::npos && colon == bracket + 1
                                     : colon != std::string::npos && address.host.find(':') == colon;
  if (has_port) {
    const std::string digits = address.host.substr(colon + 1);
    address.port = 0;
    const auto [end, error] = std::from_chars(digits.data(), digits.data() + digits.size(), address.port);
    if (error != std::errc() || end != digits.data() + digits.size()) address.port = 0;
    address.host.resize(colon);
  }
  if (is_bracketed && address.host.ends_with(']')) address.host = address.host.substr(1, address.host.size() - 2);
  return address;
}

std::string validate(const Config& config) {
  const SessionLimits& s = config.sessions;
  if (std::string error = validate(config.wind); !error.empty()) return error;
  if (std::string error = validate(config.transport); !error.empty()) return error;
  if (std::string error = validate(config.fleet); !error.empty()) return error;
  if (std::string error = validate(config.object_store); !error.empty()) return error;
  if (!config.object_store.url.empty() && config.groom_cache.empty() && config.level_cache.empty())
    return "grooms.object_store needs grooms.groom_cache or grooms.level_cache, a folder for what it brings";
  if (config.grooms.groom_bytes_max > config.grooms.upload_bytes_max)
    return fmt::format("grooms.groom_bytes_max ({}) exceeds grooms.upload_bytes_max ({})",
                       config.grooms.groom_bytes_max, config.grooms.upload_bytes_max);
  if (static_cast<double>(config.grooms.groom_bytes_max) > config.grooms.upload_burst_bytes)
    return fmt::format("a groom of {} bytes would not fit into the {:.0f} that a client may upload at once",
                       config.grooms.groom_bytes_max, config.grooms.upload_burst_bytes);
  if (s.frame_packet_bytes_max > wire::kPacketBytesMax - wire::kPacketOverheadBytesMax)
    return "a packet of frames would exceed the protocol's packet bound";
  if (s.characters_per_session_max > s.character_count_max) return "more characters a session than in all";
  if (!config.token_revoked_file.empty() && config.token_key_file.empty())
    return "server.token_revoked_file needs server.token_key_file";
  if (!config.record.empty() && config.record == config.port_file)
    return "the recording and the port file are the same file";
  return {};
}

std::string to_text(const Config& config) {
  // Settings point into a Config that can be changed; the copy keeps the caller's as it is.
  Config copy = config;
  return config_file_text(settings_of(copy));
}

std::string summary(const Config& config) {
  const int substeps = config.substeps > 0 ? config.substeps : substep_count_for(1.0 / config.tick_rate_hz);
  return fmt::format("{} Hz, pose delay {} ms, {} substep{}, {} worker{}, at most {} clients and {} characters{}{}{}{}",
                     config.tick_rate_hz, config.pose_delay_ms, substeps, substeps == 1 ? "" : "s", config.workers,
                     config.workers == 1 ? "" : "s", config.sessions.session_count_max,
                     config.sessions.character_count_max,
                     config.record.empty() ? "" : ", recording to " + config.record,
                     config.groom_cache.empty() ? "" : ", grooms kept in " + config.groom_cache,
                     config.level_cache.empty() ? "" : ", levels kept in " + config.level_cache,
                     config.object_store.url.empty() ? "" : ", both shared in " + config.object_store.url);
}

}  // namespace hairnet::server
