#pragma once

#include <vector>

#include "client/viewer/characters/load_characters.hpp"
#include "client/viewer/characters/options.hpp"
#include "client/viewer/sources/local_world.hpp"
#include "core/touch/touch_body.hpp"

namespace hairnet::viewer {

// Where scripts touch the hair of a groom at rest, head space, m. The constructor searches all points of the groom.
struct HairToTouch {
  explicit HairToTouch(const Groom& groom);
  // A point of hair on the left side of the head, towards the face, near the ends or the shoulder. The default is that
  // of a groom without hair at that height.
  Vec3 lock{0.1, 0, 0.05};
  // The height of the lowest hair; 0 where nothing hangs below the head joint.
  double low_m = 0;
};

// Returns the bodies of a script at a time, s, ascending by key. They move continuously, at most at 3 m/s, below the
// speed at which a body counts as one that has jumped. Their axes are the upright head's at its joint: +Y up, +Z where
// the face looks at the motion's beginning; m.
std::vector<TouchBody> scripted_bodies(TouchScript script, const HairToTouch& hair, double time_s);

// Lets a script touch the hair of the world's first character from now on; the bodies move with the head's place, but
// do not turn with it. `touched` is that character, and must outlive the world, which must stay where it is. Prints a
// line on stderr when a hand finds no hair to hold.
void touch_by_script(TouchScript script, const CharacterSetup& touched, double duration_s, LocalWorld& world);

}  // namespace hairnet::viewer
