#include "tests/bench/accuracy_table.hpp"

#include <array>
#include <cstdio>

#include "tests/bench/cut_off_error.hpp"
#include "tests/bench/step_runner.hpp"
#include "tests/bench/stopwatch.hpp"

namespace hairnet::bench {
namespace {

// The iterations of conjugate gradient that a row compares lie around those that are shipped (kLevelIterations).
constexpr std::array kIterations{4, 6, 8, 12, 16, 24};
// These are factors of the material's stiffness.
constexpr std::array kStiffness{0.2f, 1.0f, 5.0f};
struct Rate {
  double hz;
  int substeps;
};
constexpr std::array<Rate, 4> kRates{{{25, 1}, {25, 2}, {60, 1}, {90, 1}}};
// A step costs the same at any rate, so that times are taken at one.
constexpr double kTimedRate_hz = 60;

// The time that a step of one character takes, in microseconds. Steps cost the same at any length and stiffness.
struct StepTimes {
  std::array<double, kIterations.size()> crowd{};
  double naive = 0;
};

StepTimes time_steps(const Subject& subject, const Level& level, LevelIndex index, const Options& o) {
  const int shipped = iterations_for(index, 1 / kTimedRate_hz);
  const Workload cast = make_workload(level, subject.motions.front(), {kTimedRate_hz, o.characters, 2}, shipped);
  std::vector<std::unique_ptr<StepRunner>> performers;
  std::vector<TimedRun> laps;
  for (const int iterations : kIterations) {
    performers.push_back(make_crowd(level, cast, {.iterations = iterations}));
    laps.push_back({"crowd " + std::to_string(iterations), [p = performers.back().get()] { p->rewind(); },
                    [p = performers.back().get()] { static_cast<void>(p->perform()); }});
  }
  performers.push_back(make_baseline(Baseline::naive, level, cast, {.iterations = kPaperIterations}));
  laps.push_back(
      {"naive", [&] { performers.back()->rewind(); }, [&] { static_cast<void>(performers.back()->perform()); }});
  measure(laps, o.repetitions);
  StepTimes times;
  const auto steps = static_cast<double>(cast.characters.size() * cast.frame_count);
  for (std::size_t i = 0; i < times.crowd.size(); ++i) times.crowd[i] = 1e6 * laps[i].seconds_min / steps;
  times.naive = 1e6 * laps.back().seconds_min / steps;
  return times;
}

void measure_level(const Subject& subject, const Options& o, LevelIndex index, Report& report) {
  const auto level = build_level(subject.groom, kLevelSpecs[static_cast<std::size_t>(index)]);
  const std::string name(kLevelNames[static_cast<std::size_t>(index)]);
  const StepTimes times = time_steps(subject, *level, index, o);
  std::printf("\n%-6s %9s %6s %6s", name.c_str(), "stiffness", "rate", "steps");
  for (const int iterations : kIterations) std::printf("   %6s%-2d", "CG-", iterations);
  std::printf("\n%-6s %23s", "", "us a step");
  for (const double us : times.crowd) std::printf("   %8.2f", us);
  std::printf("\n%-6s %23s", "", "times naive");
  for (const double us : times.crowd) std::printf("   %8.1f", times.naive / us);
  std::printf("\n");
  for (const float stiffness : kStiffness) {
    for (const Rate& rate : kRates) {
      const CutOffError error(subject, *level, rate.hz, rate.substeps, o.duration_s, stiffness);
      std::printf("%-6s %9g %6g %6d", "", static_cast<double>(stiffness), rate.hz, rate.substeps);
      for (std::size_t i = 0; i < kIterations.size(); ++i) {
        const double off = error.of_ours(kIterations[i]);
        std::printf("   %6.2f %%", 100 * off);
        report.add({{"section", "accuracy"},
                    {"level", name},
                    {"stiffness", stiffness},
                    {"rate_hz", rate.hz},
                    {"steps_per_frame", rate.substeps},
                    {"iterations", kIterations[i]},
                    {"error", off},
                    {"us_per_step", times.crowd[i]},
                    {"us_per_frame", rate.substeps * times.crowd[i]},
                    {"times_naive", times.naive / times.crowd[i]}});
      }
      std::printf("\n");
      std::fflush(stdout);
    }
  }
}

}  // namespace

void measure_accuracy(const Subject& subject, const Options& options, Report& report) {
  std::printf(
      "\nWhat iterations buy: error of the trajectory from the converged one of the same steps, over the RMS motion;\n"
      "and a step of one character in a crowd, beside the naive step of %d plain iterations.\n",
      kPaperIterations);
  for (const LevelIndex index : {LevelIndex::high, LevelIndex::low}) measure_level(subject, options, index, report);
}

}  // namespace hairnet::bench
