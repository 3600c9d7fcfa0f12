#include "tests/load/fleet_plan/options.hpp"

#include <CLI/CLI.hpp>
#include <algorithm>

#include "client/tools/command_line/in_range.hpp"
#include "client/tools/command_line/parse.hpp"

namespace hairnet::fleet_plan {
namespace {

// The value in parentheses at the end of each option's text is its default, which stands in Settings (settings.hpp).
constexpr const char* kFooter = R"(Costs are measured ones of two cores of an AMD EPYC; give those of your machine.

Examples:
  hairnet-fleet-plan --page plan.html                     100 000 people at the peak, two days
  hairnet-fleet-plan --peak 5000 --rooms 800 --cores 8    a smaller fleet of larger servers
  hairnet-fleet-plan --room-cap 0 --zipf 1.1              which rooms overload a server?
  hairnet-fleet-plan --lease-s 5 --mtbf-h 24              what a shorter lease is worth when servers die every day
  hairnet-fleet-plan --servers 40 --deploy-h 6            a fixed fleet that is updated four times a day

Exit status: 0, 1 when a file cannot be written, 2 usage.)";

// The people: how many come, when, for how long, and into which rooms.
void add_people(CLI::App& app, Settings& s) {
  app.add_option("--peak", s.peak, "people at once, one character each, at the busiest minute (100000)")
      ->check(in_range(0, 1e6));
  app.add_option("--days", s.days, "simulated days, from midnight (2)")->check(in_range(0.01, 31));
  app.add_option("--night", s.night_share, "share of the peak's arrivals that come at the quietest hour (0.25)")
      ->check(in_range(0, 1));
  app.add_option("--peak-hour", s.peak_hour, "hour of the day of most arrivals (20)")->check(in_range(0, 24));
  app.add_option("--session-min", s.session_min, "mean minutes that a person stays (30)")->check(in_range(0.1, 1440));
  app.add_option("--session-sigma", s.session_sigma, "of the logarithm of sessions' lengths; 0: all equal (1)")
      ->check(in_range(0, 2));
  app.add_option("--patience-s", s.patience_s, "for which a person waits for a server (60)")->check(in_range(0, 3600));
  app.add_option("--rooms", s.rooms, "rooms that people choose from (20000)")->check(CLI::Range(1u, 131'072u));
  app.add_option("--zipf", s.zipf, "exponent of the rooms' popularity; 0: all equal (0.9)")->check(in_range(0, 3));
  app.add_option("--room-cap", s.room_cap, "people of a room; 0: any number (256)")->check(CLI::Range(0u, 1'000'000u));
  app.add_option("--room-tries", s.room_tries, "rooms that a person asks for until one is not full (3)")
      ->check(CLI::Range(1u, 100u));
  app.add_option("--observe", s.observe, "members whose hair a client gets at most (32)")->check(CLI::Range(1u, 4096u));
  app.add_option("--hairstyles", s.hairstyles, "that people wear (100)")->check(CLI::Range(1u, 100'000u));
  std::vector<std::string> names(kHairLevelNames.begin(), kHairLevelNames.end());
  app.add_option_function<std::string>(
         "--level",
         [&s](const std::string& name) {
           s.level = static_cast<HairLevel>(std::ranges::find(kHairLevelNames, name) - kHairLevelNames.begin());
         },
         "at which hair is simulated: low, half-learnt, learnt or high (low)")
      ->check(CLI::IsMember(std::move(names)));
}

// The servers: their size, their deaths and updates, and the autoscaler that orders and stops them.
void add_servers(CLI::App& app, Settings& s) {
  app.add_option("--cores", s.cores, "of a server (4)")->check(in_range(0.1, 1024));
  app.add_option("--budget-share", s.budget_share, "share of the cores' time that work may take (0.7)")
      ->check(in_range(0.01, 1));
  app.add_option("--overload-max", s.overload_max, "times the budget that lower detail makes room for (4)")
      ->check(in_range(1, 100));
  app.add_option("--characters-max", s.characters_max, "of a server (4096)")->check(CLI::Range(1u, 1'000'000u));
  app.add_option("--lease-s", s.lease_s, "after which a dead server's rooms go to others (9)")
      ->check(in_range(1, 3600));
  app.add_flag("--balance,!--no-balance", s.balance, "servers that are short of time give up rooms (on)");
  app.add_option("--mtbf-h", s.mtbf_h, "mean hours of a server between kills; 0: none (720)")->check(in_range(0, 1e6));
  app.add_option("--deploy-h", s.deploy_h, "hours from one rolling update to the next; 0: none (24)")
      ->check(in_range(0, 1000));
  app.add_option("--deploy-share", s.deploy_share, "of the servers that an update replaces at a time (0.1)")
      ->check(in_range(0.001, 1));
  app.add_option("--servers", s.servers, "a fixed number of servers; 0: autoscaling (0)")->check(CLI::Range(0u, 4096u));
  app.add_option("--servers-min", s.servers_min, "with autoscaling (2)")->check(CLI::Range(1u, 4096u));
  app.add_option("--buffer", s.buffer, "share of the needed servers that run beside them (0.25)")
      ->check(in_range(0, 10));
  app.add_option("--start-s", s.start_s, "from the order of a server until it takes rooms (90)")
      ->check(in_range(0, 86'400));
  app.add_option("--scale-in-s", s.scale_in_s, "for which servers must be too many before some are stopped (600)")
      ->check(in_range(0, 86'400));
}

}  // namespace

std::variant<Options, int> parse_options(int argc, const char* const* argv) {
  Options o;
  for (int i = 0; i < argc; ++i) o.command += (i > 0 ? " " : "") + std::string(argv[i]);
  CLI::App app("Simulates some days of a fleet of servers: how many it needs, what moves, what limits it.",
               "hairnet-fleet-plan");
  app.footer(kFooter);
  app.get_formatter()->column_width(28);
  app.add_option("--seed", o.settings.seed, "of all that is random (1)");
  app.add_option("--json", o.json, "file for figures and curves");
  app.add_option("--page", o.page, "file for a page with plots");
  add_people(app, o.settings);
  add_servers(app, o.settings);
  // Each cost of a server has an option, a meaning and a source in one table (cost_figures), so that the options, the
  // page and the JSON file name the same ones.
  for (const CostFigure& cost : cost_figures()) {
    double& value = o.settings.costs.*cost.value;
    app.add_option(std::string(cost.flag), value,
                   std::string(cost.meaning) + " (" + CLI::detail::to_string(value) + (cost.unit.empty() ? "" : " ") +
                       std::string(cost.unit) + ")")
        ->check(in_range(0, 1e6))
        ->group("Costs");
  }
  const auto check = [&] {
    if (const std::string fault = validate(o.settings); !fault.empty()) throw CLI::ValidationError(fault);
  };
  if (const auto exit_status = parse_command_line(app, argc, argv, check)) return *exit_status;
  return o;
}

}  // namespace hairnet::fleet_plan
