#include "tests/bench/stopwatch.hpp"

#include <benchmark/benchmark.h>

#include <algorithm>
#include <array>
#include <chrono>
#include <limits>

namespace hairnet::bench {
namespace {

// Google Benchmark repeats a run until this much time has passed, and counts that as one repetition.
constexpr double kRepetition_s = 0.05;

// Discards the report of Google Benchmark, as the program prints its own tables.
class NoReport final : public benchmark::BenchmarkReporter {
 public:
  bool ReportContext(const Context&) override { return true; }
  void ReportRuns(const std::vector<Run>&) override {}
};

void run(benchmark::State& state, TimedRun& lap) {
  using Clock = std::chrono::steady_clock;
  for (auto _ : state) {
    lap.rewind();
    const Clock::time_point begin = Clock::now();
    lap.perform();
    const double seconds = std::chrono::duration<double>(Clock::now() - begin).count();
    state.SetIterationTime(seconds);
    lap.seconds_min = std::min(lap.seconds_min, seconds);
  }
}

void initialize_once() {
  static const bool once = [] {
    std::string program = "hairnet-bench", interleaved = "--benchmark_enable_random_interleaving=true";
    std::array<char*, 2> arguments{program.data(), interleaved.data()};
    int count = 2;
    benchmark::Initialize(&count, arguments.data());
    return true;
  }();
  static_cast<void>(once);
}

}  // namespace

void measure(std::vector<TimedRun>& laps, int repetitions) {
  initialize_once();
  for (TimedRun& lap : laps) {
    lap.seconds_min = std::numeric_limits<double>::infinity();
    benchmark::RegisterBenchmark(lap.name.c_str(), [&lap](benchmark::State& state) { run(state, lap); })
        ->UseManualTime()
        ->MinTime(kRepetition_s)
        ->Repetitions(repetitions);
  }
  NoReport quiet;
  benchmark::RunSpecifiedBenchmarks(&quiet, ".*");
  benchmark::ClearRegisteredBenchmarks();
}

}  // namespace hairnet::bench
