#pragma once

#include "core/geometry/vec.hpp"

namespace hairnet::made {

// The bust as a signed distance field in head space, m: negative inside. Within a few centimetres of the skin its error
// is about a tenth; farther away it is a lower estimate of the right order. The field is symmetric about the middle
// plane. Each call evaluates up to 25 shapes, so callers that ask often, such as the mesh, ask near the skin only.
double bust_distance(const Vec3& p);

// Outward unit gradient of the field. Where the gradient vanishes, it is +Y.
Vec3 bust_normal(const Vec3& p);

// Moves `p` along the gradient until it is at least `clearance_m` off the skin; points already there stay. After 12
// steps without success the point stays where it is then, for example in a fold that is narrower than twice the
// clearance.
Vec3 push_out(Vec3 p, double clearance_m);

// The nearest point of the skin, for a point within a centimetre or so of it.
Vec3 onto_skin(Vec3 p);

// The point where the ray from the middle of the skull in `direction` leaves the skin. `direction` has unit length. A
// ray that leaves the skin several times, such as through an ear, may give any of these places.
Vec3 skin_along(const Vec3& direction);

// Directions in which roots are spread, and azimuths of the hairline, begin here.
extern const Vec3 kSkullCentre;

}  // namespace hairnet::made
