// Limits of motions as limits that are linear in a retiming, and a start of the search for the fastest retiming.
#pragma once
#include "polynomials.hpp"
#include "retiming.hpp"

// Limits of joints in rows: lower and upper velocity, middle and half width of the acceleration, (2, rows, joints) each, and
// the jerk (rows, joints). `at` (points) is the row of each point; `width` is the number of rows that are made of them all.
struct JointLimits {
    int64_t points, joints, width;
    const int64_t* at;
    const double *velocity, *acceleration, *jerk;
};

// Rows |by_b b + by_a a + by_c c + offset| <= constant + inverse / sqrt(b) at points, the six of them one behind the other:
// the square of the speed as a share of its limits, or of others (points) unless null; accelerations; jerks.
static inline void set_joint_rows(const JointLimits& limits, int64_t rows, const double* motion, const double* speeds,
                                  double* parts) {
    const int64_t J = limits.joints, N = limits.points, size = limits.width * N;
    double *by_b = parts, *by_a = parts + size, *by_c = parts + 2 * size;
    double *offset = parts + 3 * size, *constant = parts + 4 * size, *inverse = parts + 5 * size;
    const double *first = motion + N * J, *second = motion + 2 * N * J, *third = motion + 3 * N * J;
    for (int64_t r = 0; r < 1 + 2 * J; r++)
        for (int64_t p = 0; p < N; p++) {
            const int64_t i = r * N + p;
            constant[i] = r <= J;
            inverse[i] = r > J;
            by_b[i] = by_a[i] = by_c[i] = offset[i] = 0.0;
        }
    for (int64_t p = 0; p < N; p++) {
        double used = speeds ? speeds[p] : 0.0;
        for (int64_t j = 0; j < J; j++) {
            const int64_t own = limits.at[p] * J + j, i = p * J + j, a = (1 + j) * N + p, c = (1 + J + j) * N + p;
            used = fmax(used, first[i] / limits.velocity[(first[i] < 0.0 ? 0 : rows * J) + own]);
            const double half = limits.acceleration[rows * J + own], jerk = limits.jerk[own];
            by_b[a] = second[i] / half;
            by_a[a] = first[i] / half;
            offset[a] = -limits.acceleration[own] / half;
            by_b[c] = third[i] / jerk;
            by_a[c] = 3.0 * second[i] / jerk;
            by_c[c] = first[i] / jerk;
        }
        by_b[p] = used * used;
    }
}

// The map of `SplineMap`. Beyond both ends there is an interval of no width, whose unknown is the value at the end; where it
// begins evenly, that value is the first Bezier point of the first interval, and its unknown is idle.
static inline void set_spline_maps(int64_t n, const double* widths, bool begins_evenly, double* maps) {
    auto at = [&](int64_t state, int64_t unknown, int64_t g, int64_t i) -> double& {
        return maps[((3 * state + unknown) * SplineMap::GRIDPOINTS + g) * n + i];
    };
    for (int64_t i = 0; i < n; i++) {
        const double own = widths[i], before = i ? widths[i - 1] : 0.0, after = i + 1 < n ? widths[i + 1] : 0.0;
        const double start[3] = {own / (before + own), before / (before + own), 0.0};
        const double end[3] = {0.0, after / (own + after), own / (own + after)};
        const double rise[3] = {-1.0 / (before + own), 1.0 / (before + own), 0.0};
        const double fall[3] = {0.0, -1.0 / (own + after), 1.0 / (own + after)};
        for (int64_t k = 0; k < 3; k++)
            for (int64_t g = 0; g < SplineMap::GRIDPOINTS; g++) {
                const double u = 0.5 * (double)g, middle = k == 1;
                at(0, k, g, i) = (1.0 - u) * (1.0 - u) * start[k] + 2.0 * u * (1.0 - u) * middle + u * u * end[k];
                at(1, k, g, i) = (1.0 - u) * rise[k] + u * fall[k];
                at(2, k, g, i) = (start[k] - 2.0 * middle + end[k]) / (own * own);
            }
    }
    for (int64_t y = 0; begins_evenly && y < 3; y++)
        for (int64_t g = 0; g < SplineMap::GRIDPOINTS; g++) {
            at(y, 1, g, 0) += at(y, 0, g, 0);
            at(y, 0, g, 0) = 0.0;
        }
}

// The time scaling s(t) (pieces, order) after a retiming by unknowns (pieces + 2): lengths (pieces), by Gauss's rule with points
// and weights (2, count), and quintics (pieces, 6) with exact speed and acceleration at the nodes.
static inline void retime_scaling(int64_t n, int64_t order, const double* widths, const double* scaling, const double* x,
                                  int64_t count, const double* gauss, double* lengths, double* quintics) {
    double state[2][4];  // s, s', s'' at the start and at the end of a piece, and b
    auto set = [&](int64_t node, double* at) {
        const double before = node ? widths[node - 1] : 0.0, after = node < n ? widths[node] : 0.0, both = before + after;
        const double b = (after * x[node] + before * x[node + 1]) / both, a = (x[node + 1] - x[node]) / both;
        double law[4];
        if (node < n) taylor(scaling + node * order, order, 0.0, law);
        else taylor(scaling + (n - 1) * order, order, widths[n - 1], law);
        at[0] = law[0];
        at[1] = law[1] * sqrt(b);
        at[2] = law[2] * b + law[1] * a;
        at[3] = b;
    };
    set(0, state[0]);
    for (int64_t i = 0; i < n; i++, quintics += 6) {
        double *start = state[i % 2], *end = state[(i + 1) % 2], sum = 0.0;
        set(i + 1, end);
        for (int64_t k = 0; k < count; k++) {
            const double u = gauss[k], inside = start[3] * (1.0 - u) * (1.0 - u) + 2.0 * u * (1.0 - u) * x[i + 1] + end[3] * u * u;
            sum += gauss[count + k] / sqrt(inside);
        }
        const double h = lengths[i] = sum * widths[i], rise = end[0] - start[0];
        const double v0 = start[1] * h, a0 = start[2] * h * h, v1 = end[1] * h, a1 = end[2] * h * h;
        const double unit[6] = {start[0], v0, a0 / 2.0, 10.0 * rise - 6.0 * v0 - 4.0 * v1 - 1.5 * a0 + 0.5 * a1,
                                -15.0 * rise + 8.0 * v0 + 7.0 * v1 + 1.5 * a0 - a1, 6.0 * rise - 3.0 * (v0 + v1) - 0.5 * (a0 - a1)};
        double power = 1.0;
        for (int64_t k = 0; k < 6; k++, power *= h) quintics[k] = unit[k] / power;
    }
}

