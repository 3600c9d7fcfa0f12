#include "client/tools/command_line/parse.hpp"

#include <cstdio>
#include <string>
#include <vector>

#include "core/closest_name.hpp"
#include "core/version.hpp"

namespace hairnet {
namespace {

// The words that would have been right, to compare a misspelt one with.
struct KnownWords {
  std::vector<std::string> flags, commands;
};

// Adds the words of the program and of the command that was given; option groups are commands without a name.
void add_known(const CLI::App& app, KnownWords& known) {
  for (const CLI::Option* option : app.get_options())
    known.flags.insert(known.flags.end(), option->get_lnames().begin(), option->get_lnames().end());
  for (const CLI::App* part : app.get_subcommands([](const CLI::App*) { return true; })) {
    if (part->get_name().empty() || part->parsed())
      add_known(*part, known);
    else if (app.get_subcommands().empty())
      // Commands are known only while none was given: a second one would be no help.
      known.commands.push_back(part->get_name());
  }
}

int refuse(const CLI::App& app, const std::string& error) {
  std::fprintf(stderr, "%s: %s\n", app.get_name().c_str(), error.c_str());
  return 2;
}

// CLI11 finds a misspelt flag last, after a missing one, and prints unexpected words in reverse: it would say that
// --out is missing where --ot was typed.
int refuse_unknown(const CLI::App& app, const CLI::ParseError& error) {
  const std::vector<std::string> unknown = app.remaining(true);
  if (unknown.empty()) return refuse(app, error.what());
  KnownWords known;
  add_known(app, known);
  return refuse(app, unexpected_argument(unknown, known.flags, known.commands));
}

}  // namespace

std::optional<int> parse_command_line(CLI::App& app, int argc, const char* const* argv,
                                      const std::function<void()>& check) {
  app.set_version_flag("--version", app.get_name() + " " + kVersionAndCommit, "show the version, and exit");
  try {
    app.parse(argc, argv);
    check();
    return std::nullopt;
  } catch (const CLI::Success& asked) {
    // Help and version are no errors: CLI11 prints them to stdout, with status 0.
    return app.exit(asked);
  } catch (const CLI::ExtrasError& error) {
    return refuse_unknown(app, error);
  } catch (const CLI::RequiredError& error) {
    // A required flag may be missing because it is misspelt.
    return refuse_unknown(app, error);
  } catch (const CLI::ParseError& error) {
    return refuse(app, error.what());
  }
}

}  // namespace hairnet
