// The fastest profile of the path velocity on intervals of a path, by a backward and a forward pass (Pham and Pham, "A New
// Approach to Time-Optimal Path Parameterization Based on Reachability Analysis", 2018), and how it uses the limits.
//
// x = s'^2 is given at gridpoints. On an interval of length d, u = s'' goes from u - bend to u + bend with
// u = (x1 - x0) / (2 d), so that x at the share p is x0 + (x1 - x0) p - 2 bend d p (1 - p).
#pragma once
#include "vectors.hpp"

constexpr int POINTS = 3, PROBES = 5;
constexpr double PROBE[PROBES] = {0.0, 0.25, 0.5, 0.75, 1.0};
constexpr double AT_PROBE[PROBES][POINTS] = {  // weights of the points in the quadratic through them
    {1.0, 0.0, 0.0}, {0.375, 0.75, -0.125}, {0.0, 1.0, 0.0}, {-0.125, 0.75, 0.375}, {0.0, 0.0, 1.0}};
constexpr double PARALLEL = 1e-10;  // ratio to the largest coefficient of u below which another does not limit u
constexpr double ROUNDING = 1e-13;  // share of the limits on u by which they may miss each other
constexpr double MOST_REST = 0.9999;  // MOST_GRAVITY of planner/backends/toppra/path_limits.py
constexpr double MOST_BEND = 0.9;  // share of the bend with which x would touch 0 within an interval
constexpr double CLOSE = 0.95;  // share of its bound above which x is close to it
constexpr double SERIES = 1e-4;  // square below which the inverse of a tangent is a series of three terms, exact to rounding
constexpr double LEAST_ROOM = 1e-12;  // least difference of an inverse hyperbolic tangent's argument from 1

// Limits |per_u u + per_x x + rest| <= 1 at the start, the middle and the end of intervals, and bounds of x at probes.
struct Limits {
    int64_t intervals, count;
    const double *lengths, *per_u, *per_x, *rest;  // (intervals), then (points, intervals, count)
    const double* bounds;  // (probes, intervals)
    int64_t row(int64_t point, int64_t i) const { return (point * intervals + i) * count; }
    double bound(int probe, int64_t i) const { return bounds[probe * intervals + i]; }
};

// Limits in rows, one for each segment: centred ones by middle and half width, of velocities by both sides; and shares of the
// path velocity (probes, intervals) that other limits allow, or null. The numbers are the largest share of a limit that is
// taken by rest, the least share of the velocity, and the largest ratio of the bounds of an interval.
struct LimitRows {
    int64_t joints, rows;
    const double *middle, *half, *lower, *upper;  // (segments, joints): of acceleration, of velocity
    const double *by_u, *by_x, *rest, *row_middle, *row_half;  // (points, intervals, rows), then (segments, rows)
    const double *used, *numbers;
};

// The limits on u and x on intervals with derivatives (probes, intervals, joints) of their curves by s, with times as long as
// the roots of `slower` (intervals) tell.
static inline void set_limits(const LimitRows& given, int64_t intervals, const int64_t* segments, const double* first,
                              const double* second, const double* slower, double* per_u, double* per_x, double* rest,
                              double* bounds) {
    const int64_t J = given.joints, R = given.rows;
    const double most_rest = given.numbers[0], least_used = given.numbers[1], most_ratio = given.numbers[2];
    for (int64_t point = 0; point < POINTS; point++)
        for (int64_t i = 0; i < intervals; i++, per_u += J + R, per_x += J + R, rest += J + R) {
            const int64_t at = (2 * point * intervals + i) * J, row = (point * intervals + i) * R, own = segments[i];
            for (int64_t j = 0; j < J; j++) {
                const double half = given.half[own * J + j];
                per_u[j] = first[at + j] / half * slower[i];
                per_x[j] = second[at + j] / half * slower[i];
                rest[j] = -given.middle[own * J + j] / half;
            }
            for (int64_t r = 0; r < R; r++) {
                const double half = given.row_half[own * R + r];
                per_u[J + r] = given.by_u[row + r] / half * slower[i];
                per_x[J + r] = given.by_x[row + r] / half * slower[i];
                rest[J + r] = fmin(fmax((given.rest[row + r] - given.row_middle[own * R + r]) / half, -most_rest), most_rest);
            }
        }
    for (int64_t i = 0; i < intervals; i++) {
        double least = INFINITY;
        for (int64_t p = 0; p < PROBES; p++) {
            double used = least_used;
            for (int64_t j = 0; j < J; j++) {
                const double v = first[(p * intervals + i) * J + j];
                used = fmax(used, v / (v < 0.0 ? given.lower : given.upper)[segments[i] * J + j]);
            }
            if (given.used) used = fmax(used, given.used[p * intervals + i]);
            bounds[p * intervals + i] = 1.0 / (used * used);
            least = fmin(least, bounds[p * intervals + i]);
        }
        for (int64_t p = 0; p < PROBES; p++)
            bounds[p * intervals + i] = fmin(bounds[p * intervals + i], most_ratio * least) / slower[i];
    }
}

