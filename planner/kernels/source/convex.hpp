// Convex shapes, and distances of two of them that are proved by a plane between them.
//
// GJK suggests a direction; how far the supports of both shapes leave each other along it is a lower bound of their
// signed distance, whatever GJK did. A distance without such a proof counts for nothing.
#pragma once
#include "vectors.hpp"

constexpr double RELATIVE_ROUNDING = 1e-12;  // ROUNDING of planner/tolerances.py
constexpr double TOUCHING = 1e-8;   // difference of a distance and its proof up to which GJK has converged, m
constexpr double CONVERGED = 1e-9;  // the same at which it stops, m
constexpr int MOST_STEPS = 48;

struct Vec { double x, y, z; };
static inline Vec operator+(Vec a, Vec b) { return {a.x + b.x, a.y + b.y, a.z + b.z}; }
static inline Vec operator-(Vec a, Vec b) { return {a.x - b.x, a.y - b.y, a.z - b.z}; }
static inline Vec operator-(Vec a) { return {-a.x, -a.y, -a.z}; }
static inline Vec operator*(double s, Vec a) { return {s * a.x, s * a.y, s * a.z}; }
static inline double dot(Vec a, Vec b) { return a.x * b.x + a.y * b.y + a.z * b.z; }
static inline Vec cross(Vec a, Vec b) { return {a.y * b.z - a.z * b.y, a.z * b.x - a.x * b.z, a.x * b.y - a.y * b.x}; }
static inline double length(Vec a) { return sqrt(dot(a, a)); }
static inline double largest(double a, double b) { return a > b ? a : b; }
static inline double smallest(double a, double b) { return a < b ? a : b; }
static inline double clipped(double x, double low, double high) { return largest(low, smallest(x, high)); }
static inline double extent(Vec a) { return largest(fabs(a.x), largest(fabs(a.y), fabs(a.z))); }

// Where a joint is: a rotation, row by row, and an origin.
struct Frame {
    double r[9];
    Vec origin;
    Vec column(int k) const { return {r[k], r[3 + k], r[6 + k]}; }
    Vec turned(Vec v) const {
        return {r[0] * v.x + r[1] * v.y + r[2] * v.z, r[3] * v.x + r[4] * v.y + r[5] * v.z,
                r[6] * v.x + r[7] * v.y + r[8] * v.z};
    }
    Vec turned_back(Vec v) const {
        return {r[0] * v.x + r[3] * v.y + r[6] * v.z, r[1] * v.x + r[4] * v.y + r[7] * v.z,
                r[2] * v.x + r[5] * v.y + r[8] * v.z};
    }
    Vec placed(Vec v) const { return turned(v) + origin; }
};
constexpr Frame BASE{{1, 0, 0, 0, 1, 0, 0, 0, 1}, {0, 0, 0}};

// The hull of points, rolled over by a disc across an axis and by a ball; in the frame of its joint. Without points it is
// the ball about `start`. PIECE_NUMBERS of planner/kernels/clearance.py.
struct Piece {
    double joint, first, count, ball, disc;   // count: of points, a multiple of four
    Vec axis, start, end;                     // of the disc; ends of the axis of the bounding capsule
    double capsule, cover, extent, is_round;  // its radius, that of spheres that cover it, the largest coordinate of the
                                              // piece, and whether the piece is its capsule
};

// Points of all pieces: x, y and z of each.
struct Points { const double *x, *y, *z; };

