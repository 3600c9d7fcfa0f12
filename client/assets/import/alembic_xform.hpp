#pragma once

#include <string>
#include <vector>

#include "client/assets/import/alembic_archive.hpp"
#include "core/geometry/vec.hpp"

namespace hairnet {

// Between which two samples of a property a time lies, and how far from the first to the second. `share` is 0 at
// `before` and 1 at `behind`. Times outside of the samples have the first or last one.
struct AbcMoment {
  std::size_t before = 0, behind = 0;
  double share = 0;
};
// Times must ascend; others give some sample of the property, never one outside.
AbcMoment moment_of(const AbcTimes& times, std::size_t sample_count, double time_s);

// Appends the times of the samples in which a property changes, none if it is constant. A property may repeat its first
// and last values for any number of samples without storing them.
void add_sample_times(const AbcProperty& property, const AbcTimes& times, std::vector<double>& times_s);

// The transform of an object, as operations with values that may change. Angles are in degrees, lengths in units of the
// archive. Operations are applied to points from the last to the first.
class AbcXform {
 public:
  // Reads the properties of its `.xform`; the archive must outlive it. Returns an error for operations that are none,
  // or have too few values.
  static Result<AbcXform> read(const AbcArchive& archive, const std::vector<AbcProperty>& properties);

  // The matrix leads from the object's own space to its parent's, for points as columns.
  [[nodiscard]] Eigen::Affine3d matrix(double time_s) const;
  [[nodiscard]] bool inherits(double time_s) const;
  [[nodiscard]] bool changes() const;
  // Appends the times of its samples, if it changes.
  void add_times(std::vector<double>& times_s) const;

 private:
  // A property with its times, which belong to the archive.
  struct Changing {
    AbcProperty property;
    const AbcTimes* times;
  };
  std::vector<unsigned> operations_;
  // Each list has at most one entry.
  std::vector<Changing> values_, inherits_;
};

// All transforms of an archive, as a tree. Transform 0 is that of the archive, and changes nothing. Parents are added
// before their children, so each index is known when a child needs it.
class AbcXforms {
 public:
  [[nodiscard]] std::size_t add(AbcXform xform, std::size_t parent);
  // Leads to the world: up to the last transform that does not inherit.
  [[nodiscard]] Eigen::Affine3d world(std::size_t xform, double time_s) const;
  // Whether the transform or one above it changes.
  [[nodiscard]] bool changes(std::size_t xform) const;

 private:
  struct Node {
    AbcXform xform;
    std::size_t parent;
  };
  // The first entry is transform 1.
  std::vector<Node> nodes_;
};

}  // namespace hairnet