// A limit on u as a function of x: within `radius` of offset + slope x.
struct Band { double offset, slope, radius; };

// The limits on one interval: those on u as bands, bounds of x at the inner probes, and all others as one bound of x.
struct Stage { Band* bands; int64_t count; double length, most, speeds[PROBES]; };

// The least and the largest u that keep the limits at x, and how they change with x.
struct Range { double low, low_slope, high, high_slope; };

static inline Range range_of_u(const Stage& stage, double x, double next) {
    const double slope = -0.5 / stage.length;
    Range range{x * slope, slope, (x - next) * slope, slope};  // the next x is between 0 and `next`
    for (int p = 1; p < PROBES - 1; p++) {
        const double own = slope / PROBE[p], high = (x - stage.speeds[p]) * own;
        if (high < range.high) { range.high = high; range.high_slope = own; }
    }
    for (int64_t k = 0; k < stage.count; k++) {
        const Band& band = stage.bands[k];
        const double middle = band.offset + band.slope * x, low = middle - band.radius, high = middle + band.radius;
        if (high < range.high) { range.high = high; range.high_slope = band.slope; }
        if (low > range.low) { range.low = low; range.low_slope = band.slope; }
    }
    return range;
}

// The largest x from which some u leads to the next x or less. The room high - low is concave in x, piecewise linear, and
// not negative at x = 0, as standing still keeps every limit: Newton's steps go down to its root, piece by piece.
static inline double largest_x(const Stage& stage, double x, double next) {
    while (x > 0.0) {
        const Range range = range_of_u(stage, x, next);
        const double room = range.high - range.low, slope = range.high_slope - range.low_slope;
        if (room >= -ROUNDING * (fabs(range.high) + fabs(range.low))) break;
        const double lower = x - room / slope;
        if (!(slope < 0.0 && lower > 0.0)) return 0.0;
        if (lower >= x) break;
        x = lower;
    }
    return x;
}

// What has to hold of x at the start of an interval and of the mean u on it. Where u follows a limit along the interval, it
// is enough that the mean keeps the limit in the middle, and x may follow a bound that dips below the straight line between
// those at the ends. Where limits hold throughout, u is constant and keeps their Bernstein coefficients, which bound them.
static inline void set_stage(Stage& stage, const Limits& l, int64_t i, bool throughout) {
    stage.length = l.lengths[i];
    stage.count = 0;
    stage.most = INFINITY;
    for (int p = 0; p < PROBES; p++) {
        const double straight = l.bound(0, i) + (l.bound(PROBES - 1, i) - l.bound(0, i)) * PROBE[p];
        stage.speeds[p] = throughout ? l.bound(p, i) : fmax(l.bound(p, i), straight);
    }
    double largest = 0.0;
    auto row = [&](int64_t point, int64_t k, double& a, double& b, double& c) {
        const int64_t at = l.row(point, i) + k;
        a = l.per_u[at] + 0.5 * (double)point * 2.0 * stage.length * l.per_x[at];
        b = l.per_x[at];
        c = l.rest[at];
    };
    auto add = [&](double a, double b, double c) {
        c = fmin(fmax(c, -MOST_REST), MOST_REST);
        if (fabs(a) > PARALLEL * largest) stage.bands[stage.count++] = {-c / a, -b / a, 1.0 / fabs(a)};
        else if (b != 0.0) stage.most = fmin(stage.most, (1.0 - (b > 0.0 ? c : -c)) / fabs(b));
    };
    double a[POINTS], b[POINTS], c[POINTS];
    for (int pass = 0; pass < 2; pass++)  // the largest coefficient first
        for (int64_t k = 0; k < l.count; k++) {
            for (int p = throughout ? 0 : 1; p < (throughout ? 3 : 2); p++) row(p, k, a[p], b[p], c[p]);
            if (throughout) {
                a[1] = 2.0 * a[1] - 0.5 * (a[0] + a[2]);
                b[1] = 2.0 * b[1] - 0.5 * (b[0] + b[2]);
                c[1] = 2.0 * c[1] - 0.5 * (c[0] + c[2]);
            }
            for (int p = throughout ? 0 : 1; p < (throughout ? 3 : 2); p++) {
                if (pass == 0) largest = fmax(largest, fabs(a[p]));
                else add(a[p], b[p], c[p]);
            }
        }
}

