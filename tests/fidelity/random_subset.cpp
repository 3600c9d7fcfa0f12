#include "tests/fidelity/random_subset.hpp"

#include <algorithm>
#include <numeric>
#include <random>
#include <vector>

namespace hairnet::fidelity {

Stiffeners random_subset(const Stiffeners& all, std::size_t count, std::uint64_t seed) {
  if (all.count() <= count || count == 0) return count == 0 ? Stiffeners{} : all;
  std::vector<std::uint32_t> indices(all.count()), chosen;
  std::iota(indices.begin(), indices.end(), 0);
  std::mt19937_64 random(seed);
  std::ranges::sample(indices, std::back_inserter(chosen), static_cast<std::ptrdiff_t>(count), random);
  const auto ratio = static_cast<float>(static_cast<double>(all.count()) / static_cast<double>(count));
  Stiffeners subset;
  for (const std::uint32_t s : chosen) {
    subset.nodes.insert(subset.nodes.end(), all.nodes.begin() + all.begin[s], all.nodes.begin() + all.begin[s + 1]);
    subset.weights.insert(subset.weights.end(), all.weights.begin() + all.begin[s],
                          all.weights.begin() + all.begin[s + 1]);
    subset.begin.push_back(static_cast<std::uint32_t>(subset.nodes.size()));
    subset.stiffness.push_back(ratio * all.stiffness[s]);
    subset.damping.push_back(ratio * all.damping[s]);
    subset.rest.push_back(all.rest[s]);
  }
  return subset;
}

}  // namespace hairnet::fidelity
