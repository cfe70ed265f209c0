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

/* Raised with every change of this file; Python refuses a library of another. */
MJT_API int mjt_version(void);
MJT_API const char* mjt_kernels(void);
MJT_API int mjt_use_kernels(const char* name);

/* precision: 0 half, 1 single, 2 double. Spline coefficients: (3, patches, patches). */
MJT_API mjt_pad* mjt_pad_new(int precision, double thickness, size_t count_x, const double* ends_x, size_t count_y,
                             const double* ends_y, double factor, size_t patches_x, const double* patch_ends_x,
                             const double* spline_x, size_t patches_y, const double* patch_ends_y,
                             const double* spline_y, const double* remainder, const double* quadrant_signs);
MJT_API void mjt_pad_add_layer(mjt_pad* pad, size_t points, size_t taxels, const int32_t* starts,
                               const int32_t* places, const double* weights);
MJT_API void mjt_pad_set_class(mjt_pad* pad, int symmetry_class, size_t columns, const int32_t* column_of,
                               const double* signs, const size_t* ranks, const double* const* left,
                               const double* const* right);
MJT_API void mjt_pad_free(mjt_pad* pad);
MJT_API size_t mjt_pad_bytes(const mjt_pad* pad);
MJT_API size_t mjt_pad_response_size(const mjt_pad* pad);

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
