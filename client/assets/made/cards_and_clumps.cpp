#include "client/assets/made/cards_and_clumps.hpp"

#include <cmath>

#include "client/assets/made/bust_shape.hpp"
#include "client/assets/made/easing.hpp"

namespace hairnet::made {
namespace {

// Left and right edges of a card about `line`, both at least as far from the skin as the hair that they replace.
std::vector<Vec3f> edges_about(std::span<const Vec3f> line, double width_m) {
  std::vector<Vec3f> edges;
  Vec3 side = Vec3::UnitX();
  for (std::size_t i = 0; i < line.size(); ++i) {
    // A card begins a little behind its root, so that roots in a row leave no gap at the parting. The step back is 0.3
    // of the first segment.
    const Vec3 p = i > 0 ? line[i].cast<double>() : onto_skin((1.3f * line[0] - 0.3f * line[1]).cast<double>());
    const Vec3 along = (line[std::min(i + 1, line.size() - 1)] - line[i > 0 ? i - 1 : 0]).cast<double>().normalized();
    const Vec3 flat = along.cross(bust_normal(p));
    // Where hair points away from the skin, keep the last direction.
    if (flat.norm() > 0.2) side = flat.normalized();
    const double s = static_cast<double>(i) / static_cast<double>(line.size() - 1);
    // A card is narrower at its root, where roots are close, and at its tip, where hair thins out.
    const double half = 0.5 * width_m * mix(0.7, 1, smootherstep(0, 0.25, s)) * mix(1, 0.6, smootherstep(0.6, 1, s));
    for (const double hand : {-1.0, 1.0}) {
      // The root pair lies 1 mm off the skin, and all others 3 mm.
      const double clearance = i == 0 ? 0.001 : 0.003;
      edges.push_back(push_out(p + hand * half * side, clearance).cast<float>());
    }
  }
  return edges;
}

}  // namespace

void turn_into_cards(double width_m, Groom& groom) {
  Groom cards;
  // The groom is built anew, because points of cards stand behind those of strands in its list.
  cards.name = groom.name;
  cards.group_names = groom.group_names;
  cards.root_blends = groom.root_blends;
  cards.body = std::move(groom.body);
  for (std::size_t s = 0; s < groom.strand_count(); ++s)
    cards.add_card(edges_about(groom.strand_points(s), width_m), groom.strands[s]);
  groom = std::move(cards);
}

void turn_into_clumps(std::uint16_t copy_count, double radius_m, Groom& groom) {
  // The copies gather towards the tip, as a lock does.
  for (std::uint32_t s = 0; s < groom.strand_count(); ++s)
    groom.clumps.push_back({s, copy_count, static_cast<float>(radius_m), static_cast<float>(0.5 * radius_m)});
}

}  // namespace hairnet::made
