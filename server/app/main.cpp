#include <fmt/format.h>

#include "server/app/config.hpp"
#include "server/app/program.hpp"

int main(int argc, char** argv) {
  const hairnet::server::ParsedConfig parsed = hairnet::server::parse_config(argc, argv);
  if (parsed.exit_code >= 0) return parsed.exit_code;
  if (parsed.check_only) {
    fmt::print("# configuration is sound: {}:{}, {}\n{}", parsed.config.bind, parsed.config.port,
               summary(parsed.config), to_text(parsed.config));
    return 0;
  }
  return hairnet::server::run_program(parsed.config);
}
