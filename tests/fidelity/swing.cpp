// Measures how hair swings out, without contact, after the head was moved aside and stopped: frequency and decay, at
// every level and rate, with the full viscosity and with the solver's own damping subtracted, compared with the
// undecimated model in small steps.

#include <CLI/CLI.hpp>
#include <algorithm>
#include <cmath>
#include <cstdio>
#include <memory>
#include <nlohmann/json.hpp>
#include <numbers>
#include <optional>
#include <string>
#include <vector>

#include "core/ffd/deform.hpp"
#include "core/levels/build.hpp"
#include "core/world/world.hpp"
#include "tests/fidelity/sections.hpp"
#include "tests/fidelity/write_json.hpp"
#include "tests/support/corpus.hpp"

namespace {

using namespace hairnet;
using Json = nlohmann::ordered_json;

// The head moves by kPush_m within kPush_s; the hair is watched for kWatch_s from the beginning.
constexpr double kPush_m = 0.12, kPush_s = 0.25, kWatch_s = 3;
// The reference has the lattice of the high level with all springs and attachments.
constexpr LevelSpec kUndecimated{{10, 10, 10}, std::size_t(-1), std::size_t(-1)};

// The head moves aside from rest to a stop. The polynomial of the fifth degree has neither speed nor acceleration at
// both ends.
Pose pushed(double time_s) {
  const double t = std::clamp(time_s / kPush_s, 0.0, 1.0);
  return rigid_pose({Quat::Identity(), Vec3(kPush_m * t * t * t * (10 + t * (-15 + 6 * t)), 1.5, 0)});
}

// Adds to each viscosity the damping that an implicit step has by itself, the step times the stiffness.
// solver_damping() subtracts it again (core/solver/damping.hpp), so the viscosity of the level itself acts.
Level with_numerical_damping(Level level, double step_s) {
  const auto h = static_cast<float>(step_s);
  for (Stiffeners* s : {&level.springs, &level.attachments}) {
    for (std::size_t i = 0; i < s->count(); ++i) s->damping[i] += h * s->stiffness[i];
  }
  for (std::size_t i = 0; i < level.rest.size(); ++i) level.ether_damping[i] += h * level.ether_stiffness[i];
  return level;
}

// Mean displacement aside of the hair that swings most: points in the lower half of their strands.
class Tips {
 public:
  Tips(const Groom& groom, const Level& level) : level_(level), deformer_(deformer(groom, level)) {}

  double aside_m(const LatticeState& state) {
    grid_.resize(level_.geometry.lattice.node_count());
    expand_displacements(level_.geometry, state.displacement, grid_);
    moved_.resize(rest_.size());
    deformer_->deform(grid_, moved_);
    double sum = 0;
    for (std::size_t i = 0; i < rest_.size(); ++i) sum += static_cast<double>(moved_[i].x() - rest_[i].x());
    return sum / static_cast<double>(rest_.size());
  }

 private:
  std::optional<Deformer> deformer(const Groom& groom, const Level& level) {
    // A mean over so many points is precise enough, and all points of a hairstyle would take much longer.
    constexpr std::size_t kPoints = 3000;
    const std::size_t stride = std::max<std::size_t>(1, groom.points.size() / 2 / kPoints);
    std::size_t count = 0;
    for (std::size_t s = 0; s < groom.strand_count(); ++s) {
      const auto points = groom.strand_points(s);
      for (std::size_t p = points.size() / 2; p < points.size(); ++p) {
        if (count++ % stride == 0) rest_.push_back(points[p]);
      }
    }
    return Deformer(level.geometry.lattice, rest_, {}, FfdKind::quadratic);
  }

