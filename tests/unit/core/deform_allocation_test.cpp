#include <gtest/gtest.h>

#include "tests/support/own_allocator.hpp"
#include "tests/unit/core/deform_cases.hpp"

namespace hairnet {
namespace {

using namespace deform_cases;

// A Deformer is built once for a groom and then runs in each image of a viewer, where an allocation may wait for a
// lock.
TEST(Deformer, allocates_nothing_while_it_deforms) {
  const Lattice lattice = make_lattice({6, 5, 4});
  const Points points = make_points(lattice, 1);
  const std::vector<Vec3f> displacements = random_displacements(lattice, 0.05f, 2);
  std::vector<Vec3f> moved(points.x.size()), tangents(points.x.size());
  for (const FfdKind kind : {FfdKind::quadratic, FfdKind::linear}) {
    const std::size_t before_construction = own_allocator::allocation_count;
    const Deformer deformer = points.deformer(lattice, kind);
    const std::size_t before = own_allocator::allocation_count;
    // The constructor must allocate, or the counter does not count.
    ASSERT_GT(before, before_construction);
    deformer.deform(displacements, moved);
    deformer.deform(displacements, moved, tangents);
    EXPECT_EQ(own_allocator::allocation_count, before);
  }
}

}  // namespace
}  // namespace hairnet
