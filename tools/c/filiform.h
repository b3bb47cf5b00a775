/* filiform.h: the C interface of filiform, C99 to C23 and C++11 on. Tile sets of neurons: search, cells, attributes,
 * measures, paths, ingest and navigation.
 *
 *   filiform_set *set = NULL;
 *   if (filiform_open("column.fil", NULL, &set) != FILIFORM_OK) {
 *     fprintf(stderr, "%s\n", filiform_error_text());
 *     return 1;
 *   }
 *   const double point_um[3] = {120, -40, 800};
 *   filiform_hit hit;
 *   size_t found = 0;
 *   if (filiform_nearest(set, point_um, NULL, &hit, &found) == FILIFORM_OK && found == 1)
 *     printf("%.17g um\n", hit.distance_um);
 *   filiform_close(set);
 *
 * Link with -lfiliform (pkg-config filiform, or the CMake target filiform::c).
 *
 * Errors. A function that can fail returns a filiform_status. FILIFORM_OK is 0. Otherwise filiform_error_text() has one
 * line that says what is wrong. After an error, output parameters are 0 or NULL unless the function states otherwise.
 * No exception and no signal leaves the library.
 *
 * Units. Lengths are micrometres (_um), hand positions metres (_m), forces newtons (_N). Points are x, y, z. World
 * points are in the frame of the input. Hand positions and forces are in the device's frame: x right, y up, z towards
 * the person, origin at the centre of the workspace.
 *
 * Structs that begin with struct_size grow in later versions. Set all bytes to 0 and struct_size to sizeof the struct:
 *
 *   filiform_query query = FILIFORM_INIT(query);
 *
 * 0 means the default in every option. The library takes each size that the struct had in a version since 0.1. It reads
 * the members beyond that size as 0, and does not write them. Another size is FILIFORM_USAGE. All other structs, such
 * as filiform_hit, never change.
 *
 * Handles (filiform_set, filiform_cell, filiform_travel) are not pointers to memory. A null, closed or invented handle
 * gives FILIFORM_USAGE. Each handle must be closed. Closing NULL does nothing.
 *
 * Memory. An array that a function returns through a pointer to a pointer belongs to the caller. Free it with
 * filiform_free(). An empty array is NULL.
 *
 * Threads. All functions except those of filiform_travel may be called on any thread, also with the same handle at the
 * same time. The calls on one filiform_travel must not overlap. A handle that is closed during a call on another thread
 * stays alive until that call returns.
 *
 * fork(). A child process must not use the handles of its parent: each call gives FILIFORM_USAGE, and filiform_close()
 * does nothing. Open the set again in the child. exec() in the child is always safe. */
#ifndef FILIFORM_H
#define FILIFORM_H

#include <stddef.h>
#include <stdint.h>

