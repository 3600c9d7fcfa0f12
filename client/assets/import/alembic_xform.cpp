#include "client/assets/import/alembic_xform.hpp"

#include <algorithm>
#include <array>
#include <numbers>
#include <utility>

namespace hairnet {
namespace {

// The upper four bits of an operation; the lower four are hints, such as that it moves to a pivot, for editors.
enum Operation : unsigned { kScale, kTranslate, kRotate, kMatrix, kRotateX, kRotateY, kRotateZ, kOperations };
constexpr std::array<std::size_t, kOperations> kValues{3, 3, 4, 16, 1, 1, 1};

// The axis need not have unit length. An axis of no length turns nothing.
Eigen::Affine3d rotation(const Vec3& axis, double degrees) {
  const double length = axis.norm();
  if (!(length > 0)) return Eigen::Affine3d::Identity();
  return Eigen::Affine3d(Eigen::AngleAxisd(degrees * std::numbers::pi / 180, axis / length));
}

Eigen::Affine3d matrix_of(unsigned operation, const double* values) {
  const Vec3 first(values[0], kValues[operation] >= 3 ? values[1] : 0, kValues[operation] >= 3 ? values[2] : 0);
  switch (operation) {
    case kScale:
      return Eigen::Affine3d(first.asDiagonal());
    case kTranslate:
      return Eigen::Affine3d(Eigen::Translation3d(first));
    case kRotate:
      return rotation(first, values[3]);
    case kMatrix: {
      // Alembic writes rows for points that are rows. Eigen maps memory by columns, and so makes the matrix for points
      // that are columns. The last row is set, so that a projective matrix cannot enter an affine transform.
      Eigen::Affine3d matrix;
      matrix.matrix() = Eigen::Map<const Eigen::Matrix4d>(values);
      matrix.matrix().row(3) << 0, 0, 0, 1;
      return matrix;
    }
    default:
      return rotation(Vec3::Unit(static_cast<Eigen::Index>(operation - kRotateX)), values[0]);
  }
}

}  // namespace

// A binary search for the last sample at or before the time. Its invariant: the sample `before` is not later than the
// time, except for sample 0, and the sample `end` is later.
AbcMoment moment_of(const AbcTimes& times, std::size_t sample_count, double time_s) {
  AbcMoment moment;
  if (sample_count < 2) return moment;
  std::size_t end = sample_count;
  while (end - moment.before > 1) {
    const std::size_t middle = moment.before + (end - moment.before) / 2;
    (times.time_s(middle) <= time_s ? moment.before : end) = middle;
  }
  moment.behind = std::min(moment.before + 1, sample_count - 1);
  const double step_s = times.time_s(moment.behind) - times.time_s(moment.before);
  if (step_s > 0) moment.share = std::clamp((time_s - times.time_s(moment.before)) / step_s, 0.0, 1.0);
  return moment;
}

void add_sample_times(const AbcProperty& property, const AbcTimes& times, std::vector<double>& times_s) {
  if (property.is_constant()) return;
  times_s.push_back(times.time_s(0));
  // The sample before the first changed one counts: the motion begins there.
  for (std::size_t i = std::max(property.first_changed, 1u) - 1; i <= property.last_changed; ++i)
    times_s.push_back(times.time_s(i));
  // The last sample counts even where nothing changes any more: else a shot that ends still would be shorter.
  times_s.push_back(times.time_s(std::max<std::size_t>(property.sample_count, 1) - 1));
}

Result<AbcXform> AbcXform::read(const AbcArchive& archive, const std::vector<AbcProperty>& properties) {
  AbcXform xform;
  if (const AbcProperty* inherits = find(properties, ".inherits"))
    xform.inherits_.push_back({*inherits, &archive.times(*inherits)});
  const AbcProperty* operations = find(properties, ".ops");
  if (operations == nullptr) return xform;
  std::size_t value_count = 0;
  const AbcNumbers coded = operations->numbers(0);
  for (std::size_t i = 0; i < coded.size(); ++i) {
    // A number outside of 0 to 255 gives 16 here, which is no operation.
    const unsigned operation = coded.small(i) >> 4;
    if (operation >= kOperations) return Refusal("there is no operation " + std::to_string(operation));
    xform.operations_.push_back(operation);
    value_count += kValues[operation];
  }
  if (value_count == 0) return xform;
  const AbcProperty* values = find(properties, ".vals");
  // Without values, the operations change nothing.
  if (values == nullptr || values->sample_count == 0) return xform;
  // Only the first sample is compared with the operations; `matrix` takes missing numbers of later samples as 0.
  const std::size_t first_count = values->numbers(0).size();
  if (first_count < value_count)
    return Refusal("it has " + std::to_string(first_count) + " values, where its operations need " +
                   std::to_string(value_count));
  xform.values_.push_back({*values, &archive.times(*values)});
  return xform;
}

// The numbers of operations are interpolated, not matrices, so that a turn between two angles stays a rotation.
Eigen::Affine3d AbcXform::matrix(double time_s) const {
  Eigen::Affine3d matrix = Eigen::Affine3d::Identity();
  if (values_.empty()) return matrix;
  const AbcProperty& property = values_[0].property;
  const AbcMoment moment = moment_of(*values_[0].times, property.sample_count, time_s);
  const AbcNumbers before = property.numbers(moment.before), behind = property.numbers(moment.behind);
  std::size_t at = 0;
  for (const unsigned operation : operations_) {
    std::array<double, 16> values{};
    for (std::size_t i = 0; i < kValues[operation]; ++i, ++at) {
      values[i] = at < before.size() ? before[at] : 0;
      if (at < behind.size() && moment.share > 0) values[i] += moment.share * (behind[at] - values[i]);
    }
    matrix = matrix * matrix_of(operation, values.data());
  }
  return matrix;
}

bool AbcXform::inherits(double time_s) const {
  if (inherits_.empty()) return true;
  const AbcProperty& property = inherits_[0].property;
  const AbcNumbers value = property.numbers(moment_of(*inherits_[0].times, property.sample_count, time_s).before);
  return value.size() == 0 || value[0] != 0;
}

void AbcXform::add_times(std::vector<double>& times_s) const {
  for (const std::vector<Changing>* part : {&values_, &inherits_}) {
    for (const Changing& changing : *part) add_sample_times(changing.property, *changing.times, times_s);
  }
}

bool AbcXform::changes() const {
  const auto changes = [](const Changing& part) { return !part.property.is_constant(); };
  return std::ranges::any_of(values_, changes) || std::ranges::any_of(inherits_, changes);
}

std::size_t AbcXforms::add(AbcXform xform, std::size_t parent) {
  nodes_.push_back({std::move(xform), parent});
  return nodes_.size();
}

// The walk goes upwards from the object to the root, so each parent's matrix is multiplied on the left.
Eigen::Affine3d AbcXforms::world(std::size_t xform, double time_s) const {
  Eigen::Affine3d world = Eigen::Affine3d::Identity();
  while (xform > 0) {
    const Node& node = nodes_[xform - 1];
    world = node.xform.matrix(time_s) * world;
    xform = node.xform.inherits(time_s) ? node.parent : 0;
  }
  return world;
}

// It ignores whether transforms inherit: an object is rather taken as moving than frozen.
bool AbcXforms::changes(std::size_t xform) const {
  while (xform > 0 && !nodes_[xform - 1].xform.changes()) xform = nodes_[xform - 1].parent;
  return xform > 0;
}

}  // namespace hairnet
