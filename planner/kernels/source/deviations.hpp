// How far the tool is from a requested line or circle on four intervals, as Taylor models. A parameter of the path is chosen
// for every time; whichever it is, the tool is no farther from the path than from the pose there.
#pragma once
#include "enclosures.hpp"
#include "hulls.hpp"

// A serial chain, and the tool in the frame of the last of the joints that move it: its point, and its axes behind each other.
struct ToolChain { int64_t joints, tool_joints; const double *links, *load, *tool, *axes; };

struct ToolPath {  // PATH_NUMBERS of planner/kernels/bounded_peaks.py
    double angle, start[9], turns[6], origin[3], x[3], y[3], tolerances[2], left_out[2][4];
};

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
static inline Taylor select(VI mask, const Taylor& a, const Taylor& b) {
    Taylor t;
    for (int k = 0; k < TERMS; k++) t.c[k] = select(mask, a.c[k], b.c[k]);
    t.size = select(mask, a.size, b.size);
    t.rest = select(mask, a.rest, b.rest);
    return t;
}

// A path and its geometry at single parameters.
struct PathPoint {
    const ToolPath& path;
    void position(double u, double* p, double* slope) const {
        const double c = path.angle != 0.0 ? cos(path.angle * u) : u, s = path.angle != 0.0 ? sin(path.angle * u) : 0.0;
        const double dc = path.angle != 0.0 ? -path.angle * s : 1.0, ds = path.angle != 0.0 ? path.angle * c : 0.0;
        for (int i = 0; i < 3; i++) {
            p[i] = path.origin[i] + c * path.x[i] + s * path.y[i];
            slope[i] = dc * path.x[i] + ds * path.y[i];
        }
    }
    // The turn of the tool (3) that is left at u, in its axes, from its axes (9, one behind the other), and their slope.
    void turn(double u, const double* axes, double* left, double* slope) const {
        double v[3], squared = 0.0;
        for (int i = 0; i < 3; i++) {
            v[i] = u * (path.turns[i] + u * path.turns[3 + i]);
            slope[i] = path.turns[i] + 2.0 * u * path.turns[3 + i];
            squared += v[i] * v[i];
        }
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
        double x = 0.0, y = 0.0, xx = 0.0, u = 0.5;
        for (int i = 0; i < 3; i++) {
            x += (p[i] - path.origin[i]) * path.x[i];
            y += (p[i] - path.origin[i]) * path.y[i];
            xx += path.x[i] * path.x[i];
        }
        if (path.angle != 0.0) {
            const double angle = fmod(atan2(y, x) + 2.0 * M_PI, 2.0 * M_PI);
            u = angle <= path.angle ? angle / path.angle : angle < 0.5 * path.angle + M_PI ? 1.0 : 0.0;
        } else if (xx > 0.0) u = fmin(fmax(x / xx, 0.0), 1.0);
        for (int step = 0;; step++) {
            double at[3], slope[3], turned[3] = {}, turning[3], along = 0.0, squared = 0.0;
            position(u, at, slope);
            away[0] = away[1] = 0.0;
            for (int i = 0; i < 3; i++) {
                away[0] += (p[i] - at[i]) * (p[i] - at[i]);
                along += (p[i] - at[i]) * slope[i] / (path.tolerances[0] * path.tolerances[0]);
                squared += slope[i] * slope[i] / (path.tolerances[0] * path.tolerances[0]);
            }
            if (turns()) {
                turn(u, axes, turned, turning);
                for (int i = 0; i < 3; i++) {
                    away[1] += turned[i] * turned[i];
                    along += turned[i] * turning[i] / (path.tolerances[1] * path.tolerances[1]);
                    squared += turning[i] * turning[i] / (path.tolerances[1] * path.tolerances[1]);
                }
            }
            if (step == 3 || !(squared > 0.0)) break;
            u = fmin(fmax(u + along / squared, 0.0), 1.0);
        }
        for (int k = 0; k < 2; k++) away[k] = sqrt(away[k]);
        return u;
    }
};

// The deviations on four intervals: squares of the distance and of the sine of the angle, and the cosine.
struct Deviations {
    static constexpr int SERIES = 24;  // terms of sin(x) / x and of (1 - cos x) / x^2: enough for turns up to 4 pi
    Vector<Taylor> position, axes[3], away, sines;
    Taylor distance, sine, cosine;
    V3 origin, x, y, first, second, start[3];
    V angle, weight[2];
    VI circular;
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

