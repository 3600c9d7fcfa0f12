#include "core/levels/decimate.hpp"

#include <algorithm>
#include <atomic>
#include <cmath>
#include <functional>
#include <map>
#include <numeric>
#include <queue>

#include "core/assert.hpp"
#include "core/levels/nearest_chords.hpp"

namespace hairnet {
namespace {

// Candidates for each stiffener in the first round; run_rounds doubles the number when few pairs merge.
constexpr std::size_t kNeighbourCount = 6;

// One stiffener, or several merged. `share` is its weight in an average: k L of springs, k of attachments.
struct Cluster {
  double share = 0;
  // The sum of k L^2 for springs, and of k for attachments.
  double moment = 0;
  // The same sum of q.
  double damping_moment = 0;
  // The sum of share times w, ascending by node.
  std::vector<NodeWeight> weights;
};

// A pair of clusters that may merge. The cost is the error by which the merge would change the lattice.
struct Candidate {
  double cost;
  // The order is a < b.
  std::uint32_t a, b;
  // The versions of the clusters when the cost was found.
  std::uint32_t version_a, version_b;
};

// Least cost first; indices break ties, so that the result does not depend on the heap.
struct Later {
  bool operator()(const Candidate& x, const Candidate& y) const {
    return std::tie(x.cost, x.a, x.b) > std::tie(y.cost, y.a, y.b);
  }
};

// Adds two lists of weights that ascend by node.
std::vector<NodeWeight> sum_of(const std::vector<NodeWeight>& a, const std::vector<NodeWeight>& b) {
  std::vector<NodeWeight> sum;
  sum.reserve(a.size() + b.size());
  auto i = a.begin(), j = b.begin();
  while (i != a.end() && j != b.end()) {
    if (i->node == j->node) {
      sum.push_back({i->node, (i++)->weight + j->weight});
      ++j;
    } else {
      sum.push_back(i->node < j->node ? *i++ : *j++);
    }
  }
  sum.insert(sum.end(), i, a.end());
  sum.insert(sum.end(), j, b.end());
  HAIRNET_VALIDATE(std::ranges::adjacent_find(sum, std::greater_equal{}, &NodeWeight::node) == sum.end());
  return sum;
}

// Appends the `count` greatest of weights with one sign, scaled to the sum of all.
void append_greatest(std::vector<NodeWeight> side, std::size_t count, std::vector<NodeWeight>& kept) {
  const auto sum = [](const std::vector<NodeWeight>& weights) {
    return std::accumulate(weights.begin(), weights.end(), 0.0, [](double s, const auto& w) { return s + w.weight; });
  };
  const double whole = sum(side);
  std::ranges::stable_sort(side, std::greater{}, [](const NodeWeight& w) { return std::abs(w.weight); });
  if (side.size() > count) side.resize(count);
  const double left = sum(side);
  HAIRNET_ASSERT(side.empty() || left != 0);
  for (NodeWeight& w : side) kept.push_back({w.node, w.weight * (whole / left)});
}

class Decimation {
 public:
  Decimation(const Grid& grid, StiffenerKind kind, std::size_t count_max, StiffenerList& list,
             const std::function<bool(double)>& keep_going, const ParallelFor& parallel_for)
      : grid_(grid),
        kind_(kind),
        count_max_(count_max),
        list_(list),
        keep_going_(keep_going),
        parallel_for_(parallel_for),
        count_start_(list.count()),
        count_(list.count()),
        chords_(list.ends),
        version_(list.count(), 0),
        merged_into_(list.count()) {
    HAIRNET_ASSERT(count_start_ > count_max_);
    list.check_invariants();
    std::iota(merged_into_.begin(), merged_into_.end(), 0);
    for (std::size_t s = 0; s < count_; ++s) clusters_.push_back(cluster_of(s));
  }

  // Merges until count_max_ clusters are left, and stores them in the list. False when cancelled.
  bool run() {
    // Identical chords come first: the k-d tree takes quadratic time with many of them.
    if (count_max_ > 0) merge_identical();
    if (count_max_ > 0 && !run_rounds()) return false;
    store(most_important());
    HAIRNET_ASSERT(count_ == count_max_);
    return report();
  }