// The fastest profile: of the largest x at each gridpoint (intervals + 1) from which the rest can be braked in time the
// largest that can be reached by accelerating. x is 0 at rests.
static inline int fastest_profile(const Limits& l, const int64_t* throughout, const int64_t* rests, double* x) {
    int64_t bands = 0;
    for (int64_t i = 0; i < l.intervals; i++) bands += throughout[i] ? POINTS * l.count : l.count;
    Scratch<Band> memory(bands);
    Scratch<Stage> stages(l.intervals);
    if (!memory || !stages) return NO_MEMORY;
    Band* next = memory.data;
    for (int64_t i = 0; i < l.intervals; next += stages[i++].count) {
        stages[i].bands = next;
        set_stage(stages[i], l, i, throughout[i]);
    }
    x[l.intervals] = 0.0;
    for (int64_t i = l.intervals - 1; i >= 0; i--) {
        const double before = i ? l.bound(PROBES - 1, i - 1) : INFINITY;
        x[i] = rests[i] ? 0.0 : largest_x(stages[i], fmin(fmin(l.bound(0, i), before), stages[i].most), x[i + 1]);
    }
    for (int64_t i = 0; i < l.intervals; i++) {
        const double u = range_of_u(stages[i], x[i], x[i + 1]).high;
        x[i + 1] = fmin(fmax(x[i] + 2.0 * l.lengths[i] * u, 0.0), x[i + 1]);
    }
    return OK;
}

// The least and the largest u at a point where x is given.
static inline void range_at(const Limits& l, int64_t point, int64_t i, double x, double& low, double& high) {
    const int64_t row = l.row(point, i);
    double size = 0.0;
    for (int64_t k = 0; k < l.count; k++) size = fmax(size, fabs(l.per_u[row + k]));
    low = -INFINITY;
    high = INFINITY;
    for (int64_t k = 0; k < l.count; k++) {
        const double a = l.per_u[row + k];
        if (!(fabs(a) > PARALLEL * size)) continue;
        const double middle = -(l.per_x[row + k] * x + l.rest[row + k]) / a, reach = 1.0 / fabs(a);
        low = fmax(low, middle - reach);
        high = fmin(high, middle + reach);
    }
}

// The largest shares (probes) that a motion takes of what rest leaves of a limit. `shares` has room for one of each limit.
static inline void used_at_probes(const Limits& l, int64_t i, double x0, double x1, double bend, double* __restrict shares,
                                  double* used) {
    for (int p = 0; p < PROBES; p++) {
        const double d = l.lengths[i], u = (x1 - x0) / (2.0 * d) + bend * (2.0 * PROBE[p] - 1.0);
        const double x = x0 + (x1 - x0) * PROBE[p] - 2.0 * bend * d * (PROBE[p] - PROBE[p] * PROBE[p]);
        for (int64_t k = 0; k < l.count; k++) {
            double moved = 0.0, rest = 0.0;
            for (int point = 0; point < POINTS; point++) {
                const int64_t at = l.row(point, i) + k;
                moved += AT_PROBE[p][point] * (l.per_u[at] * u + l.per_x[at] * x);
                rest += AT_PROBE[p][point] * l.rest[at];
            }
            shares[k] = fabs(moved) / (moved < 0.0 ? 1.0 + rest : 1.0 - rest);
        }
        used[p] = 0.0;
        for (int64_t k = 0; k < l.count; k++) used[p] = shares[k] > used[p] ? shares[k] : used[p];
    }
}

