/*
 * hairnet.h: hair that a server simulates, or this program, for any language that can call C.
 *
 *     hairnet_options options = HAIRNET_OPTIONS;
 *     options.server = "ws://localhost:7420";
 *     char error[256];
 *     hairnet_room* room;
 *     if (hairnet_connect(&options, &room, error, sizeof error)) return puts(error);
 *     hairnet_groom* groom;
 *     if (hairnet_groom_load(bytes, size, &groom, error, sizeof error)) return puts(error);
 *     uint32_t me;
 *     if (hairnet_add_character(room, groom, NULL, &me, error, sizeof error)) return puts(error);
 *     while (hairnet_state(room) != HAIRNET_CLOSED) {
 *       double pose[HAIRNET_POSE_NUMBERS];            // your headset, or your animation
 *       hairnet_push_pose(room, me, pose, 0);
 *       hairnet_advance(room);                        // everyone moves to this moment
 *       const hairnet_scene* scene = hairnet_room_scene(room);
 *       hairnet_get_shown(scene, 0, everyone, hairnet_shown_count(scene)); // an array of yours; draw them, see "pictures"
 *     }
 *     hairnet_room_free(room);
 *
 * Spaces and units: metres, seconds, kilograms. Right-handed, +Y up. Head space has its origin between the ears of a head at
 * rest, +Z out of the face. World space is what poses map head space to. Colours are sRGB, 0xrrggbb.
 *
 * Poses: 35 doubles, for the bones head, neck, left shoulder, right shoulder, upper trunk: rotation x y z w (of unit length
 * within 0.001) and position x y z of a rigid transform from head space at rest to the world. At rest all bones are equal.
 * Coordinates are at most 10 000 m.
 *
 * Errors: a function that can fail returns a hairnet_error, HAIRNET_OK (0) when it did not. Where it takes `error`, one line for
 * people is written there, cut to `error_size` bytes with its final 0; `error` may be NULL. A call that fails changes nothing.
 * Nothing throws. A lack of memory in a function that returns no error ends the program, as does a failed assertion, which is a bug
 * of Hairnet. Pointers may be NULL only where it is said.
 *
 * Ownership: what a function returns by `hairnet_x**` is the caller's, to be freed by hairnet_x_free(), which takes NULL. Grooms,
 * levels and bases are immutable and counted: freeing one that a room still uses is right. Pointers inside structs are the
 * library's, and valid until the next call for the same room, world or picture that is not marked "reads".
 *
 * Threads: a room, a world or a picture may be used by one thread at a time, together with the scenes that it draws. Grooms, levels,
 * bases and geometry may be read by all threads at once. Different rooms and worlds are independent. There is no global state.
 *
 * Growth: structs with a `size` field begin with it; fill them by their macro (HAIRNET_OPTIONS), so that fields which later versions
 * add have their defaults. Other structs never change.
 */
#ifndef HAIRNET_H
#define HAIRNET_H

#include <stddef.h>
#include <stdint.h>