#ifdef __cplusplus
extern "C" {
#endif

/* The version of this header, as <filiform/index/version.h> has it; filiform_version() is that of the library. */
#ifndef FILIFORM_VERSION_MAJOR
#define FILIFORM_VERSION_MAJOR 0
#define FILIFORM_VERSION_MINOR 2
#define FILIFORM_VERSION_PATCH 0
/* For comparisons: major * 10000 + minor * 100 + patch. */
#define FILIFORM_VERSION_NUMBER (FILIFORM_VERSION_MAJOR * 10000 + FILIFORM_VERSION_MINOR * 100 + FILIFORM_VERSION_PATCH)
#endif

/* Marks what the library exports. */
#if defined(__GNUC__)
#define FILIFORM_API __attribute__((visibility("default")))
#else
#define FILIFORM_API
#endif

/* Initialises a struct that begins with struct_size. */
#ifdef __cplusplus
#define FILIFORM_INIT(variable)                                    \
  ([] {                                                            \
    decltype(variable) initial = decltype(variable)();             \
    initial.struct_size = static_cast<uint32_t>(sizeof(variable)); \
    return initial;                                                \
  }())
#else
#define FILIFORM_INIT(variable) \
  { .struct_size = (uint32_t)sizeof(variable) }
#endif

/* ---- Errors ------------------------------------------------------------------------------------------------- */

typedef enum filiform_status {
  FILIFORM_OK = 0,
  FILIFORM_INPUT = 1,       /* the input cannot be used, or a refusal: the set exists, nothing to ingest */
  FILIFORM_USAGE = 2,       /* a wrong argument: null, closed handle, wrong struct_size, NaN, unknown name */
  FILIFORM_IO = 3,          /* the system refused: file missing, disk full, network, thread not started */
  FILIFORM_CORRUPT = 4,     /* the bytes of a tile set differ from those written */
  FILIFORM_INTERRUPTED = 5, /* a callback asked to stop */
  FILIFORM_NO_MEMORY = 6,   /* memory ran out; handles stay valid */
  FILIFORM_INTERNAL = 7     /* a defect of the library: please report the text */
} filiform_status;

/* The text of the last error on the calling thread; "" if there was none. One line, UTF-8, without control characters.
 * Valid until the next failing call on this thread. Never NULL. */
FILIFORM_API const char* filiform_error_text(void);

/* The name of a status, such as "FILIFORM_USAGE"; "unknown status" for other values. Static storage. */
FILIFORM_API const char* filiform_status_name(int status);

/* The version of the library, such as "0.2.0-dev". Static storage. */
FILIFORM_API const char* filiform_version(void);

/* Frees an array that a function returned. NULL is allowed. */
FILIFORM_API void filiform_free(void* array);

/* ---- Sets --------------------------------------------------------------------------------------------------- */

typedef struct filiform_set filiform_set;

/* How filiform_open() opens a set. */
typedef struct filiform_open_options {
  uint32_t struct_size;
  uint32_t reserved;
  uint64_t memory_bytes;    /* of tiles kept between queries; 0: 256 MiB */
  const char* token;        /* for a set at an address: sent as bearer token to the set's own host; NULL: none */
  const char* cache_folder; /* for a set at an address: keeps what is read; NULL: nothing is kept */
  uint64_t cache_bytes;     /* of that folder; 0: 4 GiB */
} filiform_open_options;

/* Opens a tile set: a folder, or an address (http://HOST/v1/sets/NAME, https://HOST/PATH/NAME.fil,
 * s3://BUCKET/PATH/NAME.fil). `options` may be NULL. Reads the manifest only; the rest is read and checked at its first
 * use. The handle keeps reading the revision that it opened when another one is published.
 * FILIFORM_IO: there is no set. FILIFORM_CORRUPT, FILIFORM_INPUT: an older format. */
FILIFORM_API int filiform_open(const char* name, const filiform_open_options* options, filiform_set** set);

/* Closes a set. FILIFORM_USAGE if it is closed already. Cells and travels that were opened from it stay valid. */
FILIFORM_API int filiform_close(filiform_set* set);

/* What a set holds. */
typedef struct filiform_info {
  uint32_t struct_size;
  uint32_t capacity; /* segments a tile, at most */
  uint64_t cells, samples, segments, isolated, roots, removed;
  uint64_t tiles, stored_segments;
  uint64_t bytes;                 /* of all files */
  uint64_t decoded_bytes;         /* of all tiles, once in memory */
  uint64_t smallest_budget_bytes; /* for filiform_travel_options and filiform_run_options */
  uint64_t refused;               /* inputs that ingest refused */
  uint32_t cell_ids;              /* ids of cells are 0 .. cell_ids-1; removed cells keep theirs */
  uint32_t reserved;
  double quantum_um;         /* positions are multiples of it */
  double lo_um[3], hi_um[3]; /* box of all samples; NaN for a set without samples */
} filiform_info;

/* Fills `info`, whose struct_size the caller sets. O(1). */
FILIFORM_API int filiform_get_info(filiform_set* set, filiform_info* info);

/* ---- Search ------------------------------------------------------------------------------------------------- */

/* A segment that a search found. A segment joins a sample, its child, to the child's parent. */
typedef struct filiform_hit {
  double distance_um; /* from the query's point; along a ray: from the ray */
  double point_um[3]; /* nearest point of the segment */
  double t;           /* position of that point on the segment: 0 child .. 1 parent */
  double along_um;    /* along a ray: from its origin; otherwise 0 */
  int64_t sample;     /* id of the child sample in its file */
  uint32_t cell;      /* id in the set */
  uint32_t segment;   /* rank of the child sample in the cell; in a cell with loops, rank of the link */
  uint32_t exact;     /* 1: certainly the segment of that rank; 0: epsilon or approximate decided */
  uint32_t tiles_read;
} filiform_hit;

/* What filiform_nearest() looks for. */
typedef struct filiform_query {
  uint32_t struct_size;
  uint32_t k;             /* results for each point; 0: 1 */
  double epsilon;         /* each rank may be (1 + epsilon) times too far; saves reads */
  double max_distance_um; /* closed; 0: no limit */
  uint32_t approximate;   /* not 0: use the landmarks alone; the error is at most filiform_covering_radius() */
  uint32_t threads;       /* of filiform_nearest_many(); 0: 1 */
} filiform_query;

/* Finds the nearest segments to a point, nearest first, ties by (cell, segment). `query` may be NULL: the exact
 * nearest. `hits` has room for query->k results; `*count` becomes their number. Expected O(log segments + k).
 * FILIFORM_USAGE: a coordinate that is not finite or beyond 1e150, a negative epsilon or distance. */
FILIFORM_API int filiform_nearest(filiform_set* set, const double point_um[3], const filiform_query* query,
                                  filiform_hit* hits, size_t* count);

/* The same for many points at once. `points_um` has `points` x 3 values. The results of point i begin at
 * hits[i * query->k]; counts[i] is their number. `counts` may be NULL if every point is known to have k results.
 * FILIFORM_USAGE also for more than 2^31 results. */
FILIFORM_API int filiform_nearest_many(filiform_set* set, const double* points_um, size_t points,
                                       const filiform_query* query, filiform_hit* hits, size_t* counts);

/* The largest error of approximate results, um. The first call reads the landmarks. */
FILIFORM_API int filiform_covering_radius(filiform_set* set, double* radius_um);

/* All segments within a distance (closed) of a point, nearest first. */
FILIFORM_API int filiform_within(filiform_set* set, const double point_um[3], double radius_um, filiform_hit** hits,
                                 size_t* count);

/* All segments that meet a closed box, nearest to its middle first. Corners are rounded to the grid. */
FILIFORM_API int filiform_box(filiform_set* set, const double lo_um[3], const double hi_um[3], filiform_hit** hits,
                              size_t* count);

/* What filiform_ray() looks for. */
typedef struct filiform_ray_query {
  uint32_t struct_size;
  uint32_t most;       /* number of results; 0: all */
  double origin_um[3]; /* where the ray begins */
  double direction[3]; /* of any length except 0 */
  double radius_um;    /* a segment within this distance of the ray is hit */
  double slope;        /* that distance grows by `slope` um for each um along the ray */
  double length_um;    /* hits lie within this distance along the ray; 0: no limit */
} filiform_ray_query;

/* The segments along a ray, the first along it first. */
FILIFORM_API int filiform_ray(filiform_set* set, const filiform_ray_query* ray, filiform_hit** hits, size_t* count);

/* A row of filiform_box_counts(). */
typedef struct filiform_cell_count {
  uint32_t cell;
  uint32_t reserved;
  uint64_t segments;
} filiform_cell_count;

/* The number of segments that meet a closed box, by cell, ascending. `by_middle` not 0: only those whose middle is at
 * least lo_um and below hi_um on each axis, so that boxes side by side count each segment once. */
FILIFORM_API int filiform_box_counts(filiform_set* set, const double lo_um[3], const double hi_um[3], int by_middle,
                                     filiform_cell_count** counts, size_t* count);

/* Which segments a view has. */
typedef struct filiform_filter {
  uint32_t struct_size;
  uint32_t type_count;
  const uint16_t* types; /* only segments of these types, as in filiform_cell_arrays; NULL: all; a count of 0: none */
  const uint32_t* cells; /* only segments of these cells; NULL: all; a count of 0: none */
  size_t cell_count;
  const char* const* where; /* conditions as filiform_where() takes them, which all must hold; NULL: none */
  size_t where_count;
} filiform_filter;

/* Opens a view of a set: to its searches and counts, all other segments are as if they did not exist. A view of a
 * view has the segments that both filters leave. Cells, attributes and measures stay those of the set. Close it with
 * filiform_close(); the set may be closed before. */
FILIFORM_API int filiform_open_filtered(filiform_set* set, const filiform_filter* filter, filiform_set** filtered);

/* A row of filiform_levels(). */
typedef struct filiform_level_segment {
  double child_um[3], parent_um[3];
  float radius_um; /* NaN: unknown */
  uint16_t type;
  uint16_t reserved;
  uint32_t cell;
  uint32_t reserved2;
} filiform_level_segment;

/* Simplified neurites that draw a box whose longest side is `pixels` wide, with an error below a pixel. `most`: limits
 * the choice of tiles; 0: 2 000 000. `*error_um`: no neurite is farther from its drawn form; may be NULL.
 * FILIFORM_INPUT: the set has no levels of detail. */
FILIFORM_API int filiform_levels(filiform_set* set, const double lo_um[3], const double hi_um[3], double pixels,
                                 uint64_t most, filiform_level_segment** segments, size_t* count, double* error_um);

/* ---- Cells -------------------------------------------------------------------------------------------------- */

typedef struct filiform_cell_info {
  uint32_t struct_size;
  uint32_t removed;   /* 1: the cell was removed; all else is then 0 */
  uint32_t has_loops; /* 1: the cell is a graph, not a forest */
  uint32_t reserved;
  const char *name, *source; /* UTF-8 as far as the input was; valid until the set is closed */
  uint64_t samples, segments, isolated, roots;
  double lo_um[3], hi_um[3]; /* box of its samples; NaN without samples */
} filiform_cell_info;

/* What the set's table states about a cell. FILIFORM_USAGE: no cell has this id. O(1). */
FILIFORM_API int filiform_get_cell_info(filiform_set* set, uint32_t cell, filiform_cell_info* info);

/* The id of the cell with exactly this name. FILIFORM_USAGE: there is none. O(log cells). */
FILIFORM_API int filiform_find_cell(filiform_set* set, const char* name, uint32_t* cell);

/* The ids of the cells whose name matches in any letter case: * stands for any text, ? for any byte, [a-z] for one of a
 * list. NULL: all cells. Removed cells are left out. O(cells). */
FILIFORM_API int filiform_cells(filiform_set* set, const char* pattern, uint32_t** cells, size_t* count);

/* ---- Attributes and measures of cells ------------------------------------------------------------------------- */

typedef enum filiform_attribute_type {
  FILIFORM_TEXT = 0,
  FILIFORM_INTEGER = 1,
  FILIFORM_REAL = 2
} filiform_attribute_type;

/* A row of filiform_attributes(). */
typedef struct filiform_attribute {
  const char* name; /* valid until the set is closed */
  uint32_t type;    /* a filiform_attribute_type */
  uint32_t reserved;
  uint64_t values; /* cells that have one */
} filiform_attribute;

/* The attributes of the set's cells, such as "mtype" and "layer", ascending by name. */
FILIFORM_API int filiform_attributes(filiform_set* set, filiform_attribute** attributes, size_t* count);

/* An attribute of all cells as numbers, by id; NaN: missing. `values` has room for filiform_info.cell_ids.
 * FILIFORM_USAGE: an unknown attribute, or one of text. O(cells). */
FILIFORM_API int filiform_attribute_numbers(filiform_set* set, const char* name, double* values);

/* An attribute of all cells as texts, by id; NULL: missing. Numbers have all their digits. The caller frees the array;
 * the texts are valid until the set is closed. `*count` is filiform_info.cell_ids. O(cells). */
FILIFORM_API int filiform_attribute_texts(filiform_set* set, const char* name, const char*** texts, size_t* count);

/* The ids of the cells that meet all of `condition_count` conditions, ascending: "layer>=5", "mtype=L5_*",
 * "measure:length>5000". FILIFORM_USAGE: an unknown attribute or measure, another form. O(cells), with a measure
 * O(segments). */
FILIFORM_API int filiform_where(filiform_set* set, const char* const* conditions, size_t condition_count,
                                uint32_t** cells, size_t* count);

/* Measures cells. `features`: names with commas between, such as "length,tips" (index/measure/MEASURES.md). `cells`:
 * `cell_count` ids; NULL: all that are not removed, as filiform_cells() lists them. `*values` has a row for each cell
 * with a value for each feature, in their order; NaN: none. FILIFORM_USAGE: an unknown feature, with near names.
 * O(segments of the cells). */
FILIFORM_API int filiform_measure(filiform_set* set, const uint32_t* cells, size_t cell_count, const char* features,
                                  double** values, size_t* rows, size_t* columns);

/* ---- Whole cells ---------------------------------------------------------------------------------------------- */

/* A whole cell, read into memory. */
typedef struct filiform_cell filiform_cell;

/* Reads a cell. O(segments of the tiles that hold it). */
FILIFORM_API int filiform_cell_open(filiform_set* set, uint32_t cell, filiform_cell** handle);
FILIFORM_API int filiform_cell_close(filiform_cell* cell);

/* A root's parent; a place between two samples has no sample. */
#define FILIFORM_NONE UINT32_MAX

/* A cell as arrays. Samples have ranks 0 .. samples-1, in the order of the file. */
typedef struct filiform_cell_arrays {
  uint32_t struct_size;
  uint32_t reserved;
  size_t samples, links;
  const double* points_um;   /* samples x 3 */
  const float* radii_um;     /* samples; NaN: unknown */
  const uint16_t* types;     /* samples; as SWC: 1 soma, 2 axon, 3 dendrite, 4 apical dendrite */
  const int64_t* sample_ids; /* samples; ids of the file */
  const uint32_t* parents;   /* samples; rank of the parent, FILIFORM_NONE for a root; with loops, a spanning forest */
  const uint32_t* ends;      /* links x 2: ranks of child and parent of each segment */
} filiform_cell_arrays;

/* Fills `arrays`, whose struct_size the caller sets. The arrays belong to the cell, must not be changed, and are valid
 * until the cell is closed. O(1). */
FILIFORM_API int filiform_cell_get_arrays(filiform_cell* cell, filiform_cell_arrays* arrays);

/* A place on a cell: on a segment, at t (0 child .. 1 parent). Hits give such places. */
typedef struct filiform_place {
  uint32_t segment;
  uint32_t reserved;
  double t;
} filiform_place;

/* The place of the sample with this id in its file. If the id repeats, the sample of lowest rank. FILIFORM_USAGE: the
 * cell has no such sample. O(samples). */
FILIFORM_API int filiform_cell_place(filiform_cell* cell, int64_t sample_id, filiform_place* place);

/* The length of the shortest path along the cell. `*length_um` is infinity if no path joins the places.
 * FILIFORM_USAGE: a place that the cell does not have. O(samples log samples). */
FILIFORM_API int filiform_cell_distance(filiform_cell* cell, filiform_place from, filiform_place to, double* length_um);

/* The length of the path to each sample, by rank; infinity if there is no path. `lengths_um` has room for
 * filiform_cell_arrays.samples values. O(samples log samples). */
FILIFORM_API int filiform_cell_distances(filiform_cell* cell, filiform_place from, double* lengths_um);

/* The tip that is farthest along the cell, and the length to it. `rank` and `length_um` may be NULL. FILIFORM_USAGE: no
 * path leads to a tip. O(samples log samples). */
FILIFORM_API int filiform_cell_farthest_tip(filiform_cell* cell, filiform_place from, filiform_place* tip,
                                            uint32_t* rank, double* length_um);

/* A place on a path. */
typedef struct filiform_path_point {
  double point_um[3];
  double along_um;   /* from the first point */
  int64_t sample_id; /* of the file; 0 between two samples */
  uint32_t rank;     /* of the sample; FILIFORM_NONE between two samples */
  uint32_t reserved;
} filiform_path_point;

/* The shortest path as points: the first place, each sample on the way, the last place. FILIFORM_USAGE: no path joins
 * the places. O(samples log samples). */
FILIFORM_API int filiform_cell_path(filiform_cell* cell, filiform_place from, filiform_place to,
                                    filiform_path_point** points, size_t* count);

/* ---- Ingest ------------------------------------------------------------------------------------------------- */

/* Called now and then on the thread that called filiform_ingest(). `phase` is a word such as "reading". `total` is 0 if
 * it is unknown. Any value except 0 cancels: an existing set stays as it was. */
typedef int (*filiform_progress)(void* user, const char* phase, uint64_t done, uint64_t total);

/* How filiform_ingest() reads files and writes a set. */
typedef struct filiform_ingest_options {
  uint32_t struct_size;
  uint32_t threads;           /* 0: one a processor */
  uint64_t memory_bytes;      /* for the process, beside 32 MiB; at least 64 MiB; 0: 1 GiB */
  const char* unit;           /* of the files: "um", "nm", "mm", "8nm", "8,8,30nm"; NULL: um */
  const char* placements;     /* a table that places the morphologies of the input; NULL: none */
  uint32_t capacity;          /* segments a tile, at most; 0: 2048 */
  uint32_t apply_offset;      /* not 0: add the OFFSET of each header */
  uint32_t strict;            /* not 0: refuse files with a warning; write nothing if a file is refused */
  uint32_t force;             /* not 0: replace an existing set */
  uint32_t add;               /* not 0: add the cells to an existing set */
  uint32_t no_levels;         /* not 0: write no levels of detail */
  filiform_progress progress; /* NULL: none */
  void* user;                 /* passed to `progress` */
  /* since 0.2: */
  const char* attributes;   /* a CSV or TSV table with a row a cell, whose columns stay with the cells; NULL: none */
  const char* key;          /* its column with the names of cells */
  const char* population;   /* of a circuit, read only this one; NULL: all */
  const char* morphologies; /* a folder with the circuit's morphologies; NULL: use the folder that the circuit names */
  const char* version;      /* of neurons that a NeuroMorpho archive holds twice: "cng", "source", "both"; NULL: cng */
  uint32_t no_soma_links;   /* not 0: link no soma in formats that state no such links */
  uint32_t one_cell_a_file; /* not 0: keep a file that holds several cells as one */
  uint32_t sync;            /* not 0: the set follows its inputs */
  uint32_t remove_gone;     /* not 0: with sync, remove the cells that are gone */
} filiform_ingest_options;

/* What filiform_ingest() wrote and read. */
typedef struct filiform_ingest_result {
  uint32_t struct_size;
  uint32_t reserved;
  uint64_t cells, samples, segments, tiles;    /* of the whole set */
  uint64_t accepted, warned, skipped, refused; /* inputs */
  uint64_t bytes;                              /* of all files of the set */
  uint64_t passed_over;                        /* files of folders and archives that are no inputs */
} filiform_ingest_result;

/* Builds a tile set in the folder `output` from files, folders, archives or one circuit: `count` paths. Publishes at
 * once: a failure leaves an existing set unchanged. Inputs that cannot be used are counted in `refused`; the others are
 * ingested. `options` and `result` may be NULL. The caller sets result->struct_size.
 * FILIFORM_INPUT: the set exists, or no input is usable. FILIFORM_INTERRUPTED: `progress` asked to stop. */
FILIFORM_API int filiform_ingest(const char* const* inputs, size_t count, const char* output,
                                 const filiform_ingest_options* options, filiform_ingest_result* result);

/* ---- Navigation, one tick at a time -------------------------------------------------------------------------- */

/* A hand that travels in a set. The caller is the device: each tick takes the hand's position and gives the force on
 * it. */
typedef struct filiform_travel filiform_travel;

/* How a hand travels. */
typedef struct filiform_travel_options {
  uint32_t struct_size;
  uint32_t realtime;     /* 0: a tick reads the tiles that it needs. Not 0: threads read tiles; a tick never waits */
  uint64_t budget_bytes; /* of tiles in memory; 0: no limit */
  double zoom_um;        /* world across 0.12 m of the device; 0: 300 */
  double rate_Hz;        /* of ticks, for the choice of the stiffness; 0: 1000 */
  double stiffness_N_m;  /* of the spring to the proxy; 0: 200 */
  double max_force_N;    /* of the force on the hand; 0: 8 */
  const char* method;    /* "climb", "force", "force-listing", "shading", "basic"; NULL: climb */
} filiform_travel_options;

/* Opens a travel in the set. `options` may be NULL. The proxy has no place before the first jump. FILIFORM_USAGE: a
 * budget below filiform_info.smallest_budget_bytes, an unknown method. */
FILIFORM_API int filiform_travel_open(filiform_set* set, const filiform_travel_options* options,
                                      filiform_travel** travel);
FILIFORM_API int filiform_travel_close(filiform_travel* travel);

/* Moves the proxy to a place of a cell; the world moves so that the place lies under the hand. The force begins at zero
 * and grows over 0.5 s of ticks. Reads tiles: do not call it in a haptic loop. FILIFORM_USAGE: no such place. */
FILIFORM_API int filiform_travel_jump(filiform_travel* travel, uint32_t cell, filiform_place place);

/* The same to the place that is nearest to a point. FILIFORM_USAGE: a set without segments. */
FILIFORM_API int filiform_travel_jump_to(filiform_travel* travel, const double point_um[3]);

/* What filiform_travel_tick() gives. */
typedef struct filiform_tick {
  uint32_t struct_size;
  uint32_t frontier;      /* 1: a tile is missing; the proxy rests at its border */
  double force_N[3];      /* to be given to the hand now; bounded and slew-limited */
  double proxy_um[3];     /* in the world */
  double probe_um[3];     /* the hand in the world */
  double proxy_m[3];      /* the proxy in the device's frame */
  double t;               /* place of the proxy on its segment */
  uint32_t cell, segment; /* FILIFORM_NONE before the first jump */
  uint32_t visited;       /* segments tested */
  uint32_t reserved;
} filiform_tick;

/* One tick: the hand is at `hand_m`, `dt_s` seconds after the last tick (> 0). Fills `tick`, whose struct_size the
 * caller sets. A hand that is not finite moves nothing and gets no force.
 * With realtime, the call does not allocate, lock or call the system, and takes microseconds; the force is zero while a
 * tile that cannot be read is missing. Otherwise it may read tiles; FILIFORM_CORRUPT and FILIFORM_IO then give zero
 * force, and the next tick tries again. */
FILIFORM_API int filiform_travel_tick(filiform_travel* travel, const double hand_m[3], double dt_s,
                                      filiform_tick* tick);

/* Multiplies the zoom about the proxy; turns the world about the screen's axes through the proxy; brings the proxy to
 * the centre of the workspace. FILIFORM_USAGE for values that are not finite. */
FILIFORM_API int filiform_travel_zoom(filiform_travel* travel, double factor);
FILIFORM_API int filiform_travel_rotate(filiform_travel* travel, double about_x_rad, double about_y_rad);
FILIFORM_API int filiform_travel_centre(filiform_travel* travel);

/* What a travel has read since it began. */
typedef struct filiform_residency {
  uint32_t struct_size;
  uint32_t reserved;
  uint64_t reads, evictions, failures, cancelled;
  uint64_t bytes, peak_bytes; /* of tiles in memory */
  uint64_t bytes_read;        /* of tiles, decoded */
  uint64_t queued, peak_queued;
  uint64_t misses; /* tiles that a tick needed and that were not in memory */
  uint64_t prefetched, prefetch_used;
  uint64_t budget_bytes; /* UINT64_MAX: no limit */
} filiform_residency;

/* Counters of the travel's tiles. The caller sets struct_size. Takes a lock: do not call it in a haptic loop. */
FILIFORM_API int filiform_travel_residency(filiform_travel* travel, filiform_residency* residency);

/* ---- Navigation, whole runs ---------------------------------------------------------------------------------- */

typedef struct filiform_run_tick {
  uint64_t tick; /* from 0 */
  double time_s;
  double probe_um[3], proxy_um[3], force_N[3];
  uint32_t cell, segment; /* of the proxy */
  uint32_t visited, frontier;
} filiform_run_tick;

/* Called after each tick, on the thread that called filiform_navigate(). Any value except 0 ends the run, with the
 * outcome FILIFORM_STOPPED. */
typedef int (*filiform_run_callback)(void* user, const filiform_run_tick* tick);

/* What filiform_navigate() simulates. */
typedef struct filiform_run_options {
  uint32_t struct_size;
  uint32_t cell;                 /* id; used if has_cell is not 0 */
  uint32_t has_cell;             /* 0: the cell with the most segments */
  uint32_t realtime;             /* not 0: in real time; otherwise as fast as possible, the same on every machine */
  const char* route;             /* "longest", "random:SEED", "FIRST:LAST" (sample ids), "tour:SEED"; NULL: longest */
  const char* method;            /* as filiform_travel_options.method */
  const char* device;            /* "sim:loose", "sim:medium", "sim:firm", a device, replay:FILE; NULL: sim:medium */
  const char* record;            /* file for the recording; NULL: none */
  double seconds;                /* limit of simulated time; 0: 10 times the nominal time and 20 s, for a tour 60 s */
  double zoom_um;                /* 0: 300 */
  double rate_Hz;                /* 0: 1000 */
  double stiffness_N_m;          /* 0: by the hand */
  double speed_m_s;              /* of the hand's aim; 0: 0.05 */
  double latency_ms;             /* of reads, in virtual time */
  uint64_t budget_bytes;         /* of tiles in memory; 0: no limit */
  uint64_t seed;                 /* of the tremor; 0: 1 */
  filiform_run_callback on_tick; /* NULL: none */
  void* user;                    /* passed to on_tick */
} filiform_run_options;

/* How a run ended. */
typedef enum filiform_outcome {
  FILIFORM_COMPLETED = 0, /* the proxy came to the end of the route */
  FILIFORM_STUCK = 1,     /* the simulated person gave up */
  FILIFORM_TIME_OVER = 2,
  FILIFORM_STOPPED = 3 /* by the callback */
} filiform_outcome;

/* What a run measured. */
typedef struct filiform_run_summary {
  uint32_t struct_size;
  uint32_t outcome; /* a filiform_outcome */
  double route_um, reached_um;
  double sim_s;
  double mean_force_N, max_force_N, max_force_step_N;
  double stiffness_N_m;
  uint64_t ticks, stalls, frontiers;
  uint64_t tiles, tiles_read, evictions, peak_bytes;
  uint64_t missed_deadlines; /* in real time */
} filiform_run_summary;

/* A simulated hand travels a route, from its first to its last sample. `options` may be NULL. The caller sets
 * summary->struct_size. Without realtime the result depends on data and options alone, on every machine.
 * A replay takes the options of its recording for the fields that are 0 or NULL.
 * FILIFORM_USAGE: unknown cell, route, method or device, a zoom outside 1e-6 to 1e6 um, a route that a hand would
 * complete at this zoom without moving, a budget below the smallest one. */
FILIFORM_API int filiform_navigate(filiform_set* set, const filiform_run_options* options,
                                   filiform_run_summary* summary);

#ifdef __cplusplus
}
#endif

#endif
