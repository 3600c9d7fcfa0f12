#include "core/ffd/wide_deform.hpp"

#include "core/assert.hpp"

#undef HWY_TARGET_INCLUDE
#define HWY_TARGET_INCLUDE "core/ffd/wide_deform.cpp"
#include <hwy/foreach_target.h>  // compiles this file once more for each instruction set
#include <hwy/highway.h>

// Each lane is a point. Along one axis the three weights of quadratic FFD sum to one, so with middle node b
//
//     w_a a + w_b b + w_c c = b + w_a (a - b) + w_c (c - b),
//
// and linear FFD is a + t (c - a). Such differences of a stencil's nodes along x, y and z (its "terms") take 54
// subtractions of vectors of three. Every point of the cell then takes 26 multiply-adds a component, as many as
// Horner's scheme on powers of t, whose coefficients take twice the work; the sum over 27 nodes takes 39 and a third
// weight an axis. The same terms serve outside the lattice, where the weights are linear, so no other path is needed. A
// constant field has differences of exactly zero. A separate path that sums cells of at most 4, 8, 16 or 32 points over
// their nodes changed the time of 10 000 points on 10 x 10 x 10 nodes by -3 to +18 %, mostly for the worse, so there is
// none.

HWY_BEFORE_NAMESPACE();
namespace hairnet {
namespace HWY_NAMESPACE {
namespace hn = hwy::HWY_NAMESPACE;

using D = hn::ScalableTag<float>;
using V = hn::Vec<D>;
using D4 = hn::CappedTag<float, 4>;
constexpr std::size_t kLanes = hn::MaxLanes(D());
static_assert(kLanes <= kDeformOverhang);

// The farthest that t may be from the lattice, in spacings, so that the product of three axes stays within float's
// range.
constexpr float kFar = 1e9f;
constexpr float kSqrtHalf = 0.70710678f;

// Along one axis: the scale and the offset that turn a point's coordinate into its place in the cell, and the scale of
// its tangent.
struct AxisFrame {
  V scale, offset, rate;
};

// Along one axis, the weights of the terms after the first, and their growth per metre along the strand.
template <int kNodes>
struct AxisWeights {
  V w[kNodes - 1];
  V slope[kNodes - 1];
};

// The factor 1/sqrt 2 goes into scale and offset, which saves the 1/2 of the weights for every point.
template <int kNodes>
HWY_INLINE AxisFrame make_frame(float inverse_spacing, float centre) {
  const D d;
  if constexpr (kNodes == 3) {
    return {hn::Set(d, kSqrtHalf * inverse_spacing), hn::Set(d, kSqrtHalf * (0.5f + centre)),
            hn::Set(d, 2 * kSqrtHalf * inverse_spacing)};
  } else {
    return {hn::Set(d, inverse_spacing), hn::Set(d, centre), hn::Set(d, inverse_spacing)};
  }
}

// Quadratic B-spline (paper 4): with u = (1/2 - t)/sqrt 2 and v = (1/2 + t)/sqrt 2, w_a = u u and w_c = v v. Where u is
// not in [0, 1/sqrt 2] the weight continues along the tangent at the nearest such u': u' (2 u - u'); likewise v.
template <bool kOutside>
HWY_INLINE void set_weights(V x, V along, const AxisFrame& frame, AxisWeights<3>& axis) {
  const D d;
  const V width = hn::Set(d, kSqrtHalf);
  V u = hn::NegMulAdd(x, frame.scale, frame.offset);
  // A point may be at any distance: without the limit, infinity times a difference of zero would be NaN.
  if constexpr (kOutside) u = hn::Min(hn::Max(u, hn::Set(d, -kFar)), hn::Set(d, kFar));
  V v = hn::Sub(width, u);
  V u_in = u, v_in = v;
  if constexpr (kOutside) {
    const V zero = hn::Zero(d);
    u_in = hn::Min(hn::Max(u, zero), width);
    v_in = hn::Min(hn::Max(v, zero), width);
    u = hn::Sub(hn::Add(u, u), u_in);
    v = hn::Sub(hn::Add(v, v), v_in);
  }
  axis.w[0] = hn::Mul(u_in, u);
  axis.w[1] = hn::Mul(v_in, v);
  const V rate = hn::Mul(along, frame.rate);
  axis.slope[0] = hn::Neg(hn::Mul(u_in, rate));
  axis.slope[1] = hn::Mul(v_in, rate);
}

template <bool kOutside>
HWY_INLINE void set_weights(V x, V along, const AxisFrame& frame, AxisWeights<2>& axis) {
  const D d;
  V t = hn::MulSub(x, frame.scale, frame.offset);
  if constexpr (kOutside) t = hn::Min(hn::Max(t, hn::Set(d, -kFar)), hn::Set(d, kFar));
  axis.w[0] = t;
  axis.slope[0] = hn::Mul(along, frame.rate);
}

// Works along the axis whose neighbours lie kStride apart in `n`. Each line gets the node from which t counts, and then
// the differences from it.
template <int kNodes, int kStride, class V4>
HWY_INLINE void difference_lines(V4* n) {
  HWY_UNROLL(9)
  for (int line = 0; line < kNodes * kNodes; ++line) {
    V4* const at = n + line / kStride * kStride * kNodes + line % kStride;
    if constexpr (kNodes == 3) {
      const V4 low = at[0], middle = at[kStride];
      at[0] = middle;
      at[kStride] = hn::Sub(low, middle);
      at[2 * kStride] = hn::Sub(at[2 * kStride], middle);
    } else {
      at[kStride] = hn::Sub(at[kStride], at[0]);
    }
  }
}

// Computes the terms of the cell whose lowest node is `base`: terms[4 e + c] is component c of term e = i + kNodes (j +
// kNodes k).
template <int kNodes>
HWY_NOINLINE void difference_nodes(const WideDeform& work, const float* last_node, std::uint32_t base,
                                   float* HWY_RESTRICT terms) {
  constexpr int kCount = kNodes * kNodes * kNodes;
  const D4 d4;
  const float* HWY_RESTRICT nodes = work.displacements + 3 * std::size_t{base};
  const std::size_t row = 3 * std::size_t{work.row}, slice = 3 * std::size_t{work.slice};
  const std::uint32_t highest = base + (kNodes - 1) * (1 + work.row + work.slice);
  // Four floats are read for each node. The last node of the grid has only three, so a padded copy stands for it.
  const float* highest_node =
      highest + 1 == work.node_count ? last_node : work.displacements + 3 * std::size_t{highest};
  for (std::size_t c = 0; c < 3; c += hn::Lanes(d4)) {
    hn::Vec<D4> n[kCount];
    HWY_UNROLL(26)
    for (int e = 0; e < kCount - 1; ++e) {
      const int i = e % kNodes, j = e / kNodes % kNodes, k = e / (kNodes * kNodes);
      n[e] = hn::LoadU(d4, nodes + 3 * i + j * row + k * slice + c);
    }
    n[kCount - 1] = hn::LoadU(d4, highest_node + c);
    difference_lines<kNodes, 1>(n);
    difference_lines<kNodes, kNodes>(n);
    difference_lines<kNodes, kNodes * kNodes>(n);
    HWY_UNROLL(27)
    for (int e = 0; e < kCount; ++e) hn::StoreU(n[e], d4, terms + 4 * e + c);
  }
}

// The first term plus sum w_m terms_m along one line of terms.
template <int kNodes>
HWY_INLINE V line(const V* terms, const V* w) {
  V sum = hn::MulAdd(terms[1], w[0], terms[0]);
  if constexpr (kNodes == 3) sum = hn::MulAdd(terms[2], w[1], sum);
  return sum;
}
// Adds sum w_m terms_m, without the first term.
template <int kNodes>
HWY_INLINE V add_differences(const V* terms, const V* w, V sum) {
  sum = hn::MulAdd(terms[1], w[0], sum);
  if constexpr (kNodes == 3) sum = hn::MulAdd(terms[2], w[1], sum);
  return sum;
}

// One component of the displacement u and, in slope_out, of du / ds along the strand.
template <int kNodes, bool kTangents>
HWY_INLINE V component(const float* HWY_RESTRICT terms, const AxisWeights<kNodes>* axes, V& slope_out) {
  const D d;
  V plane[kNodes], plane_slope[kNodes];
  for (int k = 0; k < kNodes; ++k) {
    V row[kNodes], row_slope[kNodes];
    for (int j = 0; j < kNodes; ++j) {
      V node[kNodes];
      for (int i = 0; i < kNodes; ++i) node[i] = hn::Set(d, terms[4 * (i + kNodes * (j + kNodes * k))]);
      row[j] = line<kNodes>(node, axes[0].w);
      if constexpr (kTangents) row_slope[j] = add_differences<kNodes>(node, axes[0].slope, hn::Zero(d));
    }
    plane[k] = line<kNodes>(row, axes[1].w);
    if constexpr (kTangents) {
      plane_slope[k] = add_differences<kNodes>(row, axes[1].slope, line<kNodes>(row_slope, axes[1].w));
    }
  }
  if constexpr (kTangents) {
    slope_out = add_differences<kNodes>(plane, axes[2].slope, line<kNodes>(plane_slope, axes[2].w));
  }
  return line<kNodes>(plane, axes[2].w);
}

// Writes in the caller's order. Lanes beyond the cell write too: they contain points of the next cell, which writes
// them again, or, after the last cell, copies of its last point.
HWY_INLINE void scatter(V x, V y, V z, const std::uint32_t* HWY_RESTRICT output_offsets, float* HWY_RESTRICT out) {
  const D d;
  HWY_ALIGN float xy[2 * kLanes], only_z[kLanes];
  hn::StoreInterleaved2(x, y, d, xy);
  hn::Store(z, d, only_z);
  HWY_UNROLL(16)
  // The caller's order is not the sorted one, so every point is stored by itself: two floats at once, then the third.
  for (std::size_t i = 0; i < kLanes; ++i) {
    float* to = out + output_offsets[i];
    __builtin_memcpy(to, xy + 2 * i, 2 * sizeof(float));
    to[2] = only_z[i];
  }
}

// One cell at a time: its terms stay in the nearest cache while all of its points use them.
template <int kNodes, bool kOutside, bool kTangents>
HWY_NOINLINE void deform_cell(const WideDeform& work, const DeformCell& cell, const float* HWY_RESTRICT terms) {
  const D d;
  AxisFrame frames[3];
  for (int a = 0; a < 3; ++a) frames[a] = make_frame<kNodes>(work.inverse_spacing[a], cell.centre[a]);
  const float* const points[] = {work.points[0], work.points[1], work.points[2], work.points[3]};
  const float* const slopes[] = {work.slopes[0], work.slopes[1], work.slopes[2], work.slopes[3]};
  const std::uint32_t* const output_offsets = work.output_offsets;
  float* const points_out = work.points_out;
  float* const tangents_out = work.tangents_out;
  const std::size_t end = cell.end;
  for (std::size_t p = cell.begin; p < end; p += kLanes) {
    V x[3], along[3], u[3], du[3];
    AxisWeights<kNodes> axes[3];
    for (int a = 0; a < 3; ++a) {
      x[a] = hn::LoadU(d, points[a] + p);
      along[a] = kTangents ? hn::LoadU(d, slopes[a] + p) : hn::Zero(d);
      set_weights<kOutside>(x[a], along[a], frames[a], axes[a]);
    }
    for (int c = 0; c < 3; ++c) u[c] = component<kNodes, kTangents>(terms + c, axes, du[c]);
    const V delta = hn::LoadU(d, points[3] + p);
    for (int c = 0; c < 3; ++c) x[c] = hn::MulAdd(delta, u[c], x[c]);
    scatter(x[0], x[1], x[2], output_offsets + p, points_out);
    if constexpr (kTangents) {
      const V delta_slope = hn::LoadU(d, slopes[3] + p);
      for (int c = 0; c < 3; ++c) along[c] = hn::MulAdd(delta, du[c], hn::MulAdd(delta_slope, u[c], along[c]));
      scatter(along[0], along[1], along[2], output_offsets + p, tangents_out);
    }
  }
}

template <int kNodes, bool kTangents>
void deform_cells(const WideDeform& work) {
  // One more float at the end, so that the last node can be read as a vector of four.
  float last_node[4] = {};
  __builtin_memcpy(last_node, work.displacements + 3 * (std::size_t{work.node_count} - 1), 12);
  HWY_ALIGN float terms[4 * kNodes * kNodes * kNodes];
  for (std::size_t n = 0; n < work.cell_count; ++n) {
    const DeformCell& cell = work.cells[n];
    difference_nodes<kNodes>(work, last_node, cell.base, terms);
    if (cell.outside) {
      deform_cell<kNodes, true, kTangents>(work, cell, terms);
    } else {
      deform_cell<kNodes, false, kTangents>(work, cell, terms);
    }
  }
}

void deform_quadratic(const WideDeform& work) {
  work.tangents_out ? deform_cells<3, true>(work) : deform_cells<3, false>(work);
}
void deform_linear(const WideDeform& work) {
  work.tangents_out ? deform_cells<2, true>(work) : deform_cells<2, false>(work);
}

}  // namespace HWY_NAMESPACE
}  // namespace hairnet
HWY_AFTER_NAMESPACE();

#if HWY_ONCE
namespace hairnet {

HWY_EXPORT(deform_quadratic);
HWY_EXPORT(deform_linear);

void wide_deform(FfdKind kind, const WideDeform& work) {
  HAIRNET_ASSERT(work.cell_count > 0);
  HAIRNET_ASSERT(work.displacements != nullptr);
  HAIRNET_ASSERT(work.points_out != nullptr);
  HAIRNET_ASSERT(work.tangents_out == nullptr || work.slopes[0] != nullptr);
  HAIRNET_ASSERT(work.cells[work.cell_count - 1].base < work.node_count);
  if (kind == FfdKind::quadratic) {
    HWY_DYNAMIC_DISPATCH(deform_quadratic)(work);
  } else {
    HWY_DYNAMIC_DISPATCH(deform_linear)(work);
  }
}

}  // namespace hairnet
#endif
