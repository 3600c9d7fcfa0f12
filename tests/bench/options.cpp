#include "tests/bench/options.hpp"

#include <CLI/CLI.hpp>
#include <algorithm>
#include <array>
#include <string_view>
#include <utility>

#include "client/tools/command_line/in_range.hpp"
#include "client/tools/command_line/parse.hpp"

namespace hairnet::bench {
namespace {

constexpr const char* kFooter = R"(Examples:
  hairnet-bench
  hairnet-bench --quick
  hairnet-bench --groom harolongo --motion dance_a,cmu_131_02,run --json bench.json --csv bench.csv
  hairnet-bench --section crowd --isa avx2 --threads 1
  valgrind --tool=callgrind --toggle-collect='*perform_steps*' hairnet-bench --callgrind high --kernel crowd
  valgrind --tool=callgrind --toggle-collect='*perform_steps*' --dump-after='hairnet::bench::perform_steps*' \
    --callgrind-out-file=touch.out hairnet-bench --callgrind touch --dumps touch.out --steps 30 --isa avx2
)";

constexpr std::array<std::pair<std::string_view, Section>, 5> kSections{{{"paper", Section::paper},
                                                                         {"ffd", Section::ffd},
                                                                         {"accuracy", Section::accuracy},
                                                                         {"crowd", Section::crowd},
                                                                         {"codec", Section::codec}}};

std::vector<Section> sections_of(const std::vector<std::string>& names) {
  std::vector<Section> sections;
  for (const std::string& name : names) {
    const auto known = std::ranges::find(kSections, name, &std::pair<std::string_view, Section>::first);
    if (known == kSections.end())
      throw CLI::ValidationError("--section", "'" + name + "' is not one of paper, ffd, accuracy, crowd, codec");
    sections.push_back(known->second);
  }
  return sections;
}

// Numbers so small that every row is computed once within seconds, as a test does (bench_finds_everything_right).
void make_quick(Options& o) {
  o.repetitions = 1;
  o.characters = 16;
  o.crowd_high = 32;
  o.crowd_low = 64;
  o.memory_low = 100;
  o.duration_s = 0.5;
  // Zero leaves out the naive and the fair solver at the error of the shipped one, for which iterations would be
  // searched.
  o.naive_iterations_max = 0;
  o.shipped_cells_only = true;
  o.motions.resize(1);
}

}  // namespace

std::variant<Options, int> parse_options(int argc, char** argv) {
  Options o;
  std::vector<std::string> sections;
  bool quick = false;
  CLI::App app("How fast a step is, beside the paper's own way in the same run, and whether it is still right.",
               "hairnet-bench");
  app.footer(kFooter);
  app.add_option("--groom", o.groom, "a hairstyle of the fidelity corpus (made:long_straight)");
  app.add_option("--motion", o.motions, "its motions, by commas; times are of the first")->delimiter(',');
  app.add_option("--section", sections, "paper, ffd, accuracy, crowd, codec, by commas (all)")->delimiter(',');
  app.add_option("--isa", o.isa, "instruction set of the kernels: best, avx3, avx2, sse4, scalar (best)");
  app.add_option("--threads", o.threads, "of the crowd beside one alone; 0 = all (0)")
      ->check(CLI::Range(std::size_t{0}, std::size_t{1024}));
  app.add_option("--repetitions", o.repetitions, "of each time; the least counts (7)")->check(CLI::Range(1, 1000));
  app.add_option("--characters", o.characters, "of the paper's table (64)")
      ->check(CLI::Range(std::size_t{1}, std::size_t{100'000}));
  app.add_option("--crowd-high", o.crowd_high, "characters of the high crowd (1024)")
      ->check(CLI::Range(std::size_t{1}, std::size_t{65'536}));
  app.add_option("--crowd-low", o.crowd_low, "characters of the low crowd (4096)")
      ->check(CLI::Range(std::size_t{1}, std::size_t{65'536}));
  app.add_option("--duration", o.duration_s, "seconds of each motion that errors are over (4)")
      ->check(in_range(0.5, 60.0));
  app.add_option("--json", o.json, "file for the rows");
  app.add_option("--csv", o.csv, "file for the rows");
  app.add_flag("--quick", quick, "few characters and repetitions: whether it is right, not how fast");
  app.add_option("--callgrind", o.callgrind,
                 "high or low: after set-up only a crowd's steps, to count instructions of; touch: those of a room of "
                 "20, without hands and with them")
      ->check(CLI::IsMember({"high", "low", "touch"}));
  app.add_option("--kernel", o.kernel, "of --callgrind high and low: crowd or single (crowd)")
      ->check(CLI::IsMember({"crowd", "single"}));
  app.add_option("--steps", o.callgrind_steps, "of --callgrind; ticks of touch (4)")->check(CLI::Range(1, 100'000));
  app.add_option("--dumps", o.dumps, "of --callgrind touch: valgrind's --callgrind-out-file, to print its counts");
  const auto take_sections = [&] {
    if (!sections.empty()) o.sections = sections_of(sections);
  };
  if (const auto exit_status = parse_command_line(app, argc, argv, take_sections)) return *exit_status;
  if (quick) make_quick(o);
  return o;
}

}  // namespace hairnet::bench
