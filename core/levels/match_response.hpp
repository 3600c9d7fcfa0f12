#pragma once

#include <functional>

#include "core/levels/level.hpp"

namespace hairnet {

// Fits the springs of a decimated level, their weights and stiffness but not their nodes, so that the lattice gives way
// to smooth loads as it does with all springs and attachments there were (`all_*`, over the same nodes).
//
// The loads F are what a moving head does to hair: mass times an acceleration that is affine in space (translation,
// turning), and some waves a few cells long, which stand for contact. The lattice answers with
//   u = A^-1 F,   A = M / tau^2 + (Q + Q_e) / tau + K_e + sum over stiffeners (k + q / tau) (w w^T) (x) (e e^T or I)
// at rest, and its error is sum over loads and nodes of m |u - u_all|^2, m the hair's mass. Minimised by L-BFGS from
// the springs as merged; the gradient by the adjoint solution. A spring keeps its q / k, weights that sum to 0, and k >
// 0.
//
// Does nothing for a level without springs. `keep_going` may be empty. It gets the finished fraction from time to time;
// when it returns false, match_response returns false and the contents of `level` are undefined.
[[nodiscard]] bool match_response(const Stiffeners& all_springs, const Stiffeners& all_attachments, Level& level,
                                  const std::function<bool(double)>& keep_going = {});

// The relative error that match_response reduces: sqrt(sum m |u - u_all|^2 / sum m |u_all|^2). Every load has the same
// weight.
double response_error(const Stiffeners& all_springs, const Stiffeners& all_attachments, const Level& level);

}  // namespace hairnet
