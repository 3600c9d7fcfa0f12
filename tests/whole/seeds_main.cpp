#include <fmt/format.h>
#include <spdlog/spdlog.h>
#include <unistd.h>

#include <CLI/CLI.hpp>
#include <algorithm>
#include <atomic>
#include <chrono>
#include <csignal>
#include <cstring>
#include <mutex>
#include <thread>
#include <vector>

#include "client/tools/command_line/parse.hpp"
#include "tests/whole/fleet_scenario.hpp"
#include "tests/whole/frame_gaps.hpp"
#include "tests/whole/refusals.hpp"
#include "tests/whole/scenario.hpp"

// Runs many seeds of tests/whole/scenario and prints which of them failed, and the counts of all events.
namespace {

using hairnet::whole::Outcome;

thread_local std::uint64_t current_seed = 0;

// Prints the seed of a crash, with functions that a signal handler may call.
void tell_seed(int signal) {
  char text[64] = "crashed in seed ";
  std::size_t length = std::strlen(text);
  char digits[20];
  std::size_t count = 0;
  for (std::uint64_t n = current_seed; n > 0 || count == 0; n /= 10) digits[count++] = static_cast<char>('0' + n % 10);
  while (count > 0) text[length++] = digits[--count];
  text[length++] = '\n';
  [[maybe_unused]] const auto written = ::write(STDERR_FILENO, text, length);
  std::signal(signal, SIG_DFL);
  std::raise(signal);
}

// In so many seeds every refusal of refusals.cpp must happen at least once.
constexpr std::uint64_t kSeedsWithAllRefusals = 500;

struct Options {
  std::uint64_t first = 1, count = 100;
  unsigned jobs = 1;
  // Every so many seeds one is run twice; both runs must have the same hash.
  unsigned twice_every = 20;
  bool is_verbose = false, quiet = false, is_fleet = false;
};

class Sweep {
 public:
  explicit Sweep(const Options& options) : options_(options) {}

  int run() {
    const auto begun = std::chrono::steady_clock::now();
    std::vector<std::thread> threads;
    for (unsigned j = 1; j < options_.jobs; ++j) threads.emplace_back([this] { work(); });
    work();
    for (std::thread& thread : threads) thread.join();
    const double wall_s = std::chrono::duration<double>(std::chrono::steady_clock::now() - begun).count();
    std::sort(failed_.begin(), failed_.end());
    if (!options_.quiet) {
      for (const auto& [event, n] : events_) fmt::print("{:>14} {}\n", n, event);
    }
    fmt::print("{} seeds from {}: {:.0f} simulated s in {:.1f} s, {} failed", options_.count, options_.first,
               simulated_s_, wall_s, failed_.size());
    for (std::size_t i = 0; i < std::min<std::size_t>(failed_.size(), 40); ++i) fmt::print(" {}", failed_[i]);
    fmt::print("\n");
    const bool must_have_all = !options_.is_fleet && options_.count >= kSeedsWithAllRefusals;
    const auto missing = must_have_all ? hairnet::whole::missing_refusals(events_) : std::vector<std::string>();
    for (const std::string& refusal : missing) fmt::print("never happened: {}\n", refusal);
    return failed_.empty() && missing.empty() ? 0 : 1;
  }

 private:
  void work() {
    for (std::uint64_t i = next_++; i < options_.count; i = next_++) {
      const std::uint64_t seed = options_.first + i;
      current_seed = seed;
      const auto run_seed = options_.is_fleet ? hairnet::whole::run_fleet_scenario : hairnet::whole::run_scenario;
      Outcome outcome = run_seed(seed, options_.is_verbose);
      if (options_.twice_every > 0 && seed % options_.twice_every == 0 && run_seed(seed, false).hash != outcome.hash)
        outcome.faults.push_back(fmt::format("seed {}: another outcome the second time", seed));
      take(seed, outcome);
    }
  }

  void take(std::uint64_t seed, const Outcome& outcome) {
    const std::lock_guard lock(mutex_);
    simulated_s_ += outcome.simulated_s;
    for (const auto& [event, n] : outcome.events) events_[event] += n;
    if (!outcome.faults.empty()) {
      failed_.push_back(seed);
      for (const std::string& fault : outcome.faults) fmt::print("{}\n", fault);
      std::fflush(stdout);
    }
    if (++done_ % 500 == 0) fmt::print(stderr, "{} of {} seeds, {} failed\n", done_, options_.count, failed_.size());
  }

