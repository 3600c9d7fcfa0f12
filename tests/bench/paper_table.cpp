#include "tests/bench/paper_table.hpp"

#include <algorithm>
#include <cstdio>
#include <string>

#include "tests/bench/correctness.hpp"
#include "tests/bench/cut_off_error.hpp"
#include "tests/bench/isa.hpp"
#include "tests/bench/step_runner.hpp"
#include "tests/bench/stopwatch.hpp"

namespace hairnet::bench {
namespace {

// The paper's Table 1 has frames of 1/25 s.
constexpr double kRate_hz = 25;
// The search for as many of our iterations as have the paper's error ends here. Our solver needs far fewer, since it
// has a preconditioner.
constexpr int kIterationsMax = 64;

// One row of the paper's table: a lattice of nodes_per_axis³ nodes, with so many attachments and springs, and with or
// without contact.
struct Cell {
  int nodes_per_axis;
  std::size_t attachments, springs;
  bool contact;
  // The paper's time of a frame, on a Pentium 4 of 3 GHz.
  double paper_ms;
};
// The members of each row are in the order of Cell.
constexpr Cell kCells[] = {{10, 0, 0, false, 1.1},     {10, 0, 0, true, 5.2},      {10, 50, 200, true, 10.1},
                           {10, 100, 400, true, 13.8}, {10, 200, 800, true, 21.4}, {5, 0, 0, false, 0.1},
                           {5, 0, 0, true, 0.2},       {5, 50, 200, true, 2.1},    {5, 100, 400, true, 3.8},
                           {5, 200, 800, true, 7.6}};

Level build(const Groom& groom, const Cell& cell) {
  const int n = cell.nodes_per_axis;
  Level level = *build_level(
      groom,
      {{n, n, n}, cell.springs, cell.attachments, n > 5 ? kLevelSpecs[0].contact_count : kLevelSpecs[2].contact_count});
  if (!cell.contact) level.contacts = {};
  return level;
}

// Returns whether one of our levels has the size of this cell.
bool is_shipped(const Cell& cell) {
  return std::ranges::any_of(kLevelSpecs, [&](const LevelSpec& spec) {
    return cell.contact && spec.dims[0] == cell.nodes_per_axis && spec.spring_count == cell.springs;
  });
}

int shipped_iterations(const Cell& cell) {
  const LevelIndex index = cell.springs == 0           ? LevelIndex::ether
                           : cell.nodes_per_axis == 10 ? LevelIndex::high
                                                       : LevelIndex::low;
  return iterations_for(index, 1 / kRate_hz / substep_count_for(1 / kRate_hz));
}

// One way to step the characters, as a row of the output. `isa` is the instruction set; `error` is that of the
// trajectory (CutOffError).
struct Variant {
  std::string name;
  std::string isa;
  StepRunnerSettings settings;
  double error;
  std::unique_ptr<StepRunner> performer;
};

// Makes all ways to step one cell. The plain ones have the paper's 16 iterations and one step a frame; ours have as
// many iterations as reach the same error. Those named "shipped" have the steps and iterations of a server; the
// baselines among them have as many plain iterations as reach the shipped error.

std::vector<Variant> make_variants(const Subject& subject, const Level& level, const Cell& cell, const Workload& cast,
                                   const Options& o) {
  const CutOffError one_step(subject, level, kRate_hz, 1, o.duration_s);
  const int shipped_steps = substep_count_for(1 / kRate_hz), shipped = shipped_iterations(cell);
  const CutOffError shipped_step(subject, level, kRate_hz, shipped_steps, o.duration_s);
  const double paper_error = one_step.of_naive(kPaperIterations);
  const int equal = cell.springs == 0 ? 1 : one_step.iterations_for(paper_error, kIterationsMax);
  const double equal_error = one_step.of_ours(equal), shipped_error = shipped_step.of_ours(shipped);

  // The members are iterations, steps of a frame, and the relative residual, where 0 means that all iterations are
  // made.
  const StepRunnerSettings paper{kPaperIterations, 1, 0}, as_good{equal, 1, 0}, as_shipped{shipped, shipped_steps, 0};
  const std::string isa = isa_in_use();
  std::vector<Variant> variants;
  variants.push_back({"naive", isa, paper, paper_error, make_baseline(Baseline::naive, level, cast, paper)});
  variants.push_back({"fair", isa, paper, paper_error, make_baseline(Baseline::fair, level, cast, paper)});
  variants.push_back({"scalar", "scalar", as_good, equal_error, make_single(level, cast, as_good)});
  variants.push_back({"single", isa, as_good, equal_error, make_single(level, cast, as_good)});
  variants.push_back({"crowd", isa, as_good, equal_error, make_crowd(level, cast, as_good)});
  if (cell.springs > 0 && o.naive_iterations_max > 0) {
    const StepRunnerSettings patient{shipped_step.naive_iterations_for(shipped_error, o.naive_iterations_max),
                                     shipped_steps, 0};
    const double error = shipped_step.of_naive(patient.iterations);
    variants.push_back({"naive, shipped", isa, patient, error, make_baseline(Baseline::naive, level, cast, patient)});
    variants.push_back({"fair, shipped", isa, patient, error, make_baseline(Baseline::fair, level, cast, patient)});
  }
  variants.push_back({"single, shipped", isa, as_shipped, shipped_error, make_single(level, cast, as_shipped)});
  variants.push_back({"crowd, shipped", isa, as_shipped, shipped_error, make_crowd(level, cast, as_shipped)});
  return variants;
}

// Changes the instruction set of our kernels unless it is in use already.
Result<void> use(const std::string& isa) {
  return isa == isa_in_use() ? Result<void>() : use_isa(isa);
}

std::vector<TimedRun> time_all(std::vector<Variant>& variants, int repetitions, const std::string& where,
                               Report& report) {
  std::vector<TimedRun> laps;
  for (Variant& v : variants) {
    laps.push_back({v.name,
                    [&] {
                      if (const auto used = use(v.isa); !used) report.fail(where + ": " + used.error());
                      v.performer->rewind();
                    },
                    [&] {
                      if (!v.performer->perform()) report.fail(where + ": " + v.name + " is not finite");
                    }});
  }
  measure(laps, repetitions);
  return laps;
}

// Fails the report where a crowd's lattices differ from those of the single kernel in any bit.
void check_hashes(const std::vector<Variant>& variants, const std::string& where, Report& report) {
  const auto hash_of = [&](const char* name) {
    return std::ranges::find(variants, name, &Variant::name)->performer->hash();
  };
  for (const char* suffix : {"", ", shipped"}) {
    const std::string single = std::string("single") + suffix, crowd = std::string("crowd") + suffix;
    if (hash_of(single.c_str()) != hash_of(crowd.c_str())) {
      report.fail(where + ": " + crowd + " and " + single + " do not give the same bits");
    }
  }
}

void report_times(const Level& level, const Cell& cell, const std::vector<Variant>& variants,
                  const std::vector<TimedRun>& laps, double frames, Report& report) {
  std::printf("  %-16s %10s %12s %9s %8s %11s %9s   %s\n", "", "iterations", "us a frame", "x naive", "x fair",
              "as precise", "error", "state hash");
  const auto us_of = [&](std::size_t v) { return 1e6 * laps[v].seconds_min / frames; };
  const auto patient = std::ranges::find(variants, "naive, shipped", &Variant::name);
  for (std::size_t v = 0; v < variants.size(); ++v) {
    const Variant& variant = variants[v];
    const double us = us_of(v), times_naive = us_of(0) / us, times_fair = us_of(1) / us;
    std::string as_precise;
    Json times_as_precise;
    if (patient != variants.end() && variant.settings.steps_per_frame > 1) {
      const double times = us_of(static_cast<std::size_t>(patient - variants.begin())) / us;
      times_as_precise = times;
      char text[16];
      std::snprintf(text, sizeof text, "%.1f", times);
      as_precise = text;
    }
    const std::string hash = variant.performer->hash();
    std::printf("  %-16s %6d x %d %12.2f %9.1f %8.1f %11s %7.1f %%   %s\n", variant.name.c_str(),
                variant.settings.iterations, variant.settings.steps_per_frame, us, times_naive, times_fair,
                as_precise.c_str(), 100 * variant.error, hash.c_str());
    report.add({{"section", "paper"},
                {"lattice", cell.nodes_per_axis},
                {"attachments", level.attachments.count()},
                {"springs", level.springs.count()},
                {"contact_points", level.contacts.count()},
                {"nodes", level.rest.size()},
                {"paper_ms", cell.paper_ms},
                {"variant", variant.name},
                {"variant_isa", variant.isa},
                {"iterations", variant.settings.iterations},
                {"steps_per_frame", variant.settings.steps_per_frame},
                {"us_per_frame", us},
                {"times_naive", times_naive},
                {"times_fair", times_fair},
                {"times_naive_as_precise", times_as_precise},
                {"error", variant.error},
                {"hash", hash}});
  }
}

void measure_cell(const Subject& subject, const Options& o, const Cell& cell, Report& report) {
  const Level level = build(subject.groom, cell);
  const Workload cast =
      make_workload(level, subject.motions.front(), {kRate_hz, o.characters, 2}, shipped_iterations(cell));
  // `where` names the cell in messages.
  char where[80];
  std::snprintf(where, sizeof where, "%d³, %zu + %zu, %zu contact points", cell.nodes_per_axis,
                level.attachments.count(), level.springs.count(), level.contacts.count());
  const double off_m = check_against_reference(level, cast, where, report);
  std::vector<Variant> variants = make_variants(subject, level, cell, cast, o);
  const std::string isa = isa_in_use();
  const std::vector<TimedRun> laps = time_all(variants, o.repetitions, where, report);
  if (const auto used = use(isa); !used) report.fail(used.error());
  check_hashes(variants, where, report);

  std::printf("\n%s, %zu nodes; paper %.1f ms; converged steps within %.2g mm of the reference\n", where,
              level.rest.size(), cell.paper_ms, 1e3 * off_m);
  report_times(level, cell, variants, laps, static_cast<double>(cast.characters.size() * cast.frame_count), report);
}

}  // namespace

void measure_paper_table(const Subject& subject, const Options& options, Report& report) {
  std::printf(
      "\nThe paper's Table 1: a frame of 1/25 s of one character. naive, fair: %d plain iterations, as the paper;\n"
      "ours: as many as err no more than those, and as shipped, beside the naive step with as many as err no more "
      "than\n"
      "what is shipped (as precise). Error: of the trajectory from the converged one, over the RMS motion.\n",
      kPaperIterations);
  for (const Cell& cell : kCells) {
    if (options.shipped_cells_only && !is_shipped(cell)) continue;
    measure_cell(subject, options, cell, report);
    std::fflush(stdout);
  }
}

}  // namespace hairnet::bench
