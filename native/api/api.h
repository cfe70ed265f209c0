/* The core as C functions, for Python's ctypes. Arrays are C-contiguous, and lengths count elements. Units are SI,
   coordinates are in the pad frame. Functions that return int return 1 for success and 0 for failure, if nothing else
   is said. The caller owns all arrays. A handle belongs to the caller until it is passed to its _free function;
   functions that make one return null on failure. */
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
/* Name of the set of kernels in use, and choice of another set. 0 if the processor does not have it. */
MJT_API const char* mjt_kernels(void);
MJT_API int mjt_use_kernels(const char* name);
/* Whether there are a contact law and a tangential choice with these names. */
MJT_API int mjt_knows(const char* law, const char* tangential);

/* A pad without matrices. precision: the widest of its layers', 0 half, 1 single, 2 double, 3 bytes. corners: whether
   loads are replaced by forces on the elements' corners. ends: coordinates of the element boundaries [m]. mirror:
   whether the pad is symmetric under x -> -x and y -> -y. image_signs (images, classes): see
   Pad::set_mirrors. */
MJT_API mjt_pad* mjt_pad_new(int precision, int corners, size_t count_x, const double* ends_x, size_t count_y,
                             const double* ends_y, int mirror_x, int mirror_y, const double* image_signs);
/* The outer surface of a curved pad over a sheet (west, south, east, north) [m]. It is the upper half of
   p x^2 + q y^2 + ((z + c) / c)^2 = 1, with p and q in 1/m^2; or a patch given by (z, dz/dx, dz/dy, d2z/dxdy) at the
   nodes of an even grid over the sheet, (count_y, count_x, 4). */
MJT_API mjt_outer* mjt_outer_quadric(const double* sheet, double p, double q, double c);
MJT_API mjt_outer* mjt_outer_patch(const double* sheet, size_t count_x, size_t count_y, const double* jets);
MJT_API void mjt_outer_free(mjt_outer* outer);
/* The point (3) [m] at which a wrench (6) about the pad's origin presses on the surface, see centre_of_pressure. 0 if
   the wrench does not press. */
MJT_API int mjt_centre_of_pressure(const mjt_outer* outer, const double* wrench, double* centre);
/* Set the pad's outer surface, before anything is pressed on it. */
MJT_API void mjt_pad_set_outer(mjt_pad* pad, const mjt_outer* outer);
/* Set the range of small strains and the saturation. range (3): largest mean pressure [Pa] and indentation [m], and the
   sheet's thickness [m]. saturation: reading at which taxels saturate, by sensing layer [Pa]. */
MJT_API void mjt_pad_set_range(mjt_pad* pad, const double* range, const double* saturation);
/* Set the surface compliance, see SurfaceCompliance: factor of the half space [1/Pa], ends of the splines' pieces [m],
   and remainder (splines, splines) [m/N], which is the sheet's compliance minus the half space's. */
MJT_API void mjt_pad_set_compliance(mjt_pad* pad, double factor, size_t count_x, const double* ends_x, size_t count_y,
                                    const double* ends_y, const double* remainder);
/* Set the additional data for shear: Poisson's ratio of the half space, and the remainder of all components
   (3, splines, 3, splines) [m/N]. To be called once, before any thread uses the pad. */
MJT_API void mjt_pad_set_tangential(mjt_pad* pad, double poisson, const double* remainder);
/* Set the heat map of readings on the surface: tiles (count, 14) of position (3), rotation (9) and half sides (2) [m],
   and the number of the reading that colours each. */
MJT_API void mjt_pad_set_tiles(mjt_pad* pad, size_t count, const double* tiles, const int32_t* readings);
/* Add a sensing layer, see AveragingRows, whose matrices have a precision; then set the matrices of every symmetry
   class, see Pad::set_class. */
MJT_API void mjt_pad_add_layer(mjt_pad* pad, int precision, size_t points, size_t taxels, const int32_t* starts,
                               const int32_t* places, const double* weights);
