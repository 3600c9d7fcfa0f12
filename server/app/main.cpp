#include <string_view>

#include "core/broken_pipe.hpp"
#include "server/app/config.hpp"
#include "server/app/program.hpp"
#include "server/grooms/level_build.hpp"

int main(int argc, char** argv) {
  hairnet::ignore_broken_pipes();
  if (argc == 2 && std::string_view(argv[1]) == hairnet::server::kLevelBuildFlag)
    return hairnet::server::run_level_build_process();
  const hairnet::server::ParsedConfig parsed = hairnet::server::parse_config(argc, argv);
  if (parsed.exit_code >= 0) return parsed.exit_code;
  return hairnet::server::run_program(parsed.config, parsed.check_only);
}
