#include <gtest/gtest.h>

#include <atomic>
#include <cstdlib>
#include <new>

#include "tests/unit/core/deform_cases.hpp"

// This program counts its allocations.
namespace {
std::atomic<std::size_t> g_allocation_count{0};
}

void* operator new(std::size_t bytes) {
  ++g_allocation_count;
  if (void* memory = std::malloc(bytes)) return memory;
  throw std::bad_alloc();
}
void operator delete(void* memory) noexcept {
  std::free(memory);
}
void operator delete(void* memory, std::size_t) noexcept {
  std::free(memory);
}

namespace hairnet {
namespace {

using namespace deform_cases;

TEST(Deformer, allocates_nothing_while_it_deforms) {
  const Lattice lattice = make_lattice({6, 5, 4});
  const Points points = make_points(lattice, 1);
  const std::vector<Vec3f> displacements = random_displacements(lattice, 0.05f, 2);
  std::vector<Vec3f> moved(points.x.size()), tangents(points.x.size());
  for (const FfdKind kind : {FfdKind::quadratic, FfdKind::linear}) {
    const std::size_t before_construction = g_allocation_count;
    const Deformer deformer = points.deformer(lattice, kind);
    const std::size_t before = g_allocation_count;
    ASSERT_GT(before, before_construction);
    deformer.deform(displacements, moved);
    deformer.deform(displacements, moved, tangents);
    EXPECT_EQ(g_allocation_count, before);
  }
}

}  // namespace
}  // namespace hairnet