MJT_API void mjt_pad_set_class(mjt_pad* pad, int symmetry_class, size_t columns, const int32_t* column_of,
                               const double* signs, const size_t* ranks, const double* const* left,
                               const double* const* right, int mean);
/* Set the springs of law "foundation": logarithms of areas [m^2] and of stiffnesses per area [Pa/m]. */
MJT_API void mjt_pad_set_foundation(mjt_pad* pad, size_t count, const double* areas, const double* stiffnesses);
MJT_API void mjt_pad_free(mjt_pad* pad);

/* Readings (taxels) [Pa] under nodal forces (nodes y, nodes x, 3) [N]. */
MJT_API void mjt_readings(const mjt_pad* pad, const double* forces, double* readings);
/* Nodal forces of tractions, see SurfaceGrid::traction_forces. edges (count, 2 ends, 2) [m]; tractions (count, 3): on
   their left minus on their right [Pa]. */
MJT_API void mjt_traction_forces(size_t count_x, const double* ends_x, size_t count_y, const double* ends_y,
                                 size_t count, const double* edges, const double* tractions, double* forces);
/* Integrals of every shape function times 1, x and y over a polygon (nodes y, nodes x, 3) [m^2, m^3, m^3], see
   LinearTraction::nodal_forces. edges (count, 2 ends, 2) [m], with the polygon on their left. */
MJT_API void mjt_nodal_integrals(size_t count_x, const double* ends_x, size_t count_y, const double* ends_y,
                                 size_t count, const double* edges, double* integrals);

/* A body's geometry. */
MJT_API mjt_body* mjt_body_new(void);
/* Add a shape: kind 0 ellipsoid, 1 capsule, 2 cylinder, 3 box, 4 half space; size (3), pose in the body's frame (12).
   */
MJT_API void mjt_body_add_shape(mjt_body* body, int kind, const double* size, const double* pose);
/* Add a triangle mesh: vertices (count, 3), triangles (count, 3). */
MJT_API void mjt_body_add_mesh(mjt_body* body, const double* pose, size_t vertices, const float* points,
                               size_t triangles, const int32_t* corners);
MJT_API void mjt_body_free(mjt_body* body);
/* Heights of a body's lower surface between a floor and a ceiling, over points (count, 2) of a sheet (west, south,
   east, north) [m]; infinite elsewhere. 0 if no part of the body is there. */
MJT_API int mjt_body_heights(const mjt_body* body, const double* pose, const double* sheet, double floor,
                             double ceiling, size_t count, const double* points, double* heights);

/* Memory of all wrench bases in this process [bytes]. */
MJT_API size_t mjt_basis_bytes(void);

struct mjt_cells;
/* Contact cells of an outline along its own direction, see placed_cells: corners (corners, 2) of all rings, index at
   which each ring begins (rings + 1). Outlines that differ by a rigid motion only share their cells. widest: see
   CellCount. place (3): placement of the cells, x, y [m] and angle [rad]. Null if the outline has no cells. */
MJT_API mjt_cells* mjt_placed_cells(size_t rings, const size_t* begins, const double* corners, size_t count,
                                    double widest, double* place);
MJT_API void mjt_face_cells_free(mjt_cells* cells);
/* Integrals of a half space's response over pairs of cells (6, cells, cells) [m^3]: of 1/r and of ShearIntegrals. edges
   (count, 2 ends, 2) [m], with the cells on their left and right (count, 2), -1 for none. */
MJT_API void mjt_half_space(size_t cells, size_t edges, const double* ends, const int32_t* sides, double* integrals);

/* A body's footprint: the part of it that faces the pad, given without MuJoCo. */
struct mjt_footprint;
/* A flat face: contact cells placed at (x, y, angle). The cells may be freed before the footprint. */
MJT_API mjt_footprint* mjt_footprint_flat(const mjt_cells* cells, const double* place);
/* A body given by a function of its heights over points (count, 2) [m], infinite where there is no body. The body is
   within the bounds (west, south, east, north). The function must stay valid until the footprint is freed. */
