/* The core as C functions, for Python's ctypes. Arrays are C-contiguous, lengths in elements, units SI. Handles are
   opaque; what returns int returns 1 for success. */
#pragma once

#include <stddef.h>
#include <stdint.h>

#if defined(_WIN32)
#define MJT_API extern "C" __declspec(dllexport)
#else
#define MJT_API extern "C" __attribute__((visibility("default")))
#endif

struct mjt_pad;
struct mjt_outer;
struct mjt_body;

/* Incremented with every change of this file; Python refuses a library with another version. */
MJT_API int mjt_version(void);
MJT_API const char* mjt_kernels(void);
MJT_API int mjt_use_kernels(const char* name);
/* Whether there is a contact law, and a tangential choice, of these names. */
MJT_API int mjt_knows(const char* law, const char* tangential);

/* precision: 0 half, 1 single, 2 double, 3 bytes. corners: whether loads are spread onto the elements' corners. Signs:
   of the classes of the mirrors x -> -x and y -> -y that the pad has, (quadrants, classes). */
MJT_API mjt_pad* mjt_pad_new(int precision, int corners, size_t count_x, const double* ends_x, size_t count_y,
                             const double* ends_y, int mirror_x, int mirror_y, const double* quadrant_signs);
/* The outer surface of a curved pad: over a sheet (west, south, east, north) [m] the upper half of
   p x^2 + q y^2 + ((z + c) / c)^2 = 1, p and q in 1/m^2; or a patch by (z, dz/dx, dz/dy, d2z/dxdy) at the nodes of an
   even grid over it, (count_y, count_x, 4). */
MJT_API mjt_outer* mjt_outer_quadric(const double* sheet, double p, double q, double c);
MJT_API mjt_outer* mjt_outer_patch(const double* sheet, size_t count_x, size_t count_y, const double* jets);
MJT_API void mjt_outer_free(mjt_outer* outer);
/* Where a wrench (6) about the pad's origin presses on it, (3) [m], see centre_of_pressure; 0 where it presses nowhere. */
MJT_API int mjt_centre_of_pressure(const mjt_outer* outer, const double* wrench, double* centre);
/* The pad's outer surface, before anything is pressed on it. */
MJT_API void mjt_pad_set_outer(mjt_pad* pad, const mjt_outer* outer);
/* Mean pressure [Pa] and indentation [m] up to which strains are small, and the sheet's thickness [m]; the reading [Pa]
   at which taxels saturate, by sensing layer. */
MJT_API void mjt_pad_set_range(mjt_pad* pad, const double* range, const double* saturation);
/* Surface compliance: factor of the half space [1/Pa], ends of the splines' pieces [m], and the remainder, the sheet's
   compliance minus the half space's, (splines, splines) [m/N], see SurfaceCompliance. */
MJT_API void mjt_pad_set_compliance(mjt_pad* pad, double factor, size_t count_x, const double* ends_x, size_t count_y,
                                    const double* ends_y, const double* remainder);
/* Heat map of readings on the surface: tiles as position (3), rotation (9) and half sides (2) [m], (count, 14), and the
   reading that colours each. */
MJT_API void mjt_pad_set_tiles(mjt_pad* pad, size_t count, const double* tiles, const int32_t* readings);
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
                                   const double* inverse_distance, double* compliance);
/* Frictionless contact, see RigidContact; compliance (cells, cells), heights and start may be null. */
MJT_API int mjt_rigid_contact(size_t cells, size_t motions, const double* compliance, const double* modes,
                              const double* heights, const double* resultants, const uint8_t* start,
                              uint8_t* pressed, double* map_forces, double* map_motion, double* map_separation);

/* A body's geometry. */
MJT_API mjt_body* mjt_body_new(void);
/* Add a shape: kind 0 ellipsoid, 1 capsule, 2 cylinder, 3 box, 4 half space; size (3), pose in the body's frame (12). */
MJT_API void mjt_body_add_shape(mjt_body* body, int kind, const double* size, const double* pose);
/* Add a triangle mesh: vertices (count, 3), triangles (count, 3). */
MJT_API void mjt_body_add_mesh(mjt_body* body, const double* pose, size_t vertices, const float* points,
                               size_t triangles, const int32_t* corners);
MJT_API void mjt_body_free(mjt_body* body);
/* Heights of a body's lower surface between a floor and a ceiling over points (count, 2) of a sheet (west, south, east,
   north); infinite elsewhere. 0 where nothing of it is there. */
MJT_API int mjt_body_heights(const mjt_body* body, const double* pose, const double* sheet, double floor,
                             double ceiling, size_t count, const double* points, double* heights);
