#include <CLI/CLI.hpp>
#include <cstdio>
#include <memory>
#include <span>
#include <string>
#include <vector>

#include "client/files/write_file.hpp"
#include "tests/fidelity/decimation_report.hpp"
#include "tests/fidelity/sections.hpp"
#include "tests/fidelity/write_json.hpp"

namespace {

using namespace hairnet;
using namespace hairnet::fidelity;

constexpr double kRate_hz = 25, kDuration_s = 3;
constexpr std::size_t kMadeStrandCount = 3000;
// --lattices compares with a lattice of so many nodes an axis; the finest level has 10.
constexpr int kTruthNodes = 14;

constexpr const char* kExamples = R"(
Examples:
  hairnet-fidelity decimation --quick
  hairnet-fidelity decimation --json all.json --plot decimation.svg
  hairnet-fidelity decimation --groom sintel --groom made:ponytail --motion dance_a --lattices)";

struct Options {
  std::vector<std::string> grooms, motions;
  std::string json, plot;
  bool is_quick = false, has_lattices = false;
};

void print_line(const std::string& line) {
  std::fprintf(stderr, "%s\n", line.c_str());
}

// No path, no file.
Result<void> write_text(const std::string& path, const std::string& text) {
  if (path.empty()) return {};
  const auto written = write_file(path, std::as_bytes(std::span(text)));
  if (!written) return Refusal(path + ": " + written.error());
  return {};
}

// Fills in options that were not given: real hairstyles and motions if there are any, and some of our own hairstyles.
void complete(Options& options) {
  if (options.grooms.empty()) {
    if (has_real_data()) options.grooms.assign(std::begin(kRealGrooms), std::end(kRealGrooms));
    for (const char* made : {"made:long_curly", "made:bob", "made:ponytail"}) options.grooms.emplace_back(made);
    if (options.is_quick) options.grooms.resize(2);
  }
  if (options.motions.empty()) {
    options.motions = has_real_data() ? std::vector<std::string>{"dance_a", "cmu_131_01", "spinkick"}
                                      : std::vector<std::string>{"made:nod", "made:shake", "made:walk"};
    if (options.is_quick) options.motions.resize(1);
  }
}

Result<void> measure(const std::string& groom_name, const Options& options, DecimationReport& report) {
  DecimationOptions counts;
  if (options.is_quick) counts.target_seed_count = counts.other_seed_count = 1;
  auto groom = load_groom(groom_name, kMadeStrandCount);
  if (!groom) return Refusal(groom.error());
  groom->name = groom_name;
  std::vector<Clip> clips;
  for (const std::string& name : options.motions) {
    const auto motion = load_motion(name, groom->body);
    if (!motion) return Refusal(motion.error());
    clips.push_back(make_clip(*motion, kRate_hz, kDuration_s));
  }
  if (options.has_lattices) {
    auto lattices = measure_lattices(*groom, clips, kTruthNodes, counts, print_line);
    if (!lattices) return Refusal(lattices.error());
    report.lattices.insert(report.lattices.end(), lattices->begin(), lattices->end());
    return {};
  }
  auto rows = measure_decimation(*groom, clips, counts, print_line);
  if (!rows) return Refusal(rows.error());
  report.rows.insert(report.rows.end(), rows->begin(), rows->end());
  return {};
}

Result<void> run(Options options) {
  complete(options);
  DecimationReport report;
  for (const std::string& groom : options.grooms) {
    const auto done = measure(groom, options, report);
    if (!done) return done;
    // Written after each case, so that a long run that is stopped leaves its results.
    if (const auto written = write_text(options.json, json_of(report)); !written) return written;
  }
  std::printf("%s", tables_of(report).c_str());
  return write_text(options.plot, plot_of(report));
}

}  // namespace

void hairnet::fidelity::add_decimation(CLI::App& program, std::function<int()>& chosen) {
  const auto kept = std::make_shared<Options>();
  Options& options = *kept;
  CLI::App& app = *program.add_subcommand(
      "decimation", "How far a decimated model lies from all springs and attachments, integrated to convergence");
  app.add_option("--groom", options.grooms, "yuksel, ponytail, harolongo, sintel or made:NAME; again for more [seven]");
  app.add_option("--motion", options.motions, "a motion of the corpus or made:NAME; again for more [three real ones]");
  app.add_flag("--quick", options.is_quick, "two hairstyles, one motion, one random subset");
  app.add_flag("--lattices", options.has_lattices,
               "hold lattices, with all stiffeners, against one of 14 nodes an axis instead (slow)");
  app.add_option("--json", options.json, "write every figure to this file");
  app.add_option("--plot", options.plot, "draw mean error against count to this file (SVG)");
  app.footer(kExamples);
  app.callback([kept, &chosen] {
    chosen = [kept] {
      const Result<void> done = run(*kept);
      return done ? 0 : fail(done.error());
    };
  });
}
