#include "tests/bench/ffd_bench.hpp"

#include <hwy/targets.h>

#include <algorithm>
#include <chrono>
#include <cmath>
#include <cstring>
#include <functional>
#include <limits>
#include <span>

#include "core/ffd/deform.hpp"
#include "core/ffd/reference_deform.hpp"
#include "tests/bench/ffd_stored_weights.hpp"

namespace hairnet::bench {
namespace {

using Clock = std::chrono::steady_clock;
// A time is the shortest of at least so many runs, which together take at least kMeasure_s.
constexpr int kRunsMin = 50;
constexpr double kMeasure_s = 0.2;

// Whole strands, evenly picked.
struct Hair {
  std::vector<Vec3f> points;
  std::vector<float> blend;
  RestTangents rest;
};

// Picks whole strands, evenly from all, until there are about as many points as asked for.
Hair pick_strands(const Groom& groom, std::size_t point_count) {
  const std::vector<float> blend = root_blend(groom);
  const RestTangents rest = rest_tangents(groom, blend);
  const std::size_t stride = std::max<std::size_t>(1, groom.points.size() / point_count);
  Hair hair;
  for (std::size_t s = 0; s < groom.strand_count() && hair.points.size() < point_count; s += stride) {
    for (std::uint32_t p = groom.strand_begin[s]; p < groom.strand_begin[s + 1]; ++p) {
      hair.points.push_back(groom.points[p]);
      hair.blend.push_back(blend[p]);
      hair.rest.direction.push_back(rest.direction[p]);
      hair.rest.blend_slope.push_back(rest.blend_slope[p]);
    }
  }
  return hair;
}

// Displaces the nodes by a wave of a few centimetres, and each by other few millimetres, so that no two nodes are
// equal.
std::vector<Vec3f> lively_displacements(const Lattice& lattice) {
  std::vector<Vec3f> displacements;
  for (std::uint32_t n = 0; n < lattice.node_count(); ++n) {
    const Vec3f x = lattice.node(n);
    // A multiplicative hash of the node's number gives 0 to 5 mm.
    const auto rough = static_cast<float>(n * 2654435761u % 1000u) * 5e-6f;
    displacements.emplace_back(0.03f * std::sin(12 * x.y()) + rough, 0.02f * x.x() - rough,
                               0.03f * std::cos(9 * x.z()));
  }
  return displacements;
}

double min_ns(const std::function<void()>& run) {
  double least = std::numeric_limits<double>::max(), spent_s = 0;
  for (int n = 0; n < kRunsMin || spent_s < kMeasure_s; ++n) {
    const Clock::time_point begin = Clock::now();
    run();
    const double run_s = std::chrono::duration<double>(Clock::now() - begin).count();
    spent_s += run_s;
    least = std::min(least, 1e9 * run_s);
  }
  return least;
}

// FNV-1a.
std::uint64_t hash_bits(std::span<const Vec3f> vectors, std::uint64_t hash) {
  const auto* bytes = reinterpret_cast<const unsigned char*>(vectors.data());
  for (std::size_t b = 0; b < vectors.size_bytes(); ++b) hash = (hash ^ bytes[b]) * 1099511628211u;
  return hash;
}

// Returns the largest distance from the exact vectors, or NaN when one is not a number.
double error_max(std::span<const Vec3f> vectors, std::span<const Vec3> exact) {
  double error = 0;
  for (std::size_t p = 0; p < vectors.size(); ++p) {
    const double off = (vectors[p].cast<double>() - exact[p]).norm();
    // The comparison is written so that a NaN is taken, and stays.
    if (!(off <= error)) error = off;
  }
  return error;
}

// All of one kind, on the same points and nodes.
class FfdRun {
 public:
  FfdRun(const Lattice& lattice, const Hair& hair, FfdKind kind)
      : lattice_(lattice),
        hair_(hair),
        kind_(kind),
        displacements_(lively_displacements(lattice)),
        points_(hair.points.size()),
        tangents_(hair.points.size()) {
    for (std::size_t p = 0; p < hair.points.size(); ++p) {
      const DeformedPoint exact = reference_deform(lattice, kind,
                                                   {hair.points[p].cast<double>(), hair.blend[p],
                                                    hair.rest.direction[p].cast<double>(), hair.rest.blend_slope[p]},
                                                   displacements_);
      exact_points_.push_back(exact.x);
      exact_tangents_.push_back(exact.tangent);
    }
  }

  void time_stored_weights(std::vector<FfdTime>& times) {
    const StoredWeights stored(lattice_, kind_, hair_.points, hair_.blend);
    times.push_back(timed("stored weights", [&] { stored.deform(displacements_, points_); }));
  }
  void time_wide(const std::string& isa, std::vector<FfdTime>& times) {
    const Deformer deformer(lattice_, hair_.points, hair_.blend, hair_.rest, kind_);
    times.push_back(timed("wide, " + isa, [&] { deformer.deform(displacements_, points_); }));
    times.push_back(timed("wide with tangents, " + isa, [&] { deformer.deform(displacements_, points_, tangents_); }));
    FfdTime& with_tangents = times.back();
    with_tangents.hash = hash_bits(tangents_, with_tangents.hash);
    with_tangents.error_max_m = std::max(with_tangents.error_max_m, error_max(tangents_, exact_tangents_));
  }

 private:
  FfdTime timed(const std::string& what, const std::function<void()>& run) {
    std::ranges::fill(points_, Vec3f::Constant(std::numeric_limits<float>::quiet_NaN()));
    FfdTime time{(kind_ == FfdKind::quadratic ? "quadratic, " : "linear, ") + what};
    time.ns_per_point = min_ns(run) / static_cast<double>(points_.size());
    // The first run is that of the stored weights, with which all later ones are compared.
    if (stored_ns_ == 0) stored_ns_ = time.ns_per_point;
    time.ratio_to_stored = stored_ns_ / time.ns_per_point;
    time.hash = hash_bits(points_, 14695981039346656037u);
    time.error_max_m = error_max(points_, exact_points_);
    return time;
  }

  const Lattice& lattice_;
  const Hair& hair_;
  FfdKind kind_;
  std::vector<Vec3f> displacements_, points_, tangents_;
  std::vector<Vec3> exact_points_, exact_tangents_;
  double stored_ns_ = 0;
};

}  // namespace

std::vector<FfdTime> time_ffd(const Groom& groom, const Level& level, std::size_t point_count) {
  const Hair hair = pick_strands(groom, point_count);
  std::vector<FfdTime> times;
  for (const FfdKind kind : {FfdKind::quadratic, FfdKind::linear}) {
    FfdRun run(level.geometry.lattice, hair, kind);
    run.time_stored_weights(times);
    for (const std::int64_t target : hwy::SupportedAndGeneratedTargets()) {
      hwy::SetSupportedTargetsForTest(target);
      run.time_wide(hwy::TargetName(target), times);
    }
    // Zero makes all instruction sets of the machine available again.
    hwy::SetSupportedTargetsForTest(0);
  }
  return times;
}

}  // namespace hairnet::bench
