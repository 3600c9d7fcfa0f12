#pragma once

#include <Eigen/Core>
#include <type_traits>

namespace hairnet {

struct NetworkSize {
  Eigen::Index inputs = 0, hidden = 0, outputs = 0;

  [[nodiscard]] Eigen::Index weight_count() const { return 3 * hidden * (inputs + hidden + 1) + outputs * hidden; }
};

// The matrices of LearntHair in one array of numbers; T is const for those that are only read.
template <class T>
struct NetworkWeights {
  using Number = std::remove_const_t<T>;
  using Matrix = Eigen::Matrix<Number, Eigen::Dynamic, Eigen::Dynamic>;
  using Vector = Eigen::Matrix<Number, Eigen::Dynamic, 1>;
  template <class M>
  using Map = Eigen::Map<std::conditional_t<std::is_const_v<T>, const M, M>>;

  NetworkWeights(const NetworkSize& size, T* at)
      : input(at, 3 * size.hidden, size.inputs),
        hidden(at += input.size(), 3 * size.hidden, size.hidden),
        bias(at += hidden.size(), 3 * size.hidden),
        output(at += bias.size(), size.outputs, size.hidden) {}

  Map<Matrix> input, hidden;
  Map<Vector> bias;
  Map<Matrix> output;
};

// The network of LearntHair on matrices, for many characters over many ticks, and its gradient: backpropagation
// through time. A column is a character at a tick, [tick][character].
template <class T>
class Network {
 public:
  using Matrix = Eigen::Matrix<T, Eigen::Dynamic, Eigen::Dynamic>;
  using Vector = Eigen::Matrix<T, Eigen::Dynamic, 1>;

  explicit Network(const NetworkSize& size) : n_(size.hidden), size_(size) {}

  // `h`: hidden numbers of each character before the first tick; then those after the last. Returns the outputs.
  Matrix forward(const Vector& weights, const Eigen::Ref<const Matrix>& inputs, Matrix& h) {
    const NetworkWeights<const T> w(size_, weights.data());
    width_ = h.cols();
    sums_.noalias() = w.input * inputs;
    sums_.colwise() += w.bias;
    others_.resize(n_, inputs.cols());
    hidden_.resize(n_, inputs.cols() + width_);
    hidden_.leftCols(width_) = h;
    rest_ = squash(clamp(w.bias.segment(n_, n_).array()));
    for (Eigen::Index c = 0; c < inputs.cols(); c += width_) {
      const auto before = hidden_.middleCols(c, width_);
      auto a = sums_.middleCols(c, width_);
      products_.noalias() = w.hidden * before;
      others_.middleCols(c, width_) = products_.middleRows(n_, n_);
      a.topRows(n_) += products_.topRows(n_);
      a.bottomRows(n_) += products_.bottomRows(n_);
      // The gate r acts on the product N' h, hence its own place in others_: backward needs it before the gate.
      a.middleRows(n_, n_).array() += gate(clamp(a.bottomRows(n_).array())) * products_.middleRows(n_, n_).array();
      a = clamp(a.array()).matrix();
      const Array z = gate(a.topRows(n_).array());
      hidden_.middleCols(c + width_, width_).array() = before.array() + z * (target(a) - before.array());
    }
    h = hidden_.rightCols(width_);
    return w.output * hidden_.rightCols(inputs.cols());
  }

  // After forward() with the same weights and inputs: adds the gradient by the weights, from that by the outputs.
  void backward(const Vector& weights, const Eigen::Ref<const Matrix>& inputs, const Matrix& by_outputs,
                Vector& gradient) {
    const NetworkWeights<const T> w(size_, weights.data());
    NetworkWeights<T> by(size_, gradient.data());
    by.output.noalias() += by_outputs * hidden_.rightCols(inputs.cols()).transpose();
    const Matrix by_hidden = w.output.transpose() * by_outputs;
    by_sums_.resize(sums_.rows(), sums_.cols());
    by_products_.resize(sums_.rows(), sums_.cols());
    // The gradient by h of the tick, which goes back from tick to tick.
    Matrix carried = Matrix::Zero(n_, width_);
    Array by_rest = Array::Zero(n_, 1);
    for (Eigen::Index c = inputs.cols() - width_; c >= 0; c -= width_) {
      const auto a = sums_.middleCols(c, width_);
      const auto before = hidden_.middleCols(c, width_).array();
      carried += by_hidden.middleCols(c, width_);
      const Array z = gate(a.topRows(n_).array()), r = gate(a.bottomRows(n_).array());
      const Array by_target = carried.array() * z;
      // f(n0) is subtracted at every tick, so its gradient is the sum over all of them.
      by_rest -= by_target.rowwise().sum();
      auto by_a = by_sums_.middleCols(c, width_);
      by_a.topRows(n_).array() = carried.array() * (target(a) - before) * gate_slope(a.topRows(n_).array());
      by_a.middleRows(n_, n_).array() = by_target * slope(a.middleRows(n_, n_).array());
      by_a.bottomRows(n_).array() = by_a.middleRows(n_, n_).array() * others_.middleCols(c, width_).array() *
                                    gate_slope(a.bottomRows(n_).array());
      auto by_product = by_products_.middleCols(c, width_);
      by_product = by_a;
      by_product.middleRows(n_, n_).array() *= r;
      // h goes on with the share 1 - z directly, and through the three products.
      carried.array() *= T(1) - z;
      carried.noalias() += w.hidden.transpose() * by_product;
    }
    by.input.noalias() += by_sums_ * inputs.transpose();
    by.hidden.noalias() += by_products_ * hidden_.leftCols(inputs.cols()).transpose();
    by.bias += by_sums_.rowwise().sum();
    by.bias.segment(n_, n_).array() += (by_rest * slope(clamp(w.bias.segment(n_, n_).array()))).col(0);
  }

 private:
  using Array = Eigen::Array<T, Eigen::Dynamic, Eigen::Dynamic>;

  // f and its derivative, of numbers that are within -3 and 3.
  static Array squash(const Array& x) { return x * (T(27) + x.square()) / (T(27) + T(9) * x.square()); }
  // f'(x) = ((9 - x^2) / (9 + 3 x^2))^2: it is zero at the limits, so limited numbers pass no gradient on.
  static Array slope(const Array& x) { return ((T(9) - x.square()) / (T(9) + T(3) * x.square())).square(); }
  static Array gate(const Array& x) { return T(0.5) + T(0.5) * squash(x); }
  static Array gate_slope(const Array& x) { return T(0.5) * slope(x); }
  static Array clamp(const Array& x) { return x.cwiseMax(T(-3)).cwiseMin(T(3)); }
  // The n of LearntHair: the value towards which each hidden number moves.
  template <class Sums>
  Array target(const Sums& a) const {
    return squash(a.middleRows(n_, n_).array()).colwise() - rest_.col(0);
  }

  Eigen::Index n_;
  NetworkSize size_;
  Eigen::Index width_ = 0;  // characters
  // The last forward() stores these: z, n and r before f; N' h; h before each tick and after the last; f(n0).
  Matrix sums_, others_, hidden_;
  Array rest_;
  Matrix products_, by_sums_, by_products_;
};

}  // namespace hairnet
