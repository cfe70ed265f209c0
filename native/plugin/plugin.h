/* The sensor plugin "mjtactile.pad" as Python registers it, and the same pad read without a sensor. */
#pragma once

#include <stddef.h>
#include <stdint.h>

#include "api/api.h"

/* Outputs of a sensor, in the order they were asked for. */
enum { MJT_VON_MISES = 0, MJT_STRESS = 1, MJT_WRENCH = 2, MJT_CARRIED = 3, MJT_RANGE = 4, MJT_MOST_OUTPUTS = 5 };

/* The attributes of one instance, as Python interpreted them. */
typedef struct mjt_instance {
  const mjt_pad* pad;
  int64_t context;   /* number by which Python knows the instance */
  double friction, tolerance, facing_gap, strength;
  double widest;           /* flat faces get more cells where these would be wider [m]; 0: never */
  double size_tolerance;   /* largest difference between a pad's size and its geom's [m] */
  int taxels;
  char law[16], tangential[16];
  int cells, tilting, visual, output_count;
  int outputs[MJT_MOST_OUTPUTS];
  char error[1024];
  void* exception_type;   /* what interrupted Python's main thread, or null */
  void* exception;
} mjt_instance;

/* A warning, given once for every sensor, body and event. Events: 0 beyond the range of small strains, 1 not carried,
   2 approximated, 3 refused, 4 the pad was resized, 5 the body is behind the pad (see Event), 6 the model has
   other settings, 7 forces of flexes are not told. Body -1: a flex, or for events 4, 6 and 7 none. Pressure [Pa],
   indentation [m]. */
typedef struct mjt_note {
  int64_t context;
  int event, body;
  double pressure, indentation;
} mjt_note;

/* Functions of Python. During a step only `schedule` is called, which runs no Python code. */
typedef struct mjt_plugin_host {
  /* Interpret an instance's attributes. `model` null: only what the output's size depends on. 0 if the attributes are
     wrong, or if Python was interrupted; the instance then has the error, or the exception. */
  int (*resolve)(const void* model, int geom, const char* const* values, mjt_instance* instance);
  void (*release)(int64_t context);
  /* Have `deliver` called when Python runs next (Py_AddPendingCall). It fetches the warnings. */
  int (*schedule)(int (*deliver)(void*), void* argument);
  int (*deliver)(void* argument);
  /* Set the exception that Python raises (PyErr_SetObject). */
  void (*raise)(void* type, void* exception);
  /* Give back the reference to an exception (Py_DecRef). */
  void (*drop)(void* exception);
} mjt_plugin_host;

/* Names of the attributes, in the order their values reach `resolve`. */
MJT_API size_t mjt_plugin_attributes(const char* const** names);
/* Register the plugin with the running MuJoCo, once per process. Returns its slot, or -1 if the layout does not fit. */
MJT_API int mjt_plugin_register(const int64_t* layout, size_t layout_count, const void* const* functions,
                                size_t function_count, const mjt_plugin_host* host);
/* To be called before Python ends. From then on, no function of Python is called. */
MJT_API void mjt_plugin_leave(void);
/* Take the next warning. 0 if there is none. */
MJT_API int mjt_plugin_next_note(mjt_note* note);

/* Counts of one sensor in one simulation since it was made: readings with contact; contacts beyond the range, not
   carried, approximated, refused; readings by a pad whose geom was resized; contacts with the pad's back; readings that
   took over 1 ms, over 5 ms; and the longest [s]. Returns 0 if there is no such sensor. */
enum { MJT_HEALTH = 10 };
MJT_API int mjt_plugin_health(const void* data, int instance, double* health);

/* A pad of a model that is read without a sensor. Results: readings (taxels), stress (6, taxels), nodal forces (nodes
   y, nodes x, 3), wrench (6), carried wrench (6), and state (4): range [-], indentation [m], area under pressure [m^2],
   largest pressure [Pa]. Pointers of results that are not wanted are null. */
struct mjt_reader;
MJT_API mjt_reader* mjt_reader_new(const mjt_instance* instance, int geom);
MJT_API void mjt_reader_read(mjt_reader* reader, const void* model, const void* data, double* readings, double* stress,
                             double* forces, double* wrench, double* carried, double* state);
/* Edges of the areas under pressure in the last reading with nodal forces, which are on their left: both ends
   (edges, 2, 2) [m], pad frame. Returns their number; `ends` may be null. */
MJT_API size_t mjt_reader_rim(const mjt_reader* reader, double* ends);
MJT_API void mjt_reader_health(const mjt_reader* reader, double* health);
MJT_API void mjt_reader_free(mjt_reader* reader);