  Options options_;
  std::atomic<std::uint64_t> next_{0};
  std::mutex mutex_;
  std::uint64_t done_ = 0;
  double simulated_s_ = 0;
  std::map<std::string, std::uint64_t> events_;
  std::vector<std::uint64_t> failed_;
};

struct GapsOptions {
  double loss_percent = 5, round_trip_ms = 60, seconds = 300, burst_ms = 0, kbit_per_s = 0;
  std::uint32_t characters = 10;
};

// A row for each transport: how long a viewer waits from frame to frame.
int print_gaps(const Options& options, const GapsOptions& line) {
  constexpr double kTick_ms = 1000.0 / 30;
  fmt::print("{} seeds of {} s, 30 Hz, {} characters at the finest level, {} % loss, {} ms round trip\n", options.count,
             line.seconds, line.characters, line.loss_percent, line.round_trip_ms);
  fmt::print("{:>12} {:>8} {:>8} {:>8} {:>8} {:>11} {:>9} {:>14} {:>11}\n", "gap, ticks", "p50", "p99", "p99.9", "max",
             "bytes/s", "coarser", "poses missing", "poses late");
  for (const bool has_datagrams : {true, false}) {
    hairnet::whole::GapsDef def;
    def.has_datagrams = has_datagrams;
    def.duration_s = line.seconds;
    def.characters = line.characters;
    def.path.loss = line.loss_percent / 100;
    // The delay of a path is that of one direction.
    def.path.delay_ns = static_cast<std::int64_t>(1e6 * line.round_trip_ms / 2);
    def.path.burst_ns = static_cast<std::int64_t>(1e6 * line.burst_ms);
    // A kilobit is 125 bytes. Zero leaves the path as fast as it is by default.
    if (line.kbit_per_s > 0) def.path.bytes_per_s = 125 * line.kbit_per_s;
    std::vector<float> all;
    double bytes_per_s = 0, coarser = 0, missing = 0, late = 0;
    for (std::uint64_t seed = options.first; seed < options.first + options.count; ++seed) {
      const hairnet::whole::Gaps gaps = hairnet::whole::measure_gaps(def, seed);
      all.insert(all.end(), gaps.ms.begin(), gaps.ms.end());
      bytes_per_s += gaps.frame_bytes_per_s / static_cast<double>(options.count);
      coarser += gaps.coarser_share / static_cast<double>(options.count);
      missing += gaps.poses_missing_share / static_cast<double>(options.count);
      late += gaps.poses_late_share / static_cast<double>(options.count);
    }
    if (all.empty()) {
      fmt::print("no frames came\n");
      return 1;
    }
    std::sort(all.begin(), all.end());
    // Returns the gap in ticks that this share of all gaps do not exceed.
    const auto at = [&](double share) {
      return all[static_cast<std::size_t>(share * static_cast<double>(all.size() - 1))] / kTick_ms;
    };
    fmt::print("{:>12} {:>8.1f} {:>8.1f} {:>8.1f} {:>8.1f} {:>11.0f} {:>8.0f}% {:>13.2f}% {:>10.1f}%\n",
               has_datagrams ? "WebTransport" : "TCP", at(0.5), at(0.99), at(0.999), at(1), bytes_per_s, 100 * coarser,
               100 * missing, 100 * late);
  }
  return 0;
}

}  // namespace

int main(int argc, char** argv) {
  Options options;
  CLI::App app("Runs the whole server and its clients under a simulated network, seed by seed.", "hairnet-whole-seeds");
  app.footer(
      "Examples:\n  hairnet-whole-seeds --first 1 --count 10000 --jobs 2\n  hairnet-whole-seeds --first 4711 --count 1 "
      "--verbose");
  app.add_option("--first", options.first, "the first seed");
  app.add_option("--count", options.count, "how many, one after the other");
  app.add_option("--jobs", options.jobs, "threads")->check(CLI::Range(1, 64));
  app.add_option("--twice-every", options.twice_every,
                 "of so many seeds one is run twice, for the same outcome; 0: none");
  app.add_flag("--verbose", options.is_verbose, "show what the scenario and the server do");
  app.add_flag("--quiet", options.quiet, "no list of events");
  app.add_flag("--fleet", options.is_fleet, "instead: a fleet of servers, and a simulated etcd");
  bool measures_gaps = false;
  GapsOptions line;
  app.add_flag("--gaps", measures_gaps,
               "instead: how long a viewer waits from frame to frame on a line that loses packets");
  app.add_option("--loss", line.loss_percent, "of that line, percent")->check(CLI::Range(0.0, 50.0));
  app.add_option("--burst-ms", line.burst_ms, "in which all get lost, on average; 0: each by itself");
  app.add_option("--round-trip-ms", line.round_trip_ms, "of that line");
  app.add_option("--kbit", line.kbit_per_s, "that line's rate; 0: as fast as may be");
  app.add_option("--characters", line.characters, "that the viewer sees")->check(CLI::Range(1u, 64u));
  app.add_option("--seconds", line.seconds, "for so long, simulated, with each of --count seeds");
  if (const auto exit_status = hairnet::parse_command_line(app, argc, argv)) return *exit_status;
  spdlog::set_level(options.is_verbose ? spdlog::level::debug : spdlog::level::off);
  for (const int signal : {SIGSEGV, SIGABRT, SIGFPE, SIGBUS, SIGILL}) std::signal(signal, tell_seed);
  return measures_gaps ? print_gaps(options, line) : Sweep(options).run();
}
