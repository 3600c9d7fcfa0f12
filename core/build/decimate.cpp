#include "core/build/decimate.hpp"

#include <algorithm>
#include <map>
#include <numeric>
#include <optional>
#include <queue>

#include "core/build/nearest_ends.hpp"

namespace hairnet {
namespace {

constexpr std::size_t kNeighbourCount = 6;  // measured: as good as 20

// How a round orders the pairs that it looks at.
enum class Order { by_cost, by_distance };

struct Candidate {
  double key;  // cost, or squared distance
  std::uint32_t kept, merged;
  friend bool operator==(const Candidate&, const Candidate&) = default;
};

// Least key first; indices break ties, so that the result does not depend on the heap.
struct Later {
  bool operator()(const Candidate& a, const Candidate& b) const {
    return std::tie(a.key, a.kept, a.merged) > std::tie(b.key, b.kept, b.merged);
  }
};

double dot(std::span<const NodeWeight> a, std::span<const NodeWeight> b) {
  double sum = 0;
  std::size_t i = 0, j = 0;
  while (i < a.size() && j < b.size()) {
    if (a[i].node == b[j].node) {
      sum += a[i++].weight * b[j++].weight;
    } else if (a[i].node < b[j].node) {
      ++i;
    } else {
      ++j;
    }
  }
  return sum;
}

class Decimation {
 public:
  Decimation(StiffenerKind kind, std::size_t count_max, StiffenerList& list,
             const std::function<bool(double)>& keep_going)
      : kind_(kind),
        count_max_(count_max),
        list_(list),
        keep_going_(keep_going),
        count_start_(list.count()),
        count_(list.count()),
        representative_(list.count()),
        norm2_(list.count()) {
    std::iota(representative_.begin(), representative_.end(), 0);
    for (std::size_t s = 0; s < count_; ++s) norm2_[s] = dot(list_.weights(s), list_.weights(s));
  }

  // False when cancelled.
  bool run() {
    if (count_max_ > 0) merge_identical();
    if (count_max_ > 0 && !run_rounds(Order::by_cost)) return false;
    if (count_max_ > 0 && kind_ == StiffenerKind::attachment && !run_rounds(Order::by_distance)) return false;
    keep_survivors(most_important());
    return report();
  }

 private:
  // Stiffeners with the very same ends are one, without any error. Strands that share a root, or are drawn twice, are
  // common.
  void merge_identical() {
    std::vector<std::tuple<std::uint16_t, EndPoints, std::uint32_t>> keys;
    keys.reserve(count_);
    for (std::uint32_t s = 0; s < list_.count(); ++s) {
      keys.emplace_back(list_.group[s], ordered_ends(list_.ends[s]), s);
    }
    std::ranges::sort(keys);
    for (std::size_t first = 0, i = 1; i < keys.size() && count_ > count_max_; ++i) {
      const auto& [group, ends, s] = keys[i];
      if (group == std::get<0>(keys[first]) && ends == std::get<1>(keys[first])) {
        merge(std::get<2>(keys[first]), s);
      } else {
        first = i;
      }
    }
  }

  // Rounds until the count is reached or no pair is left. Few merges mean that neighbours worth merging were not among
  // the nearest: look further.
  bool run_rounds(Order order) {
    std::size_t neighbour_count = kNeighbourCount;
    while (count_ > count_max_) {
      const std::vector<std::vector<std::uint32_t>> groups = members_by_group();
      std::size_t group_size_max = 0;
      for (const auto& members : groups) group_size_max = std::max(group_size_max, members.size());
      const std::size_t before = count_;
      if (!run_round(order, groups, neighbour_count)) return false;
      if (count_ == before && neighbour_count >= group_size_max) return true;
      if (before - count_ <= before / 32) neighbour_count = std::min(2 * neighbour_count, group_size_max);
    }
    return true;
  }

  bool run_round(Order order, const std::vector<std::vector<std::uint32_t>>& groups, std::size_t neighbour_count) {
    std::vector<Candidate> candidates;
    for (const auto& members : groups) {
      if (!append_candidates(order, members, neighbour_count, candidates)) return false;
    }
    std::priority_queue<Candidate, std::vector<Candidate>, Later> heap(Later{}, std::move(candidates));
    const std::size_t round_end = std::max(count_max_, count_ / 2);
    for (std::size_t popped = 0; count_ > round_end && !heap.empty(); ++popped) {
      if (popped % 4096 == 0 && !report()) return false;
      const Candidate candidate = heap.top();
      heap.pop();
      const std::uint32_t a = find(candidate.kept), b = find(candidate.merged);
      if (a == b) continue;
      const std::optional<Candidate> now = evaluate(order, a, b);
      if (!now) continue;
      // Stiffness only grows, and cost with it: an old entry is never dearer than the pair is now.
      if (*now == candidate) {
        merge(candidate.kept, candidate.merged);
      } else {
        heap.push(*now);
      }
    }
    return true;
  }

