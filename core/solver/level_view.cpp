#include "core/solver/level_view.hpp"

#include <algorithm>
#include <limits>

#include "core/assert.hpp"

namespace hairnet {
namespace {

// Whether `begin` has the offsets of runs of entries that name nodes. Each run has at least `entries_min` entries: 1
// for a stiffener, 0 for a contact point.
[[maybe_unused]] bool are_runs_of_nodes(const std::vector<std::uint32_t>& begin,
                                        const std::vector<std::uint16_t>& nodes, std::size_t node_count,
                                        std::size_t entries_min) {
  if (begin.front() != 0 || begin.back() != nodes.size()) return false;
  for (std::size_t run = 0; run + 1 < begin.size(); ++run) {
    if (begin[run] + entries_min > begin[run + 1]) return false;
  }
  return std::ranges::all_of(nodes, [node_count](std::uint16_t node) { return node < node_count; });
}

void check_view_stiffeners(const Stiffeners& s, std::size_t node_count) {
  HAIRNET_ASSERT(s.begin.size() == s.count() + 1);
  HAIRNET_ASSERT(s.damping.size() == s.count());
  HAIRNET_ASSERT(s.rest.size() == s.count());
  HAIRNET_ASSERT(s.weights.size() == s.nodes.size());
  HAIRNET_VALIDATE(are_runs_of_nodes(s.begin, s.nodes, node_count, 1));
}

void check_view_contacts(const ContactPoints& contacts, std::size_t field_count, std::size_t node_count) {
  HAIRNET_ASSERT(contacts.begin.size() == contacts.count() + 1);
  HAIRNET_ASSERT(contacts.weights.size() == contacts.nodes.size());
  HAIRNET_ASSERT(contacts.potential.size() == contacts.count());
  HAIRNET_ASSERT(contacts.limit.size() == contacts.count() * field_count);
  HAIRNET_VALIDATE(are_runs_of_nodes(contacts.begin, contacts.nodes, node_count, 0));
}

// Sizes that the kernels rely on. They never check an index.
void check_view_arrays(const Level& level) {
  const std::size_t node_count = level.rest.size();
  HAIRNET_ASSERT(level.geometry.active_nodes.size() == node_count);
  HAIRNET_ASSERT(level.mass.size() == node_count);
  HAIRNET_ASSERT(level.ether_stiffness.size() == node_count);
  HAIRNET_ASSERT(level.ether_damping.size() == node_count);
  HAIRNET_ASSERT(level.drag.size() == node_count);
  HAIRNET_ASSERT(level.displacement_max_m > 0);
  HAIRNET_ASSERT(level.skin);
  check_view_stiffeners(level.springs, node_count);
  check_view_stiffeners(level.attachments, node_count);
  check_view_contacts(level.contacts, level.skin->size(), node_count);
}

StiffenerView make_view(const Stiffeners& s, const float* rest_length) {
  return {s.count(),
          s.begin.data(),
          s.nodes.data(),
          s.weights.data(),
          s.stiffness.data(),
          s.damping.data(),
          s.rest.empty() ? nullptr : s.rest.front().data(),
          rest_length};
}

void put_rest_lengths(const Stiffeners& springs, std::vector<float>& length) {
  length.clear();
  for (const Vec3f& rest : springs.rest) length.push_back(rest.norm());
}

void put_wind_fractions(const LevelGeometry& geometry, std::vector<float>& fraction) {
  fraction.clear();
  HAIRNET_ASSERT(geometry.active_nodes.empty() || std::ranges::min(geometry.lattice.dims) >= 2);
  for (const std::uint32_t node : geometry.active_nodes) {
    const auto coordinates = geometry.lattice.coordinates(node);
    for (std::size_t axis = 0; axis < 3; ++axis) {
      fraction.push_back(static_cast<float>(coordinates[axis]) / static_cast<float>(geometry.lattice.dims[axis] - 1));
    }
  }
}

// An entry's number is exact in float up to here.
constexpr std::size_t kFieldEntriesMax = std::size_t{1} << std::numeric_limits<float>::digits;

void put_skin(const Level& level, std::vector<SkinDistanceFieldView>& skin) {
  skin.clear();
  const float* limit = level.contacts.limit.data();
  for (const SkinDistanceField& field : *level.skin) {
    HAIRNET_ASSERT(static_cast<std::size_t>(field.bone) < kBoneCount);
    HAIRNET_ASSERT(field.cell_m > 0);
    HAIRNET_ASSERT(std::ranges::min(field.dims) >= 2);
    HAIRNET_ASSERT(field.distance.size() == static_cast<std::size_t>(field.dims[0]) *
                                                static_cast<std::size_t>(field.dims[1]) *
                                                static_cast<std::size_t>(field.dims[2]));
    HAIRNET_ASSERT(field.distance.size() <= kFieldEntriesMax);
    SkinDistanceFieldView view{};
    view.bone = static_cast<std::size_t>(field.bone);
    for (std::size_t a = 0; a < 3; ++a) {
      view.cells[a] = static_cast<float>(field.dims[a] - 1);
      view.origin[a] = field.origin[static_cast<Eigen::Index>(a)];
    }
    view.per_cell = 1 / field.cell_m;
    view.row = field.dims[0];
    view.layer = field.dims[0] * field.dims[1];
    view.distance = field.distance.data();
    // The limits of all points against one field follow those against the field before it.
    view.limit = limit;
    limit += level.contacts.count();
    skin.push_back(view);
  }
}

ContactPointsView make_view(const ContactPoints& contacts) {
  return {contacts.count(),
          contacts.begin.data(),
          contacts.nodes.data(),
          contacts.weights.data(),
          contacts.rest.empty() ? nullptr : contacts.rest.front().data(),
          contacts.potential.data()};
}

// Incidences name stiffeners with 16 bits, as the lists take half of the memory that way.
constexpr std::size_t kIncidentStiffenersMax = std::size_t{1} << std::numeric_limits<std::uint16_t>::digits;

// Turns the lists of stiffeners around: for each node, the stiffeners that act on it and its weights. Springs come
// first, then attachments, so every node sums its pulls in the same order.
IncidenceView put_incidences(const Level& level, LevelViewScratch& scratch) {
  HAIRNET_ASSERT(level.springs.count() + level.attachments.count() <= kIncidentStiffenersMax);
  // Counts are stored one place later, so that after filling a node's entries begin[node + 1] is the start of the next
  // node's.
  auto& begin = scratch.incidence_begin;
  begin.assign(level.rest.size() + 2, 0);
  for (const Stiffeners* list : {&level.springs, &level.attachments}) {
    for (const std::uint16_t node : list->nodes) ++begin[node + 2u];
  }
  for (std::size_t i = 2; i < begin.size(); ++i) begin[i] += begin[i - 1];
  scratch.incidence_stiffeners.resize(begin.back());
  scratch.incidence_weights.resize(begin.back());
  std::size_t first = 0;
  for (const Stiffeners* list : {&level.springs, &level.attachments}) {
    for (std::size_t s = 0; s < list->count(); ++s) {
      for (std::uint32_t e = list->begin[s]; e < list->begin[s + 1]; ++e) {
        const std::uint32_t at = begin[list->nodes[e] + 1u]++;
        scratch.incidence_stiffeners[at] = static_cast<std::uint16_t>(first + s);
        scratch.incidence_weights[at] = list->weights[e];
      }
    }
    first += list->count();
  }
  HAIRNET_ASSERT(begin[level.rest.size()] == scratch.incidence_stiffeners.size());
  return {begin.data(), scratch.incidence_stiffeners.data(), scratch.incidence_weights.data()};
}

}  // namespace

LevelView make_view(const Level& level, const ViewFor& what_for, LevelViewScratch& scratch) {
  check_view_arrays(level);
  put_rest_lengths(level.springs, scratch.rest_length);
  if (what_for.wind) put_wind_fractions(level.geometry, scratch.wind_fraction);
  put_skin(level, scratch.skin);
  return {level.rest.size(),
          level.displacement_max_m,
          level.rest.empty() ? nullptr : level.rest.front().data(),
          level.mass.data(),
          level.ether_stiffness.data(),
          level.ether_damping.data(),
          level.drag.empty() ? nullptr : level.drag.front().data(),
          what_for.wind ? scratch.wind_fraction.data() : nullptr,
          make_view(level.springs, scratch.rest_length.data()),
          make_view(level.attachments, nullptr),
          what_for.crowd ? put_incidences(level, scratch) : IncidenceView{},
          scratch.skin.data(),
          scratch.skin.size(),
          make_view(level.contacts),
          what_for.bodies,
          what_for.holds};
}

}  // namespace hairnet
