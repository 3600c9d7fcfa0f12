#include "client/tools/command_line/parse.hpp"
#include "client/tools/command_line/run_program.hpp"
#include "tests/fidelity/sections.hpp"

int main(int argc, char** argv) {
  using namespace hairnet::fidelity;
  CLI::App app("How close hair comes to the truth, and what goes wrong with it, section by section.",
               "hairnet-fidelity");
  app.footer(
      "A hairstyle is one of the tables' (yuksel, ponytail, harolongo, sintel), made:NAME, or a file; a motion is one "
      "of\n"
      "the tables', made:NAME, or a .bvh file.\n\n"
      "Examples:\n  hairnet-fidelity motion\n  hairnet-fidelity levels --groom made:bob --motion made:dance\n"
      "  hairnet-fidelity modes --groom mine.groom --motion mine.bvh --json mine.json\n"
      "  hairnet-fidelity decimation --help\n");
  app.require_subcommand(1);
  std::function<int()> chosen;
  for (const auto add : {add_motion, add_decimation, add_levels, add_solver, add_stride, add_swing, add_robustness,
                         add_modes, add_learnt, add_playout})
    add(app, chosen);
  if (const auto exit_status = hairnet::parse_command_line(app, argc, argv)) return *exit_status;
  return hairnet::run_program("hairnet-fidelity", chosen);
}
