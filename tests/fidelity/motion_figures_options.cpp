#include "tests/fidelity/motion_figures_options.hpp"

#include <algorithm>

#include "client/tools/command_line/in_range.hpp"
#include "client/tools/command_line/wind_flags.hpp"
#include "tests/fidelity/motion_sets.hpp"
#include "tests/support/corpus.hpp"

namespace hairnet::fidelity {
namespace {

constexpr std::string_view kFooter = R"(Examples:
  hairnet-fidelity motion
  hairnet-fidelity motion --set all --json motion.json
  hairnet-fidelity motion --groom made:bob --motion made:glide --motion made:lift --level low --rate 90
)";

// The hairstyles of a run without --groom: two real ones and one that this program makes.
const std::vector<std::string> kGrooms{"harolongo", "sintel", "made:long_straight"};

using Names = std::vector<std::string>;

Names motions_of(const std::string& set) {
  Names names;
  const auto add = [&](auto& motions) { names.insert(names.end(), std::begin(motions), std::end(motions)); };
  const bool all = set == "all";
  if (all || set == "everyday") add(kEverydayMotions);
  if (all || set == "wild") add(kWildMotions);
  if (all || set == "postures") add(kPostures);
  return names;
}

std::vector<LevelIndex> levels_of(const Names& names) {
  std::vector<LevelIndex> levels;
  for (const std::string& name : names) {
    const auto known = std::ranges::find(kLevelNames, name);
    // kLevelNames has more names than there are lattices: "learnt" and "rigid" hair has no level of its own to measure.
    if (known - kLevelNames.begin() >= static_cast<std::ptrdiff_t>(kLevelSpecs.size()))
      throw CLI::ValidationError("--level", "'" + name + "' is not one of high, medium, low, ether");
    levels.push_back(static_cast<LevelIndex>(known - kLevelNames.begin()));
  }
  return levels;
}

}  // namespace

void add_motion_figure_flags(CLI::App& app, MotionFigureFlags& flags) {
  app.footer(std::string(kFooter));
  const auto add_names = [&](const char* flag, Names& names, const char* about) {
    app.add_option(flag, names, about)->delimiter(',');
  };
  add_names("--groom", flags.grooms, "hairstyles, by commas (harolongo,sintel,made:long_straight)");
  add_names("--motion", flags.motions, "motions, by commas (those of --set)");
  app.add_option("--set", flags.set, "motions: everyday, wild, postures or all (everyday)")
      ->check(CLI::IsMember({"everyday", "wild", "postures", "all"}));
  add_names("--level", flags.level_names, "levels, by commas (high,low)");
  app.add_option("--rate", flags.rate_hz, "ticks a second (30)")->check(in_range(10.0, 240.0));
  app.add_option("--duration", flags.duration_s, "seconds of each motion, which loops (12)")
      ->check(in_range(0.5, 3600.0));
  app.add_option("--rest-after", flags.measure.rest_after_s,
                 "seconds upright and still before hair at rest is measured; 0: not at all (5)")
      ->check(in_range(0.0, 600.0));
  app.add_option("--points", flags.measure.point_count, "points of a hairstyle for depth and jumps, about (4000)")
      ->check(CLI::Range(100, 1'000'000));
  app.add_flag("--picture", flags.picture, "the commands that draw the worst ticks of made hair in made motions");
  app.add_option("--json", flags.json, "file for the figures");
  add_wind_flags(app, flags.wind);
}

void complete(MotionFigureFlags& flags) {
  if (!flags.level_names.empty()) flags.levels = levels_of(flags.level_names);
  if (const std::string error = validate(flags.wind); !error.empty()) throw CLI::ValidationError("wind", error);
  flags.measure.environment.wind = WindField(flags.wind);
  // The default sets leave out real data where it is absent. Names that the user has given stay.
  const auto is_real = [](const std::string& name) { return !name.starts_with("made:"); };
  if (flags.grooms.empty()) {
    flags.grooms = kGrooms;
    if (!has_real_data()) std::erase_if(flags.grooms, is_real);
  }
  if (flags.motions.empty()) {
    flags.motions = motions_of(flags.set);
    if (!has_real_data()) std::erase_if(flags.motions, is_real);
  }
}

}  // namespace hairnet::fidelity
