#pragma once

#include <CLI/CLI.hpp>
#include <functional>
#include <optional>

namespace hairnet {

// Adds --version and parses a program's arguments. Then it calls `check`, which throws CLI::ValidationError for what
// CLI11 cannot check, such as relations between flags. Returns the exit status when the program must end at once: 0
// after --help and --version, 2 after a wrong argument, for which one line is on stderr. A misspelt flag or command
// gets the nearest right one. Otherwise it returns none, and all bound variables are filled.
std::optional<int> parse_command_line(
    CLI::App& app, int argc, const char* const* argv, const std::function<void()>& check = [] {});

}  // namespace hairnet
