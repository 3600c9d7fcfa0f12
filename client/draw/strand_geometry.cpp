#include <algorithm>
#include <cmath>
#include <numeric>

#include "client/draw/geometry_parts.hpp"
#include "core/ffd/clump_strands.hpp"
#include "core/random.hpp"

namespace hairnet::draw {
namespace {

// The smooth line through a strand's points is divided until no piece is further than this from it, as far as
// kPiecesMax allows.
constexpr float kSag_m = 5e-4f;
// Longer pieces would show corners where a lattice bends straight hair.
constexpr float kPiece_m = 0.012f;
// A segment has at most two pieces, because each point costs 32 bytes and one FFD for every character.
constexpr int kPiecesMax = 2;
// The finest list has all points, and each next one allows three to five times the error.
constexpr std::array<float, 4> kTolerances_m{0, 2.5e-4f, 8e-4f, 4e-3f};
// Strands of up to this many points are limited to their length at rest. limit_lengths.frag walks from the root for
// each point, so the cost grows with the square of the number.
constexpr std::size_t kPlacedMax = 256;
// At least one of this many points in a row stays, since the cost of simplifying grows with their square.
constexpr std::size_t kRunMax = 256;

// A point of a drawn line: its place at rest, the delta of eq. 7, and the fraction of the strand's length up to it.
struct LinePoint {
  Vec3f x;
  float delta, fraction;
  // Whether it is a point of the groom; otherwise it is a point of the spline between two of them.
  bool own = true;
};
using Line = std::vector<LinePoint>;

// Catmull-Rom between b and c.
Vec3f spline(const Vec3f& a, const Vec3f& b, const Vec3f& c, const Vec3f& d, float t) {
  return 0.5f * (2 * b + t * (c - a) + t * t * (2 * a - 5 * b + 4 * c - d) + t * t * t * (3 * (b - c) + d - a));
}

// Replaces the corners of a polyline by a curve through the same points.
Line smoothed(const Line& line) {
  // The ends have no neighbours: mirrored ones make the curve start straight.
  Line smooth;
  for (std::size_t i = 0; i + 1 < line.size(); ++i) {
    const Vec3f &b = line[i].x, &c = line[i + 1].x;
    const Vec3f a = i > 0 ? line[i - 1].x : Vec3f(2 * b - c),
                d = i + 2 < line.size() ? line[i + 2].x : Vec3f(2 * c - b);
    const float sag_m = (spline(a, b, c, d, 0.5f) - 0.5f * (b + c)).norm();
    // A spline's sag falls with the square of the number of pieces.
    const float wanted = std::max(std::sqrt(sag_m / kSag_m), (c - b).norm() / kPiece_m);
    const int pieces = static_cast<int>(std::clamp(std::ceil(wanted), 1.0f, static_cast<float>(kPiecesMax)));
    smooth.push_back(line[i]);
    for (int piece = 1; piece < pieces; ++piece) {
      const float t = static_cast<float>(piece) / static_cast<float>(pieces);
      smooth.push_back({spline(a, b, c, d, t), std::lerp(line[i].delta, line[i + 1].delta, t),
                        std::lerp(line[i].fraction, line[i + 1].fraction, t), false});
    }
  }
  smooth.push_back(line.back());
  return smooth;
}

// The point in (first, last) that is furthest from the line between both ends; `first` when none is beyond the
// tolerance.
std::size_t furthest(const Line& line, std::size_t first, std::size_t last, float tolerance_m) {
  // The distance to the segment, not to its infinite line: curls double back beyond the ends.
  const Vec3f from = line[first].x, along = line[last].x - from;
  // Both ends of a closed loop lie at one place.
  const float length2 = std::max(along.squaredNorm(), 1e-20f);
  float worst = tolerance_m * tolerance_m;
  std::size_t at = first;
  for (std::size_t i = first + 1; i < last; ++i) {
    const Vec3f away = line[i].x - from;
    const float distance2 = (away - std::clamp(away.dot(along) / length2, 0.0f, 1.0f) * along).squaredNorm();
    if (distance2 > worst) {
      worst = distance2;
      at = i;
    }
  }
  return at;
}

// Marks the points in (first, last) that must stay so that nothing is further than the tolerance from the line
// (Douglas, Peucker). It keeps a list of pieces instead of calling itself: a long strand would exhaust the stack.
void simplify(const Line& line, std::size_t first, std::size_t last, float tolerance_m, std::vector<bool>& kept) {
  std::vector<std::array<std::size_t, 2>> pieces{{first, last}};
  while (!pieces.empty()) {
    const auto [from, to] = pieces.back();
    pieces.pop_back();
    const std::size_t at = furthest(line, from, to, tolerance_m);
    if (at == from) continue;
    kept[at] = true;
    pieces.push_back({from, at});
    pieces.push_back({at, to});
  }
}

std::vector<bool> kept_points(const Line& line, float tolerance_m) {
  std::vector<bool> kept(line.size(), tolerance_m == 0);
  kept.front() = kept.back() = true;
  // Every fourth point stays in all lists but the last (4 mm), so that a lattice can bend the line: at rest the points
  // of a straight strand all lie on the line, and would be dropped. Root and tip always stay.
  for (std::size_t i = 0; i < line.size(); i += 4) kept[i] = kept[i] || tolerance_m < 2e-3f;
  // The first two lists (0 and 0.25 mm) are nearly exact, and keep the groom's own points.
  for (std::size_t i = 0; i < line.size(); ++i) kept[i] = kept[i] || (line[i].own && tolerance_m < 5e-4f);
  kept[line.size() / 2] = kept[line.size() / 4] = true;
  for (std::size_t i = 0; i < line.size(); i += kRunMax) kept[i] = true;
  if (tolerance_m == 0) return kept;
  // Each piece between points that always stay is simplified alone.
  const std::vector<bool> always = kept;
  for (std::size_t first = 0, i = 1; i < line.size(); ++i) {
    if (!always[i]) continue;
    simplify(line, first, i, tolerance_m, kept);
    first = i;
  }
  return kept;
}

// The strands to draw: the groom's own, then the copies of clumps, which inherit the per-point data of their strand: a
// copy has as many points, each with the same delta.
class Lines {
 public:
  explicit Lines(const GeometrySource& source) : source_(source), drawn_(source.groom) {
    points_.resize(drawn_.point_count());
    drawn_.follow(source.groom.points, points_);
    parents_.resize(source.groom.strand_count());
    std::iota(parents_.begin(), parents_.end(), 0u);
    for (const Clump& clump : source.groom.clumps) {
      parents_.insert(parents_.end(), clump.copy_count, clump.strand);
    }
  }
  [[nodiscard]] std::size_t count() const { return parents_.size(); }

