#pragma once

#include <array>
#include <cstdint>
#include <memory>
#include <string>
#include <string_view>
#include <vector>

#include "core/ffd/lattice.hpp"
#include "core/groom/material.hpp"
#include "core/skin/skin_distance_field.hpp"

namespace hairnet {

// How finely hair is simulated, from the one that costs most. The first four are lattices; `ether` has no springs.
// `learnt` is a network in place of a lattice (core/learnt); `rigid` hair moves with the head.
enum class LevelIndex : std::uint8_t { high, medium, low, ether, learnt, rigid };
inline constexpr std::size_t kLevelCount = 6;
inline constexpr std::array<std::string_view, kLevelCount> kLevelNames{"high",  "medium", "low",
                                                                       "ether", "learnt", "rigid"};
constexpr bool has_lattice(LevelIndex level) {
  return level <= LevelIndex::ether;
}

// What to build for one level with a lattice.
struct LevelSpec {
  std::array<int, 3> dims;
  // The counts are upper limits: a groom may have fewer stiffeners and points than that.
  std::size_t spring_count = 0;
  std::size_t attachment_count = 0;
  std::size_t contact_count = 0;
};
// High, medium, low and ether. High and low have the sizes of the paper's high-end and low-end models, and ether is its
// model without springs and attachments (section 5.1), with contact.
inline constexpr std::array<LevelSpec, 4> kLevelSpecs{
    {{{10, 10, 10}, 800, 200, 800}, {{7, 7, 7}, 400, 100, 480}, {{5, 5, 5}, 200, 50, 230}, {{5, 5, 5}, 0, 0, 128}}};

// Stiffeners (section 2.2 of the paper), flat. Stiffener s acts on the weighted sum over entries [begin[s],
// begin[s+1]).
struct Stiffeners {
  std::vector<std::uint32_t> begin{0};
  // Active indices, ascending within a stiffener.
  std::vector<std::uint16_t> nodes;
  std::vector<float> weights;
  // The stiffness k, N/m.
  std::vector<float> stiffness;
  // The damping q, N s/m.
  std::vector<float> damping;
  // The value at rest: epsilon_0 = sum w_j p_j^0, head space, m. A spring's rest length is its norm.
  std::vector<Vec3f> rest;

  [[nodiscard]] std::size_t count() const { return stiffness.size(); }
};

// A point has the contact energy U when it is this much nearer to the skin than its limit (ContactPoints::limit;
// contact.hpp has the law).
inline constexpr double kContactDepth_m = 0.05;

// The limit of a point that cannot reach a skin. Built distances are never as low.
inline constexpr float kContactNever_m = -1;

// Points of the hair at which contact acts. As FFD moves the hair, point p moves by the weighted sum of the
// displacements of the nodes in entries [begin[p], begin[p + 1]).
struct ContactPoints {
  std::vector<std::uint32_t> begin{0};
  // Active indices, ascending within a point.
  std::vector<std::uint16_t> nodes;
  // Each is > 0, and the sum for a point is at most 1.
  std::vector<float> weights;
  // The position in the design, head space, m.
  std::vector<Vec3f> rest;
  // The potential U, J.
  std::vector<float> potential;
  // The distance to each field's skin at which contact begins, m: [field][point]. In the design every point is at least
  // as far. kContactNever_m: the point cannot reach that skin.
  std::vector<float> limit;

  [[nodiscard]] std::size_t count() const { return rest.size(); }
};

// One mechanical model of a groom, immutable and shared by all its characters. Per-node arrays are in active order.
// A character differs from it by its MaterialScale only, so the solver can step a crowd of one hairstyle side by side.
struct Level {
  LevelGeometry geometry;
  // The farthest that a node may be from its design; the step scales a lattice down that is farther away.
  float displacement_max_m = 10;
  // The position p^0 in the design, head space, m.
  std::vector<Vec3f> rest;
  // The mass of each node, with hair and ether, kg.
  std::vector<float> mass;
  // The stiffness with which the ether holds each node, N/m.
  std::vector<float> ether_stiffness;
  // The damping of each node by the ether, N s/m.
  std::vector<float> ether_damping;
  // The drag matrix Q as xx xy xz yy yz zz, N s/m, head axes.
  std::vector<std::array<float, 6>> drag;
  // The weights of a spring sum to 0.
  Stiffeners springs;
  // The weights of an attachment sum to 1.
  Stiffeners attachments;
  // The skin that hair meets. All levels of a groom share it, and it is never null.
  std::shared_ptr<const Skin> skin = std::make_shared<Skin>();
  ContactPoints contacts;
};

// Checks a level from an untrusted source: counts agree, indices are in range, numbers are finite, weights and rest
// values match the nodes. Returns an empty string when the solver can run it, else one line about the error. It costs
// one pass over all arrays; built levels need no such check.
std::string validate(const Level& level);

class LevelMap;
struct LearntHair;
struct Modes;

// The levels of a groom that have a lattice, indexed by LevelIndex. `maps[from][to]` transfers a lattice state
// (level_map.hpp). Where a map is missing, a character starts at rest on its new level. `modes`: what all levels say in
// common terms (core/modes); null where nobody needs it. `learnt`: the learnt level; null until it has been learnt.
struct LevelSet {
  std::array<Level, 4> levels;
  std::array<std::array<std::shared_ptr<const LevelMap>, 4>, 4> maps;
  std::shared_ptr<const Modes> modes;
  std::shared_ptr<const LearntHair> learnt;

  [[nodiscard]] const Level& operator[](LevelIndex i) const { return levels[static_cast<std::size_t>(i)]; }
  [[nodiscard]] const LevelMap* map(LevelIndex from, LevelIndex to) const {
    return maps[static_cast<std::size_t>(from)][static_cast<std::size_t>(to)].get();
  }
};

}  // namespace hairnet
