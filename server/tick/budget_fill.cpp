#include "server/tick/budget_fill.hpp"

#include <algorithm>
#include <limits>

#include "core/assert.hpp"

namespace hairnet::server {
namespace {

// Orders steps by priority; key and rung break ties, so that the result does not depend on the order of items.
bool goes_before(const FillStep& a, const FillStep& b) {
  if (a.priority != b.priority) return a.priority > b.priority;
  if (a.key != b.key) return a.key < b.key;
  return a.rung < b.rung;
}

// The step from the rung below to `rung`.
FillStep step_to(std::span<const BudgetItem> items, std::size_t index, std::uint8_t rung) {
  HAIRNET_VALIDATE(rung >= 1 && rung <= items[index].last);
  // Priorities of other steps, weight times error over ns, are far smaller than this, so even rungs always come first,
  // the lowest of them first of all.
  constexpr double kPerRung = 1e6;
  const BudgetItem& item = items[index];
  const std::int64_t cost_ns = item.cost_ns[rung] - item.cost_ns[rung - 1u];
  double priority = item.weight * (rung <= item.now ? kHysteresis : 1.0);
  if (rung <= item.even) {
    priority += kPerRung * static_cast<double>(kRungCountMax - rung);
  } else {
    const double gain = static_cast<double>(item.error[rung - 1u]) - static_cast<double>(item.error[rung]);
    priority *= gain / static_cast<double>(std::max<std::int64_t>(cost_ns, 1));
  }
  return {priority, cost_ns, item.key, static_cast<std::uint32_t>(index), rung};
}

// What the share gets at this level: no less than its minimum and no more than its maximum.
std::int64_t clamp_to_share(std::int64_t level_ns, const FillShare& share) {
  HAIRNET_VALIDATE(share.min_ns <= share.max_ns);
  return std::clamp(level_ns, share.min_ns, share.max_ns);
}

// The cost of all shares when each gets `level_ns`, or its minimum or maximum where that is closer.
std::int64_t level_cost(std::int64_t level_ns, std::span<const FillShare> shares) {
  std::int64_t sum = 0;
  for (const FillShare& share : shares) sum += clamp_to_share(level_ns, share);
  return sum;
}

// Max-min fair sharing: the largest time that each share can get within the budget, where a share gets no less than its
// minimum and no more than its maximum.
std::int64_t water_level(std::int64_t budget_ns, std::span<const FillShare> shares) {
  HAIRNET_VALIDATE(level_cost(0, shares) <= budget_ns);
  // A search by halves in whole nanoseconds: the cost never falls with the level, so the last level that fits is exact.
  std::int64_t low = 0, high = 0;
  for (const FillShare& share : shares) high = std::max(high, share.max_ns);
  while (low < high) {
    const std::int64_t level = low + (high - low + 1) / 2;
    if (level_cost(level, shares) <= budget_ns) {
      low = level;
    } else {
      high = level - 1;
    }
  }
  return low;
}

// Adds the part with this index to the last run, or begins a new run where it belongs to another client or subject.
void add(const FillShare& part, std::size_t index, bool is_same, std::vector<FillShare>& shares) {
  HAIRNET_ASSERT(!is_same || (!shares.empty() && shares.back().end == index));
  if (!is_same) shares.push_back({index, index, 0, 0});
  shares.back().end = index + 1;
  shares.back().min_ns += part.min_ns;
  shares.back().max_ns += part.max_ns;
}

// Finds the runs of items that belong to one client, and the runs of clients that belong to one subject.
void group(std::span<const BudgetItem> items, FillScratch& scratch) {
  scratch.clients.clear();
  scratch.subjects.clear();
  for (std::size_t i = 0; i < items.size(); ++i) {
    const bool is_same = i > 0 && items[i].subject == items[i - 1].subject && items[i].session == items[i - 1].session;
    add({i, i + 1, items[i].cost_ns[0], items[i].cost_ns[items[i].last]}, i, is_same, scratch.clients);
  }
  for (std::size_t c = 0; c < scratch.clients.size(); ++c) {
    const bool is_same =
        c > 0 && items[scratch.clients[c].begin].subject == items[scratch.clients[c - 1].begin].subject;
    add(scratch.clients[c], c, is_same, scratch.subjects);
  }
}

// One client's steps, best first, up to the first one that its share cannot pay.
class ClientFill {
 public:
  ClientFill(std::span<const BudgetItem> items, std::vector<FillStep>& steps, std::span<std::uint8_t> rungs)
      : items_(items), steps_(steps), rungs_(rungs) {}

  // Chooses the rungs of the client's items. `share_ns` includes the cost of rung 0.
  void fill(const FillShare& client, std::int64_t share_ns) {
    // A client with one character needs no comparison of steps.
    if (client.end - client.begin == 1) return fill_one(client.begin, share_ns);
    HAIRNET_ASSERT(share_ns >= client.min_ns);
    put_steps(client);
    std::int64_t left_ns = share_ns - client.min_ns;
    // The better half of [begin, end) is bought as a whole, or searched by halves.
    auto begin = steps_.begin(), end = steps_.end();
    while (begin != end) {
      // Halving costs time in proportion to the number of steps; sorting all of them would cost more, for an order that
      // nobody reads.
      const auto middle = begin + (end - begin + 1) / 2;
      if (middle != end) std::nth_element(begin, middle, end, goes_before);
      std::int64_t cost_ns = 0;
      for (auto s = begin; s != middle; ++s) cost_ns += s->cost_ns;
      if (cost_ns <= left_ns) {
        for (auto s = begin; s != middle; ++s) rungs_[s->item] = std::max(rungs_[s->item], s->rung);
        left_ns -= cost_ns;
        begin = middle;
      } else {
        if (middle - begin == 1) return;
        end = middle;
      }
    }
  }