    void find(const ToolChain& arm, const TurnedBody* bodies, const ToolPath* const* paths, const Hulls& hulls) {
        has_circles = has_turns = false;
        for (int l = 0; l < W; l++) {
            const ToolPath& path = *paths[l];
            has_circles |= path.angle != 0.0;
            has_turns |= path.tolerances[1] < INFINITY;
            load(origin, l, path.origin); load(x, l, path.x); load(y, l, path.y);
            load(first, l, path.turns); load(second, l, path.turns + 3);
            for (int k = 0; k < 3; k++) { start[k].x[l] = path.start[k]; start[k].y[l] = path.start[3 + k]; start[k].z[l] = path.start[6 + k]; }
            angle[l] = path.angle;
            for (int k = 0; k < 2; k++) weight[k][l] = 1.0 / (path.tolerances[k] * path.tolerances[k]);
        }
        circular = angle != 0.0;
        place(arm, bodies);
        bool are_left = true;
        for (int l = 0; l < W; l++) is_left[l] = false;
        for (int k = 0; k < 2; k++) {
            V3 centre;
            for (int l = 0; l < W; l++) load(centre, l, paths[l]->left_out[k]);
            const Taylor squared = square(position - constant(centre));
            V most = squared.c[0] + splat(OF_SUMS) * squared.rest + splat(8.0 * UNIT) * squared.size;
            for (int e = 1; e < TERMS; e++) most += magnitude(squared.c[e]);
            for (int l = 0; l < W; l++) {
                const double radius = paths[l]->left_out[k][3];
                is_left[l] |= radius > 0.0 && most[l] <= radius * radius;
            }
        }
        for (int l = 0; l < W; l++) are_left &= is_left[l];
        if (are_left) return;
        if (has_turns) turn(arm, bodies);
        Taylor u{};
        for (int l = 0; l < W; l++) {
            double found[3];
            for (int n = 0; n < 3; n++) {
                double p[3], turned[9];
                auto at = [&](const Vector<Taylor>& v, double* to) {
                    const Taylor* of[] = {&v.x, &v.y, &v.z};
                    for (int i = 0; i < 3; i++) {
                        double terms[TERMS];
                        for (int e = 0; e < TERMS; e++) terms[e] = of[i]->c[e][l];
                        to[i] = horner(terms, TERMS, n - 1.0);
                    }
                };
                at(position, p);
                for (int k = 0; k < 3 && has_turns; k++) at(axes[k], turned + 3 * k);
                found[n] = PathPoint{*paths[l]}.nearest(p, turned, reached[l][n]);
                for (int k = 0; k < 2; k++) {
                    const double* out = paths[l]->left_out[k];
                    double squared = 0.0;
                    for (int i = 0; i < 3; i++) squared += (p[i] - out[i]) * (p[i] - out[i]);
                    if (sqrt(squared) <= out[3]) reached[l][n][0] = reached[l][n][1] = -1.0;
                }
            }
            u.c[0][l] = found[1];
            u.c[1][l] = 0.5 * (found[2] - found[0]);
            u.c[2][l] = 0.5 * (found[2] + found[0]) - found[1];
        }
        for (int k = 0; k < 3; k++) u.size += magnitude(u.c[k]);
        // A Gauss-Newton step for all times at once, then what is left.
        const Vector<Taylor> slope = leave(u);
        const V twice = splat(2.0) * u.c[0];
        const V3 rate{first.x + twice * second.x, first.y + twice * second.y, first.z + twice * second.z};
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

    // What is between the tool and the pose at u: `away`, `sines` and `cosine`. Return the slope of the position.
    Vector<Taylor> leave(const Taylor& u) {
        Taylor c = u, s = Taylor{}, dc = number<Taylor>(1.0), ds = Taylor{};
        if (has_circles) {
            Taylor of_s, of_c;
            sine_cosine(scaled(angle, u), of_s, of_c);
            c = select(circular, of_c, c);
            s = select(circular, of_s, s);
            dc = select(circular, scaled(-angle, of_s), dc);
            ds = select(circular, scaled(angle, of_c), ds);
        }
        away = position - constant(origin) - times(c, x);
        Vector<Taylor> slope = times(dc, x);
        if (has_circles) { away = away - times(s, y); slope = slope + times(ds, y); }
        if (has_turns) {
            const Vector<Taylor> v = times(u, first) + times(u * u, second);
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
