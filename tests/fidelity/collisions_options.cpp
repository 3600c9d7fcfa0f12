#include "tests/fidelity/collisions_options.hpp"

#include <CLI/CLI.hpp>
#include <algorithm>

#include "client/tools/flags/in_range.hpp"
#include "tests/fidelity/corpus.hpp"

namespace hairnet::fidelity {
namespace {

constexpr std::string_view kFooter = R"(Examples:
  hairnet-fidelity-collisions
  hairnet-fidelity-collisions --quick
  hairnet-fidelity-collisions --groom harolongo,sintel --motion spinkick --level low --json depths.json
)";

// Those with shoulders below the hair.
const std::vector<std::string> kGrooms{"ponytail",        "harolongo", "sintel",       "made:long_straight",
                                       "made:long_curly", "made:bob",  "made:ponytail"};
const std::vector<std::string> kMadeMotions{"made:nod", "made:shake", "made:look_around", "made:walk",
                                            "made:run", "made:jump",  "made:dance"};
const std::vector<std::string> kQuickMotions{"spinkick", "made:look_around", "made:dance"};
constexpr double kQuick_s = 2;

bool is_real(const std::string& name) {
  return !name.starts_with("made:");
}

CLI::Option* add_names(CLI::App& app, const char* flag, std::vector<std::string>& names, const char* about) {
  return app.add_option(flag, names, about)->delimiter(',');
}

std::vector<LevelIndex> levels_of(const std::vector<std::string>& names) {
  std::vector<LevelIndex> levels;
  for (const std::string& name : names) {
    const auto known = std::ranges::find(kLevelNames, name);
    if (known == kLevelNames.end() || name == "rigid")
      throw CLI::ValidationError("--level", "'" + name + "' is not one of high, medium, low, ether");
    levels.push_back(static_cast<LevelIndex>(known - kLevelNames.begin()));
  }
  return levels;
}

}  // namespace

std::variant<CollisionsOptions, int> parse_collisions_options(int argc, char** argv) {
  CollisionsOptions options;
  std::vector<std::string> levels;
  bool quick = false;
  CLI::App app("How much hair lies in the body, with metaballs and without.", "hairnet-fidelity-collisions");
  app.footer(std::string(kFooter));
  app.failure_message([](const CLI::App* a, const CLI::Error& e) { return a->get_name() + ": " + e.what() + "\n"; });
  add_names(app, "--groom", options.grooms, "hairstyles, by commas (all with shoulders)");
  add_names(app, "--motion", options.motions, "motions, by commas (all)");
  add_names(app, "--level", levels, "levels, by commas (high,low)");
  app.add_option("--duration", options.duration_s, "seconds of each motion, at most (6)")->check(in_range(0.1, 3600.0));
  app.add_option("--json", options.json, "file for the figures");
  app.add_flag("--quick", quick, "two hairstyles, three motions, two seconds");
  try {
    app.parse(argc, argv);
    if (!levels.empty()) options.levels = levels_of(levels);
  } catch (const CLI::ParseError& e) {
    return app.exit(e) == 0 ? 0 : 2;
  }
  if (quick) options.duration_s = std::min(options.duration_s, kQuick_s);
  if (options.grooms.empty()) {
    options.grooms = quick ? std::vector<std::string>{"harolongo", "made:long_straight"} : kGrooms;
    if (!has_real_data()) std::erase_if(options.grooms, is_real);
  }
  if (options.motions.empty()) {
    options.motions = kQuickMotions;
    if (!quick) {
      options.motions.assign(std::begin(kRealMotions), std::end(kRealMotions));
      options.motions.insert(options.motions.end(), kMadeMotions.begin(), kMadeMotions.end());
    }
    if (!has_real_data()) std::erase_if(options.motions, is_real);
  }
  return options;
}

}  // namespace hairnet::fidelity
