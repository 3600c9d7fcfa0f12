#include "core/levels/build_estimate.hpp"

#include <gtest/gtest.h>

#include <thread>

#include "client/assets/made/made.hpp"
#include "core/levels/build.hpp"
#include "tests/support/build_grooms.hpp"
#include "tests/support/own_allocator.hpp"

namespace hairnet {
namespace {

using own_allocator::held_bytes;
using own_allocator::peak_bytes;

// Runs each loop on threads of its own, so that all levels are built at once, which takes the most memory.
void on_threads(std::size_t count, const std::function<void(std::size_t)>& body) {
  std::vector<std::thread> threads;
  for (std::size_t i = 0; i < std::min<std::size_t>(count, 4); ++i) {
    threads.emplace_back([&, i] {
      for (std::size_t n = i; n < count; n += 4) body(n);
    });
  }
  for (std::thread& thread : threads) thread.join();
}

struct Taken {
  std::size_t springs = 0, bytes = 0;
};

Taken build_and_measure(const Groom& groom) {
  std::array<LevelReport, 4> reports;
  const std::size_t before = held_bytes;
  // own_allocator raises the peak from here on (tests/support/own_allocator.hpp).
  peak_bytes = before;
  EXPECT_TRUE(build_levels(groom, {}, &reports, on_threads));
  Taken taken;
  taken.bytes = peak_bytes - before;
  for (const LevelReport& report : reports) taken.springs += report.springs_before;
  return taken;
}

void expect_bound(const Groom& groom) {
  const BuildEstimate estimate = estimate_build(groom);
  const Taken taken = build_and_measure(groom);
  // The estimate must be an upper bound, since a server refuses grooms by it; a bound of three times the springs, or of
  // four times the memory and 48 MB, still refuses few grooms that it could build.
  EXPECT_GE(estimate.spring_count, taken.springs);
  EXPECT_LE(estimate.spring_count, 3 * taken.springs + 100) << "too many for a bound that refuses grooms";
  EXPECT_GE(estimate.memory_bytes, taken.bytes) << "of " << taken.springs << " springs";
  EXPECT_LE(estimate.memory_bytes, (std::size_t{48} << 20) + 4 * taken.bytes);
}

TEST(BuildEstimate, bounds_springs_and_memory_of_a_strand_that_crosses_its_box_again_and_again) {
  // Springs arise where a strand passes between cells, so a small file of long segments that cross the box makes far
  // more springs than hair does.
  for (const int turns : {10, 300, 3000}) {
    SCOPED_TRACE(turns);
    expect_bound(support::make_zigzag(turns));
  }
}

TEST(BuildEstimate, bounds_springs_and_memory_of_hair) {
  expect_bound(support::make_head_of_hair(2000));
}

TEST(BuildEstimate, bounds_springs_and_memory_of_made_hairstyles) {
  for (const char* name : {"bob", "long_curly", "veiled"}) {
    SCOPED_TRACE(name);
    HairstyleOptions options;
    options.strand_count = 3000;
    const Result<Groom> groom = make_hairstyle(name, options);
    ASSERT_TRUE(groom) << groom.error();
    expect_bound(*groom);
  }
}

TEST(BuildEstimate, bounds_the_memory_of_a_body_of_triangles_in_one_place) {
  Groom groom = support::make_head_of_hair(10);
  groom.body = support::make_plain_body();
  const std::vector<std::array<std::uint32_t, 3>> triangles = groom.body.mesh.triangles;
  // Each triangle 21 times: the search tree of a mesh cannot divide triangles that lie in one place.
  for (int i = 0; i < 20; ++i)
    groom.body.mesh.triangles.insert(groom.body.mesh.triangles.end(), triangles.begin(), triangles.end());
  expect_bound(groom);
}

}  // namespace
}  // namespace hairnet
