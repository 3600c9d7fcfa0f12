#include "core/levels/build.hpp"

#include <algorithm>
#include <limits>
#include <optional>
#include <utility>

#include "core/assert.hpp"
#include "core/levels/build_progress.hpp"
#include "core/levels/cloth.hpp"
#include "core/levels/contact_points.hpp"
#include "core/levels/decimate.hpp"
#include "core/levels/ether.hpp"
#include "core/levels/fit_lattice.hpp"
#include "core/levels/hair_sample.hpp"
#include "core/levels/knots.hpp"
#include "core/levels/level_map.hpp"
#include "core/levels/lumped_hair.hpp"
#include "core/levels/make_skin.hpp"
#include "core/levels/match_response.hpp"
#include "core/levels/resample.hpp"
#include "core/levels/stiffener_list.hpp"
#include "core/levels/stiffener_order.hpp"
#include "core/levels/threads.hpp"
#include "core/levels/trim.hpp"

namespace hairnet {
namespace {

// The most nodes of a grid, since stiffeners store a node's index in 16 bits.
constexpr std::size_t kGridNodesMax = std::numeric_limits<std::uint16_t>::max();
static_assert(std::ranges::all_of(kLevelSpecs, [](const LevelSpec& spec) {
  return std::ranges::min(spec.dims) >= 3 &&
         std::cmp_less_equal(spec.dims[0] * spec.dims[1] * spec.dims[2], kGridNodesMax);
}));

// The contribution of a groom to one lattice, before any reduction.
struct GroomMechanics {
  StiffenerList springs, attachments;
  // The springs of the knots. They stay apart, since springs of hair must not displace them.
  StiffenerList ties;
  LumpedHair lumped;
  std::size_t degenerate_strands = 0;
};

// Adds a strand, or another line with the mechanics of a strand, with its own damping time.
void add_strand(std::span<const Vec3f> points, const StrandProperties& properties, const Material& material,
                const Grid& grid, GroomMechanics& mechanics, std::optional<double> own_damping_time_s = {}) {
  std::vector<Vec3> polyline, cuts;
  polyline_on_grid(grid, points, polyline);
  lump_strand(grid, polyline, properties, material, mechanics.lumped);
  const double length = arc_length(grid, polyline);
  // A strand without length has nodes that the FFD needs, but neither mass nor springs.
  if (length < kLengthMin) {
    ++mechanics.degenerate_strands;
    return;
  }
  const double hair_count = properties.hair_count;
  // All springs and the attachment of a strand share one q / k, so that damping does not depend on where the lattice
  // cuts the strand.
  const double damping_time_s = own_damping_time_s.value_or(axial_damping_time_s(material, length));
  const double axial_n = hair_count * static_cast<double>(material.axial_stiffness_n);
  cut_points(grid, polyline, cuts);
  for (std::size_t i = 1; i < cuts.size(); ++i) {
    add_spring(grid, cuts[i - 1], cuts[i], axial_n, damping_time_s, properties.group, mechanics.springs);
  }
  if (properties.rooted) {
    const double attachment_n_per_m = hair_count * static_cast<double>(material.attachment_stiffness_n_per_m);
    add_attachment(grid, polyline.front(), attachment_n_per_m, damping_time_s, properties.group, mechanics.attachments);
  }
}

// False when cancelled.
bool add_strands(const Groom& groom, const Grid& grid, const LevelProgress& progress, GroomMechanics& mechanics) {
  HAIRNET_ASSERT(groom.strand_begin.size() == groom.strand_count() + 1);
  for (std::size_t s = 0; s < groom.strand_count(); ++s) {
    const double fraction = static_cast<double>(s) / static_cast<double>(groom.strand_count());
    if (s % 1024 == 0 && !progress.at(0.3 * fraction, "cutting strands")) return false;
    const StrandProperties& properties = groom.strands[s];
    add_strand(groom.strand_points(s), properties, groom.materials.of(properties.group), grid, mechanics);
  }
  std::vector<Vec3f> middle;
  for (const HairCard& card : groom.cards) {
    middle_of(groom, card, middle);
    add_strand(middle, card.properties, groom.materials.of(card.properties.group), grid, mechanics);
  }
  return true;
}

// Marks the nodes of stiffeners as touched. A stiffener may reach into cells without hair or cloth: a knot's frame, a
// triangle's corner.
void touch_nodes(const StiffenerList& list, LumpedHair& lumped) {
  HAIRNET_VALIDATE(
      std::ranges::all_of(list.entries, [&](const NodeWeight& entry) { return entry.node < lumped.touched.size(); }));
  for (const NodeWeight& entry : list.entries) lumped.touched[entry.node] = true;
}

// Adds threads, cloth and knots. Stiffeners merge within a group only, so fabric has other groups than hair, and each
// knot has its own.
void add_fabric(const Groom& groom, const Grid& grid, GroomMechanics& mechanics) {
  const std::size_t group_count = groom.group_names.size();
  HAIRNET_ASSERT(2 * group_count <= std::numeric_limits<std::uint16_t>::max());
  HAIRNET_ASSERT(groom.knots.size() <= std::numeric_limits<std::uint16_t>::max());
  for (const Thread& thread : groom.threads) {
    const ThreadAsStrand strand(thread, groom.materials.base, static_cast<std::uint16_t>(group_count + thread.group));
    add_strand(groom.points_of(thread.points), strand.properties, strand.material, grid, mechanics,
               double{thread.damping_time_s});
  }
  for (const Cloth& cloth : groom.cloths) {
    const auto group = static_cast<std::uint16_t>(group_count + cloth.group);
    add_cloth(grid, groom.points, cloth, group, mechanics.springs, mechanics.attachments);
    lump_cloth(grid, groom.points, cloth, groom.materials.base, mechanics.lumped);
  }
  for (std::size_t k = 0; k < groom.knots.size(); ++k) {
    add_knot(grid, groom.points, groom.knots[k], static_cast<std::uint16_t>(k), mechanics.ties);
    add_knot_mass(grid, groom.points, groom.knots[k], groom.materials.base, mechanics.lumped);
  }
  touch_nodes(mechanics.ties, mechanics.lumped);
  touch_nodes(mechanics.springs, mechanics.lumped);
}

// Reduces the springs of knots and of all else to `count_max` together. Knots may take a quarter, and what hair and
// fabric do not need. False when cancelled.
bool decimate_springs(const Grid& grid, std::size_t count_max, const std::function<bool(double)>& keep_going,
                      const ParallelFor& parallel_for, GroomMechanics& mechanics) {
  constexpr StiffenerKind kSpring = StiffenerKind::spring;
  const std::size_t left_over = count_max - std::min(count_max, mechanics.springs.count());
  if (!decimate(grid, kSpring, std::max(count_max / 4, left_over), mechanics.ties)) return false;
  HAIRNET_ASSERT(mechanics.ties.count() <= count_max);
  if (!decimate(grid, kSpring, count_max - mechanics.ties.count(), mechanics.springs, keep_going, parallel_for))
    return false;
  append(mechanics.ties, mechanics.springs);
  HAIRNET_ASSERT(mechanics.springs.count() <= count_max);
  return true;
}

// False when cancelled.
bool decimate_both(const Grid& grid, const LevelSpec& spec, const LevelProgress& progress,
                   const ParallelFor& parallel_for, GroomMechanics& mechanics) {
  const auto springs_done = [&](double share) { return progress.at(0.3 + 0.3 * share, "merging springs"); };
  const auto attachments_done = [&](double share) { return progress.at(0.6 + 0.1 * share, "merging attachments"); };
  return decimate_springs(grid, spec.spring_count, springs_done, parallel_for, mechanics) &&
         decimate(grid, StiffenerKind::attachment, spec.attachment_count, mechanics.attachments, attachments_done,
                  parallel_for);
}

// The active index of each node of the grid, or kTrimmed.
constexpr std::uint32_t kTrimmed = ~0u;
std::vector<std::uint32_t> active_indices(const LevelGeometry& geometry) {
  HAIRNET_ASSERT(!geometry.active_nodes.empty());
  HAIRNET_ASSERT(geometry.active_nodes.back() < geometry.lattice.node_count());
  std::vector<std::uint32_t> indices(geometry.lattice.node_count(), kTrimmed);
  for (std::uint32_t a = 0; a < geometry.active_nodes.size(); ++a) indices[geometry.active_nodes[a]] = a;
  return indices;
}

// Converts a list to active indices and float. Rest values are computed from the stored weights and positions, so that
// the design is in balance to the last bit that the solver uses.
Stiffeners store_stiffeners(const StiffenerList& list, const std::vector<std::uint32_t>& active_index,
                            const std::vector<Vec3f>& rest_head) {
  list.check_invariants();
  Stiffeners stored;
  for (std::size_t s = 0; s < list.count(); ++s) {
    Vec3 rest = Vec3::Zero();
    for (const auto& [node, weight] : list.weights(s)) {
      const std::uint32_t active = active_index[node];
      HAIRNET_ASSERT(active != kTrimmed);
      stored.nodes.push_back(static_cast<std::uint16_t>(active));
      stored.weights.push_back(static_cast<float>(weight));
      rest += static_cast<double>(stored.weights.back()) * rest_head[active].cast<double>();
    }
    stored.begin.push_back(static_cast<std::uint32_t>(stored.nodes.size()));
    stored.stiffness.push_back(static_cast<float>(list.stiffness[s]));
    stored.damping.push_back(static_cast<float>(list.damping[s]));
    stored.rest.push_back(rest.cast<float>());
  }
  HAIRNET_ASSERT(stored.count() == list.count());
  HAIRNET_ASSERT(stored.begin.back() == list.entries.size());
  return stored;
}

void store_level(const GroomMechanics& mechanics, Level& level) {
  HAIRNET_ASSERT(level.rest.empty());
  const std::vector<std::uint32_t>& active_nodes = level.geometry.active_nodes;
  const std::vector<std::uint32_t> active_index = active_indices(level.geometry);
  for (std::uint32_t a = 0; a < active_nodes.size(); ++a) {
    level.rest.push_back(level.geometry.lattice.node(active_nodes[a]));
    std::array<float, 6>& drag = level.drag.emplace_back();
    for (int c = 0; c < 6; ++c) drag[c] = static_cast<float>(mechanics.lumped.drag[active_nodes[a]][c]);
  }
  const NodeMechanics nodes = fill_ether(level.geometry, mechanics.lumped);
  level.mass.assign(nodes.mass.begin(), nodes.mass.end());
  level.ether_stiffness.assign(nodes.ether_stiffness.begin(), nodes.ether_stiffness.end());
  level.ether_damping.assign(nodes.ether_damping.begin(), nodes.ether_damping.end());
  HAIRNET_ASSERT(level.mass.size() == level.rest.size());
  level.springs = store_stiffeners(mechanics.springs, active_index, level.rest);
  level.attachments = store_stiffeners(mechanics.attachments, active_index, level.rest);
}

// The farthest that a node may be from its design. Hair on a head upside down hangs twice its own length from its
// design, and swings and stretches further.
float displacement_max_m(const Lattice& lattice) {
  const Vec3f cells(static_cast<float>(lattice.dims[0] - 1), static_cast<float>(lattice.dims[1] - 1),
                    static_cast<float>(lattice.dims[2] - 1));
  return 2.5f * lattice.spacing.cwiseProduct(cells).norm();
}

// False when cancelled.
bool match_springs(const StiffenerList& all_springs, const StiffenerList& all_attachments,
                   const LevelProgress& progress, Level& level) {
  HAIRNET_ASSERT(level.springs.count() <= all_springs.count());
  // Nothing was merged, so there is no difference to fit away.
  if (level.springs.count() == all_springs.count()) return true;
  const std::vector<std::uint32_t> active_index = active_indices(level.geometry);
  const auto matched = [&](double share) { return progress.at(0.75 + 0.25 * share, "matching the springs"); };
  return match_response(store_stiffeners(all_springs, active_index, level.rest),
                        store_stiffeners(all_attachments, active_index, level.rest), level, matched);
}

// Builds one level. The progress ends at 0.3 for cutting strands, 0.6 for merging springs, 0.7 for merging attachments
// and 0.75 for contact points; matching the springs has the rest. False when cancelled.
bool make_level(const Groom& groom, const LevelSpec& spec, std::shared_ptr<const Skin> skin,
                const LevelProgress& progress, const ParallelFor& parallel_for, Level& level, LevelReport& report) {
  const double start_s = progress.clock_s();
  const Grid grid(fit_lattice(groom.points, spec.dims));
  HAIRNET_ASSERT(grid.node_count() <= kGridNodesMax);

  GroomMechanics mechanics{{}, {}, {}, LumpedHair(grid.node_count())};
  if (!add_strands(groom, grid, progress, mechanics)) return false;
  add_fabric(groom, grid, mechanics);
  report.springs_before = mechanics.springs.count() + mechanics.ties.count();
  report.attachments_before = mechanics.attachments.count();
  report.degenerate_strands = mechanics.degenerate_strands;

  const double decimation_start_s = progress.clock_s();
  // The full lists are kept, as match_springs compares the reduced lattice with them.
  StiffenerList all_springs = mechanics.springs;
  append(mechanics.ties, all_springs);
  const StiffenerList all_attachments = mechanics.attachments;
  if (!decimate_both(grid, spec, progress, parallel_for, mechanics)) return false;
  if (!progress.at(0.7, "placing contact points")) return false;
  // The nodes that hair touches are active, whichever springs survived, so all levels of these dimensions have the same
  // nodes.
  level.geometry = trim(grid.lattice(), mechanics.lumped.touched);
  level.displacement_max_m = displacement_max_m(grid.lattice());
  store_level(mechanics, level);
  level.skin = std::move(skin);
  level.contacts = make_contact_points(groom, level.geometry, level.mass, *level.skin, spec.contact_count);

  if (!match_springs(all_springs, all_attachments, progress, level)) return false;
  order_by_nodes(level.springs);
  order_by_nodes(level.attachments);
  report.decimation_s = progress.clock_s() - decimation_start_s;

  HAIRNET_ASSERT(level.springs.count() <= spec.spring_count);
  HAIRNET_ASSERT(level.attachments.count() <= spec.attachment_count);
  HAIRNET_ASSERT(level.contacts.count() <= spec.contact_count);
  report.springs_after = level.springs.count();
  report.attachments_after = level.attachments.count();
  report.active_nodes = level.geometry.active_nodes.size();
  report.contacts = level.contacts.count();
  report.total_s = progress.clock_s() - start_s;
  return progress.at(1, "level built");
}

}  // namespace

void make_level_maps(const Groom& groom, LevelSet& set, const ParallelFor& parallel_for) {
  // The most hair points to which maps between levels are fitted.
  constexpr std::size_t kMapPoints = 6000;
  HAIRNET_ASSERT(!groom.points.empty());
  const HairSample sample = sample_hair(groom, kMapPoints);
  make_level_maps(set, sample.points, sample.blend, parallel_for);
}

std::shared_ptr<const Level> build_level(const Groom& groom, const LevelSpec& spec, const BuildCallbacks& callbacks,
                                         LevelReport* report, const ParallelFor& parallel_for) {
  HAIRNET_ASSERT(!groom.points.empty());
  HAIRNET_VALIDATE(validate(groom).empty());
  BuildProgress progress(callbacks, 1);
  const auto measuring = [&progress] { return progress.at(0, 0, "measuring the skin"); };
  const std::shared_ptr<const Skin> skin = measuring() ? make_skin(groom, parallel_for, measuring) : nullptr;
  if (!skin) return nullptr;
  auto level = std::make_shared<Level>();
  LevelReport own_report;
  LevelReport& counts = report ? *report : own_report;
  counts = {};
  if (!make_level(groom, spec, skin, {progress}, parallel_for, *level, counts)) return nullptr;
  return level;
}

std::shared_ptr<const LevelSet> build_levels(const Groom& groom, const BuildCallbacks& callbacks,
                                             std::array<LevelReport, 4>* reports, const ParallelFor& parallel_for) {
  HAIRNET_ASSERT(!groom.points.empty());
  HAIRNET_VALIDATE(validate(groom).empty());
  BuildProgress progress(callbacks, kLevelSpecs.size());
  const auto measuring = [&progress] { return progress.at(0, 0, "measuring the skin"); };
  const std::shared_ptr<const Skin> skin = measuring() ? make_skin(groom, parallel_for, measuring) : nullptr;
  if (!skin) return nullptr;
  auto set = std::make_shared<LevelSet>();
  std::array<LevelReport, 4> own_reports;
  // Levels share nothing but the skin, so they are built at the same time.
  std::array<bool, kLevelSpecs.size()> is_made{};
  run_loop(parallel_for, kLevelSpecs.size(), [&](std::size_t i) {
    LevelReport& report = (reports ? *reports : own_reports)[i];
    report = {};
    is_made[i] = make_level(groom, kLevelSpecs[i], skin, {progress, i}, parallel_for, set->levels[i], report);
  });
  if (std::ranges::find(is_made, false) != is_made.end()) return nullptr;
  make_level_maps(groom, *set, parallel_for);
  return set;
}

}  // namespace hairnet
