#include "core/modes/mode_map_kernel.hpp"

#undef HWY_TARGET_INCLUDE
#define HWY_TARGET_INCLUDE "core/modes/mode_map_kernel.cpp"
#include <hwy/foreach_target.h>  // compiles this file once more for each instruction set
//
#include <hwy/highway.h>

HWY_BEFORE_NAMESPACE();
namespace hairnet {
namespace HWY_NAMESPACE {
namespace hn = hwy::HWY_NAMESPACE;

// Each lane is a character. Eight sums at once hide how long each multiply-add takes.
using D = hn::CappedTag<float, kModeMapWidth>;
constexpr std::size_t kLanes = hn::MaxLanes(D());
constexpr std::size_t kRegisters = kModeMapWidth / kLanes < 2 ? 1 : 2;
constexpr D kD{};

template <std::size_t kRows>
HWY_INLINE void add_rows(const float* matrix, std::size_t stride, std::size_t columns, const float* numbers,
                         float* sums) {
  hn::Vec<D> at[kRows][kRegisters];
  for (std::size_t row = 0; row < kRows; ++row)
    for (std::size_t v = 0; v < kRegisters; ++v) at[row][v] = hn::Load(kD, sums + row * kModeMapWidth + v * kLanes);
  for (std::size_t i = 0; i < columns; ++i, numbers += kModeMapWidth) {
    hn::Vec<D> x[kRegisters];
    for (std::size_t v = 0; v < kRegisters; ++v) x[v] = hn::Load(kD, numbers + v * kLanes);
    for (std::size_t row = 0; row < kRows; ++row) {
      const hn::Vec<D> w = hn::Set(kD, matrix[row * stride + i]);
      for (std::size_t v = 0; v < kRegisters; ++v) at[row][v] = hn::MulAdd(w, x[v], at[row][v]);
    }
  }
  for (std::size_t row = 0; row < kRows; ++row)
    for (std::size_t v = 0; v < kRegisters; ++v) hn::Store(at[row][v], kD, sums + row * kModeMapWidth + v * kLanes);
}

void mode_map_kernel_here(const float* matrix, std::size_t stride, std::size_t rows, std::size_t columns,
                          const float* numbers, float* sums) {
  // The rows that are left over go one by one.
  constexpr std::size_t kRows = 8 / kRegisters;
  for (std::size_t lane = 0; lane < kModeMapWidth; lane += kRegisters * kLanes) {
    std::size_t row = 0;
    for (; row + kRows <= rows; row += kRows)
      add_rows<kRows>(matrix + row * stride, stride, columns, numbers + lane, sums + row * kModeMapWidth + lane);
    for (; row < rows; ++row)
      add_rows<1>(matrix + row * stride, stride, columns, numbers + lane, sums + row * kModeMapWidth + lane);
  }
}

}  // namespace HWY_NAMESPACE
}  // namespace hairnet
HWY_AFTER_NAMESPACE();

#if HWY_ONCE
namespace hairnet {
namespace {
HWY_EXPORT(mode_map_kernel_here);
}  // namespace

void mode_map_kernel(const float* matrix, std::size_t stride, std::size_t rows, std::size_t columns,
                     const float* numbers, float* sums) {
  HWY_DYNAMIC_DISPATCH(mode_map_kernel_here)(matrix, stride, rows, columns, numbers, sums);
}

}  // namespace hairnet
#endif
