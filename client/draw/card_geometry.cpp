#include <algorithm>

#include "client/draw/geometry_parts.hpp"
#include "core/ffd/deform.hpp"

namespace hairnet::draw {
namespace {

// The points of a card's edges: left, right, left, right ... from the root.
struct Edges {
  std::span<const Vec3f> points, directions;
  std::span<const float> blend, blend_slope;
};

void add_card(const Edges& edges, std::size_t number, const OcclusionGrid& occlusion, Mesh<CardVertex>& mesh) {
  const std::size_t pairs = edges.points.size() / 2;
  // A card of one pair has no area.
  if (pairs < 2) return;
  const auto first = static_cast<std::uint32_t>(mesh.vertices.size());
  // The length along the middle, up to each pair.
  std::vector<float> length_m(pairs, 0.0f);
  for (std::size_t i = 1; i < pairs; ++i) {
    const Vec3f step =
        edges.points[2 * i] + edges.points[2 * i + 1] - edges.points[2 * i - 2] - edges.points[2 * i - 1];
    length_m[i] = length_m[i - 1] + 0.5f * step.norm();
  }
  for (std::size_t i = 0; i < 2 * pairs; ++i) {
    // i | 1 is the right point of the pair, i & ~1 the left one: both vertices of a pair have the same side.
    const Vec3f side = unit_or_up(edges.points[i | 1] - edges.points[i & ~std::size_t{1}]);
    const Transmittance left = occlusion.at(edges.points[i]);
    const Vec3f& p = edges.points[i];
    mesh.vertices.push_back(
        {{p.x(), p.y(), p.z(), edges.blend[i]},
         to_halves(edges.directions[i], edges.blend_slope[i]),
         sides_of(left),
         // A card without any length has fraction 0 everywhere instead of a division by zero.
         ends_of(left, length_m[i / 2] / std::max(length_m.back(), 1e-6f), static_cast<float>(i % 2)),
         {side.x(), side.y(), side.z(), static_cast<float>(number)}});
    if (i % 2 == 0 && i + 3 < 2 * pairs) {
      const std::uint32_t a = first + static_cast<std::uint32_t>(i);
      mesh.triangles.insert(mesh.triangles.end(), {a, a + 1, a + 2, a + 2, a + 1, a + 3});
    }
  }
}

}  // namespace

void add_cards(const GeometrySource& source, GroomGeometry& geometry) {
  const Groom& groom = source.groom;
  for (std::size_t s = 0; s < groom.cards.size(); ++s) {
    const PointRange& range = groom.cards[s].points;
    const Edges edges{groom.points_of(range), std::span(source.rest.direction).subspan(range.begin, range.count()),
                      source.blend.subspan(range.begin, range.count()),
                      std::span(source.rest.blend_slope).subspan(range.begin, range.count())};
    add_card(edges, s, source.occlusion, geometry.cards);
  }
}

}  // namespace hairnet::draw
