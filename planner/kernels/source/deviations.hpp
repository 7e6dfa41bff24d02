// How far the tool is from a requested path on four intervals, as Taylor models. A parameter of the path is chosen for every
// time; whichever it is, the tool is no farther from the path than from the pose there.
#pragma once
#include "enclosures.hpp"
#include "hulls.hpp"

// A serial chain, and the tool in the frame of the last of the joints that move it: its point, and its axes behind each other.
struct ToolChain { int64_t joints, tool_joints; const double *links, *load, *tool, *axes; };

constexpr int POWERS = 5;  // highest power of u in the polynomials of a path

struct ToolPath {  // PATH_NUMBERS of planner/kernels/bounded_peaks.py
    double angle, degree, start[9], turns[POWERS][3], origin[3], along[POWERS][3], middle[3], radius, tolerances[2], left_out[2][4];
};
// The parts of the paths of a piece of a motion: `count` of them from the first on.
struct PartsOfPath { int64_t first, count; };

static inline Taylor scaled(V by, const Taylor& a) {
    Taylor s;
    for (int k = 0; k < TERMS; k++) s.c[k] = by * a.c[k];
    s.size = magnitude(by) * a.size;
    s.rest = magnitude(by) * a.rest + splat(UNIT) * s.size;
    return s;
}
static inline Taylor constant(V value) {
    Taylor t{};
    t.c[0] = value;
    t.size = magnitude(value);
    return t;
}
static inline Vector<Taylor> constant(const V3& v) { return {constant(v.x), constant(v.y), constant(v.z)}; }
static inline Vector<Taylor> times(const Taylor& by, const V3& v) { return {scaled(v.x, by), scaled(v.y, by), scaled(v.z, by)}; }
static inline Taylor dot(const Vector<Taylor>& a, const Vector<Taylor>& b) { return a.x * b.x + a.y * b.y + a.z * b.z; }
static inline Taylor dot(const V3& a, const Vector<Taylor>& b) { return scaled(a.x, b.x) + scaled(a.y, b.y) + scaled(a.z, b.z); }
static inline V dot(const V3& a, const V3& b) { return a.x * b.x + a.y * b.y + a.z * b.z; }
// A path and its geometry at single parameters.
struct PathPoint {
    static constexpr int MOST_STEPS = 12;  // Newton steps towards the nearest point of a part
    static constexpr double FOUND = 1e-7;  // the last step but one as a share of the part: steps converge quadratically
    const ToolPath& path;
    static void polynomial(const double (*by_power)[3], int degree, double u, double* value, double* slope, double* bend) {
        for (int i = 0; i < 3; i++) {
            value[i] = slope[i] = bend[i] = 0.0;
            for (int k = degree - 1; k >= 0; k--) {
                bend[i] = bend[i] * u + slope[i];
                slope[i] = slope[i] * u + value[i];
                value[i] = value[i] * u + by_power[k][i];
            }
            bend[i] = 2.0 * (bend[i] * u + slope[i]);  // of u times this polynomial
            slope[i] = slope[i] * u + value[i];
            value[i] *= u;
        }
    }
    int degree() const { return (int)path.degree; }
    void position(double u, double* p, double* slope, double* bend) const {
        if (path.angle != 0.0) {
            const double c = cos(path.angle * u), s = sin(path.angle * u);
            for (int i = 0; i < 3; i++) {
                p[i] = c * path.along[0][i] + s * path.along[1][i];
                slope[i] = path.angle * (c * path.along[1][i] - s * path.along[0][i]);
                bend[i] = -path.angle * path.angle * p[i];
            }
        } else polynomial(path.along, degree(), u, p, slope, bend);
        for (int i = 0; i < 3; i++) p[i] += path.origin[i];
    }
    // The turn of the tool (3) that is left at u, in its axes, from its axes (9, one behind the other), and their slope.
    void turn(double u, const double* axes, double* left, double* slope) const {
        double v[3], bend[3], squared = 0.0;
        polynomial(path.turns, degree(), u, v, slope, bend);
        for (int i = 0; i < 3; i++) squared += v[i] * v[i];
        const double angle = sqrt(squared), s = angle > 1e-4 ? sin(angle) / angle : 1.0 - squared / 6.0;
        const double c = angle > 1e-4 ? (1.0 - cos(angle)) / squared : 0.5 - squared / 24.0;
        double e[3][3];
        for (int k = 0; k < 3; k++) {
            const double* a = axes + 3 * k;
            double b[3], once[3], twice[3];
            for (int i = 0; i < 3; i++) b[i] = path.start[i] * a[0] + path.start[3 + i] * a[1] + path.start[6 + i] * a[2];
            for (int i = 0; i < 3; i++) once[i] = v[(i + 1) % 3] * b[(i + 2) % 3] - v[(i + 2) % 3] * b[(i + 1) % 3];
            for (int i = 0; i < 3; i++) twice[i] = v[(i + 1) % 3] * once[(i + 2) % 3] - v[(i + 2) % 3] * once[(i + 1) % 3];
            for (int i = 0; i < 3; i++) e[k][i] = b[i] - s * once[i] + c * twice[i];
        }
        for (int i = 0; i < 3; i++) left[i] = 0.5 * (e[(i + 1) % 3][(i + 2) % 3] - e[(i + 2) % 3][(i + 1) % 3]);
        const double sine = sqrt(left[0] * left[0] + left[1] * left[1] + left[2] * left[2]);
        const double whole = atan2(sine, 0.5 * (e[0][0] + e[1][1] + e[2][2] - 1.0));
        for (int i = 0; i < 3; i++) left[i] *= sine > 0.0 ? whole / sine : 1.0;
    }
    bool turns() const { return path.tolerances[1] < INFINITY; }

