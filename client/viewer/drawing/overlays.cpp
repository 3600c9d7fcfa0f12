#include "client/viewer/drawing/overlays.hpp"

#include <algorithm>
#include <cmath>
#include <numbers>
#include <vector>

#include "core/geometry/symmetric_matrix.hpp"
#include "core/skin/skin_distance_field.hpp"

namespace hairnet::viewer {
namespace {

using render::Drawing;
using render::Rgba;

// A node that is this far from its place in the designed hairstyle is red.
constexpr float kFarFromDesign_m = 0.10f;
// A spring stretched or compressed by this share has the full colour.
constexpr float kStrainShown = 0.15f;

std::uint8_t byte(float x) {
  return static_cast<std::uint8_t>(std::lround(255 * std::clamp(x, 0.0f, 1.0f)));
}

// A colour from blue at 0 over green to red at 1.
Rgba heat(float x) {
  return {byte(2 * x - 0.6f), byte(1.4f - std::abs(2.4f * x - 1.2f)), byte(1.2f - 2 * x), 255};
}

// The colour is blue for compressed springs, grey at the design length, and red for stretched ones.
Rgba strain_colour(float strain) {
  const float s = std::clamp(strain / kStrainShown, -1.0f, 1.0f);
  return s < 0 ? Rgba{byte(0.7f + 0.6f * s), byte(0.7f + 0.3f * s), byte(0.7f - 0.3f * s), 200}
               : Rgba{byte(0.7f + 0.3f * s), byte(0.7f - 0.6f * s), byte(0.7f - 0.6f * s), 200};
}

// Draws a character's lattice in the world. It computes the nodes once for all overlays of a picture.
class LatticeDrawing {
 public:
  LatticeDrawing(const ViewedCharacter& character, Drawing& drawing) : viewed_(character), drawing_(drawing) {
    std::vector<Vec3f> scratch;
    const std::span<const Vec3f> nodes = nodes_of(character.lattice, scratch);
    const LevelGeometry& geometry = *character.geometry;
    for (const std::uint32_t node : geometry.active_nodes) {
      rest_.emplace_back(geometry.lattice.node(node));
      node_.emplace_back(rest_.back() + nodes[node]);
    }
  }

  void draw_lattice() {
    const LevelGeometry& geometry = *viewed_.geometry;
    // Lattice nodes that are not simulated are not drawn: they only follow others.
    std::vector<int> active(geometry.lattice.node_count(), -1);
    for (std::size_t i = 0; i < geometry.active_nodes.size(); ++i)
      active[geometry.active_nodes[i]] = static_cast<int>(i);
    const auto colour = [&](int i) { return heat((node_[i] - rest_[i]).norm() / kFarFromDesign_m); };
    for (std::size_t i = 0; i < node_.size(); ++i) {
      drawing_.point(world(node_[i]), colour(static_cast<int>(i)));
      const auto at = geometry.lattice.coordinates(geometry.active_nodes[i]);
      for (std::size_t axis = 0; axis < 3; ++axis) {
        auto next = at;
        // Each edge is drawn from its lower end, so none twice.
        if (++next[axis] >= geometry.lattice.dims[axis]) continue;
        const int other = active[geometry.lattice.index(next[0], next[1], next[2])];
        if (other < 0) continue;
        Rgba from = colour(static_cast<int>(i)), to = colour(other);
        // Edges are fainter than nodes, or a lattice would hide the hair.
        from[3] = to[3] = 90;
        drawing_.line(world(node_[i]), world(node_[static_cast<std::size_t>(other)]), from, to);
      }
    }
  }

  // A spring's weights sum to 0 (eq. 3): draws it from the mean of its nodes with negative weights to that of the
  // others. Its strain is that of the weighted sum, whose length is what the spring resists.
  void draw_springs(const Stiffeners& springs) {
    for (std::size_t s = 0; s < springs.count(); ++s) {
      Vec3f from = Vec3f::Zero(), to = Vec3f::Zero(), vector = Vec3f::Zero();
      float from_sum = 0, to_sum = 0;
      for (std::uint32_t e = springs.begin[s]; e < springs.begin[s + 1]; ++e) {
        const float weight = springs.weights[e];
        const Vec3f& node = node_[springs.nodes[e]];
        vector += weight * node;
        (weight > 0 ? to : from) += std::abs(weight) * node;
        (weight > 0 ? to_sum : from_sum) += std::abs(weight);
      }
      const float rest_m = springs.rest[s].norm();
      // A spring without a rest length has no strain.
      if (!(from_sum > 0 && to_sum > 0 && rest_m > 0)) continue;
      drawing_.line(world(from / from_sum), world(to / to_sum), strain_colour(vector.norm() / rest_m - 1));
    }
  }

  // An attachment's weights sum to 1 (eq. 4). Draws a line from the attached point at rest to the point now.
  void draw_attachments(const Stiffeners& attachments) {
    for (std::size_t s = 0; s < attachments.count(); ++s) {
      Vec3f at = Vec3f::Zero();
      for (std::uint32_t e = attachments.begin[s]; e < attachments.begin[s + 1]; ++e)
        at += attachments.weights[e] * node_[attachments.nodes[e]];
      drawing_.line(world(attachments.rest[s]), world(at), {255, 210, 60, 230});
      drawing_.point(world(attachments.rest[s]), {255, 170, 30, 255});
    }
  }