// The largest factors (points) on b with which each point keeps its limits; but of powers half the limit is for holding the
// arm and half for the motion.
static inline int set_scales(const RetimingLimits& limits, int64_t points, const double* states, double* scales) {
    const double *b = states, *a = states + points, *c = states + 2 * points;
    Scratch<double> roots(points), jerks(points);
    if (!roots || !jerks) return NO_MEMORY;
    for (int64_t p = 0; p < points; p++) {
        scales[p] = jerks[p] = INFINITY;
        roots[p] = 1.0 / sqrt(b[p]);
    }
    for (int64_t l = 0; l < limits.count; l++)
        for (int64_t p = 0; p < points; p++) {
            const int64_t i = l * points + p;
            const double value = fabs(limits.by_b[i] * b[p] + limits.by_a[i] * a[p] + limits.by_c[i] * c[p]);
            const double held = fabs(limits.offset[i]), bound = limits.inverse[i] * roots[p] * (held > 0.0 ? 0.5 : 1.0);
            const bool grows = limits.inverse[i] > 0.0;
            const double share = (grows ? bound : limits.constant[i] - held) / value, rest = bound / held;
            const double plain = grows ? (held > 0.0 ? rest * rest : (double)INFINITY) : share;
            if (plain < scales[p]) scales[p] = plain;  // not where it is no number: nothing moves and nothing is left
            if (grows && share < jerks[p]) jerks[p] = share;
        }
    for (int64_t p = 0; p < points; p++) scales[p] = fmin(scales[p], cbrt(jerks[p] * jerks[p]));
    return OK;
}

// What a start has to be: at most `largest` times its least; `worth` of the duration of another one. Each is smoothed over a
// reach of intervals on either side.
struct StartRule { double largest, worth; int64_t windows; const int64_t* reaches; };

// The start for the fastest retiming of a slow motion: the largest constant b that limits allow at each gridpoint, the least
// near each interval, smoothed by moving averages; or a constant, if no start is clearly faster.
static inline int smooth_start(const SplineMap& map, const RetimingLimits& limits, const double* weights, const StartRule& rule,
                               double* best) {
    const int64_t n = map.intervals, points = map.points();
    Scratch<double> states(3 * points), scales(points), allowed(n), near(n), average(n), smooth(n + 2);
    if (!states || !scales || !allowed || !near || !average || !smooth) return NO_MEMORY;
    int code = OK;
    auto duration = [&](const double* x) {  // with the largest factor on x
        map.states(x, states.data);
        code |= set_scales(limits, points, states.data, scales.data);
        double least = INFINITY, sum = 0.0;
        for (int64_t p = 0; p < points; p++) least = scales[p] < least ? scales[p] : least;
        for (int64_t p = 0; p < points; p++) sum += weights[p] / sqrt(least * states[p]);
        return sum;
    };
    // One pass over the intervals within a reach of each; those at the ends stand for all beyond.
    auto pass = [&](const double* from, int64_t reach, auto start, auto combine, double* to) {
        for (int64_t i = 0; i < n; i++) {
            double value = start;
            for (int64_t k = i - reach; k <= i + reach; k++) value = combine(value, from[k < 0 ? 0 : k < n ? k : n - 1]);
            to[i] = value;
        }
    };
    auto least_of = [](double x, double y) { return y < x ? y : x; };
    auto sum_of = [](double x, double y) { return x + y; };
    for (int64_t i = 0; i < n + 2; i++) best[i] = 1.0;
    double shortest = duration(best), least = INFINITY;
    for (int64_t i = 0; i < n; i++) {
        allowed[i] = least_of(least_of(scales[i], scales[n + i]), scales[2 * n + i]);
        least = least_of(least, allowed[i]);
    }
    for (int64_t i = 0; i < n; i++) allowed[i] = least_of(allowed[i], rule.largest * least);
    for (int64_t w = 0; w < rule.windows; w++) {
        const int64_t reach = rule.reaches[w];
        pass(allowed.data, 2 * reach, (double)INFINITY, least_of, near.data);
        pass(near.data, reach, 0.0, sum_of, average.data);
        pass(average.data, reach, 0.0, sum_of, near.data);
        const double count = (double)(2 * reach + 1);
        for (int64_t i = 0; i < n + 2; i++) smooth[i] = near[i < 1 ? 0 : i > n ? n - 1 : i - 1] / (count * count);
        const double own = duration(smooth.data);
        if (own < rule.worth * shortest) {
            shortest = own;
            memcpy(best, smooth.data, (n + 2) * sizeof(double));
        }
    }
    return code;
}
