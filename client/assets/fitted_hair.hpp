#pragma once

#include "core/groom/groom.hpp"
#include "core/result.hpp"

namespace hairnet {

// Made hair for a body without hair, in head space: a short style of the made bust, stretched to the other skull and
// moved onto its skin. `body` needs only its mesh. Returns an error for a body without triangles, and for one whose
// highest part is no skull, such as a hat. The origin of `body` must be the joint of its head. The groom has the body
// with generated bone weights.
Result<Groom> fitted_hair(const TriangleMesh& body);

}  // namespace hairnet
