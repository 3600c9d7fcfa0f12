#include "core/levels/stiffener_order.hpp"

#include <algorithm>
#include <numeric>
#include <span>

#include "core/assert.hpp"

namespace hairnet {

void order_by_nodes(Stiffeners& list) {
  HAIRNET_ASSERT(list.begin.size() == list.count() + 1);
  HAIRNET_ASSERT(list.begin.back() == list.nodes.size());
  HAIRNET_ASSERT(list.weights.size() == list.nodes.size());
  HAIRNET_ASSERT(list.damping.size() == list.count());
  HAIRNET_ASSERT(list.rest.size() == list.count());
  HAIRNET_VALIDATE(std::ranges::is_sorted(list.begin));
  const auto nodes = [&](std::size_t s) {
    return std::span(list.nodes).subspan(list.begin[s], list.begin[s + 1] - list.begin[s]);
  };
  std::vector<std::size_t> order(list.count());
  std::iota(order.begin(), order.end(), 0);
  // Stable, so that stiffeners with equal nodes keep the order of the build and the sums keep their bits.
  std::ranges::stable_sort(
      order, [&](std::size_t a, std::size_t b) { return std::ranges::lexicographical_compare(nodes(a), nodes(b)); });

  Stiffeners ordered;
  for (const std::size_t s : order) {
    ordered.nodes.insert(ordered.nodes.end(), list.nodes.begin() + list.begin[s],
                         list.nodes.begin() + list.begin[s + 1]);
    ordered.weights.insert(ordered.weights.end(), list.weights.begin() + list.begin[s],
                           list.weights.begin() + list.begin[s + 1]);
    ordered.begin.push_back(static_cast<std::uint32_t>(ordered.nodes.size()));
    ordered.stiffness.push_back(list.stiffness[s]);
    ordered.damping.push_back(list.damping[s]);
    ordered.rest.push_back(list.rest[s]);
  }
  HAIRNET_ASSERT(ordered.count() == list.count());
  HAIRNET_ASSERT(ordered.nodes.size() == list.nodes.size());
  list = std::move(ordered);
}

}  // namespace hairnet