/* Nodal forces of a body pressed at a pose under a wrench (6), sunk in by so much [m]; 0 where it is refused. law and
   tangential: names that the core knows; strength: 0 for none. */
MJT_API int mjt_body_press(const mjt_pad* pad, const mjt_body* body, const double* pose, const double* wrench,
                           double sunk, const char* law, const char* tangential, int tilting, double friction, double strength,
                           double facing_gap, size_t cells, double* nodal_forces, double* carried);

/* Memory that wrench bases take in this process [bytes]. */
MJT_API size_t mjt_basis_bytes(void);

/* A rigid triangle mesh. */
struct mjt_mesh;
/* From vertices (count, 3) [m] and triangles (triangles, 3), as MuJoCo's model has them; see make_mesh. */
MJT_API mjt_mesh* mjt_mesh_new(size_t count, const float* vertices, size_t triangles, const int32_t* faces);
/* From heights (rows, columns); size (4), see make_height_field. */
MJT_API mjt_mesh* mjt_mesh_new_field(size_t rows, size_t columns, const double* size, const float* data);
/* Give a height field of as many rows and columns other heights or another size. */
MJT_API void mjt_mesh_set_heights(mjt_mesh* mesh, size_t rows, size_t columns, const double* size, const float* data);
MJT_API void mjt_mesh_free(mjt_mesh* mesh);
/* The data of a mesh: counts = (vertices, triangles, closed, triangles left out for corners that are not finite or do not
   exist); then vertices (count, 3) and triangles (triangles, 3), where they are not null. */
MJT_API void mjt_mesh_data(const mjt_mesh* mesh, size_t* counts, double* vertices, int32_t* faces);
/* Heights, not below a floor, of the lower side of a mesh at a pose over points (count, 2) of a part (west, south, east,
   north) of the pad; infinite without a mesh above. Lowest: the least height over the part (1), then the mesh's lowest
   vertex (3), wherever it is. */
MJT_API void mjt_mesh_heights(const mjt_mesh* mesh, const double* pose, const double* part, double floor, double reach,
                              size_t count, const double* points, double* heights, double* lowest);
/* Where it may touch first over the part, see TriangleShadow::bottoms: up to `most` points (most, 3); their number. */
MJT_API size_t mjt_mesh_bottoms(const mjt_mesh* mesh, const double* pose, const double* part, double floor,
                                double reach, size_t most, double* points);
/* Flat facets, see flat_facets: counts = (facets, loops, points); then planes (facets, 5): normal, offset, area; loops
   (loops, 2): facet, points; and points (points, 3), where they are not null. */
MJT_API void mjt_mesh_facets(const mjt_mesh* mesh, double gap, size_t* counts, double* planes, size_t* loops,
                             double* points);

/* Contact cells of an outline, see FaceCells: corners (corners, 2) of all rings, where each ring begins (rings + 1),
   squares along the axes turned by an angle [rad]. Null where there are none. */
struct mjt_cells;
MJT_API mjt_cells* mjt_face_cells(size_t rings, const size_t* begins, const double* corners, size_t count,
                                  double angle);
/* The same along the outline's own direction, shared by outlines that differ by a shift and a turn only; `place`: where
   the cells stand, x, y [m] and an angle [rad]. */
MJT_API mjt_cells* mjt_placed_cells(size_t rings, const size_t* begins, const double* corners, size_t count,
                                    double* place);
/* quadrature: (cells, 4, 2), points whose mean integrates quadratic functions over each cell.
   sizes: cells, edges, corners of the hulls of outline and centroids, whether it is convex. */
MJT_API void mjt_face_cells_sizes(const mjt_cells* cells, size_t* sizes);
MJT_API void mjt_face_cells_copy(const mjt_cells* cells, double* centroids, double* areas, double* inverse_distance,
                                 double* ends, int32_t* sides, double* corners, double* hull, double* quadrature,
                                 double* length);
MJT_API void mjt_face_cells_free(mjt_cells* cells);
/* An outline placed at (x, y, angle) and cut at a sheet (west, south, east, north), see clip_outline; into room for
   `room` corners. Number of rings, with where they begin (rings + 1), or -1 where the room is too small. */
MJT_API int mjt_clip_outline(size_t rings, const size_t* begins, const double* corners, const double* place,
                             const double* sheet, size_t room, size_t* cut_begins, double* cut_corners);
/* Additional data for shear: Poisson's ratio of the half space, and the remainder of all components,
   (3, splines, 3, splines) [m/N]. Set once, before any thread uses it. */
MJT_API void mjt_pad_set_tangential(mjt_pad* pad, double poisson, const double* remainder);
/* Integrals over pairs of cells of a half space's response, (6, cells, cells) [m^3], of 1/r and of ShearIntegrals; edges
   (count, 2 ends, 2) with cells on both sides (count, 2), -1 for none. */
