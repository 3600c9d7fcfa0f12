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

constexpr std::uint64_t kSeedsWithAllRefusals = 500;

struct Options {
  std::uint64_t first = 1, count = 100;
  unsigned jobs = 1;
  unsigned twice_every = 20;  // seeds that are run twice, for the same hash
  bool is_verbose = false, quiet = false;
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
    const bool must_have_all = options_.count >= kSeedsWithAllRefusals;
    const auto missing = must_have_all ? hairnet::whole::missing_refusals(events_) : std::vector<std::string>();
    for (const std::string& refusal : missing) fmt::print("never happened: {}\n", refusal);
    return failed_.empty() && missing.empty() ? 0 : 1;
  }

 private:
  void work() {
    for (std::uint64_t i = next_++; i < options_.count; i = next_++) {
      const std::uint64_t seed = options_.first + i;
      current_seed = seed;
      Outcome outcome = hairnet::whole::run_scenario(seed, options_.is_verbose);
      if (options_.twice_every > 0 && seed % options_.twice_every == 0 &&
          hairnet::whole::run_scenario(seed).hash != outcome.hash)
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
  CLI11_PARSE(app, argc, argv);
  spdlog::set_level(options.is_verbose ? spdlog::level::debug : spdlog::level::off);
  for (const int signal : {SIGSEGV, SIGABRT, SIGFPE, SIGBUS, SIGILL}) std::signal(signal, tell_seed);
  return Sweep(options).run();
}
