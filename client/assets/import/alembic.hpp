#pragma once

#include <cstddef>
#include <span>

#include "client/assets/import/strands.hpp"

namespace hairnet {

// The curves of an Alembic archive (.abc, Ogawa), each as a strand in the space of the archive: linear, Bezier,
// B-spline (also with knots) and Catmull-Rom curves of all objects that are not hidden, with the transforms above them.
// What changes is taken as it begins. Alembic says neither units nor axes. A bad curve is left out, with a doubt; an
// archive without any good one is refused, and so is one with damaged structure. Groups of strands are named by
// groom_group_name or groom_group_id, which are Epic's names, or by the object. The strands own their points: `bytes`
// may be freed afterwards.
Result<ImportedStrands> decode_alembic(std::span<const std::byte> bytes);

// How the points of those strands move: at each time for which the archive stores positions or a transform, and between
// two of an object's own in a straight line. An object whose curves change their number or points does not move. Empty
// if nothing moves. The points are those of `decode_alembic` for the same bytes, in the same order, before a caller
// divides the groups or cuts outliers. Returns an error for a point that is not finite at any time, and for more than
// 100 million points over all times.
Result<StrandMotion> decode_alembic_motion(std::span<const std::byte> bytes);

}  // namespace hairnet
