/* The core as C functions, for Python's ctypes. Arrays are C-contiguous, lengths in elements, units SI. Handles are
   opaque; what returns int returns 1 for success and 0 where the readable reference has to take over. */
#pragma once

#include <stddef.h>
#include <stdint.h>

#if defined(_WIN32)
#define MJT_API extern "C" __declspec(dllexport)
#else
#define MJT_API extern "C" __attribute__((visibility("default")))
#endif

struct mjt_pad;
struct mjt_face;
struct mjt_body;

/* The slower ways, in Python. Pose: position (3) and rotation (9, row-major) of the body in the pad frame. */
typedef struct mjt_host {
  /* A body's geometry, or null where only Python presses it. */
  mjt_body* (*body)(int64_t context, int body);
  /* One of its faces, by number, or null. */
  mjt_face* (*face)(int64_t context, int body, int number);
  /* The part of it over the sheet, when it stands at place = (x, y, angle), or null. */
  mjt_face* (*cut_face)(int64_t context, int body, int number, const double* place);
  /* Nodal forces of one body's contact; 0 where there is none. */
  int (*nodal_forces)(int64_t context, int body, const double* pose, const double* wrench, double* forces);
  /* Called once per sensor when a contact leaves the range of small strains. */
  void (*beyond_range)(int64_t context, int body, double pressure, double approach);
  /* Called once per sensor when a force passes beside what it presses through. */
  void (*not_carried)(int64_t context, int body, const double* wrench);
} mjt_host;

/* Raised with every change of this file; Python refuses a library of another. */
MJT_API int mjt_version(void);
MJT_API const char* mjt_kernels(void);
MJT_API int mjt_use_kernels(const char* name);

/* precision: 0 half, 1 single, 2 double, 3 bytes. corners: whether loads are spread onto the elements' corners. range:
   mean pressure [Pa] and indentation [m] up to which strains are small. Spline coefficients: (3, patches, patches). */
MJT_API mjt_pad* mjt_pad_new(int precision, int corners, const double* range, size_t count_x, const double* ends_x,
                             size_t count_y, const double* ends_y, double factor, size_t patches_x,
                             const double* patch_ends_x, const double* spline_x, size_t patches_y,
                             const double* patch_ends_y, const double* spline_y, const double* remainder,
                             const double* quadrant_signs);
MJT_API void mjt_pad_add_layer(mjt_pad* pad, size_t points, size_t taxels, const int32_t* starts,
                               const int32_t* places, const double* weights);
MJT_API void mjt_pad_set_class(mjt_pad* pad, int symmetry_class, size_t columns, const int32_t* column_of,
                               const double* signs, const size_t* ranks, const double* const* left,
                               const double* const* right, int mean);
/* Springs of law "foundation": logarithms of areas [m^2] and of stiffnesses per area [Pa/m]. */
MJT_API void mjt_pad_set_foundation(mjt_pad* pad, size_t count, const double* areas, const double* stiffnesses);
MJT_API void mjt_pad_free(mjt_pad* pad);
MJT_API size_t mjt_pad_bytes(const mjt_pad* pad);

/* Readings (taxels) [Pa] of nodal forces (nodes y, nodes x, 3) [N]. */
MJT_API void mjt_readings(const mjt_pad* pad, const double* forces, double* readings);
/* Nodal forces of tractions; edges (count, 2 ends, 2) [m], tractions (count, 3) [Pa]. */
MJT_API void mjt_traction_forces(size_t count_x, const double* ends_x, size_t count_y, const double* ends_y,
                                 size_t count, const double* edges, const double* tractions, double* forces);
/* Normal compliance (cells, cells) [m/N], see SurfaceCompliance::normal; symmetric, whole. */
MJT_API void mjt_normal_compliance(const mjt_pad* pad, size_t cells, const double* centroids, const double* areas,
                                   const double* inverse_distance, double scale, double* compliance);
/* Frictionless contact, see RigidContact; compliance (cells, cells), heights and start may be null. */
MJT_API int mjt_rigid_contact(size_t cells, size_t motions, const double* compliance, const double* modes,
                              const double* heights, const double* resultants, const uint8_t* start,
                              uint8_t* pressed, double* map_forces, double* map_motion, double* map_separation);

/* A face as contact cells in its own frame: rotation (9) from the body's frame to it; centroids (cells, 2), areas
   (cells), inverse_distance (cells, cells), edges (count, 2 ends, 2) with cells on both sides (count, 2), -1 for none;
   corners (count, 2) of its outline. */
MJT_API mjt_face* mjt_face_new(const double* rotation, double height, double most_slope, size_t cells,
                               const double* centroids, const double* areas, const double* inverse_distance,
                               size_t edges, const double* ends, const int32_t* sides, size_t corners,
                               const double* outline, int cut);
MJT_API void mjt_face_free(mjt_face* face);
/* Nodal forces of one face pressed at a pose; 0 where the reference has to take over. law: 0 elastic, 1 foundation,
   2 uniform. */
MJT_API int mjt_face_press(const mjt_pad* pad, const mjt_face* face, const double* pose, const double* wrench, int law,
                           int tilting, double friction, size_t cells, double* nodal_forces);

/* A body's geometry: limits = (depth, reach, facing gap); facing (faces, 3), see BodyGeometry. */
MJT_API mjt_body* mjt_body_new(const double* limits, size_t faces, const double* facing);
/* Add a shape: kind 0 ellipsoid, 1 capsule, 2 cylinder, 3 box, 4 half space; size (3), pose in the body's frame (12). */
MJT_API void mjt_body_add_shape(mjt_body* body, int kind, const double* size, const double* pose);
/* Add a triangle mesh: vertices (count, 3), triangles (count, 3). */
MJT_API void mjt_body_add_mesh(mjt_body* body, const double* pose, size_t vertices, const double* points,
                               size_t triangles, const int32_t* corners, int closed);
MJT_API void mjt_body_free(mjt_body* body);
/* Heights of a body's lower surface over points (count, 2) of a sheet (west, south, east, north), over its lowest;
   infinite out of reach. 0 where nothing of it is over the sheet. */
MJT_API int mjt_body_heights(const mjt_body* body, const double* pose, const double* sheet, size_t count,
                             const double* points, double* heights);
/* Nodal forces of a curved body pressed at a pose, looked for within region = (x, y, angle, width, height), or where it
   is null within what the body covers; 0 where the reference has to take over. */
MJT_API int mjt_body_press(const mjt_pad* pad, const mjt_body* body, const double* pose, const double* wrench, int law,
                           int tilting, double friction, size_t cells, const double* region, double* nodal_forces);

/* Memory that wrench bases take in this process [bytes]. */
MJT_API size_t mjt_basis_bytes(void);
