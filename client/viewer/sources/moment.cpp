#include "client/viewer/sources/moment.hpp"

namespace hairnet::viewer {

void replay(const Moment& moment, link::LatticeBlend& blend) {
  const auto apply = [&](const Shape& shape) {
    blend.apply({true, {}, shape.level, shape.displacement, shape.time_ns, shape.geometry});
  };
  for (const Shape& shape : moment.trail) apply(shape);
  apply(moment.shape);
}

}  // namespace hairnet::viewer
