#include "core/ffd/deform.hpp"

#include <algorithm>
#include <cassert>
#include <numeric>
#include <tuple>

namespace hairnet {
namespace {

// Room for vectors that hang over the end.
std::vector<float> make_sorted(std::size_t count) {
  return std::vector<float>(count + kDeformOverhang, 0.0f);
}

// Lays component `axis` of one entry a point in the sorted order.
std::vector<float> sorted_axis(std::span<const Vec3f> vectors, int axis, std::span<const std::uint32_t> order) {
  std::vector<float> sorted = make_sorted(order.size());
  std::ranges::transform(order, sorted.begin(), [&](std::uint32_t p) { return vectors[p][axis]; });
  return sorted;
}

// `numbers` may be empty: all are `otherwise`.
std::vector<float> sorted_numbers(std::span<const float> numbers, float otherwise,
                                  std::span<const std::uint32_t> order) {
  std::vector<float> sorted = make_sorted(order.size());
  std::ranges::transform(order, sorted.begin(),
                         [&](std::uint32_t p) { return numbers.empty() ? otherwise : numbers[p]; });
  return sorted;
}

DeformCell make_cell(const Lattice& lattice, FfdKind kind, const FfdSite& site, std::uint32_t begin) {
  DeformCell cell{begin, begin, site.base, site.outside, {}};
  const std::array<int, 3> lowest = lattice.coordinates(site.base);
  for (int a = 0; a < 3; ++a) {
    const int from = lowest[static_cast<std::size_t>(a)] + (kind == FfdKind::quadratic ? 1 : 0);
    cell.centre[a] = lattice.origin[a] / lattice.spacing[a] + static_cast<float>(from);
  }
  return cell;
}

}  // namespace

Deformer::Deformer(const Lattice& lattice, std::span<const Vec3f> points_head, std::span<const float> blend,
                   FfdKind kind)
    : lattice_(lattice), kind_(kind) {
  assert(blend.empty() || blend.size() == points_head.size());
  assert(kind == FfdKind::linear || *std::min_element(lattice.dims.begin(), lattice.dims.end()) >= 3);
  sort_points(points_head, blend);
}

Deformer::Deformer(const Lattice& lattice, std::span<const Vec3f> points_head, std::span<const float> blend,
                   const RestTangents& rest, FfdKind kind)
    : Deformer(lattice, points_head, blend, kind) {
  assert(rest.direction.size() == points_head.size() && rest.blend_slope.size() == points_head.size());
  for (int a = 0; a < 3; ++a) slopes_[static_cast<std::size_t>(a)] = sorted_axis(rest.direction, a, order_);
  slopes_[3] = sorted_numbers(rest.blend_slope, 0, order_);
}

Deformer::Deformer(const Groom& groom, const Lattice& lattice, FfdKind kind)
    : Deformer(lattice, groom.points, root_blend(groom), kind) {}

void Deformer::sort_points(std::span<const Vec3f> points_head, std::span<const float> blend) {
  std::vector<FfdSite> sites;
  sites.reserve(points_head.size());
  for (const Vec3f& x : points_head) sites.push_back(ffd_site(lattice_, kind_, x));
  order_.resize(points_head.size());
  std::iota(order_.begin(), order_.end(), 0u);
  // Within a stencil in the caller's order, so that what is written lies close together.
  std::ranges::sort(order_, {}, [&](std::uint32_t p) { return std::tuple(sites[p].base, sites[p].outside, p); });
  for (std::uint32_t n = 0; n < order_.size(); ++n) {
    const FfdSite& site = sites[order_[n]];
    if (cells_.empty() || cells_.back().base != site.base || cells_.back().outside != site.outside) {
      cells_.push_back(make_cell(lattice_, kind_, site, n));
    }
    cells_.back().end = n + 1;
  }
  for (int a = 0; a < 3; ++a) points_[static_cast<std::size_t>(a)] = sorted_axis(points_head, a, order_);
  points_[3] = sorted_numbers(blend, 1, order_);
}

WideDeform Deformer::work(std::span<const Vec3f> grid_displacements, std::span<Vec3f> points_out) const {
  static_assert(sizeof(Vec3f) == 3 * sizeof(float));
  assert(grid_displacements.size() == lattice_.node_count() && points_out.size() == order_.size());
  WideDeform work{};
  work.cells = cells_.data();
  work.cell_count = cells_.size();
  for (std::size_t n = 0; n < 4; ++n) {
    work.points[n] = points_[n].data();
    work.slopes[n] = slopes_[n].data();
  }
  work.order = order_.data();
  for (int a = 0; a < 3; ++a) work.inverse_spacing[a] = 1 / lattice_.spacing[a];
  work.row = static_cast<std::uint32_t>(lattice_.dims[0]);
  work.slice = work.row * static_cast<std::uint32_t>(lattice_.dims[1]);
  work.node_count = static_cast<std::uint32_t>(lattice_.node_count());
  work.displacements = grid_displacements.data()->data();
  work.points_out = points_out.data()->data();
  return work;
}

void Deformer::deform(std::span<const Vec3f> grid_displacements, std::span<Vec3f> points_out) const {
  if (order_.empty()) return;
  wide_deform(kind_, work(grid_displacements, points_out));
}

void Deformer::deform(std::span<const Vec3f> grid_displacements, std::span<Vec3f> points_out,
                      std::span<Vec3f> tangents_out) const {
  assert((has_tangents() || order_.empty()) && tangents_out.size() == order_.size());
  if (order_.empty()) return;
  WideDeform both = work(grid_displacements, points_out);
  both.tangents_out = tangents_out.data()->data();
  wide_deform(kind_, both);
}

}  // namespace hairnet
