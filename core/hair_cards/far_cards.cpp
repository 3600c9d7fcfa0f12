#include "core/hair_cards/far_cards.hpp"

#include <algorithm>
#include <cmath>
#include <functional>
#include <map>
#include <numeric>

#include "core/assert.hpp"
#include "core/geometry/mesh_query.hpp"
#include "core/hair_cards/centreline_clusters.hpp"
#include "core/hair_cards/hair_volume.hpp"
#include "core/hair_cards/strand_centrelines.hpp"

namespace hairnet {
namespace {

// Deviations from the middle to an edge. An even spread has 1.73; a little more lets neighbours overlap.
constexpr double kEdge = 1.95;
constexpr double kHalfWidthMin = 0.002, kHalfWidthMax = 0.03;     // m, of the width
constexpr double kSkinPreference = 0.5;                           // of the spread's trace
constexpr double kStretchMax = 1.5;                               // of the mean
constexpr double kRootReachMax = 0.15, kTipReachMax = 0.1;        // of the length
constexpr double kMoveMax = 0.01;                                 // m, outwards
constexpr double kClearanceRoot = 0.001, kClearanceRest = 0.003;  // m off the skin
constexpr std::size_t kPairCount = 12;
static_assert(kPairCount >= 2 && kPairCount <= kCentrelinePoints, "each pair is at a point of the line");
static_assert(kPairCount <= GroomLimits().far_card_pair_count_max);
constexpr double kEvenness = 0.05;  // weight of a pair's distance from other pairs

template <class T>
using AlongCard = std::array<T, kCentrelinePoints>;

// The body and the hair around a card.
struct Head {
  Head(const Groom& groom, const std::vector<Centreline>& centrelines) : skin(groom.body.mesh), hair(centrelines) {
    const bool any_rooted = std::ranges::any_of(centrelines, &Centreline::rooted);
    double count = 0;
    for (const Centreline& centreline : centrelines) {
      if (any_rooted && !centreline.rooted) continue;
      centre += centreline.points[0].cast<double>();
      ++count;
    }
    if (count > 0) centre /= count;
  }
  // Direction away from the head: from its centre, and lower down from the upright axis through the centre.
  [[nodiscard]] Vec3 outward(const Vec3& point) const {
    Vec3 away = point - centre;
    away.y() = std::max(0.0, away.y());
    return away.norm() > 1e-6 ? Vec3(away.normalized()) : Vec3(Vec3::UnitY());
  }
  // The direction in which a card should face: away from the head; in a tail or at an edge also away from the other
  // hair. Its length is not 1: it is short where the direction matters little.
  [[nodiscard]] Vec3 view_side(const Vec3& point) const {
    constexpr double kOfHair = 3;
    const Vec3 side = outward(point) + kOfHair * hair.towards_surface(point);
    return side / std::max(1.0, side.norm());
  }
  // The point itself, or the nearest point at that distance from the skin.
  [[nodiscard]] Vec3 outside(Vec3 point, double clearance_m) const {
    HAIRNET_ASSERT(clearance_m > 0);
    constexpr int kTries = 4;  // outside one fold of the skin may be inside another
    for (int i = 0; i < kTries; ++i) {
      const bool inside = skin.inside(point);
      const MeshQuery::Closest near = inside ? skin.closest(point) : skin.closest(point, clearance_m);
      if (!std::isfinite(near.distance)) return point;
      const Vec3 from_skin = inside ? Vec3(near.point - point) : Vec3(point - near.point);
      const Vec3 away = near.distance > 1e-9 ? Vec3(from_skin / near.distance) : outward(point);
      point = near.point + clearance_m * away;
    }
    return point;
  }