// The bend that keeps the limits at the ends, near 0 and with room at both, or else breaks them the least; no more than the
// bounds of x ask for, as it costs time, and so that x stays positive.
static inline double best_bend(const Limits& l, int64_t i, double x0, double x1) {
    const double d = l.lengths[i], u = (x1 - x0) / (2.0 * d);
    double low0, high0, low1, high1, for_speed = -INFINITY;
    range_at(l, 0, i, x0, low0, high0);
    range_at(l, POINTS - 1, i, x1, low1, high1);
    const double least = fmax(u - high0, low1 - u), most = fmin(u - low0, high1 - u);
    const double middle = isinf(least) || isinf(most) ? 0.0 : (least + most) / 2.0;
    const double twice = 2.0 * fmin(fmax(0.0, least), most);
    const double bend = least > most ? middle : fmin(fmax(middle, fmin(twice, 0.0)), fmax(twice, 0.0));
    for (int p = 1; p < PROBES - 1; p++)
        for_speed = fmax(for_speed, (x0 + (x1 - x0) * PROBE[p] - l.bound(p, i)) / (2.0 * d * (PROBE[p] - PROBE[p] * PROBE[p])));
    const double speeds = sqrt(x0) + sqrt(x1);
    return fmin(fmax(bend, for_speed), MOST_BEND * speeds * speeds / (2.0 * d));
}

// How an interval uses its limits: the largest share with its bend; where u is constant the share of the tightest limit that
// this leaves unused, on average; and by how much x may exceed its bound between probes where it is close to it.
struct Use { double used, unused, dips; };

static inline Use use_of_limits(const Limits& l, int64_t i, bool constant, double x0, double x1, double bend, double* shares) {
    Use use{};
    double at[PROBES], bound[PROBES];
    bool close[PROBES];
    used_at_probes(l, i, x0, x1, bend, shares, at);
    for (int p = 0; p < PROBES; p++) {
        bound[p] = l.bound(p, i);
        const double inner = PROBE[p] * (1.0 - PROBE[p]), straight = x0 + (x1 - x0) * PROBE[p];
        if (p > 0 && p < PROBES - 1) at[p] = fmax(at[p], (straight - 2.0 * bend * l.lengths[i] * inner) / bound[p]);
        use.used = fmax(use.used, at[p]);
        if (constant) use.unused += fmax(1.0 - fmax(at[p], straight / bound[p]), 0.0) / PROBES;
        close[p] = straight > CLOSE * bound[p];
    }
    for (int p = 1; p < PROBES - 1; p++)
        if (close[p - 1] || close[p] || close[p + 1])
            use.dips = fmax(use.dips, (bound[p - 1] - 2.0 * bound[p] + bound[p + 1]) / bound[p] / 8.0);
    return use;
}

// The time from one share of an interval to another. With s'' = b s + constant the distance is
// (v0 + v1) tanh(sqrt(b) T / 2) / sqrt(b), and with b < 0 the same with the tangent.
static inline double time_between(double length, double x0, double x1, double bend, double start, double end) {
    auto speed = [&](double p) { return sqrt(x0 * (1.0 - p) + x1 * p - 2.0 * p * (1.0 - p) * bend * length); };
    const double ratio = (end - start) * length / (speed(start) + speed(end)), square = 2.0 * bend / length * ratio * ratio;
    if (fabs(square) < SERIES) return 2.0 * ratio * (1.0 + square / 3.0 + square * square / 5.0);
    const double root = sqrt(fabs(square));
    return 2.0 * ratio * (square > 0.0 ? atanh(fmin(root, 1.0 - LEAST_ROOM)) : atan(root)) / root;
}

// The numbers of SPLITTING in planner/backends/toppra/profile.py.
struct Splitting { double neglected, stuck, waste, steepest, least_share, tolerated, mended, parts; };

// The time in which an interval could be crossed by gaining speed, going on at the highest and braking again, and the shares
// at which these meet.
struct Crossing { double time, gained, braked; };

static inline Crossing fastest_crossing(const Limits& l, int64_t i, double x0, double x1, double steepest) {
    const double d = l.lengths[i], u = (x1 - x0) / (2.0 * d);
    double top = 0.0, low, high, speed[PROBES], time = 0.0;
    for (int p = 0; p < PROBES; p++) top = fmax(top, l.bound(p, i));
    const double least = top / d / steepest, most = steepest * top / d;
    range_at(l, 0, i, x0, low, high);
    const double gain = fmin(fmax(high, fmax(u, least)), most);
    range_at(l, POINTS - 1, i, x1, low, high);
    const double brake = fmin(fmax(-low, fmax(-u, least)), most);
    for (int p = 0; p < PROBES; p++)
        speed[p] = sqrt(fmin(fmin(x0 + 2.0 * d * gain * PROBE[p], x1 + 2.0 * d * brake * (1.0 - PROBE[p])), l.bound(p, i)));
    for (int p = 0; p + 1 < PROBES; p++) time += 2.0 * (PROBE[p + 1] - PROBE[p]) * d / (speed[p] + speed[p + 1]);
    const double peak = (u + brake) / (gain + brake);
    return {time, fmin(fmax((top - x0) / (2.0 * d * gain), 0.0), peak),
            fmin(fmax(1.0 - (top - x1) / (2.0 * d * brake), peak), 1.0)};
}

