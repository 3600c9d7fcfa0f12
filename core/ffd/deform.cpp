#include "core/ffd/deform.hpp"

#include <algorithm>
#include <limits>
#include <numeric>
#include <tuple>

#include "core/assert.hpp"

namespace hairnet {
namespace {

// One number of each point, in sorted order. The last one is repeated, since the kernel's vectors extend beyond the end
// (kDeformOverhang).
template <class Number, class Of>
std::vector<Number> sorted(std::span<const std::uint32_t> order, const Of& of) {
  std::vector<Number> numbers;
  numbers.reserve(order.size() + kDeformOverhang);
  for (const std::uint32_t p : order) numbers.push_back(of(p));
  numbers.resize(order.size() + kDeformOverhang, order.empty() ? Number{} : numbers.back());
  return numbers;
}

// The x, y and z of vectors and a fourth number, which is 1 when `fourth` is empty, each sorted.
std::array<std::vector<float>, 4> sorted_four(std::span<const std::uint32_t> order, std::span<const Vec3f> vectors,
                                              std::span<const float> fourth) {
  HAIRNET_ASSERT(vectors.size() == order.size());
  std::array<std::vector<float>, 4> four;
  for (int axis = 0; axis < 3; ++axis) {
    four[static_cast<std::size_t>(axis)] = sorted<float>(order, [&](std::uint32_t p) { return vectors[p][axis]; });
  }
  four[3] = sorted<float>(order, [&](std::uint32_t p) { return fourth.empty() ? 1.0f : fourth[p]; });
  return four;
}

// The points sorted by stencil. Points of one stencil stay in the caller's order, so that results are written close
// together.
std::vector<std::uint32_t> order_by_stencil(std::span<const FfdSite> sites) {
  std::vector<std::uint32_t> order(sites.size());
  std::iota(order.begin(), order.end(), 0u);
  std::ranges::sort(order, {}, [&](std::uint32_t p) { return std::tuple(sites[p].base, sites[p].outside, p); });
  return order;
}

// The cell of a site, without points so far.
DeformCell make_cell(const Lattice& lattice, FfdKind kind, const FfdSite& site, std::uint32_t begin) {
  DeformCell cell{begin, begin, site.base, site.outside, {}};
  const std::array<int, 3> lowest = lattice.coordinates(site.base);
  for (int a = 0; a < 3; ++a) {
    const int centre = lowest[static_cast<std::size_t>(a)] + (kind == FfdKind::quadratic ? 1 : 0);
    cell.centre[a] = lattice.origin[a] / lattice.spacing[a] + static_cast<float>(centre);
  }
  return cell;
}

// Runs of points with the same stencil. Those outside the lattice get cells of their own, since the kernel has a slower
// path for them.
std::vector<DeformCell> make_cells(const Lattice& lattice, FfdKind kind, std::span<const FfdSite> sites,
                                   std::span<const std::uint32_t> order) {
  std::vector<DeformCell> cells;
  for (std::uint32_t n = 0; n < order.size(); ++n) {
    const FfdSite& site = sites[order[n]];
    if (cells.empty() || cells.back().base != site.base || cells.back().outside != site.outside) {
      cells.push_back(make_cell(lattice, kind, site, n));
    }
    cells.back().end = n + 1;
  }
  HAIRNET_ASSERT(cells.empty() == order.empty());
  HAIRNET_ASSERT(cells.empty() || cells.back().end == order.size());
  HAIRNET_VALIDATE(std::ranges::adjacent_find(cells, [](const DeformCell& a, const DeformCell& b) {
                     return a.end != b.begin;
                   }) == cells.end());
  return cells;
}

}  // namespace

Deformer::Deformer(const Lattice& lattice, std::span<const Vec3f> points_head, std::span<const float> blend,
                   const RestTangents* rest, FfdKind kind)
    : lattice_(lattice), kind_(kind), point_count_(points_head.size()) {
  HAIRNET_ASSERT(blend.empty() || blend.size() == points_head.size());
  HAIRNET_ASSERT(std::ranges::min(lattice.dims) >= (kind == FfdKind::quadratic ? 3 : 2));
  HAIRNET_ASSERT(lattice.spacing.minCoeff() > 0);
  // Offsets count floats in 32 bits.
  HAIRNET_ASSERT(points_head.size() <= std::numeric_limits<std::uint32_t>::max() / 3);
  std::vector<FfdSite> sites;
  sites.reserve(points_head.size());
  for (const Vec3f& x : points_head) sites.push_back(ffd_site(lattice, kind, x));
  const std::vector<std::uint32_t> order = order_by_stencil(sites);
  cells_ = make_cells(lattice, kind, sites, order);
  output_offsets_ = sorted<std::uint32_t>(order, [](std::uint32_t p) { return 3 * p; });
  points_ = sorted_four(order, points_head, blend);
  if (rest == nullptr) return;
  HAIRNET_ASSERT(rest->direction.size() == points_head.size());
  HAIRNET_ASSERT(rest->blend_slope.size() == points_head.size());
  slopes_ = sorted_four(order, rest->direction, rest->blend_slope);
}

Deformer::Deformer(const Lattice& lattice, std::span<const Vec3f> points_head, std::span<const float> blend,
                   FfdKind kind)
    : Deformer(lattice, points_head, blend, nullptr, kind) {}

Deformer::Deformer(const Lattice& lattice, std::span<const Vec3f> points_head, std::span<const float> blend,
                   const RestTangents& rest, FfdKind kind)
    : Deformer(lattice, points_head, blend, &rest, kind) {}

Deformer::Deformer(const Groom& groom, const Lattice& lattice, FfdKind kind)
    : Deformer(lattice, groom.points, root_blend(groom), kind) {}

WideDeform Deformer::make_work(std::span<const Vec3f> grid_displacements, std::span<Vec3f> points_out) const {
  static_assert(sizeof(Vec3f) == 3 * sizeof(float));
  HAIRNET_ASSERT(grid_displacements.size() == lattice_.node_count());
  HAIRNET_ASSERT(points_out.size() == point_count_);
  HAIRNET_ASSERT(output_offsets_.size() == point_count_ + kDeformOverhang);
  WideDeform work{};
  work.cells = cells_.data();
  work.cell_count = cells_.size();
  for (std::size_t n = 0; n < 4; ++n) {
    work.points[n] = points_[n].data();
    work.slopes[n] = slopes_[n].data();
  }
  work.output_offsets = output_offsets_.data();
  for (int a = 0; a < 3; ++a) work.inverse_spacing[a] = 1 / lattice_.spacing[a];
  work.row = static_cast<std::uint32_t>(lattice_.dims[0]);
  work.slice = work.row * static_cast<std::uint32_t>(lattice_.dims[1]);
  work.node_count = static_cast<std::uint32_t>(lattice_.node_count());
  work.displacements = grid_displacements.data()->data();
  work.points_out = points_out.data()->data();
  return work;
}

void Deformer::deform(std::span<const Vec3f> grid_displacements, std::span<Vec3f> points_out) const {
  if (point_count_ == 0) return;
  wide_deform(kind_, make_work(grid_displacements, points_out));
}

void Deformer::deform(std::span<const Vec3f> grid_displacements, std::span<Vec3f> points_out,
                      std::span<Vec3f> tangents_out) const {
  HAIRNET_ASSERT(has_tangents());
  HAIRNET_ASSERT(tangents_out.size() == point_count_);
  if (point_count_ == 0) return;
  WideDeform work = make_work(grid_displacements, points_out);
  work.tangents_out = tangents_out.data()->data();
  wide_deform(kind_, work);
}

}  // namespace hairnet
