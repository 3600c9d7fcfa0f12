#include "client/assets/import/guess_placement.hpp"

#include <algorithm>
#include <array>
#include <cmath>
#include <cstdio>
#include <limits>
#include <vector>

#include "client/assets/import/guess_unit.hpp"
#include "client/assets/import/skull_fit.hpp"

namespace hairnet {
namespace {

// Units farther from the strands' own guess than this, in the logarithm, are not tried: a factor of about 1.65. Hair
// reaches beyond the skin, and roots often cover only a part of the head, so the guess may be off.
constexpr double kUnitSlack = 0.5;
// The order decides where scores are equal: +y and +z come first, because most programs use one of them.
constexpr std::array<Axis, 6> kAxes{Axis::plus_y,  Axis::plus_z,  Axis::plus_x,
                                    Axis::minus_y, Axis::minus_z, Axis::minus_x};
// The score of the direction up must exceed the next one by this, in radii of the skull.
constexpr double kUpMargin = 0.03;
// The weight of the share of hair in front of a face: hair there speaks against a face even if the roots fit.
constexpr double kFreeFace = 12;
// The misfit of a probe is limited to this, so that a few strands far from the body do not decide.
constexpr double kFar_m = 0.03;
// A head with a part of the neck has at most this height.
constexpr double kHeadHeight_m = 0.35;
// The score compares all directions with all points, so points are sampled: about 8 of a strand show where it hangs. A
// sample takes every n-th of a list, and has less than twice the limit.
constexpr std::uint32_t kPointsOfStrand = 8;
constexpr std::size_t kRootsMax = 4000, kProbesMax = 160, kVerticesMax = 12'000;

// Roots, the vector from each root to its tip, and points between, in file coordinates.
struct Strands {
  std::vector<Vec3> roots, falls, points;
};

Strands strands_of(std::span<const StrandFile> files) {
  std::size_t count = 0;
  for (const StrandFile& file : files) count += file.strands.strand_count();
  // Every n-th strand over all files is taken, so that each file has its share.
  const std::size_t step = std::max<std::size_t>(1, count / kRootsMax);
  Strands out;
  std::size_t n = 0;
  for (const StrandFile& file : files) {
    for (std::size_t s = 0; s < file.strands.strand_count(); ++s) {
      const std::uint32_t begin = file.strands.strand_begin[s], end = file.strands.strand_begin[s + 1];
      if (begin == end || n++ % step != 0) continue;
      // The last point minus the first is the fall of the strand, whatever it does between.
      out.roots.push_back(file.strands.points[begin].cast<double>());
      out.falls.push_back(file.strands.points[end - 1].cast<double>() - out.roots.back());
      const std::uint32_t stride = std::max<std::uint32_t>(1, (end - begin) / kPointsOfStrand);
      for (std::uint32_t i = begin; i < end; i += stride) out.points.push_back(file.strands.points[i].cast<double>());
    }
  }
  return out;
}

Vec3 mean_of(const std::vector<Vec3>& vectors) {
  Vec3 sum = Vec3::Zero();
  for (const Vec3& v : vectors) sum += v;
  return sum / static_cast<double>(std::max<std::size_t>(1, vectors.size()));
}

// The share of the hair at the face's height that lies in that direction, because hair leaves faces free. The height is
// that from the middle of the skull down to its lower end; above it a fringe may lie in front as well.
double share_towards(const Strands& strands, const SkullFit& skull, const Vec3& up, const Vec3& face) {
  std::size_t beside = 0, there = 0;
  for (const Vec3& p : strands.points) {
    const Vec3 from_middle = (p - skull.centre) / skull.radius();
    const double height = from_middle.dot(up);
    if (height < -0.9 || height > 0) continue;
    const Vec3 level = from_middle - height * up;
    ++beside;
    // The cosine 0.9 means within about 26 degrees to each side.
    there += level.dot(face) > 0.9 * level.norm();
  }
  return beside == 0 ? 0 : static_cast<double>(there) / static_cast<double>(beside);
}

// Returns every n-th point.
std::vector<Vec3> thinned(const std::vector<Vec3>& points) {
  const std::size_t step = std::max<std::size_t>(1, points.size() / kVerticesMax);
  std::vector<Vec3> out;
  for (std::size_t i = 0; i < points.size(); i += step) out.push_back(points[i]);
  return out;
}

// The mean distance of the probes from the nearest vertex, each at most kFar_m.
double misfit_of(const std::vector<Vec3>& probes_m, const std::vector<Vec3>& vertices_m) {
  Vec3 low = Vec3::Constant(std::numeric_limits<double>::infinity()), high = -low;
  for (const Vec3& v : vertices_m) {
    low = low.cwiseMin(v);
    high = high.cwiseMax(v);
  }
  double sum = 0;
  for (const Vec3& probe : probes_m) {
    // The search is over all vertices; both lists are thinned, so a trial costs at most some eight million distances.
    double nearest = kFar_m * kFar_m;
    // A probe that is far from the whole mesh is skipped.
    if ((probe - probe.cwiseMax(low).cwiseMin(high)).squaredNorm() < nearest) {
      for (const Vec3& v : vertices_m) nearest = std::min(nearest, (probe - v).squaredNorm());
    }
    sum += std::sqrt(nearest);
  }
  return sum / static_cast<double>(probes_m.size());
}

// Vertices between two depths below the top, along +y of head axes; units of the file. Depths instead of heights make
// it independent of the origin of the file.
std::vector<Vec3> slab(const std::vector<Vec3>& turned, double top, double from, double to) {
  std::vector<Vec3> out;
  for (const Vec3& v : turned) {
    if (top - v.y() >= from && top - v.y() <= to) out.push_back(v);
  }
  return out;
}

Vec3 extent(const std::vector<Vec3>& points) {
  if (points.empty()) return Vec3::Zero();
  Vec3 low = points.front(), high = low;
  for (const Vec3& p : points) {
    low = low.cwiseMin(p);
    high = high.cwiseMax(p);
  }
  return high - low;
}

std::vector<Vec3> turned_by(const std::vector<Vec3>& vertices, Axis up, Axis face) {
  const Mat3 turn = rotation_to_head(up, face);
  std::vector<Vec3> out;
  for (const Vec3& v : vertices) out.emplace_back(turn * v);
  return out;
}

double top_of(const std::vector<Vec3>& points) {
  double top = -std::numeric_limits<double>::infinity();
  for (const Vec3& p : points) top = std::max(top, p.y());
  return top;
}

bool is_complete(const KnownPlacement& known) {
  return known.up && known.face && known.unit_m;
}

// The axis of the highest score, or the known one, and by how much the next is lower. A known axis has an infinite
// margin, so that it never counts as doubtful.
struct AxisChoice {
  Axis axis = Axis::plus_y;
  double margin = std::numeric_limits<double>::infinity();
};

template <class Score>
AxisChoice choose(const std::optional<Axis>& known, Score score) {
  if (known) return {*known, std::numeric_limits<double>::infinity()};
  AxisChoice choice;
  double best = -std::numeric_limits<double>::infinity(), second = best;
  for (const Axis axis : kAxes) {
    const double of_axis = score(axis);
    // Scores that differ only by rounding count as equal; the earlier axis stays, on every machine.
    if (of_axis <= best + 1e-9) {
      second = std::max(second, of_axis);
      continue;
    }
    second = best;
    best = of_axis;
    choice.axis = axis;
  }
  choice.margin = best - second;
  return choice;
}

}  // namespace

Result<Placement> guess_placement(std::span<const StrandFile> files, const KnownPlacement& known,
                                  std::vector<std::string>* doubts) {
  const Strands strands = strands_of(files);
  // Four roots are the least that determine a sphere.
  if (strands.roots.size() < 4 && !is_complete(known))
    return Refusal("too few strands to see a head in: give --up, --face and --unit");
  Placement placement;
  placement.origin = known.origin;
  const UnitGuess unit = guess_unit(strands.roots);
  // Any unit can be right where the roots cover only a part of a head, so a guess needs a usual unit or a determined
  // size.
  if (!known.unit_m && !unit.is_usual && !unit.is_sure)
    return Refusal("the roots show no head of which size would tell the unit: give --unit");
  placement.unit_m = known.unit_m.value_or(unit.m);
  // All lengths below are in radii of this skull, so the scores do not depend on the unit.
  const SkullFit skull = fit_skull_shape(strands.roots, kUsualSkullRadius_m / placement.unit_m);
  const double radius = skull.radius();
  if (!(std::isfinite(radius) && radius > 0))
    return Refusal("the strands' roots make no head: give --up, --face and --unit");
  // Scalps are the upper and back part of a head: their mean lies above and behind the middle of the skull.
  const Vec3 from_middle = (mean_of(strands.roots) - skull.centre) / radius;
  const Vec3 fall = mean_of(strands.falls) / radius;
  // Both terms are in radii. The roots lie above the middle, and hair hangs down; the fall counts half, and at most as
  // much as two radii, because short hair points up as well as down.
  const AxisChoice up = choose(known.up, [&](Axis axis) {
    return from_middle.dot(direction(axis)) - 0.5 * std::clamp(fall.dot(direction(axis)), -2.0, 2.0);
  });
  if (up.margin < kUpMargin) return Refusal("the strands do not show which way is up: give --up");
  placement.up = up.axis;
  // The mean of the roots lies behind the middle, away from the face; hair in a direction speaks against a face there.
  const auto score_of_face = [&](Axis axis) {
    if (parallel(axis, placement.up)) return -std::numeric_limits<double>::infinity();
    return -from_middle.dot(direction(axis)) -
           kFreeFace * share_towards(strands, skull, direction(placement.up), direction(axis));
  };
  const AxisChoice face = choose(known.face, score_of_face);
  placement.face = face.axis;
  // Directions within 26 degrees are 0.144 of all around the head, so evenly spread hair has this share there, by
  // chance a little more or less. Over n roots the variance of the share is 0.144 (1 - 0.144) / n, about 0.12 / n.
  const double margin = kFreeFace * std::sqrt(0.12 / static_cast<double>(strands.roots.size()));
  // Hair that hangs alike on all sides does not show the face: it is where such files usually have it.
  const Axis usual = placement.up == Axis::plus_z ? Axis::minus_y : Axis::plus_z;
  if (known.face || face.axis == usual || parallel(usual, placement.up)) return placement;
  // The usual direction needs no proof: only a face that is clearly better replaces it.
  if (score_of_face(face.axis) - score_of_face(usual) < margin) {
    placement.face = usual;
    if (doubts)
      doubts->push_back("the strands do not show where the face is: it is taken to look along " +
                        std::string(name_of(usual)) + ", as is usual; --face sets it");
  } else if (face.margin < margin) {
    return Refusal("the strands do not show where the face is: give --face");
  }
  return placement;
}

std::optional<PlacedTogether> guess_together(std::span<const StrandFile> files, const TriangleMesh& mesh,
                                             const KnownPlacement& of_strands, const KnownPlacement& of_body) {
  // Roots lie some millimetres off a mesh even with the right axes. So the body's axes are kept unless other axes make
  // the mean distance smaller by more than this factor.
  constexpr double kSlack = 1.25;
  Result<Placement> body = guess_mesh_placement(mesh, of_body);
  if (!body) return {};
  // Both files have one origin, and the roots determine the head joint.
  body->origin = of_body.origin;
  const Mat3 turn_body = body->unit_m * rotation_to_head(body->up, body->face);
  // The body is turned once; strands are turned for each trial, since they are fewer.
  std::vector<Vec3> vertices_m, probes;
  for (const Vec3f& v : mesh.vertices) vertices_m.emplace_back(turn_body * v.cast<double>());
  // Only the head matters, and a whole person has most of its vertices elsewhere.
  vertices_m = thinned(slab(vertices_m, top_of(vertices_m), 0, kHeadHeight_m));
  const Strands strands = strands_of(files);
  const std::size_t step = std::max<std::size_t>(1, strands.roots.size() / kProbesMax);
  for (std::size_t i = 0; i < strands.roots.size(); i += step) probes.push_back(strands.roots[i]);
  if (probes.empty()) return {};
  // The mean distance of roots from the head in that placement, in m.
  const auto misfit_m = [&](const Placement& placement) {
    const Mat3 turn = placement.unit_m * rotation_to_head(placement.up, placement.face);
    std::vector<Vec3> probes_m;
    for (const Vec3& probe : probes) probes_m.emplace_back(turn * probe);
    return misfit_of(probes_m, vertices_m);
  };
  // The placement of the strands, with what is known of it; the arguments stand for what is not known. Known axes and
  // units are never varied, so the loops below try some placements several times, which is harmless.
  const auto placed = [&](Axis up, Axis face, double unit_m) {
    return Placement{of_strands.up.value_or(up), of_strands.face.value_or(face), of_strands.unit_m.value_or(unit_m),
                     of_strands.origin};
  };
  Placement best = placed(body->up, body->face, body->unit_m);
  const double same_m = parallel(best.up, best.face) ? std::numeric_limits<double>::infinity() : misfit_m(best);
  double best_m = same_m;
  // Very small hair lies near any surface: try only units in which it has the size of a head's.
  std::vector<double> units_m{body->unit_m};
  if (const Result<Placement> alone = guess_placement(files, of_strands)) {
    units_m.push_back(alone->unit_m);
    for (const auto& [unit_m, rarity] : kUsualUnits) {
      if (std::abs(std::log(unit_m / alone->unit_m)) < kUnitSlack) units_m.push_back(unit_m);
    }
  }
  // All pairs of axes give 24 placements for each unit, in the order of kAxes.
  for (const double unit_m : units_m) {
    for (const Axis up : kAxes) {
      for (const Axis face : kAxes) {
        const Placement placement = placed(up, face, unit_m);
        if (parallel(placement.up, placement.face)) continue;
        const double m = misfit_m(placement);
        if (m >= best_m || m * kSlack >= same_m) continue;
        best = placement;
        best_m = m;
      }
    }
  }
  // A probe counts at most kFar_m. Where the mean of the best placement comes near that limit, most roots lie far from
  // the mesh: nothing fits, and the caller places strands and body separately.
  if (!(best_m < 0.8 * kFar_m)) return {};
  return PlacedTogether{best, *body};
}

Result<Placement> guess_mesh_placement(const TriangleMesh& mesh, const KnownPlacement& known) {
  std::vector<Vec3> vertices;
  for (const Vec3f& v : mesh.vertices) vertices.push_back(v.cast<double>());
  vertices = thinned(vertices);
  const Vec3 size = extent(vertices);
  // Without 50 vertices there are no slabs to compare.
  if (vertices.size() < 50 || !(size.minCoeff() > 0)) return Refusal("too few vertices to see a head in");
  Placement placement;
  // A person or a bust with shoulders is longer along the axis upwards than along the other one that it may be. Only
  // clearly longer along z counts, since most files have +y up.
  placement.up = known.up.value_or(size.z() > 1.15 * size.y() ? Axis::plus_z : Axis::plus_y);
  placement.face = known.face.value_or(parallel(placement.up, Axis::plus_z) ? Axis::minus_y : Axis::plus_z);
  if (parallel(placement.up, placement.face)) return Refusal(validate(placement));
  std::vector<Vec3> turned = turned_by(vertices, placement.up, placement.face);
  const double top = top_of(turned);
  // The unit for which the uppermost 9 cm are as wide as a head. Each usual unit is tried, since each makes the cap
  // another part of the mesh.
  constexpr double kCap_m = 0.09, kCapWidth_m = 0.165;
  double best = std::numeric_limits<double>::infinity();
  for (const auto& [unit_m, rarity] : kUsualUnits) {
    if (known.unit_m) break;
    const Vec3 cap = extent(slab(turned, top, 0, kCap_m / unit_m)) * unit_m;
    const double width_m = 0.5 * (cap.x() + cap.z());
    if (!(width_m > 0)) continue;
    const double misfit = std::abs(std::log(width_m / kCapWidth_m));
    if (misfit >= best) continue;
    best = misfit;
    placement.unit_m = unit_m;
  }
  if (known.unit_m) placement.unit_m = *known.unit_m;
  // A misfit of 0.7 is a factor of two in the width.
  if (!known.unit_m && !(best < 0.7)) return Refusal("its top is not the size of a head in any usual unit");
  // Chin and nose are in front of the neck. Depths in metres below the top of an adult's head: the jaw at 13 to 19 cm,
  // the neck at 23 to 26 cm. A bust that ends at the chin has no neck slab; the cap stands for it.
  const double unit_m = placement.unit_m;
  const std::vector<Vec3> jaw = slab(turned, top, 0.13 / unit_m, 0.19 / unit_m);
  const std::vector<Vec3> neck = slab(turned, top, 0.23 / unit_m, 0.26 / unit_m);
  const std::vector<Vec3> cap = slab(turned, top, 0, 0.06 / unit_m);
  const Vec3 forward = mean_of(jaw) - mean_of(neck.empty() ? cap : neck);
  double most = 0;
  Axis face = placement.face;
  for (const Axis axis : kAxes) {
    if (parallel(axis, placement.up)) continue;
    const Vec3 along = rotation_to_head(placement.up, placement.face) * direction(axis);
    // The factor keeps the earlier axis of the list where two directions are nearly equal.
    if (forward.dot(along) > 1.2 * most) {
      most = forward.dot(along);
      face = axis;
    }
  }
  if (!jaw.empty() && !known.face) placement.face = face;
  // The skull needs head axes and metres, which are known only now.
  TriangleMesh head;
  head.triangles = mesh.triangles;
  for (const Vec3f& v : mesh.vertices) head.vertices.push_back(place(placement, Vec3::Zero(), v));
  const std::optional<SkullFit> skull = skull_of_mesh(head);
  // A skeleton also shows the head of an avatar whose top is no skull.
  placement.origin = known.origin;
  if (known.origin) return placement;
  if (!skull) return Refusal("its top is no skull");
  placement.origin = rotation_to_head(placement.up, placement.face).transpose() * skull->joint() / unit_m;
  return placement;
}

std::string to_string(const Placement& placement) {
  char text[80];
  std::snprintf(text, sizeof text, "up %s, face %s, %.3g m a unit", name_of(placement.up).data(),
                name_of(placement.face).data(), placement.unit_m);
  return text;
}

}  // namespace hairnet