// The shares at which an interval is split into the phases of its fastest crossing, none of them very short.
static inline int phases(Crossing at, double least, double* inner) {
    double shares[2] = {at.gained, at.braked};
    for (double& share : shares) share = share < least ? 0.0 : share > 1.0 - least ? 1.0 : share;
    if (shares[1] - shares[0] < least) shares[1] = 1.0;
    if (shares[0] == 0.0 && shares[1] == 1.0) shares[0] = 0.5;
    int count = 0;
    for (double share : shares)
        if (share > 0.0 && share < 1.0) inner[count++] = share;
    return count;
}

// The next intervals: parts of these, from one share of their row to another, and whether u is to be constant on them.
struct Parts {
    int64_t count, *rows;
    double *starts, *ends;
    int64_t* constant;
    void add(int64_t row, double start, double end, bool is_constant) {
        rows[count] = row; starts[count] = start; ends[count] = end; constant[count++] = is_constant;
    }
};

// Find the bends of a profile, and the intervals for another solution; no parts: it is the last one. Intervals that break
// limits, or lose time, are split, the first time in any case; or u becomes constant on them.
static inline int judge_profile(const Limits& l, const Splitting& rule, const int64_t* constant, const int64_t* groups,
                                const double* x, bool may_split, bool is_first, double* bends, Parts& next) {
    Scratch<double> shares(l.count), times(l.intervals), sums(l.intervals), numbers(l.intervals);
    Scratch<Use> uses(l.intervals);
    if (!shares || !times || !sums || !numbers || !uses) return NO_MEMORY;
    double whole = 0.0, wasted = 0.0, stuck = 0.0;
    bool any_broken = false;
    auto broken = [&](int64_t i) { return uses[i].used > rule.tolerated && !constant[i]; };
    auto hopeless = [&](int64_t i) { return broken(i) && uses[i].used > rule.mended; };
    for (int64_t i = 0; i < l.intervals; i++) sums[i] = numbers[i] = 0.0;
    for (int64_t i = 0; i < l.intervals; i++) {
        bends[i] = constant[i] ? 0.0 : best_bend(l, i, x[i], x[i + 1]);
        uses[i] = use_of_limits(l, i, constant[i], x[i], x[i + 1], bends[i], shares.data);
        times[i] = time_between(l.lengths[i], x[i], x[i + 1], bends[i], 0.0, 1.0);
        sums[groups[i]] += times[i];
        numbers[groups[i]] += 1.0;
        whole += times[i];
        wasted += uses[i].unused * times[i];
        if (hopeless(i)) stuck += times[i];
        any_broken |= broken(i);
    }
    next.count = 0;
    const bool splits = may_split && (is_first || wasted > rule.neglected * whole || stuck > rule.stuck * whole);
    if (!splits && !any_broken) return OK;
    for (int64_t i = 0; i < l.intervals; i++) {
        const double worth = rule.waste * sums[groups[i]] / numbers[groups[i]];
        double inner[2] = {};
        int cuts = 0;
        if (splits) {
            if (broken(i) || uses[i].dips > rule.tolerated - 1.0 || uses[i].unused * times[i] > worth) {
                for (double k = 0.0; k < rule.parts; k += 1.0) next.add(i, k / rule.parts, (k + 1.0) / rule.parts, hopeless(i));
                continue;
            }
            const Crossing at = fastest_crossing(l, i, x[i], x[i + 1], rule.steepest);
            if (times[i] - at.time > worth) cuts = phases(at, rule.least_share, inner);
        }
        if (!cuts) next.add(i, 0.0, 1.0, constant[i] || broken(i));
        for (int k = 0; cuts && k <= cuts; k++) next.add(i, k ? inner[k - 1] : 0.0, k < cuts ? inner[k] : 1.0, false);
    }
    if (splits && next.count == l.intervals) next.count = 0;  // nothing is split
    return OK;
}
