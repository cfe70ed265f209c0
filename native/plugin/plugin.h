/* The sensor plugin "mjtactile.pad" as Python registers it. */
#pragma once

#include <stddef.h>
#include <stdint.h>

#include "api.h"

/* Outputs of a sensor, in the order they were asked for. */
enum { MJT_VON_MISES = 0, MJT_STRESS = 1, MJT_WRENCH = 2, MJT_MOST_OUTPUTS = 3 };

/* What the attributes of one instance mean. */
typedef struct mjt_instance {
  const mjt_pad* pad;
  int64_t context;   /* of the host */
  double friction, tolerance;
  int taxels, layers, rows, columns;
  double pitch[2], centre[2]; /* of the taxels [m] */
  int law, cells, tilting, native, visual, output_count;
  int outputs[MJT_MOST_OUTPUTS];
  char error[1024];
} mjt_instance;

/* Python's part. `model` null: only what the output's size takes. 0 where the attributes are wrong, and the error. */
typedef struct mjt_plugin_host {
  int (*resolve)(const void* model, int geom, const char* const* values, mjt_instance* instance);
  void (*release)(int64_t context);
  mjt_host host;
} mjt_plugin_host;

/* Names of the attributes, in the order their values reach `resolve`. */
MJT_API size_t mjt_plugin_attributes(const char* const** names);
/* Register the plugin with the running MuJoCo; its slot, or -1. Once per process. */
MJT_API int mjt_plugin_register(const int64_t* layout, size_t layout_count, const void* const* functions,
                                size_t function_count, const mjt_plugin_host* host);
/* Python is about to end: what is destroyed from now on is not released there. */
MJT_API void mjt_plugin_leave(void);
