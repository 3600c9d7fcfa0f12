// Drawn strands are no longer than at rest and stay on the curve that FFD gives.
#include "core/ffd/strand_lengths.hpp"

#include <gmock/gmock.h>

#include <cmath>

#include "client/assets/made/made.hpp"
#include "core/ffd/reference_deform.hpp"
#include "tests/unit/core/deform_cases.hpp"

namespace hairnet {
namespace {

using deform_cases::make_lattice;
using deform_cases::random_displacements;

struct Strands {
  std::vector<Vec3f> points;
  std::vector<std::uint32_t> begin;
};

// Makes one strand that hangs straight down.
Strands straight(std::size_t count, float segment_m) {
  Strands strands{{}, {0}};
  for (std::size_t i = 0; i < count; ++i)
    strands.points.emplace_back(0.01f, 0.1f - segment_m * static_cast<float>(i), 0.02f);
  strands.begin.push_back(static_cast<std::uint32_t>(count));
  return strands;
}

// Returns curls and straight strands of different lengths, all within the lattice of make_lattice({8, 8, 8}) or near
// it.
Strands mixed() {
  Strands strands{{}, {0}};
  for (int s = 0; s < 40; ++s) {
    const int count = 2 + s;
    for (int i = 0; i < count; ++i) {
      const float along = 0.008f * static_cast<float>(i), turn = 0.9f * static_cast<float>(i * (s % 3));
      strands.points.emplace_back(0.002f * static_cast<float>(s) + 0.006f * std::cos(turn), 0.05f - along,
                                  -0.05f + 0.006f * std::sin(turn));
    }
    strands.begin.push_back(static_cast<std::uint32_t>(strands.points.size()));
  }
  return strands;
}

std::vector<Vec3> reference_points(const Strands& strands, const Lattice& lattice,
                                   std::span<const Vec3f> displacements) {
  std::vector<Vec3> deformed;
  for (const Vec3f& x : strands.points) {
    const RestPoint rest{x.cast<double>(), 1, Vec3::Zero(), 0};
    deformed.push_back(reference_deform(lattice, FfdKind::quadratic, rest, displacements).x);
  }
  return deformed;
}

double arc(std::span<const Vec3> strand, std::size_t to) {
  double length = 0;
  for (std::size_t i = 1; i <= to; ++i) length += (strand[i] - strand[i - 1]).norm();
  return length;
}

// The point of a polyline at an arc length, computed in the plain way.
Vec3 point_at(std::span<const Vec3> strand, double wanted) {
  for (std::size_t i = 1; i < strand.size(); ++i) {
    const double before = arc(strand, i - 1), after = arc(strand, i);
    if (wanted <= after) return strand[i - 1] + (wanted - before) / (after - before) * (strand[i] - strand[i - 1]);
  }
  return strand.back();
}

// Limits strands in the plain way: a point farther along its deformed strand than at rest moves back along it to its
// arc length at rest.
std::vector<Vec3> reference_limit(const Strands& strands, std::span<const Vec3> deformed) {
  std::vector<Vec3> rest, limited;
  for (const Vec3f& x : strands.points) rest.push_back(x.cast<double>());
  for (std::size_t s = 0; s + 1 < strands.begin.size(); ++s) {
    const std::size_t begin = strands.begin[s], count = strands.begin[s + 1] - begin;
    for (std::size_t i = 0; i < count; ++i) {
      const double wanted = arc(std::span<const Vec3>(rest).subspan(begin, count), i);
      limited.push_back(arc(deformed.subspan(begin, count), i) <= wanted
                            ? deformed[begin + i]
                            : point_at(deformed.subspan(begin, count), wanted));
    }
  }
  return limited;
}

double length(std::span<const Vec3f> points, const Strands& strands, std::size_t s) {
  double sum = 0;
  for (std::size_t i = strands.begin[s] + 1; i < strands.begin[s + 1]; ++i)
    sum += static_cast<double>((points[i] - points[i - 1]).norm());
  return sum;
}

class LimitedStrands : public testing::Test {
 protected:
  // Moves each node at random by up to size_m on each axis. With 10 cm most strands are stretched far beyond their
  // length.
  void deform(float size_m, unsigned seed) {
    const std::vector<Vec3f> displacements = random_displacements(lattice_, size_m, seed);
    deformed_.resize(strands_.points.size());
    Deformer(lattice_, strands_.points, {}, FfdKind::quadratic).deform(displacements, deformed_);
    limited_ = deformed_;
    lengths_.limit(limited_);
    reference_ = reference_points(strands_, lattice_, displacements);
  }

