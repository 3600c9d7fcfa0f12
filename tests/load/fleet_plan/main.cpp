#include <fmt/format.h>

#include <cstdio>
#include <span>

#include "client/files/write_file.hpp"
#include "client/tools/command_line/run_program.hpp"
#include "tests/load/fleet_plan/options.hpp"
#include "tests/load/fleet_plan/report.hpp"
#include "tests/load/fleet_plan/simulation.hpp"

namespace hairnet::fleet_plan {
namespace {

int fail(const std::string& error) {
  std::fputs(fmt::format("hairnet-fleet-plan: {}\n", error).c_str(), stderr);
  return 1;
}

int perform(const Options& options) {
  if (const auto possible = check_can_write({options.json, options.page}); !possible) return fail(possible.error());
  const Outcome outcome = simulate(options.settings);
  std::fputs(to_text(options.settings, outcome).c_str(), stdout);
  const auto write = [](const std::string& path, const std::string& text) {
    return path.empty() ? Result<void>() : write_file(path, std::as_bytes(std::span(text)));
  };
  if (const auto done = write(options.json, to_json_text(options.settings, outcome, options.command)); !done)
    return fail(options.json + ": " + done.error());
  if (const auto done = write(options.page, to_page(options.settings, outcome, options.command)); !done)
    return fail(options.page + ": " + done.error());
  return 0;
}

}  // namespace
}  // namespace hairnet::fleet_plan

int main(int argc, char** argv) {
  return hairnet::run_program("hairnet-fleet-plan", [&] {
    const auto parsed = hairnet::fleet_plan::parse_options(argc, argv);
    if (const int* exit_status = std::get_if<int>(&parsed)) return *exit_status;
    return hairnet::fleet_plan::perform(std::get<hairnet::fleet_plan::Options>(parsed));
  });
}