// The largest d . x over the piece without its ball, and the point where it is; d in the frame of its joint.
static inline double reach(const Points& points, const Piece& piece, Vec d, Vec& at) {
    if (!(piece.count > 0.0)) { at = piece.start; return dot(d, at); }
    V best = splat(-INFINITY);
    VI where = {0, 0, 0, 0}, here = {0, 1, 2, 3};
    const int64_t first = (int64_t)piece.first, count = (int64_t)piece.count;
    for (int64_t i = first; i < first + count; i += W) {
        V x, y, z;
        memcpy(&x, points.x + i, sizeof x); memcpy(&y, points.y + i, sizeof y); memcpy(&z, points.z + i, sizeof z);
        const V value = x * splat(d.x) + y * splat(d.y) + z * splat(d.z);
        const VI more = value > best;
        best = select(more, value, best);
        where = (more & here) | (~more & where);
        here += W;
    }
    int lane = 0;
    for (int k = 1; k < W; k++) if (best[k] > best[lane]) lane = k;
    const int64_t row = first + where[lane];
    at = {points.x[row], points.y[row], points.z[row]};
    double value = best[lane];
    if (piece.disc > 0.0) {
        const Vec across = d - dot(d, piece.axis) * piece.axis;
        const double size = length(across);
        value += piece.disc * size;
        if (size > 0.0) at = at + (piece.disc / size) * across;
    }
    return value;
}

// How far a placed piece reaches along d of the base frame, whatever the length of d.
static inline double support(const Points& points, const Piece& piece, const Frame& frame, Vec d) {
    Vec at;
    return reach(points, piece, frame.turned_back(d), at) + dot(d, frame.origin) + piece.ball * length(d);
}

// The rounding of supports of two placed pieces.
static inline double rounding(const Piece& a, const Frame& fa, const Piece& b, const Frame& fb) {
    return RELATIVE_ROUNDING * (1.0 + extent(fa.origin) + a.extent + extent(fb.origin) + b.extent);
}

// How far two placed pieces leave each other along a unit vector from the first to the second, less rounding.
static inline double across(const Points& points, const Piece& a, const Frame& fa, const Piece& b, const Frame& fb, Vec n) {
    return -support(points, b, fb, -n) - support(points, a, fa, n) - rounding(a, fa, b, fb);
}

// The point of a simplex that is nearest to the origin, by all of its faces; the simplex becomes the face where it is.
// Returns how deep the origin is inside of a tetrahedron, or -1.
static inline double nearest(Vec* w, int& count, Vec& v) {
    constexpr double FLAT = 1e-14;  // square of a sine below which a face is left to its edges
    double least = INFINITY;
    int best = 0;
    for (int mask = 1; mask < 1 << count; mask++) {
        Vec c[4] = {};
        int k = 0;
        for (int i = 0; i < count; i++) if (mask >> i & 1) c[k++] = w[i];
        const Vec a = c[0], e = c[1] - a, f = c[2] - a, g = c[3] - a;
        Vec p = a;
        if (k == 2) {
            const double square = dot(e, e), t = -dot(a, e);
            if (!(t > 0.0 && t < square)) continue;
            p = a + (t / square) * e;
        } else if (k == 3) {
            const double ee = dot(e, e), ef = dot(e, f), ff = dot(f, f), ae = -dot(a, e), af = -dot(a, f);
            const double area = ee * ff - ef * ef;
            if (!(area > FLAT * ee * ff)) continue;
            const double s = (ff * ae - ef * af) / area, t = (ee * af - ef * ae) / area;
            if (!(s > 0.0 && t > 0.0 && s + t < 1.0)) continue;
            p = a + s * e + t * f;
        } else if (k == 4) {
            const double volume = dot(e, cross(f, g));
            if (!(volume * volume > FLAT * FLAT * dot(e, e) * dot(f, f) * dot(g, g))) continue;
            const double s = -dot(a, cross(f, g)) / volume, t = -dot(e, cross(a, g)) / volume,
                         u = -dot(e, cross(f, a)) / volume;
            if (!(s >= 0.0 && t >= 0.0 && u >= 0.0 && s + t + u <= 1.0)) continue;
            const double of_e = s / length(cross(f, g)), of_f = t / length(cross(e, g)), of_g = u / length(cross(e, f));
            const double of_a = (1.0 - s - t - u) / length(cross(f - e, g - e));
            return fabs(volume) * smallest(smallest(of_a, of_e), smallest(of_f, of_g));
        }
        const double square = dot(p, p);
        if (square < least) { least = square; best = mask; v = p; }
    }
    int k = 0;
    for (int i = 0; i < count; i++) if (best >> i & 1) w[k++] = w[i];
    count = k;
    return -1.0;
}

