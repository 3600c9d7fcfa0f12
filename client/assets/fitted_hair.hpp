#pragma once

#include "core/groom/groom.hpp"
#include "core/result.hpp"

namespace hairnet {

// Made hair for a body without hair, in head space: a short style of the made bust, stretched to the other skull and
// moved onto its skin. `body` needs only its mesh.
Result<Groom> fitted_hair(const TriangleMesh& body);

}  // namespace hairnet
