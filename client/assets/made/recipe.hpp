#pragma once

#include <functional>

#include "client/assets/made/scalp.hpp"

namespace hairnet::made {

// Hair in front that is combed over the forehead and cut short. Places are in head space, lengths in metres.
struct Fringe {
  // The largest azimuth of the roots, to each side; zero means no fringe.
  double half_angle_deg = 0;
  // The distance that the fringe reaches back from the hairline, in its middle.
  double depth_m = 0.035;
  // The share of the depth that is missing at the fringe's ends.
  double wedge = 0.5;
  // Hair is cut at this height, about the brows.
  double tip_height_m = 0.066;
  // How far the fringe leads to the left (+X), relative to 1 straight ahead.
  double sweep = 0;
  // The greatest length of a strand of the fringe.
  double length_m = 0.11;
};

// The recipe of hair that falls free from the scalp. Defaults are those of long straight hair. Functions must be pure:
// they are called for each step of every strand.
struct LooseRecipe {
  // The direction of the comb on the scalp at `p`, for a strand from `root`; only its part along the skin counts.
  std::function<Vec3(const Vec3& p, const Root& root)> comb;
  // The comb's effect fades over this arc length from the root.
  double comb_reach_m = 0.10;
  // The weight of gravity relative to the comb, where the comb acts.
  double fall = 0.7;
  // The weight of the skin's normal in the first direction of a strand.
  double rise = 0.5;
  // The stiffness of the hair (Growth::bend_m).
  double bend_m = 0.022;
  // The thickness of the hair on the head at its outermost layer.
  double lift_m = 0.022;
  // The lift is reached over this arc length.
  double lift_rise_m = 0.045;
  // From 0, every strand has the same length, to 1, all strands are cut at one height.
  double blunt = 0.8;
  // The largest share by which single strands are shortened.
  double thinning = 0.15;
  // The length at the nape and the sides, relative to the top.
  double side_length = 1;
  // Strands rooted in front of this azimuth (degrees from the front) fall in front of the shoulders.
  double front_deg = 98;
  // How much tips turn in to the neck.
  double tuck = 0;
  // The size of the random deviation of single strands, relative to gravity's weight of 1.
  double flyaway = 0.05;
  // The number of locks on the whole head.
  int locks = 260;
  // How much the strands of a lock gather towards their tips, 0 … 1.
  double clumping = 0.45;
  // The gathering is complete at this share of the length.
  double gathered_at = 0.9;
  // The spread of the phases of curls within a lock, radians.
  double curl_disorder = 0.9;
  // The number of points of a strand without curls.
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