 private:
  // Takes the finest rung that the share can pay.
  void fill_one(std::size_t item, std::int64_t share_ns) {
    const BudgetItem& i = items_[item];
    while (rungs_[item] < i.last && i.cost_ns[rungs_[item] + 1u] <= share_ns) ++rungs_[item];
  }

  // Puts the steps of all items of the client into steps_.
  void put_steps(const FillShare& client) {
    steps_.clear();
    for (std::size_t i = client.begin; i < client.end; ++i) {
      double before = std::numeric_limits<double>::infinity();
      for (std::uint8_t rung = 1; rung <= items_[i].last; ++rung) {
        FillStep step = step_to(items_, i, rung);
        // No step comes before the step below it, even if its measured gain is larger.
        before = step.priority = std::min(step.priority, before);
        steps_.push_back(step);
      }
    }
  }

  std::span<const BudgetItem> items_;
  std::vector<FillStep>& steps_;
  std::span<std::uint8_t> rungs_;
};

// Spends the remaining time on the steps that gain most, one step an item. No item goes beyond its even rungs while
// another item lacks one of its own.
void spend_remainder(std::int64_t left_ns, std::span<const BudgetItem> items, std::vector<FillStep>& steps,
                     std::span<std::uint8_t> rungs) {
  steps.clear();
  std::int64_t cheapest_ns = std::numeric_limits<std::int64_t>::max();
  for (std::size_t i = 0; i < items.size(); ++i) {
    if (rungs[i] >= items[i].last) continue;
    steps.push_back(step_to(items, i, static_cast<std::uint8_t>(rungs[i] + 1)));
    cheapest_ns = std::min(cheapest_ns, steps.back().cost_ns);
  }
  // A heap, because most steps are never looked at.
  const auto goes_after = [](const FillStep& a, const FillStep& b) { return goes_before(b, a); };
  std::ranges::make_heap(steps, goes_after);
  bool is_uneven = false;
  while (!steps.empty() && left_ns >= cheapest_ns) {
    std::ranges::pop_heap(steps, goes_after);
    const FillStep step = steps.back();
    steps.pop_back();
    const bool is_even = step.rung <= items[step.item].even;
    // Somebody could not pay an even rung, so nobody goes beyond theirs.
    if (!is_even && is_uneven) break;
    if (step.cost_ns > left_ns) {
      is_uneven |= is_even;
      continue;
    }
    left_ns -= step.cost_ns;
    HAIRNET_ASSERT(step.rung == rungs[step.item] + 1);
    rungs[step.item] = step.rung;
  }
}

// The cost of all items on these rungs.
std::int64_t cost_of(std::span<const BudgetItem> items, std::span<const std::uint8_t> rungs) {
  std::int64_t sum = 0;
  for (std::size_t i = 0; i < items.size(); ++i) sum += items[i].cost_ns[rungs[i]];
  return sum;
}

// Whether rungs exist and cost no less than the rungs below.
[[maybe_unused]] bool is_ladder(const BudgetItem& item) {
  return item.last < kRungCountMax && item.now <= item.last && item.error && item.cost_ns[0] >= 0 &&
         std::is_sorted(item.cost_ns.begin(), item.cost_ns.begin() + item.last + 1);
}

}  // namespace

std::int64_t fill_budget(std::int64_t budget_ns, std::span<const BudgetItem> items, FillScratch& scratch,
                         std::span<std::uint8_t> rungs, Remainder remainder) {
  HAIRNET_ASSERT(rungs.size() == items.size());
  HAIRNET_VALIDATE(std::ranges::all_of(items, is_ladder));
  std::ranges::fill(rungs, std::uint8_t{0});
  group(items, scratch);
  HAIRNET_ASSERT(scratch.subjects.size() <= scratch.clients.size());
  HAIRNET_ASSERT(scratch.clients.size() <= items.size());
  const std::int64_t min_ns = cost_of(items, rungs);
  // Nothing can be left out below rung 0, so the caller learns the cost and reports the excess.
  if (min_ns >= budget_ns) return min_ns;
  // A person with many clients or characters gets one share, like everyone else: more characters only make them
  // coarser.
  const std::int64_t subject_level = water_level(budget_ns, scratch.subjects);
  ClientFill filler(items, scratch.steps, rungs);
  for (const FillShare& subject : scratch.subjects) {
    const auto clients = std::span(scratch.clients).subspan(subject.begin, subject.end - subject.begin);
    const std::int64_t client_level = water_level(clamp_to_share(subject_level, subject), clients);
    for (const FillShare& client : clients) filler.fill(client, clamp_to_share(client_level, client));
  }
  const std::int64_t spent_ns = cost_of(items, rungs);
  HAIRNET_ASSERT(spent_ns <= budget_ns);
  if (remainder == Remainder::spend && spent_ns < budget_ns)
    spend_remainder(budget_ns - spent_ns, items, scratch.steps, rungs);
  const std::int64_t cost_ns = cost_of(items, rungs);
  HAIRNET_ASSERT(cost_ns <= budget_ns);
  return cost_ns;
}

}  // namespace hairnet::server
