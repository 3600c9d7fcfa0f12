#include "tests/bench/ffd_table.hpp"

#include <cstdio>
#include <string>

#include "tests/bench/ffd_bench.hpp"
#include "tests/bench/isa.hpp"
#include "tests/bench/state_hash.hpp"

namespace hairnet::bench {
namespace {

// The limit is in metres for points and a share for tangents; it allows for floats against the reference in doubles.
constexpr double kOff_max = 1e-4;

void measure_level(const Subject& subject, LevelIndex index, Report& report) {
  const auto level = build_level(subject.groom, kLevelSpecs[static_cast<std::size_t>(index)]);
  const std::string name(kLevelNames[static_cast<std::size_t>(index)]);
  std::printf("\n%-40s %12s %10s %12s   %s\n", name.c_str(), "ns a point", "x stored", "error", "hash");
  for (const FfdTime& time : time_ffd(subject.groom, *level)) {
    StateHash hash;
    hash.add(time.hash);
    std::printf("  %-38s %12.2f %10.1f %12.2g   %s\n", time.name.c_str(), time.ns_per_point, time.ratio_to_stored,
                time.error_max_m, hash.text().c_str());
    report.add({{"section", "ffd"},
                {"level", name},
                {"variant", time.name},
                {"ns_per_point", time.ns_per_point},
                {"times_stored", time.ratio_to_stored},
                {"error_m", time.error_max_m},
                {"hash", hash.text()}});
    if (!(time.error_max_m <= kOff_max)) report.fail("FFD, " + name + ", " + time.name + ": off the reference");
  }
}

}  // namespace

void measure_ffd(const Subject& subject, Report& report) {
  std::printf("\nFFD, beside weights stored a point (the paper: 250 ns quadratic, 100 ns linear)\n");
  const std::string isa = isa_in_use();
  for (const LevelIndex index : {LevelIndex::high, LevelIndex::low}) measure_level(subject, index, report);
  // It has tried others.
  if (const auto used = use_isa(isa); !used) report.fail(used.error());
}

}  // namespace hairnet::bench
