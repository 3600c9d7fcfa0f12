#pragma once

#include <Eigen/Core>

#include "core/groom/groom.hpp"
#include "core/levels/fit_lattice.hpp"
#include "core/levels/resample.hpp"
#include "core/levels/stiffener_list.hpp"

// All stiffeners of a groom, and their sum in weight space.
namespace hairnet {

// Adds a spring of one strand's hair. Its damping time is 8 ms, about that of 30 cm of hair of the default material.
inline void add_spring(const Grid& grid, const Vec3& from, const Vec3& to, const StrandProperties& strand,
                       const Material& material, StiffenerList& springs) {
  add_spring(grid, from, to, static_cast<double>(strand.hair_count * material.axial_stiffness_n), 0.008, strand.group,
             springs);
}
inline void add_attachment(const Grid& grid, const Vec3& point, const StrandProperties& strand,
                           const Material& material, StiffenerList& attachments) {
  add_attachment(grid, point, static_cast<double>(strand.hair_count * material.attachment_stiffness_n_per_m), 0.008,
                 strand.group, attachments);
}

namespace support {

inline StiffenerList springs_of(const Groom& groom, const Grid& grid) {
  StiffenerList springs;
  std::vector<Vec3> polyline, cuts;
  for (std::size_t s = 0; s < groom.strand_count(); ++s) {
    polyline_on_grid(grid, groom.strand_points(s), polyline);
    if (arc_length(grid, polyline) < kLengthMin) continue;
    cut_points(grid, polyline, cuts);
    for (std::size_t i = 1; i < cuts.size(); ++i) {
      add_spring(grid, cuts[i - 1], cuts[i], groom.strands[s], {}, springs);
    }
  }
  return springs;
}

inline StiffenerList attachments_of(const Groom& groom, const Grid& grid) {
  StiffenerList attachments;
  for (std::size_t s = 0; s < groom.strand_count(); ++s) {
    if (groom.strand_points(s).empty()) continue;
    add_attachment(grid, grid.from_head(groom.strand_points(s)[0]), groom.strands[s], {}, attachments);
  }
  return attachments;
}

inline Grid grid_of(const Groom& groom, int n) {
  return Grid(fit_lattice(groom.points, {n, n, n}));
}

// Returns the weights of one stiffener as a vector over all nodes.
inline Eigen::VectorXd dense(const StiffenerList& list, std::size_t s, std::size_t node_count) {
  Eigen::VectorXd w = Eigen::VectorXd::Zero(static_cast<Eigen::Index>(node_count));
  for (const auto& [node, weight] : list.weights(s)) w[node] = weight;
  return w;
}

// Sums k w w^T over all stiffeners: the stiffness of the nodes along one axis, if all stiffeners lay along it.
inline Eigen::MatrixXd weight_matrix(const StiffenerList& list, std::size_t node_count) {
  const auto n = static_cast<Eigen::Index>(node_count);
  Eigen::MatrixXd sum = Eigen::MatrixXd::Zero(n, n);
  for (std::size_t s = 0; s < list.count(); ++s) {
    const Eigen::VectorXd w = dense(list, s, node_count);
    sum += list.stiffness[s] * w * w.transpose();
  }
  return sum;
}

}  // namespace support
}  // namespace hairnet