// How far two pieces are apart.
struct Apart {
    double proved, distance;  // a lower bound, rounding included; and an upper bound, infinite if none was found, m
    Vec normal;               // of the plane that proves it, from the first piece to the second
    bool is_known() const { return distance - proved <= TOUCHING; }
};

// The distance of two placed pieces by GJK, as soon as `enough` is proved; a guess of the normal, or zero.
static inline Apart separation(const Points& points, const Piece& a, const Frame& fa, const Piece& b, const Frame& fb,
                               Vec guess, double enough) {
    const double less = rounding(a, fa, b, fb), balls = a.ball + b.ball;
    Apart found{-INFINITY, INFINITY, {0.0, 0.0, 1.0}};
    Vec w[4] = {}, v = -guess;
    int count = 0;
    if (!(dot(v, v) > 0.0)) v = fa.placed(0.5 * (a.start + a.end)) - fb.placed(0.5 * (b.start + b.end));
    if (!(dot(v, v) > 0.0)) v = {0.0, 0.0, 1.0};
    for (int step = 0; step < MOST_STEPS; step++) {
        const double size = length(v);
        const Vec d = (1.0 / size) * v;
        Vec of_a, of_b;
        const double near = reach(points, a, fa.turned_back(-d), of_a) - dot(d, fa.origin),
                     far = reach(points, b, fb.turned_back(d), of_b) + dot(d, fb.origin);
        const double apart = -near - far;  // of the pieces without their balls, along d
        if (apart - balls - less > found.proved) { found.proved = apart - balls - less; found.normal = -d; }
        if (count) found.distance = smallest(found.distance, size - balls);
        if (found.proved >= enough || (count && size - apart <= CONVERGED)) break;
        const Vec s = fa.placed(of_a) - fb.placed(of_b);
        bool is_new = true;
        for (int i = 0; i < count; i++) is_new = is_new && dot(w[i] - s, w[i] - s) > 1e-24;
        if (!is_new) break;
        w[count++] = s;
        const double depth = nearest(w, count, v);  // both shapes overlap by more than a simplex inside of their difference
        if (depth >= 0.0) found.distance = -depth - balls;
        if (depth >= 0.0 || !(dot(v, v) > 1e-20)) break;
    }
    found.distance = largest(found.distance, found.proved);
    return found;
}

// A lower bound of the distance of two line segments, exact but where they nearly meet: the nearest points (Ericson,
// Real-Time Collision Detection, 5.1.9) suggest a direction, and the segments leave each other that far along it.
static inline double segment_distance(Vec a, Vec b, Vec c, Vec d) {
    constexpr double PARALLEL = 1e-12;  // squared sine below which two segments count as parallel
    const Vec u = b - a, v = d - c, r = a - c;
    const double uu = dot(u, u), vv = dot(v, v), uv = dot(u, v), ur = dot(u, r), vr = dot(v, r), area = uu * vv - uv * uv;
    double s = area > PARALLEL * uu * vv ? clipped((uv * vr - ur * vv) / area, 0.0, 1.0) : 0.0;
    const double t = vv > 0.0 ? clipped((uv * s + vr) / vv, 0.0, 1.0) : 0.0;
    if (uu > 0.0) s = clipped((uv * t - ur) / uu, 0.0, 1.0);
    const Vec way = r + s * u - t * v;
    const double size = length(way);
    if (!(size > 0.0)) return 0.0;
    const Vec n = (1.0 / size) * way;
    const double scale = 1.0 + extent(a) + extent(b) + extent(c) + extent(d);
    return smallest(dot(n, a), dot(n, b)) - largest(dot(n, c), dot(n, d)) - RELATIVE_ROUNDING * scale;
}

// The distance of a point from a line segment.
static inline double point_distance(Vec p, Vec a, Vec b) {
    const Vec u = b - a, r = p - a;
    const double square = dot(u, u);
    return length(r - (square > 0.0 ? clipped(dot(r, u) / square, 0.0, 1.0) : 0.0) * u);
}
