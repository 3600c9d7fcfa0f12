// Included once for each instruction set (Highway's foreach_target).
#if defined(HAIRNET_SKIN_INL) == defined(HWY_TARGET_TOGGLE)
#ifdef HAIRNET_SKIN_INL
#undef HAIRNET_SKIN_INL
#else
#define HAIRNET_SKIN_INL
#endif

#include <cstddef>
#include <cstdint>

#include "core/solver/lanes_inl.hpp"
#include "core/solver/level_view.hpp"

// The skin of a bone, looked up in its grid of signed distances.
HWY_BEFORE_NAMESPACE();
namespace hairnet {
namespace HWY_NAMESPACE {

template <class Lanes>
struct Skin {
  using Real = typename Lanes::Real;
  using Vector = typename Lanes::Vector;
  using L = Lanes;

  // The signed distance and its gradient scaled to unit length, as skin_distance() of core/skin/skin_distance_field.hpp
  // computes them.
  struct SkinSample {
    Real distance;
    Vector normal;
  };
  static HWY_INLINE SkinSample at(const SkinDistanceFieldView& field, const Vector& point) {
    const Vector at = L::scale(L::real(field.per_cell), L::subtract(point, L::vector(field.origin)));
    const GridCell x = cell_along(L::x(at), field.cells[0]), y = cell_along(L::y(at), field.cells[1]),
                   z = cell_along(L::z(at), field.cells[2]);
    // Whole numbers below 2^24 are exact in float.
    const Real entry = hn::MulAdd(z.low, L::real(static_cast<float>(field.layer)),
                                  hn::MulAdd(y.low, L::real(static_cast<float>(field.row)), x.low));
    const hn::RebindToSigned<decltype(L::d)> whole;
    const auto base = hn::ConvertTo(whole, entry);
    const auto pair_at = [&](std::int32_t offset) HWY_ATTR {
      const Real a = L::gather(field.distance + offset, base), b = L::gather(field.distance + offset + 1, base);
      return Edge{hn::MulAdd(x.t, b - a, a), b - a};
    };
    const Edge e00 = pair_at(0), e10 = pair_at(field.row), e01 = pair_at(field.layer),
               e11 = pair_at(field.layer + field.row);
    const Real low = hn::MulAdd(y.t, e10.value - e00.value, e00.value),
               high = hn::MulAdd(y.t, e11.value - e01.value, e01.value);
    const Real slope_low = hn::MulAdd(y.t, e10.slope - e00.slope, e00.slope),
               slope_high = hn::MulAdd(y.t, e11.slope - e01.slope, e01.slope);
    const Real y_low = e10.value - e00.value, y_high = e11.value - e01.value;
    const Vector gradient = L::compose(hn::MulAdd(z.t, slope_high - slope_low, slope_low),
                                       hn::MulAdd(z.t, y_high - y_low, y_low), high - low);
    // In the middle of a body the gradient may vanish. The limit keeps the normal finite, though shorter than 1.
    const Real length2 = hn::Max(L::dot(gradient, gradient), L::real(1e-12f));
    const Vector beyond = L::compose(x.beyond, y.beyond, z.beyond);
    const Real distance = hn::MulAdd(z.t, high - low, low) + hn::Sqrt(L::dot(beyond, beyond)) / L::real(field.per_cell);
    return {distance, L::scale(L::real(1) / hn::Sqrt(length2), gradient)};
  }
  // A lower bound of the distance at the point, from the value at the nearest node: along an axis the distance changes
  // by at most the path's length, and the path along the axes is at most sqrt(3) times the straight one.
  static HWY_INLINE Real distance_min(const SkinDistanceFieldView& field, const Vector& point) {
    const Vector at = L::scale(L::real(field.per_cell), L::subtract(point, L::vector(field.origin)));
    const auto along = [](Real a, float cells)
                           HWY_ATTR { return hn::Round(hn::Min(hn::Max(a, L::real(0)), L::real(cells))); };
    const Real x = along(L::x(at), field.cells[0]), y = along(L::y(at), field.cells[1]),
               z = along(L::z(at), field.cells[2]);
    const Real entry = hn::MulAdd(z, L::real(static_cast<float>(field.layer)),
                                  hn::MulAdd(y, L::real(static_cast<float>(field.row)), x));
    const Vector to_node = L::subtract(at, L::compose(x, y, z));
    const Real away = hn::Sqrt(L::dot(to_node, to_node));
    // No point of a cell is farther from its nearest node than half of the cell's diagonal, sqrt(3) / 2 = 0.87 cells.
    // The slope 1.74 is sqrt(3), rounded up.
    const Real within = L::real(0.87f);
    const Real beyond = hn::Max(away - within, L::real(0)) - hn::Min(away, within) * L::real(1.74f);
    return hn::MulAdd(beyond, L::real(1 / field.per_cell),
                      L::gather(field.distance, hn::ConvertTo(hn::RebindToSigned<decltype(L::d)>(), entry)));
  }

  // The distance on an edge of a cell along x, at the point's share of it, and its slope along x.
  struct Edge {
    Real value, slope;
  };
  // Along one axis of a grid: the node below, the share of the cell from there, and how far the point is outside.
  struct GridCell {
    Real low, t, beyond;
  };
  // The last node belongs to the cell below it, so that the neighbour that is read always exists.
  static HWY_INLINE GridCell cell_along(Real at, float cells) {
    const Real within = hn::Min(hn::Max(at, L::real(0)), L::real(cells));
    const Real low = hn::Min(hn::Floor(within), L::real(cells - 1));
    return {low, within - low, at - within};
  }
};

}  // namespace HWY_NAMESPACE
}  // namespace hairnet
HWY_AFTER_NAMESPACE();

#endif
