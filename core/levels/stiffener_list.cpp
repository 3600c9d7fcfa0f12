#include "core/levels/stiffener_list.hpp"

#include <algorithm>
#include <cmath>
#include <functional>

#include "core/assert.hpp"
#include "core/levels/resample.hpp"

namespace hairnet {
namespace {

// Appends `plus` minus `minus`, two ascending lists; a node in both gets one entry, or none when the weights cancel.
void append_difference(const TrilinearWeights& plus, const TrilinearWeights& minus, std::vector<NodeWeight>& entries) {
  const NodeWeight* p = plus.begin();
  const NodeWeight* m = minus.begin();
  while (p != plus.end() || m != minus.end()) {
    if (m == minus.end() || (p != plus.end() && p->node < m->node)) {
      entries.push_back(*p++);
    } else if (p == plus.end() || m->node < p->node) {
      entries.push_back({m->node, -m->weight});
      ++m;
    } else {
      if (p->weight != m->weight) entries.push_back({p->node, p->weight - m->weight});
      ++p;
      ++m;
    }
  }
}

void close_stiffener(double stiffness, double damping_time_s, std::uint16_t group, const std::array<Vec3, 2>& ends,
                     StiffenerList& list) {
  HAIRNET_ASSERT(stiffness >= kStoredStiffnessMin);
  HAIRNET_ASSERT(std::isfinite(stiffness));
  HAIRNET_ASSERT(damping_time_s >= 0);
  HAIRNET_ASSERT(list.begin.back() < list.entries.size());
  list.begin.push_back(static_cast<std::uint32_t>(list.entries.size()));
  list.stiffness.push_back(stiffness);
  list.damping.push_back(stiffness * damping_time_s);
  list.group.push_back(group);
  list.ends.push_back(ends);
  list.check_invariants();
  HAIRNET_VALIDATE(std::ranges::adjacent_find(list.weights(list.count() - 1), std::greater_equal{},
                                              &NodeWeight::node) == list.weights(list.count() - 1).end());
}

}  // namespace

void StiffenerList::check_invariants() const {
  HAIRNET_ASSERT(begin.size() == count() + 1);
  HAIRNET_ASSERT(begin.front() == 0);
  HAIRNET_ASSERT(begin.back() == entries.size());
  HAIRNET_ASSERT(damping.size() == count());
  HAIRNET_ASSERT(group.size() == count());
  HAIRNET_ASSERT(ends.size() == count());
}

void add_spring(const Grid& grid, const Vec3& from, const Vec3& to, double axial_stiffness_n, double damping_time_s,
                std::uint16_t group, StiffenerList& springs) {
  const double chord = grid.length(to - from);
  add_spring(grid, from, to, {axial_stiffness_n / std::max(chord, piece_length_min(grid)), damping_time_s, group},
             springs);
}

void add_spring(const Grid& grid, const Vec3& from, const Vec3& to, const SpringLaw& law, StiffenerList& springs) {
  // Written so that a stiffness that is NaN adds nothing.
  if (grid.length(to - from) < kLengthMin || !(law.stiffness_n_per_m >= kStoredStiffnessMin)) return;
  append_difference(grid.weights(to), grid.weights(from), springs.entries);
  close_stiffener(law.stiffness_n_per_m, law.damping_time_s, law.group, {from, to}, springs);
}

void append(const StiffenerList& more, StiffenerList& list) {
  HAIRNET_ASSERT(&more != &list);
  more.check_invariants();
  for (std::size_t s = 0; s < more.count(); ++s) {
    const auto weights = more.weights(s);
    list.entries.insert(list.entries.end(), weights.begin(), weights.end());
    list.begin.push_back(static_cast<std::uint32_t>(list.entries.size()));
  }
  list.stiffness.insert(list.stiffness.end(), more.stiffness.begin(), more.stiffness.end());
  list.damping.insert(list.damping.end(), more.damping.begin(), more.damping.end());
  list.group.insert(list.group.end(), more.group.begin(), more.group.end());
  list.ends.insert(list.ends.end(), more.ends.begin(), more.ends.end());
  list.check_invariants();
}

void add_attachment(const Grid& grid, const Vec3& point, double stiffness_n_per_m, double damping_time_s,
                    std::uint16_t group, StiffenerList& attachments) {
  if (!(stiffness_n_per_m >= kStoredStiffnessMin)) return;
  const TrilinearWeights weights = grid.weights(point);
  attachments.entries.insert(attachments.entries.end(), weights.begin(), weights.end());
  close_stiffener(stiffness_n_per_m, damping_time_s, group, {point, point}, attachments);
}

}  // namespace hairnet