  // Draws the points of hair that meet skin; points nearer to the skin than their limit are red.
  void draw_contacts(const Level& model) {
    const ContactPoints& contacts = model.contacts;
    const Pose& pose = viewed_.pose;
    for (std::size_t p = 0; p < contacts.count(); ++p) {
      // The weights sum to at most 1, because near the root a part of the point stays with the skull.
      Vec3f at = contacts.rest[p];
      for (std::uint32_t e = contacts.begin[p]; e < contacts.begin[p + 1]; ++e) {
        const std::size_t i = contacts.nodes[e];
        at += contacts.weights[e] * (node_[i] - rest_[i]);
      }
      const Vec3 place = pose.head().point(at.cast<double>());
      bool touches = false;
      for (std::size_t f = 0; f < model.skin->size(); ++f) {
        const SkinDistanceField& field = (*model.skin)[f];
        const Vec3 to_bone = pose[field.bone].inverse().point(place);
        // The same test as in the solver, against each bone's skin.
        touches |= skin_distance(field, to_bone) < static_cast<double>(contacts.limit[f * contacts.count() + p]);
      }
      drawing_.point(place.cast<float>(), touches ? Rgba{255, 80, 60, 255} : Rgba{120, 230, 255, 170});
    }
  }

  // Draws at each node a line along its strongest drag. A tensor has the six numbers xx xy xz yy yz zz.
  void draw_drag(const Level& model) {
    // The trace of the tensor (eq. 6) orders nodes by their drag.
    float most = 0;
    for (const auto& q : model.drag) most = std::max(most, q[0] + q[3] + q[5]);
    if (!(most > 0)) return;
    // The line of the strongest drag reaches 0.7 spacings of the lattice to each side of its node.
    const float reach_m = 0.7f * model.geometry.lattice.spacing.minCoeff();
    for (std::size_t i = 0; i < node_.size(); ++i) {
      const auto& q = model.drag[i];
      Mat3 tensor;
      tensor << q[0], q[1], q[2], q[1], q[3], q[4], q[2], q[4], q[5];
      const SymmetricEigen<3> axes = symmetric_eigen(tensor);
      // The last eigenvector is the direction of the strongest drag. The root makes weak drag visible beside strong.
      const Vec3f along = (axes.vectors.col(2) * (reach_m * std::sqrt(axes.values[2] / most))).cast<float>();
      drawing_.line(world(node_[i] - along), world(node_[i] + along), {190, 120, 255, 220});
    }
  }

 private:
  [[nodiscard]] Vec3f world(const Vec3f& head) const {
    return viewed_.pose.head().point(head.cast<double>()).cast<float>();
  }

  const ViewedCharacter& viewed_;
  Drawing& drawing_;
  // The active nodes at rest and now, in active order, head space, m.
  std::vector<Vec3f> rest_, node_;
};

bool is_chosen(const ViewedCharacter& character, std::optional<std::uint64_t> chosen) {
  return !chosen || *chosen == character.id;
}

}  // namespace

Vec3f level_colour(LevelIndex level) {
  switch (level) {
    case LevelIndex::high:
      return {0.10f, 0.45f, 0.12f};
    case LevelIndex::medium:
      return {0.55f, 0.45f, 0.05f};
    case LevelIndex::low:
      return {0.60f, 0.18f, 0.03f};
    case LevelIndex::ether:
      return {0.08f, 0.20f, 0.60f};
    case LevelIndex::learnt:
      return {0.35f, 0.12f, 0.45f};
    case LevelIndex::rigid:
      return {0.25f, 0.25f, 0.27f};
  }
  return Vec3f::Zero();
}

void draw_overlays(const Overlays& overlays, std::span<const ViewedCharacter> viewed,
                   std::optional<std::uint64_t> chosen, Drawing& drawing) {
  for (const ViewedCharacter& character : viewed) {
    if (!is_chosen(character, chosen) || character.geometry == nullptr) continue;
    LatticeDrawing lattice(character, drawing);
    if (overlays.lattice) lattice.draw_lattice();
    if (character.model == nullptr) continue;
    if (overlays.springs) lattice.draw_springs(character.model->springs);
    if (overlays.attachments) lattice.draw_attachments(character.model->attachments);
    if (overlays.contacts) lattice.draw_contacts(*character.model);
    if (overlays.drag) lattice.draw_drag(*character.model);
  }
}

void draw_ball(const Vec3& centre, double radius_m, const OrbitCamera& camera, Drawing& drawing) {
  // A circle in the plane of the view is the outline of a ball that is not near the eye.
  constexpr int kSides = 32;
  const auto corner = [&](int side) {
    const double angle = 2 * std::numbers::pi * side / kSides;
    const Vec3 out = std::cos(angle) * camera.right() + std::sin(angle) * camera.up();
    return Vec3f((centre + radius_m * out).cast<float>());
  };
  for (int side = 0; side < kSides; ++side) drawing.line(corner(side), corner(side + 1), {255, 210, 60, 230});
}

std::string missing_models(const Overlays& overlays, std::span<const ViewedCharacter> viewed,
                           std::optional<std::uint64_t> chosen) {
  if (!overlays.need_model()) return {};
  std::size_t missing = 0;
  for (const ViewedCharacter& character : viewed)
    missing += is_chosen(character, chosen) && character.geometry != nullptr && character.model == nullptr;
  if (missing == 0) return {};
  return std::to_string(missing) + " without springs to show: a server sends none, they are being built here";
}

}  // namespace hairnet::viewer
