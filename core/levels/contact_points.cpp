#include "core/levels/contact_points.hpp"

#include <algorithm>
#include <array>
#include <cmath>
#include <limits>
#include <numbers>

#include "core/assert.hpp"
#include "core/ffd/deform.hpp"
#include "core/gravity.hpp"
#include "core/levels/hair_sample.hpp"
#include "core/skin/skin_distance_field.hpp"

namespace hairnet {
namespace {

// The most lines that are candidates. Choosing takes time in proportion to candidates times chosen lines.
constexpr std::size_t kCandidatesMax = 1500;
// Points along a line stand this far apart, in cells of the lattice, and at least kSpacingMin_m.
constexpr double kSpacing = 0.75;
constexpr float kSpacingMin_m = 0.01f;
// Points of a smaller root blend are not chosen: so near to the root hair hardly moves relative to the head.
constexpr float kBlendMin = 0.15f;
// Hair that is thrown against the body presses with 160 times its weight. This is the acceleration of a point's share
// of the mass, m/s^2.
constexpr double kLoad = 160 * kGravity_m_per_s2;
// The load may press in to this depth.
constexpr double kDent_m = 0.005;
// In the design a point is this much farther away than where contact begins, so that rounding causes no contact.
constexpr float kSlack_m = 1e-5f;
// The greatest distance of a point from its root is its arm times kArmStretch, as hair stretches, plus kArmSlack_m, as
// bones move relative to the head.
constexpr float kArmStretch = 1.3f, kArmSlack_m = 0.05f;

// U for which f = 3 U p^2 / depth^3 carries the load at p = kDent_m.
double potential_for_load(double load_n) {
  HAIRNET_ASSERT(load_n >= 0);
  return load_n * kContactDepth_m * kContactDepth_m * kContactDepth_m / (3 * kDent_m * kDent_m);
}

// Every `stride`-th point of a run of the groom's points: a strand, an edge of a card, a thread, a vertex of a cloth.
struct Line {
  PointRange points;
  std::uint32_t stride = 1;
  bool rooted = false;