MJT_API void mjt_half_space(size_t cells, size_t edges, const double* ends, const int32_t* sides, double* integrals);
/* Compliance (3, cells, 3, cells) [m/N] of cells that stand as they are given, see SurfaceCompliance::full; edges (count, 2 ends, 2) with cells
   on both sides (count, 2), -1 for none. */
MJT_API void mjt_full_compliance(const mjt_pad* pad, size_t cells, const double* centroids, const double* areas,
                                 const double* inverse_distance, size_t edges, const double* ends,
                                 const int32_t* sides, double angle, double* compliance);
/* Forces on cells (cells, 3) [N], see SurfaceShear. compliance as above, null for "proportional", needed
   for 1 (stick) and 2 (coulomb); heights may be null; frame = (middle x, y, length). Returns bits: 1 refused, 2 slides,
   4 simplified. */
MJT_API int mjt_surface_shear(size_t cells, const double* centroids, const double* pressing, const double* heights,
                              const double* frame, int tilting, const double* compliance, const double* wrench,
                              const char* tangential, double friction, double* forces);

/* A body's footprint, the part of it that faces the pad, without MuJoCo. */
struct mjt_footprint;
/* A flat face: contact cells where they stand at (x, y, angle); they may be freed before it. */
MJT_API mjt_footprint* mjt_footprint_flat(const mjt_cells* cells, const double* place);
/* A body by a function of its heights over points (count, 2) [m], infinite where it is not; it is called within bounds
   (west, south, east, north). */
typedef void (*mjt_heights)(size_t count, const double* points, double* heights);
MJT_API mjt_footprint* mjt_footprint_heights(mjt_heights heights, const double* bounds);
MJT_API void mjt_footprint_free(mjt_footprint* footprint);
/* Presses footprints on one pad, see mjt_body_press for the numbers; narrowest: width of the narrowest cells [m], 0 for
   the resolution of the pad's taxels. Use it in one thread at a time. */
struct mjt_press;
MJT_API mjt_press* mjt_press_new(const mjt_pad* pad, const char* law, const char* tangential, int tilting, double friction,
                                 size_t cells, double strength, double narrowest);
MJT_API void mjt_press_free(mjt_press* press);
/* What was found of one body. */
struct mjt_pressed {
  double indentation, slopes[2]; /* at the point it is asked for [m], its growth along x and y [-]; NaN: not known */
  double carried[6];            /* the part of the wrench that is carried [N, N m] */
  double area, peak, stick;     /* under pressure [m^2], largest pressure [Pa], where it does not slip [m^2] */
  int32_t refused;              /* nothing of it faces the pad, or its wrench does not press */
  int32_t approximated;         /* no solution of its law was found: the pressure is spread over the area that it needs */
  int32_t simplified;           /* none was found with its shear as asked for */
  int32_t cells, edges;         /* of the contact, and edges about what is under pressure; 0 where the law needs none */
};
/* Press bodies at once, each under a wrench (6); under law "uniform" and "foundation" they do not feel each other.
   points (count, 2): where the indentation is asked for; nodal forces (count, nodes y, nodes x, 3). */
MJT_API void mjt_press_bodies(mjt_press* press, size_t count, const mjt_footprint* const* footprints,
                              const double* wrenches, const double* points, double* nodal_forces,
                              mjt_pressed* pressed);
/* Cells of one body (cells): centroids (2), areas, forces (3), heights of the body above each [m], pad frame; null for what is not wanted. */
MJT_API void mjt_press_cells(const mjt_press* press, size_t body, double* centroids, double* areas, double* forces,
                             double* heights);
/* Edges of the cells of one body, each once, (edges, 2 ends, 2) [m], and the cells to their left and right, (edges, 2), -1
   for none; null to ask for their number alone. */
MJT_API size_t mjt_press_edges(const mjt_press* press, size_t body, double* ends, int32_t* sides);
/* Edges about what is under pressure of one body, that on their left (edges, 2 ends, 2) [m]. */
MJT_API void mjt_press_rim(const mjt_press* press, size_t body, double* ends);
/* Nodal forces of the parts whose sums the loads of one body are while the same cells are pressed and no friction bounds
   them, (parts, nodes y, nodes x, 3), null to ask for their number alone; 0 where there are none. */
MJT_API size_t mjt_press_parts(mjt_press* press, size_t body, double* nodal_forces);
/* Weights of the parts asked for last under another wrench; 0 where they do not make it up. */
MJT_API int mjt_press_weights(mjt_press* press, const double* wrench, double* weights);
