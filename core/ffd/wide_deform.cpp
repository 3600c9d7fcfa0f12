#include "core/ffd/wide_deform.hpp"

#undef HWY_TARGET_INCLUDE
#define HWY_TARGET_INCLUDE "core/ffd/wide_deform.cpp"
#include <hwy/foreach_target.h>  // compiles this file once more for each instruction set
#include <hwy/highway.h>

// A lane is a point. Along one axis the three weights of quadratic FFD sum to one, so with middle node b
//     w_a a + w_b b + w_c c = b + w_a (a - b) + w_c (c - b),
// and linear FFD is a + t (c - a). Differencing a stencil's nodes so along x, y and z (its "terms") takes 54
// subtractions of vectors of three; every point of the cell then takes 26 multiply-adds a component, where the sum over
// 27 nodes takes 39. Horner's scheme on coefficients of powers of t would take as many, but more to make them; and the
// weights hold outside the lattice as well, where they are linear and no one polynomial is.

HWY_BEFORE_NAMESPACE();
namespace hairnet {
namespace HWY_NAMESPACE {
namespace hn = hwy::HWY_NAMESPACE;

using D = hn::ScalableTag<float>;
using V = hn::Vec<D>;
using D4 = hn::CappedTag<float, 4>;
constexpr std::size_t kLanes = hn::MaxLanes(D());
static_assert(kLanes <= kDeformOverhang);

// Of t, in spacings: three axes of them multiply without leaving float's range.
constexpr float kFar = 1e9f;
constexpr float kSqrtHalf = 0.70710678f;

// Along one axis: of the terms after the first, and how those weights grow per metre along the strand.
template <int kNodes>
struct AxisWeights {
  V w[kNodes - 1];
  V slope[kNodes - 1];
};

// Quadratic, model section 7: with u = (1/2 - t)/sqrt 2 and v = (1/2 + t)/sqrt 2, w_a = u u and w_c = v v. Outside
// 0 <= u <= 1/sqrt 2 the tangent there goes on, u' (2 u - u') with u' the nearest within: 0, or 1/2 - t - 1/2 = -t.
template <bool kOutside>
HWY_INLINE void set_weights(V x, V along, float inverse_spacing, float centre, AxisWeights<3>& axis) {
  const D d;
  const V half_width = hn::Set(d, kSqrtHalf);
  V u = hn::NegMulAdd(x, hn::Set(d, kSqrtHalf * inverse_spacing), hn::Set(d, kSqrtHalf * (0.5f + centre)));
  if constexpr (kOutside) u = hn::Min(hn::Max(u, hn::Set(d, -kFar)), hn::Set(d, kFar));
  V v = hn::Sub(half_width, u);
  V u_in = u, v_in = v;
  if constexpr (kOutside) {
    const V zero = hn::Zero(d);
    u_in = hn::Min(hn::Max(u, zero), half_width);
    v_in = hn::Min(hn::Max(v, zero), half_width);
    u = hn::Sub(hn::Add(u, u), u_in);
    v = hn::Sub(hn::Add(v, v), v_in);
  }
  axis.w[0] = hn::Mul(u_in, u);
  axis.w[1] = hn::Mul(v_in, v);
  const V rate = hn::Mul(along, hn::Set(d, 2 * kSqrtHalf * inverse_spacing));
  axis.slope[0] = hn::Neg(hn::Mul(u_in, rate));
  axis.slope[1] = hn::Mul(v_in, rate);
}

template <bool kOutside>
HWY_INLINE void set_weights(V x, V along, float inverse_spacing, float centre, AxisWeights<2>& axis) {
  const D d;
  V t = hn::MulSub(x, hn::Set(d, inverse_spacing), hn::Set(d, centre));
  if constexpr (kOutside) t = hn::Min(hn::Max(t, hn::Set(d, -kFar)), hn::Set(d, kFar));
  axis.w[0] = t;
  axis.slope[0] = hn::Mul(along, hn::Set(d, inverse_spacing));
}

// terms[4 e + c]: component c of term e = i + kNodes (j + kNodes k); index 0 along an axis is the node that t counts
// from, the others are the differences from it.
template <int kNodes>
HWY_INLINE void difference_nodes(const WideDeform& work, const float* last_node, std::uint32_t base,
                                 float* HWY_RESTRICT terms) {
  constexpr int kCount = kNodes * kNodes * kNodes;
  const D4 d4;
  for (std::size_t c = 0; c < 3; c += hn::Lanes(d4)) {
    hn::Vec<D4> n[kCount];
    for (int e = 0; e < kCount; ++e) {
      const int i = e % kNodes, j = e / kNodes % kNodes, k = e / (kNodes * kNodes);
      const std::uint32_t node = base + i + j * work.row + k * work.slice;
      const float* from = work.displacements + 3 * std::size_t{node};
      if (e == kCount - 1 && node + 1 == work.node_count) from = last_node;
      n[e] = hn::LoadU(d4, from + c);
    }
    for (int stride = 1; stride < kCount; stride *= kNodes) {
      for (int line = 0; line < kCount / kNodes; ++line) {
        auto* const at = n + line / stride * stride * kNodes + line % stride;
        if constexpr (kNodes == 3) {
          const auto low = at[0], middle = at[stride], high = at[2 * stride];
          at[0] = middle;
          at[stride] = hn::Sub(low, middle);
          at[2 * stride] = hn::Sub(high, middle);
        } else {
          at[stride] = hn::Sub(at[stride], at[0]);
        }
      }
    }
    for (int e = 0; e < kCount; ++e) hn::StoreU(n[e], d4, terms + 4 * e + c);
  }
}

template <int kNodes>
HWY_INLINE V line(const V* terms, const V* w) {
  V sum = hn::MulAdd(terms[1], w[0], terms[0]);
  if constexpr (kNodes == 3) sum = hn::MulAdd(terms[2], w[1], sum);
  return sum;
}
// Adds sum w_m terms_m, the first term left out.
template <int kNodes>
HWY_INLINE V add_differences(const V* terms, const V* w, V sum) {
  sum = hn::MulAdd(terms[1], w[0], sum);
  if constexpr (kNodes == 3) sum = hn::MulAdd(terms[2], w[1], sum);
  return sum;
}

// Component c of the displacement u; and of du / ds along the strand.
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

// To the caller's order.
HWY_INLINE void scatter(V x, V y, V z, const std::uint32_t* HWY_RESTRICT order, std::size_t count,
                        float* HWY_RESTRICT out) {
  const D d;
  HWY_ALIGN float xyz[3 * kLanes];
  hn::StoreInterleaved3(x, y, z, d, xyz);
  for (std::size_t i = 0; i < count; ++i) __builtin_memcpy(out + 3 * std::size_t{order[i]}, xyz + 3 * i, 12);
}

template <int kNodes, bool kOutside, bool kTangents>
HWY_NOINLINE void deform_cell(const WideDeform& work, const DeformCell& cell, const float* HWY_RESTRICT terms) {
  const D d;
  for (std::size_t p = cell.begin; p < cell.end; p += kLanes) {
    V x[3], along[3], u[3], du[3];
    AxisWeights<kNodes> axes[3];
    for (int a = 0; a < 3; ++a) {
      x[a] = hn::LoadU(d, work.points[a] + p);
      along[a] = kTangents ? hn::LoadU(d, work.slopes[a] + p) : hn::Zero(d);
      set_weights<kOutside>(x[a], along[a], work.inverse_spacing[a], cell.centre[a], axes[a]);
    }
    for (int c = 0; c < 3; ++c) u[c] = component<kNodes, kTangents>(terms + c, axes, du[c]);
    const V delta = hn::LoadU(d, work.points[3] + p);
    for (int c = 0; c < 3; ++c) x[c] = hn::MulAdd(delta, u[c], x[c]);
    const std::size_t count = HWY_MIN(kLanes, cell.end - p);
    scatter(x[0], x[1], x[2], work.order + p, count, work.points_out);
    if constexpr (kTangents) {
      const V delta_slope = hn::LoadU(d, work.slopes[3] + p);
      for (int c = 0; c < 3; ++c) along[c] = hn::MulAdd(delta, du[c], hn::MulAdd(delta_slope, u[c], along[c]));
      scatter(along[0], along[1], along[2], work.order + p, count, work.tangents_out);
    }
  }
}

template <int kNodes, bool kTangents>
void deform_cells(const WideDeform& work) {
  // One float after it, so that it can be read as a vector of four.
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
  if (kind == FfdKind::quadratic) {
    HWY_DYNAMIC_DISPATCH(deform_quadratic)(work);
  } else {
    HWY_DYNAMIC_DISPATCH(deform_linear)(work);
  }
}

}  // namespace hairnet
#endif