  [[nodiscard]] std::size_t count() const { return (points.count() + stride - 1) / stride; }
  [[nodiscard]] std::uint32_t point(std::size_t i) const {
    HAIRNET_VALIDATE(i < count());
    return points.begin + static_cast<std::uint32_t>(i) * stride;
  }
};

std::vector<Line> lines_of(const Groom& groom) {
  HAIRNET_ASSERT(groom.strand_begin.size() == groom.strand_count() + 1);
  std::vector<Line> lines;
  for (std::size_t s = 0; s < groom.strand_count(); ++s) {
    lines.push_back({{groom.strand_begin[s], groom.strand_begin[s + 1]}, 1, groom.strands[s].rooted});
  }
  for (const Thread& thread : groom.threads) lines.push_back({thread.points, 1, thread.rooted});
  for (const HairCard& card : groom.cards) lines.push_back({card.points, 2, card.properties.rooted});
  for (const Cloth& cloth : groom.cloths) {
    for (std::uint32_t p = cloth.points.begin; p < cloth.points.end; ++p) lines.push_back({{p, p + 1}});
  }
  std::erase_if(lines, [](const Line& line) { return line.count() == 0; });
  return lines;
}

// An even sample of the lines, bounded in number.
std::vector<Line> candidates_of(const Groom& groom) {
  const std::vector<Line> all = lines_of(groom);
  const double share = static_cast<double>(kCandidatesMax) / static_cast<double>(std::max<std::size_t>(1, all.size()));
  std::vector<Line> some;
  for (std::size_t l = 0; l < all.size(); ++l) {
    // Multiples of the golden ratio spread evenly over any run of lines, in whatever order a groom has its strands.
    // Where strands have a regular order, every n-th line could leave whole regions out.
    const double turn = static_cast<double>(l) * (std::numbers::phi - 1);
    if (turn - std::floor(turn) < share) some.push_back(all[l]);
  }
  HAIRNET_ASSERT(some.empty() == all.empty());
  return some;
}

// The begin, middle and end of a line.
using Centreline = std::array<Vec3f, 3>;
Centreline centreline_of(const Groom& groom, const Line& line) {
  HAIRNET_ASSERT(line.count() > 0);
  const auto at = [&](std::size_t i) { return groom.points[line.point(i)]; };
  return {at(0), at(line.count() / 2), at(line.count() - 1)};
}
// The sum of the squared distances between the begins, middles and ends, m^2.
float apart2(const Centreline& a, const Centreline& b) {
  return (a[0] - b[0]).squaredNorm() + (a[1] - b[1]).squaredNorm() + (a[2] - b[2]).squaredNorm();
}

// The points that have been chosen, with one entry in each list.
struct Chosen {
  HairSample hair;
  // The root of each point's strand.
  std::vector<Vec3f> root;
  // The length of hair from the root, which is infinite without a root.
  std::vector<float> arm_m;
};

// Adds points at even distances along the line, including the tip, where hair takes enough of the lattice's motion.
void add_points(const Groom& groom, const std::vector<float>& blend, const Line& line, float spacing_m,
                Chosen& chosen) {
  HAIRNET_ASSERT(spacing_m > 0);
  HAIRNET_ASSERT(blend.size() == groom.points.size());
  HAIRNET_ASSERT(line.count() > 0);
  const Vec3f root = groom.points[line.point(0)];
  // How far the line has gone since its last point. It starts with a full spacing, so the first point that may be
  // chosen is.
  float owed_m = spacing_m, arm_m = line.rooted ? 0 : std::numeric_limits<float>::infinity();
  for (std::size_t i = 0; i < line.count(); ++i) {
    const std::uint32_t p = line.point(i);
    const float step_m = i > 0 ? (groom.points[p] - groom.points[line.point(i - 1)]).norm() : 0;
    owed_m += step_m;
    arm_m += step_m;
    // The tip is taken when at least half of the spacing lies before it.
    const bool is_tip = i + 1 == line.count();
    if (blend[p] < kBlendMin || (owed_m < spacing_m && !(is_tip && owed_m > 0.5f * spacing_m))) continue;
    owed_m = 0;
    chosen.hair.points.push_back(groom.points[p]);
    chosen.hair.blend.push_back(blend[p]);
    chosen.root.push_back(root);
    chosen.arm_m.push_back(arm_m);
  }
  HAIRNET_ASSERT(chosen.hair.blend.size() == chosen.hair.points.size());
  HAIRNET_ASSERT(chosen.root.size() == chosen.hair.points.size());
  HAIRNET_ASSERT(chosen.arm_m.size() == chosen.hair.points.size());
}

// Chooses one candidate after the other, each the farthest from all chosen ones (Gonzalez 1985), while their points
// fit.
class FarthestFirst {
 public:
  FarthestFirst(const Groom& groom, const std::vector<Line>& lines)
      : to_chosen_(lines.size(), std::numeric_limits<float>::max()) {
    HAIRNET_ASSERT(!lines.empty());
    for (const Line& line : lines) centrelines_.push_back(centreline_of(groom, line));
  }
  [[nodiscard]] bool is_over() const { return !(*std::ranges::max_element(to_chosen_) > 0); }
  std::size_t next() {
    const auto chosen = static_cast<std::size_t>(std::ranges::max_element(to_chosen_) - to_chosen_.begin());
    HAIRNET_ASSERT(to_chosen_[chosen] > 0);
    for (std::size_t l = 0; l < centrelines_.size(); ++l) {
      to_chosen_[l] = std::min(to_chosen_[l], apart2(centrelines_[l], centrelines_[chosen]));
    }
    to_chosen_[chosen] = 0;
    return chosen;
  }