    // The parameter that is nearest to a pose by the tolerances, and the distances from there.
    double nearest(const double* p, const double* axes, double* away) const {
        const int steps = degree() > 2 ? MOST_STEPS : 3;
        double x = 0.0, y = 0.0, xx = 0.0, u = 0.5;
        bool is_found = false;
        for (int i = 0; i < 3; i++) {
            x += (p[i] - path.origin[i]) * path.along[0][i];
            y += (p[i] - path.origin[i]) * path.along[1][i];
            xx += path.along[0][i] * path.along[0][i];
        }
        if (path.angle != 0.0) {
            const double angle = fmod(atan2(y, x) + 2.0 * M_PI, 2.0 * M_PI);
            u = angle <= path.angle ? angle / path.angle : angle < 0.5 * path.angle + M_PI ? 1.0 : 0.0;
        } else if (degree() > 2) {
            x = xx = 0.0;
            for (int i = 0; i < 3; i++) {
                double chord = 0.0;
                for (int k = 0; k < degree(); k++) chord += path.along[k][i];
                x += (p[i] - path.origin[i]) * chord;
                xx += chord * chord;
            }
            u = xx > 0.0 ? fmin(fmax(x / xx, 0.0), 1.0) : 0.5;
        } else if (xx > 0.0) u = fmin(fmax(x / xx, 0.0), 1.0);
        for (int step = 0;; step++) {
            double at[3], slope[3], bend[3], turned[3] = {}, turning[3], along = 0.0, squared = 0.0, curved = 0.0;
            position(u, at, slope, bend);
            away[0] = away[1] = 0.0;
            for (int i = 0; i < 3; i++) {
                away[0] += (p[i] - at[i]) * (p[i] - at[i]);
                along += (p[i] - at[i]) * slope[i] * weight(0);
                squared += slope[i] * slope[i] * weight(0);
                curved += (p[i] - at[i]) * bend[i] * weight(0);
            }
            if (turns()) {
                turn(u, axes, turned, turning);
                for (int i = 0; i < 3; i++) {
                    away[1] += turned[i] * turned[i];
                    along += turned[i] * turning[i] * weight(1);
                    squared += turning[i] * turning[i] * weight(1);
                }
            }
            // Newton's step where the distance is convex, for the tool may be far away.
            const double before = u, by = degree() > 2 && curved < 0.9 * squared ? squared - curved : squared;
            if (step == steps || is_found || !(squared > 0.0)) break;
            u = fmin(fmax(u + along / by, 0.0), 1.0);
            is_found = degree() > 2 && fabs(u - before) < FOUND;
        }
        for (int k = 0; k < 2; k++) away[k] = sqrt(away[k]);
        return u;
    }
    double weight(int k) const { return 1.0 / (path.tolerances[k] * path.tolerances[k]); }
    double score(const double* away) const { return away[0] * away[0] * weight(0) + away[1] * away[1] * weight(1); }
    double squared_from_middle(const double* p) const {
        double far = 0.0;
        for (int i = 0; i < 3; i++) far += (p[i] - path.middle[i]) * (p[i] - path.middle[i]);
        return far;
    }
};

