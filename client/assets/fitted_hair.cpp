#include "client/assets/fitted_hair.hpp"

#include <algorithm>
#include <cmath>
#include <optional>
#include <string>

#include "client/assets/import/skull_fit.hpp"
#include "client/assets/made/made.hpp"
#include "core/geometry/mesh_query.hpp"

namespace hairnet {
namespace {

// Fewer strands than the style's own 14 000 are enough for a stand-in.
constexpr std::size_t kStrandCount = 4000;
// Points that the stretch leaves inside the skin are moved this far outside of it.
constexpr double kClear_m = 0.002;
// The joints of skeletons are this far from that of their skull, at most.
constexpr double kJointsApart_m = 0.08;

}  // namespace

Result<Groom> fitted_hair(const TriangleMesh& body) {
  if (body.vertices.empty() || body.triangles.empty()) return Refusal("a body without triangles");
  HairstyleOptions options;
  options.strand_count = kStrandCount;
  Result<Groom> made = make_hairstyle("short", options);
  if (!made) return made;
  Groom groom = std::move(*made);
  const std::optional<SkullFit> from = skull_of_mesh(groom.body.mesh), to = skull_of_mesh(body);
  if (!from || !to) return Refusal("the top of the body is no skull");
  // The body's origin is the joint of its head. Where they are far apart, a hat or a bun is its highest part.
  const double apart_m = to->joint().norm();
  if (apart_m > kJointsApart_m)
    return Refusal("the highest part of the body is no skull: one there would have its joint " +
                   std::to_string(std::lround(100 * apart_m)) + " cm from that of the head");
  // The stretch maps the made skull's ellipsoid to the other one, axis by axis. It does not turn, since both are in
  // head space.
  const Vec3 grown = to->semi_axes.cwiseQuotient(from->semi_axes);
  const MeshQuery skin(body);
  for (std::size_t s = 0; s < groom.strand_count(); ++s) {
    // The strand moves with its root as a whole, so the stretch does not bend it.
    Vec3 shift = Vec3::Zero();
    for (std::uint32_t i = groom.strand_begin[s]; i < groom.strand_begin[s + 1]; ++i) {
      Vec3 p = to->centre + grown.cwiseProduct(groom.points[i].cast<double>() - from->centre);
      // Moves the root onto the skin, and the strand with it.
      if (i == groom.strand_begin[s]) shift = skin.closest(p).point - p;
      p += shift;
      // Only points inside are moved, past the skin by kClear_m. Points outside keep the hairstyle's shape, even near
      // the skin.
      if (i > groom.strand_begin[s] && skin.inside(p)) {
        const Vec3 out = skin.closest(p).point - p;
        p += out * (1 + kClear_m / std::max(1e-6, out.norm()));
      }
      groom.points[i] = p.cast<float>();
    }
  }
  groom.name = "short, fitted";
  // The bust's bone weights do not fit another mesh, so weights are generated about the usual joints.
  groom.body = {};
  groom.body.mesh = body;
  generate_bone_weights(groom.body);
  if (std::string error = validate(groom); !error.empty()) return Refusal(std::move(error));
  return groom;
}

}  // namespace hairnet
