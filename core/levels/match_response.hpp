#pragma once

#include <functional>

#include "core/levels/level.hpp"

namespace hairnet {

// Fits the springs of a decimated level, that is their weights and stiffness but not their nodes, so that the lattice
// responds to smooth loads as with all springs and attachments before decimation (`all_*`, over the same nodes).
//
// The loads F model a moving head: mass times an acceleration that is affine in space (translation, rotation). Some
// waves a few cells long model contact. The lattice responds with
//
//   u = A^-1 F,   A = M / tau^2 + (Q + Q_e) / tau + K_e + sum over stiffeners (k + q / tau) (w w^T) (x) (e e^T or I)
//
// at rest, and its error is sum over loads and nodes of m |u - u_all|^2, where m is the hair's mass. L-BFGS minimises
// the error from the merged springs; the adjoint solution gives the gradient. A spring keeps its q / k, weights that
// sum to 0, and k > 0.
//
// Asserts that the counts of the lists agree. Does nothing for a level without springs. `keep_going` may be empty. It
// gets the finished fraction from time to time; when it returns false, match_response returns false and the contents of
// `level` are undefined.
[[nodiscard]] bool match_response(const Stiffeners& all_springs, const Stiffeners& all_attachments, Level& level,
                                  const std::function<bool(double)>& keep_going = {});

// The relative error that match_response reduces: sqrt(sum m |u - u_all|^2 / sum m |u_all|^2). Every load has the same
// weight. Asserts that the level has springs.
double response_error(const Stiffeners& all_springs, const Stiffeners& all_attachments, const Level& level);

}  // namespace hairnet