typedef void (*mjt_heights)(size_t count, const double* points, double* heights);
MJT_API mjt_footprint* mjt_footprint_heights(mjt_heights heights, const double* bounds);
MJT_API void mjt_footprint_free(mjt_footprint* footprint);
/* Presses footprints on one pad. The options are those of mjt_body_press. narrowest: width of the narrowest cells [m],
   0 for the resolution of the pad's taxels. Use it in one thread at a time. */
struct mjt_press;
MJT_API mjt_press* mjt_press_new(const mjt_pad* pad, const char* law, const char* tangential, int tilting,
                                 double friction, size_t cells, double strength, double narrowest);
MJT_API void mjt_press_free(mjt_press* press);
/* The solution for one body. */
struct mjt_pressed {
  double indentation, slopes[2]; /* at the given point [m], and its growth along x and y [-]; NaN: not known */
  double carried[6];            /* the part of the wrench that is carried [N, N m] */
  double area, peak, stick;     /* area under pressure [m^2], largest pressure [Pa], area that does not slip [m^2] */
  int32_t refused;              /* no part of it faces the pad, or its wrench does not press */
  int32_t approximated;         /* no contact of its law was found; a simpler pressure carries the force */
  int32_t simplified;           /* no shear as asked for was found; a simpler one is used */
  int32_t cells, edges;         /* numbers of contact cells, and of edges around the pressed area; 0 without cells */
};
/* Press several bodies together, each under a wrench (6). Under laws "uniform" and "foundation" they do not influence
   each other. points (count, 2): where the indentation is wanted [m]. nodal forces: (count, nodes y, nodes x, 3) [N].
   The functions below give results of the last call. */
MJT_API void mjt_press_bodies(mjt_press* press, size_t count, const mjt_footprint* const* footprints,
                              const double* wrenches, const double* points, double* nodal_forces,
                              mjt_pressed* pressed);
/* Edges around the area under pressure of one body, which is on their left (edges, 2 ends, 2) [m]. */
MJT_API void mjt_press_rim(const mjt_press* press, size_t body, double* ends);
/* Nodal forces of the parts of a linear contact (parts, nodes y, nodes x, 3) [N], see CellContact::parts. Returns their
   number; `nodal_forces` may be null if only that is wanted. 0 if the body's load is no sum of such parts: if shear is
   bounded by friction or sticks, or the contact is not that of a whole flat face. */
MJT_API size_t mjt_press_parts(mjt_press* press, size_t body, double* nodal_forces);
/* Weights, under another wrench, of the parts of the last mjt_press_parts. 0 if other cells would press under it. */
MJT_API int mjt_press_weights(mjt_press* press, const double* wrench, double* weights);

/* What follows are parts of the core that Python calls in tests alone. */

/* Nodal forces of a body that presses at a pose under a wrench (6). sunk: its overlap with the pad [m]. law and
   tangential: names for which mjt_knows is true. The other numbers are those of LawOptions. 0 if it is refused. */
MJT_API int mjt_body_press(const mjt_pad* pad, const mjt_body* body, const double* pose, const double* wrench,
                           double sunk, const char* law, const char* tangential, int tilting, double friction,
                           double strength, double facing_gap, size_t cells, double* nodal_forces, double* carried);
/* Forces on cells [N] in a frictionless contact, see RigidContact. compliance: (cells, cells). 0 if none is found. */
MJT_API int mjt_rigid_contact(size_t cells, size_t motions, const double* compliance, const double* modes,
                              const double* heights, const double* resultants, double* forces);
