// Measures what it costs to stop conjugate gradient early: the distance from the trajectory of the same steps solved to
// convergence, over the motion itself, beside the time of a tick. It also measures how far steps of a length lie from
// small ones.

#include <CLI/CLI.hpp>
#include <algorithm>
#include <cstdio>
#include <map>
#include <memory>
#include <nlohmann/json.hpp>
#include <string>
#include <tuple>
#include <vector>

#include "core/levels/build.hpp"
#include "core/solver/step.hpp"
#include "tests/fidelity/cut_off.hpp"
#include "tests/fidelity/sections.hpp"
#include "tests/fidelity/write_json.hpp"
#include "tests/support/corpus.hpp"

namespace {

using namespace hairnet;
using fidelity::integrate;
using fidelity::kConverged;
using fidelity::NodeTrajectory;
using fidelity::relative_error;
using Json = nlohmann::ordered_json;

// The reference has steps of this length: a quarter of a tick at 90 Hz, the highest of the rates.
constexpr double kSmall_s = 1.0 / 360;

struct Options {
  std::vector<std::string> grooms{"yuksel", "harolongo", "ponytail", "sintel"};
  std::vector<std::string> motions{"dance_a", "cmu_131_02", "run"};
  std::vector<std::string> levels{"high", "low"};
  std::vector<double> rates_hz{25, 30, 60, 90};
  std::vector<int> substeps{1, 2};
  std::vector<int> iterations{4, 6, 8, 12, 16, 24};
  std::vector<double> stiffness{1};
  double duration_s = 3;
  std::string json;
};

struct Sum {
  // Sums over the cases of one row: the error against the converged steps of the same length, the greatest one, the
  // error against small steps, and the microseconds of a tick.
  double error = 0, most = 0, small_error = 0, us = 0;
  int count = 0;
  void add(double e, double small, double tick_us) {
    error += e;
    most = std::max(most, e);
    small_error += small;
    us += tick_us;
    ++count;
  }
};
// The parts of a key are level, stiffness, rate, substeps and iterations.
using Key = std::tuple<std::string, double, double, int, int>;

void compare(const Options& o, const std::string& level_name, const Level& level, const Motion& motion,
             double stiffness, std::map<Key, Sum>& sums) {
  const auto k = static_cast<float>(stiffness);
  // The braces have the rate in Hz, the steps of a tick, and the iterations of a step.
  const NodeTrajectory small = integrate(level, motion, {1 / kSmall_s, 1, kConverged}, k, o.duration_s);
  for (const double rate_hz : o.rates_hz) {
    for (const int substeps : o.substeps) {
      const NodeTrajectory truth = integrate(level, motion, {rate_hz, substeps, kConverged}, k, o.duration_s);
      sums[{level_name, stiffness, rate_hz, substeps, kConverged}].add(0, relative_error(level, truth, small),
                                                                       truth.tick_us);
      for (const int iterations : o.iterations) {
        const NodeTrajectory cut = integrate(level, motion, {rate_hz, substeps, iterations}, k, o.duration_s);
        sums[{level_name, stiffness, rate_hz, substeps, iterations}].add(
            relative_error(level, cut, truth), relative_error(level, cut, small), cut.tick_us);
      }
    }
  }
}

void print(const std::map<Key, Sum>& sums) {
  std::printf("\n%-7s %9s %6s %9s %11s %22s %20s %9s\n", "level", "stiffness", "rate", "substeps", "iterations",
              "from converged (worst)", "from small steps", "us/tick");
  for (const auto& [key, sum] : sums) {
    const auto& [level, stiffness, rate_hz, substeps, iterations] = key;
    const auto index = std::find(kLevelNames.begin(), kLevelNames.end(), level) - kLevelNames.begin();
    const bool is_default = substeps == substep_count_for(1 / rate_hz) &&
                            iterations == iterations_for(static_cast<LevelIndex>(index), 1 / rate_hz / substeps);
    std::printf("%-7s %9g %6g %9d %11s %14.1f %% (%3.0f) %18.1f %% %9.0f%s\n", level.c_str(), stiffness, rate_hz,
                substeps, iterations == kConverged ? "converged" : std::to_string(iterations).c_str(),
                100 * sum.error / sum.count, 100 * sum.most, 100 * sum.small_error / sum.count, sum.us / sum.count,
                is_default ? "  <- default" : "");
  }
}

Json json_of(const std::map<Key, Sum>& sums) {
  Json rows = Json::array();
  for (const auto& [key, sum] : sums) {
    const auto& [level, stiffness, rate_hz, substeps, iterations] = key;
    rows.push_back({{"level", level},
                    {"stiffness", stiffness},
                    {"rate_hz", rate_hz},
                    {"substeps", substeps},
                    {"iterations", iterations},
                    {"error", sum.error / sum.count},
                    {"error_max", sum.most},
                    {"error_from_small_steps", sum.small_error / sum.count},
                    {"us_per_tick", sum.us / sum.count}});
  }
  return rows;
}

int run(const Options& o) {
  std::map<Key, Sum> sums;
  for (const std::string& groom_name : o.grooms) {
    // Made hairstyles get 4000 strands. Real ones have those of their files.
    const Result<Groom> groom = fidelity::load_groom(groom_name, 4000);
    if (!groom) return fidelity::fail(groom.error());
    for (const std::string& level_name : o.levels) {
      const auto index =
          static_cast<std::size_t>(std::find(kLevelNames.begin(), kLevelNames.end(), level_name) - kLevelNames.begin());
      if (index >= kLevelSpecs.size()) return fidelity::fail(level_name + ": no such level");
      const auto level = build_level(*groom, kLevelSpecs[index]);
      for (const std::string& motion_name : o.motions) {
        const Result<Motion> motion = fidelity::load_motion(motion_name, groom->body);
        if (!motion) return fidelity::fail(motion.error());
        for (const double stiffness : o.stiffness) {
          std::fprintf(stderr, "%s %s %s stiffness %g\n", groom_name.c_str(), level_name.c_str(), motion_name.c_str(),
                       stiffness);
          compare(o, level_name, *level, *motion, stiffness, sums);
        }
      }
    }
  }
  print(sums);
  return fidelity::write_json(o.json, json_of(sums));
}

}  // namespace

void hairnet::fidelity::add_solver(CLI::App& program, std::function<int()>& chosen) {
  CLI::App& app = *program.add_subcommand("solver", "Trajectory error of cut-off conjugate gradient beside its time.");
  app.footer(
      "Examples:\n  hairnet-fidelity solver\n"
      "  hairnet-fidelity solver --groom made:bob --motion made:dance --level low --stiffness 0.2 1 5\n");
  const auto kept = std::make_shared<Options>();
  Options& o = *kept;
  app.add_option("--groom", o.grooms, "hairstyles of the corpus");
  app.add_option("--motion", o.motions, "motions of the corpus");
  app.add_option("--level", o.levels, "high, medium, low");
  app.add_option("--rate", o.rates_hz, "ticks a second")->check(CLI::Range(1.0, 1000.0));
  app.add_option("--substeps", o.substeps, "steps a tick")->check(CLI::Range(1, 100));
  app.add_option("--iterations", o.iterations, "of conjugate gradient")->check(CLI::Range(1, 1000));
  app.add_option("--stiffness", o.stiffness, "times the default material's")->check(CLI::Range(0.01, 100.0));
  app.add_option("--duration", o.duration_s, "seconds of each motion")->check(CLI::Range(0.5, 60.0));
  app.add_option("--json", o.json, "the rows as JSON");
  app.callback([kept, &chosen] { chosen = [kept] { return run(*kept); }; });
}