 private:
  // A cluster of one stiffener. Attachments have no length, so 1 stands for L and both sums are those of k.
  [[nodiscard]] Cluster cluster_of(std::size_t s) const {
    const double k = list_.stiffness[s], q = list_.damping[s];
    const double length = kind_ == StiffenerKind::spring ? length_of(list_.weights(s)) : 1.0;
    Cluster cluster{k * length, k * length * length, q * length * length, {}};
    for (const auto& [node, weight] : list_.weights(s)) cluster.weights.push_back({node, cluster.share * weight});
    HAIRNET_ASSERT(cluster.share > 0);
    HAIRNET_ASSERT(cluster.moment > 0);
    HAIRNET_ASSERT(!cluster.weights.empty());
    return cluster;
  }

  // Stiffeners with identical ends merge without any error. Strands that share a root, or are drawn twice, are common.
  void merge_identical() {
    std::vector<std::tuple<std::uint16_t, std::array<double, 6>, std::uint32_t>> keys;
    keys.reserve(count_);
    for (std::uint32_t s = 0; s < list_.count(); ++s) {
      std::array<double, 6> ends;
      const auto by_coordinates = [](const Vec3& a, const Vec3& b) {
        return std::lexicographical_compare(a.begin(), a.end(), b.begin(), b.end());
      };
      const auto [low, high] = std::minmax(list_.ends[s][0], list_.ends[s][1], by_coordinates);
      std::ranges::copy(low, ends.begin());
      std::ranges::copy(high, ends.begin() + 3);
      keys.emplace_back(list_.group[s], ends, s);
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

  // Rounds until the count is reached or no pair is left. When few merge, the near ones have already merged into each
  // other: the next round looks further.
  bool run_rounds() {
    std::size_t neighbour_count = kNeighbourCount;
    while (count_ > count_max_) {
      const std::vector<std::vector<std::uint32_t>> groups = members_by_group();
      if (std::ranges::all_of(groups, [](const auto& members) { return members.size() < 2; })) return true;
      const std::size_t before = count_;
      if (!run_round(groups, neighbour_count)) return false;
      HAIRNET_ASSERT(count_ < before);
      HAIRNET_ASSERT(count_ >= count_max_);
      // A round that merged almost nothing had too few neighbours to choose from.
      if (before - count_ <= before / 32) neighbour_count = std::min(2 * neighbour_count, before);
    }
    return true;
  }

  // False when cancelled.
  bool run_round(const std::vector<std::vector<std::uint32_t>>& groups, std::size_t neighbour_count) {
    HAIRNET_ASSERT(neighbour_count > 0);
    std::vector<Candidate> candidates;
    for (const auto& members : groups) {
      if (!append_candidates(members, neighbour_count, candidates)) return false;
    }
    std::priority_queue<Candidate, std::vector<Candidate>, Later> heap(Later{}, std::move(candidates));
    // When half of the clusters have merged, the neighbours that were found at the start of the round are out of date.
    const std::size_t round_end = std::max(count_max_, count_ / 2);
    for (std::size_t popped = 0; count_ > round_end && !heap.empty(); ++popped) {
      if (popped % 4096 == 0 && !report()) return false;
      const Candidate candidate = heap.top();
      heap.pop();
      const auto [a, b] = std::minmax({find(candidate.a), find(candidate.b)});
      // A pair that has already become one cluster by other merges needs no merge.
      if (a == b) continue;
      // Clusters that have merged since their cost was found have moved and weigh more, so their pair is valued again.
      if (a == candidate.a && b == candidate.b && version_[a] == candidate.version_a &&
          version_[b] == candidate.version_b) {
        merge(a, b);
      } else {
        heap.push(evaluate(a, b));
      }
    }
    return true;
  }

  // False when cancelled.
  bool append_candidates(const std::vector<std::uint32_t>& members, std::size_t neighbour_count,
                         std::vector<Candidate>& candidates) const {
    // Parts have a fixed size and are joined in their order, so the result does not depend on the number of threads.
    constexpr std::size_t kPart = 4096;
    const NearestChords nearest(chords_, members);
    std::vector<std::vector<Candidate>> found((members.size() + kPart - 1) / kPart);
    std::atomic<bool> is_cancelled = false;
    hairnet::run_loop(parallel_for_, found.size(), [&](std::size_t part) {
      if (is_cancelled) return;
      if (!report()) {
        is_cancelled = true;
        return;
      }
      NearestChords::Pairs pairs;
      nearest.append_pairs(part * kPart, std::min((part + 1) * kPart, members.size()), neighbour_count, pairs);
      std::ranges::sort(pairs);
      pairs.erase(std::unique(pairs.begin(), pairs.end()), pairs.end());
      found[part].reserve(pairs.size());
      for (const auto& [a, b] : pairs) found[part].push_back(evaluate(a, b));
    });
    for (const auto& part : found) candidates.insert(candidates.end(), part.begin(), part.end());
    return !is_cancelled;
  }

  // Computes Ward's cost of a merge (decimate.hpp): how much the merged cluster errs, weighted with the moments.
  [[nodiscard]] Candidate evaluate(std::uint32_t a, std::uint32_t b) const {
    HAIRNET_ASSERT(a < b);
    HAIRNET_VALIDATE(merged_into_[a] == a);
    HAIRNET_VALIDATE(merged_into_[b] == b);
    const double moment_a = clusters_[a].moment, moment_b = clusters_[b].moment;
    const double cost = moment_a * moment_b / (moment_a + moment_b) * squared_distance(chords_[a], chords_[b]);
    return {cost, a, b, version_[a], version_[b]};
  }

  // Merges the second cluster into the first; decimate.hpp has the formulas.
  void merge(std::uint32_t kept, std::uint32_t merged) {
    HAIRNET_ASSERT(kept < merged);
    HAIRNET_ASSERT(merged_into_[kept] == kept);
    HAIRNET_ASSERT(merged_into_[merged] == merged);
    HAIRNET_ASSERT(list_.group[kept] == list_.group[merged]);
    HAIRNET_ASSERT(count_ > count_max_);
    Cluster &a = clusters_[kept], &b = clusters_[merged];
    Chord &chord_a = chords_[kept], &chord_b = chords_[merged];
    // A spring has no direction: both ends may be swapped. Without this, opposite springs would cancel in the mean.
    if ((chord_a[1] - chord_a[0]).dot(chord_b[1] - chord_b[0]) < 0) {
      std::swap(chord_b[0], chord_b[1]);
      for (NodeWeight& w : b.weights) w.weight = -w.weight;
    }
    const double share = a.share + b.share;
    for (std::size_t end : {0u, 1u}) chord_a[end] = (a.share * chord_a[end] + b.share * chord_b[end]) / share;
    // A cluster's chord is the mean of its members' ends, so distances in later rounds are those of the means.
    a.share = share;
    a.moment += b.moment;
    a.damping_moment += b.damping_moment;
    a.weights = sum_of(a.weights, b.weights);
    b.weights = {};
    merged_into_[merged] = kept;
    ++version_[kept];
    --count_;
  }

  // The cluster into which s was merged; s itself if it was not.
  std::uint32_t find(std::uint32_t s) {
    while (merged_into_[s] != s) {
      merged_into_[s] = merged_into_[merged_into_[s]];
      s = merged_into_[s];
    }
    return s;
  }

  // The clusters that are left, one list for each group of hair. Only clusters of one group may merge.
  [[nodiscard]] std::vector<std::vector<std::uint32_t>> members_by_group() const {
    std::map<std::uint16_t, std::vector<std::uint32_t>> by_group;
    std::size_t left = 0;
    for (std::uint32_t s = 0; s < merged_into_.size(); ++s) {
      if (merged_into_[s] != s) continue;
      by_group[list_.group[s]].push_back(s);
      ++left;
    }
    HAIRNET_ASSERT(left == count_);
    std::vector<std::vector<std::uint32_t>> groups;
    for (auto& [group, members] : by_group) groups.push_back(std::move(members));
    return groups;
  }

  // At most count_max_ of the remaining clusters, ascending, without those of least moment.
  [[nodiscard]] std::vector<std::uint32_t> most_important() const {
    std::vector<std::uint32_t> left;
    for (std::uint32_t s = 0; s < merged_into_.size(); ++s) {
      if (merged_into_[s] == s) left.push_back(s);
    }
    HAIRNET_ASSERT(left.size() == count_);
    if (left.size() > count_max_) {
      std::ranges::stable_sort(left, std::greater{}, [&](std::uint32_t s) { return clusters_[s].moment; });
      left.resize(count_max_);
      std::ranges::sort(left);
    }
    return left;
  }

  // The weights of a merged stiffener, without the smallest ones.
  [[nodiscard]] std::vector<NodeWeight> mean_weights(const Cluster& cluster) const {
    std::vector<NodeWeight> kept, pulling, pulled;
    for (const auto& [node, weight] : cluster.weights) {
      if (weight == 0) continue;
      (weight > 0 ? pulling : pulled).push_back({node, weight / cluster.share});
    }
    HAIRNET_ASSERT(kind_ == StiffenerKind::spring || pulled.empty());
    // The two ends of a spring are shortened separately, so its weights still sum to 0 and it never pulls at the
    // lattice as a whole.
    append_greatest(pulling, kind_ == StiffenerKind::spring ? kNodesPerEndMax : kNodesPerAttachmentMax, kept);
    append_greatest(pulled, kNodesPerEndMax, kept);
    std::ranges::sort(kept, {}, &NodeWeight::node);
    HAIRNET_ASSERT(!kept.empty());
    HAIRNET_VALIDATE(std::ranges::adjacent_find(kept, std::greater_equal{}, &NodeWeight::node) == kept.end());
    return kept;
  }

  // The length of the vector sum_j w_j p_j^0, m.
  [[nodiscard]] double length_of(std::span<const NodeWeight> weights) const {
    Vec3 vector = Vec3::Zero();
    for (const auto& [node, weight] : weights) vector += weight * grid_.node_head(node);
    return vector.norm();
  }

  // Without its smallest weights, a spring that is the mean of many directions may become almost zero in length. Its
  // stiffness does not grow beyond that of this length.
  [[nodiscard]] double length_min(std::uint32_t s) const { return 0.1 * grid_.length(chords_[s][1] - chords_[s][0]); }

  // Replaces the list by the stiffeners that these clusters stand for.
  void store(const std::vector<std::uint32_t>& survivors) {
    StiffenerList kept;
    for (const std::uint32_t s : survivors) {
      const Cluster& cluster = clusters_[s];
      // A stiffener that merged with no other keeps its own numbers bit by bit.
      const bool is_merged = version_[s] > 0;
      const auto own = list_.weights(s);
      const std::vector<NodeWeight> weights =
          is_merged ? mean_weights(cluster) : std::vector<NodeWeight>(own.begin(), own.end());
      const double length = kind_ == StiffenerKind::spring ? std::max(length_of(weights), length_min(s)) : 1.0;
      HAIRNET_ASSERT(length > 0);
      kept.entries.insert(kept.entries.end(), weights.begin(), weights.end());
      kept.begin.push_back(static_cast<std::uint32_t>(kept.entries.size()));
      // k L^2 is what a stretch along the springs feels, so the merged k is the sum of k L^2 over the square of the
      // mean's own length.
      kept.stiffness.push_back(is_merged ? cluster.moment / (length * length) : list_.stiffness[s]);
      kept.damping.push_back(is_merged ? cluster.damping_moment / (length * length) : list_.damping[s]);
      kept.group.push_back(list_.group[s]);
      kept.ends.push_back(chords_[s]);
    }
    kept.check_invariants();
    list_ = std::move(kept);
    count_ = list_.count();
  }

  // Tells the caller the finished fraction. False when the caller cancels.
  bool report() const {
    if (!keep_going_) return true;
    HAIRNET_ASSERT(count_ >= count_max_);
    HAIRNET_ASSERT(count_ <= count_start_);
    return keep_going_(static_cast<double>(count_start_ - count_) / static_cast<double>(count_start_ - count_max_));
  }

  const Grid& grid_;
  StiffenerKind kind_;
  std::size_t count_max_;
  StiffenerList& list_;
  // The caller owns all that is referenced, longer than the decimation lasts.
  const std::function<bool(double)>& keep_going_;
  const ParallelFor& parallel_for_;
  // The clusters at the start, and those that are left now.
  std::size_t count_start_, count_;
  std::vector<Cluster> clusters_;
  // The two ends of each cluster, the mean of its members' ends, in grid coordinates.
  std::vector<Chord> chords_;
  // How many merges each cluster has had. A candidate whose versions are older has an outdated cost.
  std::vector<std::uint32_t> version_;
  // A union-find structure: the cluster into which each one was merged, or its own index.
  std::vector<std::uint32_t> merged_into_;
};

}  // namespace

bool decimate(const Grid& grid, StiffenerKind kind, std::size_t count_max, StiffenerList& list,
              const std::function<bool(double)>& keep_going, const ParallelFor& parallel_for) {
  list.check_invariants();
  if (list.count() <= count_max) return true;
  return Decimation(grid, kind, count_max, list, keep_going, parallel_for).run();
}

}  // namespace hairnet
