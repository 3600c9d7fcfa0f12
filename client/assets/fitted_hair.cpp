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

// A stand-in needs fewer strands than the 14 000 of the made style "short" (hairstyles.cpp), and is ready sooner.
constexpr std::size_t kStrandCount = 4000;
// A point that the stretch leaves inside the skin is moved to this distance outside of it, so that no strand shows
// through.
constexpr double kClear_m = 0.002;
// The joint that SkullFit guesses from a skull may differ this much from the joint of the body's skeleton. A larger
// distance means that the highest part of the body is something else.
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
  // The body's origin is the joint of its head. If the joint of the found skull is far from it, a hat or a bun is the
  // body's highest part.
  const double apart_m = to->joint().norm();
  if (apart_m > kJointsApart_m)
    return Refusal("the highest part of the body is no skull: one there would have its joint " +
                   std::to_string(std::lround(100 * apart_m)) + " cm from that of the head");
  // The stretch maps the ellipsoid of the bust's skull to that of the body, axis by axis. It needs no rotation, since
  // both are in head space.
  const Vec3 grown = to->semi_axes.cwiseQuotient(from->semi_axes);
  const MeshQuery skin(body);
  for (std::size_t s = 0; s < groom.strand_count(); ++s) {
    // The way from the stretched root to the skin. All points of the strand move by it, so its shape stays.
    Vec3 shift = Vec3::Zero();
    for (std::uint32_t i = groom.strand_begin[s]; i < groom.strand_begin[s + 1]; ++i) {
      Vec3 p = to->centre + grown.cwiseProduct(groom.points[i].cast<double>() - from->centre);
      // The first point is the root: it is moved onto the skin.
      if (i == groom.strand_begin[s]) shift = skin.closest(p).point - p;
      p += shift;
      // Only points inside of the skin are pushed out. Points outside keep the hairstyle's shape, even near the skin.
      if (i > groom.strand_begin[s] && skin.inside(p)) {
        const Vec3 out = skin.closest(p).point - p;
        // The lower bound keeps the division defined for a point on the skin.
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
