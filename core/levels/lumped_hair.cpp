#include "core/levels/lumped_hair.hpp"

#include <algorithm>
#include <cmath>
#include <functional>

#include "core/assert.hpp"

namespace hairnet {
namespace {

// The fractions of the way from a to b at which the segment crosses lattice planes of any axis, ascending, with 0 first
// and 1 last. Crossings of two or three planes at once count as one, although rounding separates them.
void split_by_cells(const Vec3& a, const Vec3& b, std::vector<double>& fractions) {
  fractions.assign(1, 0.0);
  for (int axis = 0; axis < 3; ++axis) {
    const double low = std::min(a[axis], b[axis]), high = std::max(a[axis], b[axis]);
    for (double plane = std::floor(low) + 1; plane < high; ++plane) {
      fractions.push_back(std::clamp((plane - a[axis]) / (b[axis] - a[axis]), 0.0, 1.0));
    }
  }
  std::ranges::sort(fractions);
  const auto is_same = [](double f, double g) { return g - f < 1e-9; };
  fractions.erase(std::unique(fractions.begin(), fractions.end(), is_same), fractions.end());
  if (is_same(fractions.back(), 1.0) && fractions.size() > 1) fractions.pop_back();
  fractions.push_back(1.0);
  HAIRNET_ASSERT(fractions.size() >= 2);
  HAIRNET_ASSERT(fractions.front() == 0);
  HAIRNET_VALIDATE(std::ranges::adjacent_find(fractions, std::greater_equal{}) == fractions.end());
}

// The tensor I - e e^T of paper eq. 6: air resists motion across a hair and not along it.
std::array<double, 6> drag_tensor(const Vec3& direction) {
  const Vec3& e = direction;
  return {1 - e[0] * e[0], -e[0] * e[1], -e[0] * e[2], 1 - e[1] * e[1], -e[1] * e[2], 1 - e[2] * e[2]};
}

}  // namespace

void add_mass(std::uint32_t node, double mass, double hang_length, const Material& material, LumpedHair& lumped) {
  HAIRNET_ASSERT(mass >= 0);
  HAIRNET_VALIDATE(node < lumped.mass.size());
  HAIRNET_VALIDATE(std::isfinite(hang_length));
  lumped.touched[node] = true;
  lumped.mass[node] += mass;
  lumped.ether_mass += mass * static_cast<double>(material.ether_mass_ratio);
  lumped.hang_moment[node] += mass * std::max(hang_length, kHangLengthMin);
  lumped.gel_moment[node] += mass * static_cast<double>(material.ether_stiffness_per_s2);
  lumped.ether_damping_moment[node] += mass * static_cast<double>(material.ether_damping_ratio);
}

void lump_strand(const Grid& grid, std::span<const Vec3> polyline, const StrandProperties& strand,
                 const Material& material, LumpedHair& lumped) {
  HAIRNET_ASSERT(lumped.mass.size() == grid.node_count());
  HAIRNET_ASSERT(strand.hair_count > 0);
  HAIRNET_ASSERT(material.linear_density_kg_per_m > 0);
  // Where the two points of Gauss's rule lie, as fractions of a piece from its middle. The rule integrates cubics
  // exactly.
  const double gauss_offset = 0.5 / std::sqrt(3.0);
  const double hair_count = strand.hair_count;
  const double density = hair_count * static_cast<double>(material.linear_density_kg_per_m);
  const double air_drag = hair_count * static_cast<double>(material.air_drag_ns_per_m2);
  for (const Vec3& point : polyline) {
    for (const auto& [node, weight] : grid.weights(point)) lumped.touched[node] = true;
  }
  std::vector<double> fractions;
  for (std::size_t i = 1; i < polyline.size(); ++i) {
    const Vec3 &a = polyline[i - 1], &b = polyline[i];
    const double length = grid.length(b - a);
    HAIRNET_ASSERT(length > 0);
    const std::array<double, 6> drag = drag_tensor((b - a).cwiseProduct(grid.spacing()) / length);
    // Within a cell the product of three linear weights is a cubic along the piece, which two Gauss points integrate
    // exactly. Across cells it has kinks.
    split_by_cells(a, b, fractions);
    for (std::size_t f = 1; f < fractions.size(); ++f) {
      const double share = fractions[f] - fractions[f - 1];
      const double middle = 0.5 * (fractions[f] + fractions[f - 1]);
      for (const double side : {-gauss_offset, gauss_offset}) {
        const Vec3 point = a + (middle + side * share) * (b - a);
        for (const auto& [node, weight] : grid.weights(point)) {
          const double piece = 0.5 * share * length * weight, mass = density * piece;
          const int level = grid.lattice().coordinates(node)[1];
          // The depth of the node and not of the piece of hair: ether.hpp says why.
          const double below_root = (polyline.front()[1] - level) * grid.spacing()[1];
          add_mass(node, mass, below_root, material, lumped);
          for (int c = 0; c < 6; ++c) lumped.drag[node][c] += air_drag * piece * drag[c];
        }
      }
    }
  }
}

}  // namespace hairnet
