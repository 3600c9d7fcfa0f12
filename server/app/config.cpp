#include "server/app/config.hpp"

#include <fmt/format.h>

#include <CLI/CLI.hpp>
#include <algorithm>
#include <array>
#include <cstdio>
#include <thread>

#include "core/solver/step.hpp"
#include "schema/wire/groom_file.hpp"
#include "schema/wire/messages.hpp"

namespace hairnet::server {
namespace {

constexpr const char* kExamples = R"(Examples:
  hairnet-server                                   127.0.0.1:7420, 30 Hz
  hairnet-server --bind 0.0.0.0 --tick-rate 60     all IPv4 interfaces, 60 Hz
  hairnet-server --port 0 --port-file port.txt     any free port, written to port.txt
  hairnet-server --record run.hnrec              what the solver was told, to be stepped again
  hairnet-server --level-cache levels            builds no groom twice
  hairnet-server --check --tick-rate 90            say what would run, and end

Exit status: 0 after SIGTERM or SIGINT, 2 when the configuration is wrong or the port is taken.)";

void add_options(CLI::App& app, ParsedConfig& parsed) {
  Config& c = parsed.config;
  app.add_option("--bind", c.bind, "numeric address to listen on")
      ->check(CLI::Validator(
          [](const std::string& text) { return text.empty() ? std::string("must not be empty") : std::string(); },
          "ADDRESS"));
  app.add_option("--port", c.port, "TCP port; 0 picks a free one")->check(CLI::Range(0, 65535));
  app.add_option("--port-file", c.port_file, "write the port in use to this file");
  app.add_option("--tick-rate", c.tick_rate_hz, "steps and frames a second")->check(CLI::Range(10, 120));
  app.add_option("--pose-delay-ms", c.pose_delay_ms, "poses are sampled this far back")->check(CLI::Range(0.0, 200.0));
  app.add_option("--substeps", c.substeps, "solver steps a tick (as many as keep a step within 1/50 s)")
      ->check(CLI::Range(1, 16));
  app.add_option("--iterations", c.iterations, "of conjugate gradient a step (each level's own)")
      ->check(CLI::Range(1, 256));
  app.add_option("--characters-max", c.sessions.character_count_max, "characters of all clients")
      ->check(CLI::Range(1, 65536));
  app.add_option("--clients-max", c.sessions.session_count_max, "clients at once")->check(CLI::Range(1, 10000));
  app.add_option("--groom-bytes-max", c.grooms.groom_bytes_max, "bytes of one groom")
      ->check(CLI::Range(std::size_t{1024}, wire::kGroomBytesMax));
  app.add_option("--workers", c.workers, "threads of a tick; 0: the machine's less one")->check(CLI::Range(0, 256));
  app.add_option("--build-threads", c.build_threads,
                 "threads of a groom's build, of low priority; 0: what the machine has, at most 4")
      ->check(CLI::Range(0, 64));
  app.add_option("--level-cache", c.level_cache,
                 "keep built levels in this folder, so that the next server need not build them; "
                 "without it none are kept");
  app.add_option("--level-cache-mib", c.level_cache_mib, "MiB kept there; those used least lately go first")
      ->check(CLI::Range(1, 1 << 20));
  app.add_option_function<std::array<double, 3>>(
         "--wind", [&c](const std::array<double, 3>& v) { c.wind.mean_m_per_s = Vec3(v.data()); },
         "mean wind, m/s, world: X Y Z")
      ->default_str("0 0 0");
  app.add_option("--gust", c.wind.gust_ratio, "the mean comes and goes by this share of it, 0 to 1");
  app.add_option("--gust-period", c.wind.gust_period_s, "seconds of the slowest gust");
  app.add_option("--turbulence", c.wind.turbulence_rms_m_per_s, "m/s of each component, root mean square");
  app.add_option("--turbulence-scale", c.wind.turbulence_scale_m, "metres over which turbulence changes, at least 0.3");
  app.add_option("--wind-seed", c.wind.seed, "another seed, another turbulence");
  app.add_option("--wind-from-clients", c.sessions.wind_from_clients,
                 "whether clients may set the wind of all: on, off");
  app.add_option("--record", c.record, "write a recording to this file");
  app.add_option("--log-level", c.log_level, "trace, debug, info, warn, error or off")
      ->check(CLI::IsMember({"trace", "debug", "info", "warn", "error", "off"}));
  app.add_flag("--check", parsed.check_only, "check the configuration, say what it is, and end");
}

}  // namespace

ParsedConfig parse_config(int argc, const char* const* argv) {
  ParsedConfig parsed;
  CLI::App app("Simulates the hair of many characters for clients that stream head poses.", "hairnet-server");
  app.footer(kExamples);
  app.get_formatter()->column_width(28);
  app.option_defaults()->always_capture_default();
  add_options(app, parsed);
  try {
    app.parse(argc, argv);
  } catch (const CLI::CallForHelp&) {
    std::fputs(app.help().c_str(), stdout);
    parsed.exit_code = 0;
    return parsed;
  } catch (const CLI::ParseError& error) {
    fmt::print(stderr, "hairnet-server: {}\n", error.what());
    parsed.exit_code = 2;
    return parsed;
  }
  Config& config = parsed.config;
  if (config.workers == 0) config.workers = std::max(2u, std::thread::hardware_concurrency()) - 1;
  if (config.build_threads == 0) config.build_threads = std::clamp(std::thread::hardware_concurrency(), 1u, 4u);
  config.sessions.characters_per_session_max =
      std::min(config.sessions.characters_per_session_max, config.sessions.character_count_max);
  config.grooms.upload_bytes_max = std::max(config.grooms.upload_bytes_max, 4 * config.grooms.groom_bytes_max);
  if (const std::string wrong = validate(config); !wrong.empty()) {
    fmt::print(stderr, "hairnet-server: {}\n", wrong);
    parsed.exit_code = 2;
  }
  return parsed;
}

std::string validate(const Config& config) {
  const SessionLimits& s = config.sessions;
  if (std::string fault = validate(config.wind); !fault.empty()) return fault;
  if (std::string fault = validate(config.transport); !fault.empty()) return fault;
  // A NaN passes a range check of the command line.
  if (!(config.pose_delay_ms >= 0 && config.pose_delay_ms <= 200)) return "--pose-delay-ms: not in 0 to 200";
  if (config.grooms.groom_bytes_max > config.grooms.upload_bytes_max)
    return "one groom may not be larger than all uploads together";
  if (s.frame_packet_bytes_max > wire::kPacketBytesMax - wire::kPacketOverheadBytesMax)
    return "a packet of frames would exceed the protocol's packet bound";
  if (s.characters_per_session_max > s.character_count_max) return "more characters a session than in all";
  if (!config.record.empty() && config.record == config.port_file)
    return "the recording and the port file are the same file";
  return {};
}

std::string summary(const Config& config) {
  const int substeps = config.substeps > 0 ? config.substeps : substep_count_for(1.0 / config.tick_rate_hz);
  return fmt::format("{} Hz, pose delay {} ms, {} substep{}, {} worker{}, at most {} clients and {} characters{}{}",
                     config.tick_rate_hz, config.pose_delay_ms, substeps, substeps == 1 ? "" : "s", config.workers,
                     config.workers == 1 ? "" : "s", config.sessions.session_count_max,
                     config.sessions.character_count_max,
                     config.record.empty() ? "" : ", recording to " + config.record,
                     config.level_cache.empty() ? "" : ", levels kept in " + config.level_cache);
}

}  // namespace hairnet::server
