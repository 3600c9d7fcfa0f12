/*
 * A head that turns in the lobby of a server, by the C header alone. Prints what happens, and where the first point of its hair is.
 *   room [ADDRESS]
 */
#define _POSIX_C_SOURCE 200809L
#include <hairnet.h>
#include <math.h>
#include <stdio.h>
#include <stdlib.h>
#include <time.h>

int main(int argc, char** argv) {
  hairnet_options options = HAIRNET_OPTIONS;
  char error[256];
  hairnet_room* room = NULL;
  hairnet_groom* groom = NULL;
  uint32_t me = 0;
  if (argc > 1) options.server = argv[1];
  if (hairnet_connect(&options, &room, error, sizeof error) != HAIRNET_OK) return fprintf(stderr, "%s\n", error), 1;
  if (hairnet_groom_make("bob", 600, &groom, error, sizeof error) != HAIRNET_OK) return fprintf(stderr, "%s\n", error), 1;
  if (hairnet_add_character(room, groom, NULL, &me, error, sizeof error) != HAIRNET_OK) return fprintf(stderr, "%s\n", error), 1;

  const size_t count = hairnet_groom_point_count(groom);
  float* points = malloc(3 * count * sizeof *points);
  if (points == NULL) return fprintf(stderr, "out of memory\n"), 1;
  for (int picture = 0; picture < 200 && hairnet_state(room) != HAIRNET_CLOSED; ++picture) {
    const struct timespec pause = {0, 16000000};
    const double half = 0.3 * sin(picture / 20.0);
    double pose[HAIRNET_POSE_NUMBERS] = {0};
    hairnet_event event;
    for (int bone = 0; bone < 5; ++bone) pose[7 * bone + 1] = sin(half), pose[7 * bone + 3] = cos(half);
    hairnet_push_pose(room, me, pose, 0);
    hairnet_advance(room);
    while (hairnet_next_event(room, &event)) printf("event %d of member %u: %s\n", (int)event.kind, event.member, event.text);
    const hairnet_scene* scene = hairnet_room_scene(room);
    for (size_t i = 0; i < hairnet_shown_count(scene); ++i) {
      hairnet_shown shown;
      hairnet_get_shown(scene, i, &shown, 1);
      if (shown.own == me && hairnet_shown_points(scene, i, points, NULL, count) == HAIRNET_OK)
        printf("%.3f %.3f %.3f%s\n", points[0], points[1], points[2], shown.moves ? "" : " (at rest)");
    }
    nanosleep(&pause, NULL);
  }
  free(points);
  hairnet_groom_free(groom);
  hairnet_room_free(room);
  return 0;
}