/* Forces on cells (cells, 3) [N], see SurfaceShear. compliance (3, cells, 3, cells) [m/N]: needed for "stick" and
   "coulomb", null for "proportional". heights may be null. frame = (middle x, y, length) [m]. Returns bits: 1 refused,
   2 slides, 4 simplified. */
MJT_API int mjt_surface_shear(size_t cells, const double* centroids, const double* pressing, const double* heights,
                              const double* frame, int tilting, const double* compliance, const double* wrench,
                              const char* tangential, double friction, double* forces);
/* Cells of one body in the last mjt_press_bodies: centroids (cells, 2) [m], areas [m^2], forces (cells, 3) [N], heights
   of the body above each [m]. Arrays that are not wanted are null. */
MJT_API void mjt_press_cells(const mjt_press* press, size_t body, double* centroids, double* areas, double* forces,
                             double* heights);
/* Edges of these cells, each once (edges, 2 ends, 2) [m], and the cells on their left and right (edges, 2), -1 for
   none. Returns their number; `ends` may be null if only that is wanted. */
MJT_API size_t mjt_press_edges(const mjt_press* press, size_t body, double* ends, int32_t* sides);
/* Contact cells as mjt_placed_cells has them, but of squares along the axes turned by an angle [rad], see FaceCells. */
MJT_API mjt_cells* mjt_face_cells(size_t rings, const size_t* begins, const double* corners, size_t count,
                                  double angle);
/* The data of cells, see Face. sizes (5): numbers of cells, edges, corners of the outline's hull and of the centroids'
   hull, and whether the outline is convex. quadrature: (cells, 4, 2). If `centroids` is null, only sizes are set. */
MJT_API void mjt_face_cells_copy(const mjt_cells* cells, size_t* sizes, double* centroids, double* areas,
                                 double* inverse_distance, double* ends, int32_t* sides, double* corners, double* hull,
                                 double* quadrature, double* length);
/* An outline placed at (x, y, angle) and clipped at a sheet (west, south, east, north), see clip_outline. cut_corners
   has room for `room` corners. Returns the number of rings, or -1 if the room is too small. cut_begins: index at which
   each ring begins (rings + 1). */
MJT_API int mjt_clip_outline(size_t rings, const size_t* begins, const double* corners, const double* place,
                             const double* sheet, size_t room, size_t* cut_begins, double* cut_corners);

/* A rigid triangle mesh. */
struct mjt_mesh;
/* From vertices (count, 3) [m] and triangles (triangles, 3), as MuJoCo's model has them; see make_mesh. */
MJT_API mjt_mesh* mjt_mesh_new(size_t count, const float* vertices, size_t triangles, const int32_t* faces);
/* From a height field (rows, columns); size (4), see make_height_field. */
MJT_API mjt_mesh* mjt_mesh_new_field(size_t rows, size_t columns, const double* size, const float* data);
MJT_API void mjt_mesh_free(mjt_mesh* mesh);
/* The data of a mesh: counts = (vertices, triangles, closed, facets, loops, points); vertices (count, 3) and triangles
   (triangles, 3). Its flat facets with a gap, see flat_facets: planes (facets, 5) of normal, offset and area; loops
   (loops, 2) of facet and number of points; points (points, 3). If `vertices` is null, only counts are set. */
MJT_API void mjt_mesh_data(const mjt_mesh* mesh, double gap, size_t* counts, double* vertices, int32_t* faces,
                           double* planes, size_t* loops, double* points);
/* The lower side of a mesh at a pose over a part (west, south, east, north) of the pad, not below a floor, see
   TriangleShadow: heights over points (count, 2), infinite if there is no mesh above [m]; and the least height over the
   part. Writes up to `most` points where the mesh may touch first (most, 3) [m], and returns how many there are; 0 if
   `most` is. */
MJT_API size_t mjt_mesh_shadow(const mjt_mesh* mesh, const double* pose, const double* part, double floor,
                               double reach, size_t count, const double* points, double* heights, double* lowest,
                               size_t most, double* bottoms);
