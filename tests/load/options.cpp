#include "tests/load/options.hpp"

#include <fmt/format.h>

#include <CLI/CLI.hpp>
#include <algorithm>
#include <charconv>
#include <cstdio>
#include <utility>

#include "client/files/read_file.hpp"
#include "client/tools/command_line/in_range.hpp"
#include "client/tools/command_line/parse.hpp"
#include "tests/load/attacks.hpp"
#include "tests/load/stage_figures.hpp"

namespace hairnet::load {
namespace {

constexpr const char* kFooter = R"(A stage is KIND:DURATION[:KEY=VALUE,...]
  KIND      ramp (goes to its population evenly; not measured), steady (within a second), spike (at once), soak
  clients=N characters=N      of each client; level=high+low (in turn): high, medium, low, ether, learnt, rigid
  churn=N                     clients a second that leave and are replaced (half without a goodbye)
  storm=50%                   of the clients lose their connections at half time, and return
  slow= flood= malformed= silent= half_open=   misbehaving clients beside the others: a number, or a share such as 10%
  attack=WORD                 attackers beside all clients, see --list; the stages before and after it have none
  warm=2s measured=yes|no name=WORD
A missing key has the value of the stage before, except churn, storm, attack, warm and measured.

Examples:
  hairnet-load --server 127.0.0.1:7420 --stage ramp:5s:clients=8,characters=8 --stage steady:30s
  hairnet-load --spawn build/release/bin/hairnet-server --preset rooms8 --html load.html -- --level-cache levels
  hairnet-load --preset smoke --require 'latency_p99_ms<120' --require 'errors==0' --check 1
  hairnet-load --spawn hairnet-server --stage steady:10s:clients=4,characters=64,level=low --find-capacity \
    --require 'latency_p99_ms<80' --require 'frames_missed_share<0.01' -- --workers 1
  hairnet-load --spawn hairnet-server --preset rooms8 --transport webtransport -- --level-cache levels
  hairnet-load --plan load.json        what is in a report can be run again

Exit status: 0 all thresholds met, 1 one is not, 2 usage, 3 the generator itself was late (nothing counts), 4 it could not run.)";

struct Given {
  std::string server = "127.0.0.1:7420", transport = "tcp", plan, preset;
  std::vector<std::string> stages, requirements, grooms, motions;
  std::optional<std::uint64_t> seed;
  std::optional<double> pose_hz;
  std::optional<std::uint32_t> room_size;
  std::optional<std::string> observe;
  std::optional<double> touch_share, props_share, hair_error_mm, frame_bytes_per_s;
  std::string token_file;
  bool find_capacity = false, list = false;
  CapacityOptions capacity;
};

void add_options(CLI::App& app, Options& o, Given& g) {
  app.add_option("--server", g.server, "HOST:PORT of a server that runs (127.0.0.1:7420)");
  app.add_option("--transport", g.transport,
                 "how clients connect, but for attackers: tcp, tls, ws or webtransport (tcp)")
      ->check(CLI::IsMember(std::vector<std::string>(kTransportNames.begin(), kTransportNames.end())));
  app.add_option("--spawn", o.spawn, "start this server program instead, on a free port; its arguments after --");
  app.add_option("--server-log", o.server_log, "file for what the started server prints (hairnet-load-server.log)");
  app.add_option("--server-pid", o.server_pid, "a running server's process, for its CPU and memory")
      ->check(CLI::PositiveNumber);
  CLI::Option* plan = app.add_option("--plan", g.plan, "JSON file of the plan, or a report of an earlier run");
  app.add_option("--preset", g.preset, "a plan of ours: smoke, crowd, rooms8, rooms32, touch, hostile")->excludes(plan);
  app.add_option("--stage", g.stages, "see below; several, in order; instead of the plan's")->allow_extra_args(false);
  app.add_option("--seed", g.seed, "of arrivals, motions, misdeeds (1)");
  app.add_option("--pose-hz", g.pose_hz, "poses a second of each character (72)")->check(in_range(1, 1000));
  app.add_option("--groom", g.grooms, "groom or strand files, or made:STYLE, taken in turn (made:bob)")->delimiter(',');
  app.add_option("--motion", g.motions, "BVH files or made:NAME (made:dance,made:look_around,made:nod,made:walk)")
      ->delimiter(',');
  app.add_option("--room-size", g.room_size, "clients of a room; 0: all in one (0)")
      ->check(CLI::Range(0u, kClientCountMax));
  app.add_option("--touch-share", g.touch_share,
                 "of the clients have hands, which stroke, hold and pin the hair of others; 0 to 1 (0)")
      ->check(in_range(0, 1));
  app.add_option("--props-share", g.props_share,
                 "of the clients with hands also set, move and remove props, if the server permits it; 0 to 1 (0)")
      ->check(in_range(0, 1));
  app.add_option("--observe", g.observe, "all, or a number of nearest; 0: itself alone (all)");
  app.add_option("--hair-error", g.hair_error_mm,
                 "about the error of hair that clients ask for where a head fills the screen, mm (1)")
      ->check(in_range(0, 1000));
  app.add_option("--frame-bytes", g.frame_bytes_per_s,
                 "of frames that each client wants at most a second; 0: any number (0)")
      ->check(in_range(0, 1e9));
  app.add_option("--require", g.requirements, "threshold FIGURE<NUMBER, or STAGE/FIGURE<NUMBER; < <= > >= ==; several")
      ->allow_extra_args(false);
  app.add_option("--lag-max-ms", o.lag_p99_max_ms, "the generator's own lag, p99, above which nothing counts (5)")
      ->check(in_range(0.1, 10'000));
  app.add_option("--check", o.check_share, "share of characters whose frames are checked, in still air (0)")
      ->check(in_range(0, 1));
  app.add_option("--decode-share", o.decode_share, "share of members whose frames are decoded, the others' counted (1)")
      ->check(in_range(0, 1));
  app.add_flag("--ask-coefficients{false}", o.evaluate_learnt,
               "clients do not evaluate learnt hair: its frames have coefficients");
  app.add_option("--token", g.token_file, "file of a token for the rooms, where the server wants one");
  app.add_flag(
      "--find-capacity", g.find_capacity,
      "the most characters at which the thresholds hold, in clients as the last stage has them; of its one client");
  app.add_option("--capacity-from", g.capacity.first, "characters of the first probe (16)")
      ->check(CLI::Range(1u, 1'000'000u));
  app.add_option("--capacity-max", g.capacity.most, "of the last (20000)")->check(CLI::Range(1u, 1'000'000u));
  app.add_option("--capacity-resolution", g.capacity.resolution, "share by which it may be too low (0.05)")
      ->check(in_range(0.001, 0.5));
  app.add_option("--probe-warm-s", g.capacity.warm_s, "seconds of a probe before it is measured (4)")
      ->check(in_range(0.5, 3600));
  app.add_option("--probe-s", g.capacity.probe_s, "seconds of a probe (8)")->check(in_range(0.5, 3600));
  app.add_option("--confirm-s", g.capacity.confirm_s, "seconds of the confirming one (20)")->check(in_range(0.5, 3600));
  app.add_option("--json", o.json, "file for the report");
  app.add_option("--html", o.html, "file for the report as a page");
  app.add_flag("!--no-metrics", o.scrape_metrics, "do not ask the server for /metrics");
  app.add_flag("--quiet", o.quiet, "nothing while it runs");
  app.add_flag("--list", g.list, "the presets, the attacks and the figures that thresholds may name, and end");
  app.add_option("SERVER_ARGUMENTS", o.server_arguments, "after --: of the server that is started");
}

void print_list() {
  std::string text;
  for (const Preset& preset : presets())
    text += fmt::format("--preset {:<10} {}\n{}\n\n", preset.name, preset.description, preset.plan);
  for (std::size_t i = 0; i < kAttackNames.size(); ++i)
    text += fmt::format("attack={:<11} {}\n", kAttackNames[i], attack_meanings()[i]);
  text += '\n';
  for (const FigureName& figure : figure_names()) text += fmt::format("{:<28} {}\n", figure.name, figure.meaning);
  std::fputs(text.c_str(), stdout);
}

Result<Address> parse_address(const std::string& text) {
  const std::size_t colon = text.rfind(':');
  Address address;
  if (colon == std::string::npos || colon == 0) return Refusal(fmt::format("--server '{}' is not HOST:PORT", text));
  address.host = text.substr(0, colon);
  if (address.host.starts_with('[') && address.host.ends_with(']'))
    address.host = address.host.substr(1, address.host.size() - 2);
  const char* end = text.data() + text.size();
  const auto [stop, error] = std::from_chars(text.data() + colon + 1, end, address.port);
  if (error != std::errc() || stop != end || address.port == 0)
    return Refusal(fmt::format("--server '{}' has no port in 1 to 65535", text));
  return address;
}

Result<Plan> make_plan(const Given& g) {
  Plan plan;
  if (!g.plan.empty()) {
    const auto bytes = read_file(g.plan);
    if (!bytes) return Refusal("--plan " + g.plan + ": " + bytes.error());
    auto parsed = parse_plan(as_text(*bytes));
    if (!parsed) return Refusal("--plan " + g.plan + ": " + parsed.error());
    plan = std::move(*parsed);
  } else if (!g.preset.empty()) {
    auto preset = preset_plan(g.preset);
    if (!preset) return Refusal("--preset: " + preset.error());
    plan = std::move(*preset);
  }
  if (!g.stages.empty()) plan.stages.clear();
  for (const std::string& text : g.stages) {
    auto stage = parse_stage(text, plan.stages.empty() ? nullptr : &plan.stages.back());
    if (!stage) return Refusal(stage.error());
    plan.stages.push_back(std::move(*stage));
  }
  if (g.seed) plan.seed = *g.seed;
  if (g.pose_hz) plan.pose_hz = *g.pose_hz;
  if (!g.grooms.empty()) plan.grooms = g.grooms;
  if (!g.motions.empty()) plan.motions = g.motions;
  if (g.room_size) plan.room_size = *g.room_size;
  if (g.touch_share) plan.touch_share = *g.touch_share;
  if (g.props_share) plan.props_share = *g.props_share;
  if (g.observe) plan.observe = *g.observe;
  if (g.hair_error_mm) plan.hair_error_mm = *g.hair_error_mm;
  if (g.frame_bytes_per_s) plan.frame_bytes_per_s = *g.frame_bytes_per_s;
  if (std::string error = settle(plan); !error.empty()) return Refusal(std::move(error));
  return plan;
}

Result<void> conclude(Options& o, const Given& g) {
  auto address = parse_address(g.server);
  if (!address) return Refusal(address.error());
  o.server = std::move(*address);
  o.transport = static_cast<Transport>(std::ranges::find(kTransportNames, g.transport) - kTransportNames.begin());
  if (o.spawn.empty() && !o.server_arguments.empty())
    return Refusal("'" + o.server_arguments.front() + "': arguments after -- are for --spawn, which is not given");
  auto plan = make_plan(g);
  if (!plan) return Refusal(plan.error());
  o.plan = std::move(*plan);
  std::vector<std::string> texts = o.plan.requirements;
  texts.insert(texts.end(), g.requirements.begin(), g.requirements.end());
  if (g.find_capacity && texts.empty()) texts = {"latency_p99_ms<100", "frames_missed_share<0.01", "errors==0"};
  for (const std::string& text : texts) {
    auto requirement = parse_requirement(text);
    if (!requirement) return Refusal(requirement.error());
    o.requirements.push_back(std::move(*requirement));
  }
  if (!g.token_file.empty()) {
    const auto bytes = read_file(g.token_file);
    if (!bytes) return Refusal("--token " + g.token_file + ": " + bytes.error());
    o.token = as_text(*bytes);
    while (o.token.ends_with('\n')) o.token.pop_back();
  }
  if (o.decode_share < o.check_share) return Refusal("--check: only decoded frames can be checked, see --decode-share");
  if (!g.find_capacity) return {};
  if (o.plan.stages.back().clients == 0) return Refusal("--find-capacity: the last stage has no clients");
  for (const Requirement& requirement : o.requirements)
    if (!requirement.stage.empty()) return Refusal("--find-capacity: '" + requirement.text + "' may name no stage");
  o.capacity = g.capacity;
  return {};
}

}  // namespace

std::variant<Options, int> parse_options(int argc, const char* const* argv) {
  Options o;
  Given given;
  for (int i = 0; i < argc; ++i) o.command += (i > 0 ? " " : "") + std::string(argv[i]);
  CLI::App app("Loads a server with many clients that keep to their own times, and reports latency, losses and cost.",
               "hairnet-load");
  app.footer(kFooter);
  app.get_formatter()->column_width(28);
  add_options(app, o, given);
  if (const auto exit_status = parse_command_line(app, argc, argv)) return *exit_status;
  if (given.list) {
    print_list();
    return 0;
  }
  if (const auto done = conclude(o, given); !done) {
    std::fputs(fmt::format("hairnet-load: {}\n", done.error()).c_str(), stderr);
    return 2;
  }
  return o;
}

}  // namespace hairnet::load
