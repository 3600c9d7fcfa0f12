#include "core/build/build.hpp"

#include <algorithm>
#include <cassert>
#include <limits>

#include "core/build/body_balls.hpp"
#include "core/build/decimate.hpp"
#include "core/build/ether.hpp"
#include "core/build/fit_lattice.hpp"
#include "core/build/level_map.hpp"
#include "core/build/metaballs.hpp"
#include "core/build/node_shares.hpp"
#include "core/build/resample.hpp"
#include "core/build/stiffener_list.hpp"
#include "core/build/trim.hpp"
#include "core/ffd/deform.hpp"

namespace hairnet {
namespace {

// A part [begin, end] of the caller's whole progress.
struct Progress {
  const BuildObserver& observer;
  double begin = 0, end = 1;

  // False to cancel.
  [[nodiscard]] bool at(double fraction, std::string_view stage) const {
    return !observer.progress || observer.progress(begin + fraction * (end - begin), stage);
  }
  [[nodiscard]] double clock_s() const { return observer.clock_s ? observer.clock_s() : 0; }
};

// What all strands give to one lattice, before any of it is reduced.
struct StrandMechanics {
  StiffenerList springs, attachments;
  NodeShares shares;
  std::size_t degenerate_strands = 0;
};

void add_strand(const Groom& groom, const Material& material, const Grid& grid, std::size_t strand,
                StrandMechanics& mechanics) {
  const StrandProperties& properties = groom.strands[strand];
  std::vector<Vec3> polyline, cuts;
  polyline_on_grid(grid, groom.strand_points(strand), polyline);
  add_strand_shares(grid, polyline, properties, material, mechanics.shares);
  if (arc_length(grid, polyline) < kLengthMin) {
    ++mechanics.degenerate_strands;
    return;
  }
  cut_points(grid, polyline, cuts);
  for (std::size_t i = 1; i < cuts.size(); ++i) {
    add_spring(grid, cuts[i - 1], cuts[i], properties, material, mechanics.springs);
  }
  if (properties.rooted) add_attachment(grid, polyline.front(), properties, material, mechanics.attachments);
}

// False when cancelled.
bool add_strands(const Groom& groom, const Material& material, const Grid& grid, const Progress& progress,
                 StrandMechanics& mechanics) {
  for (std::size_t s = 0; s < groom.strand_count(); ++s) {
    const double fraction = static_cast<double>(s) / static_cast<double>(groom.strand_count());
    if (s % 1024 == 0 && !progress.at(0.3 * fraction, "cutting strands")) return false;
    add_strand(groom, material, grid, s, mechanics);
  }
  return true;
}

// False when cancelled.
bool decimate_both(const LevelSpec& spec, const Progress& progress, StrandMechanics& mechanics) {
  const auto springs_done = [&](double share) { return progress.at(0.3 + 0.5 * share, "merging springs"); };
  const auto attachments_done = [&](double share) { return progress.at(0.8 + 0.1 * share, "merging attachments"); };
  return decimate(StiffenerKind::spring, spec.spring_count, mechanics.springs, springs_done) &&
         decimate(StiffenerKind::attachment, spec.attachment_count, mechanics.attachments, attachments_done);
}

// To active indices and float; the rest is taken of what is stored, so that the design is in balance to the last bit
// that the solver sees.
Stiffeners store_stiffeners(const StiffenerList& list, const std::vector<std::uint32_t>& active_index,
                            const std::vector<Vec3f>& rest_head) {
  Stiffeners stored;
  for (std::size_t s = 0; s < list.count(); ++s) {
    Vec3 rest = Vec3::Zero();
    for (const auto& [node, weight] : list.weights(s)) {
      const std::uint32_t active = active_index[node];
      stored.nodes.push_back(static_cast<std::uint16_t>(active));
      stored.weights.push_back(static_cast<float>(weight));
      rest += static_cast<double>(stored.weights.back()) * rest_head[active].cast<double>();
    }
    stored.begin.push_back(static_cast<std::uint32_t>(stored.nodes.size()));
    stored.stiffness.push_back(static_cast<float>(list.stiffness[s]));
    stored.damping.push_back(static_cast<float>(list.damping[s]));
    stored.rest.push_back(rest.cast<float>());
  }
  return stored;
}

void store_level(const StrandMechanics& mechanics, const Material& material, const BodyShape& body, Level& level) {
  const std::vector<std::uint32_t>& active_nodes = level.geometry.active_nodes;
  std::vector<std::uint32_t> active_index(level.geometry.lattice.node_count(), 0);
  for (std::uint32_t a = 0; a < active_nodes.size(); ++a) {
    active_index[active_nodes[a]] = a;
    level.rest.push_back(level.geometry.lattice.node(active_nodes[a]));
    std::array<float, 6>& drag = level.drag.emplace_back();
    for (int c = 0; c < 6; ++c) drag[c] = static_cast<float>(mechanics.shares.drag[active_nodes[a]][c]);
  }
  const NodeMechanics nodes = fill_ether(level.geometry, mechanics.shares, material);
  level.mass.assign(nodes.mass.begin(), nodes.mass.end());
  level.ether_stiffness.assign(nodes.ether_stiffness.begin(), nodes.ether_stiffness.end());
  level.ether_damping.assign(nodes.ether_damping.begin(), nodes.ether_damping.end());
  level.springs = store_stiffeners(mechanics.springs, active_index, level.rest);
  level.attachments = store_stiffeners(mechanics.attachments, active_index, level.rest);
  level.metaballs = fit_metaballs(body, make_stencils(level.geometry, body.hair), level.rest, nodes.mass, material);
}

// Hair on a head upside down hangs twice its own length from its design, and stretches a little.
float displacement_max_m(const Lattice& lattice) {
  const Vec3f cells(static_cast<float>(lattice.dims[0] - 1), static_cast<float>(lattice.dims[1] - 1),
                    static_cast<float>(lattice.dims[2] - 1));
  return 2 * lattice.spacing.cwiseProduct(cells).norm();
}

std::size_t contact_count(const Level& level) {
  std::size_t count = 0;
  for (const Metaball& ball : level.metaballs) {
    count += ball.radius.size() - static_cast<std::size_t>(std::ranges::count(ball.radius, 0.0f));
  }
  return count;
}

// False when cancelled.
bool make_level(const Groom& groom, const Material& material, const LevelSpec& spec, const BodyShape& body,
                const Progress& progress, Level& level, LevelReport& report) {
  const double start_s = progress.clock_s();
  const Grid grid(fit_lattice(groom.points, spec.dims));
  assert(grid.node_count() <= std::numeric_limits<std::uint16_t>::max());

  StrandMechanics mechanics{{}, {}, NodeShares(grid.node_count())};
  if (!add_strands(groom, material, grid, progress, mechanics)) return false;
  report.springs_before = mechanics.springs.count();
  report.attachments_before = mechanics.attachments.count();
  report.degenerate_strands = mechanics.degenerate_strands;

  const double decimation_start_s = progress.clock_s();
  if (!decimate_both(spec, progress, mechanics)) return false;
  report.decimation_s = progress.clock_s() - decimation_start_s;

  if (!progress.at(0.9, "fitting metaballs")) return false;
  level.geometry = trim(grid.lattice(), mechanics.shares.touched);
  level.displacement_max_m = displacement_max_m(grid.lattice());
  store_level(mechanics, material, body, level);

  report.springs_after = level.springs.count();
  report.attachments_after = level.attachments.count();
  report.active_nodes = level.geometry.active_nodes.size();
  report.contacts = contact_count(level);
  report.total_s = progress.clock_s() - start_s;
  return progress.at(1, "level built");
}

// An even part of the hair's points stands for all of them in the maps between levels.
void connect(const Groom& groom, LevelSet& set) {
  constexpr std::size_t kMapPoints = 6000;
  const std::vector<float> blend = root_blend(groom);
  const std::size_t stride = std::max<std::size_t>(1, groom.points.size() / kMapPoints);
  std::vector<Vec3f> some_points;
  std::vector<float> some_blend;
  // Strands of equal length would else give the same point of each again and again.
  for (std::size_t p = 0; p < groom.points.size(); p += stride + (p / stride) % 2) {
    some_points.push_back(groom.points[p]);
    some_blend.push_back(blend[p]);
  }
  connect_levels(set, some_points, some_blend);
}

}  // namespace

std::shared_ptr<const Level> build_level(const Groom& groom, const Material& material, const LevelSpec& spec,
                                         const BuildObserver& observer, LevelReport* report) {
  const Progress progress{observer};
  if (!progress.at(0, "placing metaballs")) return nullptr;
  const BodyShape body = place_balls(groom);
  auto level = std::make_shared<Level>();
  LevelReport own_report;
  LevelReport& counts = report ? *report : own_report;
  counts = {};
  if (!make_level(groom, material, spec, body, progress, *level, counts)) return nullptr;
  return level;
}

std::shared_ptr<const LevelSet> build_levels(const Groom& groom, const Material& material,
                                             const BuildObserver& observer, std::array<LevelReport, 4>* reports) {
  if (!Progress{observer}.at(0, "placing metaballs")) return nullptr;
  const BodyShape body = place_balls(groom);
  auto set = std::make_shared<LevelSet>();
  std::array<LevelReport, 4> own_reports;
  for (std::size_t i = 0; i < kLevelSpecs.size(); ++i) {
    const double part = 1.0 / static_cast<double>(kLevelSpecs.size());
    const Progress progress{observer, static_cast<double>(i) * part, static_cast<double>(i + 1) * part};
    LevelReport& report = (reports ? *reports : own_reports)[i];
    report = {};
    if (!make_level(groom, material, kLevelSpecs[i], body, progress, set->levels[i], report)) return nullptr;
  }
  connect(groom, *set);
  return set;
}

}  // namespace hairnet
