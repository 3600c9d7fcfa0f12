#pragma once

#include <map>
#include <string>
#include <vector>

#include "client/assets/import/alembic_curves.hpp"
#include "client/assets/import/strands.hpp"

namespace hairnet {

// Counts things of one kind and keeps the first three of them for a line of text.
class AbcExamples {
 public:
  void add(const std::string& example, std::size_t count = 1);
  [[nodiscard]] std::size_t count() const { return count_; }
  [[nodiscard]] std::string text() const;

 private:
  std::vector<std::string> examples_;
  std::size_t count_ = 0;
};

// The place of an object in the archive, and what the objects above it say of it. It refers to the decoder's list of
// attributes and lives only for one call of `AbcStrands::add`.
struct AbcPlace {
  std::string path;
  std::string_view name;
  Eigen::Affine3d world;
  const std::vector<AbcAttribute>& above;
};

// Makes strands of curves, object after object. The lists of widths, colours, uvs and guides are empty until a curve
// has such a value, since most archives have none.
class AbcStrands {
 public:
  // Appends the good curves of an object. Returns the points on each curve, none for a bad one.
  std::vector<std::vector<CurvePoint>> add(const AbcCurves& curves, const AbcPlace& place);

  [[nodiscard]] std::size_t strand_count() const { return strands_.strand_count(); }
  [[nodiscard]] std::size_t point_count() const { return strands_.points.size(); }
  [[nodiscard]] std::size_t control_count() const { return control_count_; }
  [[nodiscard]] const AbcExamples& bad() const { return bad_; }
  [[nodiscard]] std::size_t listed_count() const { return listed_count_; }

  // Call it once, last.
  ImportedStrands take();

 private:
  void add_attributes(const AbcCurves& curves, const AbcPlace& place, std::size_t c,
                      const std::vector<CurvePoint>& points);
  std::uint32_t group_index(std::string name);
  void settle_groups();

  ImportedStrands strands_;
  // The curves that cannot become strands, with the reason.
  AbcExamples bad_;
  // The index of each group by its name.
  std::map<std::string, std::uint32_t> groups_;
  // The control points of all good curves, and the curves that the objects list, good or bad.
  std::size_t control_count_ = 0, listed_count_ = 0;
  // are_groups_said_: a file's attribute has named a group. has_object_of_many_: an object has several curves.
  bool are_groups_said_ = false, has_object_of_many_ = false;
};

}  // namespace hairnet
