#include <algorithm>
#include <chrono>
#include <cstdio>

#include "client/tools/groom/commands.hpp"
#include "client/tools/load/load_groom.hpp"
#include "client/tools/progress/progress_bar.hpp"
#include "core/build/build.hpp"

namespace hairnet::groom {
namespace {

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

void print_groups(const Groom& groom) {
  for (std::size_t g = 0; g < groom.group_names.size(); ++g) {
    std::size_t count = 0, rooted = 0;
    for (const StrandProperties& strand : groom.strands) {
      count += strand.group == g;
      rooted += strand.group == g && strand.rooted;
    }
    const std::string material(material_name(groom.materials.of(static_cast<std::uint16_t>(g))));
    std::printf("group      %-16s %zu strands, %zu with roots on the skull, %s\n", groom.group_names[g].c_str(), count,
                rooted, material.c_str());
  }
}

void print_groom(const Groom& groom) {
  double hairs = 0;
  for (const StrandProperties& strand : groom.strands) hairs += static_cast<double>(strand.hair_count);
  std::printf("groom      %s\n", groom.name.c_str());
  std::printf("strands    %zu of %zu points, for %.0f hairs\n", groom.strand_count(), groom.points.size(), hairs);
  print_lengths(groom);
  print_material(groom.materials.base);
  print_groups(groom);
  for (const GroupMaterial& own : groom.materials.groups) {
    std::printf("group      %s:\n", groom.group_names[own.group].c_str());
    print_material(own.material);
  }
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

void print_levels(const Groom& groom) {
  std::array<LevelReport, 4> reports;
  const double start_s = now_s();
  {
    ProgressBar bar("building levels");
    BuildObserver observer;
    observer.clock_s = now_s;
    observer.progress = [&](double fraction, std::string_view stage) {
      bar.show(fraction, stage);
      return true;
    };
    (void)build_levels(groom, observer, &reports);
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
}

}  // namespace

Result<void> inspect_groom(const InspectOptions& options) {
  const Result<Groom> groom = load_groom(options.groom, options.hairstyle);
  if (!groom) return Refusal(options.groom + ": " + groom.error());
  print_groom(*groom);
  if (!options.levels) return {};
  if (groom->points.empty()) return Refusal(options.groom + ": there is no strand to build levels from");
  print_levels(*groom);
  return {};
}

}  // namespace hairnet::groom
