#include <algorithm>
#include <cstdio>
#include <memory>
#include <nlohmann/json.hpp>

#include "client/tools/command_line/progress_bar.hpp"
#include "tests/fidelity/motion_figures_measure.hpp"
#include "tests/fidelity/motion_figures_options.hpp"
#include "tests/fidelity/motion_figures_table.hpp"
#include "tests/fidelity/motion_sets.hpp"
#include "tests/fidelity/sections.hpp"
#include "tests/fidelity/write_json.hpp"

namespace hairnet::fidelity {
namespace {

// Our own motions into a posture have reached it after this time.
constexpr double kPosture_s = 4;

// Adds the runs to `all`, so that those before a refusal are not lost.
Result<void> measure(const MotionFigureFlags& flags, std::vector<MotionFigures>& all) {
  ProgressBar bar("hairnet-fidelity");
  const auto count = static_cast<double>(flags.grooms.size() * flags.motions.size());
  double done = 0;
  for (const std::string& groom_name : flags.grooms) {
    bar.show(done / count, "building " + groom_name);
    auto groom = load_groom(groom_name);
    if (!groom) return Refusal(groom.error());
    groom->name = groom_name;
    const Subject subject = make_subject(std::move(*groom), flags.levels);
    for (const std::string& motion_name : flags.motions) {
      const auto motion = load_motion(motion_name, subject.groom.body);
      if (!motion) return Refusal(motion.error());
      const bool hangs = std::ranges::find(kPostures, motion_name) != std::end(kPostures);
      // A motion into a posture is played once and stops there, so that the hair comes to rest in it. All other motions
      // are repeated.
      const Motion played = hangs ? stopped(*motion, kPosture_s, flags.duration_s) : looped(*motion, flags.duration_s);
      const Clip clip = make_clip(played, flags.rate_hz, flags.duration_s);
      const std::string stage = groom_name + ", " + motion_name;
      const auto show = [&](double part) { bar.show((done + part) / count, stage); };
      for (MotionFigures& run : measure_motion_figures(subject, clip, hangs, flags.measure, show))
        all.push_back(std::move(run));
      done += 1;
    }
  }
  return {};
}

int run(const MotionFigureFlags& flags) {
  std::vector<MotionFigures> all;
  const auto measured = measure(flags, all);
  if (!all.empty()) std::fputs(motion_figure_tables(all).c_str(), stdout);
  if (flags.picture) std::fputs(("\n" + picture_commands(all, flags.duration_s)).c_str(), stdout);
  const int written = write_json(flags.json, motion_figure_json(all));
  return measured ? written : fail(measured.error());
}

}  // namespace

void add_motion(CLI::App& program, std::function<int()>& chosen) {
  const auto flags = std::make_shared<MotionFigureFlags>();
  CLI::App& app = *program.add_subcommand(
      "motion", "What one sees go wrong with hair: in the body, drawn out, jumping, and not coming home.");
  add_motion_figure_flags(app, *flags);
  app.callback([flags, &chosen] {
    complete(*flags);
    chosen = [flags] { return run(*flags); };
  });
}

}  // namespace hairnet::fidelity
