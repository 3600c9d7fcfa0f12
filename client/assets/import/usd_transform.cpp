#include "client/assets/import/usd_transform.hpp"

#include <Eigen/Geometry>
#include <Eigen/LU>
#include <limits>
#include <numbers>
#include <utility>

namespace hairnet::usda {
namespace {

using Mat4 = Eigen::Matrix4d;

// A prim that has more operations has none of them read. Each operation costs a search through the statements of its
// prim, so a long list would be quadratic.
constexpr std::size_t kOperationsMax = 256;
// An attribute that is asked for at this time gives its first sample.
constexpr double kFirst = -std::numeric_limits<double>::infinity();

std::size_t axis_of(char letter) {
  return static_cast<std::size_t>(letter - 'X');
}

// Whether the text is `count` letters of X, Y and Z; letters may repeat.
bool is_axes(std::string_view letters, std::size_t count) {
  return letters.size() == count && letters.find_first_not_of("XYZ") == std::string_view::npos;
}

Mat4 with_linear(const Mat3& linear) {
  Mat4 matrix = Mat4::Identity();
  matrix.topLeftCorner<3, 3>() = linear;
  return matrix;
}

Mat4 translation(const Vec3& by) {
  Mat4 matrix = Mat4::Identity();
  matrix.topRightCorner<3, 1>() = by;
  return matrix;
}

// Turns about the axes in the order of their letters, in degrees: rotateXYZ turns points about X first.
Mat4 rotation(std::string_view letters, const std::vector<double>& degrees) {
  Mat3 turned = Mat3::Identity();
  for (const char letter : letters) {
    const std::size_t axis = axis_of(letter);
    const double angle = degrees[letters.size() == 1 ? 0 : axis] * std::numbers::pi / 180;
    turned = Eigen::AngleAxisd(angle, Vec3::Unit(static_cast<Eigen::Index>(axis))).toRotationMatrix() * turned;
  }
  return with_linear(turned);
}

// The matrix of an operation such as rotateXYZ with its numbers; none where they do not fit it.
std::optional<Mat4> operation(std::string_view kind, std::string_view value) {
  if (kind == "transform") return matrix_of(value);
  const std::optional<std::vector<double>> read = numbers(value);
  if (!read || read->empty()) return {};
  const std::vector<double>& n = *read;
  const auto letters_after = [&](std::string_view begin) {
    return kind.starts_with(begin) ? kind.substr(begin.size()) : std::string_view("-");
  };
  if (kind == "translate" && n.size() == 3) return translation({n[0], n[1], n[2]});
  if (kind == "scale" && n.size() == 3) return with_linear(Vec3(n[0], n[1], n[2]).asDiagonal());
  // USD writes the real part of a quaternion first, as Eigen's constructor takes it.
  if (kind == "orient" && n.size() == 4) {
    const Quat turned(n[0], n[1], n[2], n[3]);
    if (!(turned.norm() > 0)) return {};
    return with_linear(turned.normalized().toRotationMatrix());
  }
  if (const auto letters = letters_after("rotate"); is_axes(letters, 3) && n.size() == 3) return rotation(letters, n);
  if (n.size() != 1) return {};
  if (const auto letters = letters_after("rotate"); is_axes(letters, 1)) return rotation(letters, n);
  if (const auto letters = letters_after("translate"); is_axes(letters, 1))
    return translation(n[0] * Vec3::Unit(static_cast<Eigen::Index>(axis_of(letters[0]))));
  if (const auto letters = letters_after("scale"); is_axes(letters, 1)) {
    Vec3 scale = Vec3::Ones();
    scale[static_cast<Eigen::Index>(axis_of(letters[0]))] = n[0];
    return with_linear(scale.asDiagonal());
  }
  return {};
}

}  // namespace

std::optional<Mat4> matrix_of(std::string_view value) {
  const std::optional<std::vector<double>> read = numbers(value);
  if (!read || read->size() != 16) return {};
  // Eigen reads the numbers by columns, which transposes a matrix that is written by rows.
  return Mat4(Eigen::Map<const Mat4>(read->data()));
}

LocalTransform local_transform(const Prim& prim) {
  constexpr std::string_view kInvert = "!invert!", kOp = "xformOp:";
  LocalTransform local;
  // The order of the list is the order of the product, so the last operation applies to the points first.
  const std::vector<std::string> order = strings(attribute(prim, "xformOpOrder").at(kFirst));
  if (order.size() > kOperationsMax) {
    local.unread.push_back("all " + std::to_string(order.size()) + " of them");
    return local;
  }
  for (const std::string& listed : order) {
    if (listed == "!resetXformStack!") {
      local.matrix = Mat4::Identity();
      local.resets = true;
      continue;
    }
    std::string_view name = listed;
    const bool is_inverse = name.starts_with(kInvert);
    if (is_inverse) name.remove_prefix(kInvert.size());
    // A suffix such as :pivot only makes names differ, and is cut off.
    const std::string_view kind = name.starts_with(kOp) ? name.substr(kOp.size()) : std::string_view{};
    const Attribute found = attribute(prim, name);
    std::optional<Mat4> matrix = operation(kind.substr(0, kind.find(':')), found.at(kFirst));
    // A pivot is a translation, and its inverse at the end of the list.
    if (matrix && is_inverse) {
      const Mat4 inverse = matrix->inverse();
      matrix = inverse.allFinite() ? std::optional(inverse) : std::nullopt;
    }
    if (!matrix || !matrix->allFinite()) {
      local.unread.emplace_back(listed);
      continue;
    }
    local.matrix = local.matrix * *matrix;
    local.is_animated = local.is_animated || found.samples.size() > 1;
  }
  return local;
}

}  // namespace hairnet::usda
