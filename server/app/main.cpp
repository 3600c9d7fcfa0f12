#include <fmt/format.h>

#include <string_view>

#include "server/app/config.hpp"
#include "server/app/program.hpp"
#include "server/grooms/level_build.hpp"

int main(int argc, char** argv) {
  if (argc == 2 && std::string_view(argv[1]) == hairnet::server::kLevelBuildFlag)
    return hairnet::server::run_level_build_process();
  const hairnet::server::ParsedConfig parsed = hairnet::server::parse_config(argc, argv);
  if (parsed.exit_code >= 0) return parsed.exit_code;
  if (parsed.check_only) {
    fmt::print("# configuration is sound: {}:{}, {}\n{}", parsed.config.bind, parsed.config.port,
               summary(parsed.config), to_text(parsed.config));
    return 0;
  }
  return hairnet::server::run_program(parsed.config);
}