// The part of a path that is nearest to a pose, from a first guess on (-1: none), with the parameter on it and the distances.
static inline int64_t nearest_part(const ToolPath* parts, int64_t count, int64_t guess, const double* p, const double* axes, double* away, double& u) {
    int64_t best = guess < 0 ? 0 : guess;
    double least = INFINITY;
    for (int64_t k = 0; k < count && count > 1 && guess < 0; k++) {
        const double far = PathPoint{parts[k]}.squared_from_middle(p) - parts[k].radius * parts[k].radius;
        if (far < least) { least = far; best = k; }
    }
    u = PathPoint{parts[best]}.nearest(p, axes, away);
    const int64_t first = best;
    double score = PathPoint{parts[best]}.score(away), reach = sqrt(score) * parts[best].tolerances[0];
    for (int64_t k = 0; k < count && count > 1; k++) {  // a part is inside its sphere: it could only be nearer if that is
        const PathPoint part{parts[k]};
        const double within = parts[k].radius + reach;
        if (k == first || !(part.squared_from_middle(p) < within * within)) continue;
        double from[2];
        const double there = part.nearest(p, axes, from), own = part.score(from);
        if (!(own < score)) continue;
        u = there; away[0] = from[0]; away[1] = from[1];
        score = own; reach = sqrt(score) * parts[k].tolerances[0];
        best = k;
    }
    return best;
}

// The deviations on four intervals: squares of the distance and of the sine of the angle, and the cosine.
struct Deviations {
    static constexpr int SERIES = 24;  // terms of sin(x) / x and of (1 - cos x) / x^2: enough for turns up to 4 pi
    Vector<Taylor> position, axes[3], away, sines;
    Taylor distance, sine, cosine;
    V3 origin, x, y, turns[POWERS], along[POWERS], start[3];
    V angle, weight[2];
    int degree;
    bool has_circles, has_turns, is_left[W];  // is_left: the tool is all the time where it may leave the path
    double reached[W][3][2];  // at x = -1, 0, 1: distances, or -1 where the path may be left

    void place(const ToolChain& arm, const TurnedBody* bodies) {
        position = constant<Taylor>(arm.tool);
        for (int64_t i = arm.tool_joints - 1; i >= 0; i--) {
            const TurnedBody& body = bodies[i];
            const double* m = body.link->rotation;
            position = body.out(position) + constant<Taylor>(body.link->origin);
            if (body.link->turns == 0.0)
                position = position + Vector<Taylor>{scaled(m[2], body.q), scaled(m[5], body.q), scaled(m[8], body.q)};
        }
    }
    void turn(const ToolChain& arm, const TurnedBody* bodies) {
        for (int k = 0; k < 3; k++) {
            axes[k] = constant<Taylor>(arm.axes + 3 * k);
            for (int64_t i = arm.tool_joints - 1; i >= 0; i--) axes[k] = bodies[i].out(axes[k]);
        }
    }
    static void load(V3& v, int l, const double* from) { v.x[l] = from[0]; v.y[l] = from[1]; v.z[l] = from[2]; }

    // The paths of the lanes, one for each.
    void load(const ToolPath* const* paths) {
        has_circles = false;
        degree = 1;
        for (int l = 0; l < W; l++) {
            const ToolPath& path = *paths[l];
            const bool is_circle = path.angle != 0.0;
            has_circles |= is_circle;
            degree = path.degree > degree ? (int)path.degree : degree;
            const double none[3] = {};
            load(origin, l, path.origin);
            load(x, l, is_circle ? path.along[0] : none);
            load(y, l, is_circle ? path.along[1] : none);
            for (int k = 0; k < POWERS; k++) { load(turns[k], l, path.turns[k]); load(along[k], l, is_circle ? none : path.along[k]); }
            for (int k = 0; k < 3; k++) { start[k].x[l] = path.start[k]; start[k].y[l] = path.start[3 + k]; start[k].z[l] = path.start[6 + k]; }
            angle[l] = path.angle;
            for (int k = 0; k < 2; k++) weight[k][l] = 1.0 / (path.tolerances[k] * path.tolerances[k]);
        }
    }