  const Lattice lattice_ = make_lattice({8, 8, 8});
  const Strands strands_ = mixed();
  const StrandLengths lengths_{strands_.points, strands_.begin};
  std::vector<Vec3f> deformed_, limited_;
  std::vector<Vec3> reference_;
};

TEST(StrandLengths, a_stretched_strand_ends_where_its_length_is_used_up) {
  const Strands strands = straight(11, 0.01f);
  const StrandLengths lengths(strands.points, strands.begin);
  std::vector<Vec3f> points = strands.points;
  // The strand is stretched to 1.6 times its length.
  for (Vec3f& x : points) x.y() = 0.1f + 1.6f * (x.y() - 0.1f);
  lengths.limit(points);
  for (std::size_t i = 0; i < points.size(); ++i) EXPECT_LT((points[i] - strands.points[i]).norm(), 1e-6f) << i;
}

TEST(StrandLengths, a_stretched_strand_follows_its_curve_around_a_corner) {
  const Strands strands = straight(5, 0.01f);
  const StrandLengths lengths(strands.points, strands.begin);
  const Vec3f root = strands.points.front();
  // The strand is twice as long as at rest, with a right angle in the middle.
  std::vector<Vec3f> points{root, root + Vec3f(0, -0.02f, 0), root + Vec3f(0, -0.04f, 0),
                            root + Vec3f(0.02f, -0.04f, 0), root + Vec3f(0.04f, -0.04f, 0)};
  lengths.limit(points);
  EXPECT_LT((points[3] - (root + Vec3f(0, -0.03f, 0))).norm(), 1e-6f);
  EXPECT_LT((points[4] - (root + Vec3f(0, -0.04f, 0))).norm(), 1e-6f);
}

TEST(StrandLengths, hair_at_rest_stays_to_the_bit) {
  const Groom groom = *make_hairstyle("long_curly");
  const Lattice lattice = make_lattice({6, 6, 6});
  std::vector<Vec3f> points(groom.points.size());
  Deformer(groom, lattice, FfdKind::quadratic).deform(std::vector<Vec3f>(lattice.node_count(), Vec3f::Zero()), points);
  StrandLengths(groom).limit(points);
  EXPECT_EQ(points, groom.points);
}

TEST(StrandLengths, a_compressed_strand_stays_as_it_is) {
  const Strands strands = straight(11, 0.01f);
  std::vector<Vec3f> points = strands.points;
  for (Vec3f& x : points) x.y() = 0.1f + 0.7f * (x.y() - 0.1f);
  const std::vector<Vec3f> compressed = points;
  StrandLengths(strands.points, strands.begin).limit(points);
  EXPECT_EQ(points, compressed);
}

// The first five segments are half as long as at rest and the other five half as long again. No point is farther from
// the root along the strand than at rest, so nothing may move.
TEST(StrandLengths, a_stretch_that_makes_up_for_a_compressed_one_stays) {
  const Strands strands = straight(11, 0.01f);
  std::vector<Vec3f> points = strands.points;
  for (std::size_t i = 0; i < points.size(); ++i) {
    const float along = i <= 5 ? 0.005f * static_cast<float>(i) : 0.025f + 0.015f * static_cast<float>(i - 5);
    points[i].y() = 0.1f - along;
  }
  const std::vector<Vec3f> deformed = points;
  StrandLengths(strands.points, strands.begin).limit(points);
  EXPECT_LT((points.back() - deformed.back()).norm(), 1e-6f);
  EXPECT_EQ(points[7], deformed[7]);
}

TEST_F(LimitedStrands, are_never_longer_than_at_rest) {
  for (unsigned seed = 0; seed < 10; ++seed) {
    deform(0.1f, seed);
    for (std::size_t s = 0; s + 1 < strands_.begin.size(); ++s) {
      const double rest_m = length(strands_.points, strands_, s);
      EXPECT_LE(length(limited_, strands_, s), rest_m * (1 + 1e-5)) << s;
      EXPECT_LE(length(limited_, strands_, s), length(deformed_, strands_, s) * (1 + 1e-5)) << s;
    }
  }
}

TEST_F(LimitedStrands, equal_the_reference) {
  for (unsigned seed = 0; seed < 10; ++seed) {
    deform(0.1f, seed);
    const std::vector<Vec3> expected = reference_limit(strands_, reference_);
    for (std::size_t i = 0; i < limited_.size(); ++i)
      EXPECT_LT((limited_[i].cast<double>() - expected[i]).norm(), 1e-5) << i;
  }
}

TEST_F(LimitedStrands, continue_along_the_strand_without_turning_back) {
  deform(0.1f, 3);
  for (std::size_t s = 0; s + 1 < strands_.begin.size(); ++s) {
    // Searches each point's place on the deformed strand, as its arc length, independently of the tested code.
    const std::size_t begin = strands_.begin[s], count = strands_.begin[s + 1] - begin;
    const auto strand = std::span<const Vec3>(reference_).subspan(begin, count);
    double before = -1e-9;
    for (std::size_t i = 0; i < count; ++i) {
      double place = -1;
      for (std::size_t j = 1; j < count && place < before - 1e-5; ++j) {
        const Vec3 along = strand[j] - strand[j - 1], away = limited_[begin + i].cast<double>() - strand[j - 1];
        const double t = std::clamp(away.dot(along) / along.squaredNorm(), 0.0, 1.0);
        if ((away - t * along).norm() < 1e-5) place = arc(strand, j - 1) + t * along.norm();
      }
      EXPECT_GE(place, before - 1e-5) << "strand " << s << ", point " << i;
      before = place;
    }
  }
}

TEST(StrandLengths, points_that_belong_to_no_strand_stay) {
  Strands strands = straight(3, 0.01f);
  strands.points.emplace_back(1, 2, 3);
  std::vector<Vec3f> points = strands.points;
  for (Vec3f& x : points) x *= 2;
  StrandLengths(strands.points, strands.begin).limit(points);
  EXPECT_EQ(points.back(), Vec3f(2, 4, 6));
}

TEST(StrandLengths, strands_of_one_point_or_of_no_length_are_taken) {
  const std::vector<Vec3f> rest{Vec3f::Zero(), Vec3f::Ones(), Vec3f::Ones(), Vec3f::Ones()};
  std::vector<Vec3f> points{Vec3f::Zero(), Vec3f::Ones(), Vec3f(2, 1, 1), Vec3f(3, 1, 1)};
  StrandLengths(rest, std::vector<std::uint32_t>{0, 1, 1, 4}).limit(points);
  EXPECT_EQ(points, rest);
  StrandLengths({}, {}).limit({});
}

}  // namespace
}  // namespace hairnet