  MeshQuery skin;
  HairVolume hair;
  Vec3 centre = Vec3::Zero();
};

Vec3 direction_at(const AlongCard<Vec3>& line, std::size_t i) {
  HAIRNET_ASSERT(i < line.size());
  const Vec3 chord = line[std::min(i + 1, line.size() - 1)] - line[i > 0 ? i - 1 : 0];
  return chord.norm() > 1e-9 ? Vec3(chord.normalized()) : Vec3(-Vec3::UnitY());
}

// A cluster of centrelines: their mean, and their spread about it.
struct Lock {
  Lock(const std::vector<Centreline>& centrelines, const std::vector<std::uint32_t>& members) {
    HAIRNET_ASSERT(!members.empty());
    const auto count = static_cast<double>(members.size());
    middle.fill(Vec3::Zero());
    spread.fill(Mat3::Zero());
    for (const std::uint32_t m : members) {
      for (std::size_t i = 0; i < kCentrelinePoints; ++i) middle[i] += centrelines[m].points[i].cast<double>() / count;
      own_variance += static_cast<double>(centrelines[m].own_variance_m2) / count;
    }
    for (const std::uint32_t m : members) {
      for (std::size_t i = 0; i < kCentrelinePoints; ++i) {
        const Vec3 offset = centrelines[m].points[i].cast<double>() - middle[i];
        spread[i] += offset * offset.transpose() / count;
      }
    }
    HAIRNET_ASSERT(own_variance >= 0);
  }
  // Curls and locks make the card wider, but not at its beginning and end.
  void add_own_width() {
    for (Mat3& s : spread) s += own_variance * Mat3::Identity();
  }
  AlongCard<Vec3> middle;
  AlongCard<Mat3> spread;   // m^2; of the centrelines
  double own_variance = 0;  // m^2; of the hair about its centreline
};

// The deviation along a direction, m. Rounding can make a variance of zero slightly negative.
double deviation(const Mat3& spread, const Vec3& direction) {
  return std::sqrt(std::max(0.0, direction.dot(spread * direction)));
}

double median_length(const std::vector<Centreline>& centrelines, const std::vector<std::uint32_t>& members) {
  HAIRNET_ASSERT(!members.empty());
  std::vector<float> lengths;
  for (const std::uint32_t m : members) lengths.push_back(outline_length(centrelines[m].outline));
  const auto middle = lengths.begin() + static_cast<std::ptrdiff_t>(lengths.size() / 2);
  std::ranges::nth_element(lengths, middle);
  return static_cast<double>(*middle);
}

double length_of(const AlongCard<Vec3>& line) {
  AlongCard<Vec3f> rounded;
  std::ranges::transform(line, rounded.begin(), [](const Vec3& x) { return x.cast<float>(); });
  return static_cast<double>(outline_length(make_outline(rounded)));
}

// The mean of diverging lines is shorter than each of them. Lengths are compared without waves, which the mean does not
// have.
void stretch_to(double length_m, AlongCard<Vec3>& line) {
  HAIRNET_ASSERT(length_m >= 0);
  const double own = length_of(line);
  const double ratio = own > 0 ? std::clamp(length_m / own, 1.0, kStretchMax) : 1;
  for (std::size_t i = line.size() - 1; i > 0; --i) line[i] = line[0] + ratio * (line[i] - line[0]);
}

// The middle line begins at the mean of the roots. The card must begin at the hindmost root, or skin would show there.
void reach_back(const Head& head, const Mat3& spread, AlongCard<Vec3>& line) {
  const Vec3 away = head.outward(line[0]), along = direction_at(line, 0);
  const Vec3 flat = along - along.dot(away) * away;
  if (flat.norm() < 1e-3) return;
  const Vec3 back = -flat.normalized();
  const double reach = std::min(kEdge * deviation(spread, back), kRootReachMax * length_of(line));
  line[0] += reach * flat.norm() * back;
}

// Tips that spread along the card are visible beyond their mean.
void reach_on(const Mat3& spread, AlongCard<Vec3>& line) {
  const Vec3 along = direction_at(line, line.size() - 1);
  line.back() += std::min(deviation(spread, along), kTipReachMax * length_of(line)) * along;
}

void smooth(AlongCard<Mat3>& spread) {
  constexpr int kTimes = 4;
  for (int time = 0; time < kTimes; ++time) {
    const AlongCard<Mat3> rough = spread;
    for (std::size_t i = 0; i < spread.size(); ++i) {
      const std::size_t before = i > 0 ? i - 1 : i, after = std::min(i + 1, spread.size() - 1);
      spread[i] = 0.25 * rough[before] + 0.5 * rough[i] + 0.25 * rough[after];
    }
  }
}

// The direction across the line at each point: where the members spread most, unless the spread is nearly even; then
// along the skin. The sign makes across x along point away from the head.
AlongCard<Vec3> sides_of(const Head& head, const AlongCard<Vec3>& line, const AlongCard<Mat3>& spread) {
  AlongCard<Vec3> sides;
  double looks_out = 0;
  Vec3 before = direction_at(line, 0).cross(head.outward(line[0]));
  for (std::size_t i = 0; i < line.size(); ++i) {
    const Vec3 along = direction_at(line, i), away = head.view_side(line[i]);
    const Vec3 flat = before - before.dot(along) * along;
    const Vec3 u = flat.norm() > 1e-3 * before.norm() ? Vec3(flat.normalized()) : along.unitOrthogonal(),
               v = along.cross(u);
    const Vec3 on_skin = along.cross(away);
    const Mat3 wanted =
        spread[i] / std::max(spread[i].trace(), 1e-12) + kSkinPreference * on_skin * on_skin.transpose();
    // The main axis of a symmetric tensor in the plane of u and v, within a quarter turn of u.
    const double angle = 0.5 * std::atan2(2 * u.dot(wanted * v), u.dot(wanted * u) - v.dot(wanted * v));
    before = sides[i] = std::cos(angle) * u + std::sin(angle) * v;
    looks_out += sides[i].cross(along).dot(away);
  }
  if (looks_out < 0) {
    for (Vec3& side : sides) side = -side;
  }
  HAIRNET_VALIDATE(std::ranges::all_of(sides, [](const Vec3& side) { return std::abs(side.norm() - 1) < 1e-6; }));
  return sides;
}

// The visible side of a lock is its outer side.
void move_out(const AlongCard<Vec3>& sides, const AlongCard<Mat3>& spread, AlongCard<Vec3>& line) {
  const AlongCard<Vec3> middle = line;
  for (std::size_t i = 1; i < line.size(); ++i) {
    const Vec3 normal = sides[i].cross(direction_at(middle, i));
    line[i] += std::min(deviation(spread[i], normal), kMoveMax) * normal;
  }
}

double distance_to_segment(const Vec3& point, const Vec3& a, const Vec3& b) {
  const Vec3 chord = b - a;
  const double t = std::clamp((point - a).dot(chord) / std::max(chord.squaredNorm(), 1e-18), 0.0, 1.0);
  return (point - a - t * chord).norm();
}

// The indices of the line's points that preserve its shape, ascending. Adds one point after the other: the one that is
// farthest from the line through the chosen points, and on a straight line the one farthest from them.
std::vector<std::size_t> places_of_pairs(const AlongCard<Vec3>& line) {
  AlongCard<double> arc{};
  for (std::size_t i = 1; i < line.size(); ++i) arc[i] = arc[i - 1] + (line[i] - line[i - 1]).norm();
  std::vector<std::size_t> places{0, line.size() - 1};
  while (places.size() < kPairCount) {
    double best = -1;
    std::size_t place = 0, at = 0;
    for (std::size_t k = 0; k + 1 < places.size(); ++k) {
      const std::size_t a = places[k], b = places[k + 1];
      for (std::size_t i = a + 1; i < b; ++i) {
        const double worth =
            distance_to_segment(line[i], line[a], line[b]) + kEvenness * std::min(arc[i] - arc[a], arc[b] - arc[i]);
        if (worth > best) best = worth, place = i, at = k + 1;
      }
    }
    HAIRNET_ASSERT(best >= 0);
    places.insert(places.begin() + static_cast<std::ptrdiff_t>(at), place);
  }
  HAIRNET_ASSERT(std::ranges::adjacent_find(places, std::greater_equal{}) == places.end());
  HAIRNET_ASSERT(places.back() + 1 == line.size());
  return places;
}

// Keeps a far point within the coordinates that a groom may have.
Vec3f bounded(const Vec3& x) {
  const float most = GroomLimits().coordinate_max_m;
  return x.cast<float>().cwiseMax(-most).cwiseMin(most);
}

std::vector<Vec3> edges_of(const Head& head, const AlongCard<Vec3>& line, const AlongCard<Vec3>& sides,
                           const AlongCard<Mat3>& spread, bool rooted) {
  std::vector<Vec3> edges;
  for (const std::size_t i : places_of_pairs(line)) {
    const double half = std::clamp(kEdge * deviation(spread[i], sides[i]), kHalfWidthMin, kHalfWidthMax);
    const double clearance = rooted && i == 0 ? kClearanceRoot : kClearanceRest;
    for (const double hand : {-1.0, 1.0}) edges.push_back(head.outside(line[i] + hand * half * sides[i], clearance));
  }
  HAIRNET_ASSERT(edges.size() == 2 * kPairCount);
  return edges;
}

// Where the skin bulges between the points, moves them out.
void clear_between(const Head& head, std::vector<Vec3>& edges) {
  HAIRNET_ASSERT(edges.size() >= 4);
  HAIRNET_ASSERT(edges.size() % 2 == 0);
  constexpr int kRounds = 3;
  for (int round = 0; round < kRounds; ++round) {
    for (std::size_t i = 0; i + 3 < edges.size(); i += 2) {
      const Vec3 middle = 0.25 * (edges[i] + edges[i + 1] + edges[i + 2] + edges[i + 3]);
      const Vec3 out = head.outside(middle, kClearanceRoot) - middle;
      for (std::size_t corner = i; corner < i + 4; ++corner) edges[corner] += out;
    }
  }
}

std::vector<Vec3f> ribbon_about(const Head& head, const std::vector<Centreline>& centrelines,
                                const std::vector<std::uint32_t>& members) {
  HAIRNET_ASSERT(!members.empty());
  const bool rooted = centrelines[members[0]].rooted;
  Lock lock(centrelines, members);
  auto& [line, spread, own_variance] = lock;
  stretch_to(median_length(centrelines, members), line);
  if (rooted) reach_back(head, spread.front(), line);
  reach_on(spread.back(), line);
  lock.add_own_width();
  smooth(spread);
  move_out(sides_of(head, line, spread), spread, line);
  for (std::size_t i = 0; i < line.size(); ++i)
    line[i] = head.outside(line[i], rooted && i == 0 ? kClearanceRoot : kClearanceRest);
  std::vector<Vec3> edges = edges_of(head, line, sides_of(head, line, spread), spread, rooted);
  clear_between(head, edges);
  std::vector<Vec3f> ribbon;
  for (const Vec3& x : edges) ribbon.push_back(bounded(x));
  HAIRNET_VALIDATE(std::ranges::all_of(ribbon, [](const Vec3f& x) { return x.allFinite(); }));
  return ribbon;
}

FarCard properties_of(const std::vector<Centreline>& centrelines, const std::vector<std::uint32_t>& members) {
  HAIRNET_ASSERT(!members.empty());
  HAIRNET_VALIDATE(std::ranges::all_of(members, [&](std::uint32_t m) {
    return centrelines[m].group == centrelines[members[0]].group &&
           centrelines[m].rooted == centrelines[members[0]].rooted;
  }));
  double root_length = 0;
  for (const std::uint32_t m : members) root_length += static_cast<double>(centrelines[m].root_length_m);
  const Centreline& first = centrelines[members[0]];
  return {{},
          static_cast<float>(root_length / static_cast<double>(members.size())),
          static_cast<std::uint32_t>(members.size()),
          first.group,
          first.rooted};
}

// Centrelines that may share a card, and the number of their cards: in proportion to their length, at least one.
struct Kind {
  std::vector<std::uint32_t> members;
  double length_m = 0;
};
std::vector<Kind> kinds_of(const std::vector<Centreline>& centrelines) {
  std::map<std::pair<std::uint16_t, bool>, Kind> kinds;
  for (std::uint32_t c = 0; c < centrelines.size(); ++c) {
    Kind& kind = kinds[{centrelines[c].group, centrelines[c].rooted}];
    kind.members.push_back(c);
    kind.length_m += static_cast<double>(outline_length(centrelines[c].outline));
  }
  std::vector<Kind> list;
  for (auto& [key, kind] : kinds) list.push_back(std::move(kind));
  // The longest kind last: it pays for the minimum of small kinds.
  std::ranges::stable_sort(list, {}, &Kind::length_m);
  HAIRNET_ASSERT(list.empty() == centrelines.empty());
  return list;
}

}  // namespace

FarCards make_far_cards(const Groom& groom, std::size_t count) {
  HAIRNET_ASSERT(count <= GroomLimits().far_card_count_max);
  if (count == 0) return {};
  const std::vector<Centreline> centrelines = make_centrelines(groom);
  const Head head(groom, centrelines);
  const std::vector<Kind> kinds = kinds_of(centrelines);
  const double length = std::accumulate(kinds.begin(), kinds.end(), 0.0,
                                        [](double sum, const Kind& kind) { return sum + kind.length_m; });
  FarCards far;
  double owed = static_cast<double>(count), length_left = length;
  for (const Kind& kind : kinds) {
    const double share = std::max(1.0, std::round(owed * kind.length_m / std::max(length_left, 1e-9)));
    owed = std::max(0.0, owed - share);
    length_left -= kind.length_m;
    for (const auto& members : cluster_centrelines(centrelines, kind.members, static_cast<std::size_t>(share)))
      far.add(ribbon_about(head, centrelines, members), properties_of(centrelines, members));
  }
  HAIRNET_ASSERT(far.cards.size() <= std::max(count, kinds.size()));
  HAIRNET_ASSERT(far.points.size() == 2 * kPairCount * far.cards.size());
  return far;
}

std::size_t far_card_count_for(const Groom& groom) {
  constexpr std::size_t kCardsMax = 400, kStrandsEach = 6, kFew = 24;
  static_assert(kFew <= kCardsMax && kCardsMax <= GroomLimits().far_card_count_max);
  const std::size_t lines = groom.strand_count() + groom.cards.size();
  return std::clamp(lines / kStrandsEach, std::min(lines, kFew), kCardsMax);
}

}  // namespace hairnet