  // False when cancelled.
  bool append_candidates(Order order, const std::vector<std::uint32_t>& members, std::size_t neighbour_count,
                         std::vector<Candidate>& candidates) const {
    constexpr std::size_t kPart = 8192;
    const NearestEnds nearest(list_, members);
    NearestEnds::Pairs pairs;
    for (std::size_t begin = 0; begin < members.size(); begin += kPart) {
      if (!report()) return false;
      pairs.clear();
      nearest.append_pairs(begin, std::min(begin + kPart, members.size()), neighbour_count, pairs);
      std::ranges::sort(pairs);
      pairs.erase(std::unique(pairs.begin(), pairs.end()), pairs.end());
      for (const auto& [a, b] : pairs) {
        if (const auto candidate = evaluate(order, a, b)) candidates.push_back(*candidate);
      }
    }
    return true;
  }

  std::optional<Candidate> evaluate(Order order, std::uint32_t a, std::uint32_t b) const {
    if (order == Order::by_distance) {
      const double distance2 = (list_.ends[a][0] - list_.ends[b][0]).squaredNorm();
      const bool a_is_stiffer =
          list_.stiffness[a] != list_.stiffness[b] ? list_.stiffness[a] > list_.stiffness[b] : a < b;
      return a_is_stiffer ? Candidate{distance2, a, b} : Candidate{distance2, b, a};
    }
    const double overlap = dot(list_.weights(a), list_.weights(b));
    if (overlap == 0) return std::nullopt;
    const double b_into_a = merge_of(kind_, list_.stiffness[b], norm2_[a], norm2_[b], overlap).cost;
    const double a_into_b = merge_of(kind_, list_.stiffness[a], norm2_[b], norm2_[a], overlap).cost;
    const bool keeps_a = b_into_a != a_into_b ? b_into_a < a_into_b : a < b;
    return keeps_a ? Candidate{b_into_a, a, b} : Candidate{a_into_b, b, a};
  }

  void merge(std::uint32_t kept, std::uint32_t merged) {
    const double overlap = dot(list_.weights(kept), list_.weights(merged));
    const double k = list_.stiffness[merged];
    const double gain = merge_of(kind_, k, norm2_[kept], norm2_[merged], overlap).gain;
    list_.stiffness[kept] += gain;
    list_.damping[kept] += list_.damping[merged] * gain / k;
    representative_[merged] = kept;
    --count_;
  }

  // The stiffener that s was merged into; itself while it is there.
  std::uint32_t find(std::uint32_t s) {
    while (representative_[s] != s) {
      representative_[s] = representative_[representative_[s]];
      s = representative_[s];
    }
    return s;
  }

  std::vector<std::vector<std::uint32_t>> members_by_group() const {
    std::map<std::uint16_t, std::vector<std::uint32_t>> by_group;
    for (std::uint32_t s = 0; s < representative_.size(); ++s) {
      if (representative_[s] == s) by_group[list_.group[s]].push_back(s);
    }
    std::vector<std::vector<std::uint32_t>> groups;
    for (auto& [group, members] : by_group) groups.push_back(std::move(members));
    return groups;
  }

  // At most count_max_ of those that are left, ascending: without the ones whose loss costs least, k^2 |w|^4.
  std::vector<std::uint32_t> most_important() const {
    std::vector<std::uint32_t> left;
    for (std::uint32_t s = 0; s < representative_.size(); ++s) {
      if (representative_[s] == s) left.push_back(s);
    }
    if (left.size() > count_max_) {
      std::ranges::stable_sort(left, std::greater{}, [&](std::uint32_t s) { return list_.stiffness[s] * norm2_[s]; });
      left.resize(count_max_);
      std::ranges::sort(left);
    }
    return left;
  }

  void keep_survivors(const std::vector<std::uint32_t>& survivors) {
    StiffenerList kept;
    for (const std::uint32_t s : survivors) {
      const auto weights = list_.weights(s);
      kept.entries.insert(kept.entries.end(), weights.begin(), weights.end());
      kept.begin.push_back(static_cast<std::uint32_t>(kept.entries.size()));
      kept.stiffness.push_back(list_.stiffness[s]);
      kept.damping.push_back(list_.damping[s]);
      kept.group.push_back(list_.group[s]);
      kept.ends.push_back(list_.ends[s]);
    }
    list_ = std::move(kept);
    count_ = list_.count();
  }

  bool report() const {
    if (!keep_going_) return true;
    const double all = static_cast<double>(count_start_ - std::min(count_start_, count_max_));
    return keep_going_(all > 0 ? static_cast<double>(count_start_ - count_) / all : 1.0);
  }

  StiffenerKind kind_;
  std::size_t count_max_;
  StiffenerList& list_;
  const std::function<bool(double)>& keep_going_;
  std::size_t count_start_, count_;
  std::vector<std::uint32_t> representative_;  // union-find: into which each was merged
  std::vector<double> norm2_;                  // |w|^2
};

}  // namespace

Merge merge_of(StiffenerKind kind, double stiffness_merged, double kept_norm2, double merged_norm2, double dot) {
  const double k = stiffness_merged;
  const double gain = kind == StiffenerKind::attachment ? k : k * dot * dot / (kept_norm2 * kept_norm2);
  const double cost =
      k * k * merged_norm2 * merged_norm2 - 2 * k * gain * dot * dot + gain * gain * kept_norm2 * kept_norm2;
  return {gain, std::max(cost, 0.0)};
}

bool decimate(StiffenerKind kind, std::size_t count_max, StiffenerList& list,
              const std::function<bool(double)>& keep_going) {
  if (list.count() <= count_max) return true;
  return Decimation(kind, count_max, list, keep_going).run();
}

}  // namespace hairnet
