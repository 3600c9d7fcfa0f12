#include <cstdio>
#include <string>

#include "client/tools/command_line/run_program.hpp"
#include "client/tools/sim/options.hpp"
#include "client/tools/sim/replay.hpp"
#include "client/tools/sim/simulate.hpp"

namespace {

hairnet::Result<void> run(const hairnet::sim::SimulateOptions& options) {
  return hairnet::sim::simulate(options);
}
hairnet::Result<void> run(const hairnet::sim::ReplayOptions& options) {
  return hairnet::sim::replay(options);
}

}  // namespace

// Either a clip is simulated, or a recording is replayed: the options say which.
int main(int argc, char** argv) {
  return hairnet::run_program("hairnet-sim", [&] {
    const auto parsed = hairnet::sim::parse_options(argc, argv);
    if (const int* exit_code = std::get_if<int>(&parsed)) return *exit_code;
    const hairnet::Result<void> done =
        std::visit([](const auto& options) { return run(options); }, std::get<hairnet::sim::Options>(parsed));
    if (!done) std::fprintf(stderr, "hairnet-sim: %s\n", done.error().c_str());
    return done ? 0 : 1;
  });
}