    void find(const ToolChain& arm, const TurnedBody* bodies, const ToolPath* paths, const PartsOfPath* parts, const Hulls& hulls) {
        has_turns = false;
        place(arm, bodies);
        bool are_left = true;
        for (int l = 0; l < W; l++) {
            is_left[l] = false;
            has_turns |= paths[parts[l].first].tolerances[1] < INFINITY;
        }
        for (int k = 0; k < 2; k++) {
            V3 centre;
            for (int l = 0; l < W; l++) load(centre, l, paths[parts[l].first].left_out[k]);
            const Taylor squared = square(position - constant(centre));
            V most = squared.c[0] + splat(OF_SUMS) * squared.rest + splat(8.0 * UNIT) * squared.size;
            for (int e = 1; e < TERMS; e++) most += magnitude(squared.c[e]);
            for (int l = 0; l < W; l++) {
                const double radius = paths[parts[l].first].left_out[k][3];
                is_left[l] |= radius > 0.0 && most[l] <= radius * radius;
            }
        }
        for (int l = 0; l < W; l++) are_left &= is_left[l];
        if (are_left) return;
        if (has_turns) turn(arm, bodies);
        Taylor u{};
        const ToolPath* own[W];
        for (int l = 0; l < W; l++) {
            const ToolPath* of = paths + parts[l].first;
            double p[3][3], turned[3][9], found[3];
            int64_t part[3];
            for (int which = 0; which < 3; which++) {
                const int n = which == 0 ? 1 : which == 1 ? 0 : 2;  // the middle first, as a guess for the ends
                auto at = [&](const Vector<Taylor>& v, double* to) {
                    const Taylor* of[] = {&v.x, &v.y, &v.z};
                    for (int i = 0; i < 3; i++) {
                        double terms[TERMS];
                        for (int e = 0; e < TERMS; e++) terms[e] = of[i]->c[e][l];
                        to[i] = horner(terms, TERMS, n - 1.0);
                    }
                };
                at(position, p[n]);
                for (int k = 0; k < 3 && has_turns; k++) at(axes[k], turned[n] + 3 * k);
                part[n] = nearest_part(of, parts[l].count, n == 1 ? -1 : part[1], p[n], turned[n], reached[l][n], found[n]);
                // The polynomials are that far from the pose of the tool, at most.
                double rest[2] = {position.x.rest[l] + position.y.rest[l] + position.z.rest[l], 0.0};
                for (int k = 0; k < 3 && has_turns; k++) rest[1] += 2.0 * (axes[k].x.rest[l] + axes[k].y.rest[l] + axes[k].z.rest[l]);
                for (int k = 0; k < 2; k++) reached[l][n][k] -= rest[k] * OF_SUMS;
                for (int k = 0; k < 2; k++) {
                    const double* out = of->left_out[k];
                    double squared = 0.0;
                    for (int i = 0; i < 3; i++) squared += (p[n][i] - out[i]) * (p[n][i] - out[i]);
                    if (sqrt(squared) <= out[3]) reached[l][n][0] = reached[l][n][1] = -1.0;
                }
            }
            own[l] = of + part[1];
            for (int n = 0; n < 3; n++) {
                double away[2];
                if (part[n] != part[1]) found[n] = PathPoint{*own[l]}.nearest(p[n], turned[n], away);
            }
            u.c[0][l] = found[1];
            u.c[1][l] = 0.5 * (found[2] - found[0]);
            u.c[2][l] = 0.5 * (found[2] + found[0]) - found[1];
        }
        load(own);
        for (int k = 0; k < 3; k++) u.size += magnitude(u.c[k]);
        // A Gauss-Newton step for all times at once, then what is left.
        const Vector<Taylor> slope = leave(u);
        V3 rate{};
        for (int k = degree - 1; k >= 0; k--) {
            const V by = splat(k + 1.0);
            rate = {rate.x * u.c[0] + by * turns[k].x, rate.y * u.c[0] + by * turns[k].y, rate.z * u.c[0] + by * turns[k].z};
        }
        const V3 pace{slope.x.c[0], slope.y.c[0], slope.z.c[0]};
        V squared = weight[0] * dot(pace, pace);
        Taylor step = scaled(weight[0], dot(slope, away));
        if (has_turns) {
            squared += weight[1] * dot(rate, rate);
            step = step + scaled(weight[1], dot(rate, sines));
        }
        u = u + scaled(select(squared > splat(0.0), splat(1.0) / squared, splat(0.0)), step);
        // Any choice of parameters will do: the polynomial without the rest, moved between the ends of the path.
        u.rest = u.size = splat(0.0);
        for (int l = 0; l < W; l++) {
            double terms[TERMS], range[TERMS], low = INFINITY, high = -INFINITY;
            for (int e = 0; e < TERMS; e++) terms[e] = u.c[e][l];
            hulls.bernstein(terms, range);
            for (int e = 0; e < TERMS; e++) { low = fmin(low, range[e]); high = fmax(high, range[e]); }
            const double rounding = Hulls::rounding(terms);
            if (low - rounding < 0.0) u.c[0][l] += rounding - low;
            if (high + rounding > 1.0) u.c[0][l] -= high + rounding - 1.0;
            if (!(high - low < 1.0 - 4.0 * rounding))
                for (int e = 0; e < TERMS; e++) u.c[e][l] = e ? 0.0 : 0.5;
        }
        for (int e = 0; e < TERMS; e++) u.size += magnitude(u.c[e]);
        leave(u);
        distance = square(away);
        if (has_turns) sine = square(sines);
    }

