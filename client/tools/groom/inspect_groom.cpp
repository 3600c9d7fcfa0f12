#include <algorithm>
#include <chrono>
#include <cstdio>

#include "client/assets/load_groom.hpp"
#include "client/tools/command_line/progress_bar.hpp"
#include "client/tools/groom/commands.hpp"
#include "core/levels/build.hpp"
#include "core/modes/make_modes.hpp"
#include "core/shown_text.hpp"

namespace hairnet::groom {
namespace {

// Names come from files of others: they are cut and escaped, so that they cannot write to the terminal.
constexpr std::size_t kNameBytesMax = 200;

double now_s() {
  return std::chrono::duration<double>(std::chrono::steady_clock::now().time_since_epoch()).count();
}

void print_lengths(const Groom& groom) {
  std::vector<double> lengths;
  for (std::size_t s = 0; s < groom.strand_count(); ++s) {
    const auto points = groom.strand_points(s);
    double length = 0;
    for (std::size_t i = 1; i < points.size(); ++i) length += static_cast<double>((points[i] - points[i - 1]).norm());
    lengths.push_back(length);
  }
  if (lengths.empty()) return;
  std::ranges::sort(lengths);
  std::printf("lengths    %.3f / %.3f / %.3f m (least, median, most)\n", lengths.front(), lengths[lengths.size() / 2],
              lengths.back());
}

void print_material(const Material& m) {
  std::printf("material   %s: stiffness %g N a hair, attachments %g N/m, damping %g, density %g kg/m, drag %g Ns/m2,\n",
              std::string(material_name(m)).c_str(), static_cast<double>(m.axial_stiffness_n),
              static_cast<double>(m.attachment_stiffness_n_per_m), static_cast<double>(m.damping_ratio),
              static_cast<double>(m.linear_density_kg_per_m), static_cast<double>(m.air_drag_ns_per_m2));
  std::printf("           gel %g /s2, ether damping %g, roots %g m, %g m off the skin\n",
              static_cast<double>(m.ether_stiffness_per_s2), static_cast<double>(m.ether_damping_ratio),
              static_cast<double>(m.root_length_m), static_cast<double>(m.thickness_m));
}

std::string group_name(const Groom& groom, std::size_t group) {
  return shown_text(groom.group_names[group], kNameBytesMax, '\'');
}

void print_groups(const Groom& groom) {
  for (std::size_t g = 0; g < groom.group_names.size(); ++g) {
    std::size_t count = 0, rooted = 0;
    for (const StrandProperties& strand : groom.strands) {
      count += strand.group == g;
      rooted += strand.group == g && strand.rooted;
    }
    // Threads and cloths are counted by their group.
    const auto others = [g](const auto& all, auto group_of) {
      return std::ranges::count_if(all, [&](const auto& one) { return group_of(one) == g; });
    };
    const auto own = [](const auto& one) { return one.group; };
    const auto fabrics = others(groom.threads, own) + others(groom.cloths, own);
    // Groups of threads and cloths alone have no strands, and need no line about them.
    if (count == 0 && fabrics > 0) {
      std::printf("group      %-16s %zd threads or cloths\n", group_name(groom, g).c_str(), fabrics);
      continue;
    }
    const std::string material(material_name(groom.materials.of(static_cast<std::uint16_t>(g))));
    std::printf("group      %-16s %zu strands, %zu with roots on the skull, %s\n", group_name(groom, g).c_str(), count,
                rooted, material.c_str());
  }
}

// Prints the features besides strands, one line for each kind that the groom has.
void print_features(const Groom& groom) {
  std::size_t copies = 0, triangles = 0, pinned = 0, tied = 0;
  for (const Clump& clump : groom.clumps) copies += clump.copy_count;
  for (const Cloth& cloth : groom.cloths) {
    triangles += cloth.triangles.size();
    pinned += !cloth.root_distance_m.empty();
  }
  for (const Knot& knot : groom.knots) tied += knot.points.size();
  if (!groom.clumps.empty()) std::printf("clumps     %zu, of %zu more drawn strands\n", groom.clumps.size(), copies);
  if (!groom.threads.empty()) std::printf("threads    %zu\n", groom.threads.size());
  if (!groom.cards.empty()) std::printf("cards      %zu\n", groom.cards.size());
  if (!groom.cloths.empty())
    std::printf("cloths     %zu of %zu triangles, %zu pinned to the skull\n", groom.cloths.size(), triangles, pinned);
  if (!groom.knots.empty()) std::printf("knots      %zu, tying %zu points\n", groom.knots.size(), tied);
  for (std::size_t g = 0; g < groom.root_blends.size(); ++g) {
    if (!groom.root_blends[g].points.empty())
      std::printf("root blend %-16s a curve of %zu points\n", group_name(groom, g).c_str(),
                  groom.root_blends[g].points.size());
  }
}

void print_groom(const Groom& groom) {
  double hairs = 0;
  for (const StrandProperties& strand : groom.strands) hairs += static_cast<double>(strand.hair_count);
  for (const HairCard& card : groom.cards) hairs += static_cast<double>(card.properties.hair_count);
  std::printf("groom      %s\n", shown_text(groom.name, kNameBytesMax, '\'').c_str());
  std::printf("strands    %zu of %u points, for %.0f hairs%s\n", groom.strand_count(), groom.strand_begin.back(), hairs,
              groom.cards.empty() ? "" : " with the cards");
  print_lengths(groom);
  print_material(groom.materials.base);
  print_groups(groom);
  for (const GroupMaterial& own : groom.materials.groups) {
    std::printf("group      %s:\n", group_name(groom, own.group).c_str());
    print_material(own.material);
  }
  print_features(groom);
  if (!groom.points.empty()) {
    Vec3f low = groom.points[0], high = low;
    for (const Vec3f& x : groom.points) {
      low = low.cwiseMin(x);
      high = high.cwiseMax(x);
    }
    std::printf("box        %.3f %.3f %.3f .. %.3f %.3f %.3f m, head space\n", low.x(), low.y(), low.z(), high.x(),
                high.y(), high.z());
  }
  std::printf("body       %zu vertices, %zu triangles%s\n", groom.body.mesh.vertices.size(),
              groom.body.mesh.triangles.size(), groom.body.fitted_from_roots ? ", a skull fitted to the roots" : "");
}

void print_learnt(const LearntHair& hair) {
  const auto percent = [](float share) { return 100 * static_cast<double>(share); };
  std::printf(
      "learnt     %zu hidden numbers, %zu modes; where it was learnt it erred by %.0f %% of the motion, the low level "
      "by %.0f %%\n",
      hair.hidden_count, hair.mode_count, percent(hair.error), percent(hair.low_error));
}

void print_modes(const Groom& groom, const std::shared_ptr<const LevelSet>& levels) {
  const double start_s = now_s();
  const auto percent = [](float share) { return 100 * static_cast<double>(share); };
  // The print says how many coefficients are needed for an error of 10 %.
  constexpr float kWanted = 0.1f;
  // The bar is cleared at the end of this block, before lines are printed.
  std::shared_ptr<const Modes> modes;
  {
    ProgressBar bar("making modes");
    BuildCallbacks callbacks;
    callbacks.progress = [&](double fraction, std::string_view stage) {
      bar.show(fraction, stage);
      return true;
    };
    modes = make_modes(groom, levels, callbacks);
  }
  std::printf("\nmodes      %zu, made in %.2f s; on validation motions they err by %.1f %% of the motion\n",
              modes->basis.mode_count(), now_s() - start_s, percent(modes->validation_error.back()));
  if (const std::size_t count = modes->count_within(kWanted); count > 0) {
    std::printf("           %.0f %% need %zu coefficients\n", percent(kWanted), count);
  } else {
    std::printf("           no number of coefficients errs by less than %.0f %%\n", percent(kWanted));
  }
}

void print_levels(const Groom& groom) {
  std::array<LevelReport, 4> reports;
  const double start_s = now_s();
  std::shared_ptr<const LevelSet> levels;
  {
    ProgressBar bar("building levels");
    BuildCallbacks callbacks;
    callbacks.clock_s = now_s;
    callbacks.progress = [&](double fraction, std::string_view stage) {
      bar.show(fraction, stage);
      return true;
    };
    levels = build_levels(groom, callbacks, &reports);
  }
  std::printf("\nlevel   lattice   active   springs           attachments       contacts   decimation   total\n");
  for (std::size_t i = 0; i < reports.size(); ++i) {
    const LevelReport& r = reports[i];
    const auto& dims = kLevelSpecs[i].dims;
    std::printf("%-7s %2dx%2dx%2d  %6zu   %6zu -> %-6zu  %6zu -> %-6zu  %8zu   %8.3f s   %6.3f s\n",
                kLevelNames[i].data(), dims[0], dims[1], dims[2], r.active_nodes, r.springs_before, r.springs_after,
                r.attachments_before, r.attachments_after, r.contacts, r.decimation_s, r.total_s);
  }
  if (reports[0].degenerate_strands > 0) std::printf("%zu strands without mechanics\n", reports[0].degenerate_strands);
  std::printf("built in %.2f s\n", now_s() - start_s);
  print_modes(groom, levels);
}

}  // namespace

Result<void> inspect_groom(const InspectOptions& options) {
  const Result<Groom> groom = load_groom(options.groom, options.hairstyle);
  if (!groom) return Refusal(groom.error());
  print_groom(*groom);
  // It is read beside the groom: decode_groom overlooks it.
  const Result<std::shared_ptr<const LearntHair>> learnt = load_learnt(options.groom);
  if (!learnt) return Refusal(learnt.error());
  if (*learnt) print_learnt(**learnt);
  if (!options.levels) return {};
  if (groom->points.empty()) return Refusal(options.groom + ": there is nothing to build levels from");
  print_levels(*groom);
  return {};
}

}  // namespace hairnet::groom
