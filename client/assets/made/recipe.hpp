#pragma once

#include <functional>

#include "client/assets/made/scalp.hpp"

namespace hairnet::made {

// Hair in front that is combed over the forehead and cut short. Places are in head space, lengths in metres.
struct Fringe {
  // Bounds the azimuth of the roots; zero means no fringe.
  double half_angle_deg = 0;
  // Reaches back from the hairline, in the middle.
  double depth_m = 0.035;
  // Is the share of the depth that is missing at the fringe's ends.
  double wedge = 0.5;
  // Hair is cut at this height, about the brows.
  double tip_height_m = 0.066;
  // Leads to the left (+X), relative to 1 straight ahead.
  double sweep = 0;
  // No strand of the fringe is longer.
  double length_m = 0.11;
};

// The recipe of hair that falls free from the scalp. Defaults are those of long straight hair. Functions must be pure:
// they are called for each step of every strand.
struct LooseRecipe {
  // Combing on the scalp at `p`, for a strand from `root`; only its part along the skin counts.
  std::function<Vec3(const Vec3& p, const Root& root)> comb;
  // The comb's effect fades over this arc length.
  double comb_reach_m = 0.10;
  // Weighs gravity relative to the comb, where the comb acts.
  double fall = 0.7;
  // Weighs the skin's normal in the first direction.
  double rise = 0.5;
  // See Growth::bend_m.
  double bend_m = 0.022;
  // The hair on the head is this thick at its outermost layer.
  double lift_m = 0.022;
  // The lift is reached over this arc length.
  double lift_rise_m = 0.045;
  // Ranges from 0, every strand has the same length, to 1, all are cut at one height.
  double blunt = 0.8;
  // Limits the relative shortening of some strands.
  double thinning = 0.15;
  // Scales the length at the nape and sides, relative to the top.
  double side_length = 1;
  // Strands rooted in front of this azimuth fall in front of the shoulders.
  double front_deg = 98;
  // Turns tips in to the neck.
  double tuck = 0;
  // Single strands deviate by this much.
  double flyaway = 0.05;
  int locks = 260;
  // Strands of a lock gather towards their tips, 0 … 1.
  double clumping = 0.45;
  // The gathering is complete at this share of the length.
  double gathered_at = 0.9;
  // Spreads the phases within a lock, radians.
  double curl_disorder = 0.9;
  int points = 18;
  Fringe fringe;
};

// Away from a parting on top of the head, at `x`, from `front_z` to the whorl at `back_z`. The direction has unit
// length. Behind `back_z` it leads away from the whorl in all directions.
Vec3 comb_from_parting(const Vec3& p, const Root& root, double x, double front_z, double back_z);

// Away from a whorl at the crown, on all sides. `x` and `z` are the whorl's place seen from above. The direction has
// unit length, and is zero on the whorl itself.
Vec3 comb_from_whorl(const Vec3& p, double x, double z);

}  // namespace hairnet::made
