#include "tests/bench/crowd_table.hpp"

#include <malloc.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <cstdio>

#include "tests/bench/crowd.hpp"
#include "tests/bench/cut_off_error.hpp"
#include "tests/bench/isa.hpp"
#include "tests/bench/step_runner.hpp"
#include "tests/bench/stopwatch.hpp"

namespace hairnet::bench {
namespace {

constexpr std::array kRates_hz{25.0, 60.0, 90.0};
// The search for as many of our iterations as reach the paper's error ends here.
constexpr int kIterationsMax = 64;
// Memory and caches are warm after this time, and the hair moves.
constexpr double kWarmUp_s = 1;
// The naive step takes so much longer that few characters are enough.
constexpr std::size_t kNaiveCharacters = 16;

// Builds only the two levels that are measured, since crowds do not change theirs.
std::shared_ptr<const LevelSet> build_both(const Groom& groom) {
  auto set = std::make_shared<LevelSet>();
  for (const LevelIndex index : {LevelIndex::high, LevelIndex::low}) {
    const auto i = static_cast<std::size_t>(index);
    set->levels[i] = *build_level(groom, kLevelSpecs[i]);
  }
  return set;
}

struct Run {
  // The shortest time of some ticks after the warm-up.
  double tick_s = 0;
  std::string hash;
};

Run run(const Subject& subject, const std::shared_ptr<const LevelSet>& levels, const CrowdSpec& spec, int repetitions,
        Report& report) {
  const auto warm_up = static_cast<int>(std::ceil(kWarmUp_s * spec.rate_hz));
  Crowd crowd(levels, subject.motions.front(), spec, (warm_up + repetitions) / spec.rate_hz);
  for (int tick = 0; tick < warm_up; ++tick) crowd.tick();
  Run result{crowd.tick(), {}};
  for (int tick = 1; tick < repetitions; ++tick) result.tick_s = std::min(result.tick_s, crowd.tick());
  if (crowd.resets() > 0 || crowd.stepped() != spec.count) {
    report.fail("a crowd of " + std::to_string(spec.count) + ": " + std::to_string(crowd.resets()) +
                " lattices were reset, " + std::to_string(crowd.stepped()) + " stepped in the last tick");
  }
  result.hash = crowd.hash();
  return result;
}

// The time that a step of one character takes in the paper's own way, in the same run and on the same machine.
double naive_step_s(const Subject& subject, const Level& level, double rate_hz, int iterations, int repetitions) {
  const Workload cast = make_workload(level, subject.motions.front(), {rate_hz, kNaiveCharacters, 1}, iterations);
  const auto naive = make_baseline(Baseline::naive, level, cast, {.iterations = kPaperIterations});
  std::vector<TimedRun> laps{{"naive", [&] { naive->rewind(); }, [&] { static_cast<void>(naive->perform()); }}};
  measure(laps, repetitions);
  return laps[0].seconds_min / static_cast<double>(cast.characters.size());
}

void measure_level(const Subject& subject, const Options& o, const std::shared_ptr<const LevelSet>& levels,
                   LevelIndex index, Report& report) {
  const Level& level = (*levels)[index];
  const std::string name(kLevelNames[static_cast<std::size_t>(index)]);
  const std::size_t count = index == LevelIndex::high ? o.crowd_high : o.crowd_low;
  const std::size_t threads = o.threads ? o.threads : thread_count();
  for (const double rate_hz : kRates_hz) {
    const int shipped = iterations_for(index, 1 / rate_hz / substep_count_for(1 / rate_hz));
    const double naive_s = naive_step_s(subject, level, rate_hz, shipped, o.repetitions);
    const CutOffError error(subject, level, rate_hz, 1, o.duration_s);
    const int equal = error.iterations_for(error.of_naive(kPaperIterations), kIterationsMax);
    // "as CG-16" has as many of our iterations as err no more than 16 of the naive step.
    struct Setting {
      const char* name;
      int substeps, iterations;
    };
    for (const Setting& s : {Setting{"shipped", substep_count_for(1 / rate_hz), shipped}, {"as CG-16", 1, equal}}) {
      CrowdSpec spec{index, count, rate_hz, s.substeps, s.iterations, 1};
      const Run one = run(subject, levels, spec, o.repetitions, report);
      spec.threads = threads;
      const Run all = threads > 1 ? run(subject, levels, spec, o.repetitions, report) : one;
      if (one.hash != all.hash) report.fail(name + " crowd: the number of threads changes the bits");
      const double characters = static_cast<double>(count) / rate_hz / one.tick_s;
      const double scaling = one.tick_s / all.tick_s;
      const double us = 1e6 * one.tick_s / static_cast<double>(count);
      std::printf("%-5s %6zu %4.0f Hz  %-9s %3d x %d %9.2f us %8.1f x naive %9.0f a core %9.0f on %zu (%.2f x)   %s\n",
                  name.c_str(), count, rate_hz, s.name, s.iterations, s.substeps, us, 1e6 * naive_s / us, characters,
                  characters * scaling, threads, scaling, one.hash.c_str());
      std::fflush(stdout);
      report.add({{"section", "crowd"},
                  {"level", name},
                  {"characters", count},
                  {"rate_hz", rate_hz},
                  {"variant", s.name},
                  {"iterations", s.iterations},
                  {"steps_per_frame", s.substeps},
                  {"us_per_frame", us},
                  {"times_naive", 1e6 * naive_s / us},
                  {"characters_per_core", characters},
                  {"crowd_threads", threads},
                  {"times_one_thread", scaling},
                  {"hash", one.hash}});
    }
  }
}

// The bytes of the heap, including mapped blocks and freed memory that is used again.
std::size_t heap_bytes() {
  const struct mallinfo2 info = mallinfo2();
  return info.uordblks + info.hblkhd;
}

void measure_memory(const Subject& subject, const std::shared_ptr<const LevelSet>& levels, LevelIndex index,
                    std::size_t count, Report& report) {
  const std::size_t before = heap_bytes();
  Crowd crowd(levels, subject.motions.front(), {index, count, kRates_hz[0], 0, 0, thread_count()}, 1);
  // The first ticks allocate what a crowd keeps; later ticks allocate nothing.
  for (int tick = 0; tick < 3; ++tick) crowd.tick();
  const double grown = static_cast<double>(heap_bytes()) - static_cast<double>(before);
  const std::size_t state = (*levels)[index].rest.size() * 2 * sizeof(Vec3f);
  const std::string name(kLevelNames[static_cast<std::size_t>(index)]);
  std::printf("memory: %zu %s characters: %.1f MB, %.0f bytes each, of which %zu are nodes\n", count, name.c_str(),
              grown / 1e6, grown / static_cast<double>(count), state);
  report.add({{"section", "memory"},
              {"level", name},
              {"characters", count},
              {"bytes_per_character", grown / static_cast<double>(count)},
              {"node_bytes_per_character", state}});
}

}  // namespace

void measure_crowds(const Subject& subject, const Options& options, Report& report) {
  std::printf(
      "\nDistinct characters through World::step: us of a character and tick on one thread, times the naive step,\n"
      "characters that a core keeps up with, and that all threads do.\n");
  const auto levels = build_both(subject.groom);
  measure_memory(subject, levels, LevelIndex::low, options.memory_low, report);
  measure_memory(subject, levels, LevelIndex::high, options.crowd_high, report);
  for (const LevelIndex index : {LevelIndex::high, LevelIndex::low}) {
    measure_level(subject, options, levels, index, report);
  }
}

}  // namespace hairnet::bench