#ifdef __cplusplus
extern "C" {
#endif

#if defined(__GNUC__) && !defined(HAIRNET_API)
#define HAIRNET_API __attribute__((visibility("default")))
#elif !defined(HAIRNET_API)
#define HAIRNET_API
#endif

#define HAIRNET_POSE_NUMBERS 35
#define HAIRNET_HASH_BYTES 32

typedef int32_t hairnet_error;
enum {
  HAIRNET_OK = 0,
  HAIRNET_INVALID = 1,       /* an argument is out of its range: `error` names it */
  HAIRNET_MALFORMED = 2,     /* the bytes are no such file */
  HAIRNET_UNREACHABLE = 3,   /* no server answers there */
  HAIRNET_REFUSED = 4,       /* the server refuses: token, room, version or load */
  HAIRNET_NOT_THERE = 5,     /* no such character, member or part, or not yet */
  HAIRNET_TOO_SMALL = 6,     /* the caller's buffer */
  HAIRNET_OUT_OF_MEMORY = 7
};

typedef struct hairnet_groom hairnet_groom;       /* a hairstyle */
typedef struct hairnet_room hairnet_room;         /* a conversation with a server, and everyone in one of its rooms */
typedef struct hairnet_world hairnet_world;       /* characters that this program simulates */
typedef struct hairnet_levels hairnet_levels;     /* the mechanical models of a groom, for a world */
typedef struct hairnet_build hairnet_build;       /* levels in the making */
typedef struct hairnet_scene hairnet_scene;       /* what a room or a world shows now; theirs */
typedef struct hairnet_geometry hairnet_geometry; /* a groom as vertices and indices */
typedef struct hairnet_picture hairnet_picture;   /* what a GPU gets of all characters, from picture to picture */

/* What this library is: "0.1.0", and its numbers as 10000 major + 100 minor + patch. Any thread. */
HAIRNET_API const char* hairnet_version(void);
HAIRNET_API uint32_t hairnet_version_number(void);
/* "an argument is out of its range", for instance. Any thread. */
HAIRNET_API const char* hairnet_error_text(hairnet_error error);

/* ---- hair: hairstyles ---------------------------------------------------------------------------------------------------- */

/* Reads a .groom file, as hairnet-groom makes them: at most 64 MiB. */
HAIRNET_API hairnet_error hairnet_groom_load(const void* bytes, size_t size, hairnet_groom** groom, char* error,
                                             size_t error_size);
/*
 * Makes a groom from polylines in head space, root first. `name` NULL: "strands". The body of the default person is below them. `points`: x y z of each;
 * `counts`: points of each strand, 2 to 256; `radius_m`: of one hair, for drawing, 0 for 40 micrometres; `hairs`: that one strand
 * stands for, at most 10 000 000 in all, or 0 so that all are 100 000. At most 200 000 strands and 8 000 000 points, within 10 m.
 */
HAIRNET_API hairnet_error hairnet_groom_from_strands(const char* name, const float* points, const uint32_t* counts,
                                                     size_t strand_count, float radius_m, float hairs,
                                                     hairnet_groom** groom, char* error, size_t error_size);
/* Makes one of the built-in hairstyles: "long_curly", "ponytail" and others, which hairnet-groom lists. `strands`: 0 for its own number. */
HAIRNET_API hairnet_error hairnet_groom_make(const char* hairstyle, uint32_t strands, hairnet_groom** groom, char* error,
                                             size_t error_size);
/* A file of another program, in memory. */
typedef struct hairnet_file {
  const char* name; /* UTF-8, at most 255 bytes; its extension tells the format: "curls.abc" */
  const void* bytes;
  size_t byte_count;
} hairnet_file;
/* What is known of the files; all else is guessed. */
typedef struct hairnet_import_options {
  size_t size;
  const char* name;  /* the groom's; NULL: that of the first file, without its extension */
  const char* up;    /* the files' axis upwards: "+x", "-x", "+y" ... NULL: guessed */
  const char* face;  /* the one out of the face; NULL: guessed */
  const char* roots; /* which point of a strand is its root, "first" or "last"; NULL: guessed */
  double unit_m;     /* metres in a unit of the files; 0: guessed */
} hairnet_import_options;
#define HAIRNET_IMPORT_OPTIONS {sizeof(hairnet_import_options), NULL, NULL, NULL, NULL, 0}
/*
 * Makes the groom that `hairnet-groom import` makes of the files of one head: .hair .tfx .txt .data .abc .usd .usda .usdc .usdz .ply
 * .npy .npz .obj. One without strands among them is the body that they were made on (.obj .ply .usd...). At most 64 files
 * of 512 MiB in all; takes up to some seconds; any thread. `options` may be NULL. HAIRNET_MALFORMED: a file is not of its format, of
 * none of these, or none has strands; HAIRNET_INVALID: an option, or the strands do not show what `error` asks for. Lines name
 * the options as the program's flags: --up, --face, --roots, --unit.
 */
HAIRNET_API hairnet_error hairnet_groom_import(const hairnet_file* files, size_t file_count,
                                               const hairnet_import_options* options, hairnet_groom** groom, char* error,
                                               size_t error_size);
/*
 * What was guessed, skipped and counted when hairnet_groom_import() made it: lines in UTF-8, each ended by '\n'. The first says how
 * the hair was taken to lie. "" for other grooms. Until the groom is freed.
 */
HAIRNET_API const char* hairnet_groom_remarks(const hairnet_groom* groom);
/* Writes its file. *size: the buffer's, and then the file's; HAIRNET_TOO_SMALL tells the size that is needed. */
HAIRNET_API hairnet_error hairnet_groom_file(const hairnet_groom* groom, void* buffer, size_t* size);
HAIRNET_API const char* hairnet_groom_name(const hairnet_groom* groom);
HAIRNET_API void hairnet_groom_hash(const hairnet_groom* groom, uint8_t hash[HAIRNET_HASH_BYTES]);
/* Points of all strands, threads, cards and cloths, in this order; strands s has those from begin[s] to begin[s + 1]. */
HAIRNET_API size_t hairnet_groom_point_count(const hairnet_groom* groom);
HAIRNET_API size_t hairnet_groom_strand_count(const hairnet_groom* groom);
HAIRNET_API const uint32_t* hairnet_groom_strand_begin(const hairnet_groom* groom); /* strand count + 1 */
/* At rest: x y z of each point. Until the groom is freed. */
HAIRNET_API const float* hairnet_groom_points(const hairnet_groom* groom);
/* The skull and body that it was made on, head space at rest. */
typedef struct hairnet_body {
  const float* vertices;     /* x y z each */
  const float* bone_weights; /* 5 each, of sum 1, in the order of a pose's bones */
  const uint32_t* triangles; /* 3 vertices each */
  size_t vertex_count, triangle_count;
} hairnet_body;
/* Until the groom is freed. */
HAIRNET_API void hairnet_groom_body(const hairnet_groom* groom, hairnet_body* body);
HAIRNET_API void hairnet_groom_free(hairnet_groom* groom);

/* ---- conversation -------------------------------------------------------------------------------------------------------- */

typedef struct hairnet_options {
  size_t size;
  const char* server;       /* "HOST:PORT", "tcp://", "tls://", "ws://HOST:PORT/PATH" or "wss://"; NULL: 127.0.0.1:7420 */
  const char* room;         /* NULL: the lobby */
  const char* token;        /* NULL: none */
  const char* name;         /* this program's, for the server's log; NULL: "hairnet" */
  const char* ca_file;      /* PEM, to check the server's certificate; NULL: the system's */
  uint32_t is_observer;     /* 1: has no characters of its own */
  uint32_t address_only;    /* 1: does not try WebTransport */
  uint32_t no_reconnect;    /* 1: a lost connection closes the room */
  uint32_t own_only;        /* 1: shows its own characters, and nobody else */
  double connect_timeout_s; /* ends an attempt without a welcome; 3 more where WebTransport is tried first */
  double give_up_after_s;   /* ends reconnecting; 0: never */
  float error_m;            /* the wanted error of hair where a head fills the screen; 0: the least there is */
  uint32_t bytes_per_s;     /* the most that frames take; 0: any number */
  uint64_t trace;           /* any number, which the logs of all its servers name; 0: hairnet_connect() draws one */
} hairnet_options;
#define HAIRNET_OPTIONS {sizeof(hairnet_options), NULL, NULL, NULL, NULL, NULL, 0, 0, 0, 0, 5, 0, 0.001f, 0, 0}

/*
 * Joins a room over sockets of the library, which has a thread for them. Waits for the server's welcome. HAIRNET_UNREACHABLE: nobody
 * answers, or nobody who speaks Hairnet's protocol; HAIRNET_REFUSED: the server's own reason is in `error`.
 */
HAIRNET_API hairnet_error hairnet_connect(const hairnet_options* options, hairnet_room** room, char* error,
                                          size_t error_size);
/*
 * Joins a room over sockets of the caller: see "bytes in and out". `now_ns` is of a clock of the caller's that never goes back, 0 to
 * 2^61; all times of this room are. Does not wait, and does not look at the options server, ca_file and address_only. Draw
 * `trace` at random: waits before new connections depend on it, too.
 */
HAIRNET_API hairnet_error hairnet_open(const hairnet_options* options, int64_t now_ns, hairnet_room** room, char* error,
                                       size_t error_size);
/* Says goodbye. The room is empty and closed afterwards. */
HAIRNET_API void hairnet_close(hairnet_room* room);
HAIRNET_API void hairnet_room_free(hairnet_room* room);

typedef enum hairnet_room_state {
  HAIRNET_CONNECTING,
  HAIRNET_CONNECTED,
  HAIRNET_RECONNECTING, /* by itself; members stand still */
  HAIRNET_CLOSED        /* for good */
} hairnet_room_state;
HAIRNET_API hairnet_room_state hairnet_state(const hairnet_room* room);
/* This client's session, which others see of its characters; another one after a server has lost it. 0: none yet. Reads. */
HAIRNET_API uint64_t hairnet_session(const hairnet_room* room);
/* Whether the server let this client set the wind when it joined; a moderator may forbid it later. Reads. */
HAIRNET_API int32_t hairnet_may_set_wind(const hairnet_room* room);

typedef enum hairnet_event_kind {
  HAIRNET_EVENT_STATE,   /* `state` is another; `text` says why, `wait_s` when the next attempt is */
  HAIRNET_EVENT_JOINED,  /* `member` is here */
  HAIRNET_EVENT_LEFT,    /* `member` is no longer */
  HAIRNET_EVENT_CHANGED, /* its tag or its appearance */
  HAIRNET_EVENT_WIND,    /* the room's, which `session` has set: see hairnet_get_wind() */
  HAIRNET_EVENT_ERROR,   /* the server refused something, or a hairstyle cannot be shown: `text` says what */
  HAIRNET_EVENT_HELD,    /* `hand` holds `held` points of the hair of `member`: after hairnet_take_hold(), and 0 when it is lost */
  HAIRNET_EVENT_PROPS,   /* the room's: see hairnet_get_props() */
  HAIRNET_EVENT_TOUCH    /* another audience may touch the hair of `member`: see hairnet_may_touch() */
} hairnet_event_kind;
typedef struct hairnet_event {
  hairnet_event_kind kind;
  hairnet_room_state state; /* for HAIRNET_EVENT_STATE */
  uint32_t member;          /* its number in the room, then: an own one leaves and joins with another when its room moves */
  uint32_t character;  /* the caller's own; 0: none */
  uint32_t is_refused; /* closed, and the same request would be refused again */
  uint16_t hand, held; /* for HAIRNET_EVENT_HELD; at most 65 535 */
  uint64_t session;    /* 0: the server's own wind; 2^64 - 1: set by a client of the server that had the room before */
  double wait_s;
  const char* text; /* one line; "" without one. Until the next call of this function. */
} hairnet_event;
/* The next event that hairnet_advance() met, in order; 0: there is none, or no memory for it. Of more than 10 000 that wait the oldest
 * are lost. */
HAIRNET_API int32_t hairnet_next_event(hairnet_room* room, hairnet_event* event);

typedef struct hairnet_counters {
  size_t size;
  uint64_t bytes_sent, bytes_received, frames_received, frames_dropped, frames_undecodable, poses_dropped;
  uint64_t inputs_dropped; /* poses, hands, props, winds, materials and tags of this program that were refused */
  uint64_t reconnects, resumes, redirects, silent_servers;
  /* Hairstyles that are on their way, and those that have arrived since none was: what is here, and the files' sizes. */
  uint64_t downloaded_bytes, download_byte_count;
} hairnet_counters;
#define HAIRNET_COUNTERS {sizeof(hairnet_counters), 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0}
/* Since the room was made. Reads. */
HAIRNET_API void hairnet_get_counters(const hairnet_room* room, hairnet_counters* counters);

/* ---- bytes in and out: only for a room of hairnet_open() ------------------------------------------------------------------ */

/*
 * After whatever happens, and at hairnet_next_deadline() at the latest: hairnet_poll(); then, if hairnet_wants_connection(), open one
 * and tell hairnet_on_opening(), and hairnet_on_open() or hairnet_on_closed() once it is; then send what hairnet_take_packet()
 * gives while the connection takes it; then hairnet_wants_close().
 */
HAIRNET_API void hairnet_poll(hairnet_room* room, int64_t now_ns);
HAIRNET_API int64_t hairnet_next_deadline(const hairnet_room* room); /* INT64_MAX: never. Reads. */
/* 1: open a connection. *host and *port: where to, NULL and 0 for the server of the options. */
HAIRNET_API int32_t hairnet_wants_connection(const hairnet_room* room, const char** host, uint16_t* port);
HAIRNET_API void hairnet_on_opening(hairnet_room* room, int64_t now_ns);
/* `has_datagrams`: packets that may get lost can be sent as such. */
HAIRNET_API void hairnet_on_open(hairnet_room* room, int32_t has_datagrams, int64_t now_ns);
/* Bytes of a stream, cut anywhere. */
HAIRNET_API void hairnet_on_bytes(hairnet_room* room, const void* bytes, size_t size, int64_t now_ns);
/* Exactly one packet: a WebSocket's message, or a datagram. */
HAIRNET_API void hairnet_on_packet(hairnet_room* room, const void* bytes, size_t size, int64_t now_ns);
/* `error`: one line that says how it ended, or why it could not be opened; may be NULL. */
HAIRNET_API void hairnet_on_closed(hairnet_room* room, const char* error, int64_t now_ns);
/* The next packet to send, until the next call; NULL: none now. *may_be_lost: newer ones replace it. */
HAIRNET_API const void* hairnet_take_packet(hairnet_room* room, int64_t now_ns, size_t* size, int32_t* may_be_lost);
/* 1: send the end of the stream, and read on. Reads. */
HAIRNET_API int32_t hairnet_wants_half_close(const hairnet_room* room);
/* 1: close the connection at once, and tell hairnet_on_closed(). Reads. */
HAIRNET_API int32_t hairnet_wants_close(const hairnet_room* room);
/* Gives up a connection that works for a better one, over which the session goes on; 0: there is none, or it may not be. */
HAIRNET_API int32_t hairnet_replace_connection(hairnet_room* room, const char* error, int64_t now_ns);

/* ---- hair: characters ---------------------------------------------------------------------------------------------------- */

typedef enum hairnet_level {
  HAIRNET_HIGH,
  HAIRNET_MEDIUM,
  HAIRNET_LOW,
  HAIRNET_ETHER,
  HAIRNET_LEARNT,
  HAIRNET_RIGID
} hairnet_level;

typedef struct hairnet_appearance {
  uint32_t hair_root, hair_tip, skin;
  float roughness; /* the hair's, 0 to 1: highlights are wider */
} hairnet_appearance;

typedef struct hairnet_character_options {
  size_t size;
  hairnet_level level;                  /* the finest that it may have */
  const char* tag;                      /* any bytes, at most 256; by convention a name in UTF-8. NULL: none */
  const hairnet_appearance* appearance; /* NULL: everyone chooses the same by its number */
  size_t tag_size;                      /* 0: the tag ends before its first byte of 0 */
} hairnet_character_options;
#define HAIRNET_CHARACTER_OPTIONS {sizeof(hairnet_character_options), HAIRNET_HIGH, NULL, NULL, 0}

/* Adds an own character; it is visible after its first pose. *own: its number, from 1. `options` may be NULL. */
HAIRNET_API hairnet_error hairnet_add_character(hairnet_room* room, const hairnet_groom* groom,
                                                const hairnet_character_options* options, uint32_t* own, char* error,
                                                size_t error_size);
HAIRNET_API hairnet_error hairnet_remove_character(hairnet_room* room, uint32_t own);
/*
 * Its bones now; best 60 to 90 times a second. `teleport`: 1 when the pose does not continue the one before, so that hair does not
 * swing after the jump. HAIRNET_INVALID: the pose is dropped and counted, and the character stays where it was.
 */
HAIRNET_API hairnet_error hairnet_push_pose(hairnet_room* room, uint32_t own, const double pose[HAIRNET_POSE_NUMBERS],
                                            int32_t teleport);
/*
 * The same for many at once, which saves packets. `poses`: one after the other; `teleports` may be NULL. HAIRNET_INVALID: at least one
 * pose is not valid; HAIRNET_NOT_THERE: one is of no own character. Those are dropped, and the others sent.
 */
HAIRNET_API hairnet_error hairnet_push_poses(hairnet_room* room, const uint32_t* own, const double* poses,
                                             const uint8_t* teleports, size_t count);
HAIRNET_API hairnet_error hairnet_set_level(hairnet_room* room, uint32_t own, hairnet_level level);
/* Replaces tag and appearance; its hair continues. NULL: none. Others learn of it at most four times a second. */
HAIRNET_API hairnet_error hairnet_set_appearance(hairnet_room* room, uint32_t own, const char* tag, size_t tag_size,
                                                 const hairnet_appearance* appearance, char* error, size_t error_size);

/* Factors on what the groom was made with, 0.01 to 100 each, and gel, 0 to 10 000 per square second. */
typedef struct hairnet_material {
  float stiffness, damping, density, ether_damping, air_drag, gel_per_s2;
} hairnet_material;
#define HAIRNET_MATERIAL {1, 1, 1, 1, 1, 0}
HAIRNET_API hairnet_error hairnet_set_material(hairnet_room* room, uint32_t own, const hairnet_material* material,
                                               char* error, size_t error_size);

typedef struct hairnet_wind {
  double mean_m_per_s[3];        /* world */
  double gust_ratio;             /* gusts vary the speed between (1 - ratio) and (1 + ratio) times its mean; 0 to 1 */
  double gust_period_s;          /* the slowest gust's */
  double turbulence_rms_m_per_s; /* each component's */
  double turbulence_scale_m;     /* the smallest length over which turbulence changes; at least 0.3 */
  uint64_t seed;
  uint32_t carried; /* 1: the air goes along with each head, as in a vehicle; 0: it stands in the room */
} hairnet_wind;
#define HAIRNET_STILL_AIR {{0, 0, 0}, 0, 4, 0, 0.6, 1, 0}
/* Sets it for the whole room, until another client sets one or this one leaves. A server may refuse it: HAIRNET_EVENT_ERROR. */
HAIRNET_API hairnet_error hairnet_set_wind(hairnet_room* room, const hairnet_wind* wind, char* error, size_t error_size);
HAIRNET_API void hairnet_get_wind(const hairnet_room* room, hairnet_wind* wind); /* Reads. */

/* How large a member's head is on this screen, for the server's choice of detail and the order of downloads. */
typedef struct hairnet_importance {
  uint32_t member;
  float screen_height; /* the head's, as a share of the screen's */
  uint32_t in_view;
} hairnet_importance;
HAIRNET_API void hairnet_report_importance(hairnet_room* room, const hairnet_importance* members, size_t count);
/* Asks for this member's groom before all others; 0: for no one's. `only`: 1 for no other before that. */
HAIRNET_API void hairnet_fetch_first(hairnet_room* room, uint32_t member, int32_t only);

typedef enum hairnet_moderation {
  HAIRNET_REMOVE,
  HAIRNET_MUTE,
  HAIRNET_UNMUTE,
  HAIRNET_LOCK,
  HAIRNET_UNLOCK
} hairnet_moderation;
/*
 * Removes or mutes a person, or locks the room, if this client's token says `moderate`; otherwise HAIRNET_EVENT_ERROR follows. The
 * person is the owner of `member`, or if that is 0 the subject as the server's log names it ("sub:alice"). `seconds`: of the ban
 * after a removal.
 */
HAIRNET_API hairnet_error hairnet_moderate(hairnet_room* room, hairnet_moderation action, uint32_t member,
                                           const char* subject, uint32_t seconds, const char* reason, char* error,
                                           size_t error_size);

/* Takes what has arrived, and moves everyone to this moment: the clock's, or that of the last call with a time. */
HAIRNET_API void hairnet_advance(hairnet_room* room);
/* What the room shows. It is the room's, and moves with hairnet_advance(). */
HAIRNET_API const hairnet_scene* hairnet_room_scene(const hairnet_room* room);

/* ---- hair: hands and props ------------------------------------------------------------------------------------------------ */

/* What a hand or a prop is made of. Lengths in m, in the shape's own axes. */
typedef enum hairnet_shape {
  HAIRNET_SPHERE,  /* `radius_m` */
  HAIRNET_CAPSULE, /* `radius_m` about a line of `half_size_m[1]` to both sides along y */
  HAIRNET_BOX,     /* `half_size_m` */
  HAIRNET_PLANE    /* all below it; its normal is +y */
} hairnet_shape;
typedef struct hairnet_touch_body {
  uint32_t toucher, number; /* name it: 0 and any for a prop, whose hand and which shape of it else; at most 255 */
  uint32_t shape;           /* a hairnet_shape */
  uint32_t is_inside_out;   /* 1: hair is kept within it */
  uint32_t has_jumped;      /* 1: it has not moved here, so it sweeps no hair along */
  float half_size_m[3], radius_m;
  double rotation[4], position[3]; /* x y z w and x y z: from its own axes to the world */
} hairnet_touch_body;
/* A sphere, or a capsule from one point to another, in its hand's own axes, m. */
typedef struct hairnet_hand_shape {
  float from[3], to[3]; /* equal: a sphere */
  float radius_m;
  uint32_t is_inside_out; /* 1: hair is kept within it */
} hairnet_hand_shape;
/* Shapes that move together: a hand, a controller, a brush. */
typedef struct hairnet_hand {
  uint64_t session;                /* whose it is; hairnet_push_hands() does not read it */
  double rotation[4], position[3]; /* x y z w and x y z: from its own axes to the world */
  const hairnet_hand_shape* shapes;
  size_t shape_count;
  uint32_t first_number; /* its first shape's, among the 32 of one person; from hand to hand they ascend */
  uint32_t has_jumped;   /* 1: it has not moved here, so it sweeps no hair along */
} hairnet_hand;
/*
 * This person's hands now: all of them, best before or after the poses of the moment. 0: they are gone, as they are half a second after
 * the last call. HAIRNET_INVALID: they are dropped and counted; a capsule is within 10 m in own axes.
 */
HAIRNET_API hairnet_error hairnet_push_hands(hairnet_room* room, const hairnet_hand* hands, size_t count, char* error,
                                             size_t error_size);
/*
 * The hands of others near members, at the time at which hair is shown. Writes at most `capacity`, and returns how many there are.
 * Shapes: until its next call.
 */
HAIRNET_API size_t hairnet_get_hands(const hairnet_room* room, hairnet_hand* hands, size_t capacity);

typedef enum hairnet_audience { HAIRNET_NOBODY, HAIRNET_ONESELF, HAIRNET_CHOSEN, HAIRNET_EVERYONE } hairnet_audience;
/*
 * Who may touch the hair of an own character; at first oneself. `chosen`: at most 64 sessions beside oneself, for HAIRNET_CHOSEN. After a
 * reconnect as another session nobody is chosen any more, as the numbers may be others' now: HAIRNET_EVENT_TOUCH tells it.
 */
HAIRNET_API hairnet_error hairnet_set_touch(hairnet_room* room, uint32_t own, hairnet_audience audience,
                                            const uint64_t* chosen, size_t count, char* error, size_t error_size);
/* Whether this client's hands may touch a member's hair, as far as it knows. Reads. */
HAIRNET_API int32_t hairnet_may_touch(const hairnet_room* room, uint32_t member);
/*
 * The shape `hand` of this person takes hold of the member's hair within `radius_m` (at most 0.3) of `place`, in the shape's own axes:
 * the hand's with y turned the shortest way into the capsule's axis, from its middle. HAIRNET_EVENT_HELD answers. It holds until
 * hairnet_let_go(), the hair is pulled out, the shape is gone, or the connection is lost. HAIRNET_NOT_THERE: no such member.
 * HAIRNET_INVALID also while the room is not connected, as by hairnet_let_go() and hairnet_set_props().
 */
HAIRNET_API hairnet_error hairnet_take_hold(hairnet_room* room, uint32_t member, uint32_t hand, const double place[3],
                                            double radius_m, char* error, size_t error_size);
typedef enum hairnet_release {
  HAIRNET_DROP,
  HAIRNET_PIN,  /* it stays where it is on the head */
  HAIRNET_UNPIN /* ends all pins of this toucher, or as the owner of the hair all of everyone */
} hairnet_release;
HAIRNET_API hairnet_error hairnet_let_go(hairnet_room* room, uint32_t member, uint32_t hand, hairnet_release release);

/*
 * Adds and moves props of the room, with numbers below 128, and takes away those of `removed`. They touch everyone, and stay when this
 * client leaves. A server may refuse it: HAIRNET_EVENT_ERROR. `toucher` is not read; a box that a program in C++ has set may have a
 * `radius_m` about it, too.
 */
HAIRNET_API hairnet_error hairnet_set_props(hairnet_room* room, const hairnet_touch_body* props, size_t count,
                                            const uint8_t* removed, size_t removed_count, char* error, size_t error_size);
/* Writes at most `capacity`, by number, and returns how many there are. A plane comes back as the box that it is. Reads. */
HAIRNET_API size_t hairnet_get_props(const hairnet_room* room, hairnet_touch_body* props, size_t capacity);
/* Whether the server let this client set props when it joined. Reads. */
HAIRNET_API int32_t hairnet_may_set_props(const hairnet_room* room);

/* ---- pictures ------------------------------------------------------------------------------------------------------------ */

/* The lattice that moves a character's hair: nodes at origin + (i, j, k) spacing, i fastest, then j. Head space, m. */
typedef struct hairnet_lattice {
  float origin[3], spacing[3];
  uint32_t counts[3];
  uint32_t basis;      /* number of the basis that sums up to the nodes, which characters of one groom share; 0: none */
  uint32_t mode_count; /* how many modes the basis has */
} hairnet_lattice;

/* A character as it is shown now. */
typedef struct hairnet_shown {
  uint32_t member;           /* its number in the room or the world */
  uint32_t own;              /* the caller's own number for it; 0: another's */
  uint64_t session;          /* its owner's; 0 in a world */
  uint32_t owners_character; /* the owner's own number: with `session` the same for all clients */
  hairnet_level level;       /* the one that is stepped */
  uint32_t has_pose;         /* 0: nothing is known of where it is: do not draw it */
  uint32_t has_hair;         /* 0: its groom is not here, or `error` says why it cannot be shown */
  uint32_t moves;            /* 0: its hair is at rest */
  hairnet_appearance appearance;
  double pose[HAIRNET_POSE_NUMBERS];
  const uint8_t* hash; /* its groom file's, HAIRNET_HASH_BYTES */
  const char* tag;     /* tag_size bytes, then 0 */
  size_t tag_size;
  const char* error;         /* one line; "" without one */
  double delay_s;            /* the time from sampling its poses to showing them here */
  const float* coefficients; /* amounts of its groom's modes, m, the largest first; none at rest and in a world */
  size_t coefficient_count;
  hairnet_lattice lattice; /* if its hair `moves` */
} hairnet_shown;
/* Reads, as do all functions of a scene. Numbers are those of the last hairnet_advance(). */
HAIRNET_API size_t hairnet_shown_count(const hairnet_scene* scene);
/* Writes `count` characters, from `first` on. HAIRNET_NOT_THERE: there are not that many. */
HAIRNET_API hairnet_error hairnet_get_shown(const hairnet_scene* scene, size_t first, hairnet_shown* shown,
                                            size_t count);
/* Its groom, to be freed by the caller. */
HAIRNET_API hairnet_error hairnet_shown_groom(const hairnet_scene* scene, size_t index, hairnet_groom** groom);

/*
 * The points of its hair now, in world space: x y z for each point of its groom, in the groom's order. `tangents`: the same for the
 * hair's directions (not of unit length); may be NULL. Strands do not grow longer than at rest and stay out of the skin. Costs 1 to
 * 3 ms for 100 000 points, and some 50 the first time for a groom and its lattice.
 */
HAIRNET_API hairnet_error hairnet_shown_points(const hairnet_scene* scene, size_t index, float* points,
                                               float* tangents, size_t point_count);
/* The displacements of its lattice's nodes from rest, head space, m: x y z. */
HAIRNET_API hairnet_error hairnet_shown_nodes(const hairnet_scene* scene, size_t index, float* nodes,
                                              size_t node_count);
/*
 * The modes of its lattice's basis for a GPU, which sums them up by the coefficients: for each mode, and for more of 0 until there
 * are a multiple of four, the displacements of all nodes for a coefficient of 1 m, x y z 0, in whole rows of 1024. *count: of
 * the buffer's floats, and then of those that there are; `texels` NULL only asks.
 */
HAIRNET_API hairnet_error hairnet_shown_modes(const hairnet_scene* scene, size_t index, float* texels, size_t* count);
/* The skin that its hair is kept out of, as grids of distances and ways out of it (core/ffd/skin_push.hpp). */
typedef struct hairnet_skin_grid {
  uint32_t bone;     /* the one it follows, in the order of a pose */
  float origin[3];   /* place of its first node, head space at rest, m */
  float cell_m;      /* between two nodes */
  uint32_t counts[3]; /* nodes on each axis; x fastest, then y */
  uint32_t first;    /* number of its first node among all nodes */
} hairnet_skin_grid;
typedef struct hairnet_skin {
  const hairnet_skin_grid* grids;
  const uint8_t* nodes; /* 4 bytes each: distance; way out, 128 + 89 way */
  size_t grid_count, node_count;
  float thickness_m;    /* the hair's */
} hairnet_skin;
/* HAIRNET_NOT_THERE: none is known, or not yet. */
HAIRNET_API hairnet_error hairnet_shown_skin(const hairnet_scene* scene, size_t index, hairnet_skin* skin);

/*
 * A groom at rest as vertices and indices, for all characters that have it. Takes 0.1 to 3 s for large ones; any thread. `is_coarse`:
 * 1 for the body and about 500 strands alone, to show meanwhile; HAIRNET_NOT_THERE when the whole takes no longer than a moment.
 */
HAIRNET_API hairnet_error hairnet_geometry_make(const hairnet_groom* groom, int32_t is_coarse,
                                                hairnet_geometry** geometry);
HAIRNET_API void hairnet_geometry_free(hairnet_geometry* geometry);
typedef enum hairnet_part {
  HAIRNET_STRAND_POINTS,   /* float[4]: x y z at rest, share of the lattice's motion */
  HAIRNET_STRAND_ARCS,     /* float[2]: length from the root, m; number in its strand, 0 where FFD alone places it */
  HAIRNET_STRAND_ENDS,     /* uint32: the first n strands have the points below ends[n]; strand count + 1 */
  HAIRNET_STRAND_VERTICES, /* 12 bytes: six transmittances, share of the length, 0; float: number of the strand */
  HAIRNET_STRAND_INDICES,  /* uint32, two triangles a segment, of list `list`: from all points to few */
  HAIRNET_STRAND_INDEX_ENDS, /* uint32: the first n strands have the indices below ends[n], of list `list` */
  HAIRNET_CARD_VERTICES,     /* 48 bytes: float[4] as points; half[4] direction; 8 bytes light; float[4] side, number */
  HAIRNET_CARD_INDICES,      /* uint32 */
  HAIRNET_FABRIC_VERTICES,   /* 52 bytes: float[4]; half[4]; 8 bytes light; float[4] colour, opacity; float cord */
  HAIRNET_FABRIC_INDICES,    /* uint32 */
  HAIRNET_BODY_VERTICES,     /* 32 bytes: float[3]; half[4] normal, scalp; 8 bytes light; 4 shares of bones */
  HAIRNET_BODY_INDICES       /* uint32 */
} hairnet_part;
/* A part's bytes, until the geometry is freed. HAIRNET_NOT_THERE: there is no such list. */
HAIRNET_API hairnet_error hairnet_geometry_part(const hairnet_geometry* geometry, hairnet_part part, uint32_t list,
                                                const void** bytes, size_t* size);
typedef struct hairnet_geometry_numbers {
  uint32_t strand_count;  /* drawn strands, with the copies of clumps */
  float strand_width_m;   /* at the root, when all strands are drawn with two follow hairs each */
  float radius_m;         /* a ball of it about the head joint contains body and hair at rest; swinging: 1.3 of it and 0.1 m */
} hairnet_geometry_numbers;
HAIRNET_API void hairnet_get_geometry_numbers(const hairnet_geometry* geometry, hairnet_geometry_numbers* numbers);
/* The number of lists of indices, and how far from its points each draws a strand, m (NULL: not asked). */
HAIRNET_API size_t hairnet_geometry_lists(const hairnet_geometry* geometry, float* tolerances_m, size_t capacity);

/* How finely a character's hair is drawn, whatever its level. */
typedef struct hairnet_detail {
  float strand_share;      /* the share of the groom's strands that is drawn, 0 to 1; the drawn ones are wider in turn */
  float follow_hair_count; /* made beside every strand, 0 to 15; a fraction is the opacity of the last one */
  float tolerance_m;       /* largest distance between a strand's drawn line and its points: chooses the list of indices */
  float quadratic;         /* 1: quadratic FFD; 0: linear; between: a blend */
} hairnet_detail;

/* One character of a picture. Picture space: metres, any origin and axes; near the camera, floats are precise. */
typedef struct hairnet_drawn {
  double pose[HAIRNET_POSE_NUMBERS]; /* picture space, where coordinates may be larger than in a room */
  uint64_t id;                /* the same in every picture, to follow its motion; 0: its motion is not wanted */
  const hairnet_scene* scene; /* its hair follows the lattice of this scene's character `index`; NULL: `nodes` */
  const float* nodes;         /* displacements of `lattice`'s, head space, m: x y z; NULL: at rest, if `scene` is, too */
  uint32_t index;
  uint32_t record;            /* the number of its record, from 0; HAIRNET_NOT_DRAWN: its nodes stay, for other pictures */
  hairnet_lattice lattice;    /* the one of `nodes`, 2 to 64 on an axis; `basis` is not read */
  float scale;                /* its groom's; negative: mirrored in x y z of each bone, before the pose */
  float hair[3], hair_tip[3], skin[3]; /* linear RGB */
  float roughness;            /* the hair's, 0 to 1 */
  uint32_t hides_body;        /* 1: the groom's own body is not drawn */
  uint32_t strand_count;      /* this and the next: numbers of its geometry */
  float strand_width_m;
  hairnet_detail detail;
  uint32_t first_row, row_count; /* its rows in the textures of points that shaders place its strands in */
  float box[6], root_box[6];  /* least and largest x y z of its strands' points and of their roots, head space, at rest */
  uint32_t has_light;         /* 1: light follows its moving hair, if it is among the first 16 and large */
  float head_px;              /* the height of its head (0.24 m, and as it is scaled) on the screen, pixels */
  float ball_radius_m;        /* a ball of it about its head contains its hair, head space, for its motion */
} hairnet_drawn;
#define HAIRNET_NOT_DRAWN UINT32_MAX

/* Writes the `detail` of each, by its head_px and strand_count. `quality` multiplies head_px; continuous in both. */
HAIRNET_API void hairnet_choose_details(hairnet_drawn* drawn, size_t count, float quality);

/* Who sums up the modes of lattices. */
typedef enum hairnet_node_sum { HAIRNET_SUM_BY_GPU, HAIRNET_SUM_BY_PROCESSOR } hairnet_node_sum;
/* `renderer`: as OpenGL names it. Software that plays a GPU is slower at this sum than the processor by itself. */
HAIRNET_API hairnet_node_sum hairnet_node_sum_for(const char* renderer);

/* What nodes of lattices are made of, for the records from `first` to before `end`; none if those are equal. */
typedef struct hairnet_source {
  uint32_t basis;             /* a number that the picture has for it, the same as long as the basis exists; 0: `nodes` */
  const hairnet_scene* scene; /* hairnet_shown_modes() of these two are its texels */
  size_t index;
  size_t first, end;
} hairnet_source;

/* What shaders (client/shaders) read, rows of texels of four floats. */
typedef struct hairnet_picture_data {
  const float* records; /* in rows of HAIRNET_RECORD_TEXELS */
  size_t record_count;
  const float* nodes; /* new ones that come from the processor, in rows of HAIRNET_NODE_TEXELS */
  size_t nodes_rows;
  size_t node_rows; /* height of the texture of all lattices, which sources are summed up into; of another height it is empty */
  const hairnet_source* sources; /* the one of `nodes`, then one for each basis, by which records number them */
  size_t source_count;
  size_t light_grids; /* how many characters have light that follows their hair */
} hairnet_picture_data;
#define HAIRNET_RECORD_TEXELS 85
#define HAIRNET_NODE_TEXELS 1024

HAIRNET_API hairnet_error hairnet_picture_make(hairnet_picture** picture);
HAIRNET_API void hairnet_picture_free(hairnet_picture* picture);
/*
 * Writes what the GPU gets of all characters. Each has rows of nodes by its place in `drawn`, and what they have from the picture
 * before is not sent again: keep the order. `rows_max`: of a texture. A lattice that is not finite, is none, or has no
 * room, moves nothing. HAIRNET_INVALID: another number is not finite, records have not each number below their count once, or there
 * are more than rows_max; HAIRNET_NOT_THERE: a scene has no such character.
 */
HAIRNET_API hairnet_error hairnet_picture_write(hairnet_picture* picture, const hairnet_drawn* drawn, size_t count,
                                                hairnet_node_sum sum, size_t rows_max, hairnet_picture_data* data);
/* The GPU has lost all nodes. */
HAIRNET_API void hairnet_picture_forget(hairnet_picture* picture);

/* How one character moved since the last call of hairnet_picture_motions(): columns of transforms from head space to picture space. */
typedef struct hairnet_motion {
  double now[16], before[16];
  float ball_radius_m;
} hairnet_motion;
/* The up to 8 largest characters with an `id` that were there before, too. */
typedef struct hairnet_motions {
  const hairnet_motion* motions;
  size_t count;
  const uint16_t* swing; /* where hair was, minus where it is, head space, m: 8 x 8 x 8 halfs x y z 0 in the box about each ball */
} hairnet_motions;
/* After hairnet_picture_write() of these, and before their scenes move on; for averages over pictures (accumulate.frag). */
HAIRNET_API hairnet_error hairnet_picture_motions(hairnet_picture* picture, const hairnet_drawn* drawn, size_t count,
                                                  hairnet_motions* motions);

/* Distant key, fill and rim lights, and ambient light. Linear RGB. */
typedef struct hairnet_lights {
  float towards[3][3]; /* unit vectors */
  float colours[3][3];
  float ambient_above[3], ambient_below[3];
} hairnet_lights;
/* A studio that turns with the camera's bearing. `towards_camera`: from what it shows, +Y up, of any length. Any thread. */
HAIRNET_API void hairnet_studio_lights(const double towards_camera[3], hairnet_lights* lights);

/* ---- local: hair that this program simulates ------------------------------------------------------------------------------ */

/*
 * Levels are what a world steps. Building those of a groom takes some seconds of all that a thread has; it goes on by itself on a
 * thread of the library, or where there are no threads, within hairnet_build_finish().
 */
HAIRNET_API hairnet_error hairnet_build_begin(const hairnet_groom* groom, hairnet_build** build);
HAIRNET_API double hairnet_build_progress(const hairnet_build* build); /* 0 to 1. Any thread. */
/* Waits until the levels are built. */
HAIRNET_API hairnet_error hairnet_build_finish(hairnet_build* build, hairnet_levels** levels);
/* Cancels what is not finished. */
HAIRNET_API void hairnet_build_free(hairnet_build* build);
/* Levels as a file, and back: *size as for hairnet_groom_file(). A file serves its groom and this version of the library alone. */
HAIRNET_API hairnet_error hairnet_levels_file(const hairnet_levels* levels, void* buffer, size_t* size);
HAIRNET_API hairnet_error hairnet_levels_load(const hairnet_groom* groom, const void* bytes, size_t size,
                                              hairnet_levels** levels, char* error, size_t error_size);
HAIRNET_API void hairnet_levels_free(hairnet_levels* levels);

/* A world of `tick_rate_hz` (10 to 240; 60 is right for one head on a screen). Its time begins at 0. */
HAIRNET_API hairnet_error hairnet_world_make(double tick_rate_hz, hairnet_world** world);
HAIRNET_API void hairnet_world_free(hairnet_world* world);
/*
 * Adds a character, of at most 65 536. `levels` NULL: its hair is rigid until hairnet_world_set_levels(). `options` may be NULL, and
 * `pose`, too: then it is not to be drawn before the first pushed one.
 */
HAIRNET_API hairnet_error hairnet_world_add(hairnet_world* world, const hairnet_groom* groom,
                                            const hairnet_levels* levels, const hairnet_character_options* options,
                                            const double* pose, uint32_t* own, char* error, size_t error_size);
HAIRNET_API hairnet_error hairnet_world_set_levels(hairnet_world* world, uint32_t own, const hairnet_levels* levels);
HAIRNET_API hairnet_error hairnet_world_remove(hairnet_world* world, uint32_t own);
/* The next five are as those of a room. */
HAIRNET_API hairnet_error hairnet_world_push_pose(hairnet_world* world, uint32_t own,
                                                  const double pose[HAIRNET_POSE_NUMBERS], int32_t teleport);
HAIRNET_API hairnet_error hairnet_world_set_level(hairnet_world* world, uint32_t own, hairnet_level level);
HAIRNET_API hairnet_error hairnet_world_set_material(hairnet_world* world, uint32_t own,
                                                     const hairnet_material* material, char* error, size_t error_size);
HAIRNET_API hairnet_error hairnet_world_set_appearance(hairnet_world* world, uint32_t own, const char* tag,
                                                       size_t tag_size, const hairnet_appearance* appearance, char* error,
                                                       size_t error_size);
HAIRNET_API hairnet_error hairnet_world_set_wind(hairnet_world* world, const hairnet_wind* wind, char* error,
                                                 size_t error_size);
/*
 * What touches hair from now on: all hands and props of the world. Those that were there go evenly to their new places during the
 * next advance, as poses do; faster than 8 m/s they jump. Skin lets no hand in, so hair between the two is not squeezed.
 * HAIRNET_INVALID: two have one name, there are more than 1024, or one has no size, a size above 100 m, no rotation of unit
 * length within 0.001 or no place within 20 km.
 */
HAIRNET_API hairnet_error hairnet_world_set_bodies(hairnet_world* world, const hairnet_touch_body* bodies, size_t count,
                                                   char* error, size_t error_size);
/*
 * A hand takes hold of what hair is within `radius_m` (at most 0.3) of `place`, in the axes of its shape, and holds it until
 * hairnet_world_let_go(), or until it is pulled 25 cm out of the hand, or the shape is gone. *held: on how many points of the
 * lattice, 0 where there is no hair, or none that is simulated, or before the shape's first advance; may be NULL. HAIRNET_NOT_THERE:
 * no such character, or no such shape.
 */
HAIRNET_API hairnet_error hairnet_world_grab(hairnet_world* world, uint32_t own, uint32_t toucher, uint32_t number,
                                             const double place[3], double radius_m, uint32_t* held);
HAIRNET_API hairnet_error hairnet_world_let_go(hairnet_world* world, uint32_t own, uint32_t toucher, uint32_t number,
                                               hairnet_release release);
/*
 * Moves the world on by `seconds`, at most 0.1: a machine that is too slow shows slow motion. Heads go evenly to the poses that were
 * pushed since the last call, and hair is shown one tick behind them. A step of a head at level high takes about 0.3 ms.
 * HAIRNET_INVALID: a time that is negative or not finite.
 */
HAIRNET_API hairnet_error hairnet_world_advance(hairnet_world* world, double seconds);
/* What it shows. It is the world's, and moves with hairnet_world_advance(). */
HAIRNET_API const hairnet_scene* hairnet_world_scene(const hairnet_world* world);

#ifdef __cplusplus
}
#endif
#endif
