#include <cmath>
#include <cstdio>
#include <vector>

#include "client/assets/made/made.hpp"
#include "client/link/link.hpp"
#include "client/link/playout.hpp"
#include "core/ffd/deform.hpp"
#include "schema/channel/token.hpp"
#include "schema/wire/groom_file.hpp"

// Uses something of each library, so that a missing one does not link.
int main() {
  using namespace hairnet;
  link::Link connection{link::LinkOptions{}};
  const std::int64_t first_ns = connection.now_ns();

  Groom groom = *make_hairstyle("bob", {.strand_count = 20});
  groom.name = "outside";
  const wire::GroomHash hash = wire::hash_groom(wire::encode_groom(groom));

  const Lattice lattice{Vec3f(-1, -1, -1), Vec3f(1, 1, 1), {4, 4, 4}};
  const std::vector<Vec3f> points{{0, 0, 0}};
  const std::vector<Vec3f> displacements(64, Vec3f(0.1f, 0, 0));
  std::vector<Vec3f> deformed(1);
  Deformer(lattice, points, {}, FfdKind::quadratic).deform(displacements, deformed);

  const bool valid = connection.now_ns() >= first_ns && hash != wire::GroomHash{} &&
                     std::abs(deformed[0].x() - 0.1f) < 1e-6f && channel::TokenKey::parse("short").empty();
  std::puts(valid ? "valid" : "invalid");
  return valid ? 0 : 1;
}
