#include <fmt/format.h>
#include <spdlog/spdlog.h>
#include <unistd.h>

#include <CLI/CLI.hpp>
#include <filesystem>
#include <string>
#include <vector>

#include "client/tools/command_line/parse.hpp"
#include "tests/whole/fleet_chaos/chaos.hpp"

namespace {

// ctest skips a test with this exit code.
constexpr int kCannotRun = 77;

}  // namespace

int main(int argc, char** argv) {
  using hairnet::whole::kActionNames;
  hairnet::whole::ChaosOptions options;
  double minutes = 30;
  CLI::App app(
      "Runs four hairnet-servers and three etcds in network namespaces, with clients in rooms, and kills, stops, "
      "drains and "
      "cuts them off by a seeded schedule. Exit code 1: something failed; 77: this machine cannot run it. Needs root.",
      "hairnet-fleet-chaos");
  app.footer(
      "Examples:\n  hairnet-fleet-chaos --minutes 30 --seed 1\n  hairnet-fleet-chaos --minutes 1 --actions kill drain "
      "--without-etcd stop\n  hairnet-fleet-chaos --minutes 5 --actions etcd-down --without-etcd go_on --outage 40\n"
      "  hairnet-fleet-chaos --minutes 1 --actions cut --without-etcd go_on     fails: this gives rooms two owners");
  app.add_option("--minutes", minutes, "how long; the last action is finished")->check(CLI::Range(0.1, 1440.0));
  app.add_option("--seed", options.seed, "of the schedule");
  app.add_option("--rooms", options.room_count, "that clients are in")->check(CLI::Range(1, 64));
  app.add_option("--clients", options.client_count,
                 "sessions; the third one of each room comes and goes, every eighth watches")
      ->check(CLI::Range(2, 200));
  app.add_option("--actions", options.actions, "which ones, each in turn in an order by the seed")
      ->check(CLI::IsMember(std::vector<std::string>(kActionNames.begin(), kActionNames.end())));
  app.add_option("--without-etcd", options.without_etcd,
                 "of the servers; both: stop for the first half of the time, then go_on, where no server is cut off")
      ->check(CLI::IsMember({"stop", "go_on", "both"}));
  app.add_option("--lease", options.lease_s, "seconds, of each server at etcd; below 5 only with --without-etcd stop")
      ->check(CLI::Range(2, 60));
  app.add_option("--outage", options.outage_s, "seconds for which etcd-down lasts")->check(CLI::Range(1.0, 600.0));
  app.add_option("--gap-limit", options.gap_limit_s,
                 "seconds between frames of a client in a drained move, or while one etcd is away");
  app.add_option("--owner-limit", options.owner_limit_s, "seconds until a killed server's room has an owner");
  app.add_option("--claim-limit", options.claim_limit_s, "seconds until a new room has an owner, after etcd's return");
  app.add_option("--folder", options.folder, "for logs and data, kept; else a temporary one, kept after a failure");
  if (const auto exit_status = hairnet::parse_command_line(app, argc, argv)) return *exit_status;
  options.duration_s = 60 * minutes;
  spdlog::set_level(spdlog::level::off);

  const bool is_temporary = options.folder.empty();
  if (is_temporary)
    options.folder = std::filesystem::temp_directory_path() / fmt::format("hairnet-fleet-chaos-{}", ::getpid());
  std::filesystem::create_directories(options.folder);
  bool is_well = false;
  {
    hairnet::whole::Chaos chaos(options);
    if (std::string error; !chaos.start(error)) {
      fmt::print(stderr, "hairnet-fleet-chaos: NOT TESTED: {}\n", error);
      if (is_temporary) std::filesystem::remove_all(options.folder);
      return kCannotRun;
    }
    is_well = chaos.run();
  }
  if (is_temporary && is_well)
    std::filesystem::remove_all(options.folder);
  else
    fmt::print("logs of servers and etcds: {}\n", options.folder);
  return is_well ? 0 : 1;
}
