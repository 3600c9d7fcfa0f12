#pragma once

#include <cstdint>
#include <vector>

#include "core/groom/fabric.hpp"

namespace hairnet {

// A hair card: one textured ribbon that replaces many strands when the hair is far away.
struct FarCard {
  PointRange points;               // of FarCards::points: left, right, left, right … from the root
  float root_length_m = 0.02f;     // lambda_0 of eq. 7, if rooted; 0 = no root blend
  std::uint32_t strand_count = 1;  // number of strands, and of the groom's own cards, that it replaces
  std::uint16_t group = 0;         // index into Groom::group_names; all replaced strands are of this group
  bool rooted = true;
};

// What is drawn instead of the strands and cards of a groom when it is far away. The cards follow the lattice by FFD
// but have no mechanics: the levels do not depend on them.
struct FarCards {
  std::vector<Vec3f> points;  // head space, m; card by card
  std::vector<FarCard> cards;

  // Sets the card's range.
  void add(const std::vector<Vec3f>& edges, FarCard card) {
    const auto begin = static_cast<std::uint32_t>(points.size());
    points.insert(points.end(), edges.begin(), edges.end());
    card.points = {begin, static_cast<std::uint32_t>(points.size())};
    cards.push_back(card);
  }
};

}  // namespace hairnet
