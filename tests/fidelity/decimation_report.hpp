#pragma once

#include <string>
#include <vector>

#include "tests/fidelity/decimation_case.hpp"

namespace hairnet::fidelity {

struct DecimationReport {
  std::vector<DecimationRow> rows;
  std::vector<LatticeRow> lattices;
};

// Markdown tables: means by lattice and count, each groom and motion at the target, the lattices.
std::string tables_of(const DecimationReport& report);
// Everything, one object a row.
std::string json_of(const DecimationReport& report);
// Mean error against count, merged and random, a colour a lattice.
std::string plot_of(const DecimationReport& report);

}  // namespace hairnet::fidelity