  // Returns nothing for a strand that cannot be drawn: of one point, or without length.
  [[nodiscard]] Line line(std::size_t strand) const {
    const std::uint32_t begin = drawn_.strand_begin()[strand], end = drawn_.strand_begin()[strand + 1];
    const std::uint32_t parent = source_.groom.strand_begin[parents_[strand]];
    Line line;
    float length_m = 0;
    for (std::uint32_t i = begin; i < end; ++i) {
      // Lengths first; then fractions, once the whole length is known.
      if (i > begin) length_m += (points_[i] - points_[i - 1]).norm();
      line.push_back({points_[i], source_.blend[parent + (i - begin)], length_m});
    }
    if (line.size() < 2 || length_m <= 0) return {};
    for (LinePoint& point : line) point.fraction /= length_m;
    return line;
  }

 private:
  const GeometrySource& source_;
  ClumpStrands drawn_;
  std::vector<Vec3f> points_;
  // The strand of the groom whose per-point data each drawn strand has.
  std::vector<std::size_t> parents_;
};

// Adds a left and a right vertex for every point, and the points themselves. `strand`: in the order of drawing.
void add_points(const Line& line, std::size_t strand, const OcclusionGrid& occlusion, GroomGeometry& geometry) {
  StrandPoints& points = geometry.strand_points;
  float arc_m = 0;
  for (std::size_t i = 0; i < line.size(); ++i) {
    const Vec3f& x = line[i].x;
    if (i > 0) arc_m += (x - line[i - 1].x).norm();
    points.rest.push_back({x.x(), x.y(), x.z(), line[i].delta});
    // The number 0 makes the shader place the point by FFD alone, without a limit to the length.
    points.arc.push_back({arc_m, line.size() <= kPlacedMax ? static_cast<float>(i) : 0.0f});
    const Transmittance left = occlusion.at(x);
    // The same vertex twice: the shader tells left from right by the vertex's parity.
    geometry.strand_vertices.insert(geometry.strand_vertices.end(), 2,
                                    {sides_of(left), ends_of(left, line[i].fraction, 0), static_cast<float>(strand)});
  }
}

// Joins the points that stay by two triangles a segment. `first` is the first vertex of the line.
void add_triangles(const Line& line, std::uint32_t first, SimplifiedStrands& list) {
  const std::vector<bool> kept = kept_points(line, list.tolerance_m);
  std::uint32_t before = first;
  for (std::size_t i = 1; i < line.size(); ++i) {
    if (!kept[i]) continue;
    const std::uint32_t here = first + 2 * static_cast<std::uint32_t>(i);
    list.triangles.insert(list.triangles.end(), {before, before + 1, here, here, before + 1, here + 1});
    before = here;
  }
}

}  // namespace

void add_strands(const GeometrySource& source, GroomGeometry& geometry) {
  const Lines lines(source);
  for (const float tolerance_m : kTolerances_m) geometry.simplified_strands.push_back({tolerance_m, {}, {0}});
  std::vector<std::size_t> order(lines.count());
  std::iota(order.begin(), order.end(), std::size_t{0});
  // A fixed seed: the same groom has the same order in every client, and pictures can be compared.
  Random random(1);
  for (std::size_t i = order.size(); i > 1; --i) std::swap(order[i - 1], order[random.next() % i]);

  for (std::size_t n = 0; n < order.size(); ++n) {
    // A strand that is not drawn still gets its entry in the ends, so that counts of strands agree.
    if (Line line = lines.line(order[n]); !line.empty()) {
      line = smoothed(line);
      const auto first = static_cast<std::uint32_t>(geometry.strand_vertices.size());
      add_points(line, n, source.occlusion, geometry);
      for (SimplifiedStrands& list : geometry.simplified_strands) add_triangles(line, first, list);
    }
    geometry.strand_points.end.push_back(static_cast<std::uint32_t>(geometry.strand_points.rest.size()));
    for (SimplifiedStrands& list : geometry.simplified_strands)
      list.end.push_back(static_cast<std::uint32_t>(list.triangles.size()));
  }
}

}  // namespace hairnet::draw