 private:
  std::vector<Centreline> centrelines_;
  std::vector<float> to_chosen_;  // squared
};

// Chooses whole lines, farthest first, until count_max points are reached.
Chosen choose_points(const Groom& groom, float spacing_m, std::size_t count_max) {
  const std::vector<float> blend = root_blend(groom);
  const std::vector<Line> lines = candidates_of(groom);
  Chosen chosen;
  if (lines.empty()) return chosen;
  FarthestFirst order(groom, lines);
  for (std::size_t tried = 0; tried < lines.size() && !order.is_over(); ++tried) {
    // A line is taken whole or not at all: half of a strand's points would let its other half through the skin.
    Chosen more = chosen;
    add_points(groom, blend, lines[order.next()], spacing_m, more);
    if (more.arm_m.size() > count_max) break;
    chosen = std::move(more);
  }
  HAIRNET_ASSERT(chosen.arm_m.size() <= count_max);
  return chosen;
}

// The distance to the bone's skin at which contact of a point begins, m, or kContactNever_m.
float limit_of(const SkinDistanceField& field, const Chosen& chosen, std::size_t point, float thickness_m) {
  HAIRNET_ASSERT(point < chosen.arm_m.size());
  HAIRNET_ASSERT(thickness_m >= 0);
  const auto distance_m = [&](const Vec3f& at) { return static_cast<float>(skin_distance(field, at.cast<double>())); };
  const float arm_m = kArmSlack_m + kArmStretch * chosen.arm_m[point];
  // A bone that the strand cannot reach at its full length costs no look-up in any step. Hair is always near the head.
  if (field.bone != Bone::head && distance_m(chosen.root[point]) > arm_m) return kContactNever_m;
  return std::min(thickness_m, distance_m(chosen.hair.points[point]) - kSlack_m);
}

}  // namespace

ContactPoints make_contact_points(const Groom& groom, const LevelGeometry& geometry, std::span<const float> mass,
                                  const Skin& skin, std::size_t count_max) {
  HAIRNET_ASSERT(mass.size() == geometry.active_nodes.size());
  ContactPoints contacts;
  if (skin.empty()) return contacts;
  const float spacing_m = std::max(kSpacingMin_m, static_cast<float>(kSpacing) * geometry.lattice.spacing.mean());
  const Chosen chosen = choose_points(groom, spacing_m, count_max);
  const HairStencils stencils = make_stencils(geometry, chosen.hair);
  contacts.rest = chosen.hair.points;
  contacts.begin = stencils.begin;
  contacts.nodes.assign(stencils.nodes.begin(), stencils.nodes.end());
  contacts.weights.assign(stencils.weights.begin(), stencils.weights.end());
  const Material& material = groom.materials.base;
  // kLoad and kDent_m hold for the default material; the potential of another scales them.
  const auto by_material = static_cast<double>(material.metaball_potential_j / Material{}.metaball_potential_j);
  for (std::size_t p = 0; p < contacts.count(); ++p) {
    double share_kg = 0;
    for (std::uint32_t e = contacts.begin[p]; e < contacts.begin[p + 1]; ++e) {
      share_kg += static_cast<double>(contacts.weights[e] * mass[contacts.nodes[e]]);
    }
    contacts.potential.push_back(static_cast<float>(by_material * potential_for_load(kLoad * share_kg)));
  }
  for (const SkinDistanceField& field : skin) {
    for (std::size_t p = 0; p < contacts.count(); ++p) {
      contacts.limit.push_back(limit_of(field, chosen, p, material.thickness_m));
    }
  }
  HAIRNET_ASSERT(contacts.count() <= count_max);
  HAIRNET_ASSERT(contacts.begin.size() == contacts.count() + 1);
  HAIRNET_ASSERT(contacts.begin.back() == contacts.nodes.size());
  HAIRNET_ASSERT(contacts.potential.size() == contacts.count());
  HAIRNET_ASSERT(contacts.limit.size() == contacts.count() * skin.size());
  return contacts;
}

}  // namespace hairnet