    // The polynomial of the powers of u from the first on.
    Vector<Taylor> polynomial(const Taylor& u, const V3* by_power) const {
        Vector<Taylor> sum = times(u, by_power[degree - 1]);
        for (int k = degree - 2; k >= 0; k--) sum = times(u, sum + constant(by_power[k]));
        return sum;
    }

    // What is between the tool and the pose at u: `away`, `sines` and `cosine`. Return the slope of the position.
    Vector<Taylor> leave(const Taylor& u) {
        away = position - constant(origin) - polynomial(u, along);
        Vector<Taylor> slope = constant(along[degree - 1]);
        slope = degree * slope;
        for (int k = degree - 2; k >= 0; k--) slope = times(u, slope) + (k + 1.0) * constant(along[k]);
        if (has_circles) {
            Taylor s, c;
            sine_cosine(scaled(angle, u), s, c);
            away = away - times(c, x) - times(s, y);
            slope = slope + times(scaled(angle, c), y) - times(scaled(angle, s), x);
        }
        if (has_turns) {
            const Vector<Taylor> v = polynomial(u, turns);
            const Taylor z = square(v);
            Taylor a = Taylor{}, b = Taylor{};
            for (int k = SERIES - 1; k >= 0; k--) {  // nested: 1 - z / (2 3) (1 - z / (4 5) (...)), and as much of 1 / 2
                a = number<Taylor>(1.0) - scaled(1.0 / ((2.0 * k + 2.0) * (2.0 * k + 3.0)), z * a);
                b = number<Taylor>(1.0) - scaled(1.0 / ((2.0 * k + 3.0) * (2.0 * k + 4.0)), z * b);
            }
            V tail = splat(1.0);  // what comes after the series, whose signs alternate
            for (int k = 2; k < 2 * SERIES + 2; k += 2) tail = tail * (z.size + z.rest) / splat((k + 0.0) * (k + 1.0));
            a.rest += tail + splat(4.0 * SERIES * UNIT) * a.size;
            b.rest += tail + splat(4.0 * SERIES * UNIT) * b.size;
            b = scaled(0.5, b);
            Vector<Taylor> e[3];
            for (int k = 0; k < 3; k++) {
                const Vector<Taylor> turned{dot(start[0], axes[k]), dot(start[1], axes[k]), dot(start[2], axes[k])};
                const Vector<Taylor> once = cross(v, turned);
                e[k] = turned - times(a, once) + times(b, cross(v, once));
            }
            sines = 0.5 * Vector<Taylor>{e[1].z - e[2].y, e[2].x - e[0].z, e[0].y - e[1].x};
            cosine = scaled(0.5, e[0].x + e[1].y + e[2].z - number<Taylor>(1.0));
        }
        return slope;
    }
};