  const Level& level_;
  std::vector<Vec3f> rest_, grid_, moved_;
  std::optional<Deformer> deformer_;
};

struct Swing {
  double frequency_hz = 0, damping_ratio = 0;
};

// Returns the frequency and the damping of the hair's swing, from samples that are `interval_s` apart. It uses the
// first extremum after the head has stopped and the one after it; a parabola through three samples gives the time and
// value of each.
Swing measured(const std::vector<double>& aside_m, double interval_s) {
  struct Extremum {
    double time_s, value_m;
  };
  std::vector<Extremum> extrema;
  for (std::size_t i = 1; i + 1 < aside_m.size() && extrema.size() < 2; ++i) {
    const double a = aside_m[i - 1], b = aside_m[i], c = aside_m[i + 1];
    // Only samples after the push count, where the slope changes its sign.
    if (static_cast<double>(i) * interval_s <= kPush_s || (b - a) * (c - b) > 0) continue;
    const double curve = a - 2 * b + c, shift = curve == 0 ? 0 : 0.5 * (a - c) / curve;
    extrema.push_back({(static_cast<double>(i) + shift) * interval_s, b - 0.25 * (a - c) * shift});
  }
  // Hair that does not swing to the other side has no frequency: the result is 0.
  if (extrema.size() < 2 || extrema[0].value_m * extrema[1].value_m >= 0) return {};
  // Both extrema are half a period apart. For a damping ratio zeta the second is -exp(-pi zeta / sqrt(1 - zeta^2))
  // times the first.
  const double half_s = extrema[1].time_s - extrema[0].time_s;
  const double decrement = std::log(-extrema[0].value_m / extrema[1].value_m) / std::numbers::pi;
  return {0.5 / half_s, decrement / std::sqrt(1 + decrement * decrement)};
}

// Moves the head and measures the swing. `as_asked` keeps the full viscosity (with_numerical_damping); without it the
// solver's own damping is subtracted from it.
Swing swing(const Groom& groom, const Level& level, double rate_hz, int substeps, int iterations, bool as_asked) {
  const double step_s = 1 / (rate_hz * substeps);
  Level run_level = as_asked ? with_numerical_damping(level, step_s) : level;
  // Hair that strikes the neck has no swing to measure.
  run_level.contacts = {};
  Tips tips(groom, run_level);
  LatticeState state;
  reset_to_rest(run_level, state);
  StepScratch scratch;
  std::vector<double> aside_m{0};
  const int ticks = static_cast<int>(kWatch_s * rate_hz);
  for (int tick = 0; tick < ticks; ++tick) {
    const Pose start = pushed(tick / rate_hz), end = pushed((tick + 1) / rate_hz);
    for (int s = 0; s < substeps; ++s) {
      StepInput input;
      input.from = interpolate(start, end, static_cast<double>(s) / substeps);
      input.to = interpolate(start, end, (s + 1.0) / substeps);
      input.step_s = step_s;
      if (!step(run_level, input, {.iterations = iterations}, scratch, state)) return {};
    }
    aside_m.push_back(tips.aside_m(state));
  }
  return measured(aside_m, 1 / rate_hz);
}

struct Options {
  std::vector<std::string> grooms;
  std::string json;
};

// Prints a row with its difference from `truth`, the undecimated model.
void add_row(Json& rows, const std::string& groom, const std::string& what, double rate_hz, int substeps,
             const Swing& s, const Swing& truth) {
  std::printf("%-18s %-24s %3.0f Hz x %d   %5.2f Hz %+5.0f %%   zeta %.3f %+.3f\n", groom.c_str(), what.c_str(),
              rate_hz, substeps, s.frequency_hz, 100 * (s.frequency_hz / truth.frequency_hz - 1), s.damping_ratio,
              s.damping_ratio - truth.damping_ratio);
  std::fflush(stdout);
  rows.push_back({{"groom", groom},
                  {"model", what},
                  {"rate_hz", rate_hz},
                  {"substeps", substeps},
                  {"frequency_hz", s.frequency_hz},
                  {"damping_ratio", s.damping_ratio}});
}

int run(const Options& options) {
  Json rows = Json::array();
  for (const std::string& name : options.grooms) {
    const Result<Groom> groom = fidelity::load_groom(name, 4000);
    if (!groom) return fidelity::fail(groom.error());
    const auto full = build_level(*groom, kUndecimated);
    // Four substeps at 100 Hz are steps of 1/400 s. 200 iterations are many times those of the levels as shipped.
    const Swing truth = swing(*groom, *full, 100, 4, 200, false);
    add_row(rows, name, "undecimated", 100, 4, truth, truth);
    for (std::size_t i = 0; i < kLevelSpecs.size(); ++i) {
      const auto level = build_level(*groom, kLevelSpecs[i]);
      const std::string level_name(kLevelNames[i]);
      add_row(rows, name, level_name + " small steps", 100, 4, swing(*groom, *level, 100, 4, 200, false), truth);
      for (const double rate_hz : {25.0, 30.0, 60.0, 90.0}) {
        const int substeps = substep_count_for(1 / rate_hz);
        const int iterations = iterations_for(static_cast<LevelIndex>(i), 1 / rate_hz / substeps);
        add_row(rows, name, level_name + " as asked", rate_hz, 1, swing(*groom, *level, rate_hz, 1, iterations, true),
                truth);
        add_row(rows, name, level_name, rate_hz, substeps, swing(*groom, *level, rate_hz, substeps, iterations, false),
                truth);
      }
    }
  }
  return fidelity::write_json(options.json, rows);
}

}  // namespace

void hairnet::fidelity::add_swing(CLI::App& program, std::function<int()>& chosen) {
  CLI::App& app = *program.add_subcommand("swing", "Frequency and decay of hair that swings, at every level and rate.");
  app.footer(
      "Examples:\n  hairnet-fidelity swing\n  hairnet-fidelity swing --groom yuksel made:bob --json swing.json\n");
  const auto kept = std::make_shared<Options>(Options{{"yuksel", "harolongo", "sintel", "made:long_straight"}, {}});
  Options& options = *kept;
  app.add_option("--groom", options.grooms, "hairstyles of the corpus");
  app.add_option("--json", options.json, "the rows as JSON");
  app.callback([kept, &chosen] { chosen = [kept] { return run(*kept); }; });
}
