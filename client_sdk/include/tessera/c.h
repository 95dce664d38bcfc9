/* The client SDK for C, so that engines and other languages can bind it.
 *
 *   tessera_client *client;
 *   if (tessera_connect("127.0.0.1:7300", 10, &client) != TESSERA_OK) puts(tessera_error_message());
 *
 * Units: m, kg, s, rad, N. Positions are a sector, three 64-bit integers, and a displacement from its centre,
 * exact at any distance. Vectors are along the world's axes, rotations are quaternions x y z w.
 *
 * Every call that can fail returns a code; results are written only if that is TESSERA_OK. Pointers must not
 * be null unless stated otherwise. Arguments are copied; objects made by the library are released by the call
 * named in their comment. A client may be used by any thread, a stream or a pending batch by one at a time.
 * Calls block until the cluster has answered, for at most 10 s (a load: 120 s), unless they take a timeout or
 * state otherwise.
 */
#ifndef TESSERA_C_H
#define TESSERA_C_H

#include <stdbool.h>
#include <stddef.h>
#include <stdint.h>

#ifdef __cplusplus
extern "C" {
#endif

#define TESSERA_API __attribute__((visibility("default")))

/* The codes of gRPC. */
typedef enum tessera_code {
  TESSERA_OK = 0,
  TESSERA_CANCELLED = 1,
  TESSERA_UNKNOWN = 2,
  TESSERA_INVALID_ARGUMENT = 3,  /* the message names the field and the bound */
  TESSERA_DEADLINE_EXCEEDED = 4, /* no answer in time */
  TESSERA_NOT_FOUND = 5,         /* no such body or file */
  TESSERA_ALREADY_EXISTS = 6,    /* a name is in use, or a world is loaded */
  TESSERA_PERMISSION_DENIED = 7,
  TESSERA_RESOURCE_EXHAUSTED = 8,  /* a limit is exceeded, or a stream is read too slowly */
  TESSERA_FAILED_PRECONDITION = 9, /* no world is loaded, or servers are missing */
  TESSERA_ABORTED = 10,            /* the world was unloaded or replaced */
  TESSERA_OUT_OF_RANGE = 11,       /* a position outside the 64-bit range of sectors */
  TESSERA_UNIMPLEMENTED = 12,
  TESSERA_INTERNAL = 13,
  TESSERA_UNAVAILABLE = 14, /* a process of the cluster is gone or does not answer */
  TESSERA_DATA_LOSS = 15,
  TESSERA_UNAUTHENTICATED = 16
} tessera_code;

/* The error message of the last call on this thread, in UTF-8; empty if it succeeded. Owned by the library,
 * valid until the next call on the same thread. */
TESSERA_API const char* tessera_error_message(void);

/* A point: `local` metres from the centre of `sector`, in the world's frame (`frame` 0), or in the n-th of
 * its frames that move, in which all that is said of the point is along the axes of that frame. */
typedef struct tessera_position {
  int64_t sector[3];
  double local[3];
  uint32_t frame;
} tessera_position;

/* The displacement of `point` from the centre of `sector`, of the same frame, in m: sector indices are
 * subtracted as integers before anything is rounded, so nearby points keep full precision. */
TESSERA_API void tessera_relative_to(const tessera_position* point, const int64_t sector[3],
                                     double sector_size, double metres[3]);

typedef struct tessera_client tessera_client;
typedef struct tessera_stream tessera_stream;

/* Connects to the coordinator at host:port; of several, give all, separated by commas. UNAVAILABLE if there
 * is no answer within `timeout` s. Release the client with tessera_disconnect(). */
TESSERA_API tessera_code tessera_connect(const char* address, double timeout, tessera_client** client);

/* The same with a folder that `tessera keys create` made for a client, for a cluster with keys; null: none.
 * NOT_FOUND, naming the file, if the folder lacks one. */
TESSERA_API tessera_code tessera_connect_with_keys(const char* address, const char* keys, double timeout,
                                                   tessera_client** client);

/* Streams of the client stay open. Does nothing for null. */
TESSERA_API void tessera_disconnect(tessera_client* client);

/* Loads a world file written by `tessera convert`; the world starts paused at tick 0. NOT_FOUND or
 * INVALID_ARGUMENT for the file, ALREADY_EXISTS if a world is loaded and `replace` is not set. */
TESSERA_API tessera_code tessera_load(tessera_client* client, const char* file, bool replace);

/* Writes all of the world between two ticks, whether it runs or not, to a file. `tick`: completed; may be
 * null. UNAVAILABLE if the file cannot be written. */
TESSERA_API tessera_code tessera_snapshot(tessera_client* client, const char* file, uint64_t* tick);

/* Loads the world of such a file, paused at its tick: it goes on with the bits that it would have had.
 * DATA_LOSS for a file that is damaged; otherwise as tessera_load(). */
TESSERA_API tessera_code tessera_restore(tessera_client* client, const char* file, bool replace);

/* Adds a dynamic body of uniform density to the world; `name` must be unique in it. */
TESSERA_API tessera_code tessera_spawn_box(tessera_client* client, const char* name, const double size[3],
                                           double mass, const tessera_position* position, uint64_t* id);
TESSERA_API tessera_code tessera_spawn_sphere(tessera_client* client, const char* name, double radius,
                                              double mass, const tessera_position* position, uint64_t* id);

/* The id of the body of that name. NOT_FOUND. */
TESSERA_API tessera_code tessera_find(tessera_client* client, const char* name, uint64_t* id);

/* Pushes a body: `impulse` in N s, `lever` in m from the centre of mass; null: at that centre. NOT_FOUND. */
TESSERA_API tessera_code tessera_apply_impulse(tessera_client* client, uint64_t id, const double impulse[3],
                                               const double lever[3]);

/* Starts or stops the moving surface of a body, as that of a conveyor belt: `velocity` in m/s, and `running`
 * in m/s, the axis that a track runs around, in the body frame; null: 0. NOT_FOUND. */
TESSERA_API tessera_code tessera_set_surface_motion(tessera_client* client, uint64_t id,
                                                    const double velocity[3], const double running[3]);

/* Runs that many ticks, however long they take. `tick`, the last of them, may be null, here and below.
 * FAILED_PRECONDITION unless the world is paused. */
TESSERA_API tessera_code tessera_step(tessera_client* client, uint64_t ticks, uint64_t* tick);

/* Returns when the world has paused. */
TESSERA_API tessera_code tessera_pause(tessera_client* client, uint64_t* tick);

/* Runs the world, `real_time_factor` simulated seconds per second; 0: as fast as possible. */
TESSERA_API tessera_code tessera_resume(tessera_client* client, double real_time_factor, uint64_t* tick);

typedef enum tessera_state {
  TESSERA_EMPTY = 0, /* no world */
  TESSERA_LOADING = 1,
  TESSERA_PAUSED = 2,
  TESSERA_RUNNING = 3,
  TESSERA_FAILED = 4,
  TESSERA_RECOVERING = 5 /* from the loss of a server, or waiting for one */
} tessera_state;

typedef struct tessera_status {
  tessera_state state;
  uint64_t tick; /* completed by every server */
  double time;   /* s, simulated */
  double real_time_factor;
  uint64_t servers;
  uint64_t bodies;
  uint64_t bodies_awake;
  uint64_t sectors;
  uint64_t contacts;
  double tick_ms_mean; /* of the slowest server of each tick */
  double tick_ms_p50;
  double tick_ms_p99;
  double time_step;   /* s; 0 without a world */
  double sector_size; /* m; likewise */
} tessera_status;

TESSERA_API tessera_code tessera_get_status(tessera_client* client, tessera_status* status);

/* A body that left the range of numbers, speeds or sectors in a tick, and was stopped there. */
typedef struct tessera_divergence {
  uint64_t tick;
  uint64_t body;
  uint64_t joint;   /* of its joints, the one whose error is largest; 0: none */
  const char* what; /* "speed above 1e+06 m/s": valid as long as the library */
} tessera_divergence;

/* Writes the first `capacity` of those since the load that the cluster keeps, ascending by tick and body, to
 * `divergences`, the number of these to `count`, and that of all that ever happened to `total`. */
TESSERA_API tessera_code tessera_divergences(tessera_client* client, tessera_divergence* divergences,
                                             size_t capacity, size_t* count, uint64_t* total);

/* A frame of a model: its pose is that of its body, followed by `position` and `orientation` in the body
 * frame. */
typedef struct tessera_frame {
  uint64_t body;
  double position[3];
  double orientation[4];
} tessera_frame;

/* The frame of that name. NOT_FOUND. */
TESSERA_API tessera_code tessera_find_frame(tessera_client* client, const char* name, tessera_frame* frame);

/* The frames of a world that move, such as trains and ships. */
typedef struct tessera_moving_frames tessera_moving_frames;

/* Those of the world that is loaded. Release them with tessera_moving_frames_free(). FAILED_PRECONDITION
 * without a world. */
TESSERA_API tessera_code tessera_get_moving_frames(tessera_client* client, tessera_moving_frames** frames);
TESSERA_API void tessera_moving_frames_free(tessera_moving_frames* frames); /* does nothing for null */

/* How many they are; their numbers begin with 1. The name of one, valid as long as they are; null for a
 * number that none has. The number of the one of that name; NOT_FOUND. */
TESSERA_API uint32_t tessera_moving_frames_count(const tessera_moving_frames* frames);
TESSERA_API const char* tessera_moving_frame_name(const tessera_moving_frames* frames, uint32_t frame);
TESSERA_API tessera_code tessera_find_moving_frame(const tessera_moving_frames* frames, const char* name,
                                                   uint32_t* frame);

typedef struct tessera_body tessera_body;

/* Tells where bodies are: those among them that carry frames. Others are ignored. */
TESSERA_API void tessera_see_carriers(tessera_moving_frames* frames, const tessera_body* bodies,
                                      size_t count);

/* A pose, of whatever frame, in the frame of that number, as that is at the end of `tick`. `orientation` may
 * be null, and `orientation_there` then, too. NOT_FOUND for a number that no frame has, UNAVAILABLE where a
 * frame has a carrier that tessera_see_carriers() did not see, OUT_OF_RANGE beyond the range of sectors. */
TESSERA_API tessera_code tessera_pose_in_frame(const tessera_moving_frames* frames, uint64_t tick,
                                               const tessera_position* position, const double orientation[4],
                                               uint32_t frame, tessera_position* position_there,
                                               double orientation_there[4]);

/* The hash of the world's state as 32 hexadecimal digits and a null: equal states have equal hashes, on any
 * number of servers. */
TESSERA_API tessera_code tessera_hash(tessera_client* client, char hash[33], uint64_t* tick);

typedef struct tessera_hit {
  uint64_t body; /* 0: no hit, and no other field is set */
  double distance;
  tessera_position position;
  double normal[3];
} tessera_hit;

/* The first hit of a ray within `length` m; `direction` may have any length but zero. */
TESSERA_API tessera_code tessera_raycast(tessera_client* client, const tessera_position* origin,
                                         const double direction[3], double length, tessera_hit* hit);

struct tessera_body {
  uint64_t id;
  tessera_position position; /* of the body frame */
  double orientation[4];
  double linear_velocity[3];  /* of the centre of mass, m/s */
  double angular_velocity[3]; /* rad/s */
  bool asleep;
};

/* Commands, ticks and queries in one message: commands take effect together at one tick, or none of them
 * does; queries are answered together at one tick, after the commands' ticks. Anything that the cluster can
 * do is in JSON (the message Request of proto/tessera.proto); what a game or a controller does in each frame
 * has calls of its own. */
typedef struct tessera_batch tessera_batch;
typedef struct tessera_answers tessera_answers;

/* `json`, for example {"commands": [{"remove": {"prefix": "car::"}}], "ticks": 1, "queries": [{"hash": {}}]};
 * null: an empty batch. Release it with tessera_batch_free(). INVALID_ARGUMENT, naming the field. */
TESSERA_API tessera_code tessera_batch_new(const char* json, tessera_batch** batch);
TESSERA_API void tessera_batch_free(tessera_batch* batch); /* does nothing for null */

/* Add a command. Null for a vector: 0; for an orientation: it stays. */
TESSERA_API void tessera_batch_set_velocity(tessera_batch* batch, uint64_t body, const double linear[3],
                                            const double angular[3]);
TESSERA_API void tessera_batch_apply_impulse(tessera_batch* batch, uint64_t body, const double impulse[3],
                                             const double lever[3]);
TESSERA_API void tessera_batch_apply_force(tessera_batch* batch, uint64_t body, const double force[3],
                                           const double torque[3]);
TESSERA_API void tessera_batch_teleport(tessera_batch* batch, uint64_t body, const tessera_position* position,
                                        const double orientation[4]);
TESSERA_API void tessera_batch_set_kinematic_target(tessera_batch* batch, uint64_t body,
                                                    const tessera_position* position,
                                                    const double orientation[4]);
/* A servo of the first axis: stiffness (target - position) - damping rate; rad or m, and N m or N for these.
 */
TESSERA_API void tessera_batch_set_servo(tessera_batch* batch, uint64_t joint, double target,
                                         double stiffness, double damping);
TESSERA_API void tessera_batch_remove(tessera_batch* batch, uint64_t body);

/* Ticks that a paused world runs after the commands, before the queries. */
TESSERA_API void tessera_batch_set_ticks(tessera_batch* batch, uint64_t ticks);

/* Add a query; its place is that of its result. `except`: passed through, or 0. */
TESSERA_API size_t tessera_batch_ray(tessera_batch* batch, const tessera_position* origin,
                                     const double direction[3], double length, uint64_t except);
TESSERA_API size_t tessera_batch_states(tessera_batch* batch, const uint64_t* bodies, size_t count);

/* Sends the batch, and waits for the answers, at most `timeout` s (negative: indefinitely). Release them with
 * tessera_answers_free(). The error names the element; then nothing was done. */
TESSERA_API tessera_code tessera_run(tessera_client* client, const tessera_batch* batch, double timeout,
                                     tessera_answers** answers);
TESSERA_API void tessera_answers_free(tessera_answers* answers); /* does nothing for null */

/* A batch that is on its way. */
typedef struct tessera_pending tessera_pending;

enum { TESSERA_PENDING_MAX = 512 };

/* Sends the batch and returns at once, for a game that must not wait in a frame. Batches take effect in the
 * order in which they are sent. Release `pending` with tessera_pending_free(). RESOURCE_EXHAUSTED where
 * TESSERA_PENDING_MAX batches of the client have no answer yet: then nothing is sent. */
TESSERA_API tessera_code tessera_send(tessera_client* client, const tessera_batch* batch,
                                      tessera_pending** pending);

/* Gives the answers to a batch that was sent, once; waits for them at most `timeout` s (0 polls, negative:
 * indefinitely). DEADLINE_EXCEEDED if they are not there yet: call again. Other errors as tessera_run();
 * CANCELLED after tessera_disconnect(), FAILED_PRECONDITION once the answers were given. */
TESSERA_API tessera_code tessera_take(tessera_pending* pending, double timeout, tessera_answers** answers);

/* The batch is carried out nevertheless. Does nothing for null. */
TESSERA_API void tessera_pending_free(tessera_pending* pending);

/* The tick of the results; and that at whose beginning the commands take effect, 0 without any. */
TESSERA_API uint64_t tessera_answers_tick(const tessera_answers* answers);
TESSERA_API uint64_t tessera_answers_effect(const tessera_answers* answers);

/* The result at `place`: of a ray; of states, of which the first `capacity` are written, ascending by id, and
 * all are counted. INVALID_ARGUMENT for a place of another kind of query. */
TESSERA_API tessera_code tessera_answers_ray(const tessera_answers* answers, size_t place, tessera_hit* hit);
TESSERA_API tessera_code tessera_answers_states(const tessera_answers* answers, size_t place,
                                                tessera_body* bodies, size_t capacity, size_t* count);

/* All of the answers: the message Reply as JSON, valid as long as they are. */
TESSERA_API const char* tessera_answers_json(tessera_answers* answers);

/* Subscribes to the states of bodies, merged over all servers; without ids, of all bodies that are not
 * static. Release the stream with tessera_unwatch(). FAILED_PRECONDITION if there is nothing to watch. */
TESSERA_API tessera_code tessera_watch(tessera_client* client, const uint64_t* ids, size_t count,
                                       tessera_stream** stream);

/* The same of bodies in a box along the axes of the frame of its centre, and of no other frame; `half_size`
 * in m. */
TESSERA_API tessera_code tessera_watch_region(tessera_client* client, const tessera_position* centre,
                                              const double half_size[3], tessera_stream** stream);

/* Waits at most `timeout` s (0 polls, a negative value waits indefinitely) for the next tick. Writes the
 * first `capacity` of its bodies, ascending by id, to `bodies`, and the number of all its bodies to `count`.
 *
 * DEADLINE_EXCEEDED if no tick is complete in time: call again. Any other error ends the stream for good:
 * UNAVAILABLE if a server was lost, ABORTED if the world was unloaded or replaced. */
TESSERA_API tessera_code tessera_next(tessera_stream* stream, double timeout, uint64_t* tick,
                                      tessera_body* bodies, size_t capacity, size_t* count);

/* What happens to a contact of two bodies in a tick. */
typedef enum tessera_phase { TESSERA_END = 0, TESSERA_BEGIN = 1, TESSERA_PERSIST = 2 } tessera_phase;

/* A patch of contact: points that share a normal. Of the end of a contact, and with `trigger` set, the fields
 * after `trigger` are 0. */
typedef struct tessera_contact {
  uint64_t a;
  uint64_t b;
  tessera_phase phase;
  bool trigger;              /* no contact: `b` overlaps a trigger of `a` */
  tessera_position position; /* of the deepest point, on b */
  double normal[3];          /* on b, pointing to a */
  double impulse;            /* N s, on a along the normal */
  double friction[3];        /* N s, on a */
} tessera_contact;

/* Subscribes to contacts with any of these bodies; without ids, to all: as they begin and end, or, with
 * `persisting`, those that go on, too. If `impulse_min` is not 0, instead in each tick to those whose
 * impulses are together at least that, N s. Ends and errors as tessera_watch(). */
TESSERA_API tessera_code tessera_watch_contacts(tessera_client* client, const uint64_t* ids, size_t count,
                                                bool persisting, double impulse_min, tessera_stream** stream);
/* As tessera_next(), for such a stream; INVALID_ARGUMENT for another one, which stays as it is. */
TESSERA_API tessera_code tessera_next_contacts(tessera_stream* stream, double timeout, uint64_t* tick,
                                               tessera_contact* contacts, size_t capacity, size_t* count);

/* What a joint has at a tick, by axis; 0 for axes that it does not have. */
typedef struct tessera_joint {
  uint64_t id;
  double position[2]; /* rad or m */
  double velocity[2]; /* rad/s or m/s */
  double gap;         /* m, by which it is open */
  double twist;       /* rad, likewise */
  bool asleep;        /* its child sleeps */
} tessera_joint;

/* Subscribes to the joints whose names begin with `prefix`, the first 10,000 by ids. NOT_FOUND if there are
 * none. */
TESSERA_API tessera_code tessera_watch_joints(tessera_client* client, const char* prefix,
                                              tessera_stream** stream);
TESSERA_API tessera_code tessera_next_joints(tessera_stream* stream, double timeout, uint64_t* tick,
                                             tessera_joint* joints, size_t capacity, size_t* count);

/* What a program of a body publishes. The pointers are valid until the next call with the stream. */
typedef struct tessera_program {
  uint64_t body;
  uint32_t program; /* its place on the body */
  bool stopped;     /* by a fault */
  const char* kind;
  const double* values; /* as docs/programs.md or its module lists them */
  size_t value_count;
} tessera_program;

/* Subscribes to the programs of these bodies, without ids of all, of one kind or, where that is null, of any.
 * A tick has those of bodies on which anything has changed, the first one all. */
TESSERA_API tessera_code tessera_watch_programs(tessera_client* client, const uint64_t* ids, size_t count,
                                                const char* kind, tessera_stream** stream);
TESSERA_API tessera_code tessera_next_programs(tessera_stream* stream, double timeout, uint64_t* tick,
                                               tessera_program* programs, size_t capacity, size_t* count);

/* A copy of a body in a sector other than its home, where contact with it is imminent. */
typedef struct tessera_clone {
  uint64_t body;
  int64_t sector[3];
  uint64_t server; /* the node that hosts the sector */
  uint32_t frame;  /* of the sector */
} tessera_clone;

/* An awake island across a border of sectors. */
typedef struct tessera_island {
  uint64_t id;            /* the smallest id of its bodies */
  const uint64_t* bodies; /* ascending; valid until the next call with the stream */
  size_t body_count;
} tessera_island;

/* Subscribes to what crosses borders of sectors. */
TESSERA_API tessera_code tessera_watch_seams(tessera_client* client, tessera_stream** stream);
/* As tessera_next(), for clones, ascending by body and sector, and for islands, ascending by id. */
TESSERA_API tessera_code tessera_next_seams(tessera_stream* stream, double timeout, uint64_t* tick,
                                            tessera_clone* clones, size_t clone_capacity, size_t* clone_count,
                                            tessera_island* islands, size_t island_capacity,
                                            size_t* island_count);

/* Of any kind. Does nothing for null. */
TESSERA_API void tessera_unwatch(tessera_stream* stream);

#ifdef __cplusplus
}
#endif

#endif
