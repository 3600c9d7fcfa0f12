#pragma once

#include <cstddef>
#include <span>

#include "client/assets/import/strands.hpp"

namespace hairnet {

// The curves of an Alembic archive (.abc, Ogawa), each as a strand in the space of the archive: linear, Bezier,
// B-spline (also with knots) and Catmull-Rom curves of all objects that are not hidden, with the transforms above them.
// What changes is taken as it begins. Alembic says neither units nor axes. A bad curve is left out, with a doubt;
// an archive without any good one is refused, and so is one with damaged structure. Groups of strands are named by
// groom_group_name or groom_group_id, which are Epic's names, or by the object.
Result<ImportedStrands> decode_alembic(std::span<const std::byte> bytes);

// How the points of those strands move: at each time for which the archive stores positions or a transform, and between
// two of an object's own in a straight line. An object whose curves change their number or points does not move. Empty
// if nothing moves.
Result<StrandMotion> decode_alembic_motion(std::span<const std::byte> bytes);

}  // namespace hairnet
