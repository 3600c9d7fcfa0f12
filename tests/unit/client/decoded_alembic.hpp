#pragma once

#include <gtest/gtest.h>

#include <algorithm>

#include "client/assets/import/alembic.hpp"
#include "tests/support/abc_writer.hpp"

namespace hairnet::test {

// The numbers are those of an Alembic file: the kind of curves (0 is cubic, 1 linear), whether they are closed, and
// their basis (0 is none, 2 a B-spline).
constexpr AbcBasis kLinear{1, 0, 0}, kBspline{0, 0, 2};

// Decodes a file that must be readable.
inline ImportedStrands decoded(const AbcBytes& bytes) {
  auto strands = decode_alembic(bytes);
  EXPECT_TRUE(strands) << strands.error();
  return strands ? std::move(*strands) : ImportedStrands();
}

inline ImportedStrands decoded(std::vector<AbcObj> objects) {
  return decoded(abc_file(std::move(objects)));
}

// Returns why a file is refused; empty means that it is not.
inline std::string refusal(const AbcBytes& bytes) {
  const auto strands = decode_alembic(bytes);
  return strands ? std::string() : strands.error();
}

inline std::string refusal(std::vector<AbcObj> objects) {
  return refusal(abc_file(std::move(objects)));
}

// Makes a curves object with this many strands of three points each. `more` are further properties of its geometry, and
// `arbitrary` are attributes.
inline AbcObj row(const std::string& name, std::size_t strands, std::vector<AbcProp> more = {},
                  std::vector<AbcProp> arbitrary = {}) {
  return curves(name, std::vector<std::int32_t>(strands, 3), {row_of_strands(strands)}, kLinear, std::move(more),
                std::move(arbitrary));
}

// Checks what every result must keep to, however damaged the file is: offsets in order, finite points, groups that
// exist.
inline void expect_valid(const ImportedStrands& strands) {
  EXPECT_EQ(strands.strand_begin.back(), strands.points.size());
  EXPECT_TRUE(std::ranges::is_sorted(strands.strand_begin));
  for (const Vec3f& x : strands.points) EXPECT_TRUE(x.allFinite());
  for (const std::uint32_t group : strands.groups) EXPECT_LT(group, strands.group_names.size());
}

}  // namespace hairnet::test
