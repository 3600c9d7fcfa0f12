#pragma once

#include "core/groom/groom.hpp"
#include "core/result.hpp"

namespace hairnet::viewer {

// Made hair for a body that has none, in head space: a short style of the made bust, drawn out to the other skull and
// set onto its skin. `body` needs its mesh alone.
Result<Groom> fitted_hair(const TriangleMesh& body);

}  // namespace hairnet::viewer
